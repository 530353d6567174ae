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
//! 2. The place where it ends is solved on the mesh. V y is the guess, so few iterations are left to do.
//! 3. If the error is lower there, the place is taken and its derivatives join V; otherwise its displacements alone do, and
//!    the model will not err there again.
//!
//! Rounds end when the model, right at the best place to first order, promises less than the tolerance. All starts share V: a later one ends
//! when it comes down where an earlier one has been. Displacements on the way are solved to [`LOOSE`], derivatives to [`COLUMNS`]
//! (V needs to contain the right directions, not exact numbers), the answer to the full tolerance. Of the iteration counts
//! of Gauss-Newton with solves to the full tolerance about a tenth is left.

use crate::calibration::objective::{Counts, Objective, Problem};
use crate::calibration::objectives::displacement::Displacement;
use crate::calibration::optimiser::{Outcome, Settings, Stop, TracePoint};
use crate::calibration::optimisers::gauss_newton;
use crate::calibration::surrogate::galerkin::Galerkin;
use crate::calibration::surrogate::walker::{Trust, Walker};
use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};

/// Residual |f - K u| / |f| of displacements on the way.
const LOOSE: f64 = 1e-7;

/// The same for derivatives.
const COLUMNS: f64 = 1e-4;

/// A promise of the model below this fraction of the error is in the noise of loose solves.
const SMALLEST_PROMISE: f64 = 1e-5;

/// First, smallest and largest radius of the trust region in the logarithm of phi.
const RADIUS: f64 = 1.5;
const SMALLEST_RADIUS: f64 = 0.5;
const LARGEST_RADIUS: f64 = 4.0;

/// Columns of V: at least this, or what three places with their derivatives bring.
const CAPACITY: usize = 48;

/// A later start whose model ends this near (relative) a place where an earlier start ended goes no further; stiffness below
/// this fraction of the largest is no difference.
const KNOWN: f64 = 1e-2;
const NOTHING: f64 = 1e-2;

/// Errors of the model that one descent may ask for.
const DESCENT: u64 = 500;

/// A descent on the model ends when a step lowers the error by less than this fraction.
const DESCENT_TOLERANCE: f64 = 1e-8;

/// True when the problem is one for this file: its objective is the displacement, and a worker uses all threads itself.
pub fn serves(problem: &Problem) -> bool {
    !problem.side_by_side && problem.displacement.is_some()
}

/// Runs all starts, one after the other.
///
/// # Errors
/// When no start has a positive definite K, or on interruption.
///
/// # Panics
/// When the problem is not one of displacements.
pub fn run(problem: &Problem, settings: &Settings) -> Result<Outcome> {
    let worker = problem.displacement.expect("the caller has asked whether this serves");
    let mut search = Search::new(problem, settings, worker());
    let mut failure = None;
    for start in 0..settings.starts_for(problem.upper.len()) {
        match search.descend_from(&gauss_newton::start(problem, start)) {
            Ok(()) => {}
            Err(error @ (Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. })) => failure = Some(error),
            Err(other) => return Err(other),
        }
    }
    search.finish(failure)
}

/// A place and the error there, percent.
#[derive(Clone)]
struct Place {
    phi: Vec<f64>,
    error: f64,
}

