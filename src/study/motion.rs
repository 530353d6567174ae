//! Masses, damping, safe steps and motions of a scene with `[dynamics]`.
//!
//! Before anything moves, the limits of stability are found ([`limits`]) and a step above them is refused. Motions with
//! several alpha run side by side. A continuum can move too ([`continuum`]).

pub mod continuum;
pub mod limits;
mod start;

use std::borrow::Cow;
use std::sync::Arc;

use rayon::prelude::*;

use crate::calibration::errors::global_strain;
use crate::clock::{Progress, Stopwatch};
use crate::dynamics::collapse;
use crate::dynamics::external::External;
use crate::dynamics::integrator::{self, Integrator};
use crate::dynamics::model::Model;
use crate::dynamics::motion::{self, Motion, Schedule};
use crate::dynamics::springs::{Coefficients, SpringModel};
use crate::dynamics::stepper::{Settings, Solves, Stepper};
use crate::dynamics::system::LinearSolver;
use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::reference::mass;
use crate::scene::{self, Masses};
use crate::sparse::cholesky::Symbolic;
use crate::springs::damping;

use super::body::Body;
use super::fit::{Calibration, Given};
use continuum::{Inverted, Moving};
use limits::Limits;

/// Bytes that the recorded frames may take.
const LARGEST_RECORD: f64 = 4e9;

/// What `[dynamics]` asks for.
pub struct Dynamics {
    /// What moves the body, or would.
    pub integrator: &'static Integrator,
    /// The degrees of freedom that move.
    pub dofs: DofMap,
    /// Mass of every node, kg (0 where it is tied to another).
    pub masses: Vec<f64>,
    /// Damping of every spring (4.18) for the first alpha, N s/m; absent without alpha.
    pub damping: Option<Vec<f64>>,
    /// Limits for every alpha.
    pub limits: Vec<Limits>,
    /// Steps in s, and the smallest alpha in s with which leapfrog is stable at them.
    pub damping_range: Vec<[f64; 2]>,
    /// One motion for every alpha; none when the scene moves nothing.
    pub motions: Vec<Moved>,
    /// What happened in them that the user should know.
    pub warnings: Vec<String>,
}

/// A body that was moved.
pub struct Moved {
    /// alpha in s; none without damping by (4.18).
    pub alpha: Option<f64>,
    /// Step in s.
    pub step: f64,
    /// Steps done.
    pub steps: u64,
    /// What was recorded.
    pub motion: Motion,
    /// Work of the implicit solves.
    pub solves: Solves,
    /// What was turned inside out; none where no corotational continuum moved.
    pub inverted: Option<Inverted>,
    /// Seconds it took.
    pub seconds: f64,
}

/// All that a motion is made of, but alpha.
struct Mover<'a> {
    given: Given<'a>,
    found: &'a Calibration,
    settings: &'a scene::Dynamics,
    integrator: &'static Integrator,
    /// The degrees of freedom that move.
    dofs: Cow<'a, DofMap>,
    masses: Vec<f64>,
    /// Damping of every spring with alpha = 1 s, N s/m.
    unit_damping: Vec<f64>,
    /// Analysis of the pattern of what moves.
    symbolic: Option<Arc<Symbolic>>,
}

/// Masses, limits and motions, if the scene asks for them.
///
/// # Errors
/// [`Error::UnstableStep`] before anything moves; those of the motion.
pub fn run(given: Given, found: &Calibration, progress: &Progress) -> Result<Option<Dynamics>> {
    let Some(settings) = &given.scene.dynamics else { return Ok(None) };
    progress.enter("stability", 0);
    let masses = masses(given.scene, given.body)?;
    let network = &given.lattice.network;
    let unit_damping = damping::coefficients(network, &found.stiffness, &masses, 1.0);
    let name = settings.integrator(given.scene.reference.kinematics);
    let integrator = integrator::find(name).ok_or_else(|| {
        let message = format!("there is no integrator {name}");
        Error::input("dynamics.integrator", message, "see `springfit list integrators`")
    })?;
    let dofs = start::dofs(settings, given.body);
    let mut mover = Mover { given, found, settings, integrator, dofs, masses, unit_damping, symbolic: None };
    let continuum = mover.continuum()?;
    mover.symbolic = mover.analysis(continuum.as_ref())?;
    let (limits, damping_range) = mover.limits(continuum.as_ref(), progress)?;
    let motions = if settings.moves() { mover.move_all(continuum.as_ref(), &limits, progress)? } else { vec![] };
    let damping = limits[0].alpha.map(|alpha| mover.damping(alpha));
    let warnings = mover.collapses(&motions);
    let (masses, dofs) = (mover.masses, mover.dofs.into_owned());
    Ok(Some(Dynamics { integrator, dofs, masses, damping, limits, damping_range, motions, warnings }))
}

/// Masses of the nodes (3.11, 3.12), kg.
pub fn masses(scene: &scene::Scene, body: &Body) -> Result<Vec<f64>> {
    let density = scene
        .material
        .density
        .ok_or_else(|| Error::input("material.density", "is missing", "[dynamics] needs the mass density in kg/m^3"))?;
    let points = body.integration_points()?;
    match scene.dynamics.as_ref().map(|dynamics| dynamics.masses) {
        Some(Masses::Lumped) => mass::lumped(&points, density, &body.dofs),
        _ => mass::equal_shares(&points, density, &body.dofs),
    }
}

