//! Small dense problems: a damped linear least-squares step inside a box.
//!
//! A damped Gauss-Newton step d solves
//!
//! min 1/2 |J d|^2 + 1/2 sum_i w_i d_i^2 + g^T d,   lower <= d <= upper,
//!
//! with the Jacobian J (rows x m) and the damping w_i > 0. [`LeastSquares::minimise_in_box`] is the projected Newton
//! method of D. P. Bertsekas (SIAM J. Control Optim. 20, 1982): variables pressed against a bound are held, the others
//! take a Newton step, the step is projected into the box and halved until the quadratic falls. It ends when a full step
//! changes nothing, usually after a handful of passes. Where it creeps along bounds instead, an active-set method goes on to the
//! minimum from bound to bound (J. Nocedal and S. J. Wright, Numerical Optimization, algorithm 16.3): where a step ends must be a
//! function of the problem, not of rounding on the way.
//!
//! The Newton step of the free variables F solves (J_F^T J_F + W_F) p = -q, with W = diag(w). With more free variables than rows (one group a
//! spring) the same p comes from a rows x rows system by the identity of Woodbury:
//!
//! p = -W^-1 q + W^-1 J^T (I + J W^-1 J^T)^-1 J W^-1 q.

pub mod rank;

use std::ops::Range;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::matmul::matmul;
use faer::linalg::qr::no_pivoting::factor as qr;
use faer::linalg::solvers::{Llt, Solve};
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

/// Passes of projected Newton; more of them creep.
const PASSES: usize = 25;

/// Part of the first gradient below which a bound is not left: rounding.
const PRESSED: f64 = 1e-13;

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

/// Sum of products.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Projects on what the columns of a matrix do not reach.
pub struct Complement {
    matrix: Mat<f64>,
    factor: Llt<f64>,
}

impl Complement {
    /// Takes columns (rows x columns, column-major). Columns that depend on each other are told apart by a ridge of
    /// `ridge` times their squared lengths; `None` where that is not enough, or a number is not finite.
    ///
    /// # Panics
    /// When the length of `matrix` is not rows times columns.
    pub fn new(matrix: &[f64], rows: usize, columns: usize, ridge: f64) -> Option<Self> {
        let matrix = MatRef::from_column_major_slice(matrix, rows, columns).to_owned();
        let mut gram = product(matrix.transpose(), matrix.as_ref());
        (0..columns).for_each(|i| gram[(i, i)] *= 1.0 + ridge);
        let factor = Llt::new(gram.as_ref(), Side::Lower).ok()?;
        Some(Self { matrix, factor })
    }

    /// Takes from each vector (rows each, one after the other) its nearest combination of the columns; returns the
    /// coefficients of the combinations, one vector after the other.
    pub fn project(&self, vectors: &mut [f64]) -> Vec<f64> {
        let rows = self.matrix.nrows();
        let count = vectors.len() / rows;
        let mut vectors = MatMut::from_column_major_slice_mut(vectors, rows, count);
        let coefficients = self.factor.solve(&product(self.matrix.transpose(), vectors.as_ref()));
        matmul(vectors.as_mut(), Accum::Add, self.matrix.as_ref(), coefficients.as_ref(), -1.0, Par::Seq);
        (0..count).flat_map(|j| (0..coefficients.nrows()).map(move |i| (i, j))).map(|at| coefficients[at]).collect()
    }

    /// (M^T M)^-1 of the columns M, with the ridge (columns x columns).
    pub fn inverse(&self) -> Vec<f64> {
        let m = self.matrix.ncols();
        let inverse = self.factor.solve(&Mat::<f64>::identity(m, m));
        (0..m * m).map(|at| inverse[(at % m, at / m)]).collect()
    }
}

/// The quadratic part of a linear least-squares problem, prepared for several dampings.
pub struct LeastSquares {
    /// Rows x m.
    jacobian: Mat<f64>,
    /// J^T J + C, when J has at least as many rows as columns.
    gram: Option<Mat<f64>>,
    /// C, where there is one.
    curvature: Option<Mat<f64>>,
}

