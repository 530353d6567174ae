//! Implicit midpoint.
//!
//! ```text
//! u_m = u_n + h/2 v_m,     M (v_m - v_n) / (h/2) + f_int(u_m, v_m) = f_ext(t_n + h/2)
//! u_{n+1} = 2 u_m - u_n,     v_{n+1} = 2 v_m - v_n
//! ```
//!
//! Half a step of implicit Euler, and then as far again. Of second order, symplectic; it keeps linear and angular momentum
//! of free bodies, and the energy of linear ones. Its acceleration is that of the midpoint.

use super::super::stepper::Stepper;
use super::implicit_euler;
use crate::error::Result;

/// One step.
///
/// # Errors
/// Those of [`super::super::implicit::solve`].
pub fn advance(stepper: &mut Stepper) -> Result<()> {
    let h = stepper.settings.step;
    let Stepper { state, work, .. } = stepper;
    work.last_velocity.copy_from_slice(&state.velocity);
    implicit_euler::backward(stepper, 0.5 * h)?;
    let Stepper { state, work, .. } = stepper;
    for (u, last) in state.displacement.iter_mut().zip(&work.last) {
        *u = 2.0 * *u - last;
    }
    for (v, last) in state.velocity.iter_mut().zip(&work.last_velocity) {
        *v = 2.0 * *v - last;
    }
    Ok(())
}
