//! The multigrid path of the springs against the assembled matrix and the direct solve.

use springfit::clock::Stopwatch;
use springfit::error::Error;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::sparse::cholesky::{Factor, Symbolic};
use springfit::sparse::multigrid::padded::Padded;
use springfit::sparse::ordering::nested_dissection;
use springfit::springs::affine::{self, AffineStiffness};
use springfit::springs::grouping::{self, Grouping, Request};
use springfit::springs::multigrid_solver::MultigridSolver;
use springfit::springs::network::Network;
use springfit::springs::stencil::Refusal;
use springfit::springs::topology;
use springfit::springs::weighting::{self, Weighting};

/// A supported network with its groups.
struct Body {
    grid: Grid,
    dofs: DofMap,
    network: Network,
    grouping: Grouping,
    coefficients: Vec<f64>,
}

/// Nodes at `place(i / (n - 1))`, the components that `fixed` names held, springs grouped by kind.
fn body(shape: &[usize], place: impl Fn([f64; 3]) -> [f64; 3], fixed: impl Fn([usize; 3]) -> [bool; 3]) -> Body {
    let grid = Grid::new(shape);
    let part = |i: usize, n: usize| if n > 1 { i as f64 / (n - 1) as f64 } else { 0.0 };
    let points: Vec<[f64; 3]> = (0..grid.len())
        .map(|node| {
            let (index, n) = (grid.index(node), grid.extents());
            place([0, 1, 2].map(|d| part(index[d], n[d])))
        })
        .collect();
    let held: Vec<[bool; 3]> = (0..grid.len()).map(|node| fixed(grid.index(node))).collect();
    let dofs = DofMap::untied(grid.dimension(), &held);
    let network = (topology::find("grid").expect("in the table").connect)(&grid, &points, &dofs);
    let grouping =
        (grouping::find("kind").expect("in the table").group)(&network, &Request::default()).expect("no gamma needed");
    let coefficients = weighting::coefficients(&network, Weighting::Cells, &vec![1.0; network.springs.len()]);
    Body { grid, dofs, network, grouping, coefficients }
}

fn cube(n: usize) -> Body {
    body(&[n, n, n], |x| x.map(|x| 2.0 * x), |index| [index[2] == 0; 3])
}

fn sheared(n: usize) -> Body {
    body(&[n, n, n], |[x, y, z]| [x + 0.5 * y + 0.3 * z, y + 0.4 * z, z], |index| [index[0] == 0; 3])
}

fn graded(n: usize) -> Body {
    body(&[n, n, n], |x| x.map(|x| x * (0.2 + 0.8 * x)), |index| [index[1] == 0; 3])
}

fn torus(around: usize, n: usize) -> Body {
    let place = |[t, a, b]: [f64; 3]| {
        let angle = std::f64::consts::TAU * t;
        let radius = 0.875 + 0.6 * (a - 0.5);
        [radius * angle.cos(), radius * angle.sin(), 0.6 * (b - 0.5)]
    };
    body(&[around, n, n], place, |index| [index[1] == 0; 3])
}

fn plate(n: usize) -> Body {
    body(&[n, n, 3], |[x, y, z]| [2.0 * x, 2.0 * y, 0.4 * z], |index| [index[0] == 0; 3])
}

fn square(n: usize) -> Body {
    body(&[n, n], |[x, y, _]| [2.0 * x, 2.0 * y, 0.0], |index| [index[1] == 0; 3])
}

/// Supports by component, at odd places, on even extents.
fn on_rollers(n: usize) -> Body {
    body(&[n, n + 1, n + 2], |x| x, |[i, j, k]| [i == 0 || (i, j, k) == (3, 3, 3), j == 0 || j == 3 && k == 1, k == 0])
}

impl Body {
    fn solver(&self) -> MultigridSolver {
        MultigridSolver::new(&self.network, &self.grid, &self.dofs, &self.grouping, &self.coefficients)
            .expect("a grid that can be halved")
    }

    fn phi(&self) -> Vec<f64> {
        [1000.0, 1400.0, 700.0][..self.grouping.groups.len()].to_vec()
    }