struct Search<'s, 'a> {
    problem: &'s Problem<'a>,
    settings: &'s Settings,
    clock: Stopwatch,
    exact: Displacement<'a>,
    /// Where `exact` has its displacements.
    at: Vec<f64>,
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
            problem,
            settings,
            ended: vec![],
            model_evaluations: 0,
            trace: vec![],
        }
    }

    /// Rounds from one start until it has ended.
    fn descend_from(&mut self, start: &[f64]) -> Result<()> {
        let spent = self.exact.counts().evaluations;
        let mut best = self.solve(start, LOOSE)?;
        let mut radius = RADIUS;
        // a later start gets derivatives once it has come down: most end where an earlier one did
        let mut taught = self.ended.is_empty();
        if taught {
            self.teach(&best)?;
        }
        let stop = loop {
            self.problem.progress.check()?;
            let candidate = self.descend(&best, &Trust::new(&best.phi, radius))?;
            let promise = best.error - candidate.error;
            if promise <= self.settings.tolerance.max(SMALLEST_PROMISE) * best.error {
                if taught {
                    break Stop::Converged;
                }
                self.teach(&best)?;
                taught = true;
                continue;
            }
            if self.is_known(&candidate) {
                return Ok(());
            }
            if self.exact.counts().evaluations - spent >= self.settings.refactorisations + self.settings.polish {
                break Stop::RefactorisationLimit;
            }
            let gain = best.error - self.try_at(&candidate.phi)?.map_or(f64::INFINITY, |place| {
                let error = place.error;
                if error < best.error {
                    (best, taught) = (place, false);
                }
                error
            });
            if !taught {
                self.teach(&best)?;
                taught = true;
            }
            radius = match gain / promise {
                ratio if ratio > 0.5 => (2.0 * radius).min(LARGEST_RADIUS),
                ratio if ratio > 0.1 => radius,
                _ => (0.5 * radius).max(SMALLEST_RADIUS),
            };
        };
        self.ended.push((best, stop));
        Ok(())
    }

    /// Solves on the mesh, beginning with what the model says; the displacements join V.
    fn solve(&mut self, phi: &[f64], tolerance: f64) -> Result<Place> {
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
        self.exact.error_within(&phi, tolerance)?;
        let error = self.exact.fit_scale(&mut phi);
        self.basis.enrich(self.exact.displacement());
        self.at.clone_from(&phi);
        let least = self.trace.last().map_or(f64::INFINITY, |point| point.error);
        let refactorisations = self.exact.counts().refactorisations;
        self.trace.push(TracePoint { seconds: self.clock.seconds(), refactorisations, error: error.min(least) });
        Ok(Place { phi, error })
    }

    /// [`Search::solve`] where K may not be positive definite: none there.
    fn try_at(&mut self, phi: &[f64]) -> Result<Option<Place>> {
        match self.solve(phi, LOOSE) {
            Ok(place) => Ok(Some(place)),
            Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => Ok(None),
            Err(other) => Err(other),
        }
    }

    /// The derivatives at a place join V.
    fn teach(&mut self, place: &Place) -> Result<()> {
        if self.at != place.phi {
            self.solve(&place.phi, LOOSE)?;
        }
        let mut derivatives = self.model_derivatives(place)?;
        self.exact.derivatives(&mut derivatives, COLUMNS)?;
        self.basis.enrich(&derivatives);
        Ok(())
    }

    /// K^-1 K_a u as the model has it (cases x groups x n).
    fn model_derivatives(&self, place: &Place) -> Result<Vec<f64>> {
        let (r, m, target) = (self.basis.rank(), place.phi.len(), self.basis.target());
        let n = target.operator.unknowns();
        let mut model = Walker::new(&self.basis, None);
        model.error(&place.phi)?;
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

    /// The bottom of the model.
    fn descend(&mut self, from: &Place, trust: &Trust) -> Result<Place> {
        let columns = self.basis.target().weights.len() * (1 + from.phi.len());
        if self.basis.rank() + columns > CAPACITY.max(3 * columns) {
            self.forget(from)?;
        }
        let make = || -> Box<dyn Objective + '_> { Box::new(Walker::new(&self.basis, Some(trust))) };
        let silent = Progress::default();
        let Problem { upper, seed, index, .. } = *self.problem;
        let model =
            Problem { make: &make, displacement: None, upper, seed, index, side_by_side: true, progress: &silent };
        let settings = Settings { refactorisations: DESCENT, tolerance: DESCENT_TOLERANCE, ..*self.settings };
        let Outcome { phi, error, counts, .. } = gauss_newton::descend(&model, &settings, &from.phi)?;
        self.model_evaluations += counts.evaluations;
        Ok(Place { phi, error })
    }

    /// Leaves in V what the model knows of a place: displacements and derivatives.
    fn forget(&mut self, place: &Place) -> Result<()> {
        let derivatives = self.model_derivatives(place)?;
        let mut model = Walker::new(&self.basis, None);
        model.error(&place.phi)?;
        let displacement = model.displacement();
        self.basis.clear();
        self.basis.enrich(&displacement);
        self.basis.enrich(&derivatives);
        Ok(())
    }

    /// True when an earlier start has ended here.
    fn is_known(&self, candidate: &Place) -> bool {
        self.ended.iter().any(|(place, _)| {
            let largest = place.phi.iter().fold(0.0, |most: f64, p| most.max(*p));
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= KNOWN * (b + NOTHING * largest);
            (candidate.error - place.error).abs() <= KNOWN * place.error
                && candidate.phi.iter().zip(&place.phi).all(near)
        })
    }

    /// The best place, solved to the full tolerance.
    fn finish(mut self, failure: Option<Error>) -> Result<Outcome> {
        let best = self.ended.iter().min_by(|a, b| a.0.error.total_cmp(&b.0.error)).cloned();
        let Some((place, stop)) = best else {
            return Err(failure.unwrap_or(Error::Interrupted));
        };
        let Place { phi, error } = self.solve(&place.phi, 0.0)?;
        let counts = Counts { surrogate_evaluations: self.model_evaluations, ..self.exact.counts() };
        Ok(Outcome { phi, error, stop, counts, trace: self.trace })
    }
}
