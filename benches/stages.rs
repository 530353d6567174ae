//! One case for each stage of a calibration, on cubes of 9^3 and 17^3 control points.
//!
//! Policy: one thread (what one worker of a sweep does), the code path that `springfit run` takes, nothing allocated in
//! the timed part that a run would not allocate. Compare runs on one idle machine only. The error that belongs to the
//! times is printed beside them.
//!
//! Run with `cargo bench --bench stages`.

use std::hint::black_box;
use std::sync::Arc;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, criterion_group, criterion_main};
use springfit::calibration::objective::Objective;
use springfit::calibration::objectives::displacement::{Displacement, Target, weights};
use springfit::calibration::surrogate::certificate::Certificate;
use springfit::calibration::surrogate::galerkin::Galerkin;
use springfit::calibration::surrogate::walker::Walker;
use springfit::dense::LeastSquares;
use springfit::reference::{Reference, stiffness};
use springfit::rng::Stream;
use springfit::scene::{self, Scene, Source};
use springfit::sparse::cholesky::{Factor, Symbolic};
use springfit::springs::affine::{self, AffineStiffness};
use springfit::springs::bounds;
use springfit::springs::grouping::{self, Request};
use springfit::springs::solver::{Path, Settings, SpringOperator, SpringSolver};
use springfit::study::body::{self, Body};
use springfit::study::loads::{self, LoadCase};
use springfit::study::network::{self, Lattice};

struct Cube {
    body: Body,
    loads: Vec<LoadCase>,
    lattice: Lattice,
    reference: Reference,
    operator: SpringOperator<'static>,
    upper: Vec<f64>,
}

fn cube(n: usize) -> Cube {
    let text = format!(
        "[geometry]\nshape = \"cube\"\ncontrol_points = [{n}, {n}, {n}]\n[solver]\npath = \"direct\"\n\
         [material]\nyoung = 15e3\npoisson = 0.3333333333333333\n\
         [support]\nfaces = [\"z-\"]\n[[load]]\nforce_per_node = [80.0, -40.0, 40.0]\n"
    );
    let scene: Scene = scene::parse(&Source { name: "cube".into(), text }).expect("a valid scene");
    let body = body::build(&scene).expect("a valid body");
    let loads = loads::build(&scene, &body).expect("a load");
    let lattice = network::build(&scene, &body).expect("a network");
    let points = body.integration_points().expect("points");
    let order = body.reference_order(&points).expect("an order");
    let forces = vec![loads[0].load.clone()];
    let reference = Reference::solve(&points, body.lame, &body.dofs, order, &forces).expect("solvable");
    drop(points);
    let groups = (grouping::find("length").expect("known").group)(&lattice.network, &Request::with_gamma(0.1))
        .expect("legal gamma");
    let symbolic = Arc::clone(lattice.symbolic.as_ref().expect("a path with factors"));
    let stiffness = AffineStiffness::new(&lattice.network, &groups, &lattice.coefficients, &body.dofs, &symbolic);
    let operator = SpringOperator::Assembled { stiffness, symbolic };
    let upper = bounds::upper_bounds(&groups, &lattice.spring_bounds, &lattice.factors);
    Cube { body, loads, lattice, reference, operator, upper }
}

fn stages(criterion: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first use of rayon");
    for n in [9, 17] {
        let cube = cube(n);
        systems(criterion, n, &cube);
        paths(criterion, n, &cube);
        fits(criterion, n, &cube);
    }
}

fn id(stage: &str, n: usize) -> BenchmarkId {
    BenchmarkId::new(stage, format!("{n}^3"))
}

/// Assembly, analysis, value update, factorisation.
fn systems(criterion: &mut Criterion, n: usize, cube: &Cube) {
    let Cube { body, loads, lattice, operator, upper, .. } = cube;
    let (springs, symbolic) = operator.assembled().expect("a path with factors");
    let mut group = criterion.benchmark_group("stages");
    group.sample_size(10);

    let points = body.integration_points().expect("points");
    let pattern = stiffness::pattern(&points, &body.dofs);
    group.bench_function(id("IGA assembly", n), |b| {
        b.iter(|| stiffness::stiffness(&points, body.lame, &body.dofs, &pattern).expect("assembles"));
    });

    let pattern = affine::pattern(&lattice.network, &body.dofs);
    let order = body.spring_order(&lattice.network, &pattern).expect("an order");
    group.bench_function(id("analyse", n), |b| {
        b.iter(|| Symbolic::analyse(&pattern, order.clone()).expect("analysed"));
    });

    let phi: Vec<f64> = upper.iter().map(|u| 0.1 * u).collect();
    let forces = &loads[0].load.forces;
    let mut factor = Factor::new(Arc::clone(symbolic));
    let mut u = vec![0.0; forces.len()];
    group.bench_function(id("value update", n), |b| {
        b.iter(|| springs.assemble_into(black_box(&phi), factor.values_mut()));
    });
    springs.assemble_into(&phi, factor.values_mut());
    factor.refactor().expect("positive definite");
    let error = factor.solve(forces, &mut u).expect("solvable");
    println!("{n}^3: backward error {error:.1e}, {:.3e} flop a factorisation", symbolic.factor_flops());
    group.bench_function(id("refactor + solve", n), |b| {
        b.iter(|| {
            factor.refactor().expect("positive definite");
            factor.solve(forces, &mut u).expect("solvable")
        });
    });
    group.finish();
}

