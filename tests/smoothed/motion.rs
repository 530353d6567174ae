//! Bodies in motion: what midpoint keeps, what damping takes, and that the integrators agree.

use crate::bodies::*;
use nalgebra_sparse::na::Vector3;
use springfit::dynamics::corotational::CorotationalModel;
use springfit::dynamics::external::{External, History, Part};
use springfit::dynamics::integrator;
use springfit::dynamics::model::Model;
use springfit::dynamics::stepper::{Settings, Stepper};
use springfit::geometry::dofs::DofMap;
use springfit::reference::corotational::Tangent;
use springfit::reference::corotational::held::Held;
use springfit::reference::methods::smoothed::Smoothing;

/// The beam with a kind of smoothing, its tangent, and the volume of every node.
fn model(
    cells: [usize; 3],
    smoothing: Smoothing,
    dofs: fn(&[[f64; 3]]) -> DofMap,
    tangent: Tangent,
) -> CorotationalModel {
    let mesh = beam(cells, 0.3, 1);
    let domains = smoothed_domains(&mesh, smoothing);
    let masses: Vec<f64> = row_sums(&domains).iter().map(|volume| DENSITY * volume).collect();
    let held = Held::new(domains, mesh.positions(), lame(0.3), dofs(mesh.positions())).expect("in space");
    CorotationalModel::new(held, &masses, tangent)
}

fn settings(step: f64) -> Settings {
    Settings { tolerance: 1e-12, ..Settings::with_step(step) }
}

fn unheld(positions: &[[f64; 3]]) -> DofMap {
    free(positions.len())
}

/// Linear and angular momentum of a free body.
fn momenta(positions: &[[f64; 3]], masses: &[f64], u: &[f64], v: &[f64]) -> [Vector3<f64>; 2] {
    let mut sums = [Vector3::zeros(), Vector3::zeros()];
    for (node, position) in positions.iter().enumerate() {
        let at = Vector3::from(*position) + Vector3::from_column_slice(&u[3 * node..3 * node + 3]);
        let momentum = Vector3::from_column_slice(&v[3 * node..3 * node + 3]) * masses[3 * node];
        sums[0] += momentum;
        sums[1] += at.cross(&momentum);
    }
    sums
}

#[test]
fn acceptance_midpoint_keeps_momentum_over_1000_steps_of_a_spinning_free_body() {
    for smoothing in [Smoothing::Element, Smoothing::Face] {
        let mut model = model([2, 1, 1], smoothing, unheld, Tangent::Exact);
        let positions = beam([2, 1, 1], 0.3, 1).positions().to_vec();
        let spin = Vector3::new(3.0, -8.0, 5.0);
        let start: Vec<f64> = positions
            .iter()
            .flat_map(|x| {
                let v =
                    spin.cross(&Vector3::from(*x)) + Vector3::new(1.0, 2.0, -0.5) + Vector3::new(0.0, x[0], 0.0) * 4.0;
                [v.x, v.y, v.z]
            })
            .collect();
        let masses = model.masses().to_vec();
        let zeros = vec![0.0; start.len()];
        let before = momenta(&positions, &masses, &zeros, &start);
        let still = External::default();
        let midpoint = integrator::find("midpoint").expect("in the table");
        let mut stepper = Stepper::new(&mut model, &still, midpoint, settings(5e-3), [&zeros, &start]).expect("masses");
        let kinetic: f64 = 0.5 * masses.iter().zip(&start).map(|(m, v)| m * v * v).sum::<f64>();
        let mut strained = 0.0_f64;
        for _ in 0..1000 {
            stepper.advance().expect("it converges");
            let u = stepper.state().displacement.clone();
            strained = strained.max(stepper.model().elastic_energy(&u));
        }
        let state = stepper.state().clone();
        let after = momenta(&positions, &masses, &state.displacement, &state.velocity);
        for (before, after) in before.iter().zip(&after) {
            assert!((after - before).norm() < 1e-10 * before.norm(), "{smoothing:?}: {before} {after}");
        }
        assert!(strained > 1e-2 * kinetic, "the body is strained: {strained} of {kinetic}");
    }
}

