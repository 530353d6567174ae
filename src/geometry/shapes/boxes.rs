//! Boxes: square, cube, plate and beam. Control point (i, j, k) is (i L_x / (n_x - 1), j L_y / (n_y - 1), ..), the
//! corner at the origin; open uniform knots, weights 1.

use super::{Shape, ShapeRequest, check_control_points, check_request};
use crate::error::Result;
use crate::geometry::grid::Grid;
use crate::geometry::knots::KnotVector;
use crate::geometry::patch::Patch;

pub(super) const SQUARE: Shape = Shape {
    name: "square",
    doc: "the square [0, 2] x [0, 2]",
    dimension: 2,
    default_control_points: &[6, 6],
    default_degree: &[2, 2],
    default_size: [2.0, 2.0, 0.0],
    fixed_face: "y-",
    default_force: [200.0, -200.0, 0.0],
    straight: true,
    build: |request| equally_spaced(2, request),
};

pub(super) const CUBE: Shape = Shape {
    name: "cube",
    doc: "the cube [0, 2] x [0, 2] x [0, 2]",
    dimension: 3,
    default_control_points: &[6, 6, 6],
    default_degree: &[2, 2, 2],
    default_size: [2.0, 2.0, 2.0],
    fixed_face: "z-",
    default_force: [80.0, -40.0, 40.0],
    straight: true,
    build: |request| equally_spaced(3, request),
};

pub(super) const PLATE: Shape = Shape {
    name: "plate",
    doc: "a thick square plate, 2 x 2 x 0.4, one layer of cells",
    dimension: 3,
    default_control_points: &[7, 7, 2],
    default_degree: &[2, 2, 1],
    default_size: [2.0, 2.0, 0.4],
    fixed_face: "x-",
    default_force: [0.0, 0.0, -0.5],
    straight: true,
    build: |request| equally_spaced(3, request),
};

pub(super) const BEAM: Shape = Shape {
    name: "beam",
    doc: "a beam along x, 5 x 1 x 1",
    dimension: 3,
    default_control_points: &[12, 4, 4],
    default_degree: &[2, 2, 2],
    default_size: [5.0, 1.0, 1.0],
    fixed_face: "x-",
    default_force: [0.0, 0.0, -0.2],
    straight: true,
    build: |request| equally_spaced(3, request),
};

fn equally_spaced(dimension: usize, request: &ShapeRequest) -> Result<Patch> {
    check_request(dimension, request)?;
    check_control_points(request, &request.degree.iter().map(|p| p + 1).collect::<Vec<_>>())?;
    let grid = Grid::new(&request.control_points);
    let place = |node: usize| {
        let index = grid.index(node);
        let along = |a: usize| request.size[a] * (index[a] as f64 / (request.control_points[a] - 1) as f64);
        std::array::from_fn(|a| if a < dimension { along(a) } else { 0.0 })
    };
    let directions = request.degree.iter().zip(&request.control_points);
    let knots = directions.map(|(&p, &n)| KnotVector::open_uniform(p, n)).collect::<Result<_>>()?;
    Patch::new(knots, (0..grid.len()).map(place).collect(), vec![1.0; grid.len()])
}
