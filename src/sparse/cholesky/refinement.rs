//! A solve that is checked: backward error, and one step of iterative refinement.

use super::factor::{Factor, permute};
use super::{ACCEPTED, REFINE_ABOVE};
use crate::error::{Error, Result};
use crate::sparse::backward_error::{self, Lower};
use crate::sparse::sweep::COLUMNS_AT_ONCE;

/// Right-hand sides that are checked together: their numbers fill the widest registers.
pub(super) const CHECKED_AT_ONCE: usize = 8;

impl Factor {
    /// Solves A X = B for `b.len() / n` columns (column-major, n x m) with the last factor, and refines each column once
    /// where needed. Returns the largest componentwise backward error.
    ///
    /// # Errors
    /// [`Error::Inaccurate`] when a column stays above [`ACCEPTED`].
    ///
    /// # Panics
    /// When `b` is not a whole number of columns, or `x` has another length.
    pub fn solve(&mut self, b: &[f64], x: &mut [f64]) -> Result<f64> {
        self.solve_and_check(b, x, None)
    }

    /// The same where a relative residual |b - A x| / |b| of `tolerance` is enough: where all columns that are checked together
    /// have it, they are neither refined nor measured further, which for many columns takes half the time.
    ///
    /// # Errors
    /// As [`Factor::solve`].
    ///
    /// # Panics
    /// As [`Factor::solve`].
    pub fn solve_within(&mut self, b: &[f64], x: &mut [f64], tolerance: f64) -> Result<()> {
        self.solve_and_check(b, x, Some(tolerance)).map(|_| ())
    }

    fn solve_and_check(&mut self, b: &[f64], x: &mut [f64], tolerance: Option<f64>) -> Result<f64> {
        let n = self.symbolic.len();
        assert_eq!(b.len(), x.len(), "as many solutions as right-hand sides");
        assert_eq!(b.len() % n.max(1), 0, "whole columns");
        let mut worst = 0.0_f64;
        for (b, x) in b.chunks(n * COLUMNS_AT_ONCE).zip(x.chunks_mut(n * COLUMNS_AT_ONCE)) {
            for (to, b) in self.columns.chunks_exact_mut(n).zip(b.chunks_exact(n)) {
                permute(self.symbolic.order(), b, to);
            }
            let columns = &mut self.columns[..b.len()];
            self.sweep.solve(self.symbolic.plan(), self.symbolic.supernodes(), &self.factor, columns);
            let (b, x) = (b.chunks(n * CHECKED_AT_ONCE), x.chunks_mut(n * CHECKED_AT_ONCE));
            for (first, (b, x)) in (0..).step_by(CHECKED_AT_ONCE).zip(b.zip(x)) {
                let error = if b.len() == n {
                    self.check::<1>(first, b, x, tolerance)
                } else {
                    self.check::<CHECKED_AT_ONCE>(first, b, x, tolerance)
                };
                worst = worst.max(error?);
            }
        }
        Ok(worst)
    }

    /// Checks at most K of the columns that were solved for, from number `first` on, refines them where needed and writes
    /// them to `x`. Returns the largest backward error of those that were measured.
    fn check<const K: usize>(&mut self, first: usize, b: &[f64], x: &mut [f64], tolerance: Option<f64>) -> Result<f64> {
        let n = self.symbolic.len();
        let enough = tolerance.is_some_and(|tolerance| {
            let (lower, [solutions, residuals, _]) = self.side_by_side::<K>(first, b);
            let ratios = backward_error::relative_residuals(lower, solutions, residuals);
            ratios[..b.len() / n].iter().all(|ratio| *ratio <= tolerance)
        });
        let mut errors = [0.0; K];
        if !enough {
            let (lower, [solutions, residuals, scales]) = self.side_by_side::<K>(first, b);
            errors = backward_error::residuals(lower, solutions, residuals, scales);
        }
        let mut worst = 0.0_f64;
        for (c, (b, x)) in b.chunks_exact(n).zip(x.chunks_exact_mut(n)).enumerate() {
            if errors[c] > REFINE_ABOVE && errors[c].is_finite() {
                errors[c] = self.refine::<K>(first + c, b);
            }
            if errors[c] > ACCEPTED {
                return Err(Error::Inaccurate { backward_error: errors[c], limit: ACCEPTED });
            }
            worst = worst.max(errors[c]);
            let solution = &self.columns[(first + c) * n..][..n];
            for (&i, &value) in self.symbolic.order().iter().zip(solution) {
                x[i as usize] = value;
            }
        }
        Ok(worst)
    }

    /// The matrix; and for at most K columns, those of an unknown side by side: solutions, right-hand sides in the place of
    /// residuals, and room for scales. Columns that are missing are zero.
    fn side_by_side<const K: usize>(&mut self, first: usize, b: &[f64]) -> (Lower<'_>, [&mut [[f64; K]]; 3]) {
        let n = self.symbolic.len();
        let [solutions, residuals, scales] = self.beside.each_mut().map(|rows| &mut rows.as_chunks_mut::<K>().0[..n]);
        if b.len() < n * K {
            solutions.fill([0.0; K]);
            residuals.fill([0.0; K]);
        }
        for (c, (column, b)) in self.columns[first * n..].chunks_exact(n).zip(b.chunks_exact(n)).enumerate() {
            for (row, value) in solutions.iter_mut().zip(column) {
                row[c] = *value;
            }
            for (row, &i) in residuals.iter_mut().zip(self.symbolic.order()) {
                row[c] = b[i as usize];
            }
        }
        let (starts, rows) = (self.symbolic.lower_starts(), self.symbolic.lower_rows());
        (Lower { starts, rows, values: &self.lower }, [solutions, residuals, scales])
    }

    /// One step of iterative refinement of one of the K columns whose residuals are at hand; its backward error then.
    fn refine<const K: usize>(&mut self, column: usize, b: &[f64]) -> f64 {
        let n = self.symbolic.len();
        let solution = &mut self.columns[column * n..(column + 1) * n];
        let residual = self.beside[1][column % K..].iter().step_by(K);
        self.residual.iter_mut().zip(residual).for_each(|(to, from)| *to = *from);
        self.sweep.solve(self.symbolic.plan(), self.symbolic.supernodes(), &self.factor, &mut self.residual);
        for (value, correction) in solution.iter_mut().zip(&self.residual) {
            *value += correction;
        }
        permute(self.symbolic.order(), b, &mut self.right);
        let (starts, rows) = (self.symbolic.lower_starts(), self.symbolic.lower_rows());
        let lower = Lower { starts, rows, values: &self.lower };
        backward_error::residual(lower, solution, &self.right, &mut self.residual, &mut self.scale)
    }
}
