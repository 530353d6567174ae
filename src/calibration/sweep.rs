//! The gamma sweep (Algorithm 5.1): calibrate for gamma = start, start - step, ... while positive, keep the best.
//!
//! Small gammas make many small groups, large ones few large groups. Two gammas that give the same groups are the same
//! problem: it is solved once, and both rows of the table show it. The distinct problems are independent and run in
//! parallel, each with its own random streams. The search of a problem is a piece ([`crate::calibration::pieces`]): an answer that is known
//! already is only confirmed.

use crate::calibration::linear::Reduced;
use crate::calibration::objective::{Objective, Problem, each};
use crate::calibration::objectives::displacement::{Displacement, Target};
use crate::calibration::objectives::large::{self, LargeDisplacement};
use crate::calibration::objectives::linear::Linear;
use crate::calibration::optimiser::{Optimiser, Outcome, Settings};
use crate::calibration::optimisers::gauss_newton;
use crate::calibration::pieces::{Kept, Piece, Stage};
use crate::calibration::prior::{Prior, Regularised};
use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::springs::grouping::Grouping;
use crate::springs::mechanism;
use crate::springs::solver::{self, SpringOperator};

/// The values start, start - step, ... above 0, descending.
///
/// # Errors
/// When start is not in (0, 1), or step is not positive, or more than 1,000 values would come.
pub fn gammas(start: f64, step: f64) -> Result<Vec<f64>> {
    if !(start > 0.0 && start < 1.0) {
        return Err(Error::input(
            "calibration.gamma.start",
            format!("gamma starts at {start}"),
            "a number between 0 and 1, both excluded",
        ));
    }
    if step.is_nan() || step < start / 1000.0 {
        let help = format!("a positive number, at least {:e} (a sweep has at most 1,000 values)", start / 1000.0);
        return Err(Error::input("calibration.gamma.step", format!("the step is {step}"), help));
    }
    // counted, so that rounding can neither add a value near zero nor loop for ever
    let count = (start / step - 1e-9).ceil() as usize;
    // to 12 digits, so that 0.8 - 7 * 0.1 is the 0.1 that a user would write
    let rounded = |value: f64| if value > 1e-9 { (value * 1e12).round() / 1e12 } else { value };
    Ok((0..count).map(|i| rounded(start - i as f64 * step)).collect())
}

/// For each grouping the index of the first equal one.
pub fn first_equal(groupings: &[Grouping]) -> Vec<usize> {
    (0..groupings.len()).map(|i| (0..i).find(|&j| groupings[j] == groupings[i]).unwrap_or(i)).collect()
}

/// What a problem makes small.
pub enum Search<'a> {
    /// The displacement error (5.7).
    Displacement,
    /// The displacement error of a network in equilibrium beside a continuum that turns.
    Large(large::Target<'a>),
    /// A distance that is linear in phi.
    Linear(Reduced),
    /// Nothing: phi is known.
    Known(Vec<f64>),
}

/// One distinct problem of a sweep.
pub struct SweepProblem<'a> {
    /// The springs with the groups of this problem.
    pub operator: SpringOperator<'a>,
    /// Upper bounds of the groups.
    pub upper: Vec<f64>,
    /// What is made small.
    pub search: Search<'a>,
    /// What is believed about its groups beforehand.
    pub prior: Option<Prior>,
    /// Index of the first gamma that gives it; names its random streams.
    pub index: usize,
}

/// What all problems of a sweep share.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// Forces of the fitted load cases (cases x n), N.
    pub forces: &'a [f64],
    /// Reference displacements (cases x n), m.
    pub reference: &'a [f64],
    /// Weights of the cases, see [`crate::calibration::objectives::displacement::weights`].
    pub weights: &'a [f64],
    /// The free degrees of freedom, to name loose nodes.
    pub dofs: &'a DofMap,
    /// What an answer is called in an error.
    pub what: &'static str,
    /// How K(phi) u = f is solved while the optimiser searches.
    pub solver: &'a solver::Settings,
    /// Pieces that are known already, and who hears of new ones.
    pub kept: &'a Kept<'a>,
}

