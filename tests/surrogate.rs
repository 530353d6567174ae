//! The surrogate against the exact objective: exactness at snapshots, the bound never below the true error, the best
//! known errors of `reference/objects.json`, the same bits for any number of threads.

use std::time::Instant;

use serde_json::Value;
use springfit::calibration::objective::{Objective, Problem};
use springfit::calibration::objectives::displacement::{Displacement, Target, weights};
use springfit::calibration::optimiser::{Outcome, Settings, find};
use springfit::calibration::surrogate::certificate::Certificate;
use springfit::calibration::surrogate::galerkin::Galerkin;
use springfit::calibration::surrogate::walker::Walker;
use springfit::clock::Progress;
use springfit::reference::Reference;
use springfit::rng::Stream;
use springfit::scene::{self, Scene, Source};
use springfit::sparse::ordering::nested_dissection;
use springfit::springs::affine::AffineStiffness;
use springfit::springs::weighting::Weighting;
use springfit::springs::{bounds, grouping};
use springfit::study::loads::LoadCase;
use springfit::study::network::Lattice;
use springfit::study::{body, loads, network};

/// A body of method section 8 with its springs in length groups.
struct Case {
    stiffness: AffineStiffness,
    lattice: Lattice,
    loads: Vec<LoadCase>,
    reference: Vec<f64>,
    weights: Vec<f64>,
    upper: Vec<f64>,
}

fn case(shape: &str, gamma: f64) -> Case {
    weighted_case(shape, gamma, Weighting::Springs)
}

fn weighted_case(shape: &str, gamma: f64, weighting: Weighting) -> Case {
    let text = scene::template(shape).expect("a shape");
    let source = Source { name: shape.into(), text };
    let mut scene: Scene = scene::parse(&source).expect("a template is valid");
    scene.springs.weighting = weighting;
    let body = body::build(&scene).expect("a body");
    let loads = loads::build(&scene, &body).expect("loads");
    let lattice = network::build(&scene, &body).expect("a network");
    let order = body.dofs.order(&nested_dissection(body.grid().extents(), 2, [false; 3]));
    let forces = vec![loads[0].load.clone()];
    let reference =
        Reference::solve(&body.integration_points(), body.lame, &body.dofs, order, &forces).expect("solvable");
    let groups = (grouping::find("length").expect("known").group)(&lattice.network, gamma).expect("legal gamma");
    let stiffness =
        AffineStiffness::new(&lattice.network, &groups, &lattice.coefficients, &body.dofs, &lattice.symbolic);
    let upper = bounds::upper_bounds(&lattice.network, &groups, &lattice.spring_bounds, scene.springs.law);
    let weights = weights(&[reference.cases[0].u_max], body.dofs.masters().count());
    Case { stiffness, lattice, loads, reference: reference.cases[0].displacement.clone(), weights, upper }
}

impl Case {
    fn target(&self) -> Target<'_> {
        Target {
            stiffness: &self.stiffness,
            symbolic: &self.lattice.symbolic,
            upper: &self.upper,
            forces: &self.loads[0].load.forces,
            reference: &self.reference,
            weights: &self.weights,
        }
    }

    fn centre(&self) -> Vec<f64> {
        self.upper.iter().map(|upper| 0.1 * upper).collect()
    }

    /// A basis of the solution and derivatives at the centre and of solutions at `snapshots` random states.
    fn basis(&self, snapshots: usize, decades: f64) -> (Galerkin<'_>, Vec<Vec<f64>>) {
        let mut exact = Displacement::new(self.target());
        let mut basis = Galerkin::new(self.target());
        let mut states = vec![self.centre()];
        let mut stream = Stream::new(5, 0, 0);
        states.extend((0..snapshots).map(|_| near(&self.centre(), decades, &mut stream)));
        for (i, phi) in states.iter().enumerate() {
            exact.error(phi).expect("positive definite");
            basis.enrich(exact.displacement());
            if i == 0 {
                let (mut residual, mut jacobian) = (vec![], vec![]);
                exact.linearise(&mut residual, &mut jacobian).expect("solvable");
                basis.enrich(&jacobian);
            }
        }
        (basis, states)
    }

    fn run(&self, optimiser: &str, seed: u64, settings: &Settings) -> Outcome {
        let make = || -> Box<dyn Objective + '_> { Box::new(Displacement::new(self.target())) };
        let progress = Progress::default();
        let displacement = Some(self.target());
        let problem = Problem { make: &make, displacement, upper: &self.upper, seed, index: 0, progress: &progress };
        (find(optimiser).expect("in the table").run)(&problem, settings).expect("a well-posed problem")
    }
}

