//! From a scene to a calibrated network: the method, step by step.
//!
//! 1. the body: a patch or a mesh ([`continuum`]), held and tied nodes ([`body`]);
//! 2. the forces of every load case ([`loads`]);
//! 3. the springs on the same nodes, and one analysis of their pattern ([`network`]); what the run will take against what it
//!    may ([`limits`]);
//! 4. the continuum reference: K_ref u_ref = f, or its equilibrium under large displacements ([`large`]);
//! 5. groups and bounds for every gamma, the fit of each (Algorithm 5.1), and the errors under fitted and held-out loads
//!    ([`fit`]; [`linear_fit`] for the objectives other than the displacement, [`adaptive`] for groups that adapt,
//!    [`given_stiffness`] where nothing is fitted);
//! 6. the network under loads that are not in the scene ([`other_loads`]): where it is too soft and too stiff
//!    ([`mod@generalisation`]);
//! 7. the same body on a finer mesh, if the scene asks for it: the error of the mesh beside that of the springs ([`converged`]);
//! 8. masses, damping, safe steps and motions if the scene asks for them ([`mod@motion`]).
//!
//! A scene with a budget is run at several resolutions, and the cheapest network that meets it is kept ([`mod@budget`]).
//!
//! This is the only room that knows all rooms below.

pub mod adaptive;
pub mod body;
pub mod budget;
pub mod checkpoint;
pub mod continuum;
pub mod converged;
pub mod fit;
pub mod generalisation;
pub mod given_stiffness;
pub mod large;
pub mod limits;
pub mod linear_fit;
pub mod loads;
pub mod matrix_profile;
pub mod mesh_quality;
pub mod motion;
pub mod near_mechanism;
pub mod network;
pub mod other_loads;
pub mod plan;
pub mod spring_sets;
pub mod springs_file;

use std::path::{Path, PathBuf};

use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};
use crate::export::motion::Recorded;
use crate::export::{self, Calibrated, EXPORTERS};
use crate::reference::{Forces, Reference};
use crate::scene::{Model, Scene};
use crate::springs::solver;

use body::Body;
use checkpoint::Checkpoint;
use fit::{Calibration, Given};
use generalisation::Generalisation;
use loads::LoadCase;
use mesh_quality::MeshQuality;
use network::Lattice;

