//! The answer of a linear objective in one step: bounded least squares.
//!
//! ```text
//! min |R phi - r|,   0 <= phi <= upper
//! ```
//!
//! is a convex quadratic in a box: it has one smallest value, and phi is it when no group can be moved inside the box
//! with a gain (the conditions of Karush, Kuhn and Tucker): with the gradient q = R^T (R phi - r),
//!
//! ```text
//! q_a >= 0 where phi_a = 0,   q_a <= 0 where phi_a = upper_a,   q_a = 0 between
//! ```
//!
//! The columns are scaled to length 1. [`crate::dense::LeastSquares`] finds the groups that are pressed against a bound
//! and the Newton step of the others; the step is repeated from where it led, with the gradient made from the residual
//! anew, which gives back the digits that the product R^T R loses (A. Bjorck, Linear Algebra Appl. 88, 1987). A group
//! whose column is zero, because its springs touch no free node, keeps the stiffness 0. Groups whose columns follow from
//! others have no answer of their own: that is an error which names them.

use crate::calibration::linear::Reduced;
use crate::calibration::objective::{Counts, Problem};
use crate::calibration::optimiser::{Outcome, Settings, Stop, TracePoint};
use crate::clock::Stopwatch;
use crate::dense::{LeastSquares, dot};
use crate::error::{Error, Result};

/// Newton steps after which the bounded problem is given up; two or three are usual.
const STEPS: usize = 50;

/// Steps smaller than this part of phi are rounding.
const ROUNDING: f64 = 1e-15;

/// Steps smaller than this part of phi, and no longer shrinking, are as small as they get.
const SMALL: f64 = 1e-9;

/// Solves the linear problem.
///
/// # Errors
/// [`Error::Input`] when the objective is not linear; [`Error::Inaccurate`] when the conditions are not met after many
/// steps; on interruption.
pub fn run(problem: &Problem, _settings: &Settings) -> Result<Outcome> {
    let clock = Stopwatch::start();
    problem.progress.check()?;
    let Some(reduced) = problem.linear else { return Err(not_linear("this objective")) };
    let dependent = reduced.dependent();
    if !dependent.is_empty() {
        return Err(undetermined(&dependent, reduced.groups()));
    }
    let phi = solve(reduced, problem.upper)?;
    problem.progress.advance(1);
    let error = reduced.distance(&phi);
    let counts = Counts { evaluations: 1, ..Counts::default() };
    let trace = vec![TracePoint { seconds: clock.seconds(), refactorisations: 0, error }];
    Ok(Outcome { phi, error, stop: Stop::Solved, counts, trace })
}

/// The refusal of an objective that is not linear in phi.
pub fn not_linear(objective: &str) -> Error {
    let message = format!("least_squares solves linear problems, and {objective} is not linear in the stiffness");
    let help = "choose gauss_newton, hybrid or annealing, or one of the objectives acceleration and matrix";
    Error::input("calibration.optimiser", message, help)
}

/// The refusal of groups that the equations do not tell apart.
fn undetermined(dependent: &[usize], groups: usize) -> Error {
    let some: Vec<String> = dependent.iter().take(5).map(|group| (group + 1).to_string()).collect();
    let more = if dependent.len() > 5 { ", ..." } else { "" };
    let message = format!(
        "the equations do not determine {} of {groups} groups (group {}{more}): they act as others do",
        dependent.len(),
        some.join(", ")
    );
    Error::input("calibration.objective", message, "use fewer groups, or more and different snapshots")
}

/// The minimiser in the box 0 <= phi <= upper, for columns that do not depend on each other.
///
/// # Errors
/// [`Error::Inaccurate`] when the conditions of the module page are not met.
pub fn solve(reduced: &Reduced, upper: &[f64]) -> Result<Vec<f64>> {
    let (m, rows) = (reduced.groups(), reduced.rows());
    let norms = reduced.column_norms();
    let moving: Vec<usize> = (0..m).filter(|&a| norms[a] > 0.0).collect();
    let scaled: Vec<f64> = moving
        .iter()
        .flat_map(|&a| reduced.matrix()[a * rows..(a + 1) * rows].iter().map(move |entry| (a, entry)))
        .map(|(a, entry)| entry / norms[a])
        .collect();
    let top: Vec<f64> = moving.iter().map(|&a| upper[a] * norms[a]).collect();
    let x = in_box(&scaled, reduced.right(), &top)?;
    let mut phi = vec![0.0; m];
    moving.iter().zip(x).for_each(|(&a, x)| phi[a] = (x / norms[a]).min(upper[a]));
    Ok(phi)
}

/// min |A x - r| in 0 <= x <= top; A column-major with columns of length 1.
fn in_box(matrix: &[f64], right: &[f64], top: &[f64]) -> Result<Vec<f64>> {
    let model = LeastSquares::new(matrix, right.len(), top.len());
    let undamped = vec![0.0; top.len()];
    let mut x = vec![0.0; top.len()];
    let mut least = f64::INFINITY;
    for _ in 0..STEPS {
        let residual = residual(matrix, right, &x);
        let gradient = model.transposed(&residual);
        let down: Vec<f64> = x.iter().map(|x| -x).collect();
        let up: Vec<f64> = top.iter().zip(&x).map(|(top, x)| (top - x).max(0.0)).collect();
        let Some(step) = model.minimise_in_box(&undamped, &gradient, &down, &up) else { break };
        for ((x, step), top) in x.iter_mut().zip(&step).zip(top) {
            *x = (*x + step).clamp(0.0, *top);
        }
        // steps that no longer shrink are rounding too
        let relative = dot(&step, &step).sqrt() / dot(&x, &x).sqrt().max(f64::MIN_POSITIVE);
        if relative <= ROUNDING || (relative <= SMALL && relative >= 0.5 * least) {
            return Ok(x);
        }
        least = least.min(relative);
    }
    Err(Error::Inaccurate { backward_error: least, limit: ROUNDING })
}

/// A x - r.
fn residual(matrix: &[f64], right: &[f64], x: &[f64]) -> Vec<f64> {
    let mut residual: Vec<f64> = right.iter().map(|r| -r).collect();
    for (column, x) in matrix.chunks_exact(right.len()).zip(x) {
        residual.iter_mut().zip(column).for_each(|(r, entry)| *r += entry * x);
    }
    residual
}
