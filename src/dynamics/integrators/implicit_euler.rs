//! Implicit (backward) Euler.
//!
//! ```text
//! u_{n+1} = u_n + h v_{n+1},     M (v_{n+1} - v_n) / h + f_int(u_{n+1}, v_{n+1}) = f_ext(t_{n+1})
//! ```
//!
//! Of first order. A mode of frequency omega loses the factor 1 / sqrt(1 + omega^2 h^2) of its amplitude in every step:
//! robust, and not a model of the body's own damping.

use super::super::implicit::{self, Predictor};
use super::super::stepper::Stepper;
use crate::error::Result;

/// One step.
///
/// # Errors
/// Those of [`implicit::solve`].
pub fn advance(stepper: &mut Stepper) -> Result<()> {
    let h = stepper.settings.step;
    backward(stepper, h)
}

/// The state after h of backward Euler; the external force at its end stays in `acting`.
pub(super) fn backward(stepper: &mut Stepper, h: f64) -> Result<()> {
    let Stepper { state, work, .. } = stepper;
    let motion = state.displacement.iter().zip(&state.velocity);
    for ((u, v), (predicted, velocity)) in motion.zip(work.predicted.iter_mut().zip(&mut work.velocity)) {
        *predicted = u + h * v;
        *velocity = *v;
    }
    stepper.external.at(state.time + h, stepper.settings.step, &mut work.next_force);
    work.acting.copy_from_slice(&work.next_force);
    implicit::solve(stepper, Predictor { mass: 1.0 / (h * h), rate: 1.0 / h })
}