/// Each phi moved by up to half the decades up or down.
fn near(centre: &[f64], decades: f64, stream: &mut Stream) -> Vec<f64> {
    centre.iter().map(|phi| phi * 10f64.powf(decades * (stream.uniform() - 0.5))).collect()
}

#[test]
fn the_surrogate_is_exact_at_its_snapshots_and_right_to_first_order_at_the_centre() {
    for (shape, gamma) in [("circle", 0.01), ("torus", 0.5)] {
        let case = case(shape, gamma);
        let (basis, states) = case.basis(4, 1.0);
        let mut exact = Displacement::new(case.target());
        let mut walker = Walker::new(&basis, None);
        for phi in &states {
            let (e, s) = (exact.error(phi).expect("definite"), walker.error(phi).expect("definite"));
            assert!((e / s - 1.0).abs() < 1e-9, "{shape}: {e} {s}");
        }
        // one group moved by h: the error of the surrogate falls like h^2
        let wrong = |h: f64, walker: &mut Walker, exact: &mut Displacement| {
            let mut phi = states[0].clone();
            phi[1] *= 1.0 + h;
            (exact.error(&phi).expect("definite") - walker.error(&phi).expect("definite")).abs()
        };
        let (far, close) = (wrong(0.1, &mut walker, &mut exact), wrong(0.01, &mut walker, &mut exact));
        assert!(close < 0.02 * far || close < 1e-11, "{shape}: {far:e} {close:e}");
    }
}

#[test]
fn the_jacobian_of_the_surrogate_is_that_of_its_error() {
    let case = case("circle", 0.2);
    let (basis, _) = case.basis(3, 1.0);
    let mut walker = Walker::new(&basis, None);
    let mut phi = near(&case.centre(), 0.5, &mut Stream::new(8, 0, 0));
    walker.error(&phi).expect("definite");
    let error = walker.fit_scale(&mut phi);
    assert!((walker.error(&phi).expect("definite") / error - 1.0).abs() < 1e-12);
    let (mut residual, mut jacobian) = (vec![], vec![]);
    walker.error(&phi).expect("definite");
    walker.fit_scale(&mut phi);
    walker.linearise(&mut residual, &mut jacobian).expect("solvable");
    for a in 0..phi.len() {
        let slope: f64 = residual.iter().zip(&jacobian[a * residual.len()..]).map(|(r, j)| r * j).sum::<f64>() / error;
        let h = 1e-5 * phi[a];
        let moved = |h: f64, walker: &mut Walker| {
            let mut phi = phi.clone();
            phi[a] += h;
            walker.error(&phi).expect("definite")
        };
        let difference = (moved(h, &mut walker) - moved(-h, &mut walker)) / (2.0 * h);
        assert!((slope - difference).abs() < 1e-6 * slope.abs().max(error / phi[a] * 1e-3), "{slope} {difference}");
    }
}

#[test]
fn the_bound_is_never_below_the_true_error_in_a_thousand_states() {
    for (shape, gamma, decades) in [
        ("square", 0.1, 2.0),
        ("circle", 0.2, 1.0),
        ("circle", 0.01, 0.5),
        ("cube", 0.1, 2.0),
        ("torus", 0.5, 1.0),
        ("torus", 0.1, 0.5),
    ] {
        let case = case(shape, gamma);
        let (basis, _) = case.basis(3, decades);
        let mut certificate = Certificate::new(case.target(), &case.centre()).expect("positive definite");
        certificate.bound_eigenvalue().expect("positive definite");
        certificate.extend(&basis);
        let mut image = Walker::bound_workspace(&certificate);
        let mut exact = Displacement::new(case.target());
        let mut walker = Walker::new(&basis, None);
        let mut stream = Stream::new(9, 0, 0);
        let (mut energy, mut error) = (Spread::default(), Spread::default());
        let mut strain = vec![0.0; case.stiffness.unknowns()];
        for _ in 0..1000 {
            let phi = near(&case.centre(), decades, &mut stream);
            let e = exact.error(&phi).expect("definite");
            let s = walker.error(&phi).expect("definite");
            let bound = walker.bound(&certificate, &mut image);
            let difference: Vec<f64> =
                exact.displacement().iter().zip(walker.displacement()).map(|(u, v)| u - v).collect();
            case.stiffness.apply_all(&phi, &difference, &mut strain);
            let true_energy = difference.iter().zip(&strain).map(|(u, f)| u * f).sum::<f64>().sqrt();
            assert!(bound.energy >= true_energy, "{shape} {gamma}: {bound:?} {true_energy:e}");
            assert!(bound.error >= (e - s).abs(), "{shape} {gamma}: {bound:?} {e} {s}");
            energy.add(bound.energy / true_energy);
            error.add(bound.error / (e - s).abs());
        }
        println!(
            "{shape} {} groups, r = {}, {decades} decades: energy bound / true error {energy}, e_rms bound / true {error}",
            case.upper.len(),
            basis.rank()
        );
    }
}