/// What a scene with `[dynamics]` will do, in words.
pub fn announce(settings: &scene::Dynamics, kinematics: scene::Kinematics) -> String {
    let damping = match settings.all_alphas()[..] {
        [None] => "no damping: [dynamics] has no alpha".to_owned(),
        [_] => "damping".to_owned(),
        ref several => format!("damping with {} alpha", several.len()),
    };
    let motion = match settings.moves() {
        true => {
            let turning = if settings.turns(kinematics) { ", which turns," } else { "" };
            let held = if settings.free { " without supports" } else { "" };
            format!("motion of \"{}\"{turning}{held} by {}", settings.model.name(), settings.integrator(kinematics))
        }
        false => "no motion: [dynamics] has neither duration nor steps".to_owned(),
    };
    format!("masses; {damping}; safe step; {motion}")
}

impl Mover<'_> {
    /// A word about springs that folded up.
    fn collapses(&self, motions: &[Moved]) -> Vec<String> {
        let network = &self.given.lattice.network;
        let of = |moved: &Moved| {
            let found = collapse::find(network, self.dofs(), &moved.motion.times, &moved.motion.frames)?;
            let [a, b] = found.nodes;
            Some(format!(
                "{} of {} springs passed through zero length, the first between nodes {a} and {b} by {:.4e} s: the motion is \
                 beyond what springs can stand for from there on",
                found.springs,
                network.springs.len(),
                found.time
            ))
        };
        motions.iter().filter_map(of).collect()
    }

    fn dofs(&self) -> &DofMap {
        &self.dofs
    }

    /// c of every spring (4.18), N s/m.
    fn damping(&self, alpha: f64) -> Vec<f64> {
        self.unit_damping.iter().map(|c| c / alpha).collect()
    }

    /// Calls `then` with the model that moves; springs have the damping of alpha.
    fn with_model<T>(
        &self,
        continuum: Option<&Moving>,
        alpha: Option<f64>,
        then: impl FnOnce(&mut dyn Model) -> T,
    ) -> T {
        if let Some(continuum) = continuum {
            return then(continuum.clone().model());
        }
        let damping = alpha.map(|alpha| self.damping(alpha));
        let of = Coefficients { stiffness: &self.found.stiffness, damping: damping.as_deref() };
        let mut springs = SpringModel::new(&self.given.lattice.network, self.dofs(), of, &self.masses);
        match self.settings.model {
            scene::Model::SpringsLinear => then(&mut springs.linear()),
            _ => then(&mut springs),
        }
    }

    /// Moves the body once for every alpha.
    fn move_all(&self, continuum: Option<&Moving>, limits: &[Limits], progress: &Progress) -> Result<Vec<Moved>> {
        let steps: Vec<f64> = limits.iter().filter_map(|limits| limits.step).collect();
        let schedules: Vec<Schedule> = steps.iter().map(|&step| schedule(self.settings, step)).collect();
        for (limits, &step) in limits.iter().zip(&steps) {
            self.check_step(limits, step)?;
        }
        self.check_record(&schedules)?;
        let external = self.external();
        progress.enter("motion", schedules.iter().map(|schedule| schedule.steps).sum());
        let one = |i: usize| -> Result<Moved> {
            let mut moved = self.with_model(continuum, limits[i].alpha, |model| {
                self.move_one(model, &external, limits[i].alpha, steps[i], schedules[i], progress)
            })?;
            moved.inverted = self.inverted(continuum, &moved.motion);
            Ok(moved)
        };
        (0..steps.len()).into_par_iter().map(one).collect()
    }

    fn move_one(
        &self,
        model: &mut dyn Model,
        external: &External,
        alpha: Option<f64>,
        step: f64,
        schedule: Schedule,
        progress: &Progress,
    ) -> Result<Moved> {
        let watch = Stopwatch::start();
        let settings = Settings {
            newmark: self.settings.newmark,
            tolerance: self.settings.tolerance,
            symbolic: self.symbolic.clone(),
            linear: match self.settings.linear_solver {
                scene::Linear::Cholesky => LinearSolver::Cholesky,
                scene::Linear::Cg => LinearSolver::Gradients { tolerance: self.settings.linear_tolerance },
            },
            ..Settings::with_step(step)
        };
        let [u, v] = self.start();
        let mut stepper = Stepper::new(model, external, self.integrator, settings, [&u, &v])?;
        let strain = |u: &[f64]| global_strain(&self.given.lattice.network, &self.dofs().expand(u));
        let motion = motion::run(&mut stepper, schedule, &strain, progress)?;
        let (steps, solves) = (schedule.steps, stepper.solves());
        Ok(Moved { alpha, step, steps, motion, solves, inverted: None, seconds: watch.seconds() })
    }

    /// Refuses a record that would not fit.
    fn check_record(&self, schedules: &[Schedule]) -> Result<()> {
        let records: f64 = schedules.iter().map(|s| (s.steps / s.every + 2) as f64).sum();
        let bytes = 8.0 * records * self.dofs().len() as f64;
        if bytes <= LARGEST_RECORD {
            return Ok(());
        }
        let key = if self.settings.interval.is_some() { "dynamics.interval" } else { "dynamics.frames" };
        let message = format!("{records:.0} records of {} numbers are {:.1} GB", self.dofs().len(), bytes / 1e9);
        Err(Error::input(key, message, "record less often, or move for a shorter time"))
    }
}

/// Steps of a run and between records.
fn schedule(settings: &scene::Dynamics, step: f64) -> Schedule {
    // a duration that is a whole number of steps must not get one more by rounding
    let of_duration = |duration: f64| ((duration / step - 1e-9).ceil() as u64).max(1);
    let steps = settings.steps.unwrap_or_else(|| settings.duration.map_or(1, of_duration));
    let every = match settings.interval {
        Some(interval) => ((interval / step).round() as u64).max(1),
        None => steps.div_ceil(settings.frames),
    };
    Schedule { steps, every }
}
