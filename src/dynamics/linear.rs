//! A body whose forces are linear in displacement and velocity.
//!
//! ```text
//! f_int(u, v) = K u + C v,     energy  u.K u / 2,     dissipated power  v.C v
//! ```
//!
//! K from finite elements, isogeometric analysis or springs linearised at rest, over the n free degrees of freedom.
//! C is a matrix of its own (dampers along springs) or Rayleigh's C = alpha_R M + beta_R K, alpha_R in 1/s and beta_R in
//! s. Masses are lumped, in kg.

use nalgebra_sparse::CsrMatrix;

use crate::dense::dot;
use crate::sparse::pattern::Pattern;

use super::model::Model;
use super::product::multiply;

/// Where the damping comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Damping {
    /// No damping.
    None,
    /// C = alpha_R M + beta_R K.
    Rayleigh {
        /// alpha_R, 1/s.
        mass: f64,
        /// beta_R, s.
        stiffness: f64,
    },
    /// The values of C in N s/m on the pattern of K.
    Matrix(Vec<f64>),
}

/// K, C and M of a linear body.
#[derive(Debug, Clone)]
pub struct LinearModel {
    pattern: Pattern,
    stiffness: Vec<f64>,
    damping: Damping,
    masses: Vec<f64>,
    product: Vec<f64>,
}

impl LinearModel {
    /// A body with the stiffness matrix K in N/m (both triangles, full diagonal) and one lumped mass in kg for each of
    /// its unknowns.
    ///
    /// # Panics
    /// When K is not square, lacks a diagonal entry, or another length does not fit it.
    pub fn new(stiffness: &CsrMatrix<f64>, damping: Damping, masses: Vec<f64>) -> Self {
        let pattern = Pattern::of(stiffness);
        assert_eq!(masses.len(), pattern.len(), "one mass for every unknown");
        if let Damping::Matrix(values) = &damping {
            assert_eq!(values.len(), pattern.entries(), "one damping value for every entry of K");
        }
        let product = vec![0.0; pattern.len()];
        Self { pattern, stiffness: stiffness.values().to_vec(), damping, masses, product }
    }
}

impl Model for LinearModel {
    fn unknowns(&self) -> usize {
        self.masses.len()
    }

    fn masses(&self) -> &[f64] {
        &self.masses
    }

    fn elastic_energy(&mut self, u: &[f64]) -> f64 {
        multiply(&self.pattern, &self.stiffness, u, &mut self.product);
        0.5 * dot(u, &self.product)
    }

    fn internal_force(&mut self, u: &[f64], v: &[f64], out: &mut [f64]) {
        multiply(&self.pattern, &self.stiffness, u, out);
        self.damping_force(v);
        if self.damping != Damping::None {
            out.iter_mut().zip(&self.product).for_each(|(out, damped)| *out += damped);
        }
    }

    fn dissipated_power(&mut self, _: &[f64], v: &[f64]) -> f64 {
        self.damping_force(v);
        if self.damping == Damping::None { 0.0 } else { dot(v, &self.product) }
    }

    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn tangent(&mut self, _: &[f64], _: &[f64], stiffness: &mut [f64], damping: &mut [f64]) {
        stiffness.copy_from_slice(&self.stiffness);
        match &self.damping {
            Damping::None => damping.fill(0.0),
            Damping::Matrix(values) => damping.copy_from_slice(values),
            Damping::Rayleigh { mass, stiffness: beta } => {
                damping.iter_mut().zip(&self.stiffness).for_each(|(c, k)| *c = beta * k);
                for (i, m) in self.masses.iter().enumerate() {
                    damping[self.pattern.position(i, i).expect("the diagonal is stored")] += mass * m;
                }
            }
        }
    }

    fn is_linear(&self) -> bool {
        true
    }
}

impl LinearModel {
    /// product = C v; left as it is without damping.
    fn damping_force(&mut self, v: &[f64]) {
        match &self.damping {
            Damping::None => {}
            Damping::Matrix(values) => multiply(&self.pattern, values, v, &mut self.product),
            Damping::Rayleigh { mass, stiffness } => {
                multiply(&self.pattern, &self.stiffness, v, &mut self.product);
                for ((product, m), v) in self.product.iter_mut().zip(&self.masses).zip(v) {
                    *product = stiffness * *product + mass * m * v;
                }
            }
        }
    }
}
