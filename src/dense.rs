//! Small dense problems: the Gram matrix of a Jacobian, and a quadratic minimised in a box.
//!
//! A damped Gauss-Newton step d solves
//!
//! min 1/2 d^T H d + g^T d, lower <= d <= upper, H = J^T J + damping (m x m, positive definite).
//!
//! [`minimise_in_box`] is the projected Newton method of D. P. Bertsekas (SIAM J. Control Optim. 20, 1982): variables
//! pressed against a bound are held, the others take a Newton step, the step is projected into the box and halved until
//! the quadratic falls. It ends when a full step changes nothing, usually after a handful of passes.

use std::ops::Range;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor as qr;
use faer::linalg::solvers::{Llt, Solve};
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

/// H = J^T J for a Jacobian J (rows x columns, column-major); returns columns x columns, row-major.
///
/// # Panics
/// When the length of `jacobian` is not rows times columns.
pub fn gram(jacobian: &[f64], rows: usize, columns: usize) -> Vec<f64> {
    let j = MatRef::from_column_major_slice(jacobian, rows, columns);
    let mut h = Mat::<f64>::zeros(columns, columns);
    faer::linalg::matmul::matmul(h.as_mut(), Accum::Replace, j.transpose(), j, 1.0, Par::Seq);
    (0..columns * columns).map(|i| h[(i / columns, i % columns)]).collect()
}

/// The products of the columns of a matrix with its columns from `first` on, over some of its rows: entry (i, j) of the
/// result (columns x (columns - first), column-major) is M_i . M_(first + j). The matrix is column-major with `stride`
/// rows.
///
/// # Panics
/// When the matrix has not a whole number of columns.
pub fn gram_of_rows(matrix: &[f64], stride: usize, rows: Range<usize>, first: usize) -> Vec<f64> {
    let columns = matrix.len() / stride;
    let all = MatRef::from_column_major_slice(matrix, stride, columns).subrows(rows.start, rows.len());
    let mut products = vec![0.0; columns * (columns - first)];
    let into = MatMut::from_column_major_slice_mut(&mut products, columns, columns - first);
    let right = all.subcols(first, columns - first);
    faer::linalg::matmul::matmul(into, Accum::Replace, all.transpose(), right, 1.0, Par::Seq);
    products
}

/// R of the factorisation M = Q R by reflections: |M c| = |R c| for every c, to rounding. M is column-major with `rows`
/// rows; the columns of R stand one after the other, column j with min(j + 1, rows) numbers.
///
/// # Panics
/// When the matrix has not a whole number of columns.
pub fn triangle_of(matrix: &[f64], rows: usize) -> Vec<f64> {
    let columns = matrix.len() / rows;
    let mut reflected = Mat::from_fn(rows, columns, |i, j| matrix[j * rows + i]);
    let block = qr::recommended_block_size::<f64>(rows, columns);
    let mut coefficients = Mat::<f64>::zeros(block, rows.min(columns));
    let scratch = qr::qr_in_place_scratch::<f64>(rows, columns, block, Par::Seq, Default::default());
    let mut buffer = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut buffer);
    qr::qr_in_place(reflected.as_mut(), coefficients.as_mut(), Par::Seq, stack, Default::default());
    (0..columns).flat_map(|j| (0..rows.min(j + 1)).map(move |i| (i, j))).map(|at| reflected[at]).collect()
}

/// J^T r for a column-major Jacobian.
pub fn transposed_product(jacobian: &[f64], residual: &[f64]) -> Vec<f64> {
    jacobian.chunks_exact(residual.len()).map(|column| dot(column, residual)).collect()
}

