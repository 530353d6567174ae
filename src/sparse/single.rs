//! A Cholesky factor in single precision: half the memory and about half the time, as a preconditioner.
//!
//! A ~ D^-1 (L L^T) D^-1 with L in f32 is too rough to be an answer (about 1e-7 times the condition number), but conjugate
//! gradients in f64 with it as preconditioner need two or three iterations ([`super::cg`]). The range of f32 is guarded
//! by symmetric scaling: D = diag(d) with d_i the power of two nearest 1 / sqrt(a_ii), so that
//!
//! ```text
//! A' = D A D,     a'_ii in [1/2, 2],     |a'_ij| < sqrt(a'_ii a'_jj) <= 2     (A positive definite)
//! ```
//!
//! whatever the units and the spread of stiffness, and the scaling itself rounds nothing. This also makes rounding in
//! f32 relative to the diagonal of each unknown, not to the largest of all (A. van der Sluis, Numer. Math. 14, 1969). A
//! vector is scaled by its largest entry before it is rounded. What vanishes below the range of f32 is then 1e-38 of
//! the largest and does not matter.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::sparse::cholesky::Symbolic;
use crate::sparse::multifrontal::{self, Workspace};
use crate::sparse::sweep::{COLUMNS_AT_ONCE, Sweep};

/// One worker's factor in f32 of a scaled matrix.
pub struct SingleFactor {
    symbolic: Arc<Symbolic>,
    /// d, in elimination order.
    scaling: Vec<f64>,
    lower: Vec<f32>,
    factor: Vec<f32>,
    columns: Vec<f32>,
    work: Workspace<f32>,
    sweep: Sweep<f32>,
}

impl SingleFactor {
    /// Allocates everything that factorisations and sweeps on this pattern need.
    pub fn new(symbolic: Arc<Symbolic>) -> Self {
        let n = symbolic.len();
        Self {
            scaling: vec![1.0; n],
            lower: vec![0.0; symbolic.lower_rows().len()],
            factor: vec![0.0; symbolic.factor_entries()],
            columns: vec![0.0; n * COLUMNS_AT_ONCE],
            work: Workspace::new(symbolic.plan()),
            sweep: Sweep::new(symbolic.plan(), symbolic.len()),
            symbolic,
        }
    }

    /// Bytes of one factor on this pattern.
    pub fn bytes(symbolic: &Symbolic) -> usize {
        4 * (symbolic.factor_entries() + symbolic.lower_rows().len() + (2 + COLUMNS_AT_ONCE) * symbolic.len())
            + Workspace::<f32>::bytes(symbolic.plan())
            + Sweep::<f32>::bytes(symbolic.plan(), symbolic.len())
    }

    /// Factors the matrix whose permuted lower triangle is `values` (in the order of [`Symbolic::lower_rows`]).
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] with the unknown whose pivot is not positive in f32: A is not positive definite,
    /// or its condition number is above about 1e7 after scaling.
    ///
    /// # Panics
    /// When `values` has another length than the triangle.
    pub fn refactor(&mut self, values: &[f64]) -> Result<()> {
        assert_eq!(values.len(), self.lower.len(), "the values of the analysed triangle");
        self.scale(values)?;
        let s = &*self.symbolic;
        multifrontal::factorise(s.plan(), &self.lower, s.lower_starts(), &mut self.factor, &mut self.work)
            .map_err(|column| Error::NotPositiveDefinite { dof: s.order()[column] as usize })
    }

    /// Chooses D and writes D A D, rounded.
    fn scale(&mut self, values: &[f64]) -> Result<()> {
        let s = &*self.symbolic;
        let starts = s.lower_starts();
        for (j, d) in self.scaling.iter_mut().enumerate() {
            let diagonal = values[starts[j] as usize];
            // written so that a diagonal that is not a number is refused
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return Err(Error::NotPositiveDefinite { dof: s.order()[j] as usize });
            }
            *d = (-0.5 * diagonal.log2()).round().exp2();
        }
        for (j, &d) in self.scaling.iter().enumerate() {
            let column = starts[j] as usize..starts[j + 1] as usize;
            let entries = self.lower[column.clone()].iter_mut().zip(&values[column.clone()]);
            for ((to, &value), &i) in entries.zip(&s.lower_rows()[column]) {
                *to = (value * d * self.scaling[i as usize]) as f32;
            }
        }
        Ok(())
    }

    /// z = M r for whole columns in elimination order, with M = D (L L^T)^-1 D.
    ///
    /// # Panics
    /// When `r` is not a whole number of columns, or `z` has another length.
    pub fn precondition(&mut self, r: &[f64], z: &mut [f64]) {
        let n = self.symbolic.len();
        assert!(r.len() == z.len() && r.len().is_multiple_of(n.max(1)), "whole columns");
        for (r, z) in r.chunks(n * COLUMNS_AT_ONCE).zip(z.chunks_mut(n * COLUMNS_AT_ONCE)) {
            let mut sizes = [1.0; COLUMNS_AT_ONCE];
            for ((r, to), size) in r.chunks_exact(n).zip(self.columns.chunks_exact_mut(n)).zip(&mut sizes) {
                *size = largest(r, &self.scaling);
                for ((to, r), d) in to.iter_mut().zip(r).zip(&self.scaling) {
                    *to = (r * d / *size) as f32;
                }
            }
            let (plan, supernodes) = (self.symbolic.plan(), self.symbolic.supernodes());
            self.sweep.solve(plan, supernodes, &self.factor, &mut self.columns[..r.len()]);
            for ((z, from), size) in z.chunks_exact_mut(n).zip(self.columns.chunks_exact(n)).zip(sizes) {
                for ((z, from), d) in z.iter_mut().zip(from).zip(&self.scaling) {
                    *z = f64::from(*from) * d * size;
                }
            }
        }
    }
}

/// The largest |r_i d_i|, or 1 when all are zero.
fn largest(r: &[f64], scaling: &[f64]) -> f64 {
    let largest = r.iter().zip(scaling).fold(0.0_f64, |largest, (r, d)| largest.max((r * d).abs()));
    if largest > 0.0 { largest } else { 1.0 }
}
