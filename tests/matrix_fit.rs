//! The matrix objective (3.17): P7 of the verification list, (3.13), and the distance against all entries one by one.

use nalgebra_sparse::CsrMatrix;
use springfit::calibration::objectives::matrix::{Reading, Target};
use springfit::calibration::optimisers::least_squares;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::patch::Patch;
use springfit::geometry::shapes::{self, ShapeRequest};
use springfit::reference::material::{Material, Plane};
use springfit::reference::methods::nurbs;
use springfit::reference::stiffness;
use springfit::sparse::cholesky::Symbolic;
use springfit::springs::affine::{AffineStiffness, pattern};
use springfit::springs::grouping::Grouping;
use springfit::springs::network::Network;
use springfit::springs::weighting::{Law, Weighting, coefficients};
use springfit::springs::{grouping, topology};

/// E and t of the cell: not 1, so that a missing factor shows.
const YOUNG: f64 = 15e3;
const THICKNESS: f64 = 0.7;

/// A body with its stiffness and its springs by kind.
struct Body {
    dofs: DofMap,
    stiffness: CsrMatrix<f64>,
    network: Network,
    kinds: Grouping,
    coefficients: Vec<f64>,
}

fn body(patch: &Patch, held: impl Fn([usize; 3]) -> bool, weighting: Weighting) -> Body {
    let grid = patch.grid();
    let fixed: Vec<[bool; 3]> = (0..grid.len()).map(|node| [held(grid.index(node)); 3]).collect();
    let dofs = DofMap::untied(patch.dimension(), &fixed);
    let lame =
        Material { young: YOUNG, poisson: 1.0 / 3.0 }.lame(patch.dimension(), Plane::Stress).expect("a material");
    let points = nurbs::integration_points(patch, 0, THICKNESS);
    let coupled = stiffness::pattern(&points, &dofs);
    let stiffness = stiffness::stiffness(&points, lame, &dofs, &coupled).expect("assembles");
    let network = (topology::find("grid").expect("in the table").connect)(&grid, patch.points(), &dofs);
    let kinds = (grouping::find("kind").expect("in the table").group)(&network, 0.5).expect("kinds need no gamma");
    let coefficients = coefficients(&network, weighting, Law::Stiffness);
    Body { dofs, stiffness, network, kinds, coefficients }
}

fn shape(name: &str, control_points: &[usize], degree: usize) -> Patch {
    let shape = shapes::find(name).expect("in the table");
    let (control_points, degree) = (control_points.to_vec(), vec![degree; shape.dimension]);
    (shape.build)(&ShapeRequest { control_points, degree, ..shape.default_request() }).expect("a body")
}

impl Body {
    fn target(&self, reading: Reading) -> Target<'_> {
        let Self { dofs, stiffness, network, coefficients, .. } = self;
        Target { network, coefficients, dofs, stiffness, reading }
    }

    /// K(phi), dense.
    fn springs(&self, phi: &[f64]) -> Vec<f64> {
        let n = self.dofs.len();
        let order = (0..n as u32).collect();
        let symbolic = Symbolic::analyse(&pattern(&self.network, &self.dofs), order).expect("a small pattern");
        let springs = AffineStiffness::new(&self.network, &self.kinds, &self.coefficients, &self.dofs, &symbolic);
        let column = |j: usize| {
            let (mut unit, mut image) = (vec![0.0; n], vec![0.0; n]);
            unit[j] = 1.0;
            springs.apply_all(phi, &unit, &mut image);
            image
        };
        (0..n).flat_map(column).collect()
    }

    /// K_ref, dense.
    fn continuum(&self) -> Vec<f64> {
        let n = self.dofs.len();
        let mut dense = vec![0.0; n * n];
        self.stiffness.triplet_iter().for_each(|(i, j, value)| dense[n * j + i] = *value);
        dense
    }
}

