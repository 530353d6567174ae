//! Damped Gauss-Newton steps of the numbers of the groups, a few at a time.

use crate::calibration::optimisers::descent::{DAMPING, Descent};
use crate::clock::Progress;
use crate::error::{Error, Result};

use super::worker::Worker;

/// Largest step of a number in the chart of [`Descent`]: about a factor of e^(1/2).
pub const REACH: f64 = 0.5;

/// The same for the first fit, which begins far away.
const FIRST_REACH: f64 = 3.0;

/// Part of the error below which a step is the last.
const FIT_TOLERANCE: f64 = 1e-3;

/// Factorisations of each start of the first fit, and of the best start beyond that.
const START: u64 = 7;
const POLISH: u64 = 6;

/// Fits the first groups: from a tenth of the bounds, and from one number for all.
///
/// # Errors
/// [`Error::NotPositiveDefinite`] when no start has a stiff network; where a solve is not accurate; on interruption.
pub fn begin(worker: &mut Worker, starts: usize, progress: &Progress) -> Result<()> {
    let upper = worker.upper();
    let smallest = upper.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let mut best: Option<(Vec<f64>, f64)> = None;
    for start in 0..starts.clamp(1, 2) {
        let phi: Vec<f64> = upper.iter().map(|upper| 0.1 * if start == 0 { *upper } else { smallest }).collect();
        if !worker.attempt(&phi)?.is_finite() {
            continue;
        }
        worker.accept();
        fit(worker, FIRST_REACH, START, progress)?;
        if best.as_ref().is_none_or(|(_, error)| worker.error() < *error) {
            best = Some((worker.phi().to_vec(), worker.error()));
        }
    }
    let Some((phi, error)) = best else { return Err(Error::NotPositiveDefinite { dof: 0 }) };
    if worker.error() > error {
        worker.attempt(&phi)?;
        worker.accept();
    }
    fit(worker, FIRST_REACH, POLISH, progress)
}

/// Takes a step of a model around `phi` that lowers the error below that of the network that stands, shorter ones where
/// the first do not; true when one did and stands.
///
/// # Errors
/// On interruption.
pub fn step(worker: &mut Worker, descent: &mut Descent, phi: &[f64], tries: usize) -> Result<bool> {
    let (upper, bar) = (worker.upper(), worker.error());
    descent.prepare(phi);
    for _ in 0..tries {
        let Some((trial, predicted)) = descent.damped_step(phi, &upper) else { return Ok(false) };
        let tried = worker.attempt(&trial)?;
        if tried < bar {
            descent.trust((bar * bar - tried * tried) / predicted);
            descent.reach *= 1.5;
            worker.accept();
            return Ok(true);
        }
        descent.damp();
        descent.reach = 0.3 * descent.reach.min(4.0 * REACH);
        if predicted < 1e-4 * bar * bar {
            return Ok(false);
        }
    }
    Ok(false)
}

/// Gauss-Newton from the network that stands, with at most so many factorisations.
///
/// # Errors
/// Where a solve is not accurate; on interruption.
pub fn fit(worker: &mut Worker, reach: f64, factorisations: u64, progress: &Progress) -> Result<()> {
    let until = worker.counts().evaluations + factorisations;
    let mut descent = Descent::new(worker.phi(), &worker.upper());
    descent.reach = reach;
    while worker.counts().evaluations < until && !descent.resolved(worker.error()) {
        progress.check()?;
        (descent.residual, descent.jacobian) = worker.linearise()?;
        let (before, phi) = (worker.error(), worker.phi().to_vec());
        let left = until - worker.counts().evaluations;
        if !step(worker, &mut descent, &phi, left as usize)?
            || before - worker.error() <= FIT_TOLERANCE * before && descent.damping <= DAMPING
        {
            break;
        }
    }
    Ok(())
}
