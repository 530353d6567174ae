//! Which of the local minima: starts until they agree, then hops from the best one.
//!
//! A start that converges has found a minimum, not the lowest one. What speaks for the lowest is that independent starts end in it
//! again and again; where they do not, the best one is perturbed and descended from anew (basin hopping: D. J. Wales and J. P. K. Doye,
//! J. Phys. Chem. A 101, 1997).
//!
//! 1. Starts go down in rounds of eight, a few factorisations each, until three of them end at the best error or all are spent.
//! 2. The best four that had spent their factorisations go on: the one that leads early need not lead in the end.
//! 3. Hops: one to three groups of the best network are multiplied by a factor between 2 and 30, up or down, or in every other hop all
//!    groups by factors around 1, and all are fitted again. A lower end takes the place of the best; sixteen hops without one
//!    end the search, four where most starts agree, and thirty-two where no other does.
//!
//! Errors within 1e-4 of each other are the same minimum. How many starts agreed, how far the others ended above, and how many
//! hops were made is in the outcome ([`Agreement`]); a best error that a single start or hop found is not told as converged.
//! What a scene says of starts is done to the letter: so many starts, and no hop.

use crate::calibration::objective::Problem;
use crate::calibration::optimiser::{Agreement, Outcome, Settings, Stop, best};
use crate::calibration::optimisers::gauss_newton::{self, descend, polish};
use crate::calibration::pieces::Stage;
use crate::error::{Error, Result};
use crate::rng::Stream;

/// Starts that go down side by side before it is asked whether they agree.
const ROUND: usize = 8;

/// Starts in the best minimum that are evidence enough.
const ENOUGH: usize = 3;

/// Starts that are polished at most, and how far above the best one they may be.
const POLISHED: usize = 4;
const NEAR: f64 = 0.1;

/// How far above the best network a hop may end after its first factorisations to go on.
const HOP_NEAR: f64 = 0.02;

/// Hops that go down side by side.
const SIDE_BY_SIDE: usize = 4;

/// Hops without a lower end after which the search stops.
const PATIENCE: usize = 16;

/// Hops at most.
const MOST_HOPS: usize = 96;

/// Groups that a hop of a few moves at most, and the decades of its factors; standard deviation of the decades of a hop of all.
const MOVED: usize = 3;
const DECADES: [f64; 2] = [0.3, 1.5];
const OF_ALL: f64 = 0.4;

/// A part of the upper bound: where a hop takes a group that rests at 0.
const FROM_ZERO: f64 = 0.1;

/// The first random stream of a hop: starts have those before it.
const HOP_STREAM: usize = 1000;

/// Errors within this part of each other are one minimum.
const SAME: f64 = 1e-4;

/// Evaluations that a problem of so many groups takes at most, on an ordinary search.
pub fn expected_evaluations(settings: &Settings, groups: usize) -> u64 {
    let hops = if settings.starts.is_none() && groups > 1 { PATIENCE } else { 0 };
    (settings.starts_for(groups) + hops) as u64 * settings.refactorisations + settings.polish
}

/// Goes down from the starts of a problem, and hops from the best of them.
///
/// # Errors
/// When no start has a positive definite K, or on interruption.
pub fn search(problem: &Problem, settings: &Settings) -> Result<Outcome> {
    let count = settings.starts_for(problem.upper.len());
    let go = |s: usize| descend(problem, settings, &gauss_newton::start(problem, s));
    let (mut found, mut failure) = (Vec::new(), None);
    // all at once where the scene says how many
    let round = if settings.starts.is_some() { count } else { ROUND };
    for first in (0..count).step_by(round) {
        for outcome in problem.pieces(Stage::Start, first..count.min(first + round), go) {
            match outcome {
                Ok(outcome) => found.push(outcome),
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                Err(error) => failure = Some(error),
            }
        }
        if agreeing(&found) >= ENOUGH {
            break;
        }
    }
    match failure {
        Some(error) if found.is_empty() => Err(error),
        _ => finish(problem, settings, found),
    }
}

/// Polishes the best of some outcomes, and hops from there.
///
/// # Errors
/// On interruption.
pub fn finish(problem: &Problem, settings: &Settings, mut found: Vec<Outcome>) -> Result<Outcome> {
    let mut order: Vec<usize> = (0..found.len()).collect();
    order.sort_by(|&a, &b| found[a].error.total_cmp(&found[b].error).then(a.cmp(&b)));
    let bar = (1.0 + NEAR) * found[order[0]].error;
    let near = order.into_iter().filter(|&i| found[i].error <= bar).take(POLISHED);
    let chosen: Vec<usize> = near.filter(|&i| found[i].stop == Stop::RefactorisationLimit).collect();
    let polished = problem.each(chosen.len(), |c| polish(problem, settings, (chosen[c], found[chosen[c]].clone())));
    for (i, outcome) in chosen.into_iter().zip(polished) {
        found[i] = outcome?;
    }
    let mut errors: Vec<f64> = found.iter().map(|outcome| outcome.error).collect();
    let first = best(found);
    if settings.starts.is_some() || errors.len() < 2 {
        return Ok(first.agreed(&mut errors, &Hops::default()));
    }
    hop(problem, settings, first, &mut errors)
}

