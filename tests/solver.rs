//! The spring solver: every path against the direct one, over steps, spreads and threads.

use std::sync::Arc;

use springfit::error::{Error, Result};
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::rng::Stream;
use springfit::sparse::cholesky::{Factor, Symbolic};
use springfit::sparse::ordering::nested_dissection;
use springfit::springs::affine::{self, AffineStiffness};
use springfit::springs::grouping::{self, Request};
use springfit::springs::solver::{Path, Settings, SpringOperator, SpringSolver, choose};
use springfit::springs::{prediction, topology};

/// A cube of n^3 control points, 1 m apart, held below, with all forces and a load that bends and twists it.
struct Cube {
    operator: SpringOperator<'static>,
    forces: Vec<f64>,
}

fn cube(n: usize, groups: &str) -> Cube {
    let grid = Grid::new(&[n, n, n]);
    let points: Vec<[f64; 3]> = (0..grid.len()).map(|node| grid.index(node).map(|i| i as f64)).collect();
    let fixed: Vec<[bool; 3]> = (0..grid.len()).map(|node| [grid.index(node)[2] == 0; 3]).collect();
    let dofs = DofMap::new(3, (0..grid.len() as u32).collect(), &fixed);
    let network = (topology::find("grid").expect("known").connect)(&grid, &points, &dofs);
    let groups = (grouping::find(groups).expect("known").group)(&network, &Request::with_gamma(0.1)).expect("legal");
    let order = dofs.order(&nested_dissection(grid.extents(), 1, [false; 3]));
    let symbolic = Symbolic::analyse(&affine::pattern(&network, &dofs), order).expect("analysed");
    let coefficients = vec![1.0; network.springs.len()];
    let stiffness = AffineStiffness::new(&network, &groups, &coefficients, &dofs, &symbolic);
    let forces = (0..dofs.len()).map(|i| [80.0, -40.0, 40.0][i % 3] * (1.0 + (i as f64 * 0.01).sin())).collect();
    Cube { operator: SpringOperator::Assembled { stiffness, symbolic }, forces }
}

impl Cube {
    fn stiffness(&self) -> &AffineStiffness {
        self.operator.assembled().expect("assembled").0
    }

    fn symbolic(&self) -> &Arc<Symbolic> {
        self.operator.assembled().expect("assembled").1
    }

    fn solver(&self, path: Path) -> SpringSolver<'_> {
        SpringSolver::new(&self.operator, &Settings { path, ..Settings::default() })
    }

    /// The answer of a factorisation in f64 made for this phi alone.
    fn direct(&self, phi: &[f64]) -> Result<Vec<f64>> {
        let mut factor = Factor::new(Arc::clone(self.symbolic()));
        self.stiffness().assemble_into(phi, factor.values_mut());
        factor.refactor()?;
        let mut u = vec![0.0; self.forces.len()];
        factor.solve(&self.forces, &mut u)?;
        Ok(u)
    }

    fn next(&self, solver: &mut SpringSolver, phi: &[f64], u: &mut [f64]) -> Result<()> {
        solver.set(phi)?;
        solver.solve(&self.forces, u, 1e-10)
    }
}

/// |u - v| / |v|.
fn difference(u: &[f64], v: &[f64]) -> f64 {
    let squares = |w: &mut dyn Iterator<Item = f64>| w.map(|w| w * w).sum::<f64>().sqrt();
    squares(&mut u.iter().zip(v).map(|(u, v)| u - v)) / squares(&mut v.iter().copied())
}

const PATHS: [Path; 3] = [Path::Direct, Path::Single, Path::Stale];

#[test]
fn every_path_walks_with_the_direct_one() {
    for (n, groups) in [(5, "kind"), (7, "direction"), (9, "length"), (9, "kind")] {
        let cube = cube(n, groups);
        for path in PATHS {
            let mut stream = Stream::new(7, n, 0);
            let mut solver = cube.solver(path);
            let mut phi = vec![1.0; cube.stiffness().groups()];
            let mut u = vec![0.0; cube.forces.len()];
            let mut worst = 0.0_f64;
            for step in 0..40 {
                let length = [0.01, 0.1, 1.0][step % 3];
                phi.iter_mut().for_each(|p| *p *= (length * stream.normal()).exp());
                cube.next(&mut solver, &phi, &mut u).expect("positive definite");
                worst = worst.max(difference(&u, &cube.direct(&phi).expect("positive definite")));
            }
            println!("{n}^3 {groups} {path:?}: largest difference {worst:.1e}, {:?}", solver.work());
            assert!(worst < 1e-9);
            assert_eq!(solver.work().fallbacks, 0);
        }
    }
}

