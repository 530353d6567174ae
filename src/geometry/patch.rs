//! NURBS patches: the body as one smooth map from a box of parameters to space (2.24-2.25).
//!
//!   x(xi) = sum_i R_i(xi) P_i,    R_i = w_i N_i / W,    W = sum_j w_j N_j,    N_i = product over directions of N_{i_a}(xi_a)
//!
//! P_i: control points in metres, on a grid in C order (last index fastest); w_i > 0: weights; N: B-splines (`basis`).
//! The same functions R carry the displacement in isogeometric analysis. Their gradients in space are
//!
//!   dR_i/dxi = (d(w_i N_i)/dxi - R_i dW/dxi) / W,    J_ab = dx_a/dxi_b = sum_i P_i,a dR_i/dxi_b,    dR_i/dx = J^-T dR_i/dxi.
//!
//! A patch has 2 or 3 directions. In the plane z = 0 everywhere, the third index is 0 and J_33 = 1, so that the
//! determinant of J is the area factor in 2D and the volume factor in 3D.

use super::basis;
use super::grid::Grid;
use super::knots::{KnotVector, MAX_DEGREE};
use crate::error::{Error, Result};

/// Most control points of a patch: three degrees of freedom each are numbered in u32, whose last value means "fixed".
pub(super) const MAX_NODES: usize = (u32::MAX / 3) as usize - 1;

/// A tensor-product NURBS patch in the plane or in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    knots: Vec<KnotVector>,
    points: Vec<[f64; 3]>,
    weights: Vec<f64>,
}

/// What [`Patch::shape_functions`] computes at one point, and its work space. Made by [`Patch::workspace`].
#[derive(Debug, Clone)]
pub struct ShapeFunctions {
    /// R of the (p + 1)^d local control points, in the order of [`Patch::element_nodes`].
    pub values: Vec<f64>,
    /// dR/dx in space (1/m) of the same; zero where `determinant` is zero.
    pub gradients: Vec<[f64; 3]>,
    /// The point x (m).
    pub point: [f64; 3],
    /// dx_a/dxi_b (row a, column b).
    pub jacobian: [[f64; 3]; 3],
    /// Determinant of the Jacobian: area or volume per unit of parameter.
    pub determinant: f64,
    basis: [DirectionBasis; 3],
}

/// Values, then first derivatives, of the p + 1 functions of one direction.
type DirectionBasis = [f64; 2 * (MAX_DEGREE + 1)];

impl Patch {
    /// A patch from one knot vector a direction and a point and a weight for every node of the control grid.
    ///
    /// # Errors
    /// [`Error::Input`] with the key `geometry.knots`, `geometry.points` or `geometry.weights` (and the index of the
    /// entry): 2 or 3 directions, counts that agree, finite points (z = 0 in 2D), finite positive weights.
    pub fn new(knots: Vec<KnotVector>, points: Vec<[f64; 3]>, weights: Vec<f64>) -> Result<Self> {
        if knots.len() != 2 && knots.len() != 3 {
            let message = format!("{} directions", knots.len());
            return Err(Error::input("geometry.knots", message, "a patch has 2 or 3 directions"));
        }
        let shape: Vec<usize> = knots.iter().map(KnotVector::len).collect();
        let nodes = shape.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        check_count("geometry.points", "control points", &shape, nodes, points.len())?;
        check_count("geometry.weights", "weights", &shape, nodes, weights.len())?;
        for (i, point) in points.iter().enumerate() {
            if point.iter().any(|x| !x.is_finite()) || (knots.len() == 2 && point[2] != 0.0) {
                let message = format!("control point {i} is {point:?}");
                let help = if knots.len() == 2 { "finite numbers, and z = 0 in 2D" } else { "finite numbers" };
                return Err(Error::input(format!("geometry.points[{i}]"), message, help));
            }
        }
        if let Some(i) = weights.iter().position(|&weight| !(weight > 0.0 && weight.is_finite())) {
            let message = format!("weight {i} is {}", weights[i]);
            return Err(Error::input(format!("geometry.weights[{i}]"), message, "weights are positive and finite"));
        }
        Ok(Self { knots, points, weights })
    }

