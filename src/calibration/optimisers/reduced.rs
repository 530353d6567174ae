//! Gauss-Newton on fine meshes: every solve teaches a small model, and the steps are taken on the model.
//!
//! On a fine mesh one solve costs more than all else, and a linear model of u(phi) ~ 1/phi is a poor use of it: many
//! damped steps, each with m solves. The space V of the displacements and derivatives found so far is a better model. The
//! Galerkin solution in it,
//!
//! ```text
//! V^T K(phi) V y = V^T f,     u ~ V y,        e ~ |W (V y - u_ref)|
//! ```
//!
//! agrees with u(phi) and its derivatives wherever they are in V, knows that stiffness acts by its inverse, and costs
//! microseconds ([`crate::calibration::surrogate`]). A round:
//!
//! 1. [`gauss_newton::descend`] goes to the bottom of the model inside a trust region.
//! 2. The place where it ends is solved on the mesh, beginning with V y. The displacements join V: the model will not err
//!    there again.
//! 3. Was the gain not as promised, the derivatives at the best place join V too.
//!
//! Rounds end when the model, with the derivatives at the best place in V and so right there to first order, promises less
//! than 1e-4 of the error (or the tolerance of the settings, if that is larger). All starts share V: a
//! later one goes down on the model first, and is solved on the mesh only if that ends lower than all before. So do hops
//! from the best of them ([`basins`]), and the ends of the model say whether starts agree.
//!
//! V needs to contain the right directions, not exact numbers: displacements on the way are solved to 1e-6, derivatives
//! to 1e-4, the answer to the full tolerance.
//!
//! Measured on the torus with 33 x 17 x 17 control points and 5 groups, whose stiffness spans five decades: 21 solves and
//! 733 iterations, with twelve starts. One of its six rounds failed, the others gained 0.8 to 1.04 of what was promised.

use crate::calibration::objective::{Counts, Objective, Problem};
use crate::calibration::objectives::displacement::{Displacement, Target};
use crate::calibration::optimiser::{Outcome, Settings, Stop, TracePoint};
use crate::calibration::optimisers::basins::{self, Hops};
use crate::calibration::optimisers::gauss_newton;
use crate::calibration::surrogate::galerkin::Galerkin;
use crate::calibration::surrogate::walker::{Trust, Walker};
use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};

/// Residual |f - K u| / |f| of displacements on the way.
const LOOSE: f64 = 1e-6;

/// The same for derivatives.
const COLUMNS: f64 = 1e-4;

/// A promise of the model below this fraction of the error is in the noise of loose solves.
const SMALLEST_PROMISE: f64 = 1e-4;

/// First, smallest and largest radius of the trust region in the logarithm of phi.
const RADIUS: f64 = 3.0;
const SMALLEST_RADIUS: f64 = 0.5;
const LARGEST_RADIUS: f64 = 6.0;

/// Columns of V: at least this, or what three places with their derivatives bring.
const CAPACITY: usize = 48;

/// Errors of the model that one descent may ask for.
const DESCENT: u64 = 500;

/// A descent on the model ends when a step lowers the error by less than this fraction.
const DESCENT_TOLERANCE: f64 = 1e-5;

/// A gain this far (relative) from the promise asks for derivatives at once.
const SURPRISE: f64 = 0.3;

/// Free degrees of freedom from which a solve costs more than all that is done on the model.
const FINE: usize = 10_000;

/// Displacements and derivatives of one place up to which a model of them stays small.
const SMALL_MODEL: usize = 128;

/// True when so many free degrees of freedom, load cases and groups are a problem for this file.
pub fn serves(unknowns: usize, cases: usize, groups: usize) -> bool {
    unknowns >= FINE && cases * (1 + groups) <= SMALL_MODEL
}

/// A worker, when the problem is one for this file: the displacements of a fine mesh, or of any mesh whose workers use all
/// threads, with not too many groups and no prior.
pub fn worker<'a>(problem: &Problem<'a>) -> Option<Displacement<'a>> {
    if problem.prior.is_some() {
        return None;
    }
    let worker = problem.displacement?();
    let Target { operator, weights, upper, .. } = worker.target();
    let unknowns = if problem.side_by_side { operator.unknowns() } else { usize::MAX };
    serves(unknowns, weights.len(), upper.len()).then_some(worker)
}

/// Columns that V has at most, for so many load cases and groups.
pub fn capacity(cases: usize, groups: usize) -> usize {
    CAPACITY.max(3 * cases * (1 + groups))
}

/// Runs all starts, one after the other.
///
/// # Errors
/// When no start has a positive definite K, or on interruption.
pub fn run<'a>(problem: &Problem<'a>, settings: &Settings, worker: Displacement<'a>) -> Result<Outcome> {
    let mut search = Search::new(problem, settings, worker);
    let (mut failure, mut errors) = (None, Vec::new());
    for start in 0..settings.starts_for(problem.upper.len()) {
        match search.descend_from(&gauss_newton::start(problem, start)) {
            Ok(error) => errors.push(error),
            Err(error @ (Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. })) => failure = Some(error),
            Err(other) => return Err(other),
        }
    }
    let hops = if settings.starts.is_none() && errors.len() > 1 { search.hop(&errors)? } else { Hops::default() };
    search.finish(failure).map(|found| if errors.is_empty() { found } else { found.agreed(&mut errors, &hops) })
}

