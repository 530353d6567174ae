//! Gauss-Newton for many groups: one group a spring, if need be.
//!
//! The Jacobian of m groups takes m solves and m columns. With thousands of groups neither is needed: a step of
//! conjugate gradients asks only for products with J and J^T, and each is one solve, since K is linear in phi:
//!
//! ```text
//! J d   = -w K^-1 (sum_a d_a K_a u)                                                       one solve for each load case
//! J^T v = -w z^T K_a u = -w sum_{s in a} (sqrt(w_s) b_s . z)(sqrt(w_s) b_s . u),   K z = v:   the adjoint, one solve
//! ```
//!
//! Steps are taken in t_a = sqrt(v_a) ln phi_a with v_a the share of group a in the springs, so that |t| is the root mean
//! square over the springs of the change of ln phi, and no stiffness is lost at 0. The model of the squared error,
//!
//! ```text
//! m(t) = |r + J t|^2 + rho^2 |q + P t|^2,      q and P: the rows of the prior ([`crate::calibration::prior`])
//! ```
//!
//! is made small inside |t| <= radius by conjugate gradients that stop at the edge (T. Steihaug, SIAM J. Numer. Anal. 20,
//! 1983). They see the well-determined directions first and leave the free ones alone, so that few iterations are
//! themselves a regularisation. Groups at their upper bound that would go beyond rest. One start: every group at the
//! common value of the profile. A cube of 6^3 control points (1,940 groups) took 40 s a start with the whole Jacobian.

use crate::calibration::objective::{Objective, Problem};
use crate::calibration::objectives::displacement::Displacement;
use crate::calibration::optimiser::{Outcome, Settings, Stop, TracePoint};
use crate::calibration::prior::Prior;
use crate::clock::Stopwatch;
use crate::error::{Error, Result};
use crate::sparse::vectors::{add, dot, norm};
use crate::springs::members::Members;

/// Groups from which on the columns of the Jacobian cost more than the products.
const MANY: usize = 128;

/// Fraction of the smallest bound where the start begins.
const START: f64 = 0.1;

/// First, smallest and largest radius: root mean square of the change of ln phi.
const RADIUS: f64 = 0.5;
const SMALLEST_RADIUS: f64 = 1e-4;
const LARGEST_RADIUS: f64 = 4.0;

/// Most iterations of conjugate gradients for one step, and the part of the gradient that may be left.
const ITERATIONS: usize = 60;
const LEFT: f64 = 1e-2;

/// A promise of the model below this fraction of the error ends the search.
const SMALLEST_PROMISE: f64 = 1e-4;

/// True for so many groups that this file is the better way.
pub fn serves(groups: usize) -> bool {
    groups >= MANY
}

/// A worker, when the problem is one for this file: displacements with many groups, or with a prior, which is at home in
/// the logarithm.
pub fn worker<'a>(problem: &Problem<'a>) -> Option<Displacement<'a>> {
    let make = problem.displacement?;
    (problem.prior.is_some() || serves(problem.upper.len())).then(make)
}

/// Goes down from the common value.
///
/// # Errors
/// When K is not positive definite there, or on interruption.
pub fn run<'a>(problem: &Problem<'a>, settings: &Settings, worker: Displacement<'a>) -> Result<Outcome> {
    let clock = Stopwatch::start();
    let mut search = Search::new(problem, worker)?;
    let mut radius = RADIUS;
    let mut trace = vec![search.point(&clock)];
    let limit = settings.refactorisations + settings.polish;
    let promise = settings.tolerance.max(SMALLEST_PROMISE);
    let stop = loop {
        problem.progress.check()?;
        if search.error < 1e-12 {
            break Stop::Converged;
        }
        let gradient = search.gradient()?;
        let before = search.error;
        let stop = loop {
            if search.worker.counts().evaluations >= limit {
                break Some(Stop::RefactorisationLimit);
            }
            let (step, promised) = search.step(&gradient, radius)?;
            if promised <= 2.0 * promise * before * before {
                break Some(Stop::NoPromise);
            }
            problem.progress.check()?;
            problem.progress.advance(1);
            let gained = search.try_step(&step)?;
            let ratio = gained / promised;
            radius = match ratio {
                ratio if ratio > 0.75 => (2.0 * radius).min(LARGEST_RADIUS),
                ratio if ratio > 0.25 => radius,
                _ => 0.25 * norm(&step).min(radius),
            };
            if gained > 0.0 {
                break None;
            }
            if radius < SMALLEST_RADIUS {
                break Some(Stop::NoDescent);
            }
        };
        trace.push(search.point(&clock));
        if let Some(stop) = stop {
            break stop;
        }
    };
    Ok(Outcome { counts: search.worker.counts(), phi: search.phi, error: search.error, stop, trace, agreement: None })
}

/// The search and the place it has reached.
struct Search<'p, 'a> {
    worker: Displacement<'a>,
    members: Members,
    prior: Option<&'p Prior>,
    upper: &'p [f64],
    /// sqrt(v_a).
    roots: Vec<f64>,
    phi: Vec<f64>,
    /// With the prior, percent.
    error: f64,
}

