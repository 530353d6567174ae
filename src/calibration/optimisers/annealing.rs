//! Simulated annealing (Algorithm 3.1), bounded and seeded, in independent chains.
//!
//! A chain holds one phi. A proposal that lowers the error is accepted; one that raises it by D is accepted with
//! probability exp(-D / T). The temperature T falls geometrically from a fraction of the first error to a small fraction
//! of itself, a little at every evaluation. The thesis leaves the neighbour open; here it is a step in the logarithm of
//! phi, since bounds span four decades: one group moves by exp(s N(0,1)), or all by exp(s N(0,1) / sqrt m). The length s
//! grows with every acceptance and shrinks with every rejection, so that about three of ten proposals are accepted (after A.
//! Corana et al., ACM Trans. Math. Softw. 13, 1987). A step over the upper bound is reflected in the logarithm.
//!
//! A proposal whose K(phi) is not positive definite is rejected and counted. Chain c of problem g draws from the stream
//! (seed, g, c): chains do not know of each other, so they run in parallel and give the same numbers in any order.

use crate::calibration::objective::{Objective, Problem};
use crate::calibration::optimiser::{Outcome, Settings, Stop, TracePoint, best};
use crate::calibration::pieces::Stage;
use crate::clock::Stopwatch;
use crate::error::{Error, Result};
use crate::rng::Stream;

/// Fraction of the upper bounds where the first chain begins.
const START: f64 = 0.1;

/// Largest length of a step in the logarithm of phi; chains begin with it.
const LONGEST_STEP: f64 = 1.0;

/// Growth of the step length at an acceptance and shrinkage at a rejection: in balance at 3 acceptances in 10.
const ADAPTATION: (f64, f64) = (1.15, 0.942);

/// Evaluations between two looks at the interruption flag.
const LOOK: u64 = 16;

/// Runs all chains and returns the best state found.
///
/// # Errors
/// When no chain finds a starting point with a positive definite K, or on interruption.
pub fn run(problem: &Problem, settings: &Settings) -> Result<Outcome> {
    chains(problem, settings).map(best)
}

/// The outcome of every chain, in the order of the chains.
///
/// # Errors
/// As [`run`].
pub fn chains(problem: &Problem, settings: &Settings) -> Result<Vec<Outcome>> {
    let count = settings.chains.max(1);
    let share = |chain: usize| {
        settings.evaluations / count as u64 + u64::from((chain as u64) < settings.evaluations % count as u64)
    };
    let chain = |chain| anneal(problem, settings, chain, share(chain).max(1));
    problem.pieces(Stage::Chain, 0..count, chain).into_iter().collect()
}

/// One chain of Algorithm 3.1.
fn anneal(problem: &Problem, settings: &Settings, chain: usize, evaluations: u64) -> Result<Outcome> {
    let clock = Stopwatch::start();
    let mut stream = Stream::new(problem.seed, problem.index, chain);
    let mut objective = (problem.make)();
    let phi = start(problem, chain, &mut stream);
    let error = objective.error(&phi)?;
    let mut found = Outcome {
        phi: phi.clone(),
        error,
        stop: Stop::EvaluationLimit,
        counts: objective.counts(),
        trace: vec![],
        agreement: None,
    };
    record(&mut found, &clock, objective.as_ref());
    let mut walk = Walk::new(phi, error, LONGEST_STEP);
    let first_temperature = settings.initial_temperature * error;
    for step in 1..evaluations {
        if step % LOOK == 0 {
            problem.progress.check()?;
            problem.progress.advance(LOOK);
        }
        let temperature = settings.temperature(first_temperature, step as f64 / evaluations as f64);
        walk.step(problem.upper, temperature, &mut stream, &mut |phi| objective.error(phi))?;
        if walk.error < found.error {
            found.phi.copy_from_slice(&walk.phi);
            found.error = walk.error;
            record(&mut found, &clock, objective.as_ref());
        }
    }
    found.counts = objective.counts();
    record(&mut found, &clock, objective.as_ref());
    Ok(found)
}

/// The state of a chain of Algorithm 3.1, on whatever objective.
pub(super) struct Walk {
    /// Where it stands.
    pub phi: Vec<f64>,
    /// The error there, percent.
    pub error: f64,
    step_length: f64,
    proposal: Vec<f64>,
}

impl Walk {
    /// A walk that begins at `phi` with steps of this length in the logarithm.
    pub fn new(phi: Vec<f64>, error: f64, step_length: f64) -> Self {
        Self { proposal: phi.clone(), phi, error, step_length: step_length.min(LONGEST_STEP) }
    }

    /// One proposal. `error_of` may move the proposal to a better one on its ray.
    ///
    /// # Errors
    /// Those of `error_of`, except that it has no solution: then the proposal is rejected.
    pub fn step(
        &mut self,
        upper: &[f64],
        temperature: f64,
        stream: &mut Stream,
        error_of: &mut dyn FnMut(&mut [f64]) -> Result<f64>,
    ) -> Result<()> {
        propose(&self.phi, upper, self.step_length, stream, &mut self.proposal);
        let draw = stream.uniform();
        let proposed = match error_of(&mut self.proposal) {
            Ok(proposed) => proposed,
            Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => f64::INFINITY,
            Err(other) => return Err(other),
        };
        if proposed <= self.error || draw < ((self.error - proposed) / temperature).exp() {
            self.phi.copy_from_slice(&self.proposal);
            self.error = proposed;
            self.step_length = (self.step_length * ADAPTATION.0).min(LONGEST_STEP);
        } else {
            self.step_length *= ADAPTATION.1;
        }
        Ok(())
    }
}

/// Where a chain begins: the first at a tenth of the bounds, the others anywhere within three decades below them.
pub(super) fn start(problem: &Problem, chain: usize, stream: &mut Stream) -> Vec<f64> {
    problem
        .upper
        .iter()
        .map(|upper| if chain == 0 { START * upper } else { upper * 10f64.powf(-3.0 * stream.uniform()) })
        .collect()
}

/// A neighbour of `phi` within the bounds.
fn propose(phi: &[f64], upper: &[f64], step: f64, stream: &mut Stream, proposal: &mut [f64]) {
    proposal.copy_from_slice(phi);
    let m = phi.len();
    if stream.uniform() < 0.5 {
        let a = stream.below(m);
        proposal[a] = reflected(phi[a] * (step * stream.normal()).exp(), upper[a]);
    } else {
        let step = step / (m as f64).sqrt();
        for (p, upper) in proposal.iter_mut().zip(upper) {
            *p = reflected(*p * (step * stream.normal()).exp(), *upper);
        }
    }
}

fn reflected(value: f64, upper: f64) -> f64 {
    if value > upper { upper * (upper / value) } else { value }
}

/// Appends the state of the search to its trace.
fn record(found: &mut Outcome, clock: &Stopwatch, objective: &dyn Objective) {
    let refactorisations = objective.counts().refactorisations;
    found.trace.push(TracePoint { seconds: clock.seconds(), refactorisations, error: found.error });
}
