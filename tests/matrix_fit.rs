//! The matrix objective (3.17): P7 of the verification list, (3.13), and the distance against all entries one by one.

use nalgebra_sparse::CsrMatrix;
use springfit::calibration::objectives::matrix::{Reading, Target};
use springfit::calibration::optimisers::least_squares;
use springfit::error::Result;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::geometry::patch::Patch;
use springfit::geometry::shapes::{self, ShapeRequest};
use springfit::reference::material::{Material, Plane};
use springfit::reference::methods::{self, MethodBody, nurbs};
use springfit::reference::points::IntegrationPoints;
use springfit::reference::stiffness;
use springfit::sparse::cholesky::Symbolic;
use springfit::springs::affine::{AffineStiffness, pattern};
use springfit::springs::grouping::{self, Grouping, Request};
use springfit::springs::network::Network;
use springfit::springs::weighting::{Weighting, coefficients};
use springfit::springs::{formulas, topology};

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

fn assembled(points: &IntegrationPoints, poisson: f64, dofs: &DofMap) -> CsrMatrix<f64> {
    let lame = Material { young: YOUNG, poisson }.lame(points.dimension(), Plane::Stress).expect("a material");
    stiffness::stiffness(points, lame, dofs, &stiffness::pattern(points, dofs)).expect("assembles")
}

fn by_kind(dofs: DofMap, stiffness: CsrMatrix<f64>, network: Network, weighting: Weighting) -> Body {
    let kinds = (grouping::find("kind").expect("in the table").group)(&network, &Request::default())
        .expect("kinds need no gamma");
    let coefficients = coefficients(&network, weighting, &vec![1.0; network.springs.len()]);
    Body { dofs, stiffness, network, kinds, coefficients }
}

fn body(patch: &Patch, held: impl Fn([usize; 3]) -> bool, weighting: Weighting) -> Body {
    let grid = patch.grid();
    let fixed: Vec<[bool; 3]> = (0..grid.len()).map(|node| [held(grid.index(node)); 3]).collect();
    let dofs = DofMap::untied(patch.dimension(), &fixed);
    let stiffness = assembled(&nurbs::integration_points(patch, 0, THICKNESS), 1.0 / 3.0, &dofs);
    let network = (topology::find("grid").expect("in the table").connect)(&grid, patch.points(), &dofs);
    by_kind(dofs, stiffness, network, weighting)
}

/// One free cell of a finite element method.
fn element(method: &str, mesh: &Mesh, thickness: f64, poisson: f64) -> Body {
    let dofs = DofMap::untied(mesh.dimension(), &vec![[false; 3]; mesh.positions().len()]);
    let MethodBody::Mesh { points, .. } = methods::find(method).expect("in the table").body else {
        panic!("{method} works on meshes");
    };
    let stiffness = assembled(&points(mesh, thickness).expect("a cell"), poisson, &dofs);
    let network = (topology::find("grid").expect("in the table").connect_mesh)(mesh, None, &dofs);
    by_kind(dofs, stiffness, network, Weighting::Springs)
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

/// One free square: the finite element, and the spline of degree one, which are the same.
fn squares() -> [Body; 2] {
    let places = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
    let q4 = element("q4", &one(CellKind::Quadrilateral, &places), THICKNESS, 1.0 / 3.0);
    [q4, body(&shape("square", &[2, 2], 1), |_| false, Weighting::Springs)]
}

/// Stiffnesses over E t and the distance of one free square cell.
fn cell(body: &Body, reading: Reading) -> ([f64; 2], f64) {
    let target = body.target(reading);
    assert!(target.outside() < 1e-14, "{}", target.outside());
    let reduced = target.reduce(&body.kinds);
    let phi = least_squares::solve(&reduced, &[1e9; 2]).expect("two columns");
    ([phi[0] / (YOUNG * THICKNESS), phi[1] / (YOUNG * THICKNESS)], reduced.distance(&phi))
}

#[test]
fn p7_full_frobenius_fit_of_a_square_q4_at_nu_one_third() {
    for body in squares() {
        let ([edge, diagonal], distance) = cell(&body, Reading::Full);
        assert!((edge - 17.0 / 56.0).abs() < 1e-12, "{edge}");
        assert!((diagonal - 23.0 / 56.0).abs() < 1e-12, "{diagonal}");
        assert!((distance / 100.0 - 0.11757927025044301).abs() < 1e-12, "{distance}");
    }
}

#[test]
fn thesis_3_13_off_diagonal_fit_of_a_square_q4_at_nu_one_third() {
    for body in squares() {
        let ([edge, diagonal], _) = cell(&body, Reading::OffDiagonal);
        assert!((edge - 5.0 / 16.0).abs() < 1e-12, "{edge}");
        assert!((diagonal - 7.0 / 16.0).abs() < 1e-12, "{diagonal}");
    }
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

/// A mesh of one cell.
fn one(kind: CellKind, positions: &[[f64; 3]]) -> Mesh {
    let mut mesh = Mesh::new(kind.dimension(), positions.to_vec());
    mesh.push(kind, &(0..positions.len() as u32).collect::<Vec<_>>());
    mesh
}

/// Stiffness of each kind by a fit of one cell, and by Lloyd's formula for every spring.
fn fit_and_formula(method: &str, mesh: &Mesh, thickness: f64, poisson: f64, reading: Reading) -> (Vec<f64>, Vec<f64>) {
    let body = element(method, mesh, thickness, poisson);
    let reduced = body.target(reading).reduce(&body.kinds);
    let fitted = least_squares::solve(&reduced, &vec![1e9; reduced.groups()]).expect("independent columns");
    let given = given(&body, mesh, thickness, ByHand { poisson, plane_strain: false });
    (fitted, formulas::find("lloyd").expect("in the table").stiffness(&given).expect("a regular cell"))
}

/// What a formula reads of a body.
fn given<'a>(
    body: &'a Body,
    mesh: &'a Mesh,
    thickness: f64,
    ByHand { poisson, plane_strain }: ByHand,
) -> formulas::Given<'a> {
    let (network, dofs) = (&body.network, &body.dofs);
    formulas::Given { mesh, network, dofs, young: YOUNG, poisson, thickness, plane_strain }
}