/// How many outcomes are in the best minimum.
fn agreeing(found: &[Outcome]) -> usize {
    let errors: Vec<f64> = found.iter().map(|outcome| outcome.error).collect();
    same_as(errors.iter().copied().fold(f64::INFINITY, f64::min), &errors)
}

/// How many of these errors are in the minimum of the lowest one.
fn same_as(lowest: f64, errors: &[f64]) -> usize {
    errors.iter().filter(|error| **error <= (1.0 + SAME) * lowest).count()
}

/// What hops have found, beside the errors of the starts.
#[derive(Debug, Default)]
pub struct Hops {
    /// How many were made.
    pub made: usize,
    /// How many came back to the best error since it was found.
    pub returned: usize,
    /// How many ended no lower since it was found.
    without: usize,
}

impl Hops {
    /// True while more of them may find a lower error than `lowest`: where few of the starts agree, more are needed.
    pub fn go_on(&self, lowest: f64, errors: &[f64]) -> bool {
        let patience = match same_as(lowest, errors) {
            agreeing if 2 * agreeing > errors.len() => PATIENCE / 4,
            agreeing if agreeing < 2 => 2 * PATIENCE,
            _ => PATIENCE,
        };
        self.without < patience && self.made < MOST_HOPS && lowest > 0.0
    }

    /// Counts the ends of some hops from a network with the error `before`; infinite where one had none.
    pub fn count(&mut self, before: f64, ends: &[f64]) {
        self.made += ends.len();
        if ends.iter().any(|end| *end < (1.0 - SAME) * before) {
            (self.without, self.returned) = (0, 0);
        } else {
            self.without += ends.len();
            self.returned += same_as(before, ends);
        }
    }
}

/// Hops until enough of them in a row end no lower.
fn hop(problem: &Problem, settings: &Settings, mut lowest: Outcome, errors: &mut [f64]) -> Result<Outcome> {
    let mut hops = Hops::default();
    while hops.go_on(lowest.error, errors) {
        let go = |number: usize| {
            let found = descend(problem, settings, &perturbed(problem, &lowest.phi, number))?;
            let promising = found.stop == Stop::RefactorisationLimit && found.error <= (1.0 + HOP_NEAR) * lowest.error;
            let further = Settings { refactorisations: settings.polish, ..*settings };
            match promising && settings.polish > 0 {
                true => Ok(found.clone().followed_by(descend(problem, &further, &found.phi)?)),
                false => Ok(found),
            }
        };
        let (before, mut ends) = (lowest.error, vec![f64::INFINITY; SIDE_BY_SIDE]);
        let outcomes = problem.pieces(Stage::Hop, hops.made..hops.made + SIDE_BY_SIDE, go);
        for (end, outcome) in ends.iter_mut().zip(outcomes) {
            match outcome {
                Ok(outcome) => {
                    *end = outcome.error;
                    lowest = best(vec![lowest, outcome]);
                }
                Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. } | Error::NoEquilibrium { .. }) => {}
                Err(other) => return Err(other),
            }
        }
        hops.count(before, &ends);
    }
    Ok(lowest.agreed(errors, &hops))
}

/// The numbers of a network with a few of them moved, in the random stream of this hop.
pub fn perturbed(problem: &Problem, phi: &[f64], hop: usize) -> Vec<f64> {
    let mut stream = Stream::new(problem.seed, problem.index, HOP_STREAM + hop);
    let place = |group: usize| if phi[group] > 0.0 { phi[group] } else { FROM_ZERO * problem.upper[group] };
    if hop % 2 == 1 {
        let all = (0..phi.len()).map(|group| place(group) * 10f64.powf(OF_ALL * stream.normal()));
        return all.zip(problem.upper).map(|(phi, upper)| phi.min(*upper)).collect();
    }
    let mut moved = phi.to_vec();
    for _ in 0..=stream.below(MOVED.min(phi.len())) {
        let group = stream.below(phi.len());
        let decades = DECADES[0] + (DECADES[1] - DECADES[0]) * stream.uniform();
        let factor = 10f64.powf(if stream.uniform() < 0.5 { decades } else { -decades });
        moved[group] = (place(group) * factor).min(problem.upper[group]);
    }
    moved
}

impl Outcome {
    /// This outcome with what the `errors` of all starts say, and the hops.
    pub(super) fn agreed(self, errors: &mut [f64], hops: &Hops) -> Self {
        errors.sort_by(f64::total_cmp);
        let agreeing = same_as(self.error, errors);
        let above = |error: f64| (100.0 * (error / self.error.max(f64::MIN_POSITIVE) - 1.0)).max(0.0);
        let (median, worst) = (above(errors[errors.len() / 2]), above(errors[errors.len() - 1]));
        let Hops { made, returned, .. } = *hops;
        let agreement = Agreement { starts: errors.len(), agreeing, median, worst, hops: made, returned };
        let alone = errors.len() > 1 && agreeing + returned < 2 && self.error > 0.0;
        let stop = if alone { Stop::StartsDisagree } else { self.stop };
        Self { stop, agreement: Some(agreement), ..self }
    }
}
