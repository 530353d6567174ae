//! Masses, damping, safe steps and motions of a scene with `[dynamics]`.
//!
//! Before anything moves, the limits of stability are found ([`limits`]) and a step above them is refused. Motions with
//! several alpha run side by side.

pub mod limits;

use std::sync::Arc;

use rayon::prelude::*;

use crate::calibration::errors::global_strain;
use crate::clock::{Progress, Stopwatch};
use crate::dynamics::collapse;
use crate::dynamics::external::{External, History, Part, weight};
use crate::dynamics::integrator::{self, Integrator};
use crate::dynamics::linear::{Damping, LinearModel};
use crate::dynamics::model::Model;
use crate::dynamics::motion::{self, Motion, Schedule};
use crate::dynamics::springs::{Coefficients, SpringModel};
use crate::dynamics::stepper::{Settings, Solves, Stepper};
use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::reference::{mass, stiffness};
use crate::scene::{self, Initial, Masses};
use crate::sparse::cholesky::Symbolic;
use crate::springs::damping;

use super::body::Body;
use super::fit::{Calibration, Given};
use limits::Limits;

/// Bytes that the recorded frames may take.
const LARGEST_RECORD: f64 = 4e9;

/// What `[dynamics]` asks for.
pub struct Dynamics {
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
    /// Seconds it took.
    pub seconds: f64,
}

