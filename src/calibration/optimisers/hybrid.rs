//! Annealing to find the valley, Gauss-Newton to reach its floor.
//!
//! All chains of Algorithm 3.1 run first; Gauss-Newton then starts from the best state of every chain, and the best end is hopped from
//! ([`basins`]). Annealing is
//! good at leaving local minima and bad at the last digits; Gauss-Newton is the other way round.

use crate::calibration::objective::Problem;
use crate::calibration::optimiser::{Outcome, Settings};
use crate::calibration::optimisers::{annealing, basins, gauss_newton};
use crate::calibration::pieces::Stage;
use crate::error::Result;

/// Runs both stages on one problem.
///
/// # Errors
/// As annealing and Gauss-Newton.
pub fn run(problem: &Problem, settings: &Settings) -> Result<Outcome> {
    let chains = annealing::chains(problem, settings)?;
    let descended = problem.pieces(Stage::Descent, 0..chains.len(), |c| {
        let next = gauss_newton::descend(problem, settings, &chains[c].phi)?;
        Ok(chains[c].clone().followed_by(next))
    });
    basins::finish(problem, settings, descended.into_iter().collect::<Result<_>>()?)
}
