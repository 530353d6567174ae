//! The end of an implicit step: Newton's method with a line search.
//!
//! Implicit Euler, midpoint and Newmark ask for an acceleration a with
//!
//! ```text
//! M a + f_int(u(a), v(a)) = f,     u(a) = u^ + a / m,     v(a) = v^ + (c / m) a
//! ```
//!
//! where u^, v^ are known from the start of the step, and the numbers m in 1/s^2 and c in 1/s belong to the method. To
//! first order a change d of u changes the left side by (m M + c C + K) d, so a Newton step solves
//!
//! ```text
//! (m M + c C + K) d = f - M a - f_int,     a += t m d,     0 < t <= 1
//! ```
//!
//! t is halved until the forces out of balance halve, or else the incremental potential falls, whose minimum is the end of
//! the step where the tangents are those of an energy:
//!
//! ```text
//! Phi(u) = m/2 |u - u^|_M^2 + E(u) - f.u + v.C v / (2 c)
//! ```
//!
//! A linear body needs one step with one factor for a whole run. How the systems are solved: `system.rs`.

use crate::dense::dot;
use crate::error::{Error, Result};

use super::stepper::{Settings, Stepper, Work};
use super::system::System;

/// How displacement and velocity follow from the acceleration of an implicit step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predictor {
    /// m in 1/s^2.
    pub mass: f64,
    /// c in 1/s.
    pub rate: f64,
}

/// A full step that leaves at most this part of the forces out of balance needs no energies.
const GOOD: f64 = 0.5;

/// Part of the slope of the potential that a shorter step must gain.
const GAIN: f64 = 1e-4;

/// How often a step is halved.
const HALVINGS: u32 = 30;

impl Stepper<'_> {
    /// direction = (m M + c C + k K)^-1 residual with the tangents at the present state.
    ///
    /// # Errors
    /// Those of the factorisation and of its checked solve, or of the iteration.
    pub(super) fn solve_with(&mut self, coefficients: [f64; 3]) -> Result<()> {
        let system = match &mut self.system {
            Some(system) => system,
            none => {
                let Settings { symbolic, linear, .. } = &self.settings;
                none.insert(System::new(self.model, symbolic.as_ref(), *linear)?)
            }
        };
        let Work { residual, direction, .. } = &mut self.work;
        if !system.has(coefficients) {
            let only_mass = system.tangents(self.model, [&self.state.displacement, &self.state.velocity], coefficients);
            if only_mass {
                let pairs = residual.iter().zip(self.model.masses());
                direction.iter_mut().zip(pairs).for_each(|(d, (r, mass))| *d = r / (coefficients[0] * mass));
                return Ok(());
            }
            self.solves.factorisations += system.prepare(self.model.masses())?.factorisations;
            system.lasting = self.model.is_linear();
        }
        self.solves.iterations += 1;
        self.solves.linear_iterations += system.solve(self.model.masses(), residual, direction)?.iterations;
        Ok(())
    }

    /// Displacement and velocity that belong to the acceleration.
    fn place(&mut self, Predictor { mass, rate }: Predictor) {
        let (state, work) = (&mut self.state, &self.work);
        let motion = state.displacement.iter_mut().zip(&mut state.velocity).zip(&state.acceleration);
        for (((u, v), a), (predicted, velocity)) in motion.zip(work.predicted.iter().zip(&work.velocity)) {
            *u = predicted + a / mass;
            *v = velocity + rate / mass * a;
        }
    }

    /// residual = f - M a - f_int: the largest entry, and the largest force there is.
    fn balance(&mut self) -> [f64; 2] {
        let (state, work) = (&self.state, &mut self.work);
        self.model.internal_force(&state.displacement, &state.velocity, &mut work.internal);
        let forces = work.acting.iter().zip(&work.internal).zip(self.model.masses().iter().zip(&state.acceleration));
        let (mut out_of_balance, mut largest) = (0.0_f64, 0.0_f64);
        for (residual, ((acting, internal), (mass, a))) in work.residual.iter_mut().zip(forces) {
            *residual = acting - mass * a - internal;
            largest = largest.max(acting.abs()).max(internal.abs()).max((mass * a).abs());
            // a force that is not a number must not pass for a small one
            out_of_balance = if residual.is_nan() { f64::NAN } else { out_of_balance.max(residual.abs()) };
            if out_of_balance.is_nan() {
                break;
            }
        }
        [out_of_balance, largest]
    }

    /// The incremental potential at the present state, J.
    fn potential(&mut self, Predictor { mass, rate }: Predictor) -> f64 {
        let state = &self.state;
        let inertia = super::stepper::kinetic(self.model.masses(), &state.acceleration) / mass;
        let elastic = self.model.elastic_energy(&state.displacement);
        let damping = self.model.dissipated_power(&state.displacement, &state.velocity) / (2.0 * rate);
        inertia + elastic + damping - dot(&self.work.acting, &state.displacement)
    }
}

/// Ends an implicit step: from `predicted`, `velocity` and `acting` in the workspace to the new state.
///
/// # Errors
/// [`Error::NotConverged`]; those of the factorisation and of its checked solve.
pub fn solve(stepper: &mut Stepper, predictor: Predictor) -> Result<()> {
    stepper.state.acceleration.fill(0.0);
    stepper.place(predictor);
    let (tolerance, most) = (stepper.settings.tolerance, stepper.settings.iterations);
    let mut forces = stepper.balance();
    for _ in 0..most {
        if accepted(stepper, forces) {
            return Ok(());
        }
        stepper.solve_with([predictor.mass, predictor.rate, 1.0])?;
        stepper.work.trial.copy_from_slice(&stepper.state.acceleration);
        if stepper.model.is_linear() {
            move_by(stepper, predictor, predictor.mass);
            return Ok(());
        }
        match search(stepper, predictor, forces[0]) {
            Some(found) => forces = found,
            None => break,
        }
    }
    if accepted(stepper, forces) {
        return Ok(());
    }
    let residual = forces[0] / forces[1];
    Err(Error::NotConverged { step: stepper.state.step + 1, residual, tolerance, iterations: most })
}

/// Is the largest force out of balance small beside the largest force, or rounding?
fn accepted(stepper: &mut Stepper, [out_of_balance, largest]: [f64; 2]) -> bool {
    let accepted = out_of_balance <= stepper.settings.tolerance * largest + stepper.model.rounding();
    if accepted && largest > 0.0 {
        stepper.solves.residual = stepper.solves.residual.max(out_of_balance / largest);
    }
    accepted
}

/// acceleration = trial + factor direction.
fn move_by(stepper: &mut Stepper, predictor: Predictor, factor: f64) {
    let (state, work) = (&mut stepper.state, &stepper.work);
    for ((a, trial), direction) in state.acceleration.iter_mut().zip(&work.trial).zip(&work.direction) {
        *a = trial + factor * direction;
    }
    stepper.place(predictor);
}

/// The line search along `direction` from the accelerations in `trial`; the forces at its end, `None` when no step is good.
fn search(stepper: &mut Stepper, predictor: Predictor, before: f64) -> Option<[f64; 2]> {
    let slope = dot(&stepper.work.residual, &stepper.work.direction);
    let start = stepper.potential(predictor);
    for halving in 0..HALVINGS {
        let t = 0.5_f64.powi(halving as i32);
        move_by(stepper, predictor, t * predictor.mass);
        let forces = stepper.balance();
        let halved = forces[0] <= GOOD * before;
        if halved || (slope > 0.0 && stepper.potential(predictor) <= start - GAIN * t * slope) {
            return Some(forces);
        }
    }
    None
}
