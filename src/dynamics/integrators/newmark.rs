//! Newmark's method (beta, gamma).
//!
//! ```text
//! u_{n+1} = u_n + h v_n + h^2 ((1/2 - beta) a_n + beta a_{n+1})
//! v_{n+1} = v_n + h ((1 - gamma) a_n + gamma a_{n+1})
//! M a_{n+1} + f_int(u_{n+1}, v_{n+1}) = f_ext(t_{n+1})
//! ```
//!
//! Unconditionally stable for 2 beta >= gamma >= 1/2. With (1/4, 1/2), the average acceleration, it is of second order and
//! keeps the energy of linear bodies; gamma above 1/2 damps fast motion and is of first order.

use super::super::implicit::{self, Predictor};
use super::super::stepper::Stepper;
use crate::error::Result;

/// One step.
///
/// # Errors
/// Those of [`implicit::solve`].
pub fn advance(stepper: &mut Stepper) -> Result<()> {
    let h = stepper.settings.step;
    let [beta, gamma] = stepper.settings.newmark;
    let Stepper { state, work, .. } = stepper;
    let motion = state.displacement.iter().zip(&state.velocity).zip(&state.acceleration);
    for (((u, v), a), (predicted, velocity)) in motion.zip(work.predicted.iter_mut().zip(&mut work.velocity)) {
        *predicted = u + h * v + h * h * (0.5 - beta) * a;
        *velocity = v + h * (1.0 - gamma) * a;
    }
    stepper.external.at(state.time + h, h, &mut work.next_force);
    work.acting.copy_from_slice(&work.next_force);
    implicit::solve(stepper, Predictor { mass: 1.0 / (beta * h * h), rate: gamma / (beta * h) })?;
    stepper.work.act_at_both_ends();
    Ok(())
}