/// All that a run found.
pub struct Study {
    /// The scene with every default written out.
    pub scene: Scene,
    /// The body.
    pub body: Body,
    /// How good its mesh is; none of a patch.
    pub mesh: Option<MeshQuality>,
    /// The load cases in the order of the scene.
    pub loads: Vec<LoadCase>,
    /// The solved continuum; `reference.cases[i]` belongs to `loads[i]`.
    pub reference: Reference,
    /// The network with its analysis.
    pub lattice: Lattice,
    /// The calibration.
    pub calibration: Calibration,
    /// How far it can be trusted on other loads.
    pub generalisation: Generalisation,
    /// Errors against a finer mesh, if the scene has `[converged]`.
    pub converged: Option<converged::Converged>,
    /// Masses, damping, safe steps and motions, if the scene has `[dynamics]`.
    pub dynamics: Option<motion::Dynamics>,
    /// What became of the budget, if the scene has one.
    pub budget: Option<budget::Outcome>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Seconds of each stage, in order.
    pub seconds: Vec<(&'static str, f64)>,
}

impl Study {
    /// Writes springs and fields into a folder with every exporter, each file whole or not at all; returns the files.
    ///
    /// # Errors
    /// [`crate::error::Error::File`] with the file that cannot be written.
    pub fn export(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let expand = |u: &Vec<f64>| self.body.dofs.expand(u);
        let reference: Vec<_> = self.reference.cases.iter().map(|case| expand(&case.displacement)).collect();
        let springs: Vec<_> = self.calibration.displacements.iter().map(expand).collect();
        let forces: Vec<_> = self.loads.iter().map(|case| expand(&case.load.forces)).collect();
        let cases: Vec<export::Case> = (self.loads.iter().enumerate())
            .map(|(c, LoadCase { name, fit, .. })| export::Case {
                name,
                fit: *fit,
                forces: &forces[c],
                reference: &reference[c],
                springs: &springs[c],
            })
            .collect();
        let moving = self.dynamics.as_ref().map(|data| &data.dofs);
        let moved = self.dynamics.iter().flat_map(|data| &data.motions);
        let of_body = self.scene.dynamics.as_ref().is_some_and(|dynamics| dynamics.model == Model::Reference);
        let motions: Vec<Recorded> =
            moved.map(|moved| Recorded { alpha: moved.alpha, motion: &moved.motion, dofs: moving, of_body }).collect();
        let calibrated = Calibrated {
            name: &self.scene.name,
            body: self.body.continuum.exported(),
            network: &self.lattice.network,
            dofs: &self.body.dofs,
            grouping: &self.calibration.grouping,
            stiffness: &self.calibration.stiffness,
            masses: self.dynamics.as_ref().map(|data| data.masses.as_slice()),
            damping: self.dynamics.as_ref().and_then(|data| data.damping.as_deref()),
            cases: &cases,
            motions: &motions,
        };
        let written = EXPORTERS.iter().map(|exporter| (exporter.write)(&calibrated, folder));
        Ok(written.collect::<Result<Vec<_>>>()?.concat())
    }
}

/// Runs a checked scene; one with a budget at the resolution and with the groups that the budget chooses ([`mod@budget`]).
///
/// # Errors
/// [`Error::Input`] where a value does not fit the body; [`Error::Mechanism`] and its kin where the numbers do not allow
/// it; [`Error::Interrupted`]. A budget that is not met is no error here: see [`budget::Outcome::check`].
pub fn run(scene: &Scene, progress: &Progress) -> Result<Study> {
    run_keeping(scene, progress, &Checkpoint::none())
}

/// Runs a checked scene; what is finished goes into a checkpoint, what is in it already is not done again. The study is
/// the same to the last bit, seconds apart.
///
/// # Errors
/// As [`run`]; [`Error::File`] for a checkpoint of another run, or one that cannot be written.
pub fn run_keeping(scene: &Scene, progress: &Progress, checkpoint: &Checkpoint) -> Result<Study> {
    match &scene.budget {
        Some(given) => budget::run(scene, given, progress, checkpoint),
        None => run_one(scene, progress, checkpoint),
    }
}

/// Runs a scene at its own resolution.
fn run_one(scene: &Scene, progress: &Progress, checkpoint: &Checkpoint) -> Result<Study> {
    let mut seconds = Vec::new();
    let mut timed = |stage: &'static str, watch: Stopwatch| seconds.push((stage, watch.seconds()));

    let watch = Stopwatch::start();
    progress.enter("body and loads", 0);
    limits::before_the_body(scene)?;
    let body = body::build(scene)?;
    let mesh = mesh_quality::of(&body)?;
    let scene = body.resolved.clone();
    let mut loads = loads::build(&scene, &body)?;
    timed("geometry", watch);

    let watch = Stopwatch::start();
    progress.enter("springs", 0);
    let mut lattice = network::build(&scene, &body)?;
    plan::admit(&scene, &body, &loads, &lattice)?;
    progress.check()?;
    timed("springs", watch);

    let watch = Stopwatch::start();
    progress.enter("reference", 0);
    let others = other_loads::build(&scene, &body, &lattice)?;
    let probes = others.as_ref().map_or(&[][..], |others| &others.forces);
    let (mut reference, answers) = solve_probing(&body, &loads, probes, progress)?;
    loads::scale(&scene, &mut loads, &mut reference);
    large::answer(&scene, &body, &loads, &mut reference, progress)?;
    loads::check_answers(&reference)?;
    timed("reference", watch);

    let watch = Stopwatch::start();
    let fit_on = |lattice: &Lattice| {
        let given = Given { scene: &scene, body: &body, loads: &loads, reference: &reference, lattice };
        fit::calibrate(given, progress, checkpoint)
    };
    let mut calibration = match fit_on(&lattice) {
        // groups far apart can make a body hard that a trial with equal springs took for easy
        Err(Error::Inaccurate { .. }) if lattice.symbolic.is_none() && scene.solver.path == solver::Path::Auto => {
            lattice = lattice.analysed(&scene, &body, Some("it did not converge for the groups of this body"))?;
            fit_on(&lattice)
        }
        outcome => outcome,
    }?;
    if scene.budget.is_some() {
        drop_absent(&mut lattice, &mut calibration);
    }
    timed("calibration", watch);

    let watch = Stopwatch::start();
    let given = Given { scene: &scene, body: &body, loads: &loads, reference: &reference, lattice: &lattice };
    let generalisation = generalisation::measure(given, &calibration, others.as_ref().map_err(|why| *why), &answers)?;
    timed("other loads", watch);

    let watch = Stopwatch::start();
    let converged = converged::compare(given, &calibration, progress)?;
    if converged.is_some() {
        timed("converged reference", watch);
    }

    let watch = Stopwatch::start();
    let dynamics = motion::run(given, &calibration, progress)?;
    if dynamics.is_some() {
        timed("dynamics", watch);
    }
    let mut warnings = body.warnings.clone();
    warnings.extend(lattice.warnings.iter().cloned());
    warnings.extend(given_stiffness::warning(&scene, &body));
    warnings.extend(loads::warnings(&scene, &loads));
    warnings.extend(large::warnings(&loads, &reference));
    warnings.extend(reference.accuracy.warning("reference"));
    warnings.extend(calibration.accuracy.and_then(|accuracy| accuracy.warning("springs")));
    let fitted = scene.calibration.optimiser().is_some();
    warnings.extend(calibration.warning().filter(|_| fitted));
    warnings.extend(calibration.left_out.iter().cloned());
    let advice = near_mechanism::advice(&scene, calibration.phi.len());
    warnings.extend(generalisation.warning(&advice));
    let moved = dynamics.iter().flat_map(|data| &data.motions);
    warnings.extend(moved.filter_map(|moved| moved.inverted.and_then(|inverted| inverted.warning())));
    warnings.extend(dynamics.iter().flat_map(|dynamics| dynamics.warnings.iter().cloned()));
    Ok(Study {
        scene,
        body,
        mesh,
        loads,
        reference,
        lattice,
        calibration,
        generalisation,
        converged,
        dynamics,
        budget: None,
        warnings,
        seconds,
    })
}

/// Leaves out the springs without stiffness, and the groups that have no others.
fn drop_absent(lattice: &mut Lattice, found: &mut Calibration) {
    let kept: Vec<bool> = found.stiffness.iter().map(|k| *k > 0.0).collect();
    lattice.retain(&kept);
    found.retain(&kept);
}

/// The continuum under all loads.
///
/// # Errors
/// Those of [`Reference::solve_watching`].
pub fn solve_reference(body: &Body, loads: &[LoadCase], progress: &Progress) -> Result<Reference> {
    Ok(solve_probing(body, loads, &[], progress)?.0)
}

/// The continuum under all loads, and its displacements under further forces.
fn solve_probing(
    body: &Body,
    loads: &[LoadCase],
    probes: &[f64],
    progress: &Progress,
) -> Result<(Reference, Vec<f64>)> {
    let points = body.integration_points()?;
    let order = body.reference_order(&points)?;
    let loads: Vec<_> = loads.iter().map(|case| case.load.clone()).collect();
    let forces = Forces { loads: &loads, probes };
    Reference::solve_probing(&points, body.lame, &body.dofs, order, forces, &progress.interrupt())
}