impl LeastSquares {
    /// Takes a Jacobian (rows x columns, column-major).
    ///
    /// # Panics
    /// When the length of `jacobian` is not rows times columns.
    pub fn new(jacobian: &[f64], rows: usize, columns: usize) -> Self {
        let jacobian = MatRef::from_column_major_slice(jacobian, rows, columns).to_owned();
        let gram = (columns <= rows).then(|| product(jacobian.transpose(), jacobian.as_ref()));
        Self { jacobian, gram, curvature: None }
    }

    /// The same with J^T J + C in the place of J^T J: C (columns x columns) is symmetric, what the residual itself adds to the second
    /// derivative of 1/2 |r|^2. The sum need not be definite.
    ///
    /// # Panics
    /// When C is of another size, or J has fewer rows than columns.
    pub fn with_curvature(jacobian: &[f64], rows: usize, columns: usize, curvature: &[f64]) -> Self {
        let mut model = Self::new(jacobian, rows, columns);
        let curvature = MatRef::from_column_major_slice(curvature, columns, columns).to_owned();
        *model.gram.as_mut().expect("as many rows as columns") += &curvature;
        Self { curvature: Some(curvature), ..model }
    }

    /// Squared norm of every column.
    pub fn column_squares(&self) -> Vec<f64> {
        (0..self.jacobian.ncols()).map(|j| self.jacobian.col(j).squared_norm_l2()).collect()
    }

    /// J^T r.
    pub fn transposed(&self, residual: &[f64]) -> Vec<f64> {
        let r = MatRef::from_column_major_slice(residual, residual.len(), 1);
        to_vec(&product(self.jacobian.transpose(), r))
    }

    /// |J d|^2 + d . C d.
    pub fn square(&self, d: &[f64]) -> f64 {
        let column = MatRef::from_column_major_slice(d, d.len(), 1);
        let bent = self.curvature.as_ref().map_or(0.0, |c| dot(d, &to_vec(&product(c.as_ref(), column))));
        product(self.jacobian.as_ref(), column).squared_norm_l2() + bent
    }

    /// The minimiser in the box; all slices of length m, weights positive, lower <= upper. `None` when a Newton system is not positive definite (a Jacobian that is not finite, or no damping on columns that depend on each
    /// other).
    ///
    /// # Panics
    /// When the slices do not fit together.
    pub fn minimise_in_box(&self, weights: &[f64], g: &[f64], lower: &[f64], upper: &[f64]) -> Option<Vec<f64>> {
        let m = self.jacobian.ncols();
        assert!([weights.len(), g.len(), lower.len(), upper.len()] == [m; 4], "one number for every column");
        let mut d: Vec<f64> = lower.iter().zip(upper).map(|(low, high)| 0.0_f64.clamp(*low, *high)).collect();
        let mut gradient = self.gradient(weights, g, &d);
        for _ in 0..PASSES {
            let free: Vec<usize> = (0..m)
                .filter(|&i| !(d[i] <= lower[i] && gradient[i] >= 0.0 || d[i] >= upper[i] && gradient[i] <= 0.0))
                .collect();
            if free.is_empty() {
                break;
            }
            let step = self.newton_step(weights, &gradient, &free)?;
            let before = value(&d, &gradient, g);
            let mut length = 1.0;
            loop {
                let mut trial = d.clone();
                for (&i, s) in free.iter().zip(&step) {
                    trial[i] = (d[i] + length * s).clamp(lower[i], upper[i]);
                }
                if trial == d || length < 1e-3 {
                    return self.along_bounds(weights, g, [lower, upper], d);
                }
                let there = self.gradient(weights, g, &trial);
                let descent: f64 = trial.iter().zip(&d).zip(&gradient).map(|((t, d), q)| (t - d) * q).sum();
                if value(&trial, &there, g) <= before + 1e-4 * descent {
                    let whole = length == 1.0 && free.iter().zip(&step).all(|(&i, s)| trial[i] == d[i] + s);
                    (d, gradient) = (trial, there);
                    if whole && stays(&d, &gradient, lower, upper) {
                        return Some(d);
                    }
                    break;
                }
                length *= 0.5;
            }
        }
        self.along_bounds(weights, g, [lower, upper], d)
    }