/// The answer to one distinct problem.
pub struct Solved {
    /// What the optimiser found.
    pub outcome: Outcome,
    /// Displacements of the fitted cases there (cases x n), m, from a fresh solve with [`exact`] settings; none of
    /// [`Search::Large`], whose networks have other ones.
    pub displacement: Vec<f64>,
    /// |e - e'| / e' of the optimiser's error e and the error e' of these displacements; none where the optimiser made
    /// another error small.
    pub error_difference: Option<f64>,
    /// Seconds of the fit.
    pub seconds: f64,
}

/// How an answer is confirmed: by a factor in double precision, on a grid by a fresh solve to a tenth of the tolerance.
pub fn exact(operator: &SpringOperator, search: &solver::Settings) -> solver::Settings {
    match operator {
        SpringOperator::Assembled { .. } => solver::Settings::DIRECT,
        SpringOperator::OnGrid(_) => solver::Settings { tolerance: 0.1 * search.tolerance, ..*search },
    }
}

/// Solves the distinct problems in parallel; answers in the order of the problems.
///
/// # Errors
/// The first error of a problem, in their order.
pub fn solve<'a>(
    problems: &'a [SweepProblem<'a>],
    shared: Shared<'a>,
    optimiser: &'a Optimiser,
    settings: &'a Settings,
    seed: u64,
    progress: &'a Progress,
) -> Result<Vec<Solved>> {
    // a solve on a grid uses all threads itself, and its workers are large: one at a time
    let side_by_side = problems.iter().all(|problem| matches!(problem.operator, SpringOperator::Assembled { .. }));
    let solve_one = |i: usize| {
        let watch = Stopwatch::start();
        let one = One { problem: &problems[i], shared, optimiser, settings, seed, side_by_side, progress };
        one.confirmed(one.answer()?, watch)
    };
    each(side_by_side, problems.len(), solve_one).into_iter().collect()
}

/// One problem and what it is solved with.
struct One<'a> {
    problem: &'a SweepProblem<'a>,
    shared: Shared<'a>,
    optimiser: &'a Optimiser,
    settings: &'a Settings,
    seed: u64,
    side_by_side: bool,
    progress: &'a Progress,
}

