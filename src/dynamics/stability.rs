//! How large a step may be.
//!
//! Linearised about a state, leapfrog with the damping at the velocity half a step before is
//!
//! ```text
//! M (u_{n+1} - 2 u_n + u_{n-1}) + h C (u_n - u_{n-1}) + h^2 K u_n = 0
//! ```
//!
//! A motion u_n = z^n x solves it when Q(z) x = 0 with Q(z) = M (z - 1)^2 + h C (z - 1) + h^2 K z. With m = x.M x,
//! c = x.C x, k = x.K x every such z is a root of m (z-1)^2 + h c (z-1) + h^2 k z, whose roots are inside the unit circle
//! exactly when 4 m > h^2 k + 2 h c. Conversely Q(-1) = 4 M - 2 h C - h^2 K: where that has a negative eigenvalue, Q turns
//! from indefinite at z = -1 to positive definite at z -> -infinity, so it is singular at some z < -1 and the motion grows.
//! Hence, for any symmetric C whether proportional to M and K or not,
//!
//! ```text
//! stable   <=>   4 M - 2 h C - h^2 K  is positive definite
//! ```
//!
//! For one oscillator this is h < (2/omega)(sqrt(1 + zeta^2) - zeta), without damping h < 2/omega_max. A vector x alone gives
//! the bound h(x) = 4 / (c + sqrt(c^2 + 4 k)) with m = 1; the limit is its minimum over x, found by going from x to the
//! top eigenvector of h(x)^2 K + 2 h(x) C, which converges quadratically and from above. The same way leads to the
//! smallest alpha of the damping (4.18), C = C_1 / alpha, at a given step: alpha(x) = 2 h c_1 / (4 - h^2 k).
//!
//! Searches from a start vector can miss the top eigenvector, so that limit would be too large. It is therefore *proven*:
//! the Cholesky factorisation of 4 M - 2 h C - h^2 K a billionth below the limit must succeed, and succeeds exactly when the
//! matrix is positive definite.
//!
//! The limit is that of small motion about the state. Springs that turn and stretch can be stiffer in other directions;
//! [`super::springs::isotropic`] bounds them all.

use nalgebra_sparse::CsrMatrix;

use crate::dense::dot;
use crate::error::{Error, Result};
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::ordering::minimum_degree;
use crate::sparse::pattern::Pattern;
use std::sync::Arc;

use super::eigen::{self, Pair};
use super::model::Model;
use super::product::multiply;

/// Relative distances below the limit at which it is tried to be proven.
const MARGINS: [f64; 4] = [1e-9, 1e-7, 1e-5, 1e-3];

/// What is subtracted from a limit that is too large to be proven.
const UNPROVEN: f64 = 1e-6;

/// Floating-point operations of a factorisation up to which limits are proven.
const MOST_FLOPS: f64 = 1e11;

/// Iterations of the search, which needs three or four.
const ROUNDS: usize = 20;

/// K, C and M of a body linearised about a state.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// Entries of K and C.
    pub pattern: Pattern,
    /// K in N/m.
    pub stiffness: Vec<f64>,
    /// C in N s/m; all zero without damping.
    pub damping: Vec<f64>,
    /// Lumped masses in kg.
    pub masses: Vec<f64>,
    /// An analysis of the pattern, if there is one.
    pub symbolic: Option<Arc<Symbolic>>,
}

/// What is known about the largest stable step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Largest eigenfrequency sqrt(lambda_max(M^-1 K)), rad/s.
    pub omega_max: f64,
    /// 2 / omega_max, s: the limit without damping, or with the damping centred in time.
    pub undamped: f64,
    /// The limit with the damping half a step late, s.
    pub damped: f64,
    /// The relative margin within which the limits are proven; none where the body is too large for that.
    pub proven: Option<f64>,
}

impl Limit {
    /// The largest step that is safe: below the limit by the margin of its proof. s.
    pub fn safe(&self, limit: f64) -> f64 {
        limit * (1.0 - self.proven.unwrap_or(UNPROVEN))
    }
}

impl Linearised {
    /// The tangents of a model at displacement `u` and at rest.
    pub fn at(model: &mut dyn Model, u: &[f64], symbolic: Option<Arc<Symbolic>>) -> Self {
        let entries = model.pattern().entries();
        let (mut stiffness, mut damping) = (vec![0.0; entries], vec![0.0; entries]);
        model.tangent(u, &vec![0.0; u.len()], &mut stiffness, &mut damping);
        let (pattern, masses) = (model.pattern().clone(), model.masses().to_vec());
        Self { pattern, stiffness, damping, masses, symbolic }
    }

    /// The same body with the damping divided by alpha, or without damping.
    pub fn with_damping_over(&self, alpha: Option<f64>) -> Self {
        let factor = alpha.map_or(0.0, f64::recip);
        Self { damping: self.damping.iter().map(|c| c * factor).collect(), ..self.clone() }
    }

    fn is_damped(&self) -> bool {
        self.damping.iter().any(|&c| c != 0.0)
    }

