//! Sparse Cholesky: A = L L^T, analysed once, factored and solved often.
//!
//! [`Symbolic`] holds what depends on the pattern only: the elimination order, the pattern of the permuted lower
//! triangle, and the supernodes of L. It is immutable and shared. [`Factor`] holds one worker's numbers: the values of
//! the permuted lower triangle, of L, and all workspace, so that nothing is allocated after its making. Whoever
//! assembles writes straight into [`Factor::values_mut`]; no copy stands between assembly and factorisation.
//!
//! The factorisation (`multifrontal`) runs sequentially: its bits would depend on its parallel degree, and
//! workers side by side (chains, starts, gammas, load cases) use the cores better. Only this file and [`super::single`], the
//! same in f32, name it.
//!
//! Every solve is checked: the componentwise backward error of its result is measured, one step of iterative refinement
//! follows where it is above [`REFINE_ABOVE`], and a result above [`ACCEPTED`] is an error, never a number.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::cholesky::{simplicial, supernodal};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use nalgebra_sparse::CsrMatrix;

use crate::error::{Error, Result};
use crate::sparse::backward_error::{self, Lower};
use crate::sparse::multifrontal;
use crate::sparse::pattern::Pattern;

/// A backward error above this is refined once.
pub const REFINE_ABOVE: f64 = 1e-15;

/// A backward error above this, after refinement, is an error.
pub const ACCEPTED: f64 = 1e-10;

/// Right-hand sides that one sweep over L serves; fixed, so that bits do not depend on how many there are.
const COLUMNS_AT_ONCE: usize = 16;

/// What depends on the pattern and the elimination order only.
#[derive(Debug)]
pub struct Symbolic {
    order: Vec<u32>,
    lower: SymbolicSparseColMat<u32>,
    source: Vec<usize>,
    supernodes: supernodal::SymbolicSupernodalCholesky<u32>,
    plan: multifrontal::Plan,
    factor_flops: f64,
}

impl Symbolic {
    /// Analyses a pattern. `order[k]` is the unknown that is eliminated k-th (a permutation of 0..n).
    ///
    /// # Errors
    /// When the factor is too large for 32-bit indices or for memory.
    ///
    /// # Panics
    /// When `order` is not a permutation of the unknowns.
    pub fn analyse(pattern: &Pattern, order: Vec<u32>) -> Result<Arc<Self>> {
        let n = pattern.len();
        let rank = inverse(&order, n);
        let (starts, rows, source) = permuted_lower(pattern, &order, &rank);
        let (upper_starts, upper_rows) = transpose_pattern(n, &starts, &rows);
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &upper_starts, None, &upper_rows);
        let (mut etree, mut counts) = (vec![0i32; n], vec![0u32; n]);
        let scratch = StackReq::any_of(&[
            simplicial::prefactorize_symbolic_cholesky_scratch::<u32>(n, upper_rows.len()),
            supernodal::factorize_supernodal_symbolic_cholesky_scratch::<u32>(n),
        ]);
        let mut buffer = MemBuffer::new(scratch);
        let stack = MemStack::new(&mut buffer);
        let tree = simplicial::prefactorize_symbolic_cholesky(&mut etree, &mut counts, upper, stack);
        let supernodes =
            supernodal::factorize_supernodal_symbolic_cholesky(upper, tree, &counts, stack, Default::default())
                .map_err(|_| {
                    Error::input(
                        "geometry.control_points",
                        format!("the Cholesky factor of {n} unknowns is too large to be indexed or stored"),
                        "use fewer control points",
                    )
                })?;
        let factor_flops = counts.iter().map(|&c| f64::from(c) * f64::from(c)).sum();
        let lower = SymbolicSparseColMat::new_checked(n, n, starts, None, rows);
        let plan = multifrontal::Plan::new(&supernodes);
        Ok(Arc::new(Self { order, lower, source, supernodes, plan, factor_flops }))
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// True when there are no unknowns.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// The unknown eliminated k-th.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// First entry of each column of the permuted lower triangle; length n + 1.
    pub fn lower_starts(&self) -> &[u32] {
        self.lower.col_ptr()
    }

    /// Row (in elimination order) of each entry of the permuted lower triangle, ascending in each column.
    pub fn lower_rows(&self) -> &[u32] {
        self.lower.row_idx()
    }