impl<'p, 'a> Search<'p, 'a> {
    fn new(problem: &'p Problem<'a>, mut worker: Displacement<'a>) -> Result<Self> {
        let members = worker.target().operator.members().into_owned();
        let springs = members.len().max(1) as f64;
        let roots = (0..members.groups()).map(|a| (members.group(a).len() as f64 / springs).sqrt()).collect();
        let smallest = problem.upper.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        let mut phi = vec![START * smallest; problem.upper.len()];
        worker.error(&phi)?;
        worker.fit_scale(&mut phi);
        // once more at the place itself: products with J need its very factor
        let error = worker.error(&phi)?;
        let error = problem.prior.map_or(error, |prior| prior.with(error, &phi));
        Ok(Self { worker, members, prior: problem.prior, upper: problem.upper, roots, phi, error })
    }

    fn point(&self, clock: &Stopwatch) -> TracePoint {
        let refactorisations = self.worker.counts().refactorisations;
        TracePoint { seconds: clock.seconds(), refactorisations, error: self.error }
    }

    /// Half the slope of the squared error in t; zero where a bound holds a group that would go beyond it.
    fn gradient(&mut self) -> Result<Vec<f64>> {
        let residual = self.worker.residual();
        let mut gradient = self.transposed(&residual)?;
        if let Some(prior) = self.prior {
            add(prior.strength(), &prior.rows(&self.phi), &mut gradient);
        }
        for ((g, phi), upper) in gradient.iter_mut().zip(&self.phi).zip(self.upper) {
            if *g < 0.0 && *phi >= upper * (1.0 - 1e-12) {
                *g = 0.0;
            }
        }
        Ok(gradient)
    }

    /// J t: what the residual becomes to first order.
    fn forward(&mut self, t: &[f64]) -> Result<Vec<f64>> {
        let change: Vec<f64> =
            t.iter().zip(&self.roots).zip(&self.phi).map(|((t, root), phi)| t / root * phi).collect();
        self.worker.along(&self.members, &change)
    }

    /// J^T v.
    fn transposed(&mut self, v: &[f64]) -> Result<Vec<f64>> {
        let mut slopes = self.worker.adjoint(&self.members, v)?;
        for ((slope, root), phi) in slopes.iter_mut().zip(&self.roots).zip(&self.phi) {
            *slope *= phi / root;
        }
        Ok(slopes)
    }

    /// The product of t with the second derivatives of the model, halved, and t times that.
    fn curve(&mut self, t: &[f64], held: &[bool]) -> Result<(Vec<f64>, f64)> {
        let image = self.forward(t)?;
        let mut product = self.transposed(&image)?;
        let mut square = dot(&image, &image);
        if let Some(prior) = self.prior {
            let along = dot(&self.roots, t);
            let rho = prior.strength() * prior.strength();
            let parts = product.iter_mut().zip(t).zip(&self.roots);
            parts.for_each(|((p, t), root)| *p += rho * (t - root * along));
            square += rho * (dot(t, t) - along * along);
        }
        product.iter_mut().zip(held).filter(|(_, held)| **held).for_each(|(p, _)| *p = 0.0);
        Ok((product, square))
    }

    /// The step inside the radius and the gain in squared error that the model promises.
    fn step(&mut self, gradient: &[f64], radius: f64) -> Result<(Vec<f64>, f64)> {
        let held: Vec<bool> = gradient.iter().map(|g| *g == 0.0).collect();
        let mut step = vec![0.0; gradient.len()];
        let mut rest: Vec<f64> = gradient.iter().map(|g| -g).collect();
        let mut direction = rest.clone();
        let (mut promised, mut square) = (0.0, dot(&rest, &rest));
        let enough = LEFT * LEFT * square;
        for _ in 0..ITERATIONS {
            if square <= enough || square == 0.0 {
                break;
            }
            let (product, curvature) = self.curve(&direction, &held)?;
            let whole = if curvature > 0.0 { square / curvature } else { f64::INFINITY };
            let length = whole.min(to_the_edge(&step, &direction, radius));
            // m falls by 2 length (rest . direction) - length^2 curvature, and rest . direction is the square of the rest
            promised += 2.0 * length * square - length * length * curvature;
            add(length, &direction, &mut step);
            if length < whole {
                break;
            }
            add(-length, &product, &mut rest);
            let next = dot(&rest, &rest);
            direction.iter_mut().zip(&rest).for_each(|(d, r)| *d = r + next / square * *d);
            square = next;
        }
        Ok((step, promised))
    }

    /// Takes a step if it lowers the error; what it gained in squared error.
    fn try_step(&mut self, step: &[f64]) -> Result<f64> {
        let moved = |a: usize| (self.phi[a] * (step[a] / self.roots[a]).exp()).min(self.upper[a]);
        let trial: Vec<f64> = (0..step.len()).map(moved).collect();
        let error = match self.worker.error(&trial) {
            Ok(error) => self.prior.map_or(error, |prior| prior.with(error, &trial)),
            Err(Error::NotPositiveDefinite { .. } | Error::Inaccurate { .. }) => f64::INFINITY,
            Err(other) => return Err(other),
        };
        let gained = self.error * self.error - error * error;
        if gained > 0.0 {
            self.phi = trial;
            self.error = error;
        } else {
            // the next, shorter step needs the factor of the place where it begins
            self.worker.error(&self.phi)?;
        }
        Ok(gained)
    }
}

/// The length c > 0 at which |t + c d| is the radius.
fn to_the_edge(t: &[f64], d: &[f64], radius: f64) -> f64 {
    let (along, square) = (dot(t, d), dot(d, d));
    let left = radius * radius - dot(t, t);
    if square == 0.0 { 0.0 } else { ((along * along + square * left.max(0.0)).sqrt() - along) / square }
}