    fn loads(&self) -> Vec<f64> {
        (0..self.dofs.len()).map(|i| [80.0, -40.0, 40.0][self.dofs.owner(i).1] + scattered(i)).collect()
    }

    fn affine(&self) -> (AffineStiffness, Factor) {
        let order = self.dofs.order(&nested_dissection(self.grid.extents(), 1, [false; 3]));
        let symbolic = Symbolic::analyse(&affine::pattern(&self.network, &self.dofs), order).expect("a small pattern");
        let stiffness = AffineStiffness::new(&self.network, &self.grouping, &self.coefficients, &self.dofs, &symbolic);
        (stiffness, Factor::new(symbolic))
    }
}

/// Numbers between 0 and 1 that look random and are the same for ever.
fn scattered(i: usize) -> f64 {
    ((12.9898 * (i as f64 + 1.0)).sin() * 43758.5453).rem_euclid(1.0)
}

fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |largest, v| largest.max(v.abs()))
}

fn small_bodies() -> Vec<(&'static str, Body)> {
    vec![
        ("cube 9", cube(9)),
        ("cube 10", cube(10)),
        ("sheared 9", sheared(9)),
        ("graded 9", graded(9)),
        ("torus 17x6x6", torus(17, 6)),
        ("plate 17", plate(17)),
        ("square 20", square(20)),
        ("square 33", square(33)),
        ("rollers 8", on_rollers(8)),
    ]
}

#[test]
fn products_are_those_of_the_assembled_stiffness() {
    for (name, body) in small_bodies() {
        let (affine, _) = body.affine();
        let mut solver = body.solver();
        let phi = body.phi();
        solver.set(&phi);
        let n = body.dofs.len();
        let u: Vec<f64> = (0..n).map(|i| scattered(i) - 0.5).collect();
        let (mut expected, mut found) = (vec![0.0; n], vec![0.0; n]);
        affine.apply_all(&phi, &u, &mut expected);
        let stencil = solver.stencil();
        let mut spread = vec![0.0; 3 * stencil.padded().len()];
        let mut product = spread.clone();
        stencil.spread(&u, &mut spread);
        stencil.product(&spread, &mut product);
        stencil.collect(&product, &mut found);
        let size = largest(&expected);
        assert!(found.iter().zip(&expected).all(|(f, e)| (f - e).abs() <= 1e-14 * size), "{name}");
        let outside = product.iter().zip(&spread).filter(|(_, u)| **u == 0.0).all(|(product, _)| *product == 0.0);
        assert!(outside, "{name}: held components and margin stay zero");
        for a in 0..phi.len() {
            affine.apply(a, &u, &mut expected);
            solver.apply_group(a, &u, &mut found);
            assert!(found.iter().zip(&expected).all(|(f, e)| (f - e).abs() <= 1e-14 * size), "{name}, group {a}");
        }
    }
}

#[test]
fn solutions_are_those_of_the_direct_solve() {
    for (name, body) in small_bodies().into_iter().chain([("cube 17", cube(17)), ("plate 33", plate(33))]) {
        let (affine, mut factor) = body.affine();
        let mut solver = body.solver();
        let (phi, b) = (body.phi(), body.loads());
        affine.assemble_into(&phi, factor.values_mut());
        factor.refactor().expect("positive definite");
        let (mut expected, mut found) = (vec![0.0; b.len()], vec![0.0; b.len()]);
        factor.solve(&b, &mut expected).expect("solvable");
        solver.set(&phi);
        let report = solver.solve(&b, &mut found, 1e-11).expect(name);
        let size = largest(&expected);
        let worst = found.iter().zip(&expected).fold(0.0_f64, |worst, (f, e)| worst.max((f - e).abs()));
        println!(
            "{name}: {} iterations, {:?}, difference {:.1e}",
            report.iterations,
            solver.multigrid().extents(),
            worst / size
        );
        assert!(worst <= 1e-9 * size, "{name}: {:.1e}", worst / size);
    }
}