/// Smallest, median and largest of some ratios.
#[derive(Default)]
struct Spread(Vec<f64>);

impl Spread {
    fn add(&mut self, ratio: f64) {
        self.0.push(ratio);
    }
}

impl std::fmt::Display for Spread {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        write!(f, "{:.2} .. {:.1} .. {:.0}", sorted[0], sorted[sorted.len() / 2], sorted[sorted.len() - 1])
    }
}

#[test]
fn the_residual_norm_has_no_floor_at_the_root_of_rounding() {
    let case = case("circle", 0.2);
    let (basis, states) = case.basis(3, 1.0);
    let mut certificate = Certificate::new(case.target(), &case.centre()).expect("positive definite");
    certificate.extend(&basis);
    let mut image = Walker::bound_workspace(&certificate);
    let mut walker = Walker::new(&basis, None);
    walker.error(&states[2]).expect("definite");
    let at_snapshot = walker.bound(&certificate, &mut image);
    let compliance: f64 =
        case.target().forces.iter().zip(walker.displacement()).map(|(f, u)| f * u).sum::<f64>().sqrt();
    println!("bound at a snapshot {:e} of the energy norm of the solution", at_snapshot.energy / compliance);
    assert!(at_snapshot.energy < 1e-11 * compliance);
}

/// The smallest e_rms known of a body and gamma.
fn best_known(shape: &str, gamma: f64, table: &str) -> f64 {
    let all: Value = serde_json::from_str(include_str!("reference/objects.json")).expect("JSON");
    let rows = all["objects"][shape][table].as_array().expect("rows").clone();
    let row = rows.iter().find(|row| row["gamma"].as_f64() == Some(gamma)).expect("a row of this gamma").clone();
    row["best_e_rms"].as_f64().expect("a number")
}

#[test]
fn annealing_on_the_surrogate_finds_the_best_known_errors() {
    let bodies = [("circle", 0.01, 16), ("torus", 0.5, 4), ("torus", 0.1, 15)];
    let tables = [("by_gamma", Weighting::Springs), ("weighting_cells", Weighting::Cells)];
    for ((shape, gamma, groups), (table, weighting)) in bodies.iter().flat_map(|b| tables.iter().map(move |t| (*b, *t)))
    {
        let case = weighted_case(shape, gamma, weighting);
        assert_eq!(case.upper.len(), groups);
        let known = best_known(shape, gamma, table);
        for seed in 1..4 {
            let start = Instant::now();
            let found = case.run("surrogate", seed, &Settings::default());
            println!(
                "{shape} {groups} groups seed {seed}: {:.5} % ({:+.3} % of the best known), {} exact, {} surrogate, {:.4} s, {:?}",
                found.error,
                100.0 * (found.error / known - 1.0),
                found.counts.evaluations,
                found.counts.surrogate_evaluations,
                start.elapsed().as_secs_f64(),
                found.stop
            );
            assert!(found.error <= 1.01 * known, "{shape}: {} of {known}", found.error);
            assert!(found.counts.evaluations < 60);
            let exact = Displacement::new(case.target()).error(&found.phi).expect("definite");
            assert!((exact / found.error - 1.0).abs() < 1e-11, "the answer is exact: {exact} {}", found.error);
            assert!(found.phi.iter().zip(&case.upper).all(|(phi, upper)| *phi >= 0.0 && phi <= upper));
        }
    }
}

#[test]
fn the_search_gives_the_same_bits_for_1_2_and_4_threads() {
    let case = case("torus", 0.5);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| case.run("surrogate", 3, &Settings::default()))
    };
    let one = run(1);
    for threads in [2, 4] {
        let other = run(threads);
        assert_eq!(one.phi, other.phi);
        assert_eq!(one.error.to_bits(), other.error.to_bits());
        assert_eq!(one.counts, other.counts);
    }
}
