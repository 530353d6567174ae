//! Calibration recovers what it should: R1 of the verification list, bounds, determinism.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use springfit::calibration::objective::{Objective, Problem};
use springfit::calibration::objectives::displacement::{Displacement, Target, weights};
use springfit::calibration::optimiser::{OPTIMISERS, Outcome, Serves, Settings, find};
use springfit::calibration::pieces::{Kept, NOTHING, Piece, Stage};
use springfit::clock::Progress;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::sparse::cholesky::Symbolic;
use springfit::sparse::ordering::nested_dissection;
use springfit::springs::affine::{AffineStiffness, pattern};
use springfit::springs::grouping::{self, Request};
use springfit::springs::network::Network;
use springfit::springs::solver::SpringOperator;
use springfit::springs::topology;
use springfit::springs::weighting::{Weighting, coefficients};

/// A square membrane of 2 m x 2 m, n x n masses, springs grouped by kind.
struct Membrane {
    operator: SpringOperator<'static>,
    unknowns: usize,
    nodes: usize,
}

fn membrane(n: usize, held: impl Fn([usize; 3]) -> bool) -> Membrane {
    let grid = Grid::new(&[n, n]);
    let spacing = 2.0 / (n - 1) as f64;
    let place = |node: usize| {
        let [i, j, _] = grid.index(node);
        [i as f64 * spacing, j as f64 * spacing, 0.0]
    };
    let positions: Vec<[f64; 3]> = (0..grid.len()).map(place).collect();
    let fixed: Vec<[bool; 3]> = (0..grid.len()).map(|node| [held(grid.index(node)); 3]).collect();
    let dofs = DofMap::untied(2, &fixed);
    let network: Network = (topology::find("grid").expect("in the table").connect)(&grid, &positions, &dofs);
    let groups = (grouping::find("kind").expect("in the table").group)(&network, &Request::default())
        .expect("kinds need no gamma");
    let order = dofs.order(&nested_dissection(grid.extents(), 1, [false; 3]));
    let symbolic = Symbolic::analyse(&pattern(&network, &dofs), order).expect("a small pattern");
    let w = coefficients(&network, Weighting::Springs, &vec![1.0; network.springs.len()]);
    let stiffness = AffineStiffness::new(&network, &groups, &w, &dofs, &symbolic);
    Membrane { operator: SpringOperator::Assembled { stiffness, symbolic }, unknowns: dofs.len(), nodes: grid.len() }
}

/// Fits the membrane to its own displacements at `truth`, from bounds that make (1000, 1000) the first start.
fn recover(membrane: &Membrane, truth: [f64; 2], optimiser: &str, settings: &Settings) -> Outcome {
    recover_keeping(membrane, truth, optimiser, settings, &NOTHING)
}

/// The same with some pieces known.
fn recover_keeping(membrane: &Membrane, truth: [f64; 2], optimiser: &str, settings: &Settings, kept: &Kept) -> Outcome {
    let n = membrane.unknowns;
    let forces: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { 3.0 } else { -2.0 }).collect();
    let upper = [1e4, 1e4];
    let exact = {
        let reference = vec![1.0; n];
        let target = Target {
            operator: &membrane.operator,
            upper: &upper,
            forces: &forces,
            reference: &reference,
            weights: &[1.0],
        };
        let mut objective = Displacement::new(target);
        objective.error(&truth).expect("positive definite");
        objective.displacement().to_vec()
    };
    let largest = exact.chunks(2).map(|u| u[0].hypot(u[1])).fold(0.0, f64::max);
    let weights = weights(&[largest], membrane.nodes);
    let target =
        Target { operator: &membrane.operator, upper: &upper, forces: &forces, reference: &exact, weights: &weights };
    let worker = || Displacement::new(target);
    let make = || -> Box<dyn Objective + '_> { Box::new(worker()) };
    let progress = Progress::default();
    let problem = Problem {
        make: &make,
        displacement: Some(&worker),
        linear: None,
        prior: None,
        upper: &upper,
        seed: 1,
        index: 0,
        side_by_side: true,
        progress: &progress,
        kept,
    };
    (find(optimiser).expect("in the table").run)(&problem, settings).expect("a well-posed problem")
}