#[test]
fn the_cycle_is_symmetric_and_positive() {
    for (name, body) in small_bodies() {
        let mut solver = body.solver();
        solver.set(&body.phi());
        let n = body.dofs.len();
        let places = 3 * solver.stencil().padded().len();
        let vector = |solver: &MultigridSolver, seed: usize| {
            let u: Vec<f64> = (0..n).map(|i| scattered(i + seed) - 0.5).collect();
            let mut spread = vec![0.0; places];
            solver.stencil().spread(&u, &mut spread);
            spread
        };
        let (x, y) = (vector(&solver, 1), vector(&solver, 77_777));
        let (mut mx, mut my) = (vec![0.0; places], vec![0.0; places]);
        solver.multigrid().apply(&x, &mut mx);
        solver.multigrid().apply(&y, &mut my);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let size = (dot(&x, &mx) * dot(&y, &my)).sqrt();
        assert!(dot(&x, &mx) > 0.0 && dot(&y, &my) > 0.0, "{name}");
        let gap = (dot(&x, &my) - dot(&y, &mx)).abs() / size;
        assert!(gap < 1e-5, "{name}: {gap:.1e}");
    }
}

#[test]
fn iterations_do_not_depend_on_the_size_of_the_grid() {
    type Make = fn(usize) -> Body;
    let table = [("cube", cube as Make, 16), ("sheared", sheared, 18), ("graded", graded, 30), ("square", square, 16)];
    for (name, make, most) in table {
        for n in [9, 17, 24, 33] {
            let body = make(n);
            let watch = Stopwatch::start();
            let mut solver = body.solver();
            let made = watch.seconds();
            solver.set(&body.phi());
            let set = watch.seconds() - made;
            let b = body.loads();
            let mut u = vec![0.0; b.len()];
            let report = solver.solve(&b, &mut u, 1e-10).expect(name);
            println!(
                "{name} {n}: {} dofs, {} iterations, made {made:.3} s, set {set:.3} s, solve {:.3} s, {:.1} MB",
                b.len(),
                report.iterations,
                watch.seconds() - made - set,
                solver.memory_bytes() as f64 / 1e6
            );
            assert!(report.iterations <= most, "{name} {n}: {}", report.iterations);
        }
    }
}

#[test]
fn bits_do_not_depend_on_threads_or_on_what_was_before() {
    let body = sheared(17);
    let b = body.loads();
    let run = |threads: usize, before: bool| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut solver = body.solver();
            if before {
                solver.set(&[9.0, 2.0, 5.0]);
            }
            solver.set(&body.phi());
            let mut u = vec![0.0; b.len()];
            solver.solve(&b, &mut u, 1e-10).expect("solvable");
            u
        })
    };
    let alone = run(1, false);
    for (threads, before) in [(2, false), (4, false), (1, true)] {
        assert!(run(threads, before) == alone, "{threads} threads");
    }
}

/// Seven right-hand sides with guesses: as many as are taken at once, and three more. One is zero, one is done by its guess.
fn seven_columns(solver: &mut MultigridSolver, body: &Body) -> (Vec<f64>, Vec<f64>) {
    let n = body.dofs.len();
    let (mut b, mut x) = (body.loads().repeat(7), vec![0.0; 7 * n]);
    for (i, b) in b.iter_mut().enumerate().skip(n) {
        *b = 1e3_f64.powi((i / n) as i32 - 3) * (scattered(i) - 0.5);
    }
    b[2 * n..3 * n].fill(0.0);
    solver.solve(&b[..n], &mut x[..n], 1e-12).expect("a guess that is the answer");
    x[3 * n..5 * n].iter_mut().enumerate().for_each(|(i, x)| *x = scattered(i));
    (b, x)
}

