//! The numbers of a factorisation, and sweeps over them.

use std::sync::Arc;

use nalgebra_sparse::CsrMatrix;

use super::refinement::CHECKED_AT_ONCE;
use super::symbolic::Symbolic;
use crate::error::{Error, Result};
use crate::sparse::multifrontal::{self, Workspace};
use crate::sparse::sweep::{COLUMNS_AT_ONCE, Sweep};

/// One worker's factor: values of A, values of L, workspace.
pub struct Factor {
    pub(super) symbolic: Arc<Symbolic>,
    pub(super) lower: Vec<f64>,
    pub(super) factor: Vec<f64>,
    pub(super) columns: Vec<f64>,
    pub(super) right: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) scale: Vec<f64>,
    /// Solutions, residuals and scales of columns that are checked together, those of an unknown side by side.
    pub(super) beside: [Vec<f64>; 3],
    work: Workspace<f64>,
    pub(super) sweep: Sweep<f64>,
}

impl Factor {
    /// Allocates everything that factorisations and solves on this pattern need.
    pub fn new(symbolic: Arc<Symbolic>) -> Self {
        let n = symbolic.len();
        Self {
            lower: vec![0.0; symbolic.lower_rows().len()],
            factor: vec![0.0; symbolic.factor_entries()],
            columns: vec![0.0; n * COLUMNS_AT_ONCE],
            right: vec![0.0; n],
            residual: vec![0.0; n],
            scale: vec![0.0; n],
            beside: std::array::from_fn(|_| vec![0.0; n * CHECKED_AT_ONCE]),
            work: Workspace::new(symbolic.plan()),
            sweep: Sweep::new(symbolic.plan(), symbolic.len()),
            symbolic,
        }
    }

    /// The shared analysis.
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }

    /// The values of the permuted lower triangle of A, in the order of [`Symbolic::lower_rows`]: write here, then
    /// [`Factor::refactor`].
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.lower
    }

    /// Takes the values of a CSR matrix on the analysed pattern.
    ///
    /// # Panics
    /// When the matrix has another number of entries than the pattern.
    pub fn load(&mut self, matrix: &CsrMatrix<f64>) {
        let values = matrix.values();
        for (to, &from) in self.lower.iter_mut().zip(self.symbolic.source()) {
            *to = values[from];
        }
    }

    /// Factors the matrix whose values were written.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] with the unknown whose pivot is not positive.
    pub fn refactor(&mut self) -> Result<()> {
        let s = &*self.symbolic;
        multifrontal::factorise(s.plan(), &self.lower, s.lower_starts(), &mut self.factor, &mut self.work)
            .map_err(|column| Error::NotPositiveDefinite { dof: s.order()[column] as usize })
    }

    /// The unknown with the smallest pivot relative to its diagonal entry, and that ratio L_jj^2 / A_jj in (0, 1]. The
    /// ratio is at least 1 / cond(A); at rounding (about 1e-16) the matrix is singular and the unknown is loose.
    pub fn weakest_pivot(&self) -> (usize, f64) {
        let s = &*self.symbolic;
        let mut weakest = (0, f64::INFINITY);
        for front in &s.plan().fronts {
            for (offset, j) in (front.first..front.first + front.width).enumerate() {
                let pivot = self.factor[front.values + offset * (front.height() + 1)];
                let ratio = pivot.powi(2) / self.lower[s.lower_starts()[j] as usize];
                // a pivot that is not a number is weaker than any
                if ratio.is_nan() || ratio < weakest.1 {
                    weakest = (s.order()[j] as usize, ratio);
                }
            }
        }
        weakest
    }

    /// X = L^-1 P B for whole columns, with P the elimination order: a column x has the squared length x.x = b^T A^-1 b.
    /// In elimination order, without a check.
    ///
    /// # Panics
    /// As [`Factor::solve`].
    pub fn half_solve(&mut self, b: &[f64], x: &mut [f64]) {
        let n = self.symbolic.len();
        assert_eq!(b.len(), x.len(), "as many solutions as right-hand sides");
        assert_eq!(b.len() % n.max(1), 0, "whole columns");
        for (b, x) in b.chunks(n * COLUMNS_AT_ONCE).zip(x.chunks_mut(n * COLUMNS_AT_ONCE)) {
            for (to, b) in x.chunks_exact_mut(n).zip(b.chunks_exact(n)) {
                permute(self.symbolic.order(), b, to);
            }
            self.sweep.half_solve(self.symbolic.plan(), self.symbolic.supernodes(), &self.factor, x);
        }
    }

    /// z = (L L^T)^-1 r for whole columns in elimination order with the last factor, without a check: a preconditioner.
    ///
    /// # Panics
    /// When `r` is not a whole number of columns, or `z` has another length.
    pub fn precondition(&mut self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
        for columns in z.chunks_mut(self.symbolic.len() * COLUMNS_AT_ONCE) {
            self.sweep.solve(self.symbolic.plan(), self.symbolic.supernodes(), &self.factor, columns);
        }
    }
}

/// Brings a vector from the order of the unknowns to elimination order.
pub(super) fn permute(order: &[u32], from: &[f64], to: &mut [f64]) {
    for (to, &i) in to.iter_mut().zip(order) {
        *to = from[i as usize];
    }
}