    /// The minimiser in the box, from a place in it: to the minimum of a face or to the first bound on the way, which is then held;
    /// at the minimum of a face the bound that is pressed least is left. The quadratic falls from face to face, so it ends.
    fn along_bounds(&self, weights: &[f64], g: &[f64], bounds: [&[f64]; 2], mut d: Vec<f64>) -> Option<Vec<f64>> {
        let m = d.len();
        let [lower, upper] = bounds;
        let rounding = PRESSED * g.iter().fold(0.0_f64, |largest, g| largest.max(g.abs()));
        let mut held: Vec<bool> = (0..m).map(|i| d[i] <= lower[i] || d[i] >= upper[i]).collect();
        for _ in 0..10 * m + 100 {
            let gradient = self.gradient(weights, g, &d);
            let free: Vec<usize> = (0..m).filter(|&i| !held[i]).collect();
            let step = if free.is_empty() { vec![] } else { self.newton_step(weights, &gradient, &free)? };
            let (mut length, mut blocking) = (1.0, None);
            for (&i, &s) in free.iter().zip(&step).filter(|(_, s)| **s != 0.0) {
                let bound = if s > 0.0 { upper[i] } else { lower[i] };
                if (bound - d[i]) / s < length {
                    (length, blocking) = ((bound - d[i]) / s, Some((i, bound)));
                }
            }
            free.iter().zip(&step).for_each(|(&i, s)| d[i] = (d[i] + length * s).clamp(lower[i], upper[i]));
            if let Some((i, bound)) = blocking {
                (d[i], held[i]) = (bound, true);
                continue;
            }
            let gradient = self.gradient(weights, g, &d);
            let pull = |i: usize| if d[i] <= lower[i] { -gradient[i] } else { gradient[i] };
            let leaves = (0..m).filter(|&i| held[i] && lower[i] < upper[i] && pull(i) > rounding);
            match leaves.max_by(|&a, &b| pull(a).total_cmp(&pull(b))) {
                Some(i) => held[i] = false,
                None => break,
            }
        }
        Some(d)
    }

    /// J^T J d + W d + g.
    fn gradient(&self, weights: &[f64], g: &[f64], d: &[f64]) -> Vec<f64> {
        let column = MatRef::from_column_major_slice(d, d.len(), 1);
        let bent = match &self.gram {
            Some(gram) => product(gram.as_ref(), column),
            None => product(self.jacobian.transpose(), product(self.jacobian.as_ref(), column).as_ref()),
        };
        (0..d.len()).map(|i| bent[(i, 0)] + weights[i] * d[i] + g[i]).collect()
    }

    /// The Newton step of the free variables.
    fn newton_step(&self, weights: &[f64], gradient: &[f64], free: &[usize]) -> Option<Vec<f64>> {
        let rows = self.jacobian.nrows();
        let right = Mat::from_fn(free.len(), 1, |i, _| -gradient[free[i]]);
        if free.len() > rows {
            return self.dual_step(weights, &right, free);
        }
        let mut block = match &self.gram {
            Some(gram) => Mat::from_fn(free.len(), free.len(), |i, j| gram[(free[i], free[j])]),
            None => {
                let columns = Mat::from_fn(rows, free.len(), |i, j| self.jacobian[(i, free[j])]);
                product(columns.transpose(), columns.as_ref())
            }
        };
        (0..free.len()).for_each(|i| block[(i, i)] += weights[free[i]]);
        let factor = Llt::new(block.as_ref(), Side::Lower).ok()?;
        Some(to_vec(&factor.solve(&right)))
    }

    /// The same step from a rows x rows system (module page).
    fn dual_step(&self, weights: &[f64], right: &Mat<f64>, free: &[usize]) -> Option<Vec<f64>> {
        let rows = self.jacobian.nrows();
        let columns = Mat::from_fn(rows, free.len(), |i, j| self.jacobian[(i, free[j])]);
        let scaled = Mat::from_fn(rows, free.len(), |i, j| columns[(i, j)] / weights[free[j]]);
        let mut system = product(scaled.as_ref(), columns.transpose());
        (0..rows).for_each(|i| system[(i, i)] += 1.0);
        let factor = Llt::new(system.as_ref(), Side::Lower).ok()?;
        let inner = factor.solve(&product(scaled.as_ref(), right.as_ref()));
        let back = product(scaled.transpose(), inner.as_ref());
        Some((0..free.len()).map(|i| right[(i, 0)] / weights[free[i]] - back[(i, 0)]).collect())
    }
}

