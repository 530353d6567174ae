//! Annealing on a surrogate, confirmed exactly.
//!
//! A search holds the best state known, exactly solved, and a surrogate ([`crate::calibration::surrogate`]) that is right
//! there to first order, because the basis contains the solution and its derivatives. A round:
//!
//! 1. Algorithm 3.1 walks on the surrogate from the best state. Every new lowest state passes the gate: the bound of its
//!    energy error must be small. A state that fails ends the walk.
//! 2. From a lowest state that passed, Gauss-Newton goes down, on the surrogate too.
//! 3. Where that ends is solved exactly. Is the exact error the lowest, the state becomes the best and its solution with
//!    all derivatives joins the basis. Otherwise the solution alone joins, and the surrogate is better next time.
//!
//! The surrogate is believed in a region around the best state only; it grows where the gain was as predicted and shrinks
//! where it was not. A full basis starts anew from the best state. With many groups the bound costs more than it
//! saves (one half solve for every group and column); then the region alone is the gate.
//!
//! Every chain is such a search of its own: it begins where a chain of annealing begins and draws from its stream. They do
//! not know of each other, so the numbers do not depend on threads. All go on until they slow down, the lower half until
//! they slow down further, the lowest to the end. Of several chains the first only goes down (step 2): the place where it
//! ends is no matter of luck, and the others walk to different ones. Errors in the outcome are exact ones only.
//!
//! Measured on nine bodies and gammas with 3 to 23 groups, both weightings, 12 seeds each: 12 of 216 searches end more than
//! 1 % above the lowest that 16 starts of Gauss-Newton find. When all chains walk and one is chosen at once it is 20, in the
//! same time. (To drop the worse half after every round costs a third less, and ends up to 1.7 % high on the torus with 15
//! groups: which chain leads early says little.)
//!
//! On a body so small that a full basis is no reduction ([`reduces`]) there is nothing to gain from one: the network itself
//! takes its place, in one chain that walks the steps of one round and then goes down ([`hybrid`]). All evaluations are
//! exact then, and none is counted as one of a surrogate. On the circle with 16 groups (60 displacements, 34 columns) rounds
//! on a basis took twice as long as this does.

use crate::calibration::objective::{Counts, Objective, Problem, each, each_of};
use crate::calibration::objectives::displacement::{Displacement, Target};
use crate::calibration::optimiser::{Outcome, Settings, Stop, TracePoint};
use crate::calibration::optimisers::annealing::{self, Walk};
use crate::calibration::optimisers::{gauss_newton, hybrid};
use crate::calibration::surrogate::certificate::{Certificate, assembled};
use crate::calibration::surrogate::galerkin::Galerkin;
use crate::calibration::surrogate::walker::{Trust, Walker};
use crate::clock::Stopwatch;
use crate::error::{Error, Result};
use crate::rng::Stream;

/// First radius of the trust region in the logarithm of phi.
const RADIUS: f64 = 1.0;

/// Largest radius: a factor of 20 either way.
const LARGEST_RADIUS: f64 = 3.0;

/// A search may end in a region of at least this radius only.
const WIDE: f64 = 0.5;

/// Rounds of one search; they share its evaluations.
const ROUNDS: u64 = 40;

/// Chains that lower their error by less than this fraction in a round wait for the others, and the lower half goes on: to
/// the second fraction, and then to the end.
const PACES: [f64; 2] = [0.01, 0.001];

/// Columns of the basis: at least this, or twice what one state with its derivatives brings.
const COLUMNS: usize = 24;

/// A state passes the gate when the bound of its energy error is below this fraction of its energy norm.
const GATE: f64 = 0.1;

/// Residual columns up to which the bound is used.
const CERTIFIED: usize = 120;

/// Columns of the basis of one chain, for so many load cases and groups.
pub fn capacity(cases: usize, groups: usize) -> usize {
    COLUMNS.max(2 * cases * (1 + groups))
}

