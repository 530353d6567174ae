//! Checks of `[reference]`: the method, and what goes with it.

use crate::error::{Error, Result};
use crate::reference::methods::{self, Method};

use super::super::choices::{known, names};
use super::super::{Kinematics, Reference, Scene};
use super::{positive, within};

/// The method by name, the degree that only splines have, and plain ranges.
pub(in crate::scene) fn check_reference(scene: &Scene) -> Result<()> {
    let Reference { method, thickness, extra_gauss_points, load_steps, .. } = &scene.reference;
    if let Some(method) = method {
        known("reference.method", method, &names("reference.method"))?;
    }
    if let Some(thickness) = thickness {
        positive("reference.thickness", *thickness)?;
    }
    within("reference.extra_gauss_points", *extra_gauss_points, 0, 32)?;
    within("reference.load_steps", *load_steps, 1, 1000)?;
    check_large(scene)?;
    match (&scene.geometry.degree, named_method(scene)) {
        (Some(degree), Some(method)) if !method.works_on_patches() => Err(Error::input(
            "geometry.degree",
            format!("{degree:?} has no meaning for the method \"{}\": its elements are linear", method.name),
            "remove geometry.degree, or use reference.method = \"iga\"",
        )),
        _ => Ok(()),
    }
}

/// Beside a continuum that turns the network is in equilibrium, too: one optimiser knows how to follow that.
fn check_large(scene: &Scene) -> Result<()> {
    let calibration = &scene.calibration;
    let asked = scene.reference.kinematics == Kinematics::Corotational && calibration.objective == "displacement";
    if asked && calibration.regularisation.is_some_and(|strength| strength > 0.0) {
        let message = "groups are not drawn together beside a corotational continuum";
        return Err(Error::input("calibration.regularisation", message, "remove it, or use linear kinematics"));
    }
    match calibration.optimiser.as_deref() {
        Some(name) if asked && name != "gauss_newton" => {
            let message = format!("{name} solves K(phi) u = f, and beside a corotational continuum that is too little");
            let help = "use gauss_newton, or the objective acceleration with { loads = [...] } snapshots";
            Err(Error::input("calibration.optimiser", message, help))
        }
        _ => Ok(()),
    }
}

/// The method that the scene names, if it is known.
pub(in crate::scene) fn named_method(scene: &Scene) -> Option<&'static Method> {
    scene.reference.method.as_deref().and_then(methods::find)
}

/// Checks that a method is for bodies of `dimension` 2 or 3.
///
/// # Errors
/// [`Error::Input`] at `reference.method` with the methods that are.
pub fn check_method(method: &Method, dimension: usize) -> Result<()> {
    let fits = |method: &Method| method.dimension().is_none_or(|own| own == dimension);
    if fits(method) {
        return Ok(());
    }
    let others: Vec<&str> = methods::METHODS.iter().filter(|method| fits(method)).map(|method| method.name).collect();
    let message = format!("\"{}\" is not for bodies in {dimension}D", method.name);
    Err(Error::input("reference.method", message, format!("methods in {dimension}D are {}", others.join(", "))))
}
