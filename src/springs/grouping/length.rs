//! Groups of similar rest length (4.11-4.13), with 0 < gamma < 1.
//!
//! The lengths are swept in descending order. Lengths equal to 1e-9 (relative) are one block. A block joins the current
//! group if every member then lies inside
//!
//! ```text
//! [ l (1 - gamma), l (1 + gamma) ],     l = mean rest length of the group with the block
//! ```
//!
//! and starts a new group otherwise. The groups are numbered from the shortest.

use rayon::prelude::*;

use crate::error::{Error, Result};

use super::super::network::{Kind, Network};
use super::{Grouping, Request, collect};

/// Lengths that differ by less than this part are equal.
const SAME_LENGTH: f64 = 1e-9;

pub(super) fn by_length(network: &Network, request: &Request) -> Result<Grouping> {
    let gamma = legal_gamma(request)?;
    let all: Vec<usize> = (0..network.springs.len()).collect();
    let (rank, count) = sweep(network, all, gamma);
    Ok(collect(network, &rank, &(1..=count).map(|a| format!("length_{a}")).collect::<Vec<_>>()))
}

pub(super) fn by_kind_and_length(network: &Network, request: &Request) -> Result<Grouping> {
    let gamma = legal_gamma(request)?;
    let mut rank = vec![0; network.springs.len()];
    let mut names = Vec::new();
    for kind in Kind::ALL {
        let members: Vec<usize> = (0..rank.len()).filter(|&s| network.springs[s].kind == kind).collect();
        let (within, count) = sweep(network, members.clone(), gamma);
        for s in members {
            rank[s] = names.len() + within[s];
        }
        names.extend((1..=count).map(|a| format!("{}_{a}", kind.name())));
    }
    Ok(collect(network, &rank, &names))
}

/// The gamma of a request, between 0 and 1.
fn legal_gamma(&Request { gamma, .. }: &Request) -> Result<f64> {
    if gamma > 0.0 && gamma < 1.0 {
        return Ok(gamma);
    }
    Err(Error::input("calibration.gamma", format!("gamma is {gamma}"), "gamma lies between 0 and 1, both excluded"))
}

/// A group while the sweep fills it.
struct Open {
    longest: f64,
    sum: f64,
    count: usize,
}

impl Open {
    /// Takes a block in if every member then lies near enough to the mean.
    fn admit(&mut self, block: &[f64], gamma: f64) -> bool {
        let (sum, count) = (self.sum + block.iter().sum::<f64>(), self.count + block.len());
        let (mean, shortest) = (sum / count as f64, block[block.len() - 1]);
        let inside = shortest >= mean * (1.0 - gamma) * (1.0 - SAME_LENGTH)
            && self.longest <= mean * (1.0 + gamma) * (1.0 + SAME_LENGTH);
        if inside {
            (self.sum, self.count) = (sum, count);
        }
        inside
    }
}

/// The descending sweep over some springs: the number of the group of each (from the shortest; 0 for the springs that
/// do not take part), and how many groups there are.
fn sweep(network: &Network, members: Vec<usize>, gamma: f64) -> (Vec<usize>, usize) {
    // a length is not negative, so its bits are in its order; flipped, the longest comes first
    let key = |&s: &usize| (!network.springs[s].length.to_bits(), s);
    let mut sorted: Vec<(u64, usize)> = members.par_iter().map(key).collect();
    sorted.par_sort_unstable();
    let lengths: Vec<f64> = sorted.iter().map(|(key, _)| f64::from_bits(!key)).collect();
    let mut from_longest = vec![0; lengths.len()];
    let mut groups = 0;
    let mut open = Open { longest: 0.0, sum: 0.0, count: 0 };
    let mut start = 0;
    while start < lengths.len() {
        let end = start + lengths[start..].iter().take_while(|&&l| l >= lengths[start] * (1.0 - SAME_LENGTH)).count();
        let block = &lengths[start..end];
        if groups == 0 || !open.admit(block, gamma) {
            open = Open { longest: block[0], sum: block.iter().sum(), count: block.len() };
            groups += 1;
        }
        from_longest[start..end].fill(groups);
        start = end;
    }
    let mut number = vec![0; network.springs.len()];
    for ((_, s), group) in sorted.into_iter().zip(from_longest) {
        number[s] = groups - group;
    }
    (number, groups)
}