    /// The same knots and weights with other points: a field over this patch, such as a displacement, as a patch of its own.
    ///
    /// # Errors
    /// Those of [`Patch::new`].
    pub fn with_points(&self, points: Vec<[f64; 3]>) -> Result<Self> {
        Self::new(self.knots.clone(), points, self.weights.clone())
    }

    /// Number of directions, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.knots.len()
    }

    /// The control grid.
    pub fn grid(&self) -> Grid {
        let shape: Vec<usize> = self.knots.iter().map(KnotVector::len).collect();
        Grid::new(&shape)
    }

    /// Control points (m) in C order of the grid.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Weights in C order of the grid.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Knot vector of direction `a`.
    pub fn knots(&self, a: usize) -> &KnotVector {
        &self.knots[a]
    }

    /// Degree of each direction, 0 for the one that a plane patch does not have.
    pub fn degree(&self) -> [usize; 3] {
        std::array::from_fn(|a| self.knots.get(a).map_or(0, KnotVector::degree))
    }

    /// The elements: triples of span indices in C order, the third 0 in 2D.
    pub fn elements(&self) -> Vec<[usize; 3]> {
        let spans: [Vec<usize>; 3] = std::array::from_fn(|a| self.knots.get(a).map_or(vec![0], KnotVector::spans));
        let mut elements = Vec::with_capacity(spans.iter().map(Vec::len).product());
        for &i in &spans[0] {
            for &j in &spans[1] {
                elements.extend(spans[2].iter().map(|&k| [i, j, k]));
            }
        }
        elements
    }

    /// Parameters at the start and at the end of an element; 0 and 0 in the direction that a plane patch does not have.
    pub fn element_bounds(&self, span: [usize; 3]) -> ([f64; 3], [f64; 3]) {
        let knot = |a: usize, after: usize| self.knots.get(a).map_or(0.0, |knots| knots.knots()[span[a] + after]);
        (std::array::from_fn(|a| knot(a, 0)), std::array::from_fn(|a| knot(a, 1)))
    }

    /// Writes the (p + 1)^d nodes that act on an element into `out`, in C order.
    pub fn element_nodes(&self, span: [usize; 3], out: &mut Vec<u32>) {
        let degree = self.degree();
        let first_node = self.rows(span);
        out.clear();
        for i in 0..=degree[0] {
            for j in 0..=degree[1] {
                let first = first_node(i, j);
                out.extend((first..=first + degree[2]).map(|node| node as u32));
            }
        }
    }

    /// Work space for [`Patch::shape_functions`] of this patch.
    pub fn workspace(&self) -> ShapeFunctions {
        let local = self.degree().iter().map(|p| p + 1).product();
        let mut basis = [[0.0; 2 * (MAX_DEGREE + 1)]; 3];
        basis[2][0] = 1.0;
        ShapeFunctions {
            values: vec![0.0; local],
            gradients: vec![[0.0; 3]; local],
            point: [0.0; 3],
            jacobian: [[0.0; 3]; 3],
            determinant: 0.0,
            basis,
        }
    }

    /// Shape functions, their gradients in space, the point and the Jacobian at parameter `xi` of element `span`.
    ///
    /// Allocates nothing. Where the determinant is zero (a collapsed face) the gradients are zero and the caller looks
    /// at [`ShapeFunctions::determinant`].
    ///
    /// # Panics
    /// When `out` is the work space of a patch of another degree.
    pub fn shape_functions(&self, span: [usize; 3], xi: [f64; 3], out: &mut ShapeFunctions) {
        for (a, knots) in self.knots.iter().enumerate() {
            basis::derivatives(knots, span[a], xi[a], 1, &mut out.basis[a]);
        }
        let sums = self.weighted_functions(span, out);
        let inverse_weight = 1.0 / sums.weight;
        let relative_slope = sums.weight_slope.map(|slope| slope * inverse_weight);
        out.point = sums.point.map(|x| x * inverse_weight);
        for a in 0..3 {
            for b in 0..self.dimension() {
                out.jacobian[a][b] = (sums.point_slope[a][b] - out.point[a] * sums.weight_slope[b]) * inverse_weight;
            }
        }
        if self.dimension() == 2 {
            out.jacobian[2] = [0.0, 0.0, 1.0];
        }
        let (inverse, determinant) = invert(&out.jacobian);
        out.determinant = determinant;
        for (value, gradient) in out.values.iter_mut().zip(&mut out.gradients) {
            *value *= inverse_weight;
            let slope: [f64; 3] = std::array::from_fn(|b| gradient[b] * inverse_weight - *value * relative_slope[b]);
            *gradient =
                std::array::from_fn(|a| slope[0] * inverse[0][a] + slope[1] * inverse[1][a] + slope[2] * inverse[2][a]);
        }
    }

    /// Puts w_i N_i into `out.values` and its parametric derivatives into `out.gradients`; returns their sums.
    fn weighted_functions(&self, span: [usize; 3], out: &mut ShapeFunctions) -> Sums {
        let degree = self.degree();
        let first_node = self.rows(span);
        let [u, v, w] = &out.basis;
        let (du, dv, dw) = (&u[degree[0] + 1..], &v[degree[1] + 1..], &w[degree[2] + 1..]);
        let mut sums = Sums::default();
        let mut local = 0;
        for i in 0..=degree[0] {
            for j in 0..=degree[1] {
                let row = first_node(i, j);
                for k in 0..=degree[2] {
                    let weight = self.weights[row + k];
                    let value = weight * u[i] * v[j] * w[k];
                    let slope =
                        [weight * du[i] * v[j] * w[k], weight * u[i] * dv[j] * w[k], weight * u[i] * v[j] * dw[k]];
                    out.values[local] = value;
                    out.gradients[local] = slope;
                    sums.add(value, slope, &self.points[row + k]);
                    local += 1;
                }
            }
        }
        sums
    }

    /// The point of the body (m) at parameter `xi`.
    pub fn evaluate(&self, xi: [f64; 3]) -> [f64; 3] {
        let degree = self.degree();
        let mut span = [0; 3];
        let mut values = [[0.0; MAX_DEGREE + 1]; 3];
        values[2][0] = 1.0;
        for (a, knots) in self.knots.iter().enumerate() {
            span[a] = knots.find_span(xi[a]);
            basis::derivatives(knots, span[a], xi[a], 0, &mut values[a]);
        }
        let first_node = self.rows(span);
        let (mut weight, mut point) = (0.0, [0.0; 3]);
        for i in 0..=degree[0] {
            for j in 0..=degree[1] {
                let row = first_node(i, j);
                for k in 0..=degree[2] {
                    let value = self.weights[row + k] * values[0][i] * values[1][j] * values[2][k];
                    weight += value;
                    for (sum, x) in point.iter_mut().zip(&self.points[row + k]) {
                        *sum += value * x;
                    }
                }
            }
        }
        point.map(|x| x / weight)
    }

    /// Number of the first node in local row (i, j) of an element.
    fn rows(&self, span: [usize; 3]) -> impl Fn(usize, usize) -> usize + use<> {
        let ([_, n1, n2], degree) = (self.extents(), self.degree());
        let first: [usize; 3] = std::array::from_fn(|a| span[a] - degree[a]);
        move |i, j| ((first[0] + i) * n1 + first[1] + j) * n2 + first[2]
    }

    /// Control points along each of three directions, 1 where there is none.
    fn extents(&self) -> [usize; 3] {
        std::array::from_fn(|a| self.knots.get(a).map_or(1, KnotVector::len))
    }
}

