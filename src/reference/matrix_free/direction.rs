//! One direction of a spline body, tabulated at its Gauss points.
//!
//! A span is mapped to the reference interval [-1, 1] by its half length h. At Gauss point q of a span the functions
//! have the values B_qj and the reference derivatives dB_qj. A polynomial that is known at the Gauss points x_q (as many
//! as it has coefficients, or more) has there the derivatives
//!
//! ```text
//! v'(x_q) = sum_r C_qr v(x_r),   C_qr = (c_r / c_q) / (x_q - x_r),   C_qq = -sum_(r != q) C_qr,
//! c_q = 1 / product over r != q of (x_q - x_r)
//! ```
//!
//! (J.-P. Berrut, L. N. Trefethen, SIAM Rev. 46, 2004). C is the same for all spans: derivatives cost one contraction
//! with a constant matrix.

use crate::geometry::basis;
use crate::geometry::gauss::gauss_legendre;
use crate::geometry::knots::KnotVector;

/// A tabulated direction.
#[derive(Debug, Clone)]
pub(super) struct Direction {
    /// Functions n.
    pub functions: usize,
    /// Functions p + 1 that act on a span.
    pub order: usize,
    /// Gauss points in a span.
    pub points: usize,
    /// First function that acts on each span.
    pub first: Vec<usize>,
    /// Index of the knot at the start of each span.
    pub spans: Vec<usize>,
    /// Parameter at the middle, and half length, of each span.
    pub middles: Vec<[f64; 2]>,
    /// B: span e, point q, function j at `(e * points + q) * order + j`.
    pub values: Vec<f64>,
    /// Derivatives of the functions on [-1, 1], stored like the values.
    pub slopes: Vec<f64>,
    /// C, row-major.
    pub collocation: Vec<f64>,
    /// Gauss points on [-1, 1].
    pub places: Vec<f64>,
    /// Gauss weights on [-1, 1].
    pub weights: Vec<f64>,
}

impl Direction {
    /// The direction of a knot vector with degree + 1 + `extra` Gauss points a span.
    pub fn new(knots: &KnotVector, extra: usize) -> Self {
        let (order, spans) = (knots.degree() + 1, knots.spans());
        let points = order + extra;
        let (places, weights) = gauss_legendre(points);
        let mut direction = Self {
            functions: knots.len(),
            order,
            points,
            first: spans.iter().map(|span| span + 1 - order).collect(),
            middles: Vec::new(),
            values: Vec::new(),
            slopes: Vec::new(),
            collocation: collocation(&places),
            places,
            weights,
            spans: spans.clone(),
        };
        let mut table = vec![0.0; 2 * order];
        for span in spans {
            let (start, end) = (knots.knots()[span], knots.knots()[span + 1]);
            let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
            direction.middles.push([middle, half]);
            for place in &direction.places {
                basis::derivatives(knots, span, middle + half * place, 1, &mut table);
                direction.values.extend_from_slice(&table[..order]);
                direction.slopes.extend(table[order..].iter().map(|slope| half * slope));
            }
        }
        direction
    }

    /// The direction that a plane body does not have: one function, which is 1.
    pub fn absent() -> Self {
        Self {
            functions: 1,
            order: 1,
            points: 1,
            first: vec![0],
            spans: vec![0],
            middles: vec![[0.0, 1.0]],
            values: vec![1.0],
            slopes: vec![0.0],
            collocation: vec![0.0],
            places: vec![0.0],
            weights: vec![1.0],
        }
    }

    /// Number of spans.
    pub fn elements(&self) -> usize {
        self.first.len()
    }

    /// B of one span: points x order, row-major.
    pub fn values_of(&self, element: usize) -> &[f64] {
        let size = self.points * self.order;
        &self.values[element * size..][..size]
    }

    /// Derivatives on [-1, 1] of one span, like [`Direction::values_of`].
    pub fn slopes_of(&self, element: usize) -> &[f64] {
        let size = self.points * self.order;
        &self.slopes[element * size..][..size]
    }
}

/// The transpose of a row-major matrix with `columns` columns.
pub(super) fn transposed(matrix: &[f64], columns: usize) -> Vec<f64> {
    (0..columns).flat_map(|c| matrix.iter().skip(c).step_by(columns).copied()).collect()
}

fn collocation(places: &[f64]) -> Vec<f64> {
    let n = places.len();
    let others = |q: usize| places.iter().enumerate().filter(move |&(r, _)| r != q).map(|(_, x)| *x);
    let factor: Vec<f64> = (0..n).map(|q| 1.0 / others(q).map(|x| places[q] - x).product::<f64>()).collect();
    let mut matrix = vec![0.0; n * n];
    for q in 0..n {
        for r in (0..n).filter(|&r| r != q) {
            let entry = factor[r] / factor[q] / (places[q] - places[r]);
            matrix[q * n + r] = entry;
            matrix[q * n + q] -= entry;
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_between_gauss_points_are_those_of_the_functions() {
        let knots = KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 0.3, 0.5, 0.5, 2.0, 2.0, 2.0, 2.0]).expect("knots");
        for extra in [0, 2] {
            let direction = Direction::new(&knots, extra);
            let (m, n) = (direction.order, direction.points);
            for e in 0..direction.elements() {
                let (values, slopes) = (direction.values_of(e), direction.slopes_of(e));
                for (q, row) in direction.collocation.chunks_exact(n).enumerate() {
                    for j in 0..m {
                        let slope: f64 = row.iter().enumerate().map(|(r, c)| c * values[r * m + j]).sum();
                        assert!((slope - slopes[q * m + j]).abs() < 1e-13, "span {e}, point {q}, function {j}");
                    }
                }
            }
            assert_eq!(direction.first, [0, 1, 3]);
        }
    }
}