/// The quadratic at d from its gradient there: 1/2 d.(gradient + g).
fn value(d: &[f64], gradient: &[f64], g: &[f64]) -> f64 {
    0.5 * (dot(d, gradient) + dot(d, g))
}

/// True when no variable at a bound wants to leave it.
fn stays(d: &[f64], gradient: &[f64], lower: &[f64], upper: &[f64]) -> bool {
    !(0..d.len()).any(|i| d[i] <= lower[i] && gradient[i] < 0.0 || d[i] >= upper[i] && gradient[i] > 0.0)
}

fn product(a: MatRef<f64>, b: MatRef<f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(c.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

fn to_vec(column: &Mat<f64>) -> Vec<f64> {
    (0..column.nrows()).map(|i| column[(i, 0)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;
    use proptest::prelude::*;

    #[test]
    fn the_unconstrained_minimum_is_the_newton_step() {
        // J^T J + W = [[4, 1], [1, 3]]
        let problem = LeastSquares::new(&[1.0, 1.0, 1.0, 0.0], 2, 2);
        let d = problem.minimise_in_box(&[2.0, 2.0], &[1.0, 2.0], &[-9.0; 2], &[9.0; 2]).expect("definite");
        assert!((d[0] + 1.0 / 11.0).abs() < 1e-15 && (d[1] + 7.0 / 11.0).abs() < 1e-15, "{d:?}");
        let broken = LeastSquares::new(&[f64::NAN, 1.0], 2, 1);
        assert!(broken.minimise_in_box(&[1.0], &[1.0], &[-1.0], &[1.0]).is_none());
    }

    #[test]
    fn a_box_beside_zero_is_entered() {
        let problem = LeastSquares::new(&[1.0, 0.0, 0.0, 1.0], 2, 2);
        let d = problem.minimise_in_box(&[0.0; 2], &[0.0, -3.0], &[-2.0; 2], &[-1.0, 9.0]).expect("definite");
        assert_eq!(d, [-1.0, 3.0]);
    }

    #[test]
    fn a_complement_is_orthogonal_to_its_columns() {
        let mut stream = Stream::new(3, 0, 0);
        let (rows, columns) = (30, 4);
        let matrix: Vec<f64> = (0..rows * columns).map(|_| stream.normal()).collect();
        let vectors: Vec<f64> = (0..2 * rows).map(|_| stream.normal()).collect();
        let mut rest = vectors.clone();
        let coefficients = Complement::new(&matrix, rows, columns, 0.0).expect("independent").project(&mut rest);
        for (v, (rest, c)) in rest.chunks(rows).zip(coefficients.chunks(columns)).enumerate() {
            assert!(matrix.chunks(rows).all(|column| dot(column, rest).abs() < 1e-13));
            for row in 0..rows {
                let combined: f64 = (0..columns).map(|j| c[j] * matrix[j * rows + row]).sum();
                assert!((rest[row] + combined - vectors[v * rows + row]).abs() < 1e-14);
            }
        }
        assert!(Complement::new(&[1.0, 1.0, 1.0, 1.0], 2, 2, 1e-9).is_some());
    }

    proptest! {
        /// Tall and wide Jacobians: the wide ones take the rows x rows system.
        #[test]
        fn the_minimum_in_a_box_satisfies_the_conditions_of_karush_kuhn_and_tucker(
            seed in 0u64..2000, m in 1usize..20, rows in 1usize..24
        ) {
            let mut stream = Stream::new(seed, 0, 0);
            let jacobian: Vec<f64> = (0..rows * m).map(|_| stream.normal()).collect();
            let residual: Vec<f64> = (0..rows).map(|_| stream.normal()).collect();
            let problem = LeastSquares::new(&jacobian, rows, m);
            let (weights, g) = (vec![0.01; m], problem.transposed(&residual));
            let lower: Vec<f64> = (0..m).map(|_| -0.3 * stream.uniform()).collect();
            let upper: Vec<f64> = (0..m).map(|_| 0.3 * stream.uniform()).collect();
            let d = problem.minimise_in_box(&weights, &g, &lower, &upper).expect("damped, so definite");
            let gradient = problem.gradient(&weights, &g, &d);
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
