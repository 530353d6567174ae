//! The load cases of a scene as forces on the free degrees of freedom.

use crate::error::{Error, Result};
use crate::reference::loads::{self, Face, Load};
use crate::scene::{self, Scene};

use super::body::Body;
use super::continuum::Continuum;

/// One load case.
pub struct LoadCase {
    /// Its name.
    pub name: String,
    /// False when it is held out of the fit.
    pub fit: bool,
    /// Its forces.
    pub load: Load,
}

/// The forces of every load case.
///
/// # Errors
/// [`Error::Input`] at `load[i]` when it acts on no free control point, or on a face that is not there.
pub fn build(scene: &Scene, body: &Body) -> Result<Vec<LoadCase>> {
    let one = |i: usize| -> Result<LoadCase> {
        let load = forces(&scene.load[i], body).map_err(|error| at_case(error, i))?;
        Ok(LoadCase { name: scene.load_name(i), fit: scene.load[i].fit, load })
    };
    (0..scene.load.len()).map(one).collect()
}

/// The error of one case with the key of its table.
fn at_case(error: Error, case: usize) -> Error {
    match error {
        Error::Input { message, help, .. } => Error::input(format!("load[{case}]"), message, help),
        other => other,
    }
}

fn forces(load: &scene::Load, body: &Body) -> Result<Load> {
    let padded = |given: &[f64]| [0, 1, 2].map(|a| given.get(a).copied().unwrap_or(0.0));
    if let Some(force) = &load.force_per_node {
        return loads::per_node(&body.dofs, padded(force));
    }
    if let Some(traction) = &load.traction {
        let value = padded(&traction.value);
        let Continuum::Splines { patch, .. } = &body.continuum else {
            return Err(Error::input("load", "a mesh takes no traction", "use force_per_node, body_force or point"));
        };
        let face = Face { patch, name: &traction.face, thickness: body.thickness, extra_points: body.extra_points };
        return loads::traction(face, &body.dofs, &|_, _| value);
    }
    if let Some(density) = &load.body_force {
        let density = padded(density);
        return loads::body_force(&body.integration_points()?, &body.dofs, &|_| density);
    }
    match &load.point {
        Some(point) => loads::point(&body.dofs, point.node, padded(&point.force)),
        None => Err(Error::input("load", "has no force", "give one of force_per_node, traction, body_force, point")),
    }
}