/// A place and the error there, percent.
#[derive(Clone)]
struct Place {
    phi: Vec<f64>,
    error: f64,
}

/// How a start begins.
enum Begun {
    /// On the mesh.
    At(Place),
    /// Not: the model ends no lower than what is known, with this error.
    Higher(f64),
}

struct Search<'s, 'a> {
    problem: &'s Problem<'a>,
    settings: &'s Settings,
    clock: Stopwatch,
    exact: Displacement<'a>,
    /// Where `exact` has its displacements.
    at: Vec<f64>,
    /// Where derivatives joined V last.
    taught: Vec<f64>,
    basis: Galerkin<'a>,
    /// Where the starts ended, and why.
    ended: Vec<(Place, Stop)>,
    model_evaluations: u64,
    trace: Vec<TracePoint>,
}

impl<'s, 'a> Search<'s, 'a> {
    fn new(problem: &'s Problem<'a>, settings: &'s Settings, exact: Displacement<'a>) -> Self {
        Self {
            basis: Galerkin::new(exact.target()),
            clock: Stopwatch::start(),
            exact,
            at: vec![],
            taught: vec![],
            problem,
            settings,
            ended: vec![],
            model_evaluations: 0,
            trace: vec![],
        }
    }

    /// Hops from the best place on the model, beside the errors of the starts.
    fn hop(&mut self, errors: &[f64]) -> Result<Hops> {
        let mut hops = Hops::default();
        while let Some(Place { phi, error: before }) = self.lowest().filter(|place| hops.go_on(place.error, errors)) {
            let error = match self.descend_from(&basins::perturbed(self.problem, &phi, hops.made)) {
                Ok(error) => error,
                Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => f64::INFINITY,
                Err(other) => return Err(other),
            };
            hops.count(before, &[error]);
        }
        Ok(hops)
    }

    /// The lowest place where a start has ended.
    fn lowest(&self) -> Option<Place> {
        let ended = self.ended.iter().map(|(place, _)| place);
        ended.min_by(|a, b| a.error.total_cmp(&b.error)).cloned()
    }

    /// Rounds from one start until it has ended, or shows to end no lower than an earlier one: the error there.
    fn descend_from(&mut self, start: &[f64]) -> Result<f64> {
        let limit = self.exact.counts().evaluations + self.settings.refactorisations + self.settings.polish;
        let mut best = match self.begin(start)? {
            Begun::Higher(error) => return Ok(error),
            Begun::At(place) => place,
        };
        let mut radius = RADIUS;
        let stop = loop {
            self.problem.progress.check()?;
            self.make_room(&best)?;
            let candidate = self.bottom(&best.phi, Some(&Trust::new(&best.phi, radius)))?;
            if !self.is_lower(&candidate) {
                return Ok(candidate.error);
            }
            let promise = best.error - candidate.error;
            if promise <= self.settings.tolerance.max(SMALLEST_PROMISE) * best.error {
                if self.taught == best.phi {
                    break Stop::NoPromise;
                }
                self.teach(&best)?;
                continue;
            }
            if self.exact.counts().evaluations >= limit {
                break Stop::RefactorisationLimit;
            }
            let error = self.try_at(&candidate.phi, &mut best)?;
            let gain = (promise + candidate.error - error) / promise;
            if (gain - 1.0).abs() > SURPRISE && self.taught != best.phi {
                self.teach(&best)?;
            }
            radius = match gain {
                gain if gain > 0.5 => (2.0 * radius).min(LARGEST_RADIUS),
                gain if gain > 0.1 => radius,
                _ => (0.5 * radius).max(SMALLEST_RADIUS),
            };
        };
        let error = best.error;
        self.ended.push((best, stop));
        Ok(error)
    }

    /// The first place of a start: the first start's own, with derivatives; a later start goes down on the model first, and
    /// ends there when that is no lower than what is known.
    fn begin(&mut self, start: &[f64]) -> Result<Begun> {
        if self.ended.is_empty() {
            let place = self.solve(start)?;
            self.teach(&place)?;
            return Ok(Begun::At(place));
        }
        let candidate = self.bottom(start, None)?;
        match self.is_lower(&candidate) {
            true => self.solve(&candidate.phi).map(Begun::At),
            false => Ok(Begun::Higher(candidate.error)),
        }
    }

    /// [`Search::descend`], counted.
    fn bottom(&mut self, from: &[f64], trust: Option<&Trust>) -> Result<Place> {
        let (place, evaluations) = self.descend(from, trust)?;
        self.model_evaluations += evaluations;
        Ok(place)
    }

