//! The numbers of the groups at the bottom of their valley: damped steps of Newton, to the last digits.
//!
//! What a ladder decides next depends on where a fit ended, so a fit ends where rounding does not matter: at the minimum of
//!
//! ```text
//! F^2 = e^2 + rho^2 sum_a v_a (x_a - y)^2,       x = arsinh(phi / c),      rho = PULL e_0
//! ```
//!
//! ([`crate::calibration::prior`]; e_0: the error of the rung before). Directions of phi that the loads do not determine are
//! flat in e; there the prior alone has a minimum. It raises the error by less than rho^2 / (2 e^2) times the variance of x over the springs: below a
//! thousandth of it where their x differ by 4 (a factor of 50) in the root mean square.

use crate::calibration::optimisers::descent::Descent;
use crate::calibration::prior::Prior;
use crate::clock::Progress;
use crate::error::{Error, Result};

use super::ties::TIE;
use super::worker::Worker;

/// rho as a part of the error.
pub const PULL: f64 = 0.01;

/// Largest step of a number in the chart of [`Descent`]: about a factor of e^(1/2).
pub const REACH: f64 = 0.5;

/// The same for the first fit, which begins far away.
const FIRST_REACH: f64 = 3.0;

/// A step of no coordinate x beyond this is the last: with Newton's the next one would be rounding.
const BOTTOM: f64 = 1e-7;

/// Part of F that rounding may raise it by.
const ROUNDING: f64 = 1e-11;

/// A step that gains what the model said, within this part, is followed by one with hardly any damping: flat directions, of which the
/// damping knows nothing, would otherwise converge at its pace.
const AS_SAID: f64 = 0.25;
const RELEASE: f64 = 1e-3;

/// First damping of a fit, relative to the squared column norms: what is left to do is small.
const DAMPING: f64 = 1e-3;

/// Factorisations of each start of the first fit.
const START: u64 = 12;

/// Factorisations of any other fit at most.
pub const MOST: u64 = 30;

/// Fits the first groups: from a tenth of the bounds, and from one number for all. `strength`: rho in percent, if it is given.
///
/// # Errors
/// [`Error::NotPositiveDefinite`] when no start has a stiff network; where a solve is not accurate; on interruption.
pub fn begin(worker: &mut Worker, starts: usize, strength: Option<f64>, progress: &Progress) -> Result<()> {
    let upper = worker.upper();
    let smallest = upper.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let mut best: Option<(Vec<f64>, f64)> = None;
    for start in 0..starts.clamp(1, 2) {
        let phi: Vec<f64> = upper.iter().map(|upper| 0.1 * if start == 0 { *upper } else { smallest }).collect();
        if !worker.attempt(&phi)?.is_finite() {
            continue;
        }
        let scaled = worker.tried_scaled();
        if !worker.attempt(&scaled)?.is_finite() {
            continue;
        }
        worker.accept();
        let free = Pull { strength: 0.0, chart: Descent::new(&scaled, &upper).chart() };
        fit(worker, &free, FIRST_REACH, START, progress)?;
        if best.as_ref().is_none_or(|(_, error)| worker.error() < (1.0 - TIE) * error) {
            best = Some((worker.phi().to_vec(), worker.error()));
        }
    }
    let Some((phi, _)) = best else { return Err(Error::NotPositiveDefinite { dof: 0 }) };
    if worker.phi() != phi {
        worker.attempt(&phi)?;
        worker.accept();
    }
    fit(worker, &Pull::of(worker, strength), FIRST_REACH, MOST, progress)
}

/// The prior of a rung, whatever its groups.
#[derive(Debug, Clone, Copy)]
pub struct Pull {
    /// rho, percent.
    pub strength: f64,
    /// c, also that of the steps.
    pub chart: f64,
}

impl Pull {
    /// The prior beside the error of the network that stands: `strength`, or a small part of the error.
    pub fn of(worker: &Worker, strength: Option<f64>) -> Self {
        let chart = Descent::new(worker.phi(), &worker.upper()).chart();
        Self { strength: strength.unwrap_or(PULL * worker.error()), chart }
    }

    /// The prior on the groups as they are.
    pub fn prior(&self, worker: &Worker) -> Prior {
        worker.prior(self.strength, self.chart)
    }

    /// F of the network that stands, percent.
    pub fn error(&self, worker: &Worker) -> f64 {
        self.prior(worker).with(worker.error(), worker.phi())
    }
}

/// Takes a step of a model around `phi` that brings F below `bar`, shorter ones where the first do not; F there and the largest step of
/// an x when one did and stands. `descent` has the rows of the prior.
///
/// # Errors
/// On interruption.
pub fn step(
    worker: &mut Worker,
    descent: &mut Descent,
    prior: &Prior,
    (phi, bar): (&[f64], f64),
    tries: usize,
) -> Result<Option<(f64, f64)>> {
    let upper = worker.upper();
    descent.prepare(phi);
    for _ in 0..tries {
        let Some((trial, predicted)) = descent.damped_step(phi, &upper) else { return Ok(None) };
        let moved = descent.distance(phi, &trial);
        let tried = prior.with(worker.attempt(&trial)?, &trial);
        // so near to the bottom F itself is flat to rounding
        if tried < bar || moved < ROUNDING.sqrt() && tried < (1.0 + ROUNDING) * bar {
            let ratio = (bar * bar - tried * tried) / predicted;
            descent.trust(ratio);
            if (ratio - 1.0).abs() < AS_SAID {
                descent.damping *= RELEASE;
            }
            descent.reach *= 1.5;
            worker.accept();
            return Ok(Some((tried, moved)));
        }
        descent.damp();
        descent.reach = 0.3 * descent.reach.min(4.0 * REACH);
    }
    Ok(None)
}

/// Newton from the network that stands, with at most so many factorisations.
///
/// # Errors
/// Where a solve is not accurate; on interruption.
pub fn fit(worker: &mut Worker, pull: &Pull, reach: f64, factorisations: u64, progress: &Progress) -> Result<()> {
    let until = worker.counts().evaluations + factorisations;
    let mut descent = Descent::with_chart(pull.chart);
    (descent.reach, descent.damping) = (reach, DAMPING);
    let prior = pull.prior(worker);
    while worker.counts().evaluations < until && !descent.resolved(worker.error()) {
        progress.check()?;
        let phi = worker.phi().to_vec();
        (descent.residual, descent.jacobian) = worker.linearise()?;
        descent.curvature = Some(worker.curvature(&descent.residual, &descent.jacobian)?);
        prior.append(&phi, &mut descent.residual, &mut descent.jacobian);
        let left = until - worker.counts().evaluations;
        let bar = pull.error(worker);
        match step(worker, &mut descent, &prior, (&phi, bar), left as usize)? {
            Some((_, moved)) if moved > BOTTOM => {}
            _ => break,
        }
    }
    Ok(())
}
