//! Groups that adapt: a ladder from a few groups to many, each split where the error asks for it.
//!
//! One climbs from the fitted groups of the network (edges, face diagonals, body diagonals) by these steps:
//!
//! 1. every threshold on every feature of the springs ([`features`]) is a split of a group; its gain is estimated for all at
//!    once from one block of adjoint solves with the factor at hand ([`candidates`]);
//! 2. the best of them get their column of the Jacobian and the gain of a Gauss-Newton step inside the bounds ([`exact`]);
//! 3. the best three are tried, one factorisation each where the step holds, and the lowest error stays;
//! 4. a few warm Gauss-Newton steps fit all groups again ([`worker`]).
//!
//! From 16 groups on, several groups split at once (an eighth of them), each for what it adds to the others: the
//! model is linear and the columns are there. Steps are short (a factor of 1.6 in stiffness at most while trying), for
//! the gain of a long one is not the gain of the model. No rung has a larger error than the one before.
//!
//! A rung costs the factorisations of step 3 and 4, about nine, and some hundred solves a load case. The error that a ladder
//! lowers flatters more and more; the error of the held-out cases stands beside it on every rung.

pub mod candidates;
pub mod exact;
pub mod features;
pub mod part;
pub mod worker;

use crate::calibration::objective::Counts;
use crate::calibration::optimiser::Stop;
use crate::calibration::optimisers::descent::{DAMPING, Descent};
use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};
use crate::springs::solver;

use candidates::{Model, shortlist};
use exact::{Exact, choose, measure};
use part::{Part, short};
use worker::{Ground, Worker};

/// Splits that are tried before a rung is taken, and tried at most when all fail.
const TRIALS: usize = 3;
const MOST_TRIALS: usize = 12;

/// Shorter and shorter steps that a trial may take.
const TRIES: usize = 3;

/// Largest step of a number in the chart of [`Descent`]: about a factor of e^(1/2).
const REACH: f64 = 0.5;

/// The same for the first fit, which begins far away.
const FIRST_REACH: f64 = 3.0;

/// Factorisations of a fit after a split, and the part of the error below which a step is the last.
const FIT: u64 = 4;
const FIT_TOLERANCE: f64 = 1e-3;

/// Factorisations of each start of the first fit, and of the best start beyond that.
const START: u64 = 7;
const POLISH: u64 = 6;

/// Groups from which several split at once, and one of how many does.
const TOGETHER_FROM: usize = 16;
const ONE_OF: usize = 8;

/// When a ladder ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Most groups.
    pub groups: usize,
    /// The error that is small enough, percent: of the held-out cases, of the fitted ones where none is held out.
    pub max_error: Option<f64>,
    /// Rungs without a lower held-out error after which the ladder ends; the rung with the lowest one is taken.
    pub patience: Option<usize>,
    /// Starts of the first fit: 1 or 2.
    pub starts: usize,
    /// Seed of the probes.
    pub seed: u64,
}

/// One rung: a network on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// Its groups.
    pub groups: usize,
    /// The error over the fitted cases, percent.
    pub error: f64,
    /// The error over the held-out cases, percent.
    pub held_out: Option<f64>,
    /// The splits that led to it, such as "edge: z < 0.31".
    pub splits: Vec<String>,
    /// Work of the whole ladder so far.
    pub counts: Counts,
    /// Seconds since its beginning.
    pub seconds: f64,
}

/// A ladder and the network that it led to.
pub struct Ladder {
    /// The rungs, groups ascending, fitted errors descending.
    pub rungs: Vec<Rung>,
    /// Index of the rung that is taken: the last, or the one with the lowest held-out error.
    pub taken: usize,
    /// The groups of that rung.
    pub parts: Vec<Part>,
    /// Their numbers.
    pub phi: Vec<f64>,
    /// Why the ladder ended.
    pub stop: Stop,
}

/// Climbs from the groups `start`.
///
/// # Errors
/// [`Error::NotPositiveDefinite`] when no start has a stiff network; where a solve of the first groups is not accurate; on
/// interruption.
pub fn climb(
    ground: Ground,
    solver: &solver::Settings,
    start: Vec<Part>,
    limits: &Limits,
    progress: &Progress,
) -> Result<Ladder> {
    let clock = Stopwatch::start();
    let mut worker = Worker::new(ground, solver, start, &progress.interrupt());
    begin(&mut worker, limits.starts, progress)?;
    let mut ladder = Ladder { rungs: vec![], taken: 0, parts: vec![], phi: vec![], stop: Stop::GroupLimit };
    let mut splits = Vec::new();
    loop {
        ladder.add(&mut worker, splits, clock.seconds(), limits)?;
        progress.advance(1);
        if let Some(stop) = ladder.ended(limits) {
            ladder.stop = stop;
            break;
        }
        match climb_one(&mut worker, limits, progress) {
            Ok(Some(done)) => splits = done,
            // with about as many groups as there are displacements the columns no longer tell them apart
            Ok(None) | Err(Error::Inaccurate { .. }) => {
                ladder.stop = Stop::NoDescent;
                break;
            }
            Err(other) => return Err(other),
        }
    }
    Ok(ladder)
}

