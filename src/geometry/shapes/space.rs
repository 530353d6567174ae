//! Curved bodies in space: a profile swept along a circle, weights multiplied.
//!
//! The full circle has 9 control points on the square through its corners, from (1, 0) to (1, 0) again, weights
//! 1, s, 1, s, .., 1 and the knots 0 0 0 1 1 2 2 3 3 4 4 4. Its first and last control point coincide: the body has a slit
//! there, unless nodes that lie on each other are tied (`dofs`).

use std::f64::consts::FRAC_1_SQRT_2 as S;

use super::plane::{QUARTER_CIRCLE, QUARTER_WEIGHTS, bezier_knots, disc};
use super::{Shape, refine_to};
use crate::error::Result;
use crate::geometry::knots::KnotVector;
use crate::geometry::patch::Patch;

pub(super) const TORUS: Shape = Shape {
    name: "torus",
    doc: "a torus about z, radii 0.875 and 0.375: first direction along the sweep, second radial, third along z",
    dimension: 3,
    default_control_points: &[9, 5, 5],
    default_degree: &[2, 2, 2],
    default_size: [2.5, 2.5, 0.75],
    fixed_face: "y-",
    default_force: [60.0, -30.0, 30.0],
    straight: false,
    build: |request| refine_to(torus()?, TORUS.default_size, request),
};

pub(super) const SPHEROID: Shape = Shape {
    name: "spheroid",
    doc: "two coupled hollow spheroids about x: first direction around, second along x, third from inside to outside",
    dimension: 3,
    default_control_points: &[9, 10, 3],
    default_degree: &[2, 2, 1],
    default_size: [4.0, 1.0, 1.0],
    fixed_face: "z-",
    default_force: [100.0, -50.0, 50.0],
    straight: false,
    build: |request| refine_to(spheroid()?, SPHEROID.default_size, request),
};

pub(super) const SPHERE_SHELL_OCTANT: Shape = Shape {
    name: "sphere_shell_octant",
    doc: "an eighth of the hollow sphere 1 < r < 2: around z, from the equator to the pole, outwards",
    dimension: 3,
    default_control_points: &[4, 4, 3],
    default_degree: &[2, 2, 2],
    default_size: [2.0, 2.0, 2.0],
    fixed_face: "y-",
    default_force: [20.0, 20.0, 20.0],
    straight: false,
    build: |request| refine_to(octant(1.0, 2.0)?, SPHERE_SHELL_OCTANT.default_size, request),
};

pub(super) const BALL_OCTANT: Shape = Shape {
    name: "ball_octant",
    doc: "an eighth of the unit ball: around z, from the equator to the pole, outwards; collapsed at the centre",
    dimension: 3,
    default_control_points: &[4, 4, 3],
    default_degree: &[2, 2, 2],
    default_size: [1.0, 1.0, 1.0],
    fixed_face: "y-",
    default_force: [10.0, 10.0, 10.0],
    straight: false,
    build: |request| refine_to(octant(0.0, 1.0)?, BALL_OCTANT.default_size, request),
};

/// Distance of the middle of the tube from the axis, and radius of the tube (m).
const TORUS_RADII: (f64, f64) = (0.875, 0.375);

/// The disc (x outwards, y along z) swept along the full circle. The directions around, outwards, up are left-handed: the
/// Jacobian is negative everywhere.
fn torus() -> Result<Patch> {
    let disc = disc()?;
    let (middle, tube) = TORUS_RADII;
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (x, y, around) in full_circle() {
        for (&[outwards, up, _], weight) in disc.points().iter().zip(disc.weights()) {
            let r = middle + tube * outwards;
            points.push([r * x, r * y, tube * up]);
            weights.push(around * weight);
        }
    }
    Patch::new(vec![full_circle_knots()?, disc.knots(0).clone(), disc.knots(1).clone()], points, weights)
}

/// Radii of the ten stations along x (m): two bulges and a neck.
const SPHEROID_RADII: [f64; 10] = [0.2, 0.4, 0.5, 0.4, 0.3, 0.3, 0.4, 0.5, 0.4, 0.2];

/// Where the three layers lie, as a part of the radius.
const SPHEROID_LAYERS: [f64; 3] = [0.5, 0.75, 1.0];

/// The full circle in the plane (y, z), times the radius of each station, times each layer.
fn spheroid() -> Result<Patch> {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (y, z, around) in full_circle() {
        for (station, radius) in SPHEROID_RADII.iter().enumerate() {
            for layer in SPHEROID_LAYERS {
                let x = -2.0 + 4.0 * station as f64 / 9.0;
                points.push([x, radius * layer * y, radius * layer * z]);
                weights.push(around);
            }
        }
    }
    let layers = KnotVector::open_uniform(1, SPHEROID_LAYERS.len())?;
    Patch::new(vec![full_circle_knots()?, KnotVector::open_uniform(2, SPHEROID_RADII.len())?, layers], points, weights)
}

/// An eighth of the shell between two radii: quarter circle around z, times quarter circle up to the pole.
fn octant(inner: f64, outer: f64) -> Result<Patch> {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for ([x, y], around) in QUARTER_CIRCLE.into_iter().zip(QUARTER_WEIGHTS) {
        for ([out, up], weight) in QUARTER_CIRCLE.into_iter().zip(QUARTER_WEIGHTS) {
            for r in [inner, outer] {
                points.push([r * out * x, r * out * y, r * up]);
                weights.push(around * weight);
            }
        }
    }
    Patch::new(vec![bezier_knots(2)?, bezier_knots(2)?, bezier_knots(1)?], points, weights)
}

/// Control points (x, y) and weights of the full unit circle.
fn full_circle() -> [(f64, f64, f64); 9] {
    let corners = [1.0, 1.0, 0.0, -1.0, -1.0, -1.0, 0.0, 1.0, 1.0];
    std::array::from_fn(|i| (corners[i], corners[(i + 6) % 8], if i % 2 == 0 { 1.0 } else { S }))
}

fn full_circle_knots() -> Result<KnotVector> {
    KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0])
}