    /// The top eigenpair of M^-1/2 (k K + c C) M^-1/2.
    fn largest(&self, k: f64, c: f64, start: &[f64]) -> Pair {
        let n = self.masses.len();
        let (mut scaled, mut damped) = (vec![0.0; n], vec![0.0; n]);
        let mut apply = |x: &[f64], out: &mut [f64]| {
            scaled.iter_mut().zip(x.iter().zip(&self.masses)).for_each(|(s, (x, m))| *s = x / m.sqrt());
            multiply(&self.pattern, &self.stiffness, &scaled, out);
            out.iter_mut().for_each(|out| *out *= k);
            if c != 0.0 {
                multiply(&self.pattern, &self.damping, &scaled, &mut damped);
                out.iter_mut().zip(&damped).for_each(|(out, d)| *out += c * d);
            }
            out.iter_mut().zip(&self.masses).for_each(|(out, m)| *out /= m.sqrt());
        };
        eigen::largest(&mut apply, start)
    }

    /// x.K x and x.C x for the vector M^1/2 x of length 1.
    fn quotients(&self, vector: &[f64]) -> [f64; 2] {
        let x: Vec<f64> = vector.iter().zip(&self.masses).map(|(v, m)| v / m.sqrt()).collect();
        let mut product = vec![0.0; x.len()];
        [&self.stiffness, &self.damping].map(|values| {
            multiply(&self.pattern, values, &x, &mut product);
            dot(&x, &product)
        })
    }

    /// Is 4 M - 2 h C - h^2 K positive definite?
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn is_stable(&self, step: f64) -> Result<bool> {
        Ok(self.certify(&self.analysis()?, 2.0 * step, step * step))
    }

    fn analysis(&self) -> Result<Arc<Symbolic>> {
        match &self.symbolic {
            Some(symbolic) => Ok(Arc::clone(symbolic)),
            None => Symbolic::analyse(&self.pattern, minimum_degree(&self.pattern)?),
        }
    }

    /// Is 4 M - c C - k K positive definite?
    fn certify(&self, symbolic: &Arc<Symbolic>, c: f64, k: f64) -> bool {
        let pairs = self.stiffness.iter().zip(&self.damping);
        let mut values: Vec<f64> = pairs.map(|(stiffness, damping)| -c * damping - k * stiffness).collect();
        for (i, mass) in self.masses.iter().enumerate() {
            values[self.pattern.position(i, i).expect("the diagonal is stored")] += 4.0 * mass;
        }
        let matrix = CsrMatrix::try_from_pattern_and_values(self.pattern.as_csr().clone(), values);
        let mut factor = Factor::new(Arc::clone(symbolic));
        factor.load(&matrix.expect("one value for each entry of the pattern"));
        matches!(factor.refactor(), Ok(()))
    }
}

/// The largest stable steps about the state where the body was linearised.
///
/// # Errors
/// [`Error::Inaccurate`] when the limit that was found cannot be proven by any margin; those of the analysis.
pub fn limit(body: &Linearised) -> Result<Limit> {
    let top = body.largest(1.0, 0.0, &eigen::seed_vector(body.masses.len()));
    let omega_max = top.value.max(0.0).sqrt();
    let undamped = 2.0 / omega_max;
    let damped = if body.is_damped() { search_step(body, top) } else { undamped };
    let symbolic = body.analysis()?;
    let mut limit = Limit { omega_max, undamped, damped, proven: None };
    if symbolic.factor_flops() > MOST_FLOPS || body.masses.is_empty() {
        return Ok(limit);
    }
    for margin in MARGINS {
        let [h, free] = [damped, undamped].map(|limit| limit * (1.0 - margin));
        if body.certify(&symbolic, 2.0 * h, h * h) && (h == free || body.certify(&symbolic, 0.0, free * free)) {
            limit.proven = Some(margin);
            return Ok(limit);
        }
    }
    Err(Error::Inaccurate { backward_error: MARGINS[3], limit: MARGINS[0] })
}

/// The step at which h^2 K + 2 h C first reaches 4 M.
fn search_step(body: &Linearised, mut top: Pair) -> f64 {
    let step = |[k, c]: [f64; 2]| 4.0 / (c + (c * c + 4.0 * k).sqrt());
    let mut h = step(body.quotients(&top.vector));
    for _ in 0..ROUNDS {
        top = body.largest(h * h, 2.0 * h, &restart(&top.vector));
        let next = step(body.quotients(&top.vector));
        let settled = next >= h * (1.0 - 1e-14);
        h = h.min(next);
        if settled {
            break;
        }
    }
    h
}

/// A start for the next search: the last vector, and a little of everything, lest a symmetry hides the one sought.
fn restart(vector: &[f64]) -> Vec<f64> {
    let noise = eigen::seed_vector(vector.len());
    let scale = 0.1 / (vector.len() as f64).sqrt();
    vector.iter().zip(noise).map(|(v, noise)| v + scale * noise).collect()
}

/// The smallest alpha of (4.18) with which leapfrog is stable at a step in s; none when no damping is small enough, since
/// the step is not below 2/omega_max. `body.damping` is that of alpha = 1 s, `limit` its limit.
pub fn smallest_alpha(body: &Linearised, limit: &Limit, step: f64) -> Option<f64> {
    if step >= limit.undamped {
        return None;
    }
    let alpha_of = |[k, c]: [f64; 2]| 2.0 * step * c / (4.0 - step * step * k);
    let mut top = body.largest(0.0, 1.0, &eigen::seed_vector(body.masses.len()));
    let mut alpha = alpha_of(body.quotients(&top.vector));
    for _ in 0..ROUNDS {
        top = body.largest(step * step, 2.0 * step / alpha, &restart(&top.vector));
        let next = alpha_of(body.quotients(&top.vector));
        let settled = next <= alpha * (1.0 + 1e-14);
        alpha = alpha.max(next);
        if settled {
            break;
        }
    }
    Some(alpha)
}
