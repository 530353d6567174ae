//! The load cases of a scene as forces on the free degrees of freedom.

use crate::error::{Error, Result};
use crate::reference::loads::{self, Face, Load};
use crate::reference::side_loads;
use crate::scene::{self, Scene};

use super::body::{self, Body};
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
        return self::traction(traction, padded(&traction.value), body);
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

/// A constant traction on a part of the boundary.
fn traction(traction: &scene::Traction, value: [f64; 3], body: &Body) -> Result<Load> {
    match (&body.continuum, &traction.face) {
        (Continuum::Splines { patch, .. }, Some(face)) => {
            let face = Face { patch, name: face, thickness: body.thickness, extra_points: body.extra_points };
            loads::traction(face, &body.dofs, &|_, _| value)
        }
        (Continuum::Splines { .. }, None) => {
            let help = "a patch takes a traction on a face (x-, x+, y-, ...); use finite elements for sets and boxes";
            Err(Error::input("load", "no face is given", help))
        }
        (Continuum::Elements { mesh, .. }, _) => {
            let chosen = chosen_nodes(traction, body)?;
            let faces = mesh.boundary_faces()?;
            let there = |corners: &&[u32]| corners.iter().all(|node| chosen.binary_search(node).is_ok());
            let sides: Vec<&[u32]> = faces.iter().map(|side| side.nodes()).filter(there).collect();
            if sides.is_empty() {
                let message =
                    format!("{} nodes are chosen, and no side of the boundary lies between them", chosen.len());
                return Err(Error::input("load", message, "choose all corners of the sides that are loaded"));
            }
            side_loads::traction(mesh, sides, body.thickness, &body.dofs, &|_, _| value)
        }
    }
}

/// The nodes whose sides carry a traction, ascending.
fn chosen_nodes(traction: &scene::Traction, body: &Body) -> Result<Vec<u32>> {
    let scene::Traction { face, set, r#box, .. } = traction;
    match (face, set, r#box) {
        (Some(face), ..) => body.continuum.face_nodes(face, "load"),
        (_, Some(set), _) => body.continuum.set_nodes(set, "load"),
        (_, _, Some(region)) => Ok(body::box_nodes(region, body.positions())),
        _ => Err(Error::input("load", "a traction needs a place", "give one of face, set, box")),
    }
}