    /// The pattern of the permuted lower triangle, as the factorisations of this room take it.
    pub(super) fn lower(&self) -> SymbolicSparseColMatRef<'_, u32> {
        self.lower.as_ref()
    }

    /// The fronts of a factorisation.
    pub(super) fn plan(&self) -> &multifrontal::Plan {
        &self.plan
    }

    /// The supernodes of L, as the factorisations of this room take them.
    pub(super) fn supernodes(&self) -> &supernodal::SymbolicSupernodalCholesky<u32> {
        &self.supernodes
    }

    /// Stored numbers of L, explicit zeros of the supernodes included.
    pub fn factor_entries(&self) -> usize {
        self.supernodes.len_val()
    }

    /// Floating-point operations of one factorisation (sum of squared column counts).
    pub fn factor_flops(&self) -> f64 {
        self.factor_flops
    }

    /// Bytes of one [`Factor`] on this pattern.
    pub fn factor_bytes(&self) -> usize {
        8 * (self.factor_entries()
            + self.plan.update_entries()
            + self.lower_rows().len()
            + (3 + COLUMNS_AT_ONCE) * self.len())
            + scratch(self).unaligned_bytes_required()
    }
}

/// Workspace of a factorisation and of a solve with [`COLUMNS_AT_ONCE`] columns.
fn scratch(symbolic: &Symbolic) -> StackReq {
    StackReq::any_of(&[
        symbolic.plan.scratch::<f64>(),
        symbolic.supernodes.solve_in_place_scratch::<f64>(COLUMNS_AT_ONCE, Par::Seq),
    ])
}

fn inverse(order: &[u32], n: usize) -> Vec<u32> {
    assert_eq!(order.len(), n, "an elimination order has every unknown");
    let mut rank = vec![u32::MAX; n];
    for (k, &i) in order.iter().enumerate() {
        rank[i as usize] = k as u32;
    }
    assert!(!rank.contains(&u32::MAX), "an elimination order has every unknown once");
    rank
}

/// The permuted lower triangle in compressed columns, and for every entry its position in the CSR values of the pattern.
fn permuted_lower(pattern: &Pattern, order: &[u32], rank: &[u32]) -> (Vec<u32>, Vec<u32>, Vec<usize>) {
    let mut starts = vec![0u32];
    let (mut rows, mut source) = (Vec::new(), Vec::new());
    let mut column: Vec<(u32, usize)> = Vec::new();
    for (k, &unknown) in order.iter().enumerate() {
        column.clear();
        let first = pattern.offsets()[unknown as usize];
        for (offset, &other) in pattern.row(unknown as usize).iter().enumerate() {
            if rank[other] as usize >= k {
                column.push((rank[other], first + offset));
            }
        }
        column.sort_unstable();
        rows.extend(column.iter().map(|entry| entry.0));
        source.extend(column.iter().map(|entry| entry.1));
        starts.push(rows.len() as u32);
    }
    (starts, rows, source)
}

fn transpose_pattern(n: usize, starts: &[u32], rows: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut upper_starts = vec![0u32; n + 1];
    for &i in rows {
        upper_starts[i as usize + 1] += 1;
    }
    for i in 0..n {
        upper_starts[i + 1] += upper_starts[i];
    }
    let mut next = upper_starts.clone();
    let mut upper_rows = vec![0u32; rows.len()];
    for j in 0..n {
        for &i in &rows[starts[j] as usize..starts[j + 1] as usize] {
            upper_rows[next[i as usize] as usize] = j as u32;
            next[i as usize] += 1;
        }
    }
    (upper_starts, upper_rows)
}

