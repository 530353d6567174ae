//! Central differences with the damping centred in time.
//!
//! ```text
//! a_n = (u_{n+1} - 2 u_n + u_{n-1}) / h^2,     v_n = (u_{n+1} - u_{n-1}) / (2 h)
//! ```
//!
//! which is Newmark's method with beta = 0 and gamma = 1/2, the form used here:
//!
//! ```text
//! u_{n+1} = u_n + h v_n + h^2/2 a_n
//! (M + h/2 C) a_{n+1} = f_ext(t_{n+1}) - f_int(u_{n+1}, v_n + h/2 a_n)
//! v_{n+1} = v_n + h/2 (a_n + a_{n+1})
//! ```
//!
//! The elastic force is explicit, but (M + h/2 C) is solved where there is damping: once factored for a linear body, in
//! every step for springs, whose dampers turn. In return the damping does not shrink the stable step, which stays
//! 2/omega.

use super::super::stepper::Stepper;
use crate::error::Result;

/// One step.
///
/// # Errors
/// Those of the factorisation of M + h/2 C.
pub fn advance(stepper: &mut Stepper) -> Result<()> {
    let h = stepper.settings.step;
    let Stepper { model, state, work, .. } = stepper;
    for ((u, v), a) in state.displacement.iter_mut().zip(&mut state.velocity).zip(&state.acceleration) {
        *u += h * *v + 0.5 * h * h * a;
        *v += 0.5 * h * a;
    }
    stepper.external.at(state.time + h, h, &mut work.next_force);
    model.internal_force(&state.displacement, &state.velocity, &mut work.internal);
    for ((residual, force), internal) in work.residual.iter_mut().zip(&work.next_force).zip(&work.internal) {
        *residual = force - internal;
    }
    stepper.solve_with([1.0, 0.5 * h, 0.0])?;
    let Stepper { state, work, .. } = stepper;
    state.acceleration.copy_from_slice(&work.direction);
    for (v, a) in state.velocity.iter_mut().zip(&state.acceleration) {
        *v += 0.5 * h * a;
    }
    work.act_at_both_ends();
    Ok(())
}
