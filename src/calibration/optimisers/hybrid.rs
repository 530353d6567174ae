//! Annealing to find the valley, Gauss-Newton to reach its floor.
//!
//! All chains of Algorithm 3.1 run first; Gauss-Newton then starts from the best state of every chain. Annealing is
//! good at leaving local minima and bad at the last digits; Gauss-Newton is the other way round.

use rayon::prelude::*;

use crate::calibration::objective::Problem;
use crate::calibration::optimiser::{Outcome, Settings, best};
use crate::calibration::optimisers::{annealing, gauss_newton};
use crate::error::Result;

/// Runs both stages on one problem.
///
/// # Errors
/// As annealing and Gauss-Newton.
pub fn run(problem: &Problem, settings: &Settings) -> Result<Outcome> {
    let chains = annealing::chains(problem, settings)?;
    let descended = chains.into_par_iter().map(|chain| -> Result<Outcome> {
        let next = gauss_newton::descend(problem, settings, &chain.phi)?;
        Ok(chain.followed_by(next))
    });
    gauss_newton::polish(problem, settings, best(descended.collect::<Result<_>>()?))
}
