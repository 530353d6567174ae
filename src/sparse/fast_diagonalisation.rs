//! Fast diagonalisation: the exact inverse of a sum of Kronecker products.
//!
//! On a box of n_0 x n_1 x n_2 unknowns (C order) a separable operator such as the Laplacian has the matrix
//!
//! ```text
//! P = K_0 (x) M_1 (x) M_2  +  M_0 (x) K_1 (x) M_2  +  M_0 (x) M_1 (x) K_2
//! ```
//!
//! with univariate stiffness K_a and mass M_a. With the eigenvectors of each pencil, K_a U_a = M_a U_a L_a and
//! U_a^T M_a U_a = 1,
//!
//! ```text
//! P^-1 = (U_0 (x) U_1 (x) U_2) (L_0 (+) L_1 (+) L_2)^-1 (U_0 (x) U_1 (x) U_2)^T :
//! ```
//!
//! six contractions with small dense matrices, 12 n^4 operations for n^3 unknowns, all of them matrix products
//! (R. E. Lynch, J. R. Rice, D. H. Thomas, Numer. Math. 6, 1964; as a preconditioner of isogeometric analysis
//! G. Sangalli, M. Tani, SIAM J. Sci. Comput. 38, 2016). A direction that a body does not have is a pencil with K = 0,
//! M = 1.
//!
//! Where P is singular (nothing is held: K_a has the constants in its kernel) the zero is replaced by the smallest
//! eigenvalue above it, so that the result still is a preconditioner.
//!
//! The work is cut in pieces whose size depends on n alone: the bits do not depend on the number of threads.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra_sparse::na::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

/// Columns that one task of the contraction along the first direction takes.
const COLUMNS: usize = 128;

/// An eigenvalue below this share of the largest counts as zero.
const ZERO: f64 = 1e-13;

/// A univariate pencil (K, M): symmetric n x n matrices, row-major, M positive definite, K positive semidefinite.
#[derive(Debug, Clone, PartialEq)]
pub struct Pencil {
    /// Order n.
    pub size: usize,
    /// K.
    pub stiffness: Vec<f64>,
    /// M.
    pub mass: Vec<f64>,
}

impl Pencil {
    /// The pencil of a direction that the body does not have.
    pub fn absent() -> Self {
        Self { size: 1, stiffness: vec![0.0], mass: vec![1.0] }
    }

    /// Eigenvalues and eigenvectors U (row-major, U^T M U = 1). `None` when M is not positive definite.
    fn modes(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = self.size;
        let root = DMatrix::from_row_slice(n, n, &self.mass).cholesky()?.l();
        // C = L^-1 K L^-T
        let half = root.solve_lower_triangular(&DMatrix::from_row_slice(n, n, &self.stiffness))?;
        let reduced = root.solve_lower_triangular(&half.transpose())?;
        let modes = SymmetricEigen::new(0.5 * (&reduced + reduced.transpose()));
        let vectors = root.transpose().solve_upper_triangular(&modes.eigenvectors)?;
        // nalgebra stores columns: the transpose in column order is the matrix in row order
        Some((modes.eigenvalues.as_slice().to_vec(), vectors.transpose().as_slice().to_vec()))
    }
}

/// P^-1 on one box of unknowns.
#[derive(Debug, Clone)]
pub struct FastDiagonalisation {
    extents: [usize; 3],
    /// U_a, row-major.
    vectors: [Vec<f64>; 3],
    /// 1 / (l_0 + l_1 + l_2), laid out like the unknowns.
    inverse: Vec<f64>,
}

/// What [`FastDiagonalisation::apply`] writes besides its result.
#[derive(Debug, Clone, Default)]
pub struct Workspace(Vec<f64>);

impl FastDiagonalisation {
    /// Decomposes the pencils. `None` when a mass matrix is not positive definite, or P has a negative direction.
    pub fn new(pencils: &[Pencil; 3]) -> Option<Self> {
        let modes = [pencils[0].modes()?, pencils[1].modes()?, pencils[2].modes()?];
        let extents = [0, 1, 2].map(|a| pencils[a].size);
        let mut sums = Vec::with_capacity(extents.iter().product());
        for l0 in &modes[0].0 {
            for l1 in &modes[1].0 {
                sums.extend(modes[2].0.iter().map(|l2| l0 + l1 + l2));
            }
        }
        let largest = sums.iter().fold(0.0, |most: f64, &s| most.max(s));
        let least = sums.iter().filter(|&&s| s > ZERO * largest).fold(largest, |least: f64, &s| least.min(s));
        if !(largest > 0.0 && largest.is_finite()) || sums.iter().any(|&s| s < -ZERO * largest) {
            return None;
        }
        let inverse = sums.iter().map(|&s| 1.0 / s.max(least)).collect();
        Some(Self { extents, vectors: modes.map(|(_, vectors)| vectors), inverse })
    }

    /// Unknowns along each direction.
    pub fn extents(&self) -> [usize; 3] {
        self.extents
    }