/// True when a full basis is at most half as wide as the displacements. One that is wider costs about as much as the
/// network itself.
pub fn reduces(unknowns: usize, cases: usize, groups: usize) -> bool {
    2 * capacity(cases, groups) <= unknowns
}

/// Columns that the bound of one chain keeps at most, each as long as a displacement.
pub fn certified(cases: usize, groups: usize) -> usize {
    let columns = cases + capacity(cases, groups) * groups;
    if columns <= CERTIFIED { columns } else { 0 }
}

/// Runs a search for every chain, and the best to its end.
///
/// # Errors
/// When no chain finds a start with a positive definite K, when the problem is not one of displacements or has no factors,
/// or on interruption.
pub fn run<'s, 'a>(problem: &'s Problem<'a>, settings: &'s Settings) -> Result<Outcome> {
    let Some(worker) = problem.displacement else {
        let help = "the surrogate needs the objective displacement";
        return Err(Error::input("calibration.optimiser", "there is no surrogate of this objective", help));
    };
    let target @ Target { operator, weights, .. } = worker().target();
    assembled(&target)?;
    if !reduces(operator.unknowns(), weights.len(), problem.upper.len()) {
        return hybrid::run(problem, &Settings { chains: 1, evaluations: steps(settings), ..*settings });
    }
    let begin = |chain| Search::begin(problem, settings, worker(), chain);
    let mut failure = Error::Interrupted;
    let mut searches = sound(each(problem.side_by_side, settings.chains.max(1), begin), &mut failure)?;
    let mut others = Counts::default();
    for pace in PACES {
        if searches.len() > 1 {
            let on = |search: Search<'s, 'a>| search.until(pace);
            searches = sound(each_of(problem.side_by_side, searches, on), &mut failure)?;
            searches.sort_by(|a, b| a.error.total_cmp(&b.error));
            let kept = searches.len().div_ceil(2);
            searches.drain(kept..).for_each(|search| others += search.counts());
        }
    }
    searches.drain(1.min(searches.len())..).for_each(|search| others += search.counts());
    let best = searches.pop().ok_or(failure)?;
    Ok(best.until(0.0)?.finish(others))
}

/// The searches that go on; an interruption ends all.
fn sound<'s, 'a>(outcomes: Vec<Result<Search<'s, 'a>>>, failure: &mut Error) -> Result<Vec<Search<'s, 'a>>> {
    let mut searches = Vec::new();
    for outcome in outcomes {
        match outcome {
            Ok(search) => searches.push(search),
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) => *failure = error,
        }
    }
    Ok(searches)
}

/// Evaluations that one chain may spend.
fn evaluations(settings: &Settings) -> u64 {
    settings.evaluations / settings.chains.max(1) as u64
}

/// Steps of the walk of one round.
fn steps(settings: &Settings) -> u64 {
    (evaluations(settings) / ROUNDS).max(1)
}

/// A state of the surrogate.
struct Candidate {
    phi: Vec<f64>,
    error: f64,
    passed: bool,
}

struct Search<'s, 'a> {
    problem: &'s Problem<'a>,
    settings: &'s Settings,
    clock: Stopwatch,
    exact: Displacement<'a>,
    basis: Galerkin<'a>,
    certificate: Option<Certificate<'a>>,
    trust: Trust,
    stream: Stream,
    /// Solution and derivatives at the best state (columns of n).
    anchor: Vec<f64>,
    phi: Vec<f64>,
    error: f64,
    first_error: f64,
    rounds: u64,
    surrogate_evaluations: u64,
    /// The fraction by which the last round lowered the error; infinite when it did not, or there was none.
    pace: f64,
    /// False for the first of several chains, which only goes down.
    walks: bool,
    stop: Option<Stop>,
    trace: Vec<TracePoint>,
}

