//! The iterative path of the reference against the direct one: same displacements, norms, measures and estimates of the
//! errors for every kind of body, support and tie; iteration counts; bits.

use nalgebra_sparse::CsrMatrix;
use nalgebra_sparse::csr::CsrRow;
use springfit::error::Error;
use springfit::geometry::dofs::{DofMap, tie_coincident};
use springfit::geometry::patch::Patch;
use springfit::geometry::selection::face_nodes;
use springfit::geometry::shapes;
use springfit::reference::loads::{self, Load};
use springfit::reference::material::{Lame, Material, Plane};
use springfit::reference::matrix_free::solve::memory_bytes;
use springfit::reference::methods::nurbs;
use springfit::reference::{self, Path, Reference, reason_to_factor};
use springfit::sparse::ordering::minimum_degree;

const MATERIAL: Material = Material { young: 15e3, poisson: 0.3 };

/// A body of the table, held and loaded as the table says.
struct Case {
    patch: Patch,
    held: Vec<[bool; 3]>,
    merged: bool,
    plane: Plane,
    extra: usize,
}

impl Case {
    fn new(name: &str, control_points: &[usize], degree: &[usize]) -> Self {
        let shape = shapes::find(name).expect("a shape");
        let mut request = shape.default_request();
        request.control_points = control_points.to_vec();
        request.degree = degree.to_vec();
        let patch = (shape.build)(&request).expect("a body");
        let mut case = Self { held: vec![], merged: false, plane: Plane::Stress, extra: 0, patch };
        let face = face_nodes(&case.patch.grid(), shape.fixed_face).expect("a face");
        case.hold(&face, [true; 3]);
        case
    }

    fn hold(&mut self, nodes: &[u32], components: [bool; 3]) {
        self.held = vec![[false; 3]; self.patch.points().len()];
        nodes.iter().for_each(|&node| self.held[node as usize] = components);
    }

    fn dofs(&self) -> DofMap {
        let master = match self.merged {
            true => tie_coincident(self.patch.points(), 1e-9),
            false => (0..self.held.len() as u32).collect(),
        };
        DofMap::new(self.patch.dimension(), master, &self.held)
    }

    fn lame(&self) -> Lame {
        MATERIAL.lame(self.patch.dimension(), self.plane).expect("a material")
    }

    fn loads(&self, dofs: &DofMap) -> Vec<Load> {
        let tilted = loads::per_node(dofs, [3.0, -2.0, 1.0]).expect("a load");
        let last = dofs.masters().filter(|&node| dofs.free(node).iter().all(|&dof| dof != u32::MAX)).last();
        vec![tilted, loads::point(dofs, last.expect("a free node"), [1.0, 1.0, -1.0]).expect("a load")]
    }

    fn iterative(&self) -> Reference {
        let dofs = self.dofs();
        let points = nurbs::integration_points(&self.patch, self.extra, 0.7);
        let solved = Reference::iterative(&points, self.lame(), &dofs, &self.loads(&dofs));
        solved.expect("a body that is not folded").expect("an iteration that converges")
    }

    fn direct(&self) -> Reference {
        let dofs = self.dofs();
        let points = nurbs::integration_points(&self.patch, self.extra, 0.7);
        let pattern = springfit::reference::stiffness::pattern(&points, &dofs);
        let order = minimum_degree(&pattern).expect("an order");
        Reference::direct(&points, self.lame(), &dofs, order, &self.loads(&dofs), "").expect("a solution")
    }

