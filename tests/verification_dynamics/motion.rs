//! Motions of networks: order of convergence, what is conserved, tangents, thread counts, and what is refused.

use springfit::clock::Progress;
use springfit::dynamics::energy::{Energies, drift};
use springfit::dynamics::external::{External, History, Part};
use springfit::dynamics::integrator::INTEGRATORS;
use springfit::dynamics::model::Model;
use springfit::dynamics::motion::{Motion, Schedule, run};
use springfit::dynamics::stability::{Linearised, limit};
use springfit::dynamics::stepper::{Settings, Stepper};
use springfit::error::Error;

use super::bodies::{Body, FREE, experiment_ii, free_block, free_membrane, integrator, noise, shape, swing};

/// Displacement after `time` seconds in `steps` steps from a velocity field without a structure.
fn end(model: &mut dyn Model, name: &str, time: f64, steps: u64, external: &External) -> Vec<f64> {
    let n = model.unknowns();
    let start = [vec![0.0; n], noise(n, 0.3)];
    let settings = Settings::with_step(time / steps as f64);
    let mut stepper =
        Stepper::new(model, external, integrator(name), settings, [&start[0], &start[1]]).expect("masses");
    (0..steps).for_each(|_| stepper.advance().expect("a step"));
    stepper.state().displacement.clone()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn every_integrator_converges_with_its_order_on_linear_bodies_and_on_springs() {
    let body = experiment_ii();
    for linear in [true, false] {
        for alpha in [None, Some(20.0)] {
            let model = |run: &mut dyn FnMut(&mut dyn Model) -> Vec<f64>| {
                let mut springs = body.model(alpha);
                if linear { run(&mut springs.linear()) } else { run(&mut springs) }
            };
            let exact = model(&mut |model| end(model, "midpoint", 0.2, 12_800, FREE));
            for (name, order) in [
                ("leapfrog", if alpha.is_some() { 1.0 } else { 2.0 }),
                ("central_difference", 2.0),
                ("newmark", 2.0),
                ("implicit_euler", 1.0),
                ("semi_implicit_euler", 1.0),
                ("midpoint", 2.0),
            ] {
                let errors = [400, 800].map(|steps| distance(&model(&mut |m| end(m, name, 0.2, steps, FREE)), &exact));
                let slope = (errors[0] / errors[1]).log2();
                assert!((slope - order).abs() < 0.1, "{name} linear {linear} alpha {alpha:?}: {slope}, {errors:?}");
            }
        }
    }
    assert_eq!(INTEGRATORS.len(), 6, "every integrator is here");
}

/// A recorded run of a model from a displacement.
fn recorded(model: &mut dyn Model, name: &str, step: f64, schedule: Schedule, u: &[f64]) -> Motion {
    let still = vec![0.0; u.len()];
    let settings = Settings::with_step(step);
    let mut stepper = Stepper::new(model, FREE, integrator(name), settings, [u, &still]).expect("masses");
    run(&mut stepper, schedule, &|_| 0.0, &Progress::default()).expect("a motion")
}

#[test]
fn newmark_and_midpoint_drift_by_less_than_1e_10_over_10_000_steps_of_linear_bodies() {
    let schedule = Schedule { steps: 10_000, every: 50 };
    for (body, alpha) in [(experiment_ii(), None), (experiment_ii(), Some(50.0)), (shape("torus"), None)] {
        let mut model = body.model(alpha).linear();
        let u = noise(model.unknowns(), 0.1);
        for name in ["newmark", "midpoint"] {
            let motion = recorded(&mut model, name, 0.02, schedule, &u);
            assert_eq!(motion.times.len(), 201);
            assert!(drift(&motion.energies) < 1e-10, "{} {name}: {:e}", body.name, drift(&motion.energies));
        }
    }
}

#[test]
fn energy_of_leapfrog_is_bounded_over_10_000_steps_and_falls_with_the_square_of_the_step() {
    let body = experiment_ii();
    let mut model = body.model(None).linear();
    let u = noise(model.unknowns(), 0.1);
    let rest = vec![0.0; u.len()];
    let largest = limit(&Linearised::at(&mut model, &rest, None)).expect("a limit").undamped;
    let swings = [0.2, 0.1].map(|part| {
        let motion = recorded(&mut model, "leapfrog", part * largest, Schedule { steps: 10_000, every: 1 }, &u);
        let half = |part: &[Energies]| {
            let total = part.iter().map(Energies::mechanical);
            total.fold(0.0_f64, |a, e| a.max((e / motion.energies[0].mechanical() - 1.0).abs()))
        };
        let [first, second] = [half(&motion.energies[..5000]), half(&motion.energies[5000..])];
        assert!(second < 1.2 * first, "no drift: {first} then {second}");
        first.max(second)
    });
    // (omega h)^2/4 = part^2 is the swing of the fastest mode, and so the most there can be
    assert!(swings[0] < 0.04 && swings[1] < 0.01, "{swings:?}");
    assert!((swings[0] / swings[1]).log2() > 1.7, "{swings:?}");
}

#[test]
fn damped_motion_balances_elastic_kinetic_and_dissipated_energy_with_the_work() {
    let body = experiment_ii();
    let forces = noise(body.dofs.len(), 20.0);
    let external = External { parts: vec![Part { forces, history: History::Until(1.0 / 30.0) }] };
    for name in ["leapfrog", "central_difference", "newmark", "midpoint"] {
        let mut lost = Vec::new();
        for step in [1e-3, 5e-4] {
            let mut model = body.model(Some(40.0));
            let rest = vec![0.0; model.unknowns()];
            let settings = Settings::with_step(step);
            let mut stepper =
                Stepper::new(&mut model, &external, integrator(name), settings, [&rest, &rest]).expect("masses");
            let schedule = Schedule { steps: (0.5 / step) as u64, every: 10 };
            let motion = run(&mut stepper, schedule, &|_| 0.0, &Progress::default()).expect("a motion");
            let last = motion.energies.last().expect("a record");
            assert!(last.dissipated > 0.1 * last.work && last.work > 0.0, "{last:?}");
            lost.push(drift(&motion.energies));
        }
        assert!(lost[0] < 2e-2 && lost[1] < 0.6 * lost[0], "{name}: {lost:?}");
    }
}

/// Momentum, and angular momentum about the origin, of a network.
fn momenta(body: &Body, stepper: &Stepper) -> [f64; 6] {
    let (u, v) = (body.dofs.expand(&stepper.state().displacement), body.dofs.expand(&stepper.state().velocity));
    let mut sum = [0.0; 6];
    for (node, mass) in body.masses.iter().enumerate() {
        let x = [0, 1, 2].map(|a| body.network.positions[node][a] + u[node][a]);
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            sum[a] += mass * v[node][a];
            sum[3 + a] += mass * (x[b] * v[node][c] - x[c] * v[node][b]);
        }
    }
    sum
}