impl<'s, 'a> Search<'s, 'a> {
    /// Solves at the first state of a chain.
    fn begin(
        problem: &'s Problem<'a>,
        settings: &'s Settings,
        mut exact: Displacement<'a>,
        chain: usize,
    ) -> Result<Self> {
        let clock = Stopwatch::start();
        let mut stream = Stream::new(problem.seed, problem.index, chain);
        let mut phi = annealing::start(problem, chain, &mut stream);
        exact.error(&phi)?;
        let error = exact.fit_scale(&mut phi);
        let basis = Galerkin::new(exact.target());
        let mut search = Self {
            problem,
            settings,
            clock,
            exact,
            basis,
            certificate: None,
            trust: Trust::new(&phi, RADIUS),
            stream,
            anchor: vec![],
            phi,
            error,
            first_error: error,
            rounds: 0,
            surrogate_evaluations: 0,
            pace: f64::INFINITY,
            walks: chain > 0 || settings.chains <= 1,
            stop: None,
            trace: vec![],
        };
        search.settle()?;
        Ok(search)
    }

    /// Makes the state that was solved last the best: the basis gets its solution and derivatives.
    fn settle(&mut self) -> Result<()> {
        let (mut residual, mut jacobian) = (Vec::new(), Vec::new());
        self.exact.linearise(&mut residual, &mut jacobian)?;
        self.anchor.clear();
        self.anchor.extend_from_slice(self.exact.displacement());
        self.anchor.extend_from_slice(&jacobian);
        if self.basis.rank() + self.columns() > self.capacity() {
            self.basis.clear();
        }
        self.basis.enrich(&self.anchor);
        self.certificate = None;
        self.certify()?;
        self.record();
        Ok(())
    }

    /// Adds the solution of the last exact state to the basis.
    fn enrich(&mut self) -> Result<()> {
        if self.basis.rank() + self.cases() > self.capacity() + self.columns() {
            self.basis.clear();
            self.basis.enrich(&self.anchor);
            self.certificate = None;
        }
        self.basis.enrich(self.exact.displacement());
        self.certify()
    }

    /// Brings the bound up to the basis, where it is worth its cost.
    fn certify(&mut self) -> Result<()> {
        if self.cases() + self.basis.rank() * self.phi.len() > CERTIFIED {
            self.certificate = None;
            return Ok(());
        }
        if self.certificate.is_none() {
            self.certificate = Some(Certificate::new(self.basis.target(), &self.phi)?);
        }
        self.certificate.iter_mut().for_each(|certificate| certificate.extend(&self.basis));
        Ok(())
    }

    /// Rounds until one lowers the error by less than the fraction `pace`, or the search ends.
    fn until(mut self, pace: f64) -> Result<Self> {
        while self.stop.is_none() && self.pace >= pace {
            self.round()?;
        }
        Ok(self)
    }

    /// One round; sets `stop` when the search ends.
    fn round(&mut self) -> Result<()> {
        self.problem.progress.check()?;
        let spent = self.surrogate_evaluations;
        let mut candidate = if self.walks { self.walk()? } else { self.here() };
        if candidate.passed {
            candidate = self.descend(candidate)?;
        }
        self.rounds += 1;
        self.problem.progress.advance(self.surrogate_evaluations - spent);
        let (before, predicted) = (self.error, self.error - candidate.error);
        let confirmed = self.confirm(candidate.phi)?;
        let gain = before - confirmed;
        let settled = predicted <= self.settings.tolerance * before;
        let radius = match gain / predicted {
            ratio if settled || ratio > 0.75 => 2.0 * self.trust.radius,
            ratio if ratio > 0.25 => self.trust.radius,
            _ => 0.4 * self.trust.radius,
        };
        self.stop = match () {
            () if settled && self.trust.radius >= WIDE => Some(Stop::Converged),
            () if self.rounds >= ROUNDS || self.surrogate_evaluations >= evaluations(self.settings) => {
                Some(Stop::EvaluationLimit)
            }
            () => None,
        };
        self.pace = if gain > 0.0 { gain / before } else { f64::INFINITY };
        self.trust = Trust::new(&self.phi, radius.min(LARGEST_RADIUS));
        Ok(())
    }

