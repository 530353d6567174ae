//! The lowest natural frequencies of a body.
//!
//! The free vibrations solve K v = omega^2 M v. Subspace iteration (K.-J. Bathe, 1971) keeps
//! a block X of more vectors than modes are wanted, and repeats
//!
//! ```text
//!     Y = K^-1 M X,     A = Y^T K Y,   B = Y^T M Y,     A Q = B Q diag(omega^2),     X = Y Q
//! ```
//!
//! An error in omega^2 shrinks by (omega_wanted / omega_beyond)^4 in each round, where omega_beyond belongs to the first
//! mode outside the block. Equal frequencies are found as often as they occur. K Y = M X, so K itself is not needed.
//!
//! omega in rad/s; frequencies omega / (2 pi) in Hz.

use nalgebra_sparse::na::{Cholesky, DMatrix, SymmetricEigen};

use crate::error::{Error, Result};
use crate::rng::Stream;
use crate::sparse::cholesky::Factor;

/// Rounds after which the iteration is given up.
const ROUNDS: usize = 200;

/// Relative change of omega^2 in a round that ends the iteration.
const TOLERANCE: f64 = 1e-13;

/// The `count` lowest natural frequencies in Hz, ascending. `factor` holds the factored stiffness (N/m),
/// `mass(v, out)` writes M v (kg), positive definite. There are as many frequencies as unknowns at most.
///
/// # Errors
/// [`Error::Inaccurate`] when they do not settle in 200 rounds; those of [`Factor::solve`].
pub fn lowest_frequencies(factor: &mut Factor, mass: &dyn Fn(&[f64], &mut [f64]), count: usize) -> Result<Vec<f64>> {
    let n = factor.symbolic().len();
    let block = (2 * count + 8).min(n);
    let mut stream = Stream::new(1, 0, 0);
    let mut x = DMatrix::from_fn(n, block, |_, _| stream.normal());
    let mut right = DMatrix::zeros(n, block);
    let wanted = count.min(block);
    let (mut y, mut before) = (DMatrix::zeros(n, block), vec![f64::INFINITY; wanted]);
    let mut change = f64::INFINITY;
    for _ in 0..ROUNDS {
        weigh(&x, &mut right, mass);
        factor.solve(right.as_slice(), y.as_mut_slice())?;
        let squares = rotate(&mut right, &y, &mut x, mass)?;
        change = squares.iter().zip(&before).map(|(now, before)| (now / before - 1.0).abs()).fold(0.0, f64::max);
        before.copy_from_slice(&squares[..wanted]);
        if change <= TOLERANCE {
            return Ok(before.iter().map(|square| square.sqrt() / std::f64::consts::TAU).collect());
        }
    }
    Err(Error::Inaccurate { backward_error: change, limit: TOLERANCE })
}

/// Y = M X
fn weigh(x: &DMatrix<f64>, y: &mut DMatrix<f64>, mass: &dyn Fn(&[f64], &mut [f64])) {
    let n = x.nrows();
    for (from, to) in x.as_slice().chunks_exact(n).zip(y.as_mut_slice().chunks_exact_mut(n)) {
        mass(from, to);
    }
}

/// Takes M X in `right` and Y; writes the new X and returns omega^2, ascending.
fn rotate(
    right: &mut DMatrix<f64>,
    y: &DMatrix<f64>,
    x: &mut DMatrix<f64>,
    mass: &dyn Fn(&[f64], &mut [f64]),
) -> Result<Vec<f64>> {
    let a = y.tr_mul(right);
    weigh(y, right, mass);
    let b = y.tr_mul(right);
    let lower = Cholesky::new(b).ok_or(Error::Inaccurate { backward_error: 1.0, limit: TOLERANCE })?.l();
    // with B = L L^T the pencil (A, B) has the eigenvalues of L^-1 A L^-T
    let half = lower.solve_lower_triangular(&a).expect("a Cholesky factor has a positive diagonal");
    let reduced = lower.solve_lower_triangular(&half.transpose()).expect("a Cholesky factor has a positive diagonal");
    let eigen = SymmetricEigen::new((&reduced + reduced.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let sorted = DMatrix::from_fn(order.len(), order.len(), |i, j| eigen.eigenvectors[(i, order[j])]);
    let q = lower.tr_solve_lower_triangular(&sorted).expect("a Cholesky factor has a positive diagonal");
    y.mul_to(&q, x);
    Ok(order.iter().map(|&i| eigen.eigenvalues[i]).collect())
}
