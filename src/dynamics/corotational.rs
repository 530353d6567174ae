//! A corotational body in motion.
//!
//! The elastic force is that of [`crate::reference::corotational`]: exact for any rotation, small strains in turned axes.
//! Damping is Rayleigh's with the warped tangent where the body is,
//!
//! ```text
//! f_int(u, v) = dE/du + (alpha_R M + beta_R K_warped(u)) v
//! ```
//!
//! The part with beta_R does not resist the rigid spin of a body at rest length. Of a strained one it does, a little: the
//! rate that it sees is sym(W S), where W x is the spin crossed with x and S = R^T F, and that vanishes only for S = 1. alpha_R
//! resists every motion.
//!
//! The tangent that integrators get is a choice. Newton's method wants the exact one; semi-implicit Euler, which takes
//! one step with it, is safest with the warped one.

use crate::dense::dot;
use crate::reference::corotational::Tangent;
use crate::reference::corotational::held::Held;
use crate::sparse::pattern::Pattern;

use super::model::Model;

/// A corotational body with masses and damping.
#[derive(Debug, Clone)]
pub struct CorotationalModel {
    body: Held,
    masses: Vec<f64>,
    mass_damping: f64,
    stiffness_damping: f64,
    tangent: Tangent,
    diagonal: Vec<usize>,
    product: Vec<f64>,
}

impl CorotationalModel {
    /// A body without damping, with one mass for every node in kg.
    ///
    /// # Panics
    /// When there is not one mass for every node.
    pub fn new(body: Held, masses: &[f64], tangent: Tangent) -> Self {
        assert_eq!(masses.len(), body.dofs().nodes(), "one mass for every node");
        let pattern = body.pattern();
        let diagonal = |i| pattern.position(i, i).expect("the diagonal is stored");
        Self {
            masses: (0..pattern.len()).map(|dof| masses[body.dofs().owner(dof).0]).collect(),
            diagonal: (0..pattern.len()).map(diagonal).collect(),
            product: vec![0.0; pattern.len()],
            mass_damping: 0.0,
            stiffness_damping: 0.0,
            tangent,
            body,
        }
    }

    /// The same body with alpha_R in 1/s and beta_R in s.
    pub fn with_damping(mut self, alpha: f64, beta: f64) -> Self {
        (self.mass_damping, self.stiffness_damping) = (alpha, beta);
        self
    }

    /// The body, where the last call placed it.
    pub fn body(&self) -> &Held {
        &self.body
    }

    /// product = C v where the body was placed.
    fn damp(&mut self, v: &[f64]) {
        match self.stiffness_damping {
            0.0 => self.product.fill(0.0),
            _ => {
                self.body.linearise(Tangent::Warped);
                self.body.apply(v, &mut self.product);
            }
        }
        for ((product, v), mass) in self.product.iter_mut().zip(v).zip(&self.masses) {
            *product = self.stiffness_damping * *product + self.mass_damping * mass * v;
        }
    }
}

impl Model for CorotationalModel {
    fn unknowns(&self) -> usize {
        self.masses.len()
    }

    fn masses(&self) -> &[f64] {
        &self.masses
    }

    fn node(&self, unknown: usize) -> usize {
        self.body.dofs().owner(unknown).0
    }

    fn elastic_energy(&mut self, u: &[f64]) -> f64 {
        self.body.place(u);
        self.body.energy()
    }

    fn internal_force(&mut self, u: &[f64], v: &[f64], out: &mut [f64]) {
        self.body.place(u);
        self.body.internal_force(out);
        self.damp(v);
        out.iter_mut().zip(&self.product).for_each(|(out, damping)| *out += damping);
    }

    fn dissipated_power(&mut self, u: &[f64], v: &[f64]) -> f64 {
        if self.stiffness_damping != 0.0 {
            self.body.place(u);
        }
        self.damp(v);
        dot(v, &self.product)
    }

    fn pattern(&self) -> &Pattern {
        self.body.pattern()
    }

    fn tangent(&mut self, u: &[f64], _v: &[f64], stiffness: &mut [f64], damping: &mut [f64]) {
        self.body.place(u);
        if self.stiffness_damping == 0.0 {
            damping.fill(0.0);
        } else {
            self.body.linearise(Tangent::Warped);
            self.body.fill(damping);
            damping.iter_mut().for_each(|c| *c *= self.stiffness_damping);
        }
        for (&place, mass) in self.diagonal.iter().zip(&self.masses) {
            damping[place] += self.mass_damping * mass;
        }
        self.body.linearise(self.tangent);
        self.body.fill(stiffness);
    }

    fn rounding(&self) -> f64 {
        self.body.rounding()
    }

    fn is_linear(&self) -> bool {
        false
    }
}
