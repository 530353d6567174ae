//! The networks of `bench step` as files, so that other programs can be timed on the very same numbers.
//!
//! For the cube of n^3 control points: `step_n.json` with the sizes, the step h, the acceleration g and the number of
//! steps; beside it plain lists, little-endian, without a head:
//!
//! | file | numbers |
//! |---|---|
//! | `step_n_ends.u32` | two nodes for each spring |
//! | `step_n_springs.f64` | k (N/m), l0 (m), c (N s/m) for each spring; c is 0 without damping |
//! | `step_n_nodes.f64` | x, y, z at rest (m), mass (kg), 1 where it can move and 0 where it is held, for each node |
//! | `step_n_moved.f64` | x, y, z of each node after the steps, m |

use std::path::Path;

use serde_json::json;

use crate::error::Result;
use crate::export::write;

use super::step::{ACCELERATION, Rig};

/// Steps after which the positions are written.
const STEPS: usize = 100;

/// Writes the files of one network into a folder.
///
/// # Errors
/// [`crate::error::Error::File`] with the file that cannot be written.
pub fn save(rig: &Rig, folder: &Path) -> Result<()> {
    let name = |ending: &str| folder.join(format!("step_{}{ending}", rig.size));
    let numbers = |list: &mut dyn Iterator<Item = f64>| list.flat_map(f64::to_le_bytes).collect::<Vec<u8>>();
    let springs = &rig.network.springs;
    let ends: Vec<u8> = springs.iter().flat_map(|spring| spring.nodes).flat_map(u32::to_le_bytes).collect();
    let damping = |s: usize| rig.damping.as_ref().map_or(0.0, |damping| damping[s]);
    let mut each = springs.iter().enumerate().flat_map(|(s, spring)| [rig.stiffness[s], spring.length, damping(s)]);
    let nodes = rig.network.positions.iter().zip(&rig.masses).zip(&rig.held);
    let mut nodes = nodes.flat_map(|(([x, y, z], mass), held)| [*x, *y, *z, *mass, f64::from(u8::from(!held))]);
    let moved = rig.positions_after(STEPS, STEPS as f64 * rig.step);
    write::whole(&name("_ends.u32"), &ends)?;
    write::whole(&name("_springs.f64"), &numbers(&mut each))?;
    write::whole(&name("_nodes.f64"), &numbers(&mut nodes))?;
    write::whole(&name("_moved.f64"), &numbers(&mut moved.into_iter().flatten()))?;
    let head = json!({ "schema": "springfit-step/1", "springs": springs.len(), "nodes": rig.masses.len(),
        "step": rig.step, "steps": STEPS, "acceleration": ACCELERATION, "damped": rig.damping.is_some() });
    write::whole(&name(".json"), format!("{head:#}\n").as_bytes())
}