    /// Both paths; returns the iterations of the first load.
    fn compare(&self, what: &str) -> usize {
        let (fast, exact) = (self.iterative(), self.direct());
        let relative = |a: f64, b: f64| (a / b - 1.0).abs();
        for (a, b) in fast.cases.iter().zip(&exact.cases) {
            let norm = b.displacement.iter().map(|u| u * u).sum::<f64>().sqrt();
            let difference = a.displacement.iter().zip(&b.displacement).map(|(a, b)| (a - b).powi(2));
            let error = difference.sum::<f64>().sqrt() / norm;
            assert!(error < 1e-10, "{what}: displacements differ by {error:.1e}");
            assert!(relative(a.compliance, b.compliance) < 1e-11 && relative(a.u_max, b.u_max) < 1e-10, "{what}");
        }
        let norms = relative(fast.stiffness_frobenius(), exact.stiffness_frobenius());
        assert!(norms < 1e-11, "{what}: Frobenius norms differ by {norms:.1e}");
        assert!(relative(fast.measure, exact.measure) < 1e-12, "{what}");
        let (sure, exactly) = (fast.accuracy, exact.accuracy);
        assert!(sure.backward_error < 1e-14, "{what}: {sure:?}");
        let stored = exact.stiffness.as_ref().expect("a factored matrix");
        let error = fast.cases.iter().zip(self.loads(&self.dofs())).map(|(case, load)| error_of(stored, case, &load));
        let error = error.fold(0.0, f64::max);
        // two ways to round K: where a map is nearly singular its entries agree to some 1e-14
        assert!(error < 3e-14, "{what}: {error:.1e} on the matrix, {sure:?}");
        println!("{what}: backward error {error:.1e} on the matrix, {:.1e} on the product", sure.backward_error);
        let condition = sure.condition / exactly.condition;
        assert!((0.5..2.0).contains(&condition), "{what}: {sure:?} and {exactly:?}");
        for (a, b) in fast.cases.iter().zip(&exact.cases) {
            let largest = b.displacement.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
            let off = a.displacement.iter().zip(&b.displacement).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            assert!(off / largest <= sure.forward_error, "{what}: off by {:.1e}, {sure:?}", off / largest);
        }
        let forward = sure.forward_error / exactly.forward_error;
        assert!((0.5..2.0).contains(&forward), "{what}: {sure:?} and {exactly:?}");
        println!("{what}: {sure:?}, of the direct path's condition {condition:.3}, bound {forward:.3}");
        let Path::Iterative { iterations, residual } = &fast.path else { panic!("{what} was iterated") };
        println!("{what}: {iterations:?} iterations, residual {residual:.1e}, norm {norms:.1e}");
        iterations[0]
    }
}

/// Componentwise backward error on the assembled matrix.
fn error_of(stiffness: &CsrMatrix<f64>, case: &reference::Case, load: &Load) -> f64 {
    let row = |(i, row): (usize, CsrRow<f64>)| {
        let terms = row.col_indices().iter().zip(row.values()).map(|(&j, k)| k * case.displacement[j]);
        let (sum, scale) = terms.fold((0.0, 0.0), |(sum, scale), term| (sum + term, scale + term.abs()));
        let rest: f64 = load.forces[i] - sum;
        if rest == 0.0 { 0.0 } else { rest.abs() / (scale + load.forces[i].abs()) }
    };
    stiffness.row_iter().enumerate().map(row).fold(0.0, f64::max)
}

#[test]
fn bodies_of_every_kind_agree_with_the_direct_path() {
    for (name, control_points, degree) in [
        ("square", &[9, 12][..], &[2, 2][..]),
        ("circle", &[8, 7], &[2, 2]),
        ("quarter_ring", &[7, 6], &[3, 2]),
        ("cube", &[6, 7, 10], &[2, 2, 2]),
        ("cube", &[6, 5, 5], &[3, 1, 4]),
        ("torus", &[9, 5, 5], &[2, 2, 2]),
        ("spheroid", &[9, 10, 3], &[2, 2, 1]),
        ("plate", &[12, 9, 2], &[2, 2, 1]),
        ("sphere_shell_octant", &[6, 5, 4], &[2, 2, 2]),
    ] {
        Case::new(name, control_points, degree).compare(name);
    }
}

#[test]
fn plane_strain_thickness_and_extra_gauss_points_agree() {
    let mut case = Case::new("circle", &[7, 7], &[2, 2]);
    case.plane = Plane::Strain;
    case.extra = 2;
    case.compare("circle in plane strain with two more points");
    let mut case = Case::new("torus", &[9, 5, 5], &[2, 2, 2]);
    case.extra = 1;
    case.compare("torus with one more point");
}

