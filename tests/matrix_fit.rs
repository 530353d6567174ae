//! P7 of the verification list: the springs of one square cell nearest to its bilinear element in the Frobenius norm.

use springfit::geometry::dofs::DofMap;
use springfit::geometry::shapes::{self, ShapeRequest};
use springfit::reference::material::{Material, Plane};
use springfit::reference::methods::nurbs;
use springfit::reference::stiffness;
use springfit::sparse::cholesky::Symbolic;
use springfit::springs::affine::{AffineStiffness, pattern};
use springfit::springs::weighting::{Law, Weighting, coefficients};
use springfit::springs::{grouping, topology};

/// E and t of the cell: not 1, so that a missing factor shows.
const YOUNG: f64 = 15e3;
const THICKNESS: f64 = 0.7;

#[test]
fn p7_full_frobenius_fit_of_a_square_q4_at_nu_one_third() {
    let shape = shapes::find("square").expect("in the table");
    let request = ShapeRequest { control_points: vec![2, 2], degree: vec![1, 1], ..shape.default_request() };
    let patch = (shape.build)(&request).expect("one bilinear cell");
    let dofs = DofMap::untied(2, &[[false; 3]; 4]);
    let lame = Material { young: YOUNG, poisson: 1.0 / 3.0 }.lame(2, Plane::Stress).expect("a material");
    let points = nurbs::integration_points(&patch, 0, THICKNESS);
    let coupled = stiffness::pattern(&points, &dofs);
    let element = stiffness::stiffness(&points, lame, &dofs, &coupled).expect("assembles");

    let network = (topology::find("grid").expect("in the table").connect)(&patch.grid(), patch.points(), &dofs);
    let kinds = (grouping::find("kind").expect("in the table").group)(&network, 0.5).expect("kinds need no gamma");
    let weights = coefficients(&network, Weighting::Springs, Law::Stiffness);
    let symbolic = Symbolic::analyse(&pattern(&network, &dofs), (0..8).collect()).expect("a small pattern");
    let springs = AffineStiffness::new(&network, &kinds, &weights, &dofs, &symbolic);
    let matrix = |group: usize| -> Vec<f64> {
        let column = |j: usize| {
            let (mut unit, mut image) = (vec![0.0; 8], vec![0.0; 8]);
            unit[j] = 1.0;
            springs.apply(group, &unit, &mut image);
            image
        };
        (0..8).flat_map(column).collect()
    };
    let (edges, diagonals) = (matrix(0), matrix(1));
    let mut target = vec![0.0; 64];
    element.triplet_iter().for_each(|(i, j, value)| target[8 * j + i] = *value);

    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (ee, ed, dd) = (dot(&edges, &edges), dot(&edges, &diagonals), dot(&diagonals, &diagonals));
    let (et, dt) = (dot(&edges, &target), dot(&diagonals, &target));
    let determinant = ee * dd - ed * ed;
    let (edge, diagonal) = ((et * dd - dt * ed) / determinant, (dt * ee - et * ed) / determinant);
    let rest: Vec<f64> = (0..64).map(|i| target[i] - edge * edges[i] - diagonal * diagonals[i]).collect();
    let residual = (dot(&rest, &rest) / dot(&target, &target)).sqrt();
    let scale = YOUNG * THICKNESS;
    assert!((edge / scale - 17.0 / 56.0).abs() < 1e-12, "{}", edge / scale);
    assert!((diagonal / scale - 23.0 / 56.0).abs() < 1e-12, "{}", diagonal / scale);
    assert!((residual - 0.11757927025044301).abs() < 1e-12, "{residual}");
}
