//! How well a computed solution satisfies its equations.
//!
//! For A x = b with a computed x, the componentwise backward error of Oettli and Prager
//!
//! omega = max_i |b - A x|_i / (|A| |x| + |b|)_i
//!
//! is the smallest relative change of the entries of A and b that makes x exact (W. Oettli and W. Prager, Numer. Math. 6,
//! 1964). Around 1e-16 nothing better can be had in f64; times the condition number it bounds the relative error of x.

use crate::lanes::dispatch;

/// The lower triangle (diagonal included) of a symmetric matrix in compressed columns, rows ascending: the diagonal
/// entry comes first in its column.
#[derive(Debug, Clone, Copy)]
pub struct Lower<'a> {
    /// First entry of each column; length n + 1.
    pub starts: &'a [u32],
    /// Row of each entry.
    pub rows: &'a [u32],
    /// Value of each entry.
    pub values: &'a [f64],
}

/// Writes b - A x into `residual` and returns the componentwise backward error; all slices of length n, `scale` is
/// workspace. A residual that is not finite gives infinity.
///
/// # Panics
/// When a slice is shorter than n.
pub fn residual(lower: Lower, x: &[f64], b: &[f64], residual: &mut [f64], scale: &mut [f64]) -> f64 {
    residual.copy_from_slice(b);
    residuals::<1>(lower, x.as_chunks().0, residual.as_chunks_mut().0, scale.as_chunks_mut().0)[0]
}

/// The same for K right-hand sides that stand side by side: `residual` holds b and takes b - A x. Every entry of A is read
/// once for all; the bits are those of [`residual`].
///
/// # Panics
/// When a slice is shorter than n.
pub fn residuals<const K: usize>(
    lower: Lower,
    x: &[[f64; K]],
    residual: &mut [[f64; K]],
    scale: &mut [[f64; K]],
) -> [f64; K] {
    widest::<K, _>(
        #[inline(always)]
        || {
            for (s, b) in scale.iter_mut().zip(residual.iter()) {
                *s = b.map(f64::abs);
            }
            subtract_product::<K, true>(lower, x, residual, scale);
            worst_ratios(residual, scale)
        },
    )
}

/// The same without the sizes, half the work: the relative residuals |b - A x| / |b| in the Euclidean norm; infinite where
/// |b|^2 is zero or beyond the range of numbers.
///
/// # Panics
/// When a slice is shorter than n.
pub fn relative_residuals<const K: usize>(lower: Lower, x: &[[f64; K]], residual: &mut [[f64; K]]) -> [f64; K] {
    widest::<K, _>(
        #[inline(always)]
        || {
            let right = squares(residual);
            subtract_product::<K, false>(lower, x, residual, &mut []);
            let left = squares(residual);
            std::array::from_fn(|c| if right[c].is_normal() { (left[c] / right[c]).sqrt() } else { f64::INFINITY })
        },
    )
}

/// Several right-hand sides fill wide registers; the scattered numbers of one do not.
#[inline(always)]
fn widest<const K: usize, R>(work: impl FnOnce() -> R) -> R {
    if K == 1 { work() } else { dispatch(work) }
}

#[inline(always)]
fn squares<const K: usize>(rows: &[[f64; K]]) -> [f64; K] {
    let mut sums = [0.0; K];
    for row in rows {
        for c in 0..K {
            sums[c] += row[c] * row[c];
        }
    }
    sums
}

/// residual -= A x and, where the sizes are wanted, scale += |A| |x|.
#[inline(always)]
fn subtract_product<const K: usize, const SIZES: bool>(
    lower: Lower,
    x: &[[f64; K]],
    residual: &mut [[f64; K]],
    scale: &mut [[f64; K]],
) {
    let n = lower.starts.len() - 1;
    let (x, residual) = (&x[..n], &mut residual[..n]);
    for j in 0..n {
        let column = lower.starts[j] as usize..lower.starts[j + 1] as usize;
        let (rows, values) = (&lower.rows[column.clone()], &lower.values[column]);
        let x_j = x[j];
        // the upper triangle's share of row j
        let (mut sum, mut size) = ([0.0; K], [0.0; K]);
        for (&i, &a) in rows[1..].iter().zip(&values[1..]) {
            let i = i as usize;
            // copies: what is written is not what is read, and the compiler knows
            let (x_i, mut below, mut below_size) = (x[i], residual[i], if SIZES { scale[i] } else { [0.0; K] });
            for c in 0..K {
                let (of_i, of_j) = (a * x_j[c], a * x_i[c]);
                below[c] -= of_i;
                sum[c] += of_j;
                below_size[c] += of_i.abs();
                size[c] += of_j.abs();
            }
            residual[i] = below;
            if SIZES {
                scale[i] = below_size;
            }
        }
        for c in 0..K {
            let own = values[0] * x_j[c];
            residual[j][c] -= sum[c] + own;
            if SIZES {
                scale[j][c] += size[c] + own.abs();
            }
        }
    }
}

