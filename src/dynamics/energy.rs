//! The energies of a motion and their balance.
//!
//! ```text
//! kinetic + elastic + dissipated = kinetic_0 + elastic_0 + work of the external forces
//! ```
//!
//! holds for the true motion at every time. Newmark (1/4, 1/2) and midpoint keep it to rounding on linear bodies; leapfrog
//! leaves a bounded swing; implicit Euler loses more than the dampers take, and this *numerical damping* is what is missing.
//! All in J.

use serde::Serialize;

use super::stepper::{Stepper, kinetic};

/// The energies at a time, J.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Energies {
    /// v.M v / 2.
    pub kinetic: f64,
    /// Of the stretched body.
    pub elastic: f64,
    /// Taken by the dampers since the start.
    pub dissipated: f64,
    /// Given by the external forces since the start.
    pub work: f64,
}

impl Energies {
    /// The energies of a body on its way.
    pub fn of(stepper: &mut Stepper) -> Self {
        let [dissipated, work] = stepper.accounts();
        let Stepper { model, state, .. } = stepper;
        Self {
            kinetic: kinetic(model.masses(), &state.velocity),
            elastic: model.elastic_energy(&state.displacement),
            dissipated,
            work,
        }
    }

    /// kinetic + elastic, J.
    pub fn mechanical(&self) -> f64 {
        self.kinetic + self.elastic
    }

    /// What the balance with `start` lacks (negative: energy that is gone), J.
    pub fn imbalance(&self, start: &Self) -> f64 {
        (self.mechanical() + self.dissipated - self.work) - (start.mechanical() + start.dissipated - start.work)
    }
}

/// The largest imbalance of a motion against its first energies, relative to the largest energy in it; 0 without any.
pub fn drift(energies: &[Energies]) -> f64 {
    let Some(start) = energies.first() else { return 0.0 };
    let largest = |of: &dyn Fn(&Energies) -> f64| energies.iter().map(|e| of(e).abs()).fold(0.0, f64::max);
    let scale = largest(&|e| e.mechanical()).max(largest(&|e| e.work));
    if scale == 0.0 { 0.0 } else { largest(&|e| e.imbalance(start)) / scale }
}
