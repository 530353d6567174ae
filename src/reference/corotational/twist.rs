//! What the turning of R adds to the second derivative of the energy.
//!
//! With F = U diag(s) V^T a change dF turns R by its parts along the three twists
//!
//! ```text
//!     q_ij = (u_i v_j^T - u_j v_i^T) / sqrt 2            (i, j) = (0, 1), (0, 2), (1, 2)
//!     c_ij = 2 mu + 2 (lambda (tr S - 3) - 2 mu) / (s_i + s_j)
//! ```
//!
//! and V sum c_ij (q_ij : dF)^2 is added to the warped part. All c_ij vanish at rest. A domain in compression has negative
//! ones: that is buckling. Where s_i + s_j is below 1e-6, the value at 1e-6 is taken.

use nalgebra_sparse::na::Matrix3;

use crate::reference::corotational::Tangent;
use crate::reference::corotational::rotation::Signed;
use crate::reference::material::Lame;

/// Floor of s_i + s_j.
pub(super) const LEAST_SUM: f64 = 1e-6;

/// The three twists of a domain and their coefficients in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// q_ij, without unit.
    pub directions: [Matrix3<f64>; 3],
    /// c_ij in Pa.
    pub coefficients: [f64; 3],
}

impl Twist {
    /// No twist at all.
    pub fn none() -> Self {
        Self { directions: [Matrix3::zeros(); 3], coefficients: [0.0; 3] }
    }

    /// The twists of F; none in the warped tangent, where F is not finite, and where it determines no rotation and the one
    /// in use does not turn with it.
    pub fn of(f: &Matrix3<f64>, lame: Lame, tangent: Tangent) -> Self {
        if tangent == Tangent::Warped || !f.iter().all(|x| x.is_finite()) {
            return Self::none();
        }
        let signed = Signed::of(f);
        if !signed.is_determined() {
            return Self::none();
        }
        let Signed { u, s, v } = signed;
        let pairs = [(0, 1), (0, 2), (1, 2)];
        let rest = lame.lambda * (s.sum() - 3.0) - 2.0 * lame.mu;
        let coefficients = pairs.map(|(i, j)| {
            let c = 2.0 * lame.mu + 2.0 * rest / (s[i] + s[j]).max(LEAST_SUM);
            if tangent == Tangent::Positive { c.max(0.0) } else { c }
        });
        let directions = pairs.map(|(i, j)| {
            let turned = u.column(i) * v.column(j).transpose() - u.column(j) * v.column(i).transpose();
            turned * std::f64::consts::FRAC_1_SQRT_2
        });
        Self { directions, coefficients }
    }

    /// sum c_ij (q_ij : dF) q_ij
    pub fn apply(&self, change: &Matrix3<f64>) -> Matrix3<f64> {
        let parts = self.directions.iter().zip(self.coefficients);
        parts.map(|(q, c)| q * (c * q.dot(change))).sum()
    }
}
