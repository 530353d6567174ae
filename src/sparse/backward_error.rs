//! How well a computed solution satisfies its equations.
//!
//! For A x = b with a computed x, the componentwise backward error of Oettli and Prager
//!
//! omega = max_i |b - A x|_i / (|A| |x| + |b|)_i
//!
//! is the smallest relative change of the entries of A and b that makes x exact (W. Oettli and W. Prager, Numer. Math. 6,
//! 1964). Around 1e-16 nothing better can be had in f64; times the condition number it bounds the relative error of x.

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
    for (s, b) in scale.iter_mut().zip(b) {
        *s = b.abs();
    }
    for j in 0..b.len() {
        let (start, end) = (lower.starts[j] as usize, lower.starts[j + 1] as usize);
        let (mut sum, mut sum_scale) = (0.0, 0.0);
        let x_j = x[j];
        for (&i, &a) in lower.rows[start + 1..end].iter().zip(&lower.values[start + 1..end]) {
            let i = i as usize;
            residual[i] -= a * x_j;
            scale[i] += (a * x_j).abs();
            sum += a * x[i];
            sum_scale += (a * x[i]).abs();
        }
        let diagonal = lower.values[start] * x_j;
        residual[j] -= sum + diagonal;
        scale[j] += sum_scale + diagonal.abs();
    }
    worst_ratio(residual, scale)
}

/// max_i |r_i| / s_i over the entries that are not 0; infinite where one is no number.
pub(crate) fn worst_ratio(residual: &[f64], scale: &[f64]) -> f64 {
    let mut worst = 0.0_f64;
    for (r, s) in residual.iter().zip(scale) {
        if !(r.is_finite() && s.is_finite()) {
            return f64::INFINITY;
        }
        if *r != 0.0 {
            worst = worst.max(r.abs() / s);
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
}
