//! springs.json: the network as a simulator needs it.
//!
//! One object of the schema `springfit-springs/1`. Nodes are the control points that stand for themselves: where a seam is
//! merged, only one of the nodes on each other appears. Everything in SI units; lists of nodes have one entry a node,
//! lists of springs one entry a spring:
//!
//! | key | what |
//! |---|---|
//! | `nodes` | control point (C order of the control grid) of each node |
//! | `positions` | at rest, m; two or three numbers each |
//! | `fixed` | which components are held |
//! | `masses` | kg; only when the scene has dynamics |
//! | `edges` | the two nodes of each spring: places in the lists above |
//! | `rest_lengths` | m |
//! | `group` | place in `groups` |
//! | `k` | stiffness, N/m: already times the number of cells where the weighting counts them |
//! | `c` | damping (4.18), N s/m; only when the scene has dynamics |
//! | `groups` | names of the groups |

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::Result;
use crate::geometry::dofs::FIXED;

use super::{Calibrated, write};

/// Name and version of the format.
pub const SCHEMA: &str = "springfit-springs/1";

#[derive(Serialize)]
struct Springs<'a> {
    schema: &'static str,
    name: &'a str,
    dimension: usize,
    nodes: Vec<usize>,
    positions: Vec<&'a [f64]>,
    fixed: Vec<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    masses: Option<Vec<f64>>,
    edges: Vec<[u32; 2]>,
    rest_lengths: Vec<f64>,
    group: &'a [u32],
    k: &'a [f64],
    #[serde(skip_serializing_if = "Option::is_none")]
    c: Option<&'a [f64]>,
    groups: Vec<&'a str>,
}

/// The text of springs.json.
pub fn document(results: &Calibrated) -> String {
    let (network, dofs) = (results.network, results.dofs);
    let dimension = network.dimension;
    let nodes: Vec<usize> = dofs.masters().collect();
    let mut place = vec![u32::MAX; dofs.nodes()];
    for (i, &node) in nodes.iter().enumerate() {
        place[node] = i as u32;
    }
    let springs = Springs {
        schema: SCHEMA,
        name: results.name,
        dimension,
        positions: nodes.iter().map(|&node| &network.positions[node][..dimension]).collect(),
        fixed: nodes.iter().map(|&node| dofs.free(node).iter().map(|&dof| dof == FIXED).collect()).collect(),
        masses: results.masses.map(|masses| nodes.iter().map(|&node| masses[node]).collect()),
        edges: network.springs.iter().map(|spring| spring.nodes.map(|node| place[node as usize])).collect(),
        rest_lengths: network.springs.iter().map(|spring| spring.length).collect(),
        group: &results.grouping.group_of,
        k: results.stiffness,
        c: results.damping,
        groups: results.grouping.groups.iter().map(|group| group.name.as_str()).collect(),
        nodes,
    };
    serde_json::to_string(&springs).expect("names and numbers can always be written as JSON")
}

/// Writes springs.json into a folder.
///
/// # Errors
/// When the file cannot be written.
pub fn write(results: &Calibrated, folder: &Path) -> Result<Vec<PathBuf>> {
    let path = folder.join("springs.json");
    write::whole(&path, document(results).as_bytes())?;
    Ok(vec![path])
}