#[test]
fn spreads_up_to_1e12_are_answered_exactly_or_refused_as_the_direct_path_does() {
    let cube = cube(6, "each");
    let groups = cube.stiffness().groups();
    for path in [Path::Single, Path::Stale] {
        let mut solver = cube.solver(path);
        let mut u = vec![0.0; cube.forces.len()];
        let mut worst = [0.0_f64; 2];
        for case in 0..60 {
            let mut stream = Stream::new(3, case, 0);
            let decades = (case % 13) as f64;
            // every fourth time one group of all, otherwise every spring for itself
            let phi: Vec<f64> = match case % 4 {
                0 => (0..groups).map(|g| if g == case { 10f64.powf(decades) } else { 1.0 }).collect(),
                _ => (0..groups).map(|_| 1e-3 * 10f64.powf(decades * stream.uniform())).collect(),
            };
            let exact = cube.direct(&phi);
            match (cube.next(&mut solver, &phi, &mut u), &exact) {
                (Ok(()), Ok(exact)) => {
                    let hard = usize::from(decades > 6.0);
                    worst[hard] = worst[hard].max(difference(&u, exact));
                }
                (Err(error), Err(expected)) => assert_eq!(&error, expected),
                (found, exact) => panic!("case {case}: {found:?}, direct {exact:?}"),
            }
        }
        println!("{path:?}: largest difference {:.1e}, beyond 1e6 {:.1e}, {:?}", worst[0], worst[1], solver.work());
        assert!(worst[0] < 1e-9 && solver.work().fallbacks > 0);
    }
}

#[test]
fn units_do_not_matter_to_single_precision() {
    let cube = cube(6, "kind");
    for unit in [1e-100, 1e-60, 1e-30, 1.0, 1e30, 1e60, 1e100] {
        let mut solver = cube.solver(Path::Single);
        let phi = [unit, 0.7 * unit, 0.4 * unit];
        let mut u = vec![0.0; cube.forces.len()];
        cube.next(&mut solver, &phi, &mut u).expect("positive definite");
        assert!(difference(&u, &cube.direct(&phi).expect("positive definite")) < 1e-9, "{unit:e}");
        assert_eq!(solver.work().fallbacks, 0, "{unit:e}");
    }
}

#[test]
fn an_old_factor_takes_the_iterations_that_were_foretold() {
    for n in [5, 9, 13] {
        let cube = cube(n, "kind");
        let start = [1.0, 0.7, 0.4];
        for step in [0.001_f64, 0.01, 0.1, 0.3] {
            let mut solver = cube.solver(Path::Stale);
            let mut u = vec![0.0; cube.forces.len()];
            cube.next(&mut solver, &start, &mut u).expect("positive definite");
            let first = solver.work();
            let phi = [start[0] * (1.0 + step), start[1] / (1.0 + step), start[2]];
            let c = prediction::spread(&phi, &start);
            let mut cold = vec![0.0; u.len()];
            cube.next(&mut solver, &phi, &mut cold).expect("positive definite");
            let second = solver.work();
            let iterations = second.iterations - first.iterations;
            let predicted = prediction::iterations(c, 1.0, 1e-10);
            println!("{n}^3, step {step}: {iterations} iterations, foretold {predicted}, {second:?}");
            if second.refactorisations == first.refactorisations {
                assert!(iterations as f64 <= predicted + 1.0 && second.stale_solves == 1);
            }
            // from the displacements before the step
            let mut warm = cube.solver(Path::Stale);
            let mut guess = vec![0.0; u.len()];
            cube.next(&mut warm, &start, &mut guess).expect("positive definite");
            let before = warm.work();
            cube.next(&mut warm, &phi, &mut guess).expect("positive definite");
            let predicted = prediction::iterations(c, prediction::guess_error(c), 1e-10);
            let iterations = warm.work().iterations - before.iterations;
            println!("   with a guess: {iterations} iterations, foretold {predicted}");
            if warm.work().refactorisations == before.refactorisations {
                assert!(iterations as f64 <= predicted + 1.0);
            }
        }
    }
}

#[test]
fn a_common_factor_needs_no_new_factor_and_a_long_step_does() {
    let cube = cube(13, "kind");
    let mut solver = cube.solver(Path::Stale);
    let mut u = vec![0.0; cube.forces.len()];
    for (phi, refactorisations) in [
        ([1.0, 0.7, 0.4], 1),
        ([5.0, 3.5, 2.0], 1),
        ([5.01, 3.5, 2.0], 1),
        ([500.0, 3.5, 2.0], 2),
        ([500.0, 0.0, 2.0], 3),
        ([500.0, 0.0, 2.0], 3),
    ] {
        cube.next(&mut solver, &phi, &mut u).expect("positive definite");
        assert_eq!(solver.work().refactorisations, refactorisations, "{phi:?}");
        assert!(difference(&u, &cube.direct(&phi).expect("positive definite")) < 1e-9);
    }
}

