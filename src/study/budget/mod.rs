//! The cheapest network that is good enough: resolution and groups walked from the coarse end.
//!
//! A network is a point: the error that is left on loads it was not fitted to, against the time of one explicit step. The step
//! depends on the resolution only (and on springs that a fit leaves without stiffness, which are dropped); the error on
//! resolution and groups. With `[budget]` the resolutions
//!
//! ```text
//! n_a = 1 + round(f (N_a - 1)),     f = 1/4, 3/8, 1/2, 3/4, 1        N: the finest grid
//! ```
//!
//! are walked from the coarsest that the shape has; at each the scene is calibrated, and every number of groups on the
//! way counts. The walk ends at the first resolution that meets error and step, for a finer one steps slower; there the fewest
//! groups that do are taken, and the scene is run once more with them. It ends as well where the step takes too long.
//!
//! Errors are those against the reference of the same resolution, or with `[converged]` the total against the finer mesh:
//! then a coarse grid is not better than it is. Step times are measured, so that near a limit two runs may choose
//! differently; with the choice made, the numbers are those of any run of that resolution. %, s.

mod front;

use crate::calibration::adaptive::Rung;
use crate::calibration::errors::{self, Errors};
use crate::clock::{Progress, Stopwatch};
use crate::dynamics::falling::Falling;
use crate::dynamics::forces::SpringForces;
use crate::error::{Error, Result};
use crate::geometry::dofs::FIXED;
use crate::geometry::shapes::Shape;
use crate::readable::significant;
use crate::scene::{self, Scene};

use super::Study;
use super::checkpoint::Checkpoint;

pub use front::{Front, Point};

/// Resolutions that are walked, as fractions of the spans of the finest.
const FRACTIONS: [f64; 5] = [0.25, 0.375, 0.5, 0.75, 1.0];

/// The default of the finest grid, over the spans of the shape's own.
const FINER: usize = 2;

/// Steps are measured in this many rounds of at least so many seconds; the median counts.
const ROUNDS: usize = 7;
const ROUND: f64 = 2e-3;

/// What became of a budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// All networks that were tried.
    pub front: Front,
    /// The one that was taken, among the points of the front.
    pub chosen: usize,
    /// Whether it meets the budget.
    pub met: bool,
}

impl Outcome {
    /// The error of a budget that is not met.
    pub fn check(&self, budget: &scene::Budget) -> Result<()> {
        if self.met {
            return Ok(());
        }
        let Point { control_points, groups, error, step_seconds, .. } = &self.front.points[self.chosen];
        let limit = budget.step_time.map_or(String::new(), |seconds| format!(" (allowed {seconds:.2e} s)"));
        let best = format!(
            "the best of {} networks, {control_points:?} with {groups} groups, leaves {} % (allowed {} %) at \
             {step_seconds:.2e} s a step{limit}",
            self.front.points.len(),
            significant(*error, 4),
            budget.max_error
        );
        Err(Error::OverBudget { best })
    }
}

/// Walks the resolutions of a scene with a budget and runs the one that is chosen. A resolution that is in the checkpoint
/// is not run again, nor its step measured.
///
/// # Errors
/// Those of a run of the scene, when no resolution can be run; [`Error::Interrupted`]; those of the checkpoint.
pub fn run(scene: &Scene, budget: &scene::Budget, progress: &Progress, checkpoint: &Checkpoint) -> Result<Study> {
    let limit = budget.step_time.unwrap_or(f64::INFINITY);
    let mut front = walk(scene, budget.finest.as_deref(), progress, checkpoint, |points| {
        let slow = points.iter().any(|point| point.step_seconds > limit);
        slow || points.iter().any(|point| point.error <= budget.max_error)
    })?;
    let (chosen, met) = front.choose(budget).expect("a walk has points");
    let Point { control_points, groups, calibration_seconds, .. } = front.points[chosen].clone();
    let mut scene = at(scene, &control_points);
    if front.points.get(chosen + 1).is_some_and(|next| next.control_points == control_points) {
        // a rung below the last one; the last is what the scene's own number of groups leads to
        scene.springs.groups = groups;
    }
    let mut study = super::run_one(&scene, progress, checkpoint)?;
    // the network that is handed over is measured itself
    let point = last_point(&study, &control_points, calibration_seconds);
    let met = met && point.error <= budget.max_error && point.step_seconds <= limit;
    front.points[chosen] = point;
    study.budget = Some(Outcome { front, chosen, met });
    Ok(study)
}

/// The networks of all resolutions, from the coarsest; `enough` ends the walk after a resolution.
///
/// # Errors
/// That of the finest resolution when none can be run; [`Error::Interrupted`]; those of the checkpoint.
pub fn walk(
    scene: &Scene,
    finest: Option<&[usize]>,
    progress: &Progress,
    checkpoint: &Checkpoint,
    enough: impl Fn(&[Point]) -> bool,
) -> Result<Front> {
    let mut front = Front::default();
    let mut failure = None;
    for control_points in resolutions(scene, finest)? {
        let networks = match checkpoint.walked(&control_points) {
            Some(known) => Ok(known),
            None => networks_at(scene, &control_points, progress, checkpoint),
        };
        match networks {
            Ok(points) => {
                let done = enough(&points);
                front.points.extend(points);
                if done {
                    break;
                }
            }
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) if checkpoint.failure().is_some() => return Err(error),
            Err(error) => {
                front.skipped.push((control_points, error.to_string()));
                failure = Some(error);
            }
        }
    }
    match failure.filter(|_| front.points.is_empty()) {
        Some(error) => Err(error),
        None => Ok(front),
    }
}

