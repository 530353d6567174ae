//! Annealing on a surrogate, confirmed exactly.
//!
//! A round: every chain takes some steps of Algorithm 3.1 on the surrogate ([`crate::calibration::surrogate`]), from the
//! best state known; from the lowest state they met Gauss-Newton goes down, on the surrogate too. Where it ends is solved
//! exactly. That tells how good the surrogate is there:
//!
//! - the exact error is lower than the best: the state becomes the best and the middle of the trust region, and its
//!   solution with all derivatives joins the basis, so that the surrogate is right there to first order;
//! - it is not: the solution joins the basis, and the next round begins from the same best with a better surrogate.
//!
//! The region grows where the gain was as predicted and shrinks where it was not. When the basis is full it starts anew
//! from the best state. Since every chain reads the same frozen surrogate in a round and draws from its own stream, the
//! numbers do not depend on threads. Errors in the outcome are exact ones only.

use rayon::prelude::*;

use crate::calibration::objective::{Counts, Objective, Problem};
use crate::calibration::objectives::displacement::{Displacement, Target};
use crate::calibration::optimiser::{Outcome, Settings, Stop, TracePoint};
use crate::calibration::optimisers::annealing::Walk;
use crate::calibration::optimisers::gauss_newton;
use crate::calibration::surrogate::galerkin::Galerkin;
use crate::calibration::surrogate::walker::{Trust, Walker};
use crate::clock::Stopwatch;
use crate::error::{Error, Result};
use crate::rng::Stream;

/// Fraction of the upper bounds where the search begins.
const START: f64 = 0.1;

/// First radius of the trust region in the logarithm of phi.
const RADIUS: f64 = 1.0;

/// Largest radius: a factor of 20 either way.
const LARGEST_RADIUS: f64 = 3.0;

/// Rounds that the evaluations are meant for.
const ROUNDS: u64 = 40;

/// Rounds without a gain after which a search ends.
const QUIET: usize = 2;

/// Columns of the basis: at least this, or twice what one state with its derivatives brings.
const COLUMNS: usize = 24;

/// Runs the search of one problem.
///
/// # Errors
/// When K is not positive definite at the start, when the problem is not one of displacements, or on interruption.
pub fn run(problem: &Problem, settings: &Settings) -> Result<Outcome> {
    let Some(target) = problem.displacement else {
        let help = "the surrogate needs the objective displacement";
        return Err(Error::input("calibration.optimiser", "there is no surrogate of this objective", help));
    };
    let mut search = Search::begin(problem, settings, target)?;
    loop {
        problem.progress.check()?;
        if let Some(stop) = search.round()? {
            return Ok(search.finish(stop));
        }
    }
}

/// A state of the surrogate, and what finding it cost.
struct Candidate {
    phi: Vec<f64>,
    error: f64,
    evaluations: u64,
}

struct Search<'s, 'a> {
    problem: &'s Problem<'a>,
    settings: &'s Settings,
    clock: Stopwatch,
    exact: Displacement<'a>,
    basis: Galerkin<'a>,
    trust: Trust,
    streams: Vec<Stream>,
    /// Solution and derivatives at the best state (columns of n).
    anchor: Vec<f64>,
    phi: Vec<f64>,
    error: f64,
    first_error: f64,
    quiet: usize,
    spent: u64,
    trace: Vec<TracePoint>,
}

impl<'s, 'a> Search<'s, 'a> {
    /// Solves at the first state.
    fn begin(problem: &'s Problem<'a>, settings: &'s Settings, target: Target<'a>) -> Result<Self> {
        let clock = Stopwatch::start();
        let mut exact = Displacement::new(target);
        let mut phi: Vec<f64> = problem.upper.iter().map(|upper| START * upper).collect();
        exact.error(&phi)?;
        let error = exact.fit_scale(&mut phi);
        let streams =
            (0..settings.chains.max(1)).map(|chain| Stream::new(problem.seed, problem.index, chain)).collect();
        let trust = Trust::new(&phi, RADIUS);
        let basis = Galerkin::new(target);
        let mut search = Self {
            problem,
            settings,
            clock,
            exact,
            basis,
            trust,
            streams,
            anchor: vec![],
            phi,
            error,
            first_error: error,
            quiet: 0,
            spent: 0,
            trace: vec![],
        };
        search.settle()?;
        Ok(search)
    }

    /// Makes the state that was solved last the best: the basis gets its solution and derivatives.
    fn settle(&mut self) -> Result<()> {
        let target = self.basis.target();
        let (mut residual, mut jacobian) = (Vec::new(), Vec::new());
        self.exact.linearise(&mut residual, &mut jacobian)?;
        let n = target.stiffness.unknowns();
        self.anchor.clear();
        self.anchor.extend_from_slice(self.exact.displacement());
        self.anchor.extend_from_slice(&jacobian);
        let columns = self.anchor.len() / n;
        if self.basis.rank() + columns > COLUMNS.max(2 * columns) {
            self.basis.clear();
        }
        self.basis.enrich(&self.anchor);
        self.record();
        Ok(())
    }

