//! A solve that is checked: backward error, and one step of iterative refinement.

use super::factor::{Factor, permute};
use super::{ACCEPTED, REFINE_ABOVE};
use crate::error::{Error, Result};
use crate::sparse::backward_error::{self, Lower};
use crate::sparse::sweep::COLUMNS_AT_ONCE;

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
            for (column, (b, x)) in b.chunks_exact(n).zip(x.chunks_exact_mut(n)).enumerate() {
                worst = worst.max(self.finish(column, b, x)?);
            }
        }
        Ok(worst)
    }

    /// Checks one column, refines it once if needed, and writes it in the order of the unknowns.
    fn finish(&mut self, column: usize, b: &[f64], x: &mut [f64]) -> Result<f64> {
        let n = self.symbolic.len();
        let lower =
            Lower { starts: self.symbolic.lower_starts(), rows: self.symbolic.lower_rows(), values: &self.lower };
        let solution = &mut self.columns[column * n..(column + 1) * n];
        permute(self.symbolic.order(), b, &mut self.right);
        let mut error = backward_error::residual(lower, solution, &self.right, &mut self.residual, &mut self.scale);
        if error > REFINE_ABOVE && error.is_finite() {
            let (plan, supernodes) = (self.symbolic.plan(), self.symbolic.supernodes());
            self.sweep.solve(plan, supernodes, &self.factor, &mut self.residual);
            for (value, correction) in solution.iter_mut().zip(&self.residual) {
                *value += correction;
            }
            error = backward_error::residual(lower, solution, &self.right, &mut self.residual, &mut self.scale);
        }
        if error > ACCEPTED {
            return Err(Error::Inaccurate { backward_error: error, limit: ACCEPTED });
        }
        for (&i, &value) in self.symbolic.order().iter().zip(solution.iter()) {
            x[i as usize] = value;
        }
        Ok(error)
    }
}