/// max_i |r_i| / s_i over the entries that are not 0; infinite where one is no number.
pub(crate) fn worst_ratio(residual: &[f64], scale: &[f64]) -> f64 {
    worst_ratios::<1>(residual.as_chunks().0, scale.as_chunks().0)[0]
}

#[inline(always)]
fn worst_ratios<const K: usize>(residual: &[[f64; K]], scale: &[[f64; K]]) -> [f64; K] {
    let mut worst = [0.0_f64; K];
    for (r, s) in residual.iter().zip(scale) {
        for c in 0..K {
            let ratio = if r[c] == 0.0 && s[c].is_finite() { 0.0 } else { r[c].abs() / s[c] };
            // numbers that overflow, in the residual or in the scale, and those that are no numbers
            let ratio = if r[c].is_finite() && s[c].is_finite() { ratio } else { f64::INFINITY };
            worst[c] = if ratio > worst[c] { ratio } else { worst[c] };
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_backward_error_is_the_relative_change_of_one_entry() {
        let (starts, rows) = ([0, 2, 3], [0, 1, 1]);
        let values = [4.0, 1.0, 2.0 * (1.0 + 1e-6)];
        let lower = Lower { starts: &starts, rows: &rows, values: &values };
        let x = [1.0, 3.0];
        let b = [7.0, 7.0];
        let (mut r, mut s) = ([0.0; 2], [0.0; 2]);
        let omega = residual(lower, &x, &b, &mut r, &mut s);
        assert!((r[1] + 6e-6).abs() < 1e-14 && r[0] == 0.0);
        assert!((omega - 6e-6 / 14.0).abs() < 1e-12, "{omega}");
        assert_eq!(residual(lower, &[f64::NAN, 0.0], &b, &mut r, &mut s), f64::INFINITY);
    }

    #[test]
    fn vectors_side_by_side_have_the_bits_of_one_alone_and_a_residual_in_the_euclidean_norm() {
        let n = 40;
        let starts: Vec<u32> = (0..=n as u32).map(|j| (0..j).map(|j| (n as u32 - j).min(6)).sum()).collect();
        let rows: Vec<u32> = (0..n as u32).flat_map(|j| j..n.min(j as usize + 6) as u32).collect();
        let values: Vec<f64> = (0..rows.len()).map(|i| (0.7 * i as f64).sin()).collect();
        let lower = Lower { starts: &starts, rows: &rows, values: &values };
        let number = |i: usize, c: usize| ((i * 8 + c) as f64).cos();
        let x: Vec<[f64; 8]> = (0..n).map(|i| std::array::from_fn(|c| number(i, c))).collect();
        let b: Vec<[f64; 8]> = (0..n).map(|i| std::array::from_fn(|c| number(c, i))).collect();
        let (mut r, mut s) = (b.clone(), x.clone());
        // squares that are no numbers any more are no residual of zero
        let mut tiny = b.iter().map(|row| row.map(|b| 1e-200 * b)).collect::<Vec<_>>();
        assert_eq!(relative_residuals(lower, &x, &mut tiny), [f64::INFINITY; 8]);
        let together = residuals(lower, &x, &mut r, &mut s);
        let mut again = b.clone();
        let ratios = relative_residuals(lower, &x, &mut again);
        assert_eq!(again, r);
        for c in 0..8 {
            let column = |rows: &[[f64; 8]]| rows.iter().map(|row| row[c]).collect::<Vec<f64>>();
            let (mut alone, mut scale) = (vec![0.0; n], vec![0.0; n]);
            let error = residual(lower, &column(&x), &column(&b), &mut alone, &mut scale);
            assert_eq!((error.to_bits(), alone, scale), (together[c].to_bits(), column(&r), column(&s)));
            let norm = |v: Vec<f64>| v.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!((ratios[c] - norm(column(&r)) / norm(column(&b))).abs() < 1e-12 * ratios[c]);
        }
    }
}
