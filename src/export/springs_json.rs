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
//! | `loads` | the load cases: `name`, whether they were fitted (`fit`), `forces` on the nodes, N; 0 where held |

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::geometry::dofs::FIXED;

use super::{Calibrated, write};

/// Name and version of the format.
pub const SCHEMA: &str = "springfit-springs/1";

/// The contents of springs.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Springs<'a> {
    /// [`SCHEMA`].
    pub schema: String,
    /// Name of the scene.
    pub name: String,
    /// Directions of space, 2 or 3.
    pub dimension: usize,
    /// Control point of each node.
    pub nodes: Vec<usize>,
    /// Places at rest, m.
    pub positions: Vec<Vec<f64>>,
    /// Which components are held.
    pub fixed: Vec<Vec<bool>>,
    /// Masses, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub masses: Option<Vec<f64>>,
    /// The two nodes of each spring, as places in the lists above.
    pub edges: Vec<[u32; 2]>,
    /// Rest lengths, m.
    pub rest_lengths: Vec<f64>,
    /// Places in `groups`.
    pub group: Cow<'a, [u32]>,
    /// Stiffness, N/m.
    pub k: Cow<'a, [f64]>,
    /// Damping, N s/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub c: Option<Cow<'a, [f64]>>,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// The load cases.
    #[serde(default)]
    pub loads: Vec<Forces>,
}

/// A load case in springs.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Forces {
    /// Its name.
    pub name: String,
    /// False when it was held out of the fit.
    pub fit: bool,
    /// Force on every node, N.
    pub forces: Vec<Vec<f64>>,
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
    let rows = |field: &[[f64; 3]]| nodes.iter().map(|&node| field[node][..dimension].to_vec()).collect();
    let loads = results.cases.iter();
    let springs = Springs {
        schema: SCHEMA.to_owned(),
        name: results.name.to_owned(),
        dimension,
        positions: rows(&network.positions),
        fixed: nodes.iter().map(|&node| dofs.free(node).iter().map(|&dof| dof == FIXED).collect()).collect(),
        masses: results.masses.map(|masses| nodes.iter().map(|&node| masses[node]).collect()),
        edges: network.springs.iter().map(|spring| spring.nodes.map(|node| place[node as usize])).collect(),
        rest_lengths: network.springs.iter().map(|spring| spring.length).collect(),
        group: results.grouping.group_of.as_slice().into(),
        k: results.stiffness.into(),
        c: results.damping.map(Cow::from),
        groups: results.grouping.groups.iter().map(|group| group.name.clone()).collect(),
        loads: loads.map(|case| Forces { name: case.name.into(), fit: case.fit, forces: rows(case.forces) }).collect(),
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