/// One worker's factor: values of A, values of L, workspace.
pub struct Factor {
    symbolic: Arc<Symbolic>,
    lower: Vec<f64>,
    factor: Vec<f64>,
    columns: Vec<f64>,
    right: Vec<f64>,
    residual: Vec<f64>,
    scale: Vec<f64>,
    buffer: MemBuffer,
    work: multifrontal::Workspace<f64>,
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
            buffer: MemBuffer::new(scratch(&symbolic)),
            work: multifrontal::Workspace::new(&symbolic.plan, &symbolic.supernodes),
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
        for (to, &from) in self.lower.iter_mut().zip(&self.symbolic.source) {
            *to = values[from];
        }
    }

    /// Factors the matrix whose values were written.
    ///
    /// # Errors
    /// [`Error::NotPositiveDefinite`] with the unknown whose pivot is not positive.
    pub fn refactor(&mut self) -> Result<()> {
        let s = &*self.symbolic;
        let lower = SparseColMatRef::new(s.lower.as_ref(), &self.lower);
        let stack = MemStack::new(&mut self.buffer);
        multifrontal::factorise(&s.plan, &s.supernodes, lower, &mut self.factor, &mut self.work, stack)
            .map_err(|column| Error::NotPositiveDefinite { dof: s.order[column] as usize })
    }

    /// The unknown with the smallest pivot relative to its diagonal entry, and that ratio L_jj^2 / A_jj in (0, 1]. The
    /// ratio is at least 1 / cond(A); at rounding (about 1e-16) the matrix is singular and the unknown is loose.
    pub fn weakest_pivot(&self) -> (usize, f64) {
        let s = &*self.symbolic;
        let (begin, end, values) =
            (s.supernodes.supernode_begin(), s.supernodes.supernode_end(), s.supernodes.col_ptr_for_val());
        let mut weakest = (0, f64::INFINITY);
        for (node, (&first, &last)) in begin.iter().zip(end).enumerate() {
            let width = (last - first) as usize;
            let block = &self.factor[values[node] as usize..values[node + 1] as usize];
            let height = block.len() / width;
            for (offset, j) in (first as usize..last as usize).enumerate() {
                let ratio = block[offset * height + offset].powi(2) / self.lower[s.lower_starts()[j] as usize];
                // a pivot that is not a number is weaker than any
                if ratio.is_nan() || ratio < weakest.1 {
                    weakest = (s.order[j] as usize, ratio);
                }
            }
        }
        weakest
    }

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
                permute(&self.symbolic.order, b, to);
            }
            sweep(&self.symbolic, &self.factor, &mut self.columns[..b.len()], &mut self.buffer);
            for (column, (b, x)) in b.chunks_exact(n).zip(x.chunks_exact_mut(n)).enumerate() {
                worst = worst.max(self.finish(column, b, x)?);
            }
        }
        Ok(worst)
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
                permute(&self.symbolic.order, b, to);
            }
            supernodal::SupernodalLltRef::new(&self.symbolic.supernodes, &self.factor).l_solve_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(x, n, b.len() / n),
                Par::Seq,
                MemStack::new(&mut self.buffer),
            );
        }
    }

    /// z = (L L^T)^-1 r for whole columns in elimination order with the last factor, without a check: a preconditioner.
    ///
    /// # Panics
    /// When `r` is not a whole number of columns, or `z` has another length.
    pub fn precondition(&mut self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
        for columns in z.chunks_mut(self.symbolic.len() * COLUMNS_AT_ONCE) {
            sweep(&self.symbolic, &self.factor, columns, &mut self.buffer);
        }
    }

    /// Checks one column, refines it once if needed, and writes it in the order of the unknowns.
    fn finish(&mut self, column: usize, b: &[f64], x: &mut [f64]) -> Result<f64> {
        let n = self.symbolic.len();
        let lower =
            Lower { starts: self.symbolic.lower_starts(), rows: self.symbolic.lower_rows(), values: &self.lower };
        let solution = &mut self.columns[column * n..(column + 1) * n];
        permute(&self.symbolic.order, b, &mut self.right);
        let mut error = backward_error::residual(lower, solution, &self.right, &mut self.residual, &mut self.scale);
        if error > REFINE_ABOVE && error.is_finite() {
            sweep(&self.symbolic, &self.factor, &mut self.residual, &mut self.buffer);
            for (value, correction) in solution.iter_mut().zip(&self.residual) {
                *value += correction;
            }
            error = backward_error::residual(lower, solution, &self.right, &mut self.residual, &mut self.scale);
        }
        if error > ACCEPTED {
            return Err(Error::Inaccurate { backward_error: error, limit: ACCEPTED });
        }
        for (&i, &value) in self.symbolic.order.iter().zip(solution.iter()) {
            x[i as usize] = value;
        }
        Ok(error)
    }
}

/// Brings a vector from the order of the unknowns to elimination order.
fn permute(order: &[u32], from: &[f64], to: &mut [f64]) {
    for (to, &i) in to.iter_mut().zip(order) {
        *to = from[i as usize];
    }
}