#[test]
fn supports_that_are_not_faces_agree() {
    let mut case = Case::new("cube", &[6, 6, 6], &[2, 2, 2]);
    case.hold(&[0, 5, 30, 210, 100], [true; 3]);
    case.compare("cube held at nodes");
    let mut case = Case::new("square", &[6, 9], &[2, 2]);
    case.hold(&[0, 1, 9, 10, 11, 53], [true; 3]);
    case.compare("square held at nodes");
    let mut case = Case::new("cube", &[5, 6, 7], &[2, 2, 2]);
    let face = face_nodes(&case.patch.grid(), "x+").expect("a face");
    case.hold(&face, [true, false, false]);
    for node in [0, 1, 3, 40] {
        case.held[node] = [false, true, true];
    }
    case.compare("cube on rollers");
}

#[test]
fn merged_seams_agree() {
    for (name, control_points, degree) in
        [("torus", &[9, 5, 5][..], &[2, 2, 2][..]), ("spheroid", &[9, 10, 3], &[2, 2, 1])]
    {
        let mut case = Case::new(name, control_points, degree);
        case.merged = true;
        assert!(case.dofs().masters().count() < case.held.len());
        case.compare(&format!("{name} with a merged seam"));
    }
}

#[test]
fn iterations_hardly_depend_on_the_mesh() {
    let counts: Vec<usize> =
        [5, 9, 17].iter().map(|&n| Case::new("cube", &[n; 3], &[2; 3]).compare(&format!("cube {n}^3"))).collect();
    assert!(counts[2] <= counts[1] + 5 && counts[2] <= 50, "{counts:?}");
    let counts: Vec<usize> = [[9, 10, 3], [17, 18, 5]]
        .iter()
        .map(|n| Case::new("spheroid", n, &[2, 2, 1]).compare(&format!("spheroid {n:?}")))
        .collect();
    assert!(counts[1] <= counts[0] + 20, "{counts:?}");
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let mut case = Case::new("torus", &[25, 6, 5], &[2, 2, 2]);
    case.merged = true;
    let solve = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let solved = pool.install(|| case.iterative());
        (solved.stiffness_frobenius(), solved.measure, solved.accuracy, solved.cases, solved.path)
    };
    let one = solve(1);
    assert_eq!(solve(2), one);
    assert_eq!(solve(4), one);
}

#[test]
fn the_path_is_chosen_by_size_and_said() {
    let path = |case: &Case| {
        let dofs = case.dofs();
        let points = nurbs::integration_points(&case.patch, 0, 1.0);
        let pattern = springfit::reference::stiffness::pattern(&points, &dofs);
        let order = minimum_degree(&pattern).expect("an order");
        let reason = reason_to_factor(&points, &dofs);
        let path = Reference::solve(&points, case.lame(), &dofs, order, &case.loads(&dofs)).expect("a solution").path;
        (reason, path)
    };
    let (reason, small) = path(&Case::new("cube", &[5; 3], &[2; 3]));
    assert_eq!(small, Path::Direct { reason: reason.expect("a reason") });
    let (reason, fine) = path(&Case::new("cube", &[12; 3], &[2; 3]));
    assert!(reason.is_none() && matches!(fine, Path::Iterative { .. }));
}

#[test]
fn hard_case_folded_body() {
    let mut case = Case::new("cube", &[5; 3], &[2; 3]);
    let mut points = case.patch.points().to_vec();
    points[62] = [9.0, 9.0, 9.0];
    let knots = (0..3).map(|a| case.patch.knots(a).clone()).collect();
    case.patch = Patch::new(knots, points, case.patch.weights().to_vec()).expect("a patch");
    let dofs = case.dofs();
    let integration = nurbs::integration_points(&case.patch, 0, 1.0);
    match Reference::iterative(&integration, case.lame(), &dofs, &case.loads(&dofs)) {
        Err(Error::FoldedElement { element, point, .. }) => assert_eq!((element.len(), point.len()), (3, 3)),
        other => panic!("a folded body gave {other:?}"),
    }
}

#[test]
fn memory_grows_like_the_body() {
    let bytes = |n: usize| {
        let case = Case::new("cube", &[n; 3], &[2; 3]);
        memory_bytes(&case.patch, 0, case.dofs().len(), 1, 2)
    };
    let (coarse, fine) = (bytes(17), bytes(33));
    assert!(fine < 300_000_000 && fine < 10 * coarse, "{coarse} and {fine} bytes");
}
