//! Checks of `[converged]`: a finer mesh is finer, and holds what the mesh holds, which is so on faces only.

use crate::error::{Error, Result};

use super::super::{Converged, Scene};
use super::within;

/// Most halvings and elevations.
const MOST: usize = 4;

/// What needs no body.
pub(super) fn check(scene: &Scene) -> Result<()> {
    let Some(Converged { halvings, elevations }) = scene.converged else { return Ok(()) };
    within("converged.halvings", halvings, 0, MOST)?;
    within("converged.elevations", elevations, 0, MOST)?;
    if halvings + elevations == 0 {
        let help = "give halvings or elevations above 0, or remove the table";
        return Err(Error::input("converged", "the mesh is not refined", help));
    }
    let by_number = |support: &super::super::Support| {
        !support.nodes.is_empty() || support.r#box.is_some() || !support.sets.is_empty()
    };
    if scene.support.tables().iter().any(by_number) {
        let message = "the supports name control points, and a finer mesh has others";
        return Err(Error::input("converged", message, "hold whole faces (support.faces), or remove the table"));
    }
    Ok(())
}
