//! Semi-implicit Euler: one linear solve a step.
//!
//! ```text
//! (M + h C + h^2 K) v_{n+1} = M v_n + h (f_ext(t_{n+1}) - f_int(u_n, 0)),     u_{n+1} = u_n + h v_{n+1}
//! ```
//!
//! with the tangents at u_n: implicit Euler after a single Newton step, the two are the same on a linear body. (D. Baraff and
//! A. Witkin, SIGGRAPH 1998; for corotational bodies M. Mueller and M. Gross, Graphics Interface 2004.) Of first order; it damps as implicit
//! Euler does, so amplitudes of a motion are to be taken from another.

use super::super::stepper::Stepper;
use crate::error::Result;

/// One step.
///
/// # Errors
/// Those of the factorisation and of its checked solve.
pub fn advance(stepper: &mut Stepper) -> Result<()> {
    let h = stepper.settings.step;
    let Stepper { state, work, model, external, .. } = stepper;
    external.at(state.time + h, h, &mut work.next_force);
    work.acting.copy_from_slice(&work.next_force);
    work.trial_velocity.fill(0.0);
    model.internal_force(&state.displacement, &work.trial_velocity, &mut work.internal);
    let forces = work.acting.iter().zip(&work.internal);
    let momenta = model.masses().iter().zip(&state.velocity);
    for (residual, ((acting, internal), (mass, v))) in work.residual.iter_mut().zip(forces.zip(momenta)) {
        *residual = mass * v + h * (acting - internal);
    }
    stepper.solve_with([1.0, h, h * h])?;
    let Stepper { state, work, .. } = stepper;
    let motion = state.displacement.iter_mut().zip(&mut state.velocity).zip(&mut state.acceleration);
    for (((u, v), a), next) in motion.zip(&work.direction) {
        *a = (next - *v) / h;
        *v = *next;
        *u += h * next;
    }
    Ok(())
}