    /// Adds the solution of the last exact state to the basis.
    fn enrich(&mut self) {
        let cases = self.basis.target().weights.len();
        let columns = self.anchor.len() / self.basis.target().stiffness.unknowns();
        if self.basis.rank() + cases > COLUMNS.max(3 * columns) {
            self.basis.clear();
            self.basis.enrich(&self.anchor);
        }
        self.basis.enrich(self.exact.displacement());
    }

    /// One round; why the search ends, if it does.
    fn round(&mut self) -> Result<Option<Stop>> {
        let candidate = self.lowest()?;
        self.spent += candidate.evaluations;
        self.problem.progress.advance(candidate.evaluations);
        let predicted = self.error - candidate.error;
        let mut phi = candidate.phi;
        let confirmed = match self.exact.error(&phi) {
            Ok(_) => self.exact.fit_scale(&mut phi),
            Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => f64::INFINITY,
            Err(other) => return Err(other),
        };
        let gain = self.error - confirmed;
        let negligible = self.settings.tolerance * self.error;
        let radius = match gain / predicted {
            _ if predicted <= negligible => 2.0 * self.trust.radius,
            ratio if ratio > 0.75 => 2.0 * self.trust.radius,
            ratio if ratio > 0.25 => self.trust.radius,
            _ => 0.4 * self.trust.radius,
        };
        if gain > 0.0 {
            self.phi = phi;
            self.error = confirmed;
            self.settle()?;
        } else if confirmed.is_finite() {
            self.enrich();
        }
        self.trust = Trust::new(&self.phi, radius.min(LARGEST_RADIUS));
        self.quiet = if predicted <= negligible { self.quiet + 1 } else { 0 };
        Ok(match () {
            () if self.quiet >= QUIET => Some(Stop::Converged),
            () if self.spent >= self.settings.evaluations => Some(Stop::EvaluationLimit),
            () => None,
        })
    }

    /// The lowest state of all chains on the surrogate as it is, and down from there.
    fn lowest(&mut self) -> Result<Candidate> {
        let mut streams = std::mem::take(&mut self.streams);
        let this = &*self;
        let found: Vec<Result<Candidate>> = streams.par_iter_mut().map(|stream| this.walk(stream)).collect();
        self.streams = streams;
        let mut found = found.into_iter().collect::<Result<Vec<_>>>()?;
        let walked: u64 = found.iter().map(|candidate| candidate.evaluations).sum();
        let lowest = (0..found.len()).min_by(|&a, &b| found[a].error.total_cmp(&found[b].error)).unwrap_or(0);
        let descended = self.descend(found.swap_remove(lowest))?;
        Ok(Candidate { evaluations: walked + descended.evaluations, ..descended })
    }

    /// One chain of a round: annealing on the surrogate.
    fn walk(&self, stream: &mut Stream) -> Result<Candidate> {
        let Settings { evaluations, initial_temperature, .. } = *self.settings;
        let steps = (evaluations / (self.settings.chains.max(1) as u64 * ROUNDS)).max(1);
        let elapsed = (self.spent as f64 / evaluations as f64).min(1.0);
        let temperature = self.settings.temperature(initial_temperature * self.first_error, elapsed);
        let mut walker = Walker::new(&self.basis, Some(&self.trust));
        let mut walk = Walk::new(self.phi.clone(), self.error, self.trust.radius);
        let mut lowest = Candidate { phi: self.phi.clone(), error: self.error, evaluations: steps };
        for _ in 0..steps {
            walk.step(self.problem.upper, temperature, stream, &mut |phi| {
                walker.error(phi)?;
                Ok(walker.fit_scale(phi))
            })?;
            if walk.error < lowest.error {
                lowest.phi.copy_from_slice(&walk.phi);
                lowest.error = walk.error;
            }
        }
        Ok(lowest)
    }

    /// Gauss-Newton on the surrogate.
    fn descend(&self, from: Candidate) -> Result<Candidate> {
        let make = || -> Box<dyn Objective + '_> { Box::new(Walker::new(&self.basis, Some(&self.trust))) };
        let Problem { upper, seed, index, progress, .. } = *self.problem;
        let reduced = Problem { make: &make, displacement: None, upper, seed, index, progress };
        let Outcome { phi, error, counts, .. } = gauss_newton::descend(&reduced, self.settings, &from.phi)?;
        Ok(Candidate { phi, error, evaluations: counts.evaluations })
    }

    fn record(&mut self) {
        let refactorisations = self.exact.counts().refactorisations;
        self.trace.push(TracePoint { seconds: self.clock.seconds(), refactorisations, error: self.error });
    }

    fn finish(mut self, stop: Stop) -> Outcome {
        self.record();
        let counts = Counts { surrogate_evaluations: self.spent, ..self.exact.counts() };
        Outcome { phi: self.phi, error: self.error, stop, counts, trace: self.trace }
    }
}
