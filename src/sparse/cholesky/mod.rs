//! Sparse Cholesky: A = L L^T, analysed once, factored and solved often.
//!
//! [`Symbolic`] holds what depends on the pattern only: the elimination order, the pattern of the permuted lower
//! triangle, and the supernodes of L. It is immutable and shared. [`Factor`] holds one worker's numbers: the values of
//! the permuted lower triangle, of L, and all workspace, so that nothing is allocated after its making. Whoever
//! assembles writes straight into [`Factor::values_mut`]; no copy stands between assembly and factorisation.
//!
//! A large factorisation (`multifrontal`) and its sweeps use all threads: branches of the elimination tree side by side,
//! large fronts in tiles. What is divided, and how, is decided by the pattern, so the bits are the same for any number of
//! threads. Workers side by side (chains, starts, gammas, load cases) may each factor: their pieces go to the same
//! threads, and nobody waits for a thread of its own.
//!
//! Every solve is checked: the componentwise backward error of its result is measured, one step of iterative refinement
//! follows where it is above [`REFINE_ABOVE`], and a result above [`ACCEPTED`] is an error, never a number. Where less will
//! do (the columns of a Jacobian), a small residual is enough ([`Factor::solve_within`]).

#[cfg(test)]
mod divided_tests;
mod factor;
mod refinement;
mod symbolic;
#[cfg(test)]
mod tests;
mod trust;

pub use factor::Factor;
pub use symbolic::Symbolic;

/// A backward error above this is refined once.
pub const REFINE_ABOVE: f64 = 1e-15;

/// A backward error above this, after refinement, is an error.
pub const ACCEPTED: f64 = 1e-10;
