//! The load cases of a scene as forces on the free degrees of freedom.

use crate::error::{Error, Result};
use crate::reference::Reference;
use crate::reference::load_fields::{self, Field};
use crate::reference::load_file::{self, Wanted};
use crate::reference::loads::{self, Face, Load};
use crate::reference::side_loads;
use crate::scene::{self, Axis, Place, Scene};

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

/// A word about every load that is listed for a held component of a node: its support takes it at once.
pub fn warnings(scene: &Scene, loads: &[LoadCase]) -> Vec<String> {
    let of = |(i, case): (usize, &LoadCase)| {
        let given = &scene.load[i];
        let listed = given.point.is_some() || given.patch.is_some() || given.file.is_some();
        let first = *case.load.held_nodes.first().filter(|_| listed)?;
        let more = case.load.held_nodes.len() - 1;
        let others = if more > 0 { format!(" and {more} more") } else { String::new() };
        Some(format!(
            "load[{i}] acts on held components of node {first}{others}: up to {:?} N at a node, {:?} N together, go straight \
             into the support and are part of its reaction",
            case.load.held_most, case.load.held
        ))
    };
    loads.iter().enumerate().filter_map(of).collect()
}

/// The error of one case with the key of its table.
fn at_case(error: Error, case: usize) -> Error {
    match error {
        Error::Input { key, message, help } => {
            let inside = key.strip_prefix("load.").map(|rest| format!(".{rest}")).unwrap_or_default();
            Error::input(format!("load[{case}]{inside}"), message, help)
        }
        other => other,
    }
}

/// The forces of one load, not scaled.
///
/// # Errors
/// Those of [`build`], at `load`.
pub(super) fn forces(load: &scene::Load, body: &Body) -> Result<Load> {
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
    if let Some(point) = &load.point {
        return loads::point(&body.dofs, point.node, padded(&point.force));
    }
    if let Some(patch) = &load.patch {
        return loads::shared(&body.dofs, &chosen_nodes(patch.place(), body)?, padded(&patch.force));
    }
    if let Some(path) = &load.file {
        let (body_name, case) = (load.body.as_deref(), load.case.as_deref());
        let (dimension, nodes) = (body.dofs.dimension(), body.dofs.nodes());
        let forces = load_file::read(path, Wanted { body: body_name, case, dimension, nodes })?;
        return loads::nodal(&body.dofs, &forces);
    }
    match (field(load), load.strength()) {
        (Some(field), Some((_, strength))) => load_fields::load(&field, strength, body.positions(), &body.dofs),
        _ => Err(Error::input("load", "has no force", "see `springfit schema` for the kinds of load")),
    }
}

/// The load field of a scene's load, if it is one.
fn field(load: &scene::Load) -> Option<Field> {
    let unit = |axis: Axis| std::array::from_fn(|i| f64::from(i == axis.index()));
    let torsion = load.torsion.as_ref().map(|torsion| Field::Torsion { axis: unit(torsion.axis) });
    let bending = load.bending.as_ref();
    let bending = bending.map(|b| Field::Bending { along: unit(b.along), direction: unit(b.direction) });
    let random = load.random_smooth.as_ref().map(|random| Field::RandomSmooth { seed: random.seed });
    torsion.or(bending).or(load.radial.map(|_| Field::Radial)).or(random)
}

/// Refuses loads under which the continuum stays where it is: no error could be told relative to that.
///
/// # Errors
/// [`Error::Input`] at `load[i]`.
pub fn check_answers(reference: &Reference) -> Result<()> {
    match reference.cases.iter().position(|case| case.u_max.is_nan() || case.u_max <= 0.0) {
        None => Ok(()),
        Some(i) => {
            let message = "the continuum does not move under it as far as numbers can tell";
            Err(Error::input(format!("load[{i}]"), message, "a larger force, or a softer material"))
        }
    }
}

/// Scales the loads that ask for it to their largest displacement of the continuum, and its answers with them.
pub fn scale(scene: &Scene, loads: &mut [LoadCase], reference: &mut Reference) {
    for ((given, case), answer) in scene.load.iter().zip(loads).zip(&mut reference.cases) {
        if let Some(largest) = given.max_displacement {
            let factor = largest / answer.u_max;
            case.load.scale(factor);
            answer.scale(factor);
        }
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
            let chosen = chosen_nodes(traction.place(), body)?;
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

/// The nodes of a place, ascending.
fn chosen_nodes(place: Place, body: &Body) -> Result<Vec<u32>> {
    match (place.face, place.set, place.region) {
        (Some(face), ..) => body.continuum.face_nodes(face, "load"),
        (_, Some(set), _) => body.continuum.set_nodes(set, "load"),
        (_, _, Some(region)) => Ok(body::box_nodes(region, body.positions())),
        _ => Err(Error::input("load", "it needs a place", "give one of face, set, box")),
    }
}