/// Stiffnesses over E t and the distance of one free square cell.
fn cell(reading: Reading) -> ([f64; 2], f64) {
    let body = body(&shape("square", &[2, 2], 1), |_| false, Weighting::Springs);
    let target = body.target(reading);
    assert!(target.outside() < 1e-14, "{}", target.outside());
    let reduced = target.reduce(&body.kinds);
    let phi = least_squares::solve(&reduced, &[1e9; 2]).expect("two columns");
    ([phi[0] / (YOUNG * THICKNESS), phi[1] / (YOUNG * THICKNESS)], reduced.distance(&phi))
}

#[test]
fn p7_full_frobenius_fit_of_a_square_q4_at_nu_one_third() {
    let ([edge, diagonal], distance) = cell(Reading::Full);
    assert!((edge - 17.0 / 56.0).abs() < 1e-12, "{edge}");
    assert!((diagonal - 23.0 / 56.0).abs() < 1e-12, "{diagonal}");
    assert!((distance / 100.0 - 0.11757927025044301).abs() < 1e-12, "{distance}");
}

#[test]
fn thesis_3_13_off_diagonal_fit_of_a_square_q4_at_nu_one_third() {
    let ([edge, diagonal], _) = cell(Reading::OffDiagonal);
    assert!((edge - 5.0 / 16.0).abs() < 1e-12, "{edge}");
    assert!((diagonal - 7.0 / 16.0).abs() < 1e-12, "{diagonal}");
}

/// Inside and outside of the pattern together are the distance of the whole matrices, under a spline of degree two whose
/// matrix is larger than that of the springs, with held nodes and shared springs.
#[test]
fn thesis_3_17_distance_is_that_of_all_entries() {
    let cases = [shape("square", &[5, 4], 2), shape("cube", &[4, 4, 3], 2), shape("ellipse", &[4, 5], 3)];
    for patch in &cases {
        for reading in [Reading::Full, Reading::OffDiagonal] {
            let body = body(patch, |[_, j, _]| j == 0, Weighting::Cells);
            let target = body.target(reading);
            let reduced = target.reduce(&body.kinds);
            let phi: Vec<f64> = (0..body.kinds.groups.len()).map(|a| 700.0 + 300.0 * a as f64).collect();
            let (springs, continuum) = (body.springs(&phi), body.continuum());
            let n = body.dofs.len();
            let (mut apart, mut whole) = (0.0, 0.0);
            for (at, (k, k_ref)) in springs.iter().zip(&continuum).enumerate() {
                let same_node = body.dofs.owner(at / n).0 == body.dofs.owner(at % n).0;
                if reading == Reading::Full || !same_node {
                    apart += (k - k_ref).powi(2);
                    whole += k_ref * k_ref;
                }
            }
            let direct = 100.0 * (apart / whole).sqrt();
            let ours = reduced.distance(&phi).hypot(target.outside());
            assert!((ours / direct - 1.0).abs() < 1e-12, "{reading:?}: {ours} {direct}");
            assert!(target.outside() > 1.0, "a spline couples nodes two steps apart: {}", target.outside());
        }
    }
}

/// A continuum that is a network is found again, and nothing is left.
#[test]
fn a_matrix_of_springs_is_recovered() {
    let mut body = body(&shape("cube", &[4, 3, 4], 1), |[_, _, k]| k == 0, Weighting::Cells);
    let truth = [500.0, 0.0, 125.0];
    let n = body.dofs.len();
    let dense = body.springs(&truth);
    body.stiffness.triplet_iter_mut().for_each(|(i, j, value)| *value = dense[n * j + i]);
    for reading in [Reading::Full, Reading::OffDiagonal] {
        let reduced = body.target(reading).reduce(&body.kinds);
        let phi = least_squares::solve(&reduced, &[1e5; 3]).expect("three columns");
        assert!(phi.iter().zip(truth).all(|(p, t)| (p - t).abs() <= 1e-12 * 500.0), "{phi:?}");
        assert!(reduced.distance(&phi) < 1e-12, "{}", reduced.distance(&phi));
    }
}
