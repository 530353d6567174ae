//! May a factor be trusted? Zero modes where pivots vanish, and how sure its solutions are.

use super::factor::{Factor, permute};
use crate::error::{Error, Result};
use crate::sparse::backward_error::{self, Lower};
use crate::sparse::condition::{self, Accuracy, Inverse, Solved};
use crate::sparse::zero_modes::{ZeroModes, zero_modes};

/// A pivot below this part of its diagonal entry makes it worth to count zero modes: rounding alone can lift the pivot of a
/// singular matrix to about 1e-13, and a body that is held may go down to 1 / cond.
const SUSPECT: f64 = 1e-10;

impl Factor {
    /// Factors the matrix whose values were written, unless it is singular: then its zero modes, counted.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] for a matrix that has a negative pivot and no zero mode.
    pub fn refactor_or_count(&mut self) -> Result<Option<ZeroModes>> {
        let outcome = self.refactor();
        let sound = outcome.is_ok() && self.weakest_pivot().1 >= SUSPECT;
        if sound || self.symbolic.is_empty() {
            return Ok(None);
        }
        if let Err(error @ Error::Input { .. }) = outcome {
            return Err(error);
        }
        let modes = zero_modes(&self.symbolic, &self.lower);
        match modes.count {
            0 => outcome.map(|()| None),
            _ => Ok(Some(modes)),
        }
    }

    /// How sure the solutions `x` to the right-hand sides `b` (whole columns) are, with the last factor: the worst of all
    /// columns. Takes about six solves, and one or two for every further column.
    ///
    /// # Panics
    /// When `b` is not a whole number of columns, or `x` has another length.
    pub fn accuracy(&mut self, b: &[f64], x: &[f64]) -> Accuracy {
        let n = self.symbolic.len();
        assert!(b.len() == x.len() && b.len().is_multiple_of(n.max(1)), "whole columns, a solution each");
        let (norm, longest_row) = self.row_sums();
        let mut worst = Accuracy { backward_error: 0.0, condition: 0.0, forward_error: 0.0 };
        let (mut solution, mut residual, mut scale) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut inverse = Inverse::default();
        for (b, x) in b.chunks_exact(n.max(1)).zip(x.chunks_exact(n.max(1))) {
            let lower =
                Lower { starts: self.symbolic.lower_starts(), rows: self.symbolic.lower_rows(), values: &self.lower };
            permute(self.symbolic.order(), b, &mut self.right);
            permute(self.symbolic.order(), x, &mut solution);
            let backward_error = backward_error::residual(lower, &solution, &self.right, &mut residual, &mut scale);
            let mut solve = |b: &[f64], x: &mut [f64]| {
                self.precondition(b, x);
                Ok(())
            };
            let solved =
                Solved { norm, longest_row, backward_error, residual: &residual, scale: &scale, solution: &solution };
            let found = condition::accuracy(&solved, &mut inverse, &mut solve).expect("solves that cannot fail");
            worst = worst.worse(found);
        }
        worst
    }

    /// The largest sum of the sizes in a row, and the entries of the longest row.
    fn row_sums(&self) -> (f64, usize) {
        let n = self.symbolic.len();
        let (starts, rows) = (self.symbolic.lower_starts(), self.symbolic.lower_rows());
        let (mut sums, mut lengths) = (vec![0.0_f64; n], vec![0_usize; n]);
        for j in 0..n {
            let column = starts[j] as usize..starts[j + 1] as usize;
            for (&i, value) in rows[column.clone()].iter().zip(&self.lower[column]) {
                let (i, size) = (i as usize, value.abs());
                sums[i] += size;
                lengths[i] += 1;
                if i != j {
                    sums[j] += size;
                    lengths[j] += 1;
                }
            }
        }
        (sums.into_iter().fold(0.0, f64::max), lengths.into_iter().max().unwrap_or(0))
    }
}
