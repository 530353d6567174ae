//! The damped step of Gauss-Newton inside bounds: the local model, the chart and the damping.
//!
//! With r(phi + d) ~ r + J d the step solves
//!
//! min |r + J d|^2 + lambda |D d|^2,   0 <= phi + d <= upper,   D = the column norms of J,
//!
//! a convex quadratic in a box, in the coordinates x of the chart phi = c sinh(x). A phi that lies above a bound (a group of
//! springs that has just become smaller) is brought inside by the step.
//!
//! Gauss-Newton leaves out what the residual itself adds to the second derivative, S_ab = sum_i r_i d2r_i/dphi_a dphi_b, and so
//! converges linearly where a residual is left. With S ([`Curvature`]) the model is Newton's and steps converge quadratically: in x it
//! adds (dphi_a/dx_a) S_ab (dphi_b/dx_b) + delta_ab phi_a g_a, g = J^T r, for d2phi/dx2 = phi.

use crate::dense::{self, LeastSquares};

/// The stiffness c of the chart phi = c sinh(x), as a fraction of the median stiffness where a start begins.
const LINEAR_BELOW: f64 = 0.05;

/// First damping, relative to the squared column norms.
pub const DAMPING: f64 = 1e-2;

/// Damping at which a start gives up.
pub const LARGEST_DAMPING: f64 = 1e10;

/// What a residual adds to the second derivative of half its square, in phi.
pub struct Curvature {
    /// S (m x m), symmetric.
    pub second: Vec<f64>,
    /// g = J^T r (m) of the rows that S is of.
    pub gradient: Vec<f64>,
}

/// The local model and the damping of one start.
pub struct Descent {
    /// c of the chart phi = c sinh(x).
    chart: f64,
    /// r; written by the caller before [`Descent::prepare`].
    pub residual: Vec<f64>,
    /// dr/dphi (rows x m, column-major); written by the caller before [`Descent::prepare`], which scales it.
    pub jacobian: Vec<f64>,
    /// S and g; written by the caller before [`Descent::prepare`] where the step is to be Newton's.
    pub curvature: Option<Curvature>,
    /// |J d|^2 in x; made anew at every accepted point.
    model: Option<LeastSquares>,
    /// J^T r in x.
    gradient: Vec<f64>,
    /// lambda.
    pub damping: f64,
    growth: f64,
    /// Largest step of a coordinate x; infinite unless the caller sets it.
    pub reach: f64,
}

impl Descent {
    /// A model around `phi`, inside `upper`.
    pub fn new(phi: &[f64], upper: &[f64]) -> Self {
        let mut sorted: Vec<f64> = phi.iter().copied().filter(|p| *p > 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(upper[0]);
        Self::with_chart(LINEAR_BELOW * median)
    }

    /// A model in the chart of this c.
    pub fn with_chart(chart: f64) -> Self {
        Self {
            chart,
            residual: vec![],
            jacobian: vec![],
            curvature: None,
            model: None,
            gradient: vec![],
            damping: DAMPING,
            growth: 2.0,
            reach: f64::INFINITY,
        }
    }

    /// c of the chart phi = c sinh(x).
    pub fn chart(&self) -> f64 {
        self.chart
    }

    /// True when the error is at the rounding of displacements (percent of the largest).
    pub fn resolved(&self, error: f64) -> bool {
        error < 1e-12
    }

    /// Forms the quadratic model in the coordinates of the chart.
    pub fn prepare(&mut self, phi: &[f64]) {
        let (rows, m) = (self.residual.len(), phi.len());
        let slopes: Vec<f64> = phi.iter().map(|p| (p * p + self.chart * self.chart).sqrt()).collect();
        for (column, slope) in self.jacobian.chunks_exact_mut(rows).zip(&slopes) {
            column.iter_mut().for_each(|entry| *entry *= slope);
        }
        let model = match self.curvature.take() {
            None => LeastSquares::new(&self.jacobian, rows, m),
            Some(Curvature { mut second, gradient }) => {
                second.iter_mut().enumerate().for_each(|(at, entry)| *entry *= slopes[at / m] * slopes[at % m]);
                (0..m).for_each(|a| second[a * m + a] += phi[a] * gradient[a]);
                LeastSquares::with_curvature(&self.jacobian, rows, m, &second)
            }
        };
        self.gradient = model.transposed(&self.residual);
        self.model = Some(model);
    }

    /// The damped step from `phi` inside the bounds and the gain in squared error that the model predicts; `None` when
    /// the damped matrix is not positive definite or nothing moves.
    pub fn step(&self, phi: &[f64], upper: &[f64]) -> Option<(Vec<f64>, f64)> {
        let model = self.model.as_ref()?;
        let squares = model.column_squares();
        let largest = squares.iter().fold(0.0_f64, |a, b| a.max(*b));
        let weights: Vec<f64> = squares.iter().map(|square| self.damping * square.max(1e-12 * largest)).collect();
        let x: Vec<f64> = phi.iter().map(|p| (p / self.chart).asinh()).collect();
        let down: Vec<f64> = x.iter().map(|x| (-x).max(-self.reach)).collect();
        let room = |(u, x): (&f64, &f64)| ((u / self.chart).asinh() - x).min(self.reach);
        // below zero where phi has to come down to its bound, however far
        let up: Vec<f64> = upper.iter().zip(&x).map(room).collect();
        let down: Vec<f64> = down.iter().zip(&up).map(|(down, up)| down.min(*up)).collect();
        let d = model.minimise_in_box(&weights, &self.gradient, &down, &up)?;
        let predicted = -2.0 * dense::dot(&self.gradient, &d) - model.square(&d);
        if predicted.is_nan() || predicted <= 0.0 {
            return None;
        }
        let moved = |i: usize| ((x[i] + d[i]).sinh() * self.chart).clamp(0.0, upper[i]);
        Some(((0..phi.len()).map(moved).collect(), predicted))
    }

    /// The largest difference of a coordinate x of two places.
    pub fn distance(&self, from: &[f64], to: &[f64]) -> f64 {
        let x = |phi: &f64| (phi / self.chart).asinh();
        from.iter().zip(to).fold(0.0, |largest: f64, (a, b)| largest.max((x(a) - x(b)).abs()))
    }

    /// The step with as much more damping as it takes to have one; `None` when there is none however small.
    pub fn damped_step(&mut self, phi: &[f64], upper: &[f64]) -> Option<(Vec<f64>, f64)> {
        while self.damping <= LARGEST_DAMPING {
            let step = self.step(phi, upper);
            if step.is_some() {
                return step;
            }
            self.damp();
        }
        None
    }

    /// After a step that failed.
    pub fn damp(&mut self) {
        self.damping *= self.growth;
        self.growth *= 2.0;
    }

    /// After a step that gained `ratio` times what the model predicted.
    pub fn trust(&mut self, ratio: f64) {
        self.damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(0.1, 2.0);
        self.growth = 2.0;
    }
}
