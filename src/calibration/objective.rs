//! What an optimiser sees of a calibration problem.
//!
//! The unknowns are the stiffnesses phi (one a group, m of them) in the box 0 <= phi <= upper. The error is the norm of
//! a residual vector r(phi): error = |r|, in percent. An objective is one worker's: it owns the factor and the vectors
//! it evaluates with, and remembers the last phi it was asked for. Workers are made by [`Problem::make`], so that
//! starts, chains and gammas run side by side.

use std::ops::AddAssign;

use crate::calibration::objectives::displacement::Target;
use crate::clock::Progress;
use crate::error::Result;

/// How often the expensive things were done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Errors asked for.
    pub evaluations: u64,
    /// Factorisations of K(phi).
    pub refactorisations: u64,
    /// Right-hand sides solved for.
    pub solves: u64,
    /// Errors asked of a surrogate.
    pub surrogate_evaluations: u64,
    /// Proposals whose K(phi) was not positive definite.
    pub rejected: u64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.evaluations += other.evaluations;
        self.refactorisations += other.refactorisations;
        self.solves += other.solves;
        self.surrogate_evaluations += other.surrogate_evaluations;
        self.rejected += other.rejected;
    }
}

/// A distance between network and continuum as a function of the group stiffnesses.
pub trait Objective {
    /// The error |r(phi)| in percent; phi of length m, in N/m (or N, with the law "axial_rigidity").
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

/// A calibration problem as every optimiser is given it.
pub struct Problem<'a> {
    /// Makes a worker.
    pub make: &'a (dyn Fn() -> Box<dyn Objective + 'a> + Sync),
    /// The displacement problem behind `make`, when that is what it makes: surrogates are built from it.
    pub displacement: Option<Target<'a>>,
    /// Upper bounds of phi, length m; the lower ones are 0.
    pub upper: &'a [f64],
    /// Seed of the run and index of the problem in its sweep: with the chain they make the random stream.
    pub seed: u64,
    /// Index of the problem in its sweep.
    pub index: usize,
    /// Where evaluations are counted, and whether to stop.
    pub progress: &'a Progress,
}
