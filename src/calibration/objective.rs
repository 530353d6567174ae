//! What an optimiser sees of a calibration problem.
//!
//! The unknowns are the stiffnesses phi (one a group, m of them) in the box 0 <= phi <= upper. The error is the norm of
//! a residual vector r(phi): error = |r|, in percent. An objective is one worker's: it owns the factor and the vectors
//! it evaluates with, and remembers the last phi it was asked for. Workers are made by [`Problem::make`], so that
//! starts, chains and gammas run side by side.

use std::ops::{AddAssign, Range};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::calibration::linear::Reduced;
use crate::calibration::objectives::displacement::Displacement;
use crate::calibration::optimiser::Outcome;
use crate::calibration::pieces::{Kept, NOTHING, Piece, Stage};
use crate::calibration::prior::Prior;
use crate::clock::Progress;
use crate::error::Result;
use crate::springs::solver::Work;

/// How often the expensive things were done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Errors asked for.
    pub evaluations: u64,
    /// Factorisations of K(phi), in either precision.
    pub refactorisations: u64,
    /// Factorisations in single precision among them.
    pub single_refactorisations: u64,
    /// Right-hand sides solved with the factor of an earlier phi.
    pub stale_solves: u64,
    /// Iterations of conjugate gradients.
    pub cg_iterations: u64,
    /// Times single precision failed and double precision took over.
    pub fallbacks: u64,
    /// Right-hand sides solved for.
    pub solves: u64,
    /// Errors asked of a surrogate.
    pub surrogate_evaluations: u64,
    /// Proposals whose K(phi) was not positive definite.
    pub rejected: u64,
}

impl Counts {
    /// These counts with the work of a solver as theirs.
    pub fn with(self, work: Work) -> Self {
        let Work { refactorisations, single_refactorisations, stale_solves, iterations, fallbacks } = work;
        Self { refactorisations, single_refactorisations, stale_solves, cg_iterations: iterations, fallbacks, ..self }
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.evaluations += other.evaluations;
        self.refactorisations += other.refactorisations;
        self.single_refactorisations += other.single_refactorisations;
        self.stale_solves += other.stale_solves;
        self.cg_iterations += other.cg_iterations;
        self.fallbacks += other.fallbacks;
        self.solves += other.solves;
        self.surrogate_evaluations += other.surrogate_evaluations;
        self.rejected += other.rejected;
    }
}

/// A distance between network and continuum as a function of the group stiffnesses.
pub trait Objective {
    /// The error |r(phi)| in percent; phi of length m, in the unit of the profile (N/m for "constant").
    ///
    /// # Errors
    /// Where K(phi) is not positive definite or its solution is not accurate.
    fn error(&mut self, phi: &[f64]) -> Result<f64>;

    /// Multiplies the phi of the last [`Objective::error`] by the common factor that makes the error smallest inside the
    /// bounds, without a factorisation; writes it to `phi` and returns the error there.
    fn fit_scale(&mut self, phi: &mut [f64]) -> f64;

    /// The residual (rows) and its Jacobian dr/dphi (rows x m, column-major) at the last phi.
    ///
    /// # Errors
    /// Where a solve is not accurate.
    fn linearise(&mut self, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) -> Result<()>;

    /// Work done by this worker so far.
    fn counts(&self) -> Counts;
}

/// Does `count` independent pieces of work, side by side or one after the other; results in their order.
pub fn each<T: Send>(side_by_side: bool, count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    each_of(side_by_side, (0..count).collect(), work)
}

/// The same for things that the work takes.
pub fn each_of<I: Send, T: Send>(side_by_side: bool, things: Vec<I>, work: impl Fn(I) -> T + Sync) -> Vec<T> {
    match side_by_side {
        true => things.into_par_iter().map(&work).collect(),
        false => things.into_iter().map(work).collect(),
    }
}

/// A calibration problem as every optimiser is given it.
pub struct Problem<'a> {
    /// Makes a worker.
    pub make: &'a (dyn Fn() -> Box<dyn Objective + 'a> + Sync),
    /// Makes the same worker with its displacements in sight, when the objective is one of displacements: surrogates are
    /// built from them.
    pub displacement: Option<&'a (dyn Fn() -> Displacement<'a> + Sync)>,
    /// The whole problem, when the objective is linear in phi: it can be solved in one step.
    pub linear: Option<&'a Reduced>,
    /// What is believed about phi beforehand; workers of `make` have it in their error.
    pub prior: Option<&'a Prior>,
    /// Upper bounds of phi, length m; the lower ones are 0.
    pub upper: &'a [f64],
    /// Seed of the run and index of the problem in its sweep: with the chain they make the random stream.
    pub seed: u64,
    /// Index of the problem in its sweep.
    pub index: usize,
    /// True when starts and chains run side by side; false when each of them uses all threads itself.
    pub side_by_side: bool,
    /// Where evaluations are counted, and whether to stop.
    pub progress: &'a Progress,
    /// What is known of it already, and who hears of its pieces.
    pub kept: &'a Kept<'a>,
}

impl<'a> Problem<'a> {
    /// A problem of which nothing is known but its objective, and whose pieces nobody keeps: a search inside another.
    pub fn bare(
        make: &'a (dyn Fn() -> Box<dyn Objective + 'a> + Sync),
        upper: &'a [f64],
        (seed, index): (u64, usize),
        side_by_side: bool,
        progress: &'a Progress,
    ) -> Self {
        let (displacement, linear, prior, kept) = (None, None, None, &NOTHING);
        Self { make, displacement, linear, prior, upper, seed, index, side_by_side, progress, kept }
    }

    /// Does the pieces of one stage with these numbers; outcomes in their order.
    pub fn pieces(
        &self,
        stage: Stage,
        numbers: Range<usize>,
        work: impl Fn(usize) -> Result<Outcome> + Sync,
    ) -> Vec<Result<Outcome>> {
        let piece = |number| Piece { problem: self.index, stage, number };
        let one = |i: usize| self.kept.or(piece(numbers.start + i), || work(numbers.start + i));
        self.each(numbers.len(), one)
    }

    /// Does some work as the starts and chains of the problem do, side by side or one after the other; results in their order.
    pub fn each<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
        each(self.side_by_side, count, work)
    }
}
