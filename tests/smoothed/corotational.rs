//! Large rotations: forces against energies, tangents against forces, equilibrium against the reference file.

use crate::bodies::*;
use nalgebra_sparse::CsrMatrix;
use nalgebra_sparse::na::{Matrix3, Rotation3, SymmetricEigen, Vector3};
use springfit::reference::corotational::Tangent;
use springfit::reference::corotational::body::Corotational;
use springfit::reference::corotational::held::Held;
use springfit::reference::corotational::statics::{self, Search};
use springfit::reference::methods::smoothed::{Domains, Smoothing};
use springfit::reference::methods::t10;
use springfit::rng::Stream;
use springfit::sparse::block_jacobi::BlockJacobi;
use springfit::sparse::cg;
use springfit::sparse::cholesky::{Factor, Symbolic};
use springfit::sparse::ordering::minimum_degree;

const TANGENTS: [Tangent; 3] = [Tangent::Warped, Tangent::Exact, Tangent::Positive];

/// Places turned by a large angle, stretched and shaken.
fn deformed(positions: &[[f64; 3]], shaking: f64, seed: u64) -> Vec<[f64; 3]> {
    let turn = Rotation3::from_euler_angles(2.0, -0.7, 1.1).into_inner();
    let stretch = Matrix3::new(1.3, 0.2, 0.0, -0.1, 0.8, 0.1, 0.05, 0.0, 1.1);
    let mut stream = Stream::new(seed, 0, 0);
    let place = |x: &[f64; 3]| {
        let shaken = stretch * Vector3::from(*x) + Vector3::from_fn(|_, _| shaking * stream.normal());
        (turn * shaken + Vector3::new(3.0, -2.0, 1.0)).into()
    };
    positions.iter().map(place).collect()
}

fn largest(vectors: &[[f64; 3]]) -> f64 {
    vectors.as_flattened().iter().fold(0.0, |most: f64, f| most.max(f.abs()))
}

fn body(domains: Domains) -> Corotational {
    Corotational::new(domains, lame(0.3)).expect("in space")
}

fn forces(body: &mut Corotational, places: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut forces = vec![[0.0; 3]; places.len()];
    body.place(places);
    body.forces(&mut forces);
    forces
}

#[test]
fn acceptance_a_rigid_motion_has_no_force() {
    for (name, domains, positions) in every_method(&beam([4, 2, 2], 0.4, 2)) {
        let mut body = body(domains);
        for (angles, far) in
            [([2.0, -0.7, 1.1], 3.0), ([std::f64::consts::PI, 0.0, 0.0], 100.0), ([0.1, 1.5, -3.0], 0.0)]
        {
            let turn = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).into_inner();
            let places: Vec<[f64; 3]> =
                positions.iter().map(|x| (turn * Vector3::from(*x) + Vector3::from_element(far)).into()).collect();
            let force = largest(&forces(&mut body, &places));
            // beside E h, the force of a strain of 1
            assert!(force < 1e-10 * 1e6 * 0.05 * 0.05, "{name}: {force:e}");
            assert!(body.energy() < 1e-20 * 1e6, "{name}: {}", body.energy());
        }
    }
}

#[test]
fn acceptance_forces_and_torques_add_up_to_nothing() {
    for (name, domains, positions) in every_method(&beam([4, 2, 2], 0.4, 2)) {
        let places = deformed(&positions, 0.01, 5);
        let forces = forces(&mut body(domains), &places);
        let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
        for (f, x) in forces.iter().zip(&places) {
            force += Vector3::from(*f);
            torque += Vector3::from(*x).cross(&Vector3::from(*f));
        }
        let size = largest(&forces);
        assert!(force.amax() < 1e-12 * size && torque.amax() < 1e-12 * size, "{name}: {force} {torque} {size}");
    }
}

