//! Twice the digits: numbers as unevaluated sums of two f64, and a dense Cholesky factorisation with them.
//!
//! ```text
//! x = high + low,   |low| <= 2^-53 |high|:     106 bits, about 32 digits
//! ```
//!
//! (T. J. Dekker, Numer. Math. 18, 1971). With a + b = s + e and a b = p + e exactly, e being a few operations more (D. E. Knuth;
//! the fused multiply-add for the product), sums and products of such pairs lose a few units of 2^-104. A system of condition
//! number kappa is then solved to about kappa 1e-31: an answer to hold those of f64 against, up to kappa of 1e15 and more.

use crate::sparse::backward_error::Lower;

/// high + low.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Double {
    high: f64,
    low: f64,
}

impl Double {
    /// Nothing.
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };

    /// An f64, exactly.
    pub fn of(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }

    /// The nearest f64.
    pub fn value(self) -> f64 {
        self.high + self.low
    }

    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let part = high - a;
        Self { high, low: (a - (high - part)) + (b - part) }
    }

    fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        Self { high, low: a.mul_add(b, -high) }
    }

    /// x + y.
    pub fn plus(self, other: Self) -> Self {
        let high = Self::sum(self.high, other.high);
        let low = Self::sum(self.low, other.low);
        let first = Self::sum(high.high, high.low + low.high);
        Self::sum(first.high, first.low + low.low)
    }

    /// -x.
    pub fn negative(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }

    /// x - y.
    pub fn minus(self, other: Self) -> Self {
        self.plus(other.negative())
    }

    /// x y.
    pub fn times(self, other: Self) -> Self {
        let leading = Self::product(self.high, other.high);
        Self::sum(leading.high, leading.low + (self.high * other.low + self.low * other.high))
    }

    /// x / y.
    pub fn over(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self.minus(other.times(Self::of(first)));
        let second = rest.high / other.high;
        let rest = rest.minus(other.times(Self::of(second)));
        Self::sum(first, second).plus(Self::of(rest.high / other.high))
    }

    /// sqrt(x) of a positive x: one step of Newton's method from the root in f64.
    pub fn root(self) -> Self {
        let near = self.high.sqrt();
        let rest = self.minus(Self::product(near, near));
        Self::of(near).plus(Self::of(rest.high / (2.0 * near)))
    }
}

/// Solves A x = b for a symmetric positive definite A with twice the digits, and rounds x once; none where a pivot is not
/// positive. Work n^3 / 6: for small systems.
///
/// # Panics
/// When `b` is not as long as the matrix.
pub fn solve(lower: Lower, b: &[f64]) -> Option<Vec<f64>> {
    let n = b.len();
    assert_eq!(lower.starts.len(), n + 1, "a right-hand side as long as the matrix");
    let mut factor = vec![Double::ZERO; n * n];
    for j in 0..n {
        for entry in lower.starts[j] as usize..lower.starts[j + 1] as usize {
            factor[lower.rows[entry] as usize * n + j] = Double::of(lower.values[entry]);
        }
    }
    for i in 0..n {
        for j in 0..=i {
            let (above, row) = factor.split_at_mut(i * n);
            let other: &[Double] = if i == j { &[] } else { &above[j * n..j * n + j + 1] };
            let mut sum = row[j];
            for k in 0..j {
                // most entries of a sparse row are exactly zero
                if row[k] != Double::ZERO {
                    let with = if i == j { row[k] } else { other[k] };
                    sum = sum.minus(row[k].times(with));
                }
            }
            row[j] = match i == j {
                true if sum.high > 0.0 => sum.root(),
                true => return None,
                false => sum.over(other[j]),
            };
        }
    }
    let mut x: Vec<Double> = b.iter().map(|&b| Double::of(b)).collect();
    for i in 0..n {
        for k in 0..i {
            x[i] = x[i].minus(factor[i * n + k].times(x[k]));
        }
        x[i] = x[i].over(factor[i * n + i]);
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            x[i] = x[i].minus(factor[k * n + i].times(x[k]));
        }
        x[i] = x[i].over(factor[i * n + i]);
    }
    Some(x.into_iter().map(Double::value).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirty_digits_survive_sums_products_quotients_and_roots() {
        let third = Double::of(1.0).over(Double::of(3.0));
        let rest = third.times(Double::of(3.0)).minus(Double::of(1.0));
        assert!(rest.value().abs() < 1e-31, "{rest:?}");
        let root = Double::of(2.0).root();
        assert!(root.times(root).minus(Double::of(2.0)).value().abs() < 1e-31);
        let tiny = Double::of(1.0).plus(Double::of(1e-25)).minus(Double::of(1.0));
        assert!((tiny.value() / 1e-25 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_hilbert_matrix_is_solved_where_f64_has_no_digit_left() {
        let n = 12;
        // scaled so that its entries are whole numbers: lcm(1..=23)
        let whole = 5_354_228_880.0;
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for j in 0..n {
            for i in j..n {
                rows.push(i as u32);
                values.push(whole / (i + j + 1) as f64);
            }
            starts.push(rows.len() as u32);
        }
        let lower = Lower { starts: &starts, rows: &rows, values: &values };
        // b = A 1, whole numbers below 2^53
        let b: Vec<f64> = (0..n).map(|i| (0..n).map(|j| whole / (i + j + 1) as f64).sum()).collect();
        let x = solve(lower, &b).expect("positive definite");
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-13), "{x:?}");
        let not = Lower { values: &values.iter().map(|v| -v).collect::<Vec<_>>(), ..lower };
        assert_eq!(solve(not, &b), None);
    }
}
