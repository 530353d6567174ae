//! Springs that the user names: pairs of nodes in the scene or in a file.
//!
//! A pair that some topology joins too is the spring of that topology, with its kind, its step in the grid and its cells, so
//! that a list of all pairs of a grid is that grid. Any other pair is a spring of the kind "other" that counts once, with
//! its step in the grid where there is one. Pairs that are there already are passed over.
//!
//! A file has one pair of node numbers a line, from 0, between them blanks or a comma; what follows a `#` is a remark.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::geometry::grid::Grid;

use super::network::{Kind, Network, Spring, rest};
use super::topology::{COINCIDENT, diagonal};

/// Largest file that is read, bytes.
const LARGEST_FILE: u64 = 1 << 30;

/// Reads the pairs of a file.
///
/// # Errors
/// [`Error::File`] with the line that is not a pair of node numbers.
pub fn read(path: &Path) -> Result<Vec<[u32; 2]>> {
    let wrong = |message: String| Error::File {
        path: path.into(),
        message,
        help: "a line is two node numbers from 0, such as 3 17 or 3, 17".into(),
    };
    let cannot = |error: std::io::Error| wrong(format!("cannot be read: {error}"));
    let metadata = fs::metadata(path).map_err(cannot)?;
    if !metadata.is_file() || metadata.len() > LARGEST_FILE {
        return Err(wrong(format!("is not a regular file of at most {LARGEST_FILE} bytes")));
    }
    let text = fs::read_to_string(path).map_err(cannot)?;
    let mut pairs = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = line.split([' ', '\t', ',']).filter(|word| !word.is_empty()).collect();
        let numbers: Option<Vec<u32>> = words.iter().map(|word| word.parse().ok()).collect();
        match numbers.as_deref() {
            Some([]) => {}
            Some(&[a, b]) => pairs.push([a, b]),
            _ => return Err(wrong(format!("line {}: {:?} is not a pair of nodes", number + 1, line.trim()))),
        }
    }
    Ok(pairs)
}

/// Adds the springs of some pairs to a network. `known` is the same body with the springs of its cells.
///
/// # Errors
/// [`Error::Input`] at `key` for a node that is not there, or a pair of one node.
pub fn add(
    network: &mut Network,
    pairs: &[[u32; 2]],
    key: &str,
    known: &Network,
    grid: Option<&Grid>,
    dofs: &DofMap,
) -> Result<()> {
    let by_nodes = |network: &Network| -> HashMap<[u32; 2], usize> {
        network.springs.iter().enumerate().map(|(s, spring)| (sorted(spring.nodes), s)).collect()
    };
    let (mut there, usual) = (by_nodes(network), by_nodes(known));
    let tolerance = COINCIDENT * diagonal(&network.positions);
    for (i, &pair) in pairs.iter().enumerate() {
        let nodes = sorted(checked(pair, &format!("{key}[{i}]"), dofs)?);
        if there.contains_key(&nodes) {
            continue;
        }
        let spring = match usual.get(&nodes) {
            Some(&s) => Some(known.springs[s].clone()),
            None => other(nodes, network, grid, tolerance),
        };
        match spring {
            Some(spring) => {
                there.insert(nodes, network.springs.len());
                network.springs.push(spring);
            }
            None => network.zero_length += 1,
        }
    }
    Ok(())
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The masters of a pair.
fn checked(pair: [u32; 2], key: &str, dofs: &DofMap) -> Result<[u32; 2]> {
    if let Some(node) = pair.into_iter().find(|&node| node as usize >= dofs.nodes()) {
        let help = format!("the body has {}, numbered from 0 to {}", dofs.nodes(), dofs.nodes().saturating_sub(1));
        return Err(Error::input(key, format!("there is no node {node}"), help));
    }
    if pair[0] == pair[1] {
        let message = format!("node {} is joined to itself", pair[0]);
        return Err(Error::input(key, message, "give two different nodes"));
    }
    Ok(pair.map(|node| dofs.master(node as usize) as u32))
}

/// A spring that no topology has; none where its ends lie on one place.
fn other(nodes: [u32; 2], network: &Network, grid: Option<&Grid>, tolerance: f64) -> Option<Spring> {
    let [a, b] = nodes.map(|node| network.positions[node as usize]);
    let (length, direction) = rest(a, b, tolerance)?;
    let offset = grid.and_then(|grid| step(grid, nodes)).unwrap_or_default();
    Some(Spring { nodes, length, direction, kind: Kind::Other, offset, cells: 1 })
}

/// The step in the grid between two nodes, the smaller first; none when it is too long to be kept.
fn step(grid: &Grid, [from, to]: [u32; 2]) -> Option<[i8; 3]> {
    let (start, end) = (grid.index(from as usize), grid.index(to as usize));
    let mut step = [0; 3];
    for a in 0..3 {
        step[a] = i8::try_from(end[a] as i64 - start[a] as i64).ok()?;
    }
    Some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::springs::topology;

    fn square() -> (Grid, Vec<[f64; 3]>, DofMap) {
        let grid = Grid::new(&[4, 4]);
        let positions = (0..grid.len()).map(|node| grid.index(node).map(|i| i as f64)).collect();
        (grid, positions, DofMap::untied(2, &[[false; 3]; 16]))
    }

    fn named(topology: &str) -> Network {
        let (grid, positions, dofs) = square();
        (topology::find(topology).expect("in the table").connect)(&grid, &positions, &dofs)
    }

    #[test]
    fn a_list_of_all_pairs_of_a_topology_is_that_topology() {
        let (grid, _, dofs) = square();
        let known = named("second_ring");
        for topology in ["grid", "second_ring"] {
            let there = named(topology);
            let pairs: Vec<[u32; 2]> = there.springs.iter().map(|spring| [spring.nodes[1], spring.nodes[0]]).collect();
            let mut listed = named("list");
            add(&mut listed, &pairs, "springs.edges", &known, Some(&grid), &dofs).expect("nodes of the body");
            assert_eq!(listed, there);
            add(&mut listed, &pairs, "springs.edges", &known, Some(&grid), &dofs).expect("nodes of the body");
            assert_eq!(listed, there, "the same pairs again");
        }
    }

    #[test]
    fn a_long_spring_keeps_its_step_and_nodes_are_checked() {
        let (grid, _, dofs) = square();
        let (mut network, known) = (named("grid"), named("grid"));
        add(&mut network, &[[15, 0]], "springs.edges", &known, Some(&grid), &dofs).expect("in the body");
        let last = network.springs.last().expect("it was added");
        assert_eq!((last.nodes, last.offset, last.kind, last.cells), ([0, 15], [3, 3, 0], Kind::Other, 1));
        assert_eq!(network.reach(), Some(3));
        for (pair, words) in [([0, 16], "there is no node 16"), ([3, 3], "node 3 is joined to itself")] {
            let error = add(&mut network, &[[0, 1], pair], "springs.edges", &known, Some(&grid), &dofs).unwrap_err();
            assert!(error.to_string().contains(words) && error.to_string().contains("springs.edges[1]"), "{error}");
        }
    }

    #[test]
    fn a_file_has_a_pair_a_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("edges.txt");
        fs::write(&path, "# of a beam\n0 5\n\n 3,\t17 # long\n").expect("written");
        assert_eq!(read(&path).expect("two pairs"), [[0, 5], [3, 17]]);
        fs::write(&path, "0 5\n7 -1\n").expect("written");
        assert!(read(&path).unwrap_err().to_string().contains("line 2: \"7 -1\" is not a pair"));
    }
}