#[test]
fn free_networks_keep_momentum_and_angular_momentum() {
    for body in [free_membrane(), free_block()] {
        // the last two do not promise the angular momentum: their velocity belongs to another place, or is damped
        let names = [
            ("leapfrog", Some(1e-11)),
            ("midpoint", Some(1e-8)),
            ("central_difference", None),
            ("implicit_euler", None),
        ];
        for (name, angular) in names {
            let mut model = body.model((name != "leapfrog").then_some(100.0));
            let n = model.unknowns();
            let (rest, velocity) = (vec![0.0; n], noise(n, 1.0));
            let settings = Settings::with_step(2e-3);
            let mut stepper =
                Stepper::new(&mut model, FREE, integrator(name), settings, [&rest, &velocity]).expect("masses");
            let before = momenta(&body, &stepper);
            (0..500).for_each(|_| stepper.advance().expect("a step"));
            let after = momenta(&body, &stepper);
            for a in 0..3 {
                assert!((before[a] - after[a]).abs() < 1e-9, "{} {name}: {before:?} {after:?}", body.name);
            }
            let Some(angular) = angular else { continue };
            for a in 3..6 {
                assert!((before[a] - after[a]).abs() < angular, "{} {name}: {before:?} {after:?}", body.name);
            }
        }
    }
}

