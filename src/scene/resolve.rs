//! The scene with every default written out, as the result prints it.

use crate::reference::methods::Method;

use super::{Axis, Plane, Scene};

/// Fills in what depends on the body, of `dimension` 2 or 3, and its method: extents, control points and degree of a shape
/// (no degree under finite elements), cells of a mesh, the held components, in 2D plane and thickness, the profile of the springs, the optimiser, and the settings of the
/// objective.
///
/// A body from a file keeps its own extents, control points and degree; they stay absent.
pub fn resolve(scene: &Scene, dimension: usize, method: &Method) -> Scene {
    let mut resolved = scene.clone();
    let geometry = &mut resolved.geometry;
    if let Some(shape) = geometry.known_shape() {
        geometry.size.get_or_insert_with(|| shape.default_size[..dimension].to_vec());
        geometry.control_points.get_or_insert_with(|| shape.default_control_points.to_vec());
        if method.works_on_patches() {
            geometry.degree.get_or_insert_with(|| shape.default_degree.to_vec());
        }
    }
    if let Some(shape) = geometry.known_mesh() {
        geometry.size.get_or_insert_with(|| shape.default_size[..dimension].to_vec());
        geometry.cells.get_or_insert_with(|| shape.default_cells.to_vec());
    }
    resolved.springs.profile = Some(resolved.springs.profile().to_owned());
    resolved.reference.method.get_or_insert_with(|| method.name.to_owned());
    for support in resolved.support.tables_mut() {
        support.components.get_or_insert_with(|| Axis::ALL[..dimension].to_vec());
    }
    if dimension == 2 {
        resolved.reference.plane.get_or_insert(Plane::Stress);
        resolved.reference.thickness.get_or_insert(1.0);
    }
    let kinematics = resolved.reference.kinematics;
    if let Some(dynamics) = &mut resolved.dynamics {
        let integrator = dynamics.integrator(kinematics).to_owned();
        if dynamics.turns(kinematics) {
            dynamics.tangent = Some(dynamics.tangent(&integrator));
        }
        dynamics.integrator = Some(integrator);
    }
    let calibration = &mut resolved.calibration;
    calibration.optimiser = calibration.optimiser().map(str::to_owned);
    match calibration.objective.as_str() {
        "matrix" => drop(calibration.matrix.get_or_insert_default()),
        "acceleration" => {
            let given = calibration.acceleration.take().unwrap_or_default();
            calibration.acceleration = Some(given.resolved(dimension));
        }
        _ => {}
    }
    resolved
}
