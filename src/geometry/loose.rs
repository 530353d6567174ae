//! Zero modes in words: which nodes are loose, and along what.

use crate::error::{Error, direction_name};
use crate::sparse::zero_modes::ZeroModes;

use super::dofs::DofMap;

/// The error of a body with zero modes: of every mode the node that moves most, with its direction. `what` is "spring
/// network" or "reference body".
pub fn mechanism(what: impl Into<String>, modes: &ZeroModes, dofs: &DofMap) -> Error {
    let motions = modes.vectors.iter().map(|mode| {
        let moved = dofs.expand(mode);
        let size = |node: usize| moved[node].iter().map(|u| u * u).sum::<f64>();
        let mut most = 0;
        for node in dofs.masters() {
            // a clear winner only: equal motions go to the first node, whatever the rounding
            if size(node) > size(most) * (1.0 + 1e-9) {
                most = node;
            }
        }
        format!("node {most} can move along {}", direction_name(moved[most]))
    });
    Error::mechanism(what, modes.count, motions.collect())
}