fn relative_error(found: &Outcome, truth: [f64; 2]) -> f64 {
    found.phi.iter().zip(&truth).map(|(p, t)| (p / t - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn r1_gauss_newton_recovers_500_400_from_1000_1000() {
    let truth = [500.0, 400.0];
    let settings = Settings { starts: Some(1), ..Settings::default() };
    for membrane in [
        membrane(9, |[i, ..]| i == 0),
        membrane(5, |[i, ..]| i == 0),
        membrane(9, |[i, j, _]| i == 0 || j == 0 || i == 8 || j == 8),
    ] {
        let found = recover(&membrane, truth, "gauss_newton", &settings);
        println!("{:?} error {:e} after {} factorisations", found.phi, found.error, found.counts.refactorisations);
        assert!(relative_error(&found, truth) <= 1e-10, "{found:?}");
        assert!(found.error <= 1e-9);
        assert!(found.counts.refactorisations <= 20);
    }
}

#[test]
fn r1_annealing_alone_recovers_500_400() {
    let truth = [500.0, 400.0];
    let settings = Settings { evaluations: 20_000, final_temperature: 1e-10, ..Settings::default() };
    let found = recover(&membrane(5, |[i, ..]| i == 0), truth, "annealing", &settings);
    println!("{:?} error {:e}", found.phi, found.error);
    assert!(relative_error(&found, truth) <= 1e-6, "{found:?}");
}

#[test]
fn hybrid_is_never_worse_than_its_annealing_and_recovers_too() {
    let truth = [500.0, 400.0];
    let settings = Settings { evaluations: 200, ..Settings::default() };
    let membrane = membrane(5, |[i, ..]| i == 0);
    let annealed = recover(&membrane, truth, "annealing", &settings);
    let hybrid = recover(&membrane, truth, "hybrid", &settings);
    assert!(hybrid.error < annealed.error);
    assert!(relative_error(&hybrid, truth) <= 1e-10);
    assert!(
        hybrid.trace.windows(2).all(|w| w[0].seconds <= w[1].seconds && w[0].refactorisations <= w[1].refactorisations)
    );
}

#[test]
fn every_optimiser_gives_the_same_bits_for_any_number_of_threads() {
    let membrane = membrane(5, |[i, ..]| i == 0);
    let settings = Settings { evaluations: 300, ..Settings::default() };
    for optimiser in OPTIMISERS.iter().filter(|optimiser| optimiser.serves != Serves::Linear) {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| recover(&membrane, [500.0, 400.0], optimiser.name, &settings))
        };
        let (one, three) = (run(1), run(3));
        assert_eq!(one.phi, three.phi, "{}", optimiser.name);
        assert_eq!(one.counts, three.counts, "{}", optimiser.name);
    }
}

#[test]
fn products_with_the_jacobian_and_its_adjoint_are_those_of_its_columns() {
    let membrane = membrane(5, |[i, ..]| i == 0);
    let n = membrane.unknowns;
    let load = |shift: usize| (0..n).map(move |i| ((i + shift) % 7) as f64 - 3.0);
    let forces: Vec<f64> = load(0).chain(load(3)).collect();
    let reference: Vec<f64> = forces.iter().map(|f| 1e-3 * f).collect();
    let target = Target {
        operator: &membrane.operator,
        upper: &[1e4, 1e4],
        forces: &forces,
        reference: &reference,
        weights: &[2.0, 0.5],
    };
    let mut objective = Displacement::new(target);
    objective.error(&[500.0, 400.0]).expect("positive definite");
    let (mut residual, mut jacobian) = (vec![], vec![]);
    objective.linearise(&mut residual, &mut jacobian).expect("positive definite");
    assert_eq!(objective.residual(), residual);
    let members = membrane.operator.members().into_owned();
    let largest = jacobian.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    for (a, column) in jacobian.chunks_exact(residual.len()).enumerate() {
        let change: Vec<f64> = (0..2).map(|b| f64::from(a == b)).collect();
        let along = objective.along(&members, &change).expect("positive definite");
        assert!(along.iter().zip(column).all(|(x, y)| (x - y).abs() <= 1e-11 * largest), "group {a}");
        let slope = objective.adjoint(&members, &residual).expect("positive definite")[a];
        let direct: f64 = column.iter().zip(&residual).map(|(x, r)| x * r).sum();
        assert!((slope - direct).abs() <= 1e-11 * direct.abs(), "group {a}: {slope}, {direct}");
    }
}

/// Starts, chains, descents and the polish are told once each; known ones are not done again and lead to the same bits.
#[test]
fn pieces_that_are_known_are_not_done_again() {
    let membrane = membrane(5, |[i, ..]| i == 0);
    let usual = Settings { starts: Some(3), chains: 3, evaluations: 60, ..Settings::default() };
    let short = Settings { refactorisations: 3, ..usual };
    let rows = [("gauss_newton", usual, 3), ("annealing", usual, 3), ("hybrid", usual, 6), ("gauss_newton", short, 5)];
    for (optimiser, settings, pieces) in rows {
        let told = Mutex::new(Vec::<(Piece, Outcome)>::new());
        let tell = |piece, outcome: &Outcome| told.lock().expect("no panic").push((piece, outcome.clone()));
        let with = |kept: &Kept| recover_keeping(&membrane, [500.0, 400.0], optimiser, &settings, kept);
        let first = with(&Kept { known: &|_| None, tell: &tell });
        let all = told.lock().expect("no panic").clone();
        assert_eq!(all.len(), pieces, "{optimiser}");
        let mut names: Vec<Piece> = all.iter().map(|(piece, _)| *piece).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), pieces, "every piece has its own name");
        assert!(names.iter().all(|piece| piece.problem == 0 && piece.stage != Stage::Answer));
        let polished = names.iter().filter(|piece| piece.stage == Stage::Polish).count();
        // two of the three starts are near the best one and have spent what they had
        assert_eq!(polished, if settings == short { 2 } else { 0 }, "{optimiser}");

        let find = |piece| all.iter().find(|(name, _)| *name == piece).map(|(_, outcome)| outcome.clone());
        let (asked, done_again) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let known = |piece| {
            asked.fetch_add(1, Ordering::Relaxed);
            find(piece)
        };
        let tell = |_, _: &Outcome| {
            done_again.fetch_add(1, Ordering::Relaxed);
        };
        let again = with(&Kept { known: &known, tell: &tell });
        assert_eq!((asked.into_inner(), done_again.into_inner()), (pieces, 0), "{optimiser}");
        let bits = |outcome: &Outcome| outcome.phi.iter().map(|phi| phi.to_bits()).collect::<Vec<_>>();
        assert_eq!((bits(&first), first.counts, first.stop), (bits(&again), again.counts, again.stop));
        assert_eq!(first.error.to_bits(), again.error.to_bits());
        let errors =
            |outcome: &Outcome| outcome.trace.iter().map(|p| (p.refactorisations, p.error)).collect::<Vec<_>>();
        assert_eq!(errors(&first), errors(&again));
    }
}
