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
//! Measured with one chain on the circle with 16 groups and the torus with 4 and 15 (medians of 15 seeds): the walk alone
//! ends 2.5, 0.002 and 0.4 to 1.5 % above the best known, with step 2 at 0, 0 and 0 to 0.4 %. Step 2 alone does as well there:
//! the walk is for landscapes with more minima, and makes chains differ.
//!
//! Every chain is such a search of its own: it begins where a chain of annealing begins and draws from its stream. All
//! chains go on until they slow down, the best of them to the end. (To drop the worse half after every round costs a third
//! less, and ends up to 1.7 % high on the torus: which chain leads early says little.) They do not know of each other, so
//! the numbers do not depend on threads. Errors in the outcome are exact ones only.
//!
//! On a body so small that a full basis is no reduction ([`reduces`]) there is nothing to gain from one: the network itself
//! takes its place, in one chain that walks the steps of one round and then goes down ([`hybrid`]). All evaluations are
//! exact then, and none is counted as one of a surrogate. On the circle with 16 groups (60 displacements, 34 columns) an
//! exact evaluation costs 9 us; one on 16 to 32 columns costs 1.2 to 4.5 us in a walk and 10 to 25 us in a descent, with
//! its derivatives, and rounds on a basis took twice as long as this does.

use crate::calibration::objective::{Counts, Objective, Problem, each};
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

/// A chain that lowers its error by less than this fraction in a round waits for the others.
const SLOW: f64 = 0.01;

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
pub fn run(problem: &Problem, settings: &Settings) -> Result<Outcome> {
    let Some(worker) = problem.displacement else {
        let help = "the surrogate needs the objective displacement";
        return Err(Error::input("calibration.optimiser", "there is no surrogate of this objective", help));
    };
    let target @ Target { operator, weights, .. } = worker().target();
    assembled(&target)?;
    if !reduces(operator.unknowns(), weights.len(), problem.upper.len()) {
        return hybrid::run(problem, &Settings { chains: 1, evaluations: steps(settings), ..*settings });
    }
    let chains = settings.chains.max(1);
    let screen = |chain: usize| {
        let mut search = Search::begin(problem, settings, worker(), chain)?;
        while chains > 1 && search.stop.is_none() && !search.slow {
            search.round()?;
        }
        Ok(search)
    };
    let screened: Vec<Result<Search>> = each(problem.side_by_side, chains, screen);
    let (mut searches, mut failure) = (Vec::new(), Error::Interrupted);
    for search in screened {
        match search {
            Ok(search) => searches.push(search),
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) => failure = error,
        }
    }
    let best = (0..searches.len()).min_by(|&a, &b| searches[a].error.total_cmp(&searches[b].error));
    let mut best = searches.swap_remove(best.ok_or(failure)?);
    let mut others = Counts::default();
    searches.iter().for_each(|search| others += search.counts());
    while best.stop.is_none() {
        best.round()?;
    }
    Ok(best.finish(others))
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
    slow: bool,
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
            slow: false,
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

    /// One round; sets `stop` when the search ends.
    fn round(&mut self) -> Result<()> {
        self.problem.progress.check()?;
        let spent = self.surrogate_evaluations;
        let mut candidate = self.walk()?;
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
        self.slow = gain > 0.0 && gain < SLOW * before;
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

    /// The lowest state of some steps of annealing on the surrogate.
    fn walk(&mut self) -> Result<Candidate> {
        let elapsed = self.rounds as f64 / ROUNDS as f64;
        let temperature = self.settings.temperature(self.settings.initial_temperature * self.first_error, elapsed);
        let mut walker = Walker::new(&self.basis, Some(&self.trust));
        let mut image = self.certificate.as_ref().map(Walker::bound_workspace).unwrap_or_default();
        let mut walk = Walk::new(self.phi.clone(), self.error, self.trust.radius);
        let mut lowest = Candidate { phi: self.phi.clone(), error: self.error, passed: true };
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
        Outcome { phi: self.phi, error: self.error, stop, counts, trace: self.trace }
    }
}
