//! Gauss-Legendre quadrature.
//!
//!   integral over [-1, 1] of f(x) dx = sum_g w_g f(x_g)
//!
//! With n points it is exact for polynomials of degree 2 n - 1. The points are the roots of the Legendre polynomial
//! P_n, the weights w = 2 / ((1 - x^2) P_n'(x)^2), from
//!
//!   (k + 1) P_{k+1} = (2 k + 1) x P_k - k P_{k-1},   (1 - x^2) P_n' = n (P_{n-1} - x P_n).

use std::f64::consts::PI;

/// Points (ascending) and weights of the rule with `n` points on [-1, 1].
///
/// # Panics
/// When `n` is zero.
pub fn gauss_legendre(n: usize) -> (Vec<f64>, Vec<f64>) {
    assert!(n > 0, "a quadrature rule has at least one point");
    let (mut points, mut weights) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n.div_ceil(2) {
        let (x, weight) = if 2 * i + 1 == n { (0.0, weight(n, 0.0)) } else { root(n, i) };
        points[i] = -x;
        points[n - 1 - i] = x;
        weights[i] = weight;
        weights[n - 1 - i] = weight;
    }
    (points, weights)
}

/// Root `i` of P_n counted from the right end, by Newton, and its weight.
fn root(n: usize, i: usize) -> (f64, f64) {
    let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
    for _ in 0..100 {
        let (value, slope) = legendre(n, x);
        let step = value / slope;
        x -= step;
        if step.abs() <= f64::EPSILON {
            break;
        }
    }
    (x, weight(n, x))
}

/// Weight of the root next to `x`. The weight reacts to an error of x near the ends, where 1 - x^2 is small: the
/// remaining Newton step d is kept, (1 - x^2) P_n'^2 at x + d being ((1 - x^2) + 2 x d) P_n'^2 to first order.
fn weight(n: usize, x: f64) -> f64 {
    let (value, slope) = legendre(n, x);
    let step = -value / slope;
    2.0 / (((1.0 - x) * (1.0 + x) + 2.0 * x * step) * slope * slope)
}

/// P_n and its derivative at |x| < 1.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 1..n {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k + 1.0) * x * value - k * before) / (k + 1.0));
    }
    (value, n as f64 * (before - x * value) / ((1.0 - x) * (1.0 + x)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_of_all_sizes_integrate_their_monomials() {
        for n in 1..=64 {
            let (points, weights) = gauss_legendre(n);
            assert!(points.windows(2).all(|pair| pair[0] < pair[1]));
            for power in 0..2 * n {
                let sum: f64 = points.iter().zip(&weights).map(|(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 2e-15, "n {n}, power {power}: {sum} instead of {exact}");
            }
        }
    }

    #[test]
    fn small_rules_have_their_closed_form() {
        let (points, weights) = gauss_legendre(3);
        assert!((points[2] - 0.6f64.sqrt()).abs() < 2e-16 && points[1] == 0.0);
        assert!((weights[1] - 8.0 / 9.0).abs() < 5e-16 && (weights[0] - 5.0 / 9.0).abs() < 5e-16);
    }
}