/// Two evaluations on each path with factors: 1 % to either side of the phi where the first factor was made, up in the
/// first group and down in the others or the other way round.
fn paths(criterion: &mut Criterion, n: usize, cube: &Cube) {
    let Cube { loads, operator, upper, .. } = cube;
    let mut group = criterion.benchmark_group("two evaluations");
    group.sample_size(10);
    let forces = &loads[0].load.forces;
    let aside = |step: f64| -> Vec<f64> {
        (0..upper.len()).map(|a| 0.1 * upper[a] * if a == 0 { step } else { 1.0 / step }).collect()
    };
    let (here, there, back) = (aside(1.0), aside(1.01), aside(1.0 / 1.01));
    let mut exact = vec![0.0; forces.len()];
    for path in [Path::Direct, Path::Single, Path::Stale] {
        let mut solver = SpringSolver::new(operator, &Settings { path, ..Settings::default() });
        let mut u = vec![0.0; forces.len()];
        let mut evaluate = |phi: &[f64], u: &mut [f64]| {
            solver.set(phi).and_then(|()| solver.solve(forces, u, 1e-10)).expect("positive definite");
        };
        evaluate(&here, &mut u);
        group.bench_function(BenchmarkId::new(path.name(), format!("{n}^3")), |b| {
            b.iter(|| {
                evaluate(black_box(&there), &mut u);
                evaluate(black_box(&back), &mut u);
            });
        });
        if path == Path::Direct {
            exact.copy_from_slice(&u);
        }
        let largest = exact.iter().fold(0.0_f64, |a, u| a.max(u.abs()));
        let difference = u.iter().zip(&exact).fold(0.0_f64, |a, (u, e)| a.max((u - e).abs()));
        println!(
            "{n}^3 {}: largest difference to direct {:.1e}, {:?}",
            path.name(),
            difference / largest,
            solver.work()
        );
    }
    group.finish();
}

/// One annealing evaluation and one Gauss-Newton iteration.
fn fits(criterion: &mut Criterion, n: usize, cube: &Cube) {
    let Cube { body, loads, reference, operator, upper, .. } = cube;
    let mut group = criterion.benchmark_group("stages");
    group.sample_size(10);
    let case = &reference.cases[0];
    let weights = weights(&[case.u_max], body.dofs.masters().count());
    let target =
        Target { operator, upper, forces: &loads[0].load.forces, reference: &case.displacement, weights: &weights };
    let phi: Vec<f64> = upper.iter().map(|u| 0.1 * u).collect();
    let mut objective = Displacement::new(target);
    println!("{n}^3: error at 0.1 of the bounds {:.3} %", objective.error(&phi).expect("positive definite"));
    group.bench_function(id("annealing evaluation", n), |b| {
        b.iter(|| objective.error(black_box(&phi)).expect("positive definite"));
    });
    let (mut residual, mut jacobian) = (Vec::new(), Vec::new());
    group.bench_function(id("Gauss-Newton iteration", n), |b| {
        b.iter(|| {
            objective.error(black_box(&phi)).expect("positive definite");
            objective.linearise(&mut residual, &mut jacobian).expect("solvable");
            let model = LeastSquares::new(&jacobian, residual.len(), phi.len());
            let (weights, gradient) = (model.column_squares(), model.transposed(&residual));
            model.minimise_in_box(&weights, &gradient, &vec![-1e9; phi.len()], &vec![1e9; phi.len()])
        });
    });
    surrogate(&mut group, n, &mut objective, &jacobian);
    group.finish();
}

/// One evaluation of a surrogate with 20 columns, and of its bound.
fn surrogate(group: &mut BenchmarkGroup<WallTime>, n: usize, objective: &mut Displacement, derivatives: &[f64]) {
    let target = objective.target();
    let mut phi: Vec<f64> = target.upper.iter().map(|u| 0.1 * u).collect();
    let mut basis = Galerkin::new(target);
    basis.enrich(derivatives);
    // solutions at random states within a decade: enough of them, and never more than enough
    let mut stream = Stream::new(1, 0, 0);
    for _ in 0..60 {
        if basis.rank() >= 20 {
            break;
        }
        let state = |upper: &f64| 0.1 * upper * 10f64.powf(stream.uniform() - 0.5);
        phi = target.upper.iter().map(state).collect();
        objective.error(&phi).expect("positive definite");
        basis.enrich(objective.displacement());
    }
    let mut certificate = Certificate::new(target, &phi).expect("positive definite");
    certificate.extend(&basis);
    let mut image = Walker::bound_workspace(&certificate);
    let mut walker = Walker::new(&basis, None);
    phi[0] *= 1.7;
    let errors = (objective.error(&phi).expect("positive definite"), walker.error(&phi).expect("positive definite"));
    println!("{n}^3: r = {}, error {:.9} %, of the surrogate {:.9} %", basis.rank(), errors.0, errors.1);
    group.bench_function(id("surrogate evaluation", n), |b| {
        b.iter(|| walker.error(black_box(&phi)).expect("positive definite"));
    });
    group.bench_function(id("surrogate bound", n), |b| {
        b.iter(|| walker.bound(black_box(&certificate), &mut image));
    });
}

criterion_group!(benches, stages);
criterion_main!(benches);
