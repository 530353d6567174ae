//! Gauss points of a knot span, and of its faces.
//!
//! A span is a box in parameter space; its rule is the product of one-dimensional Gauss rules (see
//! [`crate::geometry::gauss`]). The weight of a point is dxi deta dzeta: times |det dx/dxi| it is a volume. On a face
//! one direction is held at an end of the span and has no part in the weight.

use crate::geometry::gauss::gauss_legendre;
use crate::geometry::patch::Patch;

/// Points and weights on [-1, 1] for each direction.
#[derive(Debug, Clone)]
pub(super) struct TensorRule {
    points: [Vec<f64>; 3],
    weights: [Vec<f64>; 3],
    integrated: [bool; 3],
}

impl TensorRule {
    /// degree + 1 + `extra` points in each direction of the patch.
    pub fn of_spans(patch: &Patch, extra: usize) -> Self {
        let mut rule =
            Self { points: [const { Vec::new() }; 3], weights: [const { Vec::new() }; 3], integrated: [false; 3] };
        for a in 0..3 {
            rule.integrated[a] = a < patch.dimension();
            (rule.points[a], rule.weights[a]) = match rule.integrated[a] {
                true => gauss_legendre(patch.degree()[a] + 1 + extra),
                false => (vec![0.0], vec![1.0]),
            };
        }
        rule
    }

    /// The rule of the face where `direction` is at the start (or the end) of the span.
    pub fn of_face(patch: &Patch, extra: usize, direction: usize, at_end: bool) -> Self {
        let mut rule = Self::of_spans(patch, extra);
        rule.integrated[direction] = false;
        rule.points[direction] = vec![if at_end { 1.0 } else { -1.0 }];
        rule.weights[direction] = vec![1.0];
        rule
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.iter().map(Vec::len).product()
    }

    /// Parametric place and weight of each point in the span from `start` to `end`, last direction fastest.
    pub fn points(&self, start: [f64; 3], end: [f64; 3]) -> impl Iterator<Item = ([f64; 3], f64)> + '_ {
        let [_, n1, n2] = [0, 1, 2].map(|a| self.points[a].len());
        (0..self.len()).map(move |q| {
            let index = [q / (n1 * n2), q / n2 % n1, q % n2];
            let (mut xi, mut weight) = ([0.0; 3], 1.0);
            for a in 0..3 {
                let half = 0.5 * (end[a] - start[a]);
                xi[a] = 0.5 * (start[a] + end[a]) + half * self.points[a][index[a]];
                weight *= self.weights[a][index[a]] * if self.integrated[a] { half } else { 1.0 };
            }
            (xi, weight)
        })
    }
}
