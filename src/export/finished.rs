//! A finished run, read back from its folder: springs.json as a network, and the groups that result.json tells of.
//!
//! Files may have been edited, cut short or made by something else, so everything is checked before it is used: the
//! schema, that every list has one entry a node or a spring, that springs join different nodes that are there, and that
//! rest lengths are those of the places.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::springs::network::{Kind, Network, Spring};

use super::springs_json::{SCHEMA, Springs};

/// Name and version of result.json.
const RESULT_SCHEMA: &str = "springfit-result/1";

/// How far a rest length may be from the distance of its nodes, relative.
const SAME_LENGTH: f64 = 1e-9;

/// A finished run.
#[derive(Debug, Clone)]
pub struct Finished {
    /// springs.json.
    pub springs: Springs<'static>,
    /// Its network; every node stands for itself.
    pub network: Network,
    /// Its supports.
    pub dofs: DofMap,
    /// The groups of the calibration.
    pub groups: Vec<Group>,
}

/// A group, as result.json tells of it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// How many springs it has.
    pub springs: usize,
    /// Their mean rest length, m.
    pub length: f64,
    /// What was fitted: N/m, or N for an axial rigidity.
    pub stiffness: f64,
    /// Least value that was allowed.
    pub lower: f64,
    /// Largest value that was allowed.
    pub upper: f64,
}

#[derive(Deserialize)]
struct Document {
    schema: String,
    calibration: Calibration,
}

#[derive(Deserialize)]
struct Calibration {
    groups: Vec<Group>,
}

/// Reads the folder of a run.
///
/// # Errors
/// [`Error::File`] with the folder when it is none or holds no result, with the file and what is wrong in it otherwise.
pub fn read(folder: &Path) -> Result<Finished> {
    if !folder.is_dir() {
        return Err(refusal(folder, "there is no such folder"));
    }
    let files = ["result.json", "springs.json"].map(|name| folder.join(name));
    if let Some(missing) = files.iter().find(|path| !path.is_file()) {
        let name = missing.file_name().unwrap_or_default().to_string_lossy();
        return Err(refusal(folder, &format!("holds no {name}: no run has finished here")));
    }
    let [result, springs] = &files;
    let document: Document = parsed(result)?;
    if document.schema != RESULT_SCHEMA {
        return Err(wrong(result, format!("its schema is {:?}, not {RESULT_SCHEMA:?}", document.schema)));
    }
    let read: Springs<'static> = parsed(springs)?;
    check(&read).map_err(|message| wrong(springs, message))?;
    let network = network(&read).map_err(|message| wrong(springs, message))?;
    let fixed: Vec<[bool; 3]> = read.fixed.iter().map(|held| padded(held, false)).collect();
    let dofs = DofMap::untied(read.dimension, &fixed);
    Ok(Finished { network, dofs, springs: read, groups: document.calibration.groups })
}

fn refusal(folder: &Path, message: &str) -> Error {
    let help = "give the folder of a finished run: springfit run SCENE --out DIR";
    Error::File { path: folder.to_owned(), message: message.to_owned(), help: help.into() }
}

fn wrong(path: &PathBuf, message: String) -> Error {
    let help = "run the scene again: springfit run SCENE --out DIR";
    Error::File { path: path.clone(), message, help: help.into() }
}

fn parsed<T: serde::de::DeserializeOwned>(path: &PathBuf) -> Result<T> {
    let bytes = std::fs::read(path).map_err(|error| wrong(path, format!("cannot be read: {error}")))?;
    serde_json::from_slice(&bytes).map_err(|error| wrong(path, error.to_string()))
}

/// The numbers of a node, the third one filled in.
pub(super) fn padded<T: Copy>(row: &[T], rest: T) -> [T; 3] {
    [0, 1, 2].map(|a| row.get(a).copied().unwrap_or(rest))
}

/// The lengths of all lists.
fn check(springs: &Springs) -> std::result::Result<(), String> {
    if springs.schema != SCHEMA {
        return Err(format!("its schema is {:?}, not {SCHEMA:?}", springs.schema));
    }
    let (nodes, edges, d) = (springs.nodes.len(), springs.edges.len(), springs.dimension);
    if !(d == 2 || d == 3) {
        return Err(format!("dimension: {d} is neither 2 nor 3"));
    }
    let lists = [
        ("positions", springs.positions.len(), nodes),
        ("fixed", springs.fixed.len(), nodes),
        ("masses", springs.masses.as_ref().map_or(nodes, Vec::len), nodes),
        ("rest_lengths", springs.rest_lengths.len(), edges),
        ("group", springs.group.len(), edges),
        ("k", springs.k.len(), edges),
        ("c", springs.c.as_ref().map_or(edges, |c| c.len()), edges),
    ];
    let loads = springs.loads.iter().map(|load| ("loads", load.forces.len(), nodes));
    if let Some((name, found, wanted)) = lists.into_iter().chain(loads).find(|&(_, found, wanted)| found != wanted) {
        return Err(format!("{name}: {found} entries instead of {wanted}"));
    }
    let short = |rows: &[Vec<f64>]| rows.iter().position(|row| row.len() != d);
    let named = [("positions", short(&springs.positions))].into_iter();
    let named = named.chain(springs.loads.iter().map(|load| ("loads", short(&load.forces))));
    let held = springs.fixed.iter().position(|row| row.len() != d);
    match named.chain([("fixed", held)]).find_map(|(name, node)| node.map(|node| (name, node))) {
        Some((name, node)) => Err(format!("{name}: node {node} has not {d} components")),
        None => match springs.group.iter().position(|&group| group as usize >= springs.groups.len()) {
            Some(s) => Err(format!("group: spring {s} is in group {}, which is not there", springs.group[s])),
            None => Ok(()),
        },
    }
}

/// The springs between their nodes.
fn network(springs: &Springs) -> std::result::Result<Network, String> {
    let positions: Vec<[f64; 3]> = springs.positions.iter().map(|x| padded(x, 0.0)).collect();
    let one = |(s, (&[a, b], &length)): (usize, (&[u32; 2], &f64))| {
        let place = |node: u32| positions.get(node as usize).ok_or(format!("edges: spring {s} has no node {node}"));
        let (from, to) = (place(a)?, place(b)?);
        let step: [f64; 3] = std::array::from_fn(|i| to[i] - from[i]);
        let distance = step.iter().map(|d| d * d).sum::<f64>().sqrt();
        let same = (distance - length).abs() <= SAME_LENGTH * distance && distance > 0.0;
        if !same {
            return Err(format!("rest_lengths: spring {s} is {length} m long, its nodes are {distance} m apart"));
        }
        let direction = step.map(|d| d / distance);
        Ok(Spring { nodes: [a, b], length, direction, kind: Kind::Edge, offset: [0; 3], cells: 1 })
    };
    let each = springs.edges.iter().zip(&springs.rest_lengths).enumerate();
    let bars = each.map(one).collect::<std::result::Result<_, String>>()?;
    Ok(Network { dimension: springs.dimension, positions, springs: bars, zero_length: 0 })
}
