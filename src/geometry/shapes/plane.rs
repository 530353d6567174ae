//! Curved bodies in the plane, each from its coarsest exact patch.
//!
//! A quarter of the unit circle is the rational quadratic with the control points (1, 0), (1, 1), (0, 1) and the weights
//! 1, s, 1, where s = cos(45 deg) = sqrt(2)/2.

use std::f64::consts::FRAC_1_SQRT_2 as S;

use super::{Shape, refine_to};
use crate::error::Result;
use crate::geometry::knots::KnotVector;
use crate::geometry::patch::Patch;

pub(super) const CIRCLE: Shape = Shape {
    name: "circle",
    doc: "the disc of radius 1 about the origin, one biquadratic patch",
    dimension: 2,
    default_control_points: &[6, 6],
    default_degree: &[2, 2],
    default_size: [2.0, 2.0, 0.0],
    fixed_face: "y-",
    default_force: [600.0, 100.0, 0.0],
    straight: false,
    build: |request| refine_to(disc()?, CIRCLE.default_size, request),
};

pub(super) const ELLIPSE: Shape = Shape {
    name: "ellipse",
    doc: "the ellipse with the half axes 1 and 0.5: the disc, squeezed along y",
    dimension: 2,
    default_control_points: &[6, 6],
    default_degree: &[2, 2],
    default_size: [2.0, 1.0, 0.0],
    fixed_face: "y-",
    default_force: [1600.0, 200.0, 0.0],
    straight: false,
    // The size is always given against the disc, whose extent is 2 x 2.
    build: |request| refine_to(disc()?, CIRCLE.default_size, request),
};

pub(super) const QUARTER_RING: Shape = Shape {
    name: "quarter_ring",
    doc: "a quarter of the ring 1 < r < 2: first direction radial, second along the arc",
    dimension: 2,
    default_control_points: &[4, 4],
    default_degree: &[2, 2],
    default_size: [2.0, 2.0, 0.0],
    fixed_face: "y-",
    default_force: [50.0, 50.0, 0.0],
    straight: false,
    build: |request| refine_to(quarter_ring()?, QUARTER_RING.default_size, request),
};

pub(super) const PLATE_WITH_HOLE: Shape = Shape {
    name: "plate_with_hole",
    doc: "[-4, 0] x [0, 4] without the disc of radius 1: first direction along the hole; two control points coincide",
    dimension: 2,
    default_control_points: &[6, 6],
    default_degree: &[2, 2],
    default_size: [4.0, 4.0, 0.0],
    fixed_face: "x-",
    default_force: [10.0, 10.0, 0.0],
    straight: false,
    build: |request| refine_to(plate_with_hole()?, PLATE_WITH_HOLE.default_size, request),
};

/// The unit disc; first direction along x, second along y.
pub(super) fn disc() -> Result<Patch> {
    let steps = [-1.0, 0.0, 1.0];
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for i in steps {
        for j in steps {
            // Corners at (+-s, +-s), the middles of the edges at distance 2 s.
            let reach: f64 = if i == 0.0 || j == 0.0 { 2.0 * S } else { S };
            points.push([reach * i, reach * j, 0.0]);
            weights.push(if (i == 0.0) == (j == 0.0) { 1.0 } else { S });
        }
    }
    Patch::new(vec![bezier_knots(2)?, bezier_knots(2)?], points, weights)
}

/// Radii 1 and 2 times the quarter circle.
fn quarter_ring() -> Result<Patch> {
    let points = [1.0, 2.0].iter().flat_map(|r| QUARTER_CIRCLE.map(|[x, y]| [r * x, r * y, 0.0])).collect();
    Patch::new(vec![bezier_knots(1)?, bezier_knots(2)?], points, [QUARTER_WEIGHTS, QUARTER_WEIGHTS].concat())
}

/// The hole as two eighths of a circle, then a row half way, then the outer edges; their corner stands twice.
fn plate_with_hole() -> Result<Patch> {
    let hole = [[-1.0, 0.0], [-1.0, TAN_PI_8], [-TAN_PI_8, 1.0], [0.0, 1.0]];
    let middle = [[-2.5, 0.0], [-2.5, 0.75], [-0.75, 2.5], [0.0, 2.5]];
    let edge = [[-4.0, 0.0], [-4.0, 4.0], [-4.0, 4.0], [0.0, 4.0]];
    // The quarter circle with a knot in its middle: the mean of the weights 1 and s.
    let arc_weights = [1.0, (1.0 + S) / 2.0, (1.0 + S) / 2.0, 1.0];
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for i in 0..4 {
        points.extend([hole[i], middle[i], edge[i]].map(|[x, y]| [x, y, 0.0]));
        weights.extend([arc_weights[i], 1.0, 1.0]);
    }
    let along = KnotVector::new(2, vec![0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0])?;
    Patch::new(vec![along, bezier_knots(2)?], points, weights)
}

/// tan(pi/8) = sqrt(2) - 1.
const TAN_PI_8: f64 = 2.0 * S - 1.0;

/// Control points of a quarter of the unit circle, from (1, 0) to (0, 1).
pub(super) const QUARTER_CIRCLE: [[f64; 2]; 3] = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// Their weights.
pub(super) const QUARTER_WEIGHTS: [f64; 3] = [1.0, S, 1.0];

/// Knots of one span [0, 1].
pub(super) fn bezier_knots(degree: usize) -> Result<KnotVector> {
    KnotVector::open_uniform(degree, degree + 1)
}