impl<'a> One<'a> {
    /// The linear problem beside these displacements of the continuum.
    fn target(&self, reference: &'a [f64]) -> Target<'a> {
        let Shared { forces, weights, .. } = self.shared;
        Target { operator: &self.problem.operator, upper: &self.problem.upper, forces, reference, weights }
    }

    /// A worker of it.
    fn worker(&self, reference: &'a [f64]) -> Displacement<'a> {
        let worker = Displacement::with_solver(self.target(reference), self.shared.solver);
        worker.watching(&self.progress.interrupt())
    }

    /// What the optimiser finds, or has found before.
    fn answer(&self) -> Result<Outcome> {
        let Self { problem, shared, optimiser, settings, seed, side_by_side, progress } = *self;
        let (upper, index, kept, prior) = (&problem.upper[..], problem.index, shared.kept, problem.prior.as_ref());
        let whole = Piece { problem: index, stage: Stage::Answer, number: 0 };
        let worker = || self.worker(shared.reference);
        let given = |make, displacement, linear| -> Result<Outcome> {
            let all = Problem { make, displacement, linear, prior, upper, seed, index, side_by_side, progress, kept };
            kept.or(whole, || (optimiser.run)(&all, settings))
        };
        match &problem.search {
            Search::Large(target) => kept.or(whole, || self.turning(target)),
            Search::Displacement => match prior {
                None => given(&|| Box::new(worker()), Some(&worker), None),
                Some(prior) => given(&|| Box::new(Regularised::new(worker(), prior)), Some(&worker), None),
            },
            Search::Linear(reduced) => {
                let found = given(&|| Box::new(Linear::new(reduced, upper)), None, Some(reduced))?;
                Ok(Outcome { phi: reduced.completed(found.phi, upper), ..found })
            }
            Search::Known(phi) => Ok(Outcome::known(phi.clone())),
        }
    }

    /// Gauss-Newton under large displacements, from the linear answer and from one stiffness for all groups.
    fn turning(&self, target: &large::Target) -> Result<Outcome> {
        let Self { problem, shared, optimiser, settings, seed, side_by_side, progress } = *self;
        let Shared { forces, reference, weights, .. } = shared;
        let cases = large::Cases { forces, reference, weights };
        let (upper, place) = (&problem.upper[..], (seed, problem.index));
        let linear = || self.worker(target.linear);
        let make = || -> Box<dyn Objective> { Box::new(linear()) };
        let small = Problem::bare(&make, upper, place, side_by_side, progress);
        let mut even = gauss_newton::start(&small, 1);
        let first = (optimiser.run)(&Problem { displacement: Some(&linear), ..small }, settings)?;
        let mut worker = linear();
        worker.error(&even)?;
        worker.fit_scale(&mut even);
        let make = || -> Box<dyn Objective> { Box::new(LargeDisplacement::new(*target, cases, &progress.interrupt())) };
        let large = Problem::bare(&make, upper, place, side_by_side, progress);
        let mut found = gauss_newton::from(&large, settings, &[first.phi, even])?;
        found.counts += first.counts;
        Ok(found)
    }

    /// The answer, solved afresh.
    fn confirmed(&self, outcome: Outcome, watch: Stopwatch) -> Result<Solved> {
        let Self { problem, shared, .. } = *self;
        if let Search::Large(_) = problem.search {
            let (displacement, error_difference) = (Vec::new(), None);
            return Ok(Solved { outcome, displacement, error_difference, seconds: watch.seconds() });
        }
        let settings = exact(&problem.operator, shared.solver);
        let exact = Displacement::with_solver(self.target(shared.reference), &settings);
        let mut exact = exact.watching(&self.progress.interrupt());
        let error = exact.error(&outcome.phi).map_err(|error| self.loose(error, &outcome.phi))?;
        let error = problem.prior.as_ref().map_or(error, |prior| prior.with(error, &outcome.phi));
        let error_difference = match problem.search {
            Search::Displacement if error > 0.0 => Some((outcome.error - error).abs() / error),
            Search::Displacement => Some(outcome.error),
            _ => None,
        };
        let displacement = exact.displacement().to_vec();
        Ok(Solved { outcome, displacement, error_difference, seconds: watch.seconds() })
    }

    /// The ways to move of a network that a fit left without stiffness, where they can be counted.
    fn loose(&self, error: Error, phi: &[f64]) -> Error {
        match (&error, self.problem.operator.assembled()) {
            (Error::NotPositiveDefinite { .. }, Some((stiffness, symbolic))) => {
                mechanism::of_groups(self.shared.what, stiffness, phi, self.shared.dofs, symbolic)
                    .err()
                    .unwrap_or(error)
            }
            _ => error,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_ends_above_zero_and_cannot_loop() {
        assert_eq!(gammas(0.8, 0.1).expect("legal").len(), 8);
        assert_eq!(gammas(0.5, 0.7).expect("legal"), [0.5]);
        assert_eq!(gammas(0.3, 0.1).expect("legal").len(), 3);
        for (start, step) in
            [(0.8, 0.0), (0.8, -0.1), (0.8, f64::NAN), (0.0, 0.1), (1.0, 0.1), (f64::NAN, 0.1), (0.5, 1e-9)]
        {
            assert!(matches!(gammas(start, step), Err(Error::Input { .. })), "{start} {step}");
        }
    }
}