/// A linear map of the body leaves the inside in balance, however far it turns.
#[test]
fn acceptance_patch_test_of_large_rotations() {
    for (name, domains, positions) in every_method(&beam([4, 4, 4], 0.4, 3)) {
        let places = deformed(&positions, 0.0, 1);
        let forces = forces(&mut body(domains), &places);
        let inside = |x: &[f64; 3]| (0..3).all(|i| x[i] > 1e-12 && x[i] < SIZE[i] - 1e-12);
        let inner = positions.iter().zip(&forces).filter(|(x, _)| inside(x));
        let imbalance = inner.map(|(_, f)| largest(&[*f])).fold(0.0, f64::max);
        assert!(imbalance < 1e-12 * largest(&forces), "{name}: {imbalance:e} of {:e}", largest(&forces));
    }
}

#[test]
fn acceptance_gather_identity_1e_14() {
    for (name, domains, positions) in every_method(&beam([4, 2, 2], 0.45, 2)) {
        let places = deformed(&positions, 0.01, 6);
        let mut body = body(domains);
        let gathered = forces(&mut body, &places);
        let mut direct = vec![[0.0; 3]; places.len()];
        // what the terms of the sums are as large as
        let mut terms = 0.0_f64;
        for k in 0..body.domains().len() {
            for acting in body.domains().acting(k) {
                let force = body.stress(k) * Vector3::from(acting.gradient) * body.domains().volume(k);
                terms = terms.max(force.amax());
                (0..3).for_each(|i| direct[acting.node as usize][i] -= force[i]);
            }
        }
        let difference = gathered.as_flattened().iter().zip(direct.as_flattened()).map(|(a, b)| (a - b).abs());
        let size = terms.max(largest(&direct));
        assert!(difference.fold(0.0, f64::max) < 1e-14 * size, "{name}");
    }
}

/// Central differences of the energy along random directions.
#[test]
fn acceptance_the_force_is_the_gradient_of_the_energy_1e_7() {
    for (name, domains, positions) in every_method(&beam([3, 2, 2], 0.3, 2)) {
        let places = deformed(&positions, 0.01, 7);
        let mut body = body(domains);
        let forces = forces(&mut body, &places);
        let mut stream = Stream::new(8, 0, 0);
        for _ in 0..4 {
            let direction: Vec<[f64; 3]> = places.iter().map(|_| [0; 3].map(|_| stream.normal())).collect();
            let mut energy = |h: f64| {
                body.place(&moved(&places, &direction, h));
                body.energy()
            };
            let h = 2e-6;
            let slope = (energy(h) - energy(-h)) / (2.0 * h);
            let exact: f64 =
                -forces.as_flattened().iter().zip(direction.as_flattened()).map(|(f, d)| f * d).sum::<f64>();
            let size = norm(&forces) * norm(&direction);
            assert!((slope - exact).abs() < 1e-7 * size, "{name}: {slope} {exact} {size}");
            assert!(exact.abs() > 1e-4 * size, "the direction is not across the force");
        }
    }
}

