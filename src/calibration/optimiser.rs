//! What every optimiser is given and gives back, and the table of optimisers.

use serde::{Deserialize, Serialize};

use crate::calibration::objective::{Counts, Problem};
use crate::calibration::optimisers::{annealing, basins, gauss_newton, hybrid, least_squares, many, surrogate};
use crate::error::Result;

/// Settings of all optimisers; each reads what concerns it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Starting points of Gauss-Newton; `None`: as many as it takes, see [`Settings::starts_for`] and
    /// [`crate::calibration::optimisers::basins`].
    pub starts: Option<usize>,
    /// Factorisations a start may spend.
    pub refactorisations: u64,
    /// Factorisations that the best start may spend beyond that.
    pub polish: u64,
    /// Gauss-Newton ends when a step lowers the error by less than this fraction.
    pub tolerance: f64,
    /// Independent annealing chains.
    pub chains: usize,
    /// Evaluations of all chains of one problem together.
    pub evaluations: u64,
    /// First temperature, as a fraction of the error at the start of a chain.
    pub initial_temperature: f64,
    /// Last temperature, as a fraction of the first.
    pub final_temperature: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            starts: None,
            refactorisations: 20,
            polish: 80,
            tolerance: 1e-6,
            chains: 4,
            evaluations: 5000,
            initial_temperature: 0.1,
            final_temperature: 1e-4,
        }
    }
}

impl Settings {
    /// The temperature of annealing when this fraction of the evaluations is spent.
    pub fn temperature(&self, first: f64, elapsed: f64) -> f64 {
        first * self.final_temperature.powf(elapsed)
    }

    /// Most starting points for a problem of `groups` groups. Unless they are given: one for a single group, whose best
    /// stiffness is known after one factorisation; otherwise 2 + 2 m and at most 32, for local minima come with groups.
    pub fn starts_for(&self, groups: usize) -> usize {
        let automatic = if groups == 1 { 1 } else { (2 + 2 * groups).min(32) };
        self.starts.unwrap_or(automatic).max(1)
    }
}

/// Why an optimiser stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stop {
    /// Further steps would lower the error by less than the tolerance.
    Converged,
    /// On a fine mesh or with many groups: a model that is right to first order promises less than 1e-4 of the error (or the
    /// tolerance, if that is larger); see [`crate::calibration::optimisers::reduced`] and [`crate::calibration::optimisers::many`].
    NoPromise,
    /// No step along the model lowered the error.
    NoDescent,
    /// It is at the bottom of a valley, but no other start found the same one, and no hop came back to it: there may be a lower one.
    StartsDisagree,
    /// The factorisations of a start were spent.
    RefactorisationLimit,
    /// The evaluations were spent.
    EvaluationLimit,
    /// The problem was linear and solved in one step.
    Solved,
    /// Nothing was searched: the stiffness was given.
    NotFitted,
    /// A ladder of groups came to the most groups of the scene.
    GroupLimit,
    /// A ladder came to the error of the scene.
    ErrorReached,
    /// The held-out error did not fall for as many rungs of a ladder as the scene allows.
    HeldOutRises,
}

impl Stop {
    /// The name in a result.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::NoPromise => "model_promises_less_than_1e-4",
            Self::NoDescent => "no_descent",
            Self::StartsDisagree => "starts_disagree",
            Self::RefactorisationLimit => "refactorisation_limit",
            Self::EvaluationLimit => "evaluation_limit",
            Self::Solved => "solved",
            Self::NotFitted => "not_fitted",
            Self::GroupLimit => "group_limit",
            Self::ErrorReached => "error_reached",
            Self::HeldOutRises => "held_out_rises",
        }
    }
}

/// One point of the history of a start or chain: work done and best error so far.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TracePoint {
    /// Seconds since the start or chain began.
    pub seconds: f64,
    /// Factorisations of this start or chain so far.
    pub refactorisations: u64,
    /// Smallest error so far, percent.
    pub error: f64,
}

/// What several starts say of the best of them, see [`crate::calibration::optimisers::basins`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Agreement {
    /// Starts.
    pub starts: usize,
    /// Those that ended within 1e-4 of the best error.
    pub agreeing: usize,
    /// How far the median of their errors is above the best one, percent of it.
    pub median: f64,
    /// How far the worst is, percent of the best.
    pub worst: f64,
    /// Hops from the best network.
    pub hops: usize,
    /// Those that came back to its error after the last lower one was found.
    pub returned: usize,
}

/// What one start or chain found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// Best stiffnesses, length m.
    pub phi: Vec<f64>,
    /// Error there, percent.
    pub error: f64,
    /// Why it ended.
    pub stop: Stop,
    /// Work done by all starts and chains that this outcome stands for.
    pub counts: Counts,
    /// History of the start or chain that found it.
    pub trace: Vec<TracePoint>,
    /// What the other starts say of it; none of a single search.
    pub agreement: Option<Agreement>,
}

