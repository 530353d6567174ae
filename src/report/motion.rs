//! `dynamics` of result.json, and what a person reads of it. Steps in s, alpha in s, omega in rad/s, energies in J, strain in
//! percent.

use std::fmt::Write;

use serde::Serialize;

use crate::dynamics::energy::{Energies, drift};
use crate::dynamics::integrator::Integrator;
use crate::dynamics::stability::Limit;
use crate::readable::significant;
use crate::scene;
use crate::study::motion::Moved;
use crate::study::motion::limits::{Limits, bound};

/// The object `dynamics`.
#[derive(Debug, Serialize)]
pub struct Dynamics {
    total_mass: f64,
    smallest_mass: f64,
    largest_mass: f64,
    alpha: Option<f64>,
    damping: Option<[f64; 2]>,
    model: &'static str,
    integrator: &'static str,
    /// Of the first alpha: what "auto" takes, before `safety`; none where every step is stable.
    #[serde(skip_serializing_if = "Option::is_none")]
    safe_step: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    omega_max: Option<f64>,
    limits: Vec<Row>,
    /// Steps, and the smallest alpha with which leapfrog is stable at them.
    damping_range: Vec<[f64; 2]>,
    motions: Vec<Motion>,
}

/// The limits for one alpha.
#[derive(Debug, Serialize)]
struct Row {
    alpha: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    at_rest: Option<Bounds>,
    #[serde(skip_serializing_if = "Option::is_none")]
    any_motion: Option<Bounds>,
    #[serde(skip_serializing_if = "Option::is_none")]
    step: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    smallest_alpha: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Bounds {
    omega_max: f64,
    leapfrog: f64,
    central_difference: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    proven_within: Option<f64>,
}

/// One motion in numbers; its course is in the files of the exporters.
#[derive(Debug, Serialize)]
struct Motion {
    alpha: Option<f64>,
    step: f64,
    steps: u64,
    records: usize,
    start: Energies,
    end: Energies,
    /// Largest imbalance of the energies, relative to the largest energy.
    drift: f64,
    largest_strain: f64,
    last_strain: f64,
    newton_iterations: u64,
    factorisations: u64,
    newton_residual: f64,
    /// Iterations of conjugate gradients.
    #[serde(skip_serializing_if = "Option::is_none")]
    linear_iterations: Option<u64>,
    /// Records with cells of a corotational continuum that are inside out, and the smallest det F of a cell.
    #[serde(skip_serializing_if = "Option::is_none")]
    inverted_records: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    smallest_determinant: Option<f64>,
    seconds: f64,
}

impl Dynamics {
    /// What `[dynamics]` of a scene gave.
    pub fn of(data: &crate::study::motion::Dynamics, settings: &scene::Dynamics) -> Self {
        let range = |values: &[f64]| {
            let positive = values.iter().copied().filter(|value| *value > 0.0);
            [positive.clone().fold(f64::INFINITY, f64::min), positive.fold(0.0, f64::max)]
        };
        let [smallest_mass, largest_mass] = range(&data.masses);
        let first = data.limits.first();
        Self {
            total_mass: data.masses.iter().sum(),
            smallest_mass,
            largest_mass,
            alpha: first.and_then(|limits| limits.alpha),
            damping: data.damping.as_deref().map(range),
            model: settings.model.name(),
            integrator: data.integrator.name,
            safe_step: first.and_then(|limits| safe_step(limits, data.integrator)),
            omega_max: first.and_then(|limits| limits.at_rest.or(limits.any_motion)).map(|limit| limit.omega_max),
            limits: data.limits.iter().map(row).collect(),
            damping_range: data.damping_range.clone(),
            motions: data.motions.iter().map(motion).collect(),
        }
    }
}

/// The largest step that is safe however the body moves.
fn safe_step(limits: &Limits, integrator: &Integrator) -> Option<f64> {
    let limit = limits.safest()?;
    bound(integrator, &limit).map(|bound| limit.safe(bound))
}

fn row(limits: &Limits) -> Row {
    let bounds = |limit: Limit| Bounds {
        omega_max: limit.omega_max,
        leapfrog: limit.damped,
        central_difference: limit.undamped,
        proven_within: limit.proven,
    };
    Row {
        alpha: limits.alpha,
        at_rest: limits.at_rest.map(bounds),
        any_motion: limits.any_motion.map(bounds),
        step: limits.step,
        smallest_alpha: limits.smallest_alpha,
    }
}

fn motion(moved: &Moved) -> Motion {
    let Moved { alpha, step, steps, motion, solves, inverted, seconds } = moved;
    Motion {
        alpha: *alpha,
        step: *step,
        steps: *steps,
        records: motion.times.len(),
        start: motion.energies.first().copied().unwrap_or_default(),
        end: motion.energies.last().copied().unwrap_or_default(),
        drift: drift(&motion.energies),
        largest_strain: motion.strain.iter().copied().fold(0.0, f64::max),
        last_strain: motion.strain.last().copied().unwrap_or_default(),
        newton_iterations: solves.iterations,
        factorisations: solves.factorisations,
        newton_residual: solves.residual,
        linear_iterations: Some(solves.linear_iterations).filter(|&count| count > 0),
        inverted_records: inverted.map(|inverted| inverted.records),
        smallest_determinant: inverted.map(|inverted| inverted.least_cell),
        seconds: *seconds,
    }
}

/// The lines of the summary.
pub fn summary(data: &crate::study::motion::Dynamics) -> String {
    let mut text = String::new();
    let alpha = |alpha: Option<f64>| alpha.map_or("undamped".to_owned(), |alpha| format!("alpha {alpha}"));
    for limits in &data.limits {
        let _ = write!(text, "largest stable step of leapfrog, {}:", alpha(limits.alpha));
        if let Some(limit) = limits.at_rest {
            let omega = significant(limit.omega_max, 5);
            let _ = write!(text, " {:.4e} s in small motion (omega_max {omega} rad/s)", limit.damped);
        }
        if let Some(limit) = limits.any_motion {
            let _ = write!(text, " {:.4e} s in any motion", limit.damped);
        }
        if let (Some(step), Some(least)) = (limits.step, limits.smallest_alpha) {
            let _ = write!(text, "; a step of {step:.4e} s needs alpha {} or more", significant(least, 5));
        }
        text.push('\n');
    }
    for moved in &data.motions {
        let Motion { steps, step, drift, largest_strain, last_strain, seconds, .. } = motion(moved);
        let _ = writeln!(
            text,
            "motion, {}: {steps} steps of {step:.4e} s, energy drift {drift:.1e}, global strain at most {} %, {} % at the end, \
             {} s",
            alpha(moved.alpha),
            significant(largest_strain, 4),
            significant(last_strain, 4),
            significant(seconds, 3)
        );
    }
    text
}
