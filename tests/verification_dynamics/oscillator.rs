//! One oscillator: what every integrator makes of omega = 2 pi, in closed form.

use std::f64::consts::PI;

use springfit::dynamics::energy::{Energies, drift};
use springfit::dynamics::integrator::INTEGRATORS;
use springfit::dynamics::stepper::{Settings, Stepper};

use super::bodies::{FREE, integrator, oscillator, swing};

const OMEGA: f64 = 2.0 * PI;

/// The 2x2 matrix that takes (u, v) to the next step, by columns.
fn amplification(name: &str, step: f64, zeta: f64) -> [[f64; 2]; 2] {
    [[1.0, 0.0], [0.0, 1.0]].map(|[u, v]| {
        let mut model = oscillator(OMEGA, zeta);
        let settings = Settings::with_step(step);
        let mut stepper = Stepper::new(&mut model, FREE, integrator(name), settings, [&[u], &[v]]).expect("a mass");
        stepper.advance().expect("a step");
        [stepper.state().displacement[0], stepper.state().velocity[0]]
    })
}

/// Frequency ratio and amplitude factor a step of an undamped oscillator: the eigenvalues of the matrix.
fn laws(name: &str, step: f64) -> [f64; 2] {
    let [[a, c], [b, d]] = amplification(name, step, 0.0);
    let (half_trace, determinant) = (0.5 * (a + d), a * d - b * c);
    let sine = (determinant - half_trace * half_trace).sqrt();
    [sine.atan2(half_trace) / (OMEGA * step), determinant.sqrt()]
}

#[test]
fn d1_discrete_frequency_laws() {
    // (step, ratio of leapfrog and central differences, of newmark and midpoint, of implicit Euler, its amplitude factor)
    for (step, explicit, average, euler, factor) in [
        (0.05, 1.0041586777599585, 0.9918949854399924, 0.9689219161395484, 0.954028216378465),
        (0.01, 1.0001645665064511, 0.9996712078675765, 0.9986871610744932, 0.9980319045036448),
    ] {
        for (name, ratio, amplitude) in [
            ("leapfrog", explicit, 1.0),
            ("central_difference", explicit, 1.0),
            ("newmark", average, 1.0),
            ("midpoint", average, 1.0),
            ("implicit_euler", euler, factor),
        ] {
            let [found, damped] = laws(name, step);
            assert!((found - ratio).abs() < 1e-12, "{name} at {step}: ratio {found}, not {ratio}");
            assert!((damped - amplitude).abs() < 1e-12, "{name} at {step}: factor {damped}, not {amplitude}");
        }
    }
    assert_eq!(INTEGRATORS.len(), 5, "every integrator has its law here");
}

#[test]
fn d1_the_printed_half_step_form_is_not_ours() {
    // (3.7-3.8) as printed swings at 2/(w dt) asin(w dt / (2 sqrt 2)) = 0.7086 and 0.7072 of the true frequency
    for (step, printed) in [(0.05, 0.7085688427189625), (0.01, 0.707164951306749)] {
        let formula = 2.0 / (OMEGA * step) * (OMEGA * step / (2.0 * 2.0_f64.sqrt())).asin();
        assert!((formula - printed).abs() < 1e-12);
        assert!(laws("leapfrog", step)[0] > 1.4 * printed);
    }
}

#[test]
fn d4_energy_of_leapfrog_swings_by_its_formula_and_does_not_drift() {
    for (step, excursion, expected_drift) in
        [(0.05_f64, 0.024674004611617062, -6.7202510920464e-05), (0.01, 0.0009869604394130427, -8.449642247715189e-09)]
    {
        let per_period = (1.0 / step).round() as u64;
        let (mut energies, mut shadows) = (vec![0.5 * OMEGA * OMEGA], Vec::new());
        let limit = (OMEGA * step).powi(2) / 4.0;
        swing(&mut oscillator(OMEGA, 0.0), "leapfrog", step, 200 * per_period, &[1.0], &mut |stepper| {
            let (u, v) = (stepper.state().displacement[0], stepper.state().velocity[0]);
            energies.push(Energies::of(stepper).mechanical());
            shadows.push(0.5 * (v * v + (1.0 - limit) * OMEGA * OMEGA * u * u));
            true
        })
        .expect("a stable step");
        let largest = energies.iter().map(|e| (e / energies[0] - 1.0).abs()).fold(0.0, f64::max);
        assert!((largest - excursion).abs() < 1e-12, "{largest} {excursion}");
        assert!(largest <= limit);
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let tens = 10 * per_period as usize;
        let drift = (mean(&energies[energies.len() - tens..]) - mean(&energies[1..=tens])) / energies[0];
        assert!((drift - expected_drift).abs() < 1e-10, "{drift} {expected_drift}");
        let shadow = shadows.iter().map(|e| (e / shadows[0] - 1.0).abs()).fold(0.0, f64::max);
        assert!(shadow < 1e-12, "{shadow}");
    }
}

#[test]
fn d4_newmark_and_midpoint_keep_the_energy() {
    for name in ["newmark", "midpoint"] {
        for step in [0.05, 0.01] {
            let mut energies = vec![Energies { elastic: 0.5 * OMEGA * OMEGA, ..Energies::default() }];
            swing(&mut oscillator(OMEGA, 0.0), name, step, (200.0 / step) as u64, &[1.0], &mut |stepper| {
                energies.push(Energies::of(stepper));
                true
            })
            .expect("a step");
            assert!(drift(&energies) < 1e-12, "{name} at {step}: {}", drift(&energies));
        }
    }
}