#[test]
fn columns_together_have_the_bits_of_each_alone_on_any_number_of_threads() {
    for (name, body) in small_bodies().into_iter().chain([("sheared 17", sheared(17))]) {
        let mut solver = body.solver();
        solver.set(&body.phi());
        let (b, guess) = seven_columns(&mut solver, &body);
        let (mut alone, mut together) = (guess.clone(), guess.clone());
        let n = body.dofs.len();
        let each = b.chunks_exact(n).zip(alone.chunks_exact_mut(n));
        let reports: Vec<_> = each.map(|(b, x)| solver.solve(b, x, 1e-10).expect(name)).collect();
        assert!(reports[0].iterations == 0 && reports[2].iterations == 0 && reports[1].iterations > 5, "{name}");
        for threads in [1, 2, 4] {
            together.copy_from_slice(&guess);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let report = pool.install(|| solver.solve_columns(&b, &mut together, 1e-10)).expect(name);
            assert!(together == alone, "{name} on {threads} threads");
            assert_eq!(report.iterations, reports.iter().map(|report| report.iterations).sum::<usize>(), "{name}");
            assert_eq!(report.residual, reports.iter().fold(0.0, |worst: f64, report| worst.max(report.residual)));
        }
    }
}

#[test]
fn memory_grows_to_four_columns_and_no_further() {
    let body = cube(17);
    let mut solver = body.solver();
    solver.set(&body.phi());
    let n = body.dofs.len();
    let mut bytes = |columns: usize| {
        solver.solve_columns(&body.loads().repeat(columns), &mut vec![0.0; columns * n], 1e-2).expect("solvable");
        solver.memory_bytes()
    };
    let (one, two, four, nine) = (bytes(1), bytes(2), bytes(4), bytes(9));
    // six vectors in f64, four in f32 on all grids
    let vector = 3 * Padded::new(body.grid.extents()).len();
    assert!((56 * vector..80 * vector).contains(&(two - one)), "{one} {two}");
    assert_eq!((four - one, nine), (3 * (two - one), four));
}

#[test]
fn a_tolerance_below_rounding_ends_at_rounding_and_says_so() {
    for body in [cube(9), plate(17)] {
        let mut solver = body.solver();
        solver.set(&body.phi());
        let b = body.loads();
        let mut u = vec![0.0; b.len()];
        let report = solver.solve(&b, &mut u, 1e-17).expect("as good as f64 allows");
        assert!(report.residual > 1e-17 && report.residual < 1e-10, "{:.1e}", report.residual);
    }
}

#[test]
fn a_body_that_is_too_hard_is_an_error_after_a_bounded_number_of_iterations() {
    let thin = body(&[65, 9, 3], |[x, y, z]| [20.0 * x, y, 0.002 * z], |index| [index[0] == 0; 3]);
    let mut solver = thin.solver();
    solver.set(&[1e4, 1.0, 1.0]);
    let b = thin.loads();
    let mut u = vec![0.0; b.len()];
    let error = solver.solve(&b, &mut u, 1e-10).expect_err("a thin strip held at one end");
    assert!(matches!(error, Error::Inaccurate { .. }), "{error}");
}

/// Edges alone are a mechanism: u grows until its rounding is as large as the load, with a backward error of 1e-16.
#[test]
fn a_network_without_stiffness_is_an_error_and_no_huge_displacement() {
    for body in [cube(9), torus(17, 9)] {
        let mut solver = body.solver();
        for phi in [[1000.0, 0.0, 0.0], [0.0, 0.0, 700.0], [0.0; 3]] {
            solver.set(&phi);
            let mut u = vec![0.0; body.dofs.len()];
            let found = solver.solve(&body.loads(), &mut u, 1e-10);
            assert!(matches!(found, Err(Error::Inaccurate { .. })), "{phi:?}: {found:?}, |u| = {:e}", largest(&u));
        }
    }
}

#[test]
fn what_is_no_stencil_is_refused() {
    let tiny = body(&[3, 3, 3], |x| x, |index| [index[0] == 0; 3]);
    let refused = |body: &Body| {
        MultigridSolver::new(&body.network, &body.grid, &body.dofs, &body.grouping, &body.coefficients).err()
    };
    assert_eq!(refused(&tiny), Some(Refusal::Small));
    let mut tied = cube(9);
    let mut master: Vec<u32> = (0..tied.grid.len() as u32).collect();
    master[tied.grid.len() - 1] = 0;
    tied.dofs = DofMap::new(3, master, &vec![[false; 3]; tied.grid.len()]);
    assert_eq!(refused(&tied), Some(Refusal::Tied));
}