/// All that a motion is made of, but alpha.
struct Mover<'a> {
    given: Given<'a>,
    found: &'a Calibration,
    settings: &'a scene::Dynamics,
    integrator: &'static Integrator,
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
    let integrator = integrator::find(&settings.integrator).ok_or_else(|| {
        let message = format!("there is no integrator {}", settings.integrator);
        Error::input("dynamics.integrator", message, "see `springfit list integrators`")
    })?;
    let mut mover = Mover { given, found, settings, integrator, masses, unit_damping, symbolic: None };
    let reference = mover.reference_model()?;
    mover.symbolic = mover.analysis(reference.as_ref())?;
    let (limits, damping_range) = mover.limits(reference.as_ref(), progress)?;
    let motions = if settings.moves() { mover.move_all(reference.as_ref(), &limits, progress)? } else { vec![] };
    let damping = limits[0].alpha.map(|alpha| mover.damping(alpha));
    let warnings = mover.collapses(&motions);
    Ok(Some(Dynamics { masses: mover.masses, damping, limits, damping_range, motions, warnings }))
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
pub fn announce(settings: &scene::Dynamics) -> String {
    let damping = match settings.all_alphas()[..] {
        [None] => "no damping: [dynamics] has no alpha".to_owned(),
        [_] => "damping".to_owned(),
        ref several => format!("damping with {} alpha", several.len()),
    };
    let motion = match settings.moves() {
        true => format!("motion of \"{}\" by {}", settings.model.name(), settings.integrator),
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
        &self.given.body.dofs
    }

    /// c of every spring (4.18), N s/m.
    fn damping(&self, alpha: f64) -> Vec<f64> {
        self.unit_damping.iter().map(|c| c / alpha).collect()
    }

    /// The continuum in motion, if that is what moves.
    fn reference_model(&self) -> Result<Option<LinearModel>> {
        if self.settings.model != scene::Model::Reference {
            return Ok(None);
        }
        let (body, dofs) = (self.given.body, self.dofs());
        let assembled = match &self.given.reference.stiffness {
            Some(stiffness) => stiffness.clone(),
            None => {
                let points = body.integration_points()?;
                stiffness::stiffness(&points, body.lame, dofs, &stiffness::pattern(&points, dofs))?
            }
        };
        let damping = match self.settings.rayleigh {
            Some([mass, stiffness]) => Damping::Rayleigh { mass, stiffness },
            None => Damping::None,
        };
        let masses = (0..dofs.len()).map(|dof| self.masses[dofs.owner(dof).0]).collect();
        Ok(Some(LinearModel::new(&assembled, damping, masses)))
    }

    /// The analysis of the pattern of what moves; none where springs have none because they are many.
    fn analysis(&self, reference: Option<&LinearModel>) -> Result<Option<Arc<Symbolic>>> {
        let Some(model) = reference else { return Ok(self.given.lattice.symbolic.clone()) };
        let order = self.given.body.reference_order(&self.given.body.integration_points()?)?;
        Symbolic::analyse(model.pattern(), order).map(Some)
    }

    /// Calls `then` with the model that moves; springs have the damping of alpha.
    fn with_model<T>(
        &self,
        reference: Option<&LinearModel>,
        alpha: Option<f64>,
        then: impl FnOnce(&mut dyn Model) -> T,
    ) -> T {
        if let Some(reference) = reference {
            return then(&mut reference.clone());
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
    fn move_all(&self, reference: Option<&LinearModel>, limits: &[Limits], progress: &Progress) -> Result<Vec<Moved>> {
        let steps: Vec<f64> = limits.iter().filter_map(|limits| limits.step).collect();
        let schedules: Vec<Schedule> = steps.iter().map(|&step| schedule(self.settings, step)).collect();
        for (limits, &step) in limits.iter().zip(&steps) {
            self.check_step(limits, step)?;
        }
        self.check_record(&schedules)?;
        let external = self.external()?;
        progress.enter("motion", schedules.iter().map(|schedule| schedule.steps).sum());
        let one = |i: usize| -> Result<Moved> {
            self.with_model(reference, limits[i].alpha, |model| {
                self.move_one(model, &external, limits[i].alpha, steps[i], schedules[i], progress)
            })
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
            ..Settings::with_step(step)
        };
        let still = vec![0.0; self.dofs().len()];
        let start = self.start()?.unwrap_or_else(|| still.clone());
        let mut stepper = Stepper::new(model, external, self.integrator, settings, [&start, &still])?;
        let strain = |u: &[f64]| global_strain(&self.given.lattice.network, &self.dofs().expand(u));
        let motion = motion::run(&mut stepper, schedule, &strain, progress)?;
        let (steps, solves) = (schedule.steps, stepper.solves());
        Ok(Moved { alpha, step, steps, motion, solves, seconds: watch.seconds() })
    }

    /// Index of the load case that acts.
    fn case(&self) -> usize {
        let named = |name: &String| self.given.loads.iter().position(|case| &case.name == name);
        self.settings.load_case.as_ref().and_then(named).unwrap_or(0)
    }

    /// The displacement of the static state that the body is released from, if it is.
    fn start(&self) -> Result<Option<Vec<f64>>> {
        Ok((self.settings.initial == Initial::Released).then(|| match self.settings.model {
            scene::Model::Reference => self.given.reference.cases[self.case()].displacement.clone(),
            _ => self.found.displacements[self.case()].clone(),
        }))
    }

    /// The forces in time: the load case as long as it acts, and weight.
    fn external(&self) -> Result<External> {
        let mut parts = Vec::new();
        if self.settings.initial == Initial::Rest {
            let history = match (self.settings.load_until, self.settings.load_factors.is_empty()) {
                (Some(end), _) => History::Until(end),
                (None, false) => History::Table(self.settings.load_factors.clone()),
                (None, true) => History::Constant,
            };
            parts.push(Part { forces: self.given.loads[self.case()].load.forces.clone(), history });
        }
        if let Some(gravity) = &self.settings.gravity {
            let dofs = self.dofs();
            let gravity = [0, 1, 2].map(|a| gravity.get(a).copied().unwrap_or(0.0));
            let masses: Vec<f64> = (0..dofs.len()).map(|dof| self.masses[dofs.owner(dof).0]).collect();
            let forces = weight(&masses, |dof| dofs.owner(dof).1, gravity);
            parts.push(Part { forces, history: History::Constant });
        }
        Ok(External { parts })
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
