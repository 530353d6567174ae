//! The network of a springs.json, of this program or another one, on the nodes of a body.
//!
//! The file says which springs there are, so that none is missing and none too many, and how stiff each is. Its nodes are control
//! points of the body, at the same places: that is checked, for a network of another body would be judged by the wrong
//! continuum. Rest lengths are the distances of the nodes; supports and loads are those of the scene.

use std::collections::HashMap;
use std::path::Path;

use crate::error::{Error, Result};
use crate::export::finished;
use crate::export::springs_json::Springs;
use crate::springs::network::Network;
use crate::springs::{edge_list, topology};

use super::body::Body;

/// A node of a file is at the place of its control point when it is nearer than this part of the diagonal of the body.
const SAME_PLACE: f64 = 1e-6;

/// Stiffness and group of every spring of a network from a file.
pub struct FromFile {
    /// N/m.
    pub stiffness: Vec<f64>,
    /// Place in `names`.
    pub class_of: Vec<u32>,
    /// Names of the groups.
    pub names: Vec<String>,
}

/// The network of a springs.json on the nodes of a body; `known` is the same body with the springs of its cells, and `bare`
/// without any.
///
/// # Errors
/// [`Error::File`] for a file that is none, or of another body; [`Error::Input`] for springs between nodes that are not there.
pub fn network(path: &Path, body: &Body, known: &Network, bare: Network) -> Result<(Network, FromFile)> {
    let file = finished::read_springs(path)?;
    check_body(path, &file, body)?;
    let node = |place: u32| file.nodes[place as usize] as u32;
    let pairs: Vec<[u32; 2]> = file.edges.iter().map(|ends| ends.map(node)).collect();
    let mut network = bare;
    edge_list::add(&mut network, &pairs, "calibration.springs", known, body.grid().as_ref(), &body.dofs)?;
    let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let springs = network.springs.iter().enumerate();
    let number: HashMap<[u32; 2], usize> = springs.map(|(s, spring)| (sorted(spring.nodes), s)).collect();
    let count = network.springs.len();
    let (mut stiffness, mut class_of) = (vec![0.0; count], vec![u32::MAX; count]);
    for ((pair, k), group) in pairs.iter().zip(file.k.iter()).zip(file.group.iter()) {
        // springs of zero length are left out
        if let Some(&s) = number.get(&sorted(pair.map(|node| body.dofs.master(node as usize) as u32))) {
            // springs side by side are as stiff as their sum
            stiffness[s] += k;
            class_of[s] = class_of[s].min(*group);
        }
    }
    Ok((network, FromFile { stiffness, class_of, names: file.groups }))
}

/// Refuses a file of another body or of a network that is not at rest, and stiffness that is none.
fn check_body(path: &Path, file: &Springs, body: &Body) -> Result<()> {
    let wrong = |message: String, help: &str| Err(Error::File { path: path.into(), message, help: help.into() });
    let another = "give the springs.json of a network on the control points of this body, in the same unit of length";
    let dimension = body.dofs.dimension();
    if file.dimension != dimension {
        return wrong(format!("a network in {}D, and the body is in {dimension}D", file.dimension), another);
    }
    let positions = body.positions();
    let tolerance = SAME_PLACE * topology::diagonal(positions);
    for (&node, place) in file.nodes.iter().zip(&file.positions) {
        let Some(own) = positions.get(node) else {
            return wrong(format!("nodes: the body has no control point {node}"), another);
        };
        let apart = distance(place, own);
        if apart.is_nan() || apart > tolerance {
            return wrong(
                format!("positions: node {node} is {apart:e} m from control point {node} of the body"),
                another,
            );
        }
    }
    for (s, (&[a, b], &rest)) in file.edges.iter().zip(&file.rest_lengths).enumerate() {
        let apart = distance(&file.positions[a as usize], &file.positions[b as usize]);
        if (rest - apart).is_nan() || (rest - apart).abs() > tolerance {
            let message = format!("rest_lengths: spring {s} is {rest} m long, its nodes are {apart} m apart");
            return wrong(message, "a network under tension at rest is not judged: give the distances of the nodes");
        }
    }
    match file.k.iter().position(|k| !(k.is_finite() && *k >= 0.0)) {
        Some(s) => wrong(format!("k: spring {s} has {}", file.k[s]), "give finite numbers from 0, in N/m"),
        None => Ok(()),
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