    /// Replaces `values` (C order of the box) by P^-1 `values`.
    ///
    /// # Panics
    /// When `values` does not have one number for each unknown.
    pub fn apply(&self, values: &mut [f64], work: &mut Workspace) {
        let [n0, n1, n2] = self.extents;
        let plane = n1 * n2;
        assert_eq!(values.len(), n0 * plane, "one number for each unknown");
        work.0.resize(values.len(), 0.0);
        values.par_chunks_mut(plane).for_each_init(Vec::new, |space, slab| self.in_plane(slab, true, space));
        let from: &[f64] = values;
        work.0.par_chunks_mut(n0 * COLUMNS).enumerate().for_each_init(
            Vec::new,
            |space: &mut Vec<f64>, (chunk, out)| {
                let (start, width) = (chunk * COLUMNS, out.len() / n0);
                let u = MatRef::from_row_major_slice(&self.vectors[0], n0, n0);
                let columns = MatRef::from_row_major_slice(from, n0, plane).subcols(start, width);
                space.resize(out.len(), 0.0);
                let mut modes = MatMut::from_row_major_slice_mut(space, n0, width);
                matmul(modes.as_mut(), Accum::Replace, u.transpose(), columns, 1.0, Par::Seq);
                for (row, inverse) in space.chunks_exact_mut(width).zip(self.inverse.chunks_exact(plane)) {
                    row.iter_mut().zip(&inverse[start..]).for_each(|(value, inverse)| *value *= inverse);
                }
                let modes = MatRef::from_row_major_slice(space, n0, width);
                matmul(MatMut::from_row_major_slice_mut(out, n0, width), Accum::Replace, u, modes, 1.0, Par::Seq);
            },
        );
        let chunked: &[f64] = &work.0;
        values.par_chunks_mut(plane).enumerate().for_each_init(Vec::new, |space, (i, slab)| {
            for (chunk, part) in chunked.chunks(n0 * COLUMNS).zip(slab.chunks_mut(COLUMNS)) {
                part.copy_from_slice(&chunk[i * part.len()..][..part.len()]);
            }
            self.in_plane(slab, false, space);
        });
    }

    /// X := U_1^T X U_2 (`analyse`) or U_1 X U_2^T for one plane X of n_1 x n_2 numbers.
    fn in_plane(&self, slab: &mut [f64], analyse: bool, space: &mut Vec<f64>) {
        let [_, n1, n2] = self.extents;
        let (u1, u2) = (
            MatRef::from_row_major_slice(&self.vectors[1], n1, n1),
            MatRef::from_row_major_slice(&self.vectors[2], n2, n2),
        );
        let (left, right) = if analyse { (u1.transpose(), u2) } else { (u1, u2.transpose()) };
        space.resize(slab.len(), 0.0);
        let mut product = MatMut::from_row_major_slice_mut(space, n1, n2);
        let plane = MatRef::from_row_major_slice(slab, n1, n2);
        matmul(product.as_mut(), Accum::Replace, plane, right, 1.0, Par::Seq);
        let plane = MatMut::from_row_major_slice_mut(slab, n1, n2);
        matmul(plane, Accum::Replace, left, product.as_ref(), 1.0, Par::Seq);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear elements on n + 1 unequal cells, held at the start when `held`.
    fn pencil(n: usize, held: bool) -> Pencil {
        let (mut stiffness, mut mass) = (vec![0.0; n * n], vec![0.0; n * n]);
        for cell in 0..n {
            let h = 1.0 + 0.1 * cell as f64;
            let Some(i) = cell.checked_sub(1) else {
                if held {
                    stiffness[0] += 1.0 / h;
                    mass[0] += h / 3.0;
                }
                continue;
            };
            for (a, b, k, m) in
                [(i, i, 1.0, 2.0), (i + 1, i + 1, 1.0, 2.0), (i, i + 1, -1.0, 1.0), (i + 1, i, -1.0, 1.0)]
            {
                stiffness[a * n + b] += k / h;
                mass[a * n + b] += m * h / 6.0;
            }
        }
        Pencil { size: n, stiffness, mass }
    }

    fn product(pencils: &[Pencil; 3], x: &[f64]) -> Vec<f64> {
        let n = [0, 1, 2].map(|a| pencils[a].size);
        let index = |i: usize| [i / (n[1] * n[2]), i / n[2] % n[1], i % n[2]];
        let entry = |i: [usize; 3], j: [usize; 3]| -> f64 {
            let at = |a: usize, matrix: &[f64]| matrix[i[a] * n[a] + j[a]];
            let term = |a: usize, b: usize| if a == b { at(b, &pencils[b].stiffness) } else { at(b, &pencils[b].mass) };
            (0..3).map(|a| term(a, 0) * term(a, 1) * term(a, 2)).sum()
        };
        (0..x.len()).map(|i| (0..x.len()).map(|j| entry(index(i), index(j)) * x[j]).sum()).collect()
    }

    #[test]
    fn it_inverts_a_sum_of_kronecker_products_on_any_number_of_threads() {
        for pencils in [
            [pencil(5, true), pencil(4, false), pencil(6, false)],
            [pencil(4, false), Pencil::absent(), pencil(7, true)],
        ] {
            let inverse = FastDiagonalisation::new(&pencils).expect("definite pencils");
            let size: usize = inverse.extents().iter().product();
            let x: Vec<f64> = (0..size).map(|i| (1.7 * i as f64).sin()).collect();
            let solve = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                let mut values = product(&pencils, &x);
                pool.install(|| inverse.apply(&mut values, &mut Workspace::default()));
                values
            };
            let solved = solve(1);
            assert!(solved.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-11));
            assert_eq!(solve(3), solved);
        }
    }

    #[test]
    fn a_body_that_nothing_holds_still_gets_a_positive_preconditioner() {
        let pencils = [pencil(3, false), pencil(3, false), pencil(3, false)];
        let inverse = FastDiagonalisation::new(&pencils).expect("semidefinite pencils");
        assert!(inverse.inverse.iter().all(|&i| i > 0.0 && i.is_finite()));
        let indefinite = Pencil { size: 1, stiffness: vec![-1.0], mass: vec![1.0] };
        assert!(FastDiagonalisation::new(&[indefinite, Pencil::absent(), Pencil::absent()]).is_none());
    }
}