#[test]
fn thesis_3_13_formulas_of_lloyd_are_the_fits_of_one_regular_cell() {
    let side = 0.6;
    let (height, s) = (side * 0.75_f64.sqrt(), side / 8.0_f64.sqrt());
    let triangle = one(CellKind::Triangle, &[[0.0; 3], [side, 0.0, 0.0], [side / 2.0, height, 0.0]]);
    let square = one(CellKind::Quadrilateral, &[[0.0; 3], [side, 0.0, 0.0], [side, side, 0.0], [0.0, side, 0.0]]);
    let tetrahedron = one(CellKind::Tetrahedron, &[[s, s, s], [-s, s, -s], [s, -s, -s], [-s, -s, s]]);
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;

    for reading in [Reading::Full, Reading::OffDiagonal] {
        let (fitted, formula) = fit_and_formula("t3", &triangle, THICKNESS, 1.0 / 3.0, reading);
        assert!(formula.iter().all(|&k| near(k, fitted[0])), "{fitted:?} {formula:?}");
        assert!(near(fitted[0], 3_f64.sqrt() / 4.0 * YOUNG * THICKNESS));
    }
    let (fitted, formula) = fit_and_formula("q4", &square, THICKNESS, 1.0 / 3.0, Reading::OffDiagonal);
    let edges = formula.iter().filter(|&&k| near(k, fitted[0])).count();
    let diagonals = formula.iter().filter(|&&k| near(k, fitted[1])).count();
    assert_eq!((edges, diagonals), (4, 2), "{fitted:?} {formula:?}");
    let (fitted, formula) = fit_and_formula("t4", &tetrahedron, 1.0, 0.25, Reading::Full);
    assert!(formula.iter().all(|&k| near(k, fitted[0])), "{fitted:?} {formula:?}");
    // the other reading
    let (fitted, _) = fit_and_formula("t4", &tetrahedron, 1.0, 0.25, Reading::OffDiagonal);
    assert!(near(fitted[0], 2_f64.sqrt() / 12.0 * YOUNG * side), "{fitted:?}");
}

/// Young's modulus, Poisson's ratio and plane strain of a formula by hand.
#[derive(Clone, Copy)]
struct ByHand {
    poisson: f64,
    plane_strain: bool,
}

const SOFT: ByHand = ByHand { poisson: 0.2, plane_strain: false };

/// The stiffness of every spring by a formula, by its ends.
fn by_formula(name: &str, mesh: &Mesh, by_hand: ByHand) -> Result<Vec<([u32; 2], f64)>> {
    let (method, thickness) = if mesh.dimension() == 2 { ("t3", THICKNESS) } else { ("t4", 1.0) };
    let body = element(method, mesh, thickness, by_hand.poisson);
    let k = formulas::find(name).expect("in the table").stiffness(&given(&body, mesh, thickness, by_hand))?;
    let mut of: Vec<([u32; 2], f64)> = body.network.springs.iter().map(|spring| spring.nodes).zip(k).collect();
    of.iter_mut().for_each(|(nodes, _)| nodes.sort_unstable());
    of.sort_by_key(|(nodes, _)| *nodes);
    Ok(of)
}

