//! An objective that is linear in phi, as annealing and Gauss-Newton see it.
//!
//! The residual is R (phi, -1) of the reduced problem ([`crate::calibration::linear`]): the Jacobian is a constant, and
//! no system is ever factored or solved. The best common factor of all stiffnesses is a least-squares problem in one
//! unknown, s = (R phi) . r / |R phi|^2 with the right-hand side r.

use crate::calibration::linear::Reduced;
use crate::calibration::objective::{Counts, Objective};
use crate::dense::dot;
use crate::error::Result;

/// One worker of a linear problem.
pub struct Linear<'a> {
    reduced: &'a Reduced,
    upper: &'a [f64],
    phi: Vec<f64>,
    /// R phi.
    image: Vec<f64>,
    counts: Counts,
}

impl<'a> Linear<'a> {
    /// A worker; `upper` holds the bounds of phi, length m.
    pub fn new(reduced: &'a Reduced, upper: &'a [f64]) -> Self {
        Self {
            phi: vec![0.0; upper.len()],
            image: vec![0.0; reduced.rows()],
            counts: Counts::default(),
            reduced,
            upper,
        }
    }

    fn distance(&self) -> f64 {
        self.image.iter().zip(self.reduced.right()).map(|(image, right)| (image - right).powi(2)).sum::<f64>().sqrt()
    }
}

impl Objective for Linear<'_> {
    fn error(&mut self, phi: &[f64]) -> Result<f64> {
        self.counts.evaluations += 1;
        self.phi.copy_from_slice(phi);
        self.reduced.apply(phi, &mut self.image);
        Ok(self.distance())
    }

    fn fit_scale(&mut self, phi: &mut [f64]) -> f64 {
        let with_right = dot(&self.image, self.reduced.right());
        let largest = self.phi.iter().zip(self.upper).fold(f64::INFINITY, |s, (p, u)| s.min(u / p));
        // an image that points away from the right-hand side has no best positive factor: leave it
        let best = if with_right > 0.0 { (with_right / dot(&self.image, &self.image)).min(largest) } else { 1.0 };
        for (p, upper) in self.phi.iter_mut().zip(self.upper) {
            *p = (*p * best).min(*upper);
        }
        self.image.iter_mut().for_each(|entry| *entry *= best);
        phi.copy_from_slice(&self.phi);
        self.distance()
    }

    fn linearise(&mut self, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) -> Result<()> {
        residual.clear();
        residual.extend(self.image.iter().zip(self.reduced.right()).map(|(image, right)| image - right));
        jacobian.clear();
        jacobian.extend_from_slice(self.reduced.matrix());
        Ok(())
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}
