//! The limits of stability, on the numbers of the sources and by running on both sides of them.

use springfit::dynamics::eigen;
use springfit::dynamics::model::Model;
use springfit::dynamics::stability::{Linearised, limit, smallest_alpha};
use springfit::dynamics::stepper::Stepper;
use springfit::error::Error;

use super::bodies::{Body, chain, experiment_ii, noise, oscillator, swing, ten};

fn linearised(model: &mut dyn Model) -> Linearised {
    let rest = vec![0.0; model.unknowns()];
    Linearised::at(model, &rest, None)
}

#[test]
fn d2_one_oscillator_has_the_limits_of_the_closed_forms() {
    for omega in [0.3, 1.0, 40.0] {
        for zeta in [0.0, 0.1, 0.7, 1.0, 3.0_f64] {
            let found = limit(&linearised(&mut oscillator(omega, zeta))).expect("a limit");
            let damped = 2.0 / omega * ((1.0 + zeta * zeta).sqrt() - zeta);
            assert!((found.undamped * omega / 2.0 - 1.0).abs() < 1e-14);
            assert!((found.damped / damped - 1.0).abs() < 1e-12, "{omega} {zeta}: {} {damped}", found.damped);
            assert_eq!(found.proven, Some(1e-9));
        }
    }
}

#[test]
fn d5_thesis_experiment_ii_has_our_thresholds_and_not_the_printed_ones() {
    let body = experiment_ii();
    assert_eq!(body.network.springs.len(), 72);
    let at_one = linearised(&mut body.model(Some(1.0)));
    let found = limit(&at_one).expect("a limit");
    assert!((found.omega_max / 39.48455295674003 - 1.0).abs() < 1e-12, "{}", found.omega_max);
    assert!((found.undamped / 0.0506527198672158 - 1.0).abs() < 1e-12, "{}", found.undamped);
    // the source's value was found where the largest |z| passes 1 + 1e-6; the true limit, proven to a billionth, is 4.9e-7 below
    let theirs = 0.0039118696842498964;
    assert_eq!(found.proven, Some(1e-9));
    assert!((found.damped / theirs - 1.0).abs() < 5e-7 && found.damped < theirs, "{}", found.damped);
    assert!((fastest_growth(&at_one, theirs) - 1.0 - 1e-6).abs() < 1e-9, "{:e}", fastest_growth(&at_one, theirs) - 1.0);
    let alpha = smallest_alpha(&at_one, &found, 1.0 / 60.0).expect("a step below the undamped limit");
    assert_eq!(alpha.ceil(), 5.0, "{alpha}");
    // theirs: alpha < 40 unstable at 1/60, and alpha = 1 needs 1/3000
    assert!(alpha < 40.0 && found.damped > 10.0 / 3000.0);
    assert_eq!(smallest_alpha(&at_one, &found, 0.051), None);
}

/// |z| of the motion that alternates fastest at this step.
fn fastest_growth(body: &Linearised, step: f64) -> f64 {
    let x = fastest(body, step);
    let quotient = |values: &[f64]| -> f64 {
        let row = |i: usize| {
            let entries = body.pattern.offsets()[i]..body.pattern.offsets()[i + 1];
            body.pattern.row(i).iter().zip(entries).map(|(&j, e)| values[e] * x[j]).sum::<f64>()
        };
        (0..x.len()).map(|i| x[i] * row(i)).sum()
    };
    let mass: f64 = x.iter().zip(&body.masses).map(|(x, m)| m * x * x).sum();
    let [k, c] = [&body.stiffness, &body.damping].map(|values| quotient(values) / mass);
    // (z - 1)^2 + h c (z - 1) + h^2 k z = 0
    let (b, constant) = (step * step * k + step * c - 2.0, 1.0 - step * c);
    0.5 * (b + (b * b - 4.0 * constant).sqrt())
}

/// A run that has grown by so much will not come back.
const GROWN: f64 = 1e3;

