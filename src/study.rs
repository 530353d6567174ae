//! From a scene to a calibrated network: the method, step by step.
//!
//! 1. the body: a patch or a mesh ([`continuum`]), held and tied nodes ([`body`]);
//! 2. the forces of every load case ([`loads`]);
//! 3. the continuum reference: K_ref u_ref = f;
//! 4. the springs on the same nodes, and one analysis of their pattern ([`network`]);
//! 5. groups and bounds for every gamma, the fit of each (Algorithm 5.1), and the errors under fitted and held-out loads
//!    ([`fit`], and [`linear_fit`] for the objectives other than the displacement);
//! 6. masses, damping, safe steps and motions if the scene asks for them ([`mod@motion`]).
//!
//! This is the only room that knows all rooms below.

pub mod body;
pub mod continuum;
pub mod fit;
pub mod linear_fit;
pub mod loads;
pub mod matrix_profile;
pub mod motion;
pub mod near_mechanism;
pub mod network;
pub mod plan;
pub mod spring_sets;

use std::path::{Path, PathBuf};

use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};
use crate::export::motion::Recorded;
use crate::export::{self, Calibrated, EXPORTERS};
use crate::reference::Reference;
use crate::scene::Scene;
use crate::springs::solver;

use body::Body;
use fit::{Calibration, Given};
use loads::LoadCase;
use network::Lattice;

/// All that a run found.
pub struct Study {
    /// The scene with every default written out.
    pub scene: Scene,
    /// The body.
    pub body: Body,
    /// The load cases in the order of the scene.
    pub loads: Vec<LoadCase>,
    /// The solved continuum; `reference.cases[i]` belongs to `loads[i]`.
    pub reference: Reference,
    /// The network with its analysis.
    pub lattice: Lattice,
    /// The calibration.
    pub calibration: Calibration,
    /// Masses, damping, safe steps and motions, if the scene has `[dynamics]`.
    pub dynamics: Option<motion::Dynamics>,
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
        let cases: Vec<export::Case> = (0..self.loads.len())
            .map(|c| export::Case { name: &self.loads[c].name, reference: &reference[c], springs: &springs[c] })
            .collect();
        let moved = self.dynamics.iter().flat_map(|data| &data.motions);
        let motions: Vec<Recorded> =
            moved.map(|moved| Recorded { alpha: moved.alpha, motion: &moved.motion }).collect();
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

/// Runs a checked scene.
///
/// # Errors
/// [`Error::Input`] where a value does not fit the body; [`Error::Mechanism`] and its kin where the numbers do not allow
/// it; [`Error::Interrupted`].
pub fn run(scene: &Scene, progress: &Progress) -> Result<Study> {
    let mut seconds = Vec::new();
    let mut timed = |stage: &'static str, watch: Stopwatch| seconds.push((stage, watch.seconds()));

    let watch = Stopwatch::start();
    progress.enter("body and loads", 0);
    let body = body::build(scene)?;
    let scene = body.resolved.clone();
    let mut loads = loads::build(&scene, &body)?;
    timed("geometry", watch);

    let watch = Stopwatch::start();
    progress.enter("reference", 0);
    let mut reference = solve_reference(&body, &loads, progress)?;
    loads::scale(&scene, &mut loads, &mut reference);
    timed("reference", watch);

    let watch = Stopwatch::start();
    progress.enter("springs", 0);
    let mut lattice = network::build(&scene, &body)?;
    progress.check()?;
    timed("springs", watch);

    let watch = Stopwatch::start();
    let fit_on = |lattice: &Lattice| {
        let given = Given { scene: &scene, body: &body, loads: &loads, reference: &reference, lattice };
        fit::calibrate(given, progress)
    };
    let calibration = match fit_on(&lattice) {
        // groups far apart can make a body hard that a trial with equal springs took for easy
        Err(Error::Inaccurate { .. }) if lattice.symbolic.is_none() && scene.solver.path == solver::Path::Auto => {
            lattice = lattice.analysed(&scene, &body, Some("it did not converge for the groups of this body"))?;
            fit_on(&lattice)
        }
        outcome => outcome,
    }?;
    timed("calibration", watch);

    let watch = Stopwatch::start();
    let given = Given { scene: &scene, body: &body, loads: &loads, reference: &reference, lattice: &lattice };
    let dynamics = motion::run(given, &calibration, progress)?;
    if dynamics.is_some() {
        timed("dynamics", watch);
    }
    let mut warnings = body.warnings.clone();
    warnings.extend(lattice.warnings.iter().cloned());
    warnings.extend(linear_fit::warning(&scene, &body));
    warnings.extend(calibration.warning());
    warnings.extend(calibration.weakness.warning());
    Ok(Study { scene, body, loads, reference, lattice, calibration, dynamics, warnings, seconds })
}

/// The continuum under all loads.
///
/// # Errors
/// Those of [`Reference::solve_watching`].
pub fn solve_reference(body: &Body, loads: &[LoadCase], progress: &Progress) -> Result<Reference> {
    let points = body.integration_points()?;
    let order = body.reference_order(&points)?;
    let forces: Vec<_> = loads.iter().map(|case| case.load.clone()).collect();
    Reference::solve_watching(&points, body.lame, &body.dofs, order, &forces, &progress.interrupt())
}
