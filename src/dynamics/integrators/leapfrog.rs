//! Leapfrog (Stoermer-Verlet) with full steps.
//!
//! ```text
//! v_{n+1/2} = v_n + h/2 a_n
//! u_{n+1}   = u_n + h v_{n+1/2}
//! M a_{n+1} = f_ext(t_{n+1}) - f_int(u_{n+1}, v_{n+1/2})
//! v_{n+1}   = v_{n+1/2} + h/2 a_{n+1}
//! ```
//!
//! The half steps join to v_{n+1/2} = v_{n-1/2} + h a_n: positions and velocities leap over each other by full steps. The
//! thesis prints (3.7-3.8) with h/2 in the velocity and h in the position; that scheme swings with 0.7071 of the true
//! frequency. The damping force is taken at the velocity half a step before, so nothing is solved; the step is bounded
//! ([`super::super::stability`]).

use super::super::stepper::Stepper;
use crate::error::Result;

/// One step.
///
/// # Errors
/// None; the signature is that of the table.
pub fn advance(stepper: &mut Stepper) -> Result<()> {
    let Stepper { model, state, work, .. } = stepper;
    let h = stepper.settings.step;
    for ((u, v), a) in state.displacement.iter_mut().zip(&mut state.velocity).zip(&state.acceleration) {
        *v += 0.5 * h * a;
        *u += h * *v;
    }
    stepper.external.at(state.time + h, h, &mut work.next_force);
    model.internal_force(&state.displacement, &state.velocity, &mut work.internal);
    let balance = work.next_force.iter().zip(&work.internal).zip(model.masses());
    let motion = state.velocity.iter_mut().zip(&mut state.acceleration);
    for (((force, internal), mass), (v, a)) in balance.zip(motion) {
        *a = (force - internal) / mass;
        *v += 0.5 * h * *a;
    }
    work.act_at_both_ends();
    Ok(())
}
