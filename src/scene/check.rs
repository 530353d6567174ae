//! Checks of a scene that need no geometry: ranges, names, lengths of vectors, one kind of load a table.
//!
//! Every failure is an [`Error::Input`] at its key. What depends on the built body comes later, in [`check_body`] and
//! in the rooms below. Upper limits are there so that a slip of the keyboard costs a message, not the memory.

mod budget;
mod calibration;
mod converged;
mod geometry;
mod reference;
mod springs;
mod support;

pub use reference::check_method;

use crate::error::{Error, Result};

use reference::{check_reference, named_method};

use super::check_load;
use super::dynamics;
use super::limits;
use super::{BoxRegion, Kinematics, Plane, Scene, Solver};

/// Smallest and largest tolerance of the iterative solver: below is rounding, above the error would show it.
const TOLERANCES: [f64; 2] = [1e-14, 1e-6];

/// Checks all that can be checked before the body is built, and returns warnings.
///
/// # Errors
/// [`Error::Input`] at the key of the first value that cannot be used.
pub fn check(scene: &Scene) -> Result<Vec<String>> {
    geometry::check(&scene.geometry)?;
    check_material(scene)?;
    support::check(&scene.support)?;
    check_load::check(&scene.load)?;
    check_reference(scene)?;
    converged::check(scene)?;
    springs::check(&scene.springs)?;
    springs::check_adaptive(scene)?;
    calibration::check(&scene.calibration)?;
    calibration::check_groups_of_known(scene)?;
    check_solver(&scene.solver)?;
    limits::check(&scene.limits)?;
    budget::check(scene)?;
    if let Some(dynamics) = &scene.dynamics {
        dynamics::check(scene, dynamics)?;
    }
    let patch = scene.geometry.known_shape().map(|shape| shape.dimension);
    if let Some(dimension) = patch.or(scene.geometry.known_mesh().map(|shape| shape.dimension)) {
        check_dimension(scene, dimension)?;
    }
    Ok(warnings(scene))
}

/// Checks a scene against its body: `dimension` 2 or 3, and the number of control points.
///
/// # Errors
/// [`Error::Input`] at a vector of another length, a setting for the other dimension, or a control point that is not
/// there.
pub fn check_body(scene: &Scene, dimension: usize, control_points: usize) -> Result<()> {
    check_dimension(scene, dimension)?;
    let there = |key: String, node: usize| match node < control_points {
        true => Ok(()),
        false => Err(Error::input(
            key,
            format!("there is no control point {node}"),
            format!("the body has {control_points}, numbered from 0 to {}", control_points.saturating_sub(1)),
        )),
    };
    for (key, support) in scene.support.keyed() {
        for (i, &node) in support.nodes.iter().enumerate() {
            there(format!("{key}.nodes[{i}]"), node)?;
        }
    }
    for (i, load) in scene.load.iter().enumerate() {
        if let Some(point) = &load.point {
            there(format!("load[{i}].point.node"), point.node)?;
        }
    }
    for (i, set) in scene.springs.sets.iter().enumerate() {
        set.nodes.iter().enumerate().try_for_each(|(j, &node)| there(format!("springs.sets[{i}].nodes[{j}]"), node))?;
    }
    Ok(())
}

fn check_material(scene: &Scene) -> Result<()> {
    let material = &scene.material;
    positive("material.young", material.young)?;
    if let Some(density) = material.density {
        positive("material.density", density)?;
    }
    if material.poisson > -1.0 && material.poisson <= 0.5 {
        return Ok(());
    }
    let help = "above -1 and below 0.5; 0.5 itself only in plane stress";
    Err(Error::input("material.poisson", format!("{} is out of range", material.poisson), help))
}

pub(super) fn check_box(key: &str, BoxRegion { min, max }: &BoxRegion) -> Result<()> {
    match min.iter().zip(max).position(|(low, high)| low > high) {
        Some(a) => Err(Error::input(
            format!("{key}.max[{a}]"),
            format!("{} is below the minimum {}", max[a], min[a]),
            "give the smaller corner as min and the larger as max",
        )),
        None => Ok(()),
    }
}