#[test]
fn a_network_that_moves_or_turns_as_a_whole_feels_no_force() {
    let body = free_block();
    let mut model = body.model(Some(1.0));
    let (sine, cosine) = 0.7_f64.sin_cos();
    let n = model.unknowns();
    let (mut u, mut v, mut force) = (vec![0.0; n], vec![0.0; n], vec![f64::NAN; n]);
    for dof in 0..n {
        let (node, component) = body.dofs.owner(dof);
        let [x, y, z] = body.network.positions[node];
        let turned = [cosine * x - sine * y + 3.0, sine * x + cosine * y - 1.0, z + 2.0];
        u[dof] = turned[component] - body.network.positions[node][component];
        // a spin about z at the turned place, and a drift
        v[dof] = [-turned[1] + 0.3, turned[0], 0.5][component];
    }
    model.internal_force(&u, &v, &mut force);
    assert!(force.iter().all(|f| f.abs() < 1e-10), "{force:?}");
    assert!(model.elastic_energy(&u) < 1e-20 && model.dissipated_power(&u, &v) < 1e-20);
}

#[test]
fn tangents_of_springs_are_the_derivatives_of_their_force() {
    let body = shape("cube");
    let mut model = body.model(Some(10.0));
    let n = model.unknowns();
    let (u, zero) = (noise(n, 0.05), vec![0.0; n]);
    let (mut stiffness, mut damping) = (vec![0.0; model.pattern().entries()], vec![0.0; model.pattern().entries()]);
    model.tangent(&u, &zero, &mut stiffness, &mut damping);
    let pattern = model.pattern().clone();
    let (mut plus, mut minus) = (vec![0.0; n], vec![0.0; n]);
    for column in (0..n).step_by(17) {
        let mut moved = [u.clone(), u.clone()];
        moved[0][column] += 1e-5;
        moved[1][column] -= 1e-5;
        model.internal_force(&moved[0], &zero, &mut plus);
        model.internal_force(&moved[1], &zero, &mut minus);
        let mut v = zero.clone();
        v[column] = 1.0;
        let slope: Vec<f64> = plus.iter().zip(&minus).map(|(p, m)| (p - m) / 2e-5).collect();
        model.internal_force(&u, &v, &mut plus);
        model.internal_force(&u, &zero, &mut minus);
        for row in 0..n {
            let entry = |values: &[f64]| pattern.position(row, column).map_or(0.0, |place| values[place]);
            assert!((slope[row] - entry(&stiffness)).abs() < 1e-4, "{row} {column}");
            assert!((plus[row] - minus[row] - entry(&damping)).abs() < 1e-9, "{row} {column}");
        }
    }
    // power taken by the dampers: the trait's own formula against the sum over springs
    let v = noise(n, 1.0);
    model.internal_force(&u, &v, &mut plus);
    model.internal_force(&u, &zero, &mut minus);
    let power: f64 = v.iter().zip(plus.iter().zip(&minus)).map(|(v, (p, m))| v * (p - m)).sum();
    assert!((model.dissipated_power(&u, &v) / power - 1.0).abs() < 1e-12);
}

#[test]
fn two_thread_counts_give_the_same_bits() {
    let body = shape("spheroid");
    for name in ["leapfrog", "midpoint"] {
        let bits = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| {
                let mut model = body.model(Some(100.0));
                let u = noise(model.unknowns(), 0.02);
                let motion = recorded(&mut model, name, 2e-3, Schedule { steps: 40, every: 8 }, &u);
                let numbers =
                    motion.frames.concat().into_iter().chain(motion.energies.iter().map(Energies::mechanical));
                numbers.map(f64::to_bits).collect::<Vec<_>>()
            })
        });
        assert_eq!(bits[0], bits[1], "{name}");
    }
}