    /// Solves on the mesh, beginning with what the model says; the displacements join V.
    fn solve(&mut self, phi: &[f64]) -> Result<Place> {
        self.problem.progress.advance(1);
        let guess = self.exact.begin_with();
        guess.fill(0.0);
        if self.basis.rank() > 0 {
            let mut model = Walker::new(&self.basis, None);
            if model.error(phi).is_ok() {
                guess.copy_from_slice(&model.displacement());
            }
        }
        let mut phi = phi.to_vec();
        self.exact.error_within(&phi, LOOSE)?;
        self.exact.fit_scale(&mut phi);
        self.basis.enrich(self.exact.displacement());
        // the model makes up for what a loose solve leaves, and promises are measured against it
        let mut model = Walker::new(&self.basis, None);
        model.error(&phi)?;
        let error = model.fit_scale(&mut phi);
        self.at.clone_from(&phi);
        let least = self.trace.last().map_or(f64::INFINITY, |point| point.error);
        let refactorisations = self.exact.counts().refactorisations;
        self.trace.push(TracePoint { seconds: self.clock.seconds(), refactorisations, error: error.min(least) });
        Ok(Place { phi, error })
    }

    /// Solves at a candidate, which becomes the best place if it is; the error there, infinite when it cannot be solved.
    fn try_at(&mut self, phi: &[f64], best: &mut Place) -> Result<f64> {
        match self.solve(phi) {
            Ok(place) => {
                let error = place.error;
                if error < best.error {
                    *best = place;
                }
                Ok(error)
            }
            Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => Ok(f64::INFINITY),
            Err(other) => Err(other),
        }
    }

    /// The derivatives at a place join V.
    fn teach(&mut self, place: &Place) -> Result<()> {
        if self.at != place.phi {
            self.solve(&place.phi)?;
        }
        let mut derivatives = self.model_derivatives(&place.phi)?;
        self.exact.derivatives(&mut derivatives, COLUMNS)?;
        self.basis.enrich(&derivatives);
        self.taught.clone_from(&place.phi);
        Ok(())
    }

    /// K^-1 K_a u as the model has it (cases x groups x n).
    fn model_derivatives(&self, phi: &[f64]) -> Result<Vec<f64>> {
        let (r, m, target) = (self.basis.rank(), phi.len(), self.basis.target());
        let n = target.operator.unknowns();
        let mut model = Walker::new(&self.basis, None);
        model.error(phi)?;
        let (mut residual, mut jacobian) = (Vec::new(), Vec::new());
        model.linearise(&mut residual, &mut jacobian)?;
        let mut derivatives = vec![0.0; target.weights.len() * m * n];
        for (i, derivative) in derivatives.chunks_exact_mut(n).enumerate() {
            let (case, a) = (i / m, i % m);
            let first = a * residual.len() + case * (r + 1);
            let y: Vec<f64> = jacobian[first..first + r].iter().map(|entry| -entry / target.weights[case]).collect();
            self.basis.combine(&y, derivative);
        }
        Ok(derivatives)
    }

    /// The bottom of the model, from a place.
    fn descend(&self, from: &[f64], trust: Option<&Trust>) -> Result<(Place, u64)> {
        let make = || -> Box<dyn Objective + '_> { Box::new(Walker::new(&self.basis, trust)) };
        let silent = Progress::default();
        let Problem { upper, seed, index, .. } = *self.problem;
        let model = Problem::bare(&make, upper, (seed, index), true, &silent);
        let settings = Settings { refactorisations: DESCENT, tolerance: DESCENT_TOLERANCE, ..*self.settings };
        let Outcome { phi, error, counts, .. } = gauss_newton::descend(&model, &settings, from)?;
        Ok((Place { phi, error }, counts.evaluations))
    }

    /// When V is full, leaves in it what the model knows of a place: displacements and derivatives.
    fn make_room(&mut self, place: &Place) -> Result<()> {
        let (cases, groups) = (self.basis.target().weights.len(), place.phi.len());
        if self.basis.rank() + cases * (1 + groups) <= capacity(cases, groups) {
            return Ok(());
        }
        let derivatives = self.model_derivatives(&place.phi)?;
        let mut model = Walker::new(&self.basis, None);
        model.error(&place.phi)?;
        let displacement = model.displacement();
        self.basis.clear();
        self.basis.enrich(&displacement);
        self.basis.enrich(&derivatives);
        Ok(())
    }

    /// True when this is lower than all places where starts have ended.
    fn is_lower(&self, candidate: &Place) -> bool {
        self.ended.iter().all(|(place, _)| candidate.error < (1.0 - SMALLEST_PROMISE) * place.error)
    }

    /// The best place, solved to the full tolerance.
    fn finish(mut self, failure: Option<Error>) -> Result<Outcome> {
        let best = self.ended.iter().min_by(|a, b| a.0.error.total_cmp(&b.0.error)).cloned();
        let Some((place, stop)) = best else {
            return Err(failure.unwrap_or(Error::Interrupted));
        };
        let mut phi = place.phi;
        self.exact.error_within(&phi, 0.0)?;
        let error = self.exact.fit_scale(&mut phi);
        let counts = Counts { surrogate_evaluations: self.model_evaluations, ..self.exact.counts() };
        Ok(Outcome { phi, error, stop, counts, trace: self.trace, agreement: None })
    }
}