fn norm(vectors: &[[f64; 3]]) -> f64 {
    vectors.as_flattened().iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn moved(places: &[[f64; 3]], direction: &[[f64; 3]], h: f64) -> Vec<[f64; 3]> {
    places.iter().zip(direction).map(|(x, d)| [0, 1, 2].map(|i| x[i] + h * d[i])).collect()
}

#[test]
fn acceptance_the_exact_tangent_is_the_derivative_of_the_force_1e_6() {
    for (name, domains, positions) in every_method(&beam([3, 2, 2], 0.3, 2)) {
        let places = deformed(&positions, 0.01, 9);
        let mut body = body(domains);
        let mut stream = Stream::new(10, 0, 0);
        let direction: Vec<[f64; 3]> = places.iter().map(|_| [0; 3].map(|_| stream.normal())).collect();
        let h = 1e-6;
        let ahead = forces(&mut body, &moved(&places, &direction, h));
        let behind = forces(&mut body, &moved(&places, &direction, -h));
        body.place(&places);
        let mut product = vec![[0.0; 3]; places.len()];
        let mut off = |tangent| {
            body.linearise(tangent);
            body.apply(&direction, &mut product);
            let pairs = product.as_flattened().iter().zip(ahead.as_flattened().iter().zip(behind.as_flattened()));
            let difference = pairs.map(|(p, (a, b))| (p + (a - b) / (2.0 * h)).abs()).fold(0.0, f64::max);
            difference / largest(&product)
        };
        assert!(off(Tangent::Exact) < 1e-6, "{name}: {:e}", off(Tangent::Exact));
        assert!(off(Tangent::Warped) > 1e-3, "{name}: the warped tangent misses something");
    }
}

/// A random displacement of the free nodes of the beam that leaves it turned and shaken.
fn shaken(held: &Held, size: f64, seed: u64) -> Vec<f64> {
    let mut stream = Stream::new(seed, 0, 0);
    (0..held.dofs().len()).map(|_| size * stream.normal()).collect()
}

fn filled(held: &mut Held, tangent: Tangent) -> CsrMatrix<f64> {
    let pattern = held.pattern().as_csr().clone();
    let mut values = vec![f64::NAN; pattern.nnz()];
    held.linearise(tangent);
    held.fill(&mut values);
    CsrMatrix::try_from_pattern_and_values(pattern, values).expect("one value an entry")
}

#[test]
fn the_matrix_is_what_the_products_are_and_at_rest_the_linear_stiffness() {
    let mesh = beam([3, 2, 2], 0.3, 2);
    for (name, domains, positions) in every_method(&mesh) {
        let dofs = clamped(&positions);
        let linear = dense(&linear_stiffness(&mesh, domains.clone(), lame(0.3), &dofs));
        let mut held = Held::new(domains, &positions, lame(0.3), dofs).expect("in space");
        for tangent in TANGENTS {
            held.place(&vec![0.0; linear.nrows()]);
            let at_rest = dense(&filled(&mut held, tangent));
            assert!((&at_rest - &linear).amax() < 1e-12 * linear.amax(), "{name} {tangent:?}");
            let (u, direction) = (shaken(&held, 0.02, 3), shaken(&held, 1.0, 4));
            held.place(&u);
            let matrix = dense(&filled(&mut held, tangent));
            assert!(matrix == matrix.transpose(), "{name} {tangent:?}: not symmetric");
            let mut product = vec![0.0; direction.len()];
            held.apply(&direction, &mut product);
            for (i, p) in product.iter().enumerate() {
                let sum: f64 = (0..direction.len()).map(|j| matrix[(i, j)] * direction[j]).sum();
                assert!((sum - p).abs() < 1e-12 * matrix.amax(), "{name} {tangent:?}: {sum} {p}");
            }
            let least = SymmetricEigen::new(matrix.clone()).eigenvalues.min();
            assert!(tangent == Tangent::Exact || least > -1e-12 * matrix.amax(), "{name} {tangent:?}: {least:e}");
        }
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mesh = beam([10, 2, 2], 0.45, 1);
            let dofs = clamped(mesh.positions());
            let domains = smoothed_domains(&mesh, Smoothing::Face);
            let mut held = Held::new(domains, mesh.positions(), lame(0.3), dofs).expect("in space");
            held.place(&shaken(&held, 0.02, 3));
            let mut force = vec![0.0; held.dofs().len()];
            held.internal_force(&mut force);
            (force, filled(&mut held, Tangent::Exact).values().to_vec(), held.energy())
        })
    };
    assert_eq!(run(1), run(3));
}

/// Tip of the corotational cantilever: minus u_z and u_x.
fn corotational_tip(domains: Domains, positions: &[[f64; 3]]) -> [f64; 2] {
    let dofs = clamped(positions);
    let load = weight(&dofs, &row_sums(&domains));
    let mut held = Held::new(domains, positions, lame(0.3), dofs).expect("in space");
    let search = Search { load_steps: 2, tolerance: 1e-12, iterations: 60 };
    let found = statics::solve(&mut held, &load, &vec![0.0; load.len()], search).expect("it bends");
    assert!(held.inversion(&found.displacement).is_sound());
    let u = held.dofs().expand(&found.displacement);
    [-tip(positions, &u, 2), tip(positions, &u, 0)]
}