#[test]
fn the_isotropic_bound_holds_for_turned_and_stretched_networks() {
    let body = shape("cube");
    let mut model = body.model(Some(20.0));
    let bound = limit(&body.isotropic(20.0)).expect("a limit").damped;
    let n = model.unknowns();
    let rest = limit(&Linearised::at(&mut model, &vec![0.0; n], None)).expect("a limit").damped;
    assert!(bound < rest);
    for size in [0.05, 0.5, 5.0] {
        let state = Linearised::at(&mut model, &noise(n, size), None);
        assert!(state.is_stable(bound * (1.0 - 1e-9)).expect("an analysis"), "at {size}");
    }
    // pulled ten times as long, springs hold sideways: the limit at rest is too large there
    let pulled: Vec<f64> =
        (0..n).map(|dof| 9.0 * body.network.positions[body.dofs.owner(dof).0][body.dofs.owner(dof).1]).collect();
    let state = Linearised::at(&mut model, &pulled, None);
    assert!(!state.is_stable(0.999 * rest).expect("an analysis"));
    assert!(state.is_stable(bound * (1.0 - 1e-9)).expect("an analysis"));
}

#[test]
fn a_motion_that_grows_without_bound_is_named_and_ends() {
    let body = experiment_ii();
    let mut model = body.model(Some(1.0));
    let u = noise(model.unknowns(), 0.01);
    let outcome = swing(&mut model, "leapfrog", 1.0 / 60.0, 10_000, &u, &mut |_| true);
    assert!(matches!(&outcome, Err(Error::BlowUp { step, .. }) if *step < 1000), "{outcome:?}");
    assert_eq!(outcome.unwrap_err().exit_status(), 3);
}

#[test]
fn newton_reports_its_residual_and_says_when_it_does_not_converge() {
    let body = experiment_ii();
    let mut model = body.model(None);
    let u = noise(model.unknowns(), 0.1);
    let still = vec![0.0; u.len()];
    let settings = Settings::with_step(0.05);
    let mut stepper = Stepper::new(&mut model, FREE, integrator("newmark"), settings, [&u, &still]).expect("masses");
    (0..20).for_each(|_| stepper.advance().expect("a step"));
    let solves = stepper.solves();
    assert!(solves.residual > 0.0 && solves.residual <= 1e-10 && solves.iterations >= 40, "{solves:?}");
    let hasty = Settings { iterations: 1, ..Settings::with_step(0.05) };
    let mut stepper = Stepper::new(&mut model, FREE, integrator("newmark"), hasty, [&u, &still]).expect("masses");
    let outcome = stepper.advance();
    assert!(
        matches!(outcome, Err(Error::NotConverged { step: 1, residual, iterations: 1, .. }) if residual > 1e-10),
        "{outcome:?}"
    );
}

#[test]
fn a_linear_run_factors_once() {
    let body = experiment_ii();
    let mut model = body.model(Some(10.0)).linear();
    let u = noise(model.unknowns(), 0.1);
    for name in ["newmark", "midpoint", "implicit_euler", "central_difference"] {
        let mut factorisations = 0;
        swing(&mut model, name, 0.01, 50, &u, &mut |stepper| {
            factorisations = stepper.solves().factorisations;
            true
        })
        .expect("a motion");
        assert_eq!(factorisations, 1, "{name}");
    }
}

#[test]
fn rest_stays_rest_with_every_integrator() {
    let body = shape("torus");
    for integrator in INTEGRATORS {
        let mut model = body.model(Some(100.0));
        let rest = vec![0.0; model.unknowns()];
        swing(&mut model, integrator.name, 1e-3, 20, &rest, &mut |stepper| {
            assert!(stepper.state().displacement.iter().all(|u| u.abs() < 1e-14), "{}", integrator.name);
            true
        })
        .expect("a motion");
    }
}