#[test]
fn a_guess_that_is_worse_than_it_should_be_costs_iterations_not_a_factor() {
    let cube = cube(9, "kind");
    let mut solver = cube.solver(Path::Stale);
    let mut u = vec![0.0; cube.forces.len()];
    cube.next(&mut solver, &[1.0, 0.7, 0.4], &mut u).expect("positive definite");
    let phi = [1.01, 0.7, 0.4];
    let exact = cube.direct(&phi).expect("positive definite");
    for spoil in [1.0, -3.0, 1e30, f64::NAN] {
        cube.next(&mut solver, &phi, &mut u).expect("positive definite");
        // the solver holds this for the answer it gave
        u.iter_mut().enumerate().for_each(|(i, u)| *u = spoil * (i as f64).sin());
        cube.next(&mut solver, &phi, &mut u).expect("positive definite");
        assert!(difference(&u, &exact) < 1e-9, "{spoil}");
        assert_eq!(solver.work().refactorisations, 1, "{spoil}");
    }
}

#[test]
fn a_network_that_moves_is_an_error_on_every_path_and_the_next_one_is_solved() {
    let cube = cube(5, "kind");
    for path in PATHS {
        let mut solver = cube.solver(path);
        let mut u = vec![0.0; cube.forces.len()];
        let good = [1.0, 0.7, 0.4];
        for bad in [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [f64::NAN, 1.0, 1.0], [1.0, -1.0, 1.0]] {
            cube.next(&mut solver, &good, &mut u).expect("positive definite");
            let outcome = cube.next(&mut solver, &bad, &mut u);
            let a_number = bad.iter().all(|phi| *phi >= 0.0);
            let as_expected = match &outcome {
                Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => a_number,
                Err(Error::Input { message, .. }) => !a_number && message.contains("the stiffness of group"),
                _ => false,
            };
            assert!(as_expected, "{path:?} {bad:?}: {outcome:?}");
            cube.next(&mut solver, &good, &mut u).expect("positive definite");
            assert!(difference(&u, &cube.direct(&good).expect("positive definite")) < 1e-9);
        }
    }
}

#[test]
fn many_right_hand_sides_and_a_loose_tolerance() {
    let cube = cube(9, "kind");
    let n = cube.forces.len();
    let forces: Vec<f64> = (0..20 * n).map(|i| (i as f64 * 0.37).cos()).collect();
    let mut exact = vec![0.0; forces.len()];
    let mut factor = Factor::new(Arc::clone(cube.symbolic()));
    cube.stiffness().assemble_into(&[1.0, 0.7, 0.4], factor.values_mut());
    factor.refactor().expect("positive definite");
    factor.solve(&forces, &mut exact).expect("accurate");
    for path in PATHS {
        for (tolerance, allowed) in [(1e-10, 1e-9), (1e-6, 1e-4)] {
            let mut solver = cube.solver(path);
            let mut u = vec![0.0; forces.len()];
            solver.set(&[1.01, 0.7, 0.4]).expect("positive definite");
            solver.solve(&forces, &mut u, tolerance).expect("accurate");
            solver.set(&[1.0, 0.7, 0.4]).expect("positive definite");
            solver.solve(&forces, &mut u, tolerance).expect("accurate");
            let worst = u.chunks(n).zip(exact.chunks(n)).map(|(u, e)| difference(u, e)).fold(0.0, f64::max);
            println!("{path:?} {tolerance:e}: {worst:.1e}, {:?}", solver.work());
            assert!(worst < allowed);
        }
    }
}

#[test]
fn the_choice_is_direct_for_small_cubes_and_says_why() {
    let (small, large) = (cube(9, "kind"), cube(13, "kind"));
    let settings = Settings::default();
    let choice = |cube: &Cube| choose(&settings, cube.symbolic());
    println!("{:?}\n{:?}", choice(&small), choice(&large));
    assert_eq!([choice(&small).path, choice(&large).path], [Path::Direct, Path::Stale]);
    for path in PATHS {
        assert_eq!(choose(&Settings { path, ..settings }, small.symbolic()).path, path);
    }
}

#[test]
fn the_same_walk_has_the_same_bits_in_any_pool() {
    let cube = cube(13, "kind");
    let walk = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut solver = cube.solver(Path::Auto);
            let mut u = vec![0.0; cube.forces.len()];
            for step in 0..4 {
                let phi = [1.0 + 0.02 * f64::from(step), 0.7, 0.4];
                cube.next(&mut solver, &phi, &mut u).expect("positive definite");
            }
            (u, solver.work())
        })
    };
    let one = walk(1);
    for threads in [2, 4] {
        assert!(walk(threads) == one, "{threads} threads");
    }
}