/// The largest displacement of a run with this step, relative to the start; infinite when it grows without bound.
fn growth(body: &Body, alpha: Option<f64>, name: &str, step: f64) -> f64 {
    let mut model = body.model(alpha).linear();
    // the fastest mode, and a little of everything
    let linear = linearised(&mut model);
    let mut fast = fastest(&linear, step);
    let largest = fast.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    let noise = noise(fast.len(), 1e-3);
    fast.iter_mut().zip(&noise).for_each(|(x, noise)| *x = *x / largest + noise);
    let mut most = 0.0_f64;
    let see = &mut |stepper: &mut Stepper| {
        most = stepper.state().displacement.iter().fold(most, |a, x| a.max(x.abs()));
        most < GROWN
    };
    match swing(&mut model, name, step, 12_000, &fast, see) {
        Ok(()) => most,
        Err(Error::BlowUp { .. }) => f64::INFINITY,
        Err(other) => panic!("{other}"),
    }
}

/// The mode that becomes unstable first.
fn fastest(body: &Linearised, step: f64) -> Vec<f64> {
    let n = body.masses.len();
    let mut apply = |x: &[f64], out: &mut [f64]| {
        for (row, out) in out.iter_mut().enumerate() {
            let entries = body.pattern.offsets()[row]..body.pattern.offsets()[row + 1];
            *out = body.pattern.row(row).iter().zip(entries).fold(0.0, |sum, (&column, e)| {
                let entry = step * step * body.stiffness[e] + 2.0 * step * body.damping[e];
                sum + entry * x[column] / (body.masses[row] * body.masses[column]).sqrt()
            });
        }
    };
    let top = eigen::largest(&mut apply, &eigen::seed_vector(n)).vector;
    top.iter().zip(&body.masses).map(|(x, mass)| x / mass.sqrt()).collect()
}

#[test]
fn d2_leapfrog_is_bounded_at_0_999_and_unbounded_at_1_001_of_the_limit_on_ten_bodies() {
    let bodies = ten();
    assert_eq!(bodies.len(), 10);
    for body in &bodies {
        for alpha in [None, Some(1.0), Some(30.0)] {
            let found = limit(&linearised(&mut body.model(alpha))).expect("a limit");
            assert_eq!(found.proven, Some(1e-9), "{}", body.name);
            let [below, above] = [0.999, 1.001].map(|part| growth(body, alpha, "leapfrog", part * found.damped));
            assert!(below < 3.0, "{} {alpha:?}: {below} at 0.999", body.name);
            assert!(above > GROWN, "{} {alpha:?}: {above} at 1.001", body.name);
        }
    }
}

#[test]
fn d2_centred_damping_has_the_undamped_limit() {
    for body in [chain(12), experiment_ii()] {
        for alpha in [None, Some(10.0)] {
            let found = limit(&linearised(&mut body.model(alpha))).expect("a limit");
            let [below, above] =
                [0.999, 1.001].map(|part| growth(&body, alpha, "central_difference", part * found.undamped));
            assert!(below < 3.0, "{} {alpha:?}: {below} at 0.999", body.name);
            assert!(above > GROWN, "{} {alpha:?}: {above} at 1.001", body.name);
        }
    }
}

#[test]
fn the_smallest_alpha_of_a_step_is_the_alpha_whose_limit_is_that_step() {
    for body in ten() {
        let at_one = linearised(&mut body.model(Some(1.0)));
        let found = limit(&at_one).expect("a limit");
        let step = 0.5 * found.undamped;
        let alpha = smallest_alpha(&at_one, &found, step).expect("a step below the undamped limit");
        let again = limit(&linearised(&mut body.model(Some(alpha)))).expect("a limit");
        assert!((again.damped / step - 1.0).abs() < 1e-9, "{}: {} {step}", body.name, again.damped);
    }
}

#[test]
fn proportional_damping_has_the_limit_of_its_fastest_oscillator() {
    use springfit::dynamics::linear::{Damping, LinearModel};
    let body = experiment_ii();
    let free = linearised(&mut body.model(None));
    let matrix = nalgebra_sparse::CsrMatrix::try_from_pattern_and_values(free.pattern.as_csr().clone(), free.stiffness)
        .expect("one value an entry");
    for [mass, stiffness] in [[0.0, 1e-3], [0.4, 2e-2], [0.0, 0.3]] {
        let damping = Damping::Rayleigh { mass, stiffness };
        let found = limit(&linearised(&mut LinearModel::new(&matrix, damping, free.masses.clone()))).expect("a limit");
        let zeta = 0.5 * (mass / found.omega_max + stiffness * found.omega_max);
        let formula = 2.0 / found.omega_max * ((1.0 + zeta * zeta).sqrt() - zeta);
        assert!((found.damped / formula - 1.0).abs() < 1e-10, "{} {formula}", found.damped);
    }
}
