//! Groups that adapt: a ladder from a few groups to many, each split where the error asks for it.
//!
//! One climbs from the fitted groups of the network (edges, face diagonals, body diagonals) by these steps:
//!
//! 1. every threshold on every feature of the springs ([`features`]) is a split of a group; its gain is estimated for all at
//!    once from one block of adjoint solves with the factor at hand ([`candidates`]);
//! 2. the best of them get their column of the Jacobian and the gain of a Gauss-Newton step inside the bounds ([`exact`]);
//! 3. every two groups may share a number instead, at a loss in the same linear model ([`unions`]): a rung that needs one group
//!    more may split two and unite two, where that promises more;
//! 4. three plans are tried, one factorisation each where the step holds, and the lowest error stays ([`rung`]);
//! 5. warm steps of Newton fit all groups again, to the bottom of the valley ([`fit`], [`worker`]).
//!
//! No step draws a random number, and none turns on rounding: what is equally good is taken in the order of the geometry ([`ties`]),
//! probes belong to places ([`places`]), fits are converged, and flat valleys have a bottom. So the same body in other units, with other
//! node numbers, another seed or on another processor climbs the same ladder.
//!
//! From 16 groups on, several groups split at once (an eighth of them), each for what it adds to the others: the
//! model is linear and the columns are there. Steps are short (a factor of 1.6 in stiffness at most while trying), for
//! the gain of a long one is not the gain of the model. No rung has a larger error than the one before.
//!
//! A rung costs the factorisations of step 4 and 5, about seven, and some hundred solves a load case. The error that a ladder
//! lowers flatters more and more; the error of the held-out cases stands beside it on every rung. A ladder that was left on
//! a rung goes on with the same bits from what was kept of it ([`Standing`]).

pub mod candidates;
pub mod exact;
pub mod features;
pub mod fit;
pub mod part;
pub mod places;
pub mod rung;
pub mod state;
pub mod ties;
pub mod unions;
pub mod worker;

use serde::{Deserialize, Serialize};

use crate::calibration::objective::Counts;
use crate::calibration::optimiser::Stop;
use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};
use crate::springs::solver;

use part::Part;
use ties::TIE;
use worker::{Ground, Worker};

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
    /// Strength rho of the prior in percent; a hundredth of the error unless it is given ([`fit`]).
    pub regularisation: Option<f64>,
}

/// One rung: a network on the way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// Its groups.
    pub groups: usize,
    /// The error over the fitted cases, percent.
    pub error: f64,
    /// The error over the held-out cases, percent.
    pub held_out: Option<f64>,
    /// What led to it: splits such as "edge: z < 0.31", and unions such as "edge, z < 0.31 with body_diagonal".
    pub splits: Vec<String>,
    /// Work of the whole ladder so far.
    pub counts: Counts,
    /// Seconds since its beginning.
    pub seconds: f64,
}

/// Groups with their numbers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// The groups.
    pub parts: Vec<Part>,
    /// Their numbers.
    pub phi: Vec<f64>,
}

/// A ladder on a rung: all that the next rung depends on, to the bit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// The rungs so far, groups ascending, fitted errors descending.
    pub rungs: Vec<Rung>,
    /// Index of the rung that would be taken: the last, or the one with the lowest held-out error.
    pub taken: usize,
    /// The groups of that rung.
    pub best: Fitted,
    /// The groups of the last rung.
    pub last: Fitted,
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

/// Climbs from the groups `start`, or on from where a ladder on the same ground stood, with the same bits as one that was
/// never left. `hear` is told of every new rung.
///
/// # Errors
/// [`Error::NotPositiveDefinite`] when no start has a stiff network; where a solve of the first groups is not accurate; on
/// interruption; those of `hear`.
pub fn climb(
    ground: Ground,
    solver: &solver::Settings,
    start: Vec<Part>,
    kept: Option<Standing>,
    limits: &Limits,
    progress: &Progress,
    hear: &mut dyn FnMut(&Standing) -> Result<()>,
) -> Result<Ladder> {
    let clock = Stopwatch::start();
    let mut standing = kept.unwrap_or_default();
    let earlier = standing.rungs.last().map_or(0.0, |rung| rung.seconds);
    let parts = if standing.rungs.is_empty() { start } else { standing.last.parts.clone() };
    let mut worker = Worker::new(ground, solver, parts, &progress.interrupt());
    match standing.rungs.last() {
        Some(rung) => worker.stand(&standing.last.phi, rung.counts)?,
        None => {
            fit::begin(&mut worker, limits.starts, limits.regularisation, progress)?;
            standing.add(&mut worker, vec![], clock.seconds(), limits)?;
            hear(&standing)?;
        }
    }
    progress.advance(standing.rungs.len() as u64);
    let stop = loop {
        if let Some(stop) = standing.ended(limits) {
            break stop;
        }
        let climbed = match rung::climb_one(&mut worker, limits, progress) {
            Ok(Some(done)) => standing.add(&mut worker, done, earlier + clock.seconds(), limits),
            Ok(None) => break Stop::NoDescent,
            Err(error) => Err(error),
        };
        match climbed {
            Ok(()) => hear(&standing)?,
            // with about as many groups as there are displacements the columns no longer tell them apart
            Err(Error::Inaccurate { .. }) => break Stop::NoDescent,
            Err(other) => return Err(other),
        }
        progress.advance(1);
    };
    let Standing { rungs, taken, best: Fitted { parts, phi, .. }, .. } = standing;
    Ok(Ladder { rungs, taken, parts, phi, stop })
}

impl Standing {
    /// True for a rung of some network with so many springs, each in one group.
    pub fn is_of(&self, springs: usize) -> bool {
        let partition = |Fitted { parts, phi }: &Fitted| {
            let mut all: Vec<u32> = parts.iter().flat_map(|part| part.springs.iter().copied()).collect();
            all.sort_unstable();
            let known = parts.iter().flat_map(|part| &part.pieces).flat_map(|piece| &piece.conditions);
            all.into_iter().eq(0..springs as u32)
                && phi.len() == parts.len()
                && known.map(|condition| condition.feature).all(|feature| feature < features::FEATURES.len())
        };
        self.taken < self.rungs.len() && [&self.best, &self.last].into_iter().all(partition)
    }

    /// Adds the network that stands.
    fn add(&mut self, worker: &mut Worker, splits: Vec<String>, seconds: f64, limits: &Limits) -> Result<()> {
        let held_out = worker.settle()?;
        let (groups, error, counts) = (worker.parts.len(), worker.error(), worker.counts());
        self.rungs.push(Rung { groups, error, held_out, splits, counts, seconds });
        self.last = Fitted { parts: worker.parts.clone(), phi: worker.phi().to_vec() };
        let lowest = match (limits.patience, held_out) {
            (Some(_), Some(error)) => self.rungs[..self.rungs.len() - 1]
                .iter()
                .filter_map(|rung| rung.held_out)
                .all(|e| error < (1.0 - TIE) * e),
            _ => true,
        };
        if lowest {
            self.taken = self.rungs.len() - 1;
            self.best = self.last.clone();
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
