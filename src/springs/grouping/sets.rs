//! Groups that the scene names: a spring belongs to the first set that has both its ends, otherwise to "rest".

use crate::error::{Error, Result};

use super::super::network::{Network, Spring};
use super::{Grouping, Request, collect};

pub(super) fn by_sets(network: &Network, request: &Request) -> Result<Grouping> {
    if request.sets.is_empty() {
        let help = "add [[springs.sets]] with a name and one of box, nodes, face, set";
        return Err(Error::input("springs.sets", "the grouping \"sets\" has no sets", help));
    }
    let inside = |spring: &Spring, nodes: &[u32]| spring.nodes.iter().all(|node| nodes.binary_search(node).is_ok());
    let first = |spring: &Spring| request.sets.iter().position(|set| inside(spring, &set.nodes));
    let rank: Vec<usize> = network.springs.iter().map(|spring| first(spring).unwrap_or(request.sets.len())).collect();
    if let Some(empty) = (0..request.sets.len()).find(|set| !rank.contains(set)) {
        let message = format!(
            "\"{}\" has {} nodes, and no spring between two of them",
            request.sets[empty].name,
            request.sets[empty].nodes.len()
        );
        let help = "a spring belongs to the first set that has both its ends; make the set larger, or name it earlier";
        return Err(Error::input(format!("springs.sets[{empty}]"), message, help));
    }
    let names: Vec<String> = request.sets.iter().map(|set| set.name.clone()).chain(["rest".to_owned()]).collect();
    Ok(collect(network, &rank, &names))
}
