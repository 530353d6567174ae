//! Groups of springs that lie alike in the grid of the nodes.
//!
//! The step of a spring in the grid, such as (1, -1, 0), is its direction on the body as the body was made: on a curved body it
//! turns with the grid. Mirrored steps, (1, 1, 0) and (1, -1, 0), are one group of `direction_and_multiplicity`, so that a
//! body that is its own mirror image stays so; springs at the boundary, which belong to fewer cells, are groups of their own.

use std::cmp::Reverse;

use crate::error::{Error, Result};

use super::super::network::{Kind, Network, Spring};
use super::{Grouping, Request, collect};

pub(super) fn by_kind(network: &Network, _request: &Request) -> Result<Grouping> {
    let rank: Vec<usize> = network.springs.iter().map(|spring| spring.kind as usize).collect();
    Ok(collect(network, &rank, &Kind::ALL.map(|kind| kind.name().to_owned())))
}

pub(super) fn by_direction(network: &Network, _request: &Request) -> Result<Grouping> {
    on_a_grid(network, "direction")?;
    let key = |spring: &Spring| (spring.kind, Reverse(spring.offset));
    Ok(by_key(network, key, |(_, Reverse(offset))| step_name(*offset, network.dimension)))
}

pub(super) fn by_direction_and_multiplicity(network: &Network, _request: &Request) -> Result<Grouping> {
    on_a_grid(network, "direction_and_multiplicity")?;
    let key = |spring: &Spring| (spring.kind, Reverse(spring.offset.map(|step| step.unsigned_abs())), spring.cells);
    let name = |(_, Reverse(step), cells): &(Kind, Reverse<[u8; 3]>, u32)| {
        let digits: Vec<String> = step[..network.dimension].iter().map(u8::to_string).collect();
        format!("{}x{cells}", digits.join(""))
    };
    Ok(by_key(network, key, name))
}

pub(super) fn each(network: &Network, _request: &Request) -> Result<Grouping> {
    let rank: Vec<usize> = (0..network.springs.len()).collect();
    let names: Vec<String> = rank.iter().map(|s| format!("spring_{s}")).collect();
    Ok(collect(network, &rank, &names))
}

/// One group for each different key, in the order of the keys.
fn by_key<K: Ord>(network: &Network, key: impl Fn(&Spring) -> K, name: impl Fn(&K) -> String) -> Grouping {
    let mut keys: Vec<K> = network.springs.iter().map(&key).collect();
    keys.sort_unstable();
    keys.dedup();
    let rank: Vec<usize> = network.springs.iter().map(|spring| keys.partition_point(|k| *k < key(spring))).collect();
    collect(network, &rank, &keys.iter().map(name).collect::<Vec<_>>())
}

/// Refuses springs that have no step in a grid.
fn on_a_grid(network: &Network, name: &str) -> Result<()> {
    if network.springs.iter().all(|spring| spring.offset != [0; 3]) {
        return Ok(());
    }
    let help = "use length, kind, kind_and_length, k_means, sets or each on a mesh without a grid";
    Err(Error::input("springs.grouping", format!("\"{name}\" needs nodes on a grid"), help))
}

/// Name of a grid step: one sign for each direction, such as `+0-`; longer steps with their length, `+2+0`.
fn step_name(offset: [i8; 3], dimension: usize) -> String {
    let signs = offset[..dimension].iter().map(|&step| match step {
        1 => "+".to_owned(),
        0 => "0".to_owned(),
        -1 => "-".to_owned(),
        longer => format!("{longer:+}"),
    });
    signs.collect()
}