impl Outcome {
    /// Stiffnesses that nobody searched for; the error is not a number.
    pub fn known(phi: Vec<f64>) -> Self {
        Self { phi, error: f64::NAN, stop: Stop::NotFitted, counts: Counts::default(), trace: vec![], agreement: None }
    }

    /// This outcome continued by another one that began where it ended.
    pub fn followed_by(self, next: Self) -> Self {
        let (seconds, refactorisations) = self.trace.last().map_or((0.0, 0), |p| (p.seconds, p.refactorisations));
        let mut trace = self.trace;
        trace.extend(next.trace.iter().map(|point| TracePoint {
            seconds: point.seconds + seconds,
            refactorisations: point.refactorisations + refactorisations,
            error: point.error.min(self.error),
        }));
        let mut counts = self.counts;
        counts += next.counts;
        let (phi, error) = if next.error < self.error { (next.phi, next.error) } else { (self.phi, self.error) };
        Self { phi, error, stop: next.stop, counts, trace, agreement: None }
    }
}

/// Part of an error within which another one is equal to it: below is how far from the bottom a search ended, and rounding.
pub const EQUAL: f64 = 1e-8;

/// The best of several outcomes, with the work of all of them: the first within [`EQUAL`] of the lowest error, so that of ends in the
/// same valley rounding chooses none.
///
/// # Panics
/// When there is none.
pub fn best(outcomes: Vec<Outcome>) -> Outcome {
    let mut total = Counts::default();
    outcomes.iter().for_each(|outcome| total += outcome.counts);
    let lowest = outcomes.iter().fold(f64::INFINITY, |lowest, outcome| lowest.min(outcome.error));
    let first = outcomes.iter().position(|outcome| outcome.error <= (1.0 + EQUAL) * lowest).unwrap_or(0);
    let mut best = outcomes.into_iter().nth(first).expect("an optimiser has at least one start");
    best.counts = total;
    best
}

/// Which objectives an optimiser can make small.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Serves {
    /// All that are searched.
    All,
    /// Those that are linear in the stiffness.
    Linear,
    /// The one of displacements.
    Displacement,
}

/// An optimiser as a scene names it.
pub struct Optimiser {
    /// Name in the scene.
    pub name: &'static str,
    /// One line for `list`.
    pub doc: &'static str,
    /// Runs all starts or chains of one problem.
    pub run: fn(&Problem, &Settings) -> Result<Outcome>,
    /// Which objectives it can make small.
    pub serves: Serves,
    /// True when it forms the Jacobian (one column a group).
    pub uses_jacobian: bool,
    /// Evaluations that a problem of so many groups takes at most: the length of the progress bar.
    pub expected_evaluations: fn(&Settings, usize) -> u64,
}

/// All optimisers.
pub const OPTIMISERS: &[Optimiser] = &[
    Optimiser {
        name: "gauss_newton",
        doc: "damped Gauss-Newton with the exact Jacobian and bounds, from several starts",
        run: gauss_newton::run,
        serves: Serves::All,
        uses_jacobian: true,
        expected_evaluations: |settings, groups| match many::serves(groups) {
            true => settings.refactorisations + settings.polish,
            false => basins::expected_evaluations(settings, groups),
        },
    },
    Optimiser {
        name: "annealing",
        doc: "simulated annealing (Algorithm 3.1), independent chains",
        run: annealing::run,
        serves: Serves::All,
        uses_jacobian: false,
        expected_evaluations: |settings, _| settings.evaluations,
    },
    Optimiser {
        name: "hybrid",
        doc: "annealing, then Gauss-Newton from the best state of each chain",
        run: hybrid::run,
        serves: Serves::All,
        uses_jacobian: true,
        expected_evaluations: |settings, _| {
            settings.evaluations + settings.chains as u64 * settings.refactorisations + settings.polish
        },
    },
    Optimiser {
        name: "surrogate",
        doc: "annealing on a reduced basis with an error bound; what it finds is confirmed exactly",
        run: surrogate::run,
        serves: Serves::Displacement,
        uses_jacobian: true,
        expected_evaluations: |settings, _| settings.evaluations,
    },
    Optimiser {
        name: "least_squares",
        doc: "bounded least squares in one step, for the linear objectives acceleration and matrix",
        run: least_squares::run,
        serves: Serves::Linear,
        uses_jacobian: false,
        expected_evaluations: |_, _| 1,
    },
];

/// The optimiser of this name.
pub fn find(name: &str) -> Option<&'static Optimiser> {
    OPTIMISERS.iter().find(|optimiser| optimiser.name == name)
}