#[test]
fn smoothed_fem_json_corotational_tips() {
    let numbers = reference_numbers();
    let mut compared = 0;
    for case in numbers["cantilever"].as_array().expect("cases") {
        let Some(expected) = case["corot_tip"].as_f64() else { continue };
        let cells: [usize; 3] = std::array::from_fn(|i| case["n"][i].as_u64().expect("cells") as usize);
        let mesh = beam(cells, case["alpha"].as_f64().expect("alpha"), case["seed"].as_u64().expect("seed"));
        let kind = case["kind"].as_str().expect("kind");
        let smoothing = METHODS.iter().find(|m| m.0 == kind).expect("a method of the file").1;
        let [down, along] = corotational_tip(smoothed_domains(&mesh, smoothing), mesh.positions());
        assert!((down / expected - 1.0).abs() < 1e-8, "{kind} {cells:?}: {down} {expected}");
        let expected = case["corot_tip_dx"].as_f64().expect("dx");
        assert!((along / expected - 1.0).abs() < 1e-8, "{kind} {cells:?}: {along} {expected}");
        compared += 1;
    }
    assert_eq!(compared, 14);
    let mesh = beam([10, 2, 2], 0.0, 1);
    let positions = t10::Quadratic::new(&mesh).expect("tetrahedra").positions;
    let [down, along] = corotational_tip(t10::domains(&mesh).expect("positive"), &positions);
    let expected = &numbers["t10_ref"]["(10, 2, 2)"];
    assert!((down / expected["corot_tip"].as_f64().expect("tip") - 1.0).abs() < 1e-8, "{down}");
    assert!((along / expected["corot_tip_dx"].as_f64().expect("dx") - 1.0).abs() < 1e-8, "{along}");
}

/// Conjugate gradients on the product without a matrix, against the factored matrix.
#[test]
fn the_product_without_a_matrix_serves_conjugate_gradients() {
    let mesh = beam([6, 2, 2], 0.3, 1);
    let dofs = clamped(mesh.positions());
    let domains = smoothed_domains(&mesh, Smoothing::Face);
    let mut held = Held::new(domains, mesh.positions(), lame(0.3), dofs).expect("in space");
    held.place(&shaken(&held, 0.005, 3));
    let matrix = filled(&mut held, Tangent::Positive);
    let right = shaken(&held, 1.0, 4);
    let order = minimum_degree(held.pattern()).expect("small");
    let mut factor = Factor::new(Symbolic::analyse(held.pattern(), order).expect("small"));
    factor.load(&matrix);
    factor.refactor().expect("held");
    let (mut direct, mut iterated) = (vec![0.0; right.len()], vec![0.0; right.len()]);
    factor.solve(&right, &mut direct).expect("accurate");
    let mut jacobi = BlockJacobi::new(held.pattern(), |dof| held.dofs().owner(dof).0);
    jacobi.load(matrix.values());
    let mut work = cg::Workspace::new(right.len());
    let apply = &mut |p: &[f64], q: &mut [f64]| held.apply(p, q);
    let precondition = &mut |r: &[f64], z: &mut [f64]| jacobi.apply(r, z);
    let outcome = cg::solve(apply, precondition, &right, &mut iterated, 1e-10, 2000, &mut work);
    assert!(outcome.reached(1e-10), "{outcome:?}");
    let size = direct.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    direct.iter().zip(&iterated).for_each(|(a, b)| assert!((a - b).abs() < 1e-7 * size, "{a} {b}"));
    let mut plain = vec![0.0; right.len()];
    let mut copy = |r: &[f64], z: &mut [f64]| z.copy_from_slice(r);
    let unaided = cg::solve(apply, &mut copy, &right, &mut plain, 1e-10, 2000, &mut work);
    assert!(outcome.iterations < unaided.iterations, "{outcome:?} {unaided:?}");
}