/// Sums over the local control points of w N, w N x and their parametric derivatives.
#[derive(Default)]
struct Sums {
    weight: f64,
    weight_slope: [f64; 3],
    point: [f64; 3],
    point_slope: [[f64; 3]; 3],
}

impl Sums {
    fn add(&mut self, value: f64, slope: [f64; 3], x: &[f64; 3]) {
        self.weight += value;
        for a in 0..3 {
            self.weight_slope[a] += slope[a];
            self.point[a] += value * x[a];
            for (sum, slope) in self.point_slope[a].iter_mut().zip(&slope) {
                *sum += slope * x[a];
            }
        }
    }
}

/// Inverse and determinant of a 3 x 3 matrix; the inverse is zero when the determinant is.
pub(crate) fn invert(m: &[[f64; 3]; 3]) -> ([[f64; 3]; 3], f64) {
    let cofactor = |a: usize, b: usize| {
        let (r, s, c, d) = ((a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3);
        m[r][c] * m[s][d] - m[r][d] * m[s][c]
    };
    let determinant = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    if determinant == 0.0 {
        return ([[0.0; 3]; 3], 0.0);
    }
    (std::array::from_fn(|b| std::array::from_fn(|a| cofactor(a, b) / determinant)), determinant)
}

/// Refuses a list whose length is not the number of nodes.
fn check_count(key: &str, what: &str, shape: &[usize], nodes: Option<usize>, given: usize) -> Result<()> {
    match nodes {
        Some(nodes) if nodes == given && nodes <= MAX_NODES => Ok(()),
        _ => {
            let message = format!("{given} {what}, but the knots make a grid of {shape:?} nodes");
            Err(Error::input(
                key,
                message,
                "one for every node: the product of (knots - degree - 1) over the directions",
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;

    fn one_cell(points: Vec<[f64; 3]>, weights: Vec<f64>) -> Result<Patch> {
        let knots = KnotVector::open_uniform(1, 2).unwrap();
        Patch::new(vec![knots.clone(), knots], points, weights)
    }

    #[test]
    fn bad_patches_are_refused_with_their_index() {
        let square = vec![[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
        let with = |i: usize, a: usize, x: f64| {
            let mut points = square.clone();
            points[i][a] = x;
            points
        };
        let cases = [
            (one_cell(square[..3].to_vec(), vec![1.0; 4]), "geometry.points"),
            (one_cell(square.clone(), vec![1.0; 5]), "geometry.weights"),
            (one_cell(with(2, 1, f64::NAN), vec![1.0; 4]), "geometry.points[2]"),
            (one_cell(with(1, 0, f64::INFINITY), vec![1.0; 4]), "geometry.points[1]"),
            (one_cell(with(3, 2, 0.5), vec![1.0; 4]), "geometry.points[3]"),
            (one_cell(square.clone(), vec![1.0, 1.0, 1.0, 0.0]), "geometry.weights[3]"),
            (one_cell(square.clone(), vec![1.0, -1.0, 1.0, 1.0]), "geometry.weights[1]"),
            (one_cell(square.clone(), vec![f64::NAN, 1.0, 1.0, 1.0]), "geometry.weights[0]"),
            (Patch::new(vec![KnotVector::open_uniform(1, 2).unwrap()], vec![], vec![]), "geometry.knots"),
        ];
        for (result, place) in cases {
            match result {
                Err(Error::Input { key, .. }) => assert_eq!(key, place),
                other => panic!("{place}: {other:?}"),
            }
        }
        assert!(one_cell(square, vec![1e-300; 4]).is_ok());
    }

    #[test]
    fn a_collapsed_point_has_no_gradients() {
        let ball = shapes::find("ball_octant").unwrap();
        let patch = (ball.build)(&ball.default_request()).unwrap();
        let mut out = patch.workspace();
        patch.shape_functions(patch.elements()[0], [0.2, 0.3, 0.0], &mut out);
        assert_eq!(out.determinant, 0.0);
        assert!(out.gradients.iter().flatten().all(|&slope| slope == 0.0));
        assert!((out.values.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn elements_and_their_nodes_are_in_c_order() {
        let plate = shapes::find("plate").unwrap();
        let patch = (plate.build)(&plate.default_request()).unwrap();
        let (elements, mut nodes) = (patch.elements(), Vec::new());
        assert_eq!((elements.len(), elements[1]), (25, [2, 3, 1]));
        patch.element_nodes(elements[1], &mut nodes);
        assert_eq!(nodes, [2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 30, 31, 32, 33, 34, 35]);
        assert_eq!(patch.element_bounds(elements[1]), ([0.0, 0.2, 0.0], [0.2, 0.4, 1.0]));
    }
}
