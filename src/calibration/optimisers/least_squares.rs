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
//! whose column is zero keeps the stiffness 0 here. Columns that follow from others ([`Reduced::dependent`]) have no
//! answer of their own: such a problem is refused with the names of its groups before it comes here.

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
    let phi = solve(reduced, problem.upper)?;
    problem.progress.advance(1);
    let error = reduced.distance(&phi);
    let counts = Counts { evaluations: 1, ..Counts::default() };
    let trace = vec![TracePoint { seconds: clock.seconds(), refactorisations: 0, error }];
    Ok(Outcome { phi, error, stop: Stop::Solved, counts, trace, agreement: None })
}

/// The refusal of an objective that is not linear in phi.
pub fn not_linear(objective: &str) -> Error {
    let message = format!("least_squares solves linear problems, and {objective} is not linear in the stiffness");
    let help = "choose gauss_newton, hybrid or annealing, or one of the objectives acceleration and matrix";
    Error::input("calibration.optimiser", message, help)
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
    for ((&a, x), top) in moving.iter().zip(x).zip(top) {
        // a bound is met exactly, not up to the rounding of the scaling
        phi[a] = if x >= top { upper[a] } else { (x / norms[a]).min(upper[a]) };
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::linear::{OWN, Rows};
    use crate::rng::Stream;
    use proptest::prelude::*;

    /// A random problem: dense rows, some columns small, some answers outside the box.
    fn problem(stream: &mut Stream, groups: usize, rows: usize) -> (Reduced, Vec<f64>) {
        let sizes: Vec<f64> = (0..groups).map(|_| 10f64.powf(3.0 * stream.normal())).collect();
        let mut all = Rows::new(groups);
        for _ in 0..rows {
            let mut row: Vec<f64> = sizes.iter().map(|size| size * stream.normal()).collect();
            row.push(stream.normal());
            all.push(&row);
        }
        let upper = sizes.iter().map(|size| 0.3 * stream.uniform() / size).collect();
        (all.reduced(1.0, &vec![0.0; groups]), upper)
    }

    /// The smallest distance over all ways to press groups against a bound and solve for the others by elimination.
    fn by_all_active_sets(reduced: &Reduced, upper: &[f64]) -> f64 {
        let m = reduced.groups();
        let mut best = f64::INFINITY;
        for code in 0..3_usize.pow(m as u32) {
            let state = |a: usize| code / 3_usize.pow(a as u32) % 3;
            let free: Vec<usize> = (0..m).filter(|&a| state(a) == 2).collect();
            let mut phi: Vec<f64> = (0..m).map(|a| if state(a) == 1 { upper[a] } else { 0.0 }).collect();
            solve_free(reduced, &free, &mut phi);
            if phi.iter().zip(upper).all(|(p, u)| (0.0..=*u).contains(p)) {
                best = best.min(reduced.distance(&phi));
            }
        }
        best
    }

    /// Normal equations of the free columns, scaled to 1, by elimination with the rest held.
    fn solve_free(reduced: &Reduced, free: &[usize], phi: &mut [f64]) {
        let (rows, norms) = (reduced.rows(), reduced.column_norms());
        let column = |a: usize| &reduced.matrix()[a * rows..(a + 1) * rows];
        let mut image = vec![0.0; rows];
        reduced.apply(phi, &mut image);
        let rest: Vec<f64> = reduced.right().iter().zip(&image).map(|(r, i)| r - i).collect();
        let n = free.len();
        let mut system: Vec<Vec<f64>> = free
            .iter()
            .map(|&a| {
                let mut row: Vec<f64> =
                    free.iter().map(|&b| dot(column(a), column(b)) / (norms[a] * norms[b])).collect();
                row.push(dot(column(a), &rest) / norms[a]);
                row
            })
            .collect();
        for i in 0..n {
            for j in i + 1..n {
                let factor = system[j][i] / system[i][i];
                let pivot = system[i].clone();
                system[j].iter_mut().zip(&pivot).for_each(|(entry, pivot)| *entry -= factor * pivot);
            }
        }
        let mut x = vec![0.0; n];
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| system[i][j] * x[j]).sum();
            x[i] = (system[i][n] - known) / system[i][i];
        }
        free.iter().zip(x).for_each(|(&a, x)| phi[a] = x / norms[a]);
    }

    proptest! {
        #[test]
        fn no_active_set_is_better_and_the_conditions_hold(seed in 0u64..5000, m in 1usize..6, extra in 0usize..20) {
            let mut stream = Stream::new(seed, 0, 0);
            let (reduced, upper) = problem(&mut stream, m, m + 2 + extra);
            prop_assume!(reduced.dependent().is_empty());
            let phi = solve(&reduced, &upper).expect("independent columns");
            let (ours, best) = (reduced.distance(&phi), by_all_active_sets(&reduced, &upper));
            prop_assert!(ours <= best * (1.0 + 1e-9), "{ours} {best}");
            let mut image = vec![0.0; reduced.rows()];
            reduced.apply(&phi, &mut image);
            let residual: Vec<f64> = image.iter().zip(reduced.right()).map(|(i, r)| i - r).collect();
            let size = dot(reduced.right(), reduced.right()).sqrt();
            for (a, norm) in reduced.column_norms().iter().enumerate() {
                let column = &reduced.matrix()[a * reduced.rows()..(a + 1) * reduced.rows()];
                let slope = dot(column, &residual) / norm;
                prop_assert!((0.0..=upper[a]).contains(&phi[a]));
                prop_assert!(phi[a] == 0.0 || slope <= 1e-11 * size, "{a}: {slope:e}");
                prop_assert!(phi[a] == upper[a] || slope >= -1e-11 * size, "{a}: {slope:e}");
            }
        }
    }

    #[test]
    fn empty_columns_stay_at_zero() {
        let mut stream = Stream::new(3, 0, 0);
        let mut rows = Rows::new(3);
        for _ in 0..12 {
            rows.push(&[stream.normal(), 0.0, stream.normal(), stream.normal()]);
        }
        assert_eq!(solve(&rows.reduced(1.0, &[0.0; 3]), &[1.0; 3]).expect("two columns")[1], 0.0);
    }

    /// Down to the tolerance of the rank the answer is worth what the columns are worth: rounding over the part of its own.
    #[test]
    fn columns_that_are_just_told_apart_have_an_accurate_answer() {
        for part in [1e-3, 1e-5, 1e-6, 2.0 * OWN] {
            let mut stream = Stream::new(4, 0, 0);
            let mut rows = Rows::new(3);
            for _ in 0..40 {
                let [a, b, own] = [stream.normal(), stream.normal(), stream.normal()];
                let twin = a + part * own;
                rows.push(&[a, b, twin, 0.25 * a + 0.5 * b + 0.5 * twin]);
            }
            let reduced = rows.reduced(1.0, &[0.0; 3]);
            assert!(reduced.dependent().is_empty(), "{part:e}");
            let phi = solve(&reduced, &[1.0; 3]).expect("told apart");
            let wrong = phi.iter().zip([0.25, 0.5, 0.5]).map(|(p, t)| (p - t).abs()).fold(0.0, f64::max);
            println!("own part {part:e}: {wrong:e}");
            assert!(wrong <= 1e-14 / part, "own part {part:e}: {phi:?}");
        }
    }
}
