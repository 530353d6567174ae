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
    let polished: Vec<Outcome> =
        chains.par_iter().map(|chain| gauss_newton::descend(problem, settings, &chain.phi)).collect::<Result<_>>()?;
    let joined = chains.into_iter().zip(polished).map(|(chain, mut polish)| {
        let (seconds, before) = chain.trace.last().map_or((0.0, 0), |p| (p.seconds, p.refactorisations));
        for point in &mut polish.trace {
            point.seconds += seconds;
            point.refactorisations += before;
        }
        let mut trace = chain.trace;
        trace.append(&mut polish.trace);
        polish.counts += chain.counts;
        Outcome { trace, ..polish }
    });
    Ok(best(joined.collect()))
}
