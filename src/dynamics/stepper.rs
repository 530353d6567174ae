//! A body on its way: the state, the forces on it, and the accounts of energy.
//!
//! [`Stepper::advance`] takes one step h of the chosen integrator and books what the step did:
//!
//! ```text
//! work        += f . (u_{n+1} - u_n)                       f the external force as the integrator saw it
//! dissipated  += h w . (f_int(u, w) - f_int(u, 0))         at the mean u, with the mean velocity w = (u_{n+1} - u_n) / h
//! ```
//!
//! Everything that steps need is allocated at the start or in the first step.

use std::sync::Arc;

use crate::dense::dot;
use crate::error::{Error, Result};
use crate::sparse::cholesky::Symbolic;

use super::external::External;
use super::integrator::Integrator;
use super::model::Model;
use super::system::{LinearSolver, System};

/// What a user may say about the steps.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Step h in s.
    pub step: f64,
    /// beta and gamma of Newmark's method.
    pub newmark: [f64; 2],
    /// Largest force out of balance that ends Newton's method, relative to the largest force.
    pub tolerance: f64,
    /// Most iterations of Newton's method in a step.
    pub iterations: usize,
    /// An analysis of the pattern of the model, if there is one; implicit integrators make their own otherwise.
    pub symbolic: Option<Arc<Symbolic>>,
    /// How the linear systems of implicit steps are solved.
    pub linear: LinearSolver,
}

impl Settings {
    /// The defaults with a step in s: average acceleration, balance to 1e-10 in at most 50 iterations.
    pub fn with_step(step: f64) -> Self {
        Self {
            step,
            newmark: [0.25, 0.5],
            tolerance: 1e-10,
            iterations: 50,
            symbolic: None,
            linear: LinearSolver::Cholesky,
        }
    }
}

/// Where a body is and how it moves, over the n free degrees of freedom.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Steps done.
    pub step: u64,
    /// Time in s: steps times h.
    pub time: f64,
    /// u, m.
    pub displacement: Vec<f64>,
    /// v, m/s.
    pub velocity: Vec<f64>,
    /// a, m/s^2.
    pub acceleration: Vec<f64>,
}

/// Vectors of one length that the integrators share.
#[derive(Debug, Clone)]
pub(super) struct Work {
    /// Displacement and velocity at the start of the step.
    pub last: Vec<f64>,
    pub last_velocity: Vec<f64>,
    /// External force at the start and the end of the step, and as the step saw it.
    pub force: Vec<f64>,
    pub next_force: Vec<f64>,
    pub acting: Vec<f64>,
    /// f_int.
    pub internal: Vec<f64>,
    /// Where an implicit step starts from: displacement and velocity.
    pub predicted: Vec<f64>,
    pub velocity: Vec<f64>,
    /// Forces out of balance, and the step they ask for.
    pub residual: Vec<f64>,
    pub direction: Vec<f64>,
    /// A trial of a line search.
    pub trial: Vec<f64>,
    pub trial_velocity: Vec<f64>,
}

impl Work {
    fn new(n: usize) -> Self {
        let zero = || vec![0.0; n];
        Self {
            last: zero(),
            last_velocity: zero(),
            force: zero(),
            next_force: zero(),
            acting: zero(),
            internal: zero(),
            predicted: zero(),
            velocity: zero(),
            residual: zero(),
            direction: zero(),
            trial: zero(),
            trial_velocity: zero(),
        }
    }

    /// The external force acted as the mean of its values at both ends of the step.
    pub fn act_at_both_ends(&mut self) {
        for ((acting, before), after) in self.acting.iter_mut().zip(&self.force).zip(&self.next_force) {
            *acting = 0.5 * (before + after);
        }
    }
}

/// Work of the implicit solves of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Solves {
    /// Iterations of Newton's method (one a step on a linear body).
    pub iterations: u64,
    /// Factorisations.
    pub factorisations: u64,
    /// Iterations of conjugate gradients, where they solve the linear systems.
    pub linear_iterations: u64,
    /// Largest force out of balance that was accepted, relative to the largest force.
    pub residual: f64,
}

/// Integrates one body in time.
pub struct Stepper<'m> {
    pub(super) model: &'m mut dyn Model,
    pub(super) external: &'m External,
    pub(super) integrator: &'static Integrator,
    pub(super) settings: Settings,
    pub(super) state: State,
    pub(super) work: Work,
    pub(super) system: Option<System>,
    pub(super) solves: Solves,
    dissipated: f64,
    supplied: f64,
    /// Energy at the start and all work so far without its sign: what a sound motion cannot exceed by much.
    available: f64,
}

