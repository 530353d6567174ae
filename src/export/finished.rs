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
    let document: Document = read_result(folder)?;
    let springs = &file_of(folder, "springs.json")?;
    let read = read_springs(springs)?;
    let network = network(&read).map_err(|message| wrong(springs, message))?;
    let fixed: Vec<[bool; 3]> = read.fixed.iter().map(|held| padded(held, false)).collect();
    let dofs = DofMap::untied(read.dimension, &fixed);
    Ok(Finished { network, dofs, springs: read, groups: document.calibration.groups })
}

/// Reads what is wanted of the result.json in the folder of a run.
///
/// # Errors
/// [`Error::File`] with the folder when it is none or holds no result, with the file when it is another document.
pub fn read_result<T: serde::de::DeserializeOwned>(folder: &Path) -> Result<T> {
    if !folder.is_dir() {
        return Err(refusal(folder, "there is no such folder"));
    }
    let path = file_of(folder, "result.json")?;
    let document: serde_json::Value = parsed(&path)?;
    if document["schema"] != RESULT_SCHEMA {
        return Err(wrong(&path, format!("its schema is {}, not {RESULT_SCHEMA:?}", document["schema"])));
    }
    serde_json::from_value(document).map_err(|error| wrong(&path, error.to_string()))
}

/// The path of a file of a finished run.
fn file_of(folder: &Path, name: &str) -> Result<PathBuf> {
    let path = folder.join(name);
    match path.is_file() {
        true => Ok(path),
        false => Err(refusal(folder, &format!("holds no {name}: no run has finished here"))),
    }
}

/// Reads a springs.json, of this program or another one. Places, rest lengths and stiffness are taken as they are.
///
/// # Errors
/// [`Error::File`] with the list that is missing or has another length than its nodes or springs.
pub fn read_springs(path: &Path) -> Result<Springs<'static>> {
    let help = |error: Error| match error {
        Error::File { path, message, .. } => Error::File {
            path,
            message,
            help: "give the springs.json of a network: springfit run SCENE --out DIR".into(),
        },
        other => other,
    };
    let read: Springs<'static> = parsed(path).map_err(help)?;
    check(&read).map_err(|message| help(wrong(path, message)))?;
    Ok(read)
}

fn refusal(folder: &Path, message: &str) -> Error {
    let help = "give the folder of a finished run: springfit run SCENE --out DIR";
    Error::File { path: folder.to_owned(), message: message.to_owned(), help: help.into() }
}

fn wrong(path: &Path, message: String) -> Error {
    let help = "run the scene again: springfit run SCENE --out DIR";
    Error::File { path: path.to_owned(), message, help: help.into() }
}

fn parsed<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T> {
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
    if let Some((name, node)) = named.chain([("fixed", held)]).find_map(|(name, node)| Some((name, node?))) {
        return Err(format!("{name}: node {node} has not {d} components"));
    }
    let missing = |&[a, b]: &[u32; 2]| a.max(b) as usize >= nodes;
    match springs.edges.iter().position(missing) {
        Some(s) => Err(format!("edges: spring {s} has no node {}", springs.edges[s][0].max(springs.edges[s][1]))),
        None => match springs.group.iter().position(|&group| group as usize >= springs.groups.len()) {
            Some(s) => Err(format!("group: spring {s} is in group {}, which is not there", springs.group[s])),
            None => Ok(()),
        },
    }
}

/// The springs between their nodes, which are there.
fn network(springs: &Springs) -> std::result::Result<Network, String> {
    let positions: Vec<[f64; 3]> = springs.positions.iter().map(|x| padded(x, 0.0)).collect();
    let one = |(s, (&[a, b], &length)): (usize, (&[u32; 2], &f64))| {
        let [from, to] = [a, b].map(|node| positions[node as usize]);
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