/// Sum of products.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The minimiser of 1/2 d^T H d + g^T d in the box; H symmetric (m x m, row-major), lower <= 0 <= upper. `None` when H is
/// not positive definite on the free variables.
///
/// # Panics
/// When the slices do not fit together.
pub fn minimise_in_box(h: &[f64], g: &[f64], lower: &[f64], upper: &[f64]) -> Option<Vec<f64>> {
    let m = g.len();
    assert_eq!(h.len(), m * m, "a square matrix of the length of the gradient");
    let mut d = vec![0.0; m];
    let value = |d: &[f64], gradient: &[f64]| {
        0.5 * d.iter().zip(gradient.iter().zip(g)).map(|(d, (q, g))| d * (q + g)).sum::<f64>()
    };
    for _ in 0..20 + 10 * m {
        let gradient = gradient_at(h, g, &d);
        let free: Vec<usize> = (0..m)
            .filter(|&i| !((d[i] <= lower[i] && gradient[i] >= 0.0) || (d[i] >= upper[i] && gradient[i] <= 0.0)))
            .collect();
        if free.is_empty() {
            return Some(d);
        }
        let step = newton_step(h, &gradient, &free)?;
        let before = value(&d, &gradient);
        let mut length = 1.0;
        let moved = loop {
            let mut trial = d.clone();
            for (&i, s) in free.iter().zip(&step) {
                trial[i] = (d[i] + length * s).clamp(lower[i], upper[i]);
            }
            if trial == d || length < 1e-12 {
                return Some(d);
            }
            let descent: f64 = trial.iter().zip(&d).zip(&gradient).map(|((t, d), q)| (t - d) * q).sum();
            if value(&trial, &gradient_at(h, g, &trial)) <= before + 1e-4 * descent {
                break trial;
            }
            length *= 0.5;
        };
        let unclipped = length == 1.0 && free.iter().zip(&step).all(|(&i, s)| moved[i] == d[i] + s);
        d = moved;
        if unclipped && optimal(h, g, &d, lower, upper) {
            return Some(d);
        }
    }
    Some(d)
}

/// H d + g.
fn gradient_at(h: &[f64], g: &[f64], d: &[f64]) -> Vec<f64> {
    h.chunks_exact(d.len()).zip(g).map(|(row, g)| dot(row, d) + g).collect()
}

/// True when no held variable wants to leave its bound (the free ones are at their minimum).
fn optimal(h: &[f64], g: &[f64], d: &[f64], lower: &[f64], upper: &[f64]) -> bool {
    let gradient = gradient_at(h, g, d);
    let leaves = |i: usize| (d[i] <= lower[i] && gradient[i] < 0.0) || (d[i] >= upper[i] && gradient[i] > 0.0);
    !(0..d.len()).any(leaves)
}

/// The Newton step of the free variables.
fn newton_step(h: &[f64], gradient: &[f64], free: &[usize]) -> Option<Vec<f64>> {
    let m = gradient.len();
    let block = Mat::from_fn(free.len(), free.len(), |i, j| h[free[i] * m + free[j]]);
    let right = Mat::from_fn(free.len(), 1, |i, _| -gradient[free[i]]);
    let factor = Llt::new(block.as_ref(), Side::Lower).ok()?;
    let step = factor.solve(&right);
    Some((0..free.len()).map(|i| step[(i, 0)]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;
    use proptest::prelude::*;

    #[test]
    fn the_unconstrained_minimum_is_the_newton_step() {
        let h = [4.0, 1.0, 1.0, 3.0];
        let d = minimise_in_box(&h, &[1.0, 2.0], &[-9.0; 2], &[9.0; 2]).expect("definite");
        assert!((d[0] + 1.0 / 11.0).abs() < 1e-15 && (d[1] + 7.0 / 11.0).abs() < 1e-15, "{d:?}");
        assert!(minimise_in_box(&[1.0, 2.0, 2.0, 1.0], &[1.0, 1.0], &[-1.0; 2], &[1.0; 2]).is_none());
    }

    proptest! {
        #[test]
        fn the_minimum_in_a_box_satisfies_the_conditions_of_karush_kuhn_and_tucker(seed in 0u64..2000, m in 1usize..20) {
            let mut stream = Stream::new(seed, 0, 0);
            let rows = m + 2;
            let jacobian: Vec<f64> = (0..rows * m).map(|_| stream.normal()).collect();
            let residual: Vec<f64> = (0..rows).map(|_| stream.normal()).collect();
            let (h, g) = (gram(&jacobian, rows, m), transposed_product(&jacobian, &residual));
            let lower: Vec<f64> = (0..m).map(|_| -0.3 * stream.uniform()).collect();
            let upper: Vec<f64> = (0..m).map(|_| 0.3 * stream.uniform()).collect();
            let d = minimise_in_box(&h, &g, &lower, &upper).expect("a Gram matrix of full rank");
            let gradient = gradient_at(&h, &g, &d);
            let size = g.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            for i in 0..m {
                prop_assert!(d[i] >= lower[i] && d[i] <= upper[i]);
                let tolerance = 1e-9 * size;
                prop_assert!(d[i] == lower[i] || gradient[i] < tolerance);
                prop_assert!(d[i] == upper[i] || gradient[i] > -tolerance);
            }
        }
    }
}