/// L L^T X = B in place, in elimination order, without a check.
fn sweep(symbolic: &Symbolic, factor: &[f64], columns: &mut [f64], buffer: &mut MemBuffer) {
    let n = symbolic.len();
    let count = columns.len() / n;
    supernodal::SupernodalLltRef::new(&symbolic.supernodes, factor).solve_in_place_with_conj(
        Conj::No,
        MatMut::from_column_major_slice_mut(columns, n, count),
        Par::Seq,
        MemStack::new(buffer),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::ordering;

    /// A grid of unit springs between neighbours (5-point matrix) plus a random positive diagonal.
    fn grid_matrix(nx: usize, ny: usize, seed: f64) -> (Pattern, CsrMatrix<f64>) {
        let node = |i: usize, j: usize| (i * ny + j) as u32;
        let mut edges = Vec::new();
        for i in 0..nx {
            for j in 0..ny {
                if i + 1 < nx {
                    edges.push([node(i, j), node(i + 1, j)]);
                }
                if j + 1 < ny {
                    edges.push([node(i, j), node(i, j + 1)]);
                }
            }
        }
        let pattern = Pattern::from_cliques(nx * ny, edges.iter().map(|e| e.as_slice()));
        let mut values = vec![0.0; pattern.entries()];
        for (s, &[a, b]) in edges.iter().enumerate() {
            let k = 1.0 + (seed * (s as f64 + 1.0)).sin().abs();
            let (a, b) = (a as usize, b as usize);
            for (i, j, k) in [(a, a, k), (b, b, k), (a, b, -k), (b, a, -k)] {
                values[pattern.position(i, j).expect("in the pattern")] += k;
            }
        }
        values[0] += 1.0;
        let matrix =
            CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), values).expect("one value an entry");
        (pattern, matrix)
    }

    fn factored(symbolic: &Arc<Symbolic>, matrix: &CsrMatrix<f64>) -> Factor {
        let mut factor = Factor::new(Arc::clone(symbolic));
        factor.load(matrix);
        factor.refactor().expect("a positive definite matrix");
        factor
    }

    #[test]
    fn both_orders_solve_many_columns_with_a_backward_error_of_rounding() {
        let (pattern, matrix) = grid_matrix(17, 11, 0.7);
        let n = pattern.len();
        for order in [
            ordering::nested_dissection([17, 11, 1], 1, [false; 3]),
            ordering::minimum_degree(&pattern).expect("a small pattern"),
        ] {
            let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
            let b: Vec<f64> = (0..n * 19).map(|i| (i as f64 * 0.37).cos()).collect();
            let mut x = vec![0.0; b.len()];
            let error = factored(&symbolic, &matrix).solve(&b, &mut x).expect("solvable");
            assert!(error <= REFINE_ABOVE, "{error}");
            let product = &matrix * &nalgebra_sparse::na::DMatrix::from_column_slice(n, 19, &x);
            assert!(product.iter().zip(&b).all(|(p, b)| (p - b).abs() < 1e-12));
        }
    }

    #[test]
    fn an_updated_factor_has_the_bits_of_a_fresh_one() {
        let (pattern, first) = grid_matrix(13, 13, 0.3);
        let (_, second) = grid_matrix(13, 13, 1.9);
        let order = ordering::nested_dissection([13, 13, 1], 1, [false; 3]);
        let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
        let b: Vec<f64> = (0..pattern.len()).map(|i| i as f64).collect();
        let solve = |factor: &mut Factor| {
            let mut x = vec![0.0; b.len()];
            factor.solve(&b, &mut x).expect("solvable");
            x
        };
        let mut updated = factored(&symbolic, &first);
        let before = solve(&mut updated);
        updated.load(&second);
        updated.refactor().expect("a positive definite matrix");
        assert_eq!(solve(&mut updated), solve(&mut factored(&symbolic, &second)));
        updated.load(&first);
        updated.refactor().expect("a positive definite matrix");
        assert_eq!(solve(&mut updated), before);
    }

    #[test]
    fn the_weakest_pivot_tells_a_loose_matrix_from_a_stiff_one() {
        let (pattern, mut matrix) = grid_matrix(6, 5, 0.3);
        let order = ordering::nested_dissection([6, 5, 1], 1, [false; 3]);
        let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
        assert!(factored(&symbolic, &matrix).weakest_pivot().1 > 1e-3);
        matrix.values_mut()[0] -= 1.0 - 1e-14;
        let mut factor = Factor::new(Arc::clone(&symbolic));
        factor.load(&matrix);
        assert!(factor.refactor().is_err() || factor.weakest_pivot().1 < 1e-13);
    }

    #[test]
    fn an_indefinite_matrix_is_an_error_that_names_an_unknown_and_leaves_the_factor_usable() {
        let (pattern, mut matrix) = grid_matrix(4, 4, 0.3);
        let order = ordering::nested_dissection([4, 4, 1], 1, [false; 3]);
        let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
        let good = matrix.clone();
        let diagonal = pattern.position(9, 9).expect("the diagonal is stored");
        matrix.values_mut()[diagonal] = -1.0;
        let mut factor = factored(&symbolic, &good);
        factor.load(&matrix);
        assert!(matches!(factor.refactor(), Err(Error::NotPositiveDefinite { dof }) if dof < 16));
        matrix.values_mut()[diagonal] = f64::NAN;
        factor.load(&matrix);
        let mut x = vec![0.0; 16];
        let outcome = factor.refactor().and_then(|()| factor.solve(&[1.0; 16], &mut x));
        assert!(outcome.is_err(), "a matrix with a NaN has no solution: {outcome:?}");
        factor.load(&good);
        factor.refactor().expect("usable again");
        assert!(factor.solve(&[1.0; 16], &mut x).is_ok());
    }
}