    /// Solves exactly at a candidate and learns from it; the error there.
    fn confirm(&mut self, mut phi: Vec<f64>) -> Result<f64> {
        let error = match self.exact.error(&phi) {
            Ok(_) => self.exact.fit_scale(&mut phi),
            Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => return Ok(f64::INFINITY),
            Err(other) => return Err(other),
        };
        if error < self.error {
            self.phi = phi;
            self.error = error;
            self.settle()?;
        } else {
            self.enrich()?;
        }
        Ok(error)
    }

    /// The best state.
    fn here(&self) -> Candidate {
        Candidate { phi: self.phi.clone(), error: self.error, passed: true }
    }

    /// The lowest state of some steps of annealing on the surrogate.
    fn walk(&mut self) -> Result<Candidate> {
        let elapsed = self.rounds as f64 / ROUNDS as f64;
        let temperature = self.settings.temperature(self.settings.initial_temperature * self.first_error, elapsed);
        let mut walker = Walker::new(&self.basis, Some(&self.trust));
        let mut image = self.certificate.as_ref().map(Walker::bound_workspace).unwrap_or_default();
        let mut walk = Walk::new(self.phi.clone(), self.error, self.trust.radius);
        let mut lowest = self.here();
        for _ in 0..steps(self.settings) {
            walk.step(self.problem.upper, temperature, &mut self.stream, &mut |phi| {
                walker.error(phi)?;
                Ok(walker.fit_scale(phi))
            })?;
            if walk.error < lowest.error {
                lowest.phi.copy_from_slice(&walk.phi);
                lowest.error = walk.error;
                let bound = self.certificate.as_ref().map(|certificate| walker.bound(certificate, &mut image));
                lowest.passed = bound.is_none_or(|bound| bound.energy <= GATE * walker.energy());
            }
            if !lowest.passed {
                break;
            }
        }
        self.surrogate_evaluations += walker.counts().evaluations;
        Ok(lowest)
    }

    /// Gauss-Newton on the surrogate.
    fn descend(&mut self, from: Candidate) -> Result<Candidate> {
        let make = || -> Box<dyn Objective + '_> { Box::new(Walker::new(&self.basis, Some(&self.trust))) };
        let Problem { upper, seed, index, side_by_side, progress, .. } = *self.problem;
        let reduced = Problem::bare(&make, upper, (seed, index), side_by_side, progress);
        let Outcome { phi, error, counts, .. } = gauss_newton::descend(&reduced, self.settings, &from.phi)?;
        self.surrogate_evaluations += counts.evaluations;
        Ok(if error < from.error { Candidate { phi, error, passed: true } } else { from })
    }

    fn cases(&self) -> usize {
        self.basis.target().weights.len()
    }

    /// Columns that one state with its derivatives brings.
    fn columns(&self) -> usize {
        self.cases() * (1 + self.phi.len())
    }

    fn capacity(&self) -> usize {
        capacity(self.cases(), self.phi.len())
    }

    fn counts(&self) -> Counts {
        Counts { surrogate_evaluations: self.surrogate_evaluations, ..self.exact.counts() }
    }

    fn record(&mut self) {
        let refactorisations = self.exact.counts().refactorisations;
        self.trace.push(TracePoint { seconds: self.clock.seconds(), refactorisations, error: self.error });
    }

    fn finish(mut self, others: Counts) -> Outcome {
        self.record();
        let mut counts = self.counts();
        counts += others;
        let stop = self.stop.unwrap_or(Stop::EvaluationLimit);
        Outcome { phi: self.phi, error: self.error, stop, counts, trace: self.trace, agreement: None }
    }
}