/// Runs one resolution, without motion; its networks are kept.
fn networks_at(
    scene: &Scene,
    control_points: &[usize],
    progress: &Progress,
    checkpoint: &Checkpoint,
) -> Result<Vec<Point>> {
    let watch = Stopwatch::start();
    let mut scene = Scene { dynamics: None, ..at(scene, control_points) };
    // the network that is chosen is tried under other loads, those on the way are not
    scene.calibration.generalisation = Some(false);
    let study = super::run_one(&scene, progress, checkpoint)?;
    let points = points_of(&study, control_points, watch.seconds());
    checkpoint.keep_walked(&points)?;
    Ok(points)
}

/// The scene at a resolution.
fn at(scene: &Scene, control_points: &[usize]) -> Scene {
    let mut scene = scene.clone();
    scene.geometry.control_points = Some(control_points.to_vec());
    scene
}

/// The grids to try, from the coarsest.
fn resolutions(scene: &Scene, finest: Option<&[usize]>) -> Result<Vec<Vec<usize>>> {
    let shape: &Shape = scene.geometry.known_shape().ok_or_else(|| {
        Error::input("geometry.shape", "only a shape comes at every resolution", "see `springfit list shapes`")
    })?;
    let own: Vec<usize> = shape.default_control_points.iter().map(|n| FINER * (n - 1) + 1).collect();
    let finest = finest.or(scene.geometry.control_points.as_deref()).unwrap_or(&own);
    let scaled = |f: f64| finest.iter().map(|&n| 1 + (f * (n - 1) as f64).round().max(1.0) as usize).collect();
    let mut all: Vec<Vec<usize>> = FRACTIONS.into_iter().map(scaled).collect();
    all.dedup();
    Ok(all)
}

/// The networks that a study went through: the rungs of groups that adapt, or the one it ended with. The step is that of
/// the last of them.
fn points_of(study: &Study, control_points: &[usize], seconds: f64) -> Vec<Point> {
    let last = last_point(study, control_points, seconds);
    let rungs = match &study.converged {
        // only the network at the end was held against the finer mesh
        Some(_) => &[],
        None => &study.calibration.ladder[..],
    };
    let point = |rung: &Rung| Point {
        groups: rung.groups,
        fitted: rung.error,
        error: rung.held_out.unwrap_or(rung.error),
        calibration_seconds: rung.seconds,
        ..last.clone()
    };
    let below = rungs.iter().filter(|rung| rung.groups < last.groups).map(point);
    below.chain([last.clone()]).collect()
}

/// The network that a study ended with.
fn last_point(study: &Study, control_points: &[usize], calibration_seconds: f64) -> Point {
    let found = &study.calibration;
    Point {
        control_points: control_points.to_vec(),
        groups: found.grouping.groups.len(),
        springs: found.stiffness.len(),
        fitted: found.fitted.e_rms,
        error: error(study),
        step_seconds: step_seconds(study),
        calibration_seconds,
    }
}

/// e_rms of a study over the cases that are held out, of all cases where none is; against the finer mesh where there is one.
fn error(study: &Study) -> f64 {
    let held_out = study.loads.iter().any(|case| !case.fit);
    let counts = |c: &usize| !held_out || !study.loads[*c].fit;
    let of = |c: usize| match &study.converged {
        Some(converged) => Errors { e_rms: converged.cases[c].total, e_max: converged.cases[c].total },
        None => study.calibration.errors[c],
    };
    let cases: Vec<Errors> = (0..study.loads.len()).filter(counts).map(of).collect();
    errors::over_cases(&cases).e_rms
}

/// Seconds of one explicit step of the network, with all threads: the median of some rounds.
pub fn step_seconds(study: &Study) -> f64 {
    let network = &study.lattice.network;
    let held = |node: usize| study.body.dofs.free(node).iter().all(|&dof| dof == FIXED);
    let mobility = (0..network.positions.len()).map(|node| if held(node) { 0.0 } else { 1.0 }).collect();
    let forces = SpringForces::new(network, &study.calibration.stiffness, None);
    // so short a step that nothing moves: a step costs what it costs wherever the nodes are
    let mut run = Falling::new(forces, network.positions.clone(), mobility, [0.0; 3], f64::MIN_POSITIVE);
    let mut times = 1;
    let mut round = |times: usize| {
        let watch = Stopwatch::start();
        (0..times).for_each(|_| run.advance());
        watch.seconds()
    };
    while round(times) < ROUND {
        times *= 2;
    }
    let mut seconds: Vec<f64> = (0..ROUNDS).map(|_| round(times) / times as f64).collect();
    seconds.sort_by(f64::total_cmp);
    seconds[ROUNDS / 2]
}
