//! B-spline basis functions and their derivatives on one span.
//!
//! Cox-de Boor recursion (2.16-2.17), with t the knots and 0/0 = 0:
//!
//!   N_{i,0}(x) = 1 on [t_i, t_{i+1}), else 0
//!   N_{i,q}(x) = (x - t_i) / (t_{i+q} - t_i) N_{i,q-1}(x) + (t_{i+q+1} - x) / (t_{i+q+1} - t_{i+1}) N_{i+1,q-1}(x)
//!
//! On span s only the p + 1 functions s - p ..= s are not zero; the recursion is done on them alone. The k-th
//! derivative is a combination of the functions of degree p - k:
//!
//!   d^k N_{i,p} / dx^k = p (p-1) .. (p-k+1) sum_{m=0..k} a_{k,m} N_{i+m,p-k}
//!   a_{0,0} = 1,   a_{k,m} = (a_{k-1,m} - a_{k-1,m-1}) / (t_{i+p+1-k+m} - t_{i+m})
//!
//! (Piegl and Tiller, The NURBS Book, A2.3.) Work arrays have a fixed size: nothing is allocated.

use super::knots::{KnotVector, MAX_DEGREE};

/// Functions that act on one span, at most.
const ORDER: usize = MAX_DEGREE + 1;

/// Values and derivatives up to `order` of the p + 1 functions of `span` at `xi`.
///
/// `out[k * (p + 1) + j]` receives the k-th derivative of function `span` - p + j; orders above p are zero.
///
/// # Panics
/// When `out` is shorter than (`order` + 1) (p + 1), or `span` is not one of [`KnotVector::spans`].
pub fn derivatives(knots: &KnotVector, span: usize, xi: f64, order: usize, out: &mut [f64]) {
    let p = knots.degree();
    let t = knots.knots();
    let values = triangle(t, span, xi, p);
    out[..=p].copy_from_slice(&values[p][..=p]);
    for j in 0..=p {
        let mut a = [0.0; ORDER];
        a[0] = 1.0;
        let mut factor = 1.0;
        for k in 1..=order.min(p) {
            factor *= (p + 1 - k) as f64;
            let mut sum = 0.0;
            // Function i + m of degree p - k has the place j + m - k in row p - k; places outside are zero functions.
            for m in (0..=k).rev() {
                let before = if m > 0 { a[m - 1] } else { 0.0 };
                let place = j + m;
                if place < k || place > p {
                    a[m] = 0.0;
                    continue;
                }
                a[m] = (a[m] - before) / support(t, span, p - k, place - k);
                sum += a[m] * values[p - k][place - k];
            }
            out[k * (p + 1) + j] = factor * sum;
        }
    }
    for k in p + 1..=order {
        out[k * (p + 1)..(k + 1) * (p + 1)].fill(0.0);
    }
}

/// The functions of all degrees up to p on one span: row q, place j holds N_{s-q+j, q}, j = 0 ..= q.
fn triangle(t: &[f64], s: usize, x: f64, p: usize) -> [[f64; ORDER]; ORDER] {
    let mut values = [[0.0; ORDER]; ORDER];
    values[0][0] = 1.0;
    for q in 1..=p {
        let mut from_left = 0.0;
        for j in 0..q {
            let share = values[q - 1][j] / support(t, s, q - 1, j);
            values[q][j] = from_left + (t[s + 1 + j] - x) * share;
            from_left = (x - t[s + 1 + j - q]) * share;
        }
        values[q][q] = from_left;
    }
    values
}

/// Length t_{s+1+j} - t_{s-q+j} of the support of function s - q + j of degree q. It holds the span: not zero.
fn support(t: &[f64], s: usize, q: usize, j: usize) -> f64 {
    t[s + 1 + j] - t[s + j - q]
}
