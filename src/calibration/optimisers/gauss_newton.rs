//! Damped Gauss-Newton (Levenberg-Marquardt) with the exact Jacobian and bounds.
//!
//! With r(phi + d) ~ r + J d the step solves
//!
//! min |r + J d|^2 + lambda |D d|^2,   0 <= phi + d <= upper,   D = the column norms of J,
//!
//! a convex quadratic in a box. A step that lowers the error is taken and lambda falls with how well the model
//! predicted the gain (H. B. Nielsen, Tech. Univ. of Denmark, 1999); one that does not is thrown away and lambda grows.
//! Every trial costs at most one factorisation; the Jacobian at an accepted trial reuses it.
//!
//! Stiffness acts by its inverse, so far from the solution a straight step in phi overshoots below zero. Steps are
//! therefore taken in x with phi = c sinh(x): logarithmic where phi is much larger than c, linear near the bound 0,
//! where the logarithm would stall. After each trial the best common factor of all stiffnesses is applied, which costs
//! nothing.
//!
//! Many groups leave flat valleys and local minima, so several starts spend a few factorisations each ([`basins`]). On fine
//! meshes a model of the whole network takes the place of the linear one ([`reduced`]); with hundreds of groups products with
//! the Jacobian take the place of the Jacobian ([`many`]).

use crate::calibration::objective::{Objective, Problem};
use crate::calibration::optimiser::{Outcome, Settings, Stop, TracePoint, best};
use crate::calibration::optimisers::descent::{DAMPING, Descent, LARGEST_DAMPING};
use crate::calibration::optimisers::{basins, many, reduced};
use crate::calibration::pieces::{Piece, Stage};
use crate::clock::Stopwatch;
use crate::error::{Error, Result};
use crate::rng::Stream;

/// Fraction of the upper bounds where the first start begins.
const START: f64 = 0.1;

/// Factorisations of one piece of the polish: what is lost at most when a run is stopped.
const POLISH: u64 = 20;

/// Most pieces of one polish.
const PIECES: usize = 10_000;

/// Runs all starts and returns the best.
///
/// # Errors
/// When no start has a positive definite K, or on interruption.
pub fn run(problem: &Problem, settings: &Settings) -> Result<Outcome> {
    if let Some(worker) = many::worker(problem) {
        return many::run(problem, settings, worker);
    }
    if let Some(worker) = reduced::worker(problem) {
        return reduced::run(problem, settings, worker);
    }
    basins::search(problem, settings)
}

/// Runs from these stiffnesses and returns the best outcome, polished.
///
/// # Errors
/// As [`run`].
pub fn from(problem: &Problem, settings: &Settings, starts: &[Vec<f64>]) -> Result<Outcome> {
    let outcomes = problem.pieces(Stage::Start, 0..starts.len(), |s| descend(problem, settings, &starts[s]));
    let mut found = Vec::new();
    let mut failure = None;
    for outcome in outcomes {
        match outcome {
            Ok(outcome) => found.push(outcome),
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) => failure = Some(error),
        }
    }
    match failure {
        Some(error) if found.is_empty() => Err(error),
        _ => polish(problem, settings, (0, best(found))),
    }
}

/// Goes on from an outcome that had spent its factorisations, in pieces that begin anew with the first damping; `place` is its
/// number among those that are polished.
///
/// # Errors
/// As [`descend`].
pub fn polish(problem: &Problem, settings: &Settings, (place, mut found): (usize, Outcome)) -> Result<Outcome> {
    let mut left = settings.polish;
    for part in 0..PIECES {
        if found.stop != Stop::RefactorisationLimit || left == 0 {
            break;
        }
        let further = Settings { refactorisations: left.min(POLISH), ..*settings };
        left -= further.refactorisations;
        let piece = Piece { problem: problem.index, stage: Stage::Polish, number: place * PIECES + part };
        let next = problem.kept.or(piece, || descend(problem, &further, &found.phi))?;
        found = found.followed_by(next);
    }
    Ok(found)
}

/// Where a start begins: a tenth of the bounds, then one stiffness for all groups, then anywhere within three decades
/// below the bounds.
pub fn start(problem: &Problem, index: usize) -> Vec<f64> {
    let smallest = problem.upper.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let mut stream = Stream::new(problem.seed, problem.index, index);
    let place = |upper: &f64| match index {
        0 => START * upper,
        1 => START * smallest,
        _ => upper * 10f64.powf(-3.0 * stream.uniform()),
    };
    problem.upper.iter().map(place).collect()
}

/// Gauss-Newton from one point.
///
/// # Errors
/// When K is not positive definite there, or on interruption.
pub fn descend(problem: &Problem, settings: &Settings, from: &[f64]) -> Result<Outcome> {
    let clock = Stopwatch::start();
    let mut objective = (problem.make)();
    let mut phi = from.to_vec();
    objective.error(&phi)?;
    let mut error = objective.fit_scale(&mut phi);
    let mut descent = Descent::new(&phi, problem.upper);
    let mut trace = vec![point(&clock, objective.as_ref(), error)];
    let mut previous: Option<(Vec<f64>, f64)> = None;
    let stop = loop {
        problem.progress.check()?;
        if descent.resolved(error) {
            break Stop::Converged;
        }
        match (objective.linearise(&mut descent.residual, &mut descent.jacobian), previous.take()) {
            (Ok(()), _) => descent.prepare(&phi),
            // a network that is about to fall apart bears the loads but not the forces of the columns: back to where the
            // model was made, and less far from there
            (Err(Error::Inaccurate { .. }), Some(place)) => {
                (phi, error) = place;
                trace.pop();
                descent.damp();
            }
            (Err(other), _) => return Err(other),
        }
        previous = Some((phi.clone(), error));
        let before = error;
        let stop = loop {
            // every trial counts, also one that an old factor answers
            if objective.counts().evaluations >= settings.refactorisations {
                break Some(Stop::RefactorisationLimit);
            }
            let Some((trial, predicted)) = descent.step(&phi, problem.upper) else {
                descent.damp();
                if descent.damping > LARGEST_DAMPING {
                    break Some(Stop::NoDescent);
                }
                continue;
            };
            problem.progress.check()?;
            problem.progress.advance(1);
            let mut trial_phi = trial;
            let tried = match objective.error(&trial_phi) {
                Ok(_) => objective.fit_scale(&mut trial_phi),
                Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. } | Error::NoEquilibrium { .. }) => {
                    f64::INFINITY
                }
                Err(other) => return Err(other),
            };
            if tried < error {
                descent.trust((error * error - tried * tried) / predicted);
                phi = trial_phi;
                error = tried;
                break None;
            }
            descent.damp();
            if predicted <= settings.tolerance * error * error || descent.damping > LARGEST_DAMPING {
                break Some(Stop::NoDescent);
            }
        };
        trace.push(point(&clock, objective.as_ref(), error));
        if let Some(stop) = stop {
            break stop;
        }
        if before - error <= settings.tolerance * before && descent.damping <= DAMPING {
            break Stop::Converged;
        }
    };
    Ok(Outcome { phi, error, stop, counts: objective.counts(), trace, agreement: None })
}

fn point(clock: &Stopwatch, objective: &dyn Objective, error: f64) -> TracePoint {
    TracePoint { seconds: clock.seconds(), refactorisations: objective.counts().refactorisations, error }
}
