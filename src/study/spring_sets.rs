//! The parts of a body that a scene gives groups of their own.

use crate::error::{Error, Result};
use crate::scene::{Place, Scene, SpringSet};
use crate::springs::grouping::NodeSet;

use super::body::{self, Body};

/// The sets of a scene with their nodes; tied nodes are their masters.
///
/// # Errors
/// [`Error::Input`] at `springs.sets[i]` for a face or a set that is not there, and for one without nodes.
pub fn sets(scene: &Scene, body: &Body) -> Result<Vec<NodeSet>> {
    scene.springs.sets.iter().enumerate().map(|(i, set)| one(set, &format!("springs.sets[{i}]"), body)).collect()
}

fn one(set: &SpringSet, key: &str, body: &Body) -> Result<NodeSet> {
    let found = match set.place() {
        Place { face: Some(face), .. } => body.continuum.face_nodes(face, &format!("{key}.face"))?,
        Place { set: Some(name), .. } => body.continuum.set_nodes(name, &format!("{key}.set"))?,
        Place { region: Some(region), .. } => body::box_nodes(region, body.positions()),
        _ => set.nodes.iter().map(|&node| node as u32).collect(),
    };
    if found.is_empty() {
        return Err(Error::input(key, format!("\"{}\" holds no node", set.name), "make its box larger"));
    }
    let mut nodes: Vec<u32> = found.into_iter().map(|node| body.dofs.master(node as usize) as u32).collect();
    nodes.sort_unstable();
    nodes.dedup();
    Ok(NodeSet { name: set.name.clone(), nodes })
}