/// A rectangle of two right triangles of area 1, with edges 2, sqrt 5 (shared), 1, 1, 2.
fn rectangle() -> Mesh {
    let mut plane = Mesh::new(2, vec![[0.0; 3], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    plane.push(CellKind::Triangle, &[0, 1, 2]);
    plane.push(CellKind::Triangle, &[0, 2, 3]);
    plane
}

/// As printed there is no nu in it: the same numbers at any nu, in plane stress and plane strain.
#[test]
fn thesis_3_14_van_gelder_by_hand_whatever_nu() {
    let expected = [([0, 1], 0.25), ([0, 2], 2.0 / 5.0), ([0, 3], 1.0), ([1, 2], 1.0), ([2, 3], 0.25)];
    for (poisson, plane_strain) in [(0.0, false), (0.2, false), (0.45, false), (0.45, true)] {
        let found = by_formula("van_gelder", &rectangle(), ByHand { poisson, plane_strain }).expect("triangles");
        for ((nodes, k), (ends, number)) in found.into_iter().zip(expected) {
            assert!(nodes == ends && (k / (YOUNG * THICKNESS) - number).abs() < 1e-14, "{nodes:?} {k}");
        }
    }
}

/// cot of the angle that an edge looks at, over 2, is (a^2 + b^2 - c^2) / (8 A): 0 at the shared edge, 1/4 at the long
/// ones, 1 at the short ones.
#[test]
fn van_gelder_with_nu_by_hand() {
    let by_hand = |area_over_square: f64, half_cotangent: f64, young: f64, nu: f64| {
        young * THICKNESS * (area_over_square / (1.0 + nu) + nu / (1.0 - nu * nu) * half_cotangent)
    };
    let edges = [(0.25, 0.25), (0.4, 0.0), (1.0, 1.0), (1.0, 1.0), (0.25, 0.25)];
    for (plane_strain, young, nu) in [(false, YOUNG, 0.2), (true, YOUNG / 0.96, 0.25)] {
        let given = ByHand { plane_strain, ..SOFT };
        let found = by_formula("van_gelder_poisson", &rectangle(), given).expect("triangles");
        for ((nodes, k), (area, cotangent)) in found.into_iter().zip(edges) {
            assert!((k / by_hand(area, cotangent, young, nu) - 1.0).abs() < 1e-14, "{nodes:?} {k}");
        }
    }
    // nu = 0 is (3.14)
    let without = ByHand { poisson: 0.0, ..SOFT };
    let both =
        ["van_gelder", "van_gelder_poisson"].map(|name| by_formula(name, &rectangle(), without).expect("triangles"));
    assert_eq!(both[0], both[1]);
    // equilateral at nu = 1/3: exact, which is Lloyd's
    let triangle = one(CellKind::Triangle, &[[0.0; 3], [0.6, 0.0, 0.0], [0.3, 0.6 * 0.75_f64.sqrt(), 0.0]]);
    let third = ByHand { poisson: 1.0 / 3.0, ..SOFT };
    for (_, k) in by_formula("van_gelder_poisson", &triangle, third).expect("a triangle") {
        assert!((k / (3_f64.sqrt() / 4.0 * YOUNG * THICKNESS) - 1.0).abs() < 1e-12, "{k}");
    }
}

#[test]
fn van_gelder_with_nu_refuses_a_spring_below_zero() {
    let flat = one(CellKind::Triangle, &[[0.0; 3], [2.0, 0.0, 0.0], [1.0, 0.2, 0.0]]);
    let stiff = ByHand { poisson: 0.45, ..SOFT };
    let error = by_formula("van_gelder_poisson", &flat, stiff).expect_err("an obtuse angle").to_string();
    assert!(error.contains("spring") && error.contains("N/m: it looks at obtuse angles"), "{error}");
    assert!(by_formula("van_gelder", &flat, stiff).expect("positive").iter().all(|(_, k)| *k > 0.0));
}

/// (3.14) is for triangles; volumes in the place of areas have their own name.
#[test]
fn van_gelder_in_space_has_its_own_name() {
    let corner = one(CellKind::Tetrahedron, &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]);
    let expected = [1.0, 1.0, 1.0 / 9.0, 0.5, 0.1, 0.1].map(|number| 0.5 * number);
    let found = by_formula("van_gelder_volume", &corner, SOFT).expect("a tetrahedron");
    for ((nodes, k), number) in found.into_iter().zip(expected) {
        assert!((k / YOUNG - number).abs() < 1e-14, "{nodes:?} {k}");
    }
    for name in ["van_gelder", "van_gelder_poisson"] {
        let error = by_formula(name, &corner, SOFT).expect_err("a tetrahedron").to_string();
        assert!(error.contains("is for triangles, and this is a tetrahedron"), "{error}");
    }
}