fn check_solver(solver: &Solver) -> Result<()> {
    let [least, most] = TOLERANCES;
    if (least..=most).contains(&solver.tolerance) {
        return Ok(());
    }
    let message = format!("{:e} is out of range", solver.tolerance);
    Err(Error::input("solver.tolerance", message, format!("give a number from {least:e} to {most:e}")))
}

fn check_dimension(scene: &Scene, dimension: usize) -> Result<()> {
    let geometry = &scene.geometry;
    length("geometry.size", geometry.size.as_ref().map(Vec::len), dimension)?;
    length("geometry.control_points", geometry.control_points.as_ref().map(Vec::len), dimension)?;
    length("geometry.degree", geometry.degree.as_ref().map(Vec::len), dimension)?;
    let finest = scene.budget.as_ref().and_then(|budget| budget.finest.as_ref());
    length("budget.finest", finest.map(Vec::len), dimension)?;
    support::check_dimension(&scene.support, dimension)?;
    check_load::check_dimension(&scene.load, dimension)?;
    let gravity = scene.dynamics.as_ref().and_then(|dynamics| dynamics.gravity.as_ref());
    length("dynamics.gravity", gravity.map(Vec::len), dimension)?;
    if let Some(dynamics) = &scene.dynamics {
        length("dynamics.velocity", dynamics.velocity.as_ref().map(Vec::len), dimension)?;
        dynamics::check_spin(dynamics, dimension)?;
    }
    calibration::check_dimension(&scene.calibration, dimension)?;
    springs::check_dimension(&scene.springs, dimension)?;
    if let Some(method) = named_method(scene) {
        check_method(method, dimension)?;
    }
    check_plane(scene, dimension)
}

/// Plane settings belong to 2D, and an incompressible material to plane stress.
fn check_plane(scene: &Scene, dimension: usize) -> Result<()> {
    let reference = &scene.reference;
    let given = [("plane", reference.plane.is_some()), ("thickness", reference.thickness.is_some())];
    if let (3, Some((key, _))) = (dimension, given.into_iter().find(|&(_, given)| given)) {
        let help = format!("remove reference.{key}: it is for bodies in 2D");
        return Err(Error::input(format!("reference.{key}"), "the body is in 3D", help));
    }
    let stress = dimension == 2 && reference.plane != Some(Plane::Strain);
    if scene.material.poisson < 0.5 || stress {
        return Ok(());
    }
    let message = format!("{} makes the material incompressible", scene.material.poisson);
    Err(Error::input("material.poisson", message, "below 0.5; 0.5 itself only in plane stress"))
}

/// What is allowed but may not be meant.
fn warnings(scene: &Scene) -> Vec<String> {
    let mut warnings = springs::warnings(scene);
    warnings.extend(calibration::warnings(scene));
    if scene.reference.extra_gauss_points > 0 && named_method(scene).is_some_and(|method| !method.works_on_patches()) {
        warnings.push("reference.extra_gauss_points has no effect on finite elements".to_owned());
    }
    if scene.reference.kinematics == Kinematics::Corotational {
        warnings.extend(calibration::warnings_of_large(&scene.calibration));
    }
    warnings
}

pub(super) fn length(key: &str, found: Option<usize>, dimension: usize) -> Result<()> {
    match found {
        Some(found) if found != dimension => {
            let message = format!("{found} numbers for a body in {dimension}D");
            Err(Error::input(key, message, format!("give {dimension}, one for each direction")))
        }
        _ => Ok(()),
    }
}

pub(super) fn positive(key: &str, value: f64) -> Result<()> {
    if value > 0.0 {
        return Ok(());
    }
    Err(Error::input(key, format!("{value} is not positive"), "give a number above 0"))
}

pub(super) fn within(key: &str, value: usize, least: usize, most: usize) -> Result<()> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::input(key, format!("{value} is out of range"), format!("give a whole number from {least} to {most}")))
}