/// The cantilever swings under its weight; where its tip is after a while.
fn swing(name: &str, tangent: Tangent, steps: usize, damping: [f64; 2]) -> f64 {
    let mut model = model([5, 1, 1], Smoothing::Face, clamped, tangent).with_damping(damping[0], damping[1]);
    let mesh = beam([5, 1, 1], 0.3, 1);
    let dofs = clamped(mesh.positions());
    let forces = weight(&dofs, &row_sums(&smoothed_domains(&mesh, Smoothing::Face)));
    let external = External { parts: vec![Part { forces, history: History::Constant }] };
    let zeros = vec![0.0; dofs.len()];
    let found = integrator::find(name).expect("in the table");
    let mut stepper =
        Stepper::new(&mut model, &external, found, settings(0.05 / steps as f64), [&zeros, &zeros]).expect("masses");
    for _ in 0..steps {
        stepper.advance().expect("it converges");
    }
    let [dissipated, supplied] = stepper.accounts();
    let state = stepper.state().clone();
    let masses = stepper.model().masses().to_vec();
    let kinetic = 0.5 * masses.iter().zip(&state.velocity).map(|(m, v)| m * v * v).sum::<f64>();
    let energy = kinetic + stepper.model().elastic_energy(&state.displacement);
    if name == "midpoint" {
        assert!((supplied - dissipated - energy).abs() < 2e-3 * supplied, "{supplied} {dissipated} {energy}");
    }
    assert!(dissipated >= 0.0 && (dissipated > 0.0) == (damping != [0.0; 2]));
    tip(mesh.positions(), &dofs.expand(&state.displacement), 2)
}

#[test]
fn every_integrator_converges_to_the_swing_of_midpoint_with_its_order() {
    for damping in [[0.0; 2], [2.0, 1e-3]] {
        let exact = swing("midpoint", Tangent::Exact, 3200, damping);
        assert!(exact.abs() > 5e-3, "{exact}");
        for (name, tangent, order) in [
            ("midpoint", Tangent::Exact, 2.0),
            ("newmark", Tangent::Positive, 2.0),
            ("implicit_euler", Tangent::Positive, 1.0),
            ("semi_implicit_euler", Tangent::Warped, 1.0),
        ] {
            let errors = [100, 200].map(|steps| (swing(name, tangent, steps, damping) - exact).abs());
            let slope = (errors[0] / errors[1]).log2();
            assert!((slope - order).abs() < 0.15, "{name} {damping:?}: {slope}, {errors:?}");
        }
    }
}

/// Damping forces against the derivative that is told of them, by differences.
#[test]
fn the_damping_tangent_is_the_derivative_of_the_damping_force() {
    let mut model = model([3, 1, 1], Smoothing::Face, clamped, Tangent::Exact).with_damping(0.7, 0.02);
    let n = model.unknowns();
    let u: Vec<f64> = (0..n).map(|i| 0.02 * (i as f64 * 1.7).sin()).collect();
    let v: Vec<f64> = (0..n).map(|i| (i as f64 * 0.9).cos()).collect();
    let (mut stiffness, mut damping) = (vec![0.0; model.pattern().entries()], vec![0.0; model.pattern().entries()]);
    model.tangent(&u, &v, &mut stiffness, &mut damping);
    let (mut moving, mut resting) = (vec![0.0; n], vec![0.0; n]);
    model.internal_force(&u, &v, &mut moving);
    model.internal_force(&u, &vec![0.0; n], &mut resting);
    let mut power = 0.0;
    for i in 0..n {
        let (first, row) = (model.pattern().offsets()[i], model.pattern().row(i));
        let product: f64 = row.iter().enumerate().map(|(k, &j)| damping[first + k] * v[j]).sum();
        assert!((product - (moving[i] - resting[i])).abs() < 1e-10 * moving[i].abs().max(1.0));
        power += v[i] * product;
    }
    assert!((model.dissipated_power(&u, &v) / power - 1.0).abs() < 1e-12 && power > 0.0);
}