/// A motion whose kinetic energy is so many times all that was ever supplied has blown up. Near its limit of stability
/// leapfrog swings by some thousand.
const BLOWN_UP: f64 = 1e6;

impl<'m> Stepper<'m> {
    /// A body that starts at displacement `u` (m) with velocity `v` (m/s).
    ///
    /// # Errors
    /// [`Error::Input`] at `dynamics.masses` for an unknown without mass.
    ///
    /// # Panics
    /// When `u` or `v` is not as long as the model has unknowns.
    pub fn new(
        model: &'m mut dyn Model,
        external: &'m External,
        integrator: &'static Integrator,
        settings: Settings,
        [u, v]: [&[f64]; 2],
    ) -> Result<Self> {
        let n = model.unknowns();
        assert_eq!([u.len(), v.len()], [n; 2], "one displacement and one velocity for every unknown");
        if let Some(unknown) = model.masses().iter().position(|mass| mass.is_nan() || *mass <= 0.0) {
            let message = format!("unknown {unknown} has the mass {} kg", model.masses()[unknown]);
            return Err(Error::input("dynamics.masses", message, "give every free unknown a mass above 0"));
        }
        let mut work = Work::new(n);
        external.at(0.0, settings.step, &mut work.force);
        model.internal_force(u, v, &mut work.internal);
        let balance = work.force.iter().zip(&work.internal).zip(model.masses());
        let acceleration = balance.map(|((force, internal), mass)| (force - internal) / mass).collect();
        let state = State { step: 0, time: 0.0, displacement: u.to_vec(), velocity: v.to_vec(), acceleration };
        let available = model.elastic_energy(u) + kinetic(model.masses(), v);
        let (system, solves) = (None, Solves::default());
        let (dissipated, supplied) = (0.0, 0.0);
        Ok(Self { model, external, integrator, settings, state, work, system, solves, dissipated, supplied, available })
    }

    /// One step.
    ///
    /// # Errors
    /// [`Error::BlowUp`]; those of the integrator.
    pub fn advance(&mut self) -> Result<()> {
        self.work.last.copy_from_slice(&self.state.displacement);
        (self.integrator.advance)(self)?;
        self.state.step += 1;
        self.state.time = self.state.step as f64 * self.settings.step;
        self.book();
        let Work { force, next_force, .. } = &mut self.work;
        self.external.at(self.state.time, self.settings.step, next_force);
        std::mem::swap(force, next_force);
        self.check()
    }

    /// Books work and dissipation of the step that was done.
    fn book(&mut self) {
        let (h, Work { last, acting, trial, trial_velocity, .. }) = (self.settings.step, &mut self.work);
        for (i, (last, u)) in last.iter().zip(&self.state.displacement).enumerate() {
            trial[i] = 0.5 * (last + u);
            trial_velocity[i] = (u - last) / h;
        }
        let work = h * dot(acting, trial_velocity);
        self.supplied += work;
        self.available += work.abs();
        self.dissipated += h * self.model.dissipated_power(trial, trial_velocity);
    }

    /// Is the motion still one?
    fn check(&self) -> Result<()> {
        let kinetic = kinetic(self.model.masses(), &self.state.velocity);
        let place = dot(&self.state.displacement, &self.state.displacement);
        let blown = |what: String| Error::BlowUp { step: self.state.step, time: self.state.time, what };
        if !(kinetic.is_finite() && place.is_finite()) {
            return Err(blown("displacement or velocity is not a finite number any more".into()));
        }
        if kinetic > BLOWN_UP * self.available && self.available > 0.0 {
            let available = self.available;
            return Err(blown(format!("{kinetic:.2e} J of kinetic energy, but only {available:.2e} J were supplied")));
        }
        Ok(())
    }

    /// Where the body is.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The body.
    pub fn model(&mut self) -> &mut dyn Model {
        self.model
    }

    /// Dissipated energy and work of the external forces so far, J.
    pub fn accounts(&self) -> [f64; 2] {
        [self.dissipated, self.supplied]
    }

    /// Work of the implicit solves so far.
    pub fn solves(&self) -> Solves {
        self.solves
    }

    /// The step in s.
    pub fn step(&self) -> f64 {
        self.settings.step
    }
}

/// Kinetic energy v.M v / 2 in J.
pub(super) fn kinetic(masses: &[f64], v: &[f64]) -> f64 {
    0.5 * masses.iter().zip(v).map(|(mass, v)| mass * v * v).sum::<f64>()
}