impl Ladder {
    /// Adds the network that stands.
    fn add(&mut self, worker: &mut Worker, splits: Vec<String>, seconds: f64, limits: &Limits) -> Result<()> {
        let held_out = worker.held_out_error()?;
        let (groups, error, counts) = (worker.parts.len(), worker.error(), worker.counts());
        self.rungs.push(Rung { groups, error, held_out, splits, counts, seconds });
        let lowest = match (limits.patience, held_out) {
            (Some(_), Some(error)) => self.rungs.iter().all(|rung| rung.held_out >= Some(error)),
            _ => true,
        };
        if lowest {
            self.taken = self.rungs.len() - 1;
            (self.parts, self.phi) = (worker.parts.clone(), worker.phi().to_vec());
        }
        Ok(())
    }

    /// Why the ladder has ended, if it has.
    fn ended(&self, limits: &Limits) -> Option<Stop> {
        let last = self.rungs.last()?;
        let error = last.held_out.unwrap_or(last.error);
        let waited = self.rungs.len() - 1 - self.taken;
        match () {
            () if limits.max_error.is_some_and(|enough| error <= enough) => Some(Stop::ErrorReached),
            () if limits.patience.is_some_and(|patience| waited >= patience) => Some(Stop::HeldOutRises),
            () if last.groups >= limits.groups => Some(Stop::GroupLimit),
            () => None,
        }
    }
}

/// Fits the first groups: from a tenth of the bounds, and from one number for all.
fn begin(worker: &mut Worker, starts: usize, progress: &Progress) -> Result<()> {
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

/// One rung: the splits that were made, in words; none when no split lowers the error.
fn climb_one(worker: &mut Worker, limits: &Limits, progress: &Progress) -> Result<Option<Vec<String>>> {
    progress.check()?;
    let m = worker.parts.len();
    let model = Model::new(worker)?;
    let found = shortlist(worker, &model, limits.seed, m)?;
    let splits = measure(worker, &model, found)?;
    let together = if m < TOGETHER_FROM { 1 } else { m / ONE_OF };
    let count = together.min(limits.groups - m);
    let (whole, phi) = (worker.parts.clone(), worker.phi().to_vec());
    let mut best: Option<(Vec<Part>, Vec<usize>)> = None;
    for first in 0..splits.len().min(MOST_TRIALS) {
        if first >= TRIALS && best.is_some() {
            break;
        }
        let chosen = choose(&splits, &model.rest, first, count);
        worker.parts.clone_from(&whole);
        let (child, jacobian) = divide(worker, &model.jacobian, &phi, chosen.iter().map(|&i| &splits[i]));
        let mut descent = Descent::new(&child, &worker.upper());
        descent.reach = REACH;
        (descent.residual, descent.jacobian) = (model.residual.clone(), jacobian);
        progress.check()?;
        if step(worker, &mut descent, &child, TRIES)? {
            best = Some((worker.parts.clone(), chosen));
        }
    }
    let Some((parts, chosen)) = best else {
        worker.parts = whole;
        return Ok(None);
    };
    worker.parts = parts;
    fit(worker, REACH, FIT, progress)?;
    Ok(Some(chosen.into_iter().map(|i| words(&splits[i], &whole)).collect()))
}

/// A split in words.
fn words(exact: &Exact, whole: &[Part]) -> String {
    let split = &exact.split;
    let feature = features::FEATURES[split.feature].name;
    format!("{}: {feature} < {}", whole[split.group].name(), short(split.threshold))
}

/// Divides groups; phi with the new groups and the Jacobian with their columns.
fn divide<'s>(
    worker: &mut Worker,
    jacobian: &[f64],
    phi: &[f64],
    splits: impl Iterator<Item = &'s Exact>,
) -> (Vec<f64>, Vec<f64>) {
    let (mut phi, mut jacobian) = (phi.to_vec(), jacobian.to_vec());
    for Exact { split, column, halves: [below, above], .. } in splits {
        worker.parts[split.group] = below.clone();
        worker.parts.push(above.clone());
        phi.push(phi[split.group]);
        let of_group = split.group * column.len()..(split.group + 1) * column.len();
        let rest: Vec<f64> =
            jacobian[of_group.clone()].iter().zip(column).map(|(group, below)| group - below).collect();
        jacobian[of_group].copy_from_slice(column);
        jacobian.extend(rest);
    }
    (phi, jacobian)
}

/// Takes a step of a model around `phi` that lowers the error below that of the network that stands, shorter ones where
/// the first do not; true when one did and stands.
fn step(worker: &mut Worker, descent: &mut Descent, phi: &[f64], tries: usize) -> Result<bool> {
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
fn fit(worker: &mut Worker, reach: f64, factorisations: u64, progress: &Progress) -> Result<()> {
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
