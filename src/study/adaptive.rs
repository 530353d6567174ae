//! Groups that adapt, on the network of a scene: what a ladder needs, and what it leads to as a calibration.

use std::sync::Arc;

use crate::calibration::adaptive::features::{self, Site};
use crate::calibration::adaptive::part::Part;
use crate::calibration::adaptive::state::Cases;
use crate::calibration::adaptive::worker::Ground;
use crate::calibration::adaptive::{Ladder, Limits, Standing, climb, places};
use crate::calibration::errors;
use crate::calibration::optimiser::{Outcome, TracePoint};
use crate::calibration::sweep::Search;
use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};
use crate::geometry::dofs::FIXED;
use crate::springs::grouping::{self, Group, Grouping, Request};
use crate::springs::network::Network;

use super::body::Body;
use super::checkpoint::Checkpoint;
use super::continuum::Continuum;
use super::fit::{self, Calibration, Given, Row};
use super::linear_fit;
use super::network;

/// Starts of the first fit, unless the scene says otherwise.
const STARTS: usize = 2;

/// Columns that a rung needs beside those of its groups.
const BESIDE: usize = 160;

/// Fits the network of a scene with groups that adapt.
///
/// # Errors
/// As [`climb`]; [`crate::error::Error::Input`] for more groups than memory holds.
pub fn calibrate(given: Given, progress: &Progress, checkpoint: &Checkpoint) -> Result<Calibration> {
    let clock = Stopwatch::start();
    check_memory(&given)?;
    progress.enter("calibration", given.scene.springs.groups as u64);
    let network = &given.lattice.network;
    let inputs = inputs(&given);
    let kept = checkpoint.ladder(inputs).filter(|standing| standing.is_of(network.springs.len()));
    let ladder = climb_scene(&given, kept, progress, &mut |standing| checkpoint.keep_ladder(inputs, standing))?;
    let grouping = grouping_of(&ladder.parts, network);
    let goal = linear_fit::goal(&given)?;
    let mut problem = given.problem(&goal, &grouping, 0)?;
    problem.search = Search::Known(ladder.phi.clone());
    let confirmed = given.solve(std::slice::from_ref(&problem), progress, checkpoint)?;
    let errors = errors::over_cases(&given.fitted_errors(&confirmed[0].displacement));
    let error = ladder.rungs[ladder.taken].error;
    let row = Row {
        gamma: None,
        groups: grouping.groups.len(),
        solved_by: 0,
        errors,
        error_difference: Some((error - errors.e_rms).abs() / errors.e_rms.max(f64::MIN_POSITIVE)),
        seconds: clock.seconds(),
        outcome: Arc::new(outcome(&ladder)),
    };
    let found = given.finish(vec![row], 0, grouping.clone(), &problem, None)?;
    Ok(Calibration { ladder: ladder.rungs, ..found })
}

/// A digest of the numbers that a ladder begins with.
fn inputs(given: &Given) -> u64 {
    let (fitted, held_out) = (given.cases(true), given.cases(false));
    given.digest(&[], &[&fitted.forces, &fitted.reference, &held_out.forces, &held_out.reference])
}

/// Refuses columns that would not fit: those of the groups and those of the splits, four copies at a time.
fn check_memory(given: &Given) -> Result<()> {
    let groups = given.scene.springs.groups.min(given.lattice.network.springs.len());
    let fitted = given.loads.iter().filter(|case| case.fit).count();
    let bytes = 8.0 * 4.0 * (groups + BESIDE) as f64 * (given.body.dofs.len() * fitted) as f64;
    if bytes <= fit::LARGEST_JACOBIAN {
        return Ok(());
    }
    let message =
        format!("{groups} groups on {} degrees of freedom need {:.1} GB", given.body.dofs.len(), 1e-9 * bytes);
    Err(Error::input("springs.groups", message, "use fewer groups or fewer control points"))
}

/// The ladder of a scene, from its beginning or on from what was kept of it; `hear` is told of every new rung.
///
/// # Errors
/// As [`climb`].
pub fn climb_scene(
    given: &Given,
    kept: Option<Standing>,
    progress: &Progress,
    hear: &mut dyn FnMut(&Standing) -> Result<()>,
) -> Result<Ladder> {
    let (network, springs) = (&given.lattice.network, &given.scene.springs);
    let rule = grouping::find("each").expect("the table has it");
    let (goal, single) = (linear_fit::goal(given)?, (rule.group)(network, &Request::default())?);
    let each = given.problem(&goal, &single, 0)?;
    let (_, start) = fit::group(given.scene, given.body, given.lattice)?;
    let [boundary, held] = [boundary(given.body)?, held(given.body)];
    let site = site(given, &boundary, &held);
    let (features, resolutions) = (features::table(&site), features::resolutions(&site));
    let places = places::places(given.body.positions(), &given.body.dofs);
    let (fitted, held_out) = (given.cases(true), given.cases(false));
    let ground = Ground {
        operator: &each.operator,
        fitted: Cases { forces: &fitted.forces, reference: &fitted.reference, weights: &fitted.weights },
        held_out: Cases { forces: &held_out.forces, reference: &held_out.reference, weights: &held_out.weights },
        bounds: &each.upper,
        features: &features,
        resolutions: &resolutions,
        places: &places,
    };
    let limits = Limits {
        groups: springs.groups,
        max_error: springs.max_error,
        patience: springs.patience,
        starts: given.scene.calibration.starts.unwrap_or(STARTS),
        regularisation: given.scene.calibration.regularisation,
    };
    let start = parts_of(&start[0], &each.upper);
    climb(ground, &network::settings(given.scene), start, kept, &limits, progress, hear)
}

/// The features of all springs of a scene: [`features::table`].
///
/// # Errors
/// For a mesh whose boundary cannot be told.
pub fn features(given: &Given) -> Result<Vec<Vec<f64>>> {
    Ok(features::table(&site(given, &boundary(given.body)?, &held(given.body))))
}

fn site<'a>(given: &Given<'a>, boundary: &'a [u32], held: &'a [u32]) -> Site<'a> {
    Site { network: &given.lattice.network, grid: given.body.grid(), boundary, held }
}

/// A grouping as parts that have not been split.
fn parts_of(grouping: &Grouping, bounds: &[f64]) -> Vec<Part> {
    let of = |a: usize| -> Vec<u32> {
        (0..grouping.group_of.len() as u32).filter(|&s| grouping.group_of[s as usize] as usize == a).collect()
    };
    grouping.groups.iter().enumerate().map(|(a, group)| Part::whole(&group.name, of(a), bounds)).collect()
}

/// Parts as a grouping.
fn grouping_of(parts: &[Part], network: &Network) -> Grouping {
    let mut group_of = vec![0; network.springs.len()];
    let mut groups = Vec::with_capacity(parts.len());
    for (a, part) in parts.iter().enumerate() {
        part.springs.iter().for_each(|&s| group_of[s as usize] = a as u32);
        let length: f64 = part.springs.iter().map(|&s| network.springs[s as usize].length).sum();
        let springs = part.springs.len();
        groups.push(Group { name: part.name(), springs, length: length / springs as f64 });
    }
    Grouping { group_of, groups }
}

/// What the ladder found, as an optimiser would say it.
fn outcome(ladder: &Ladder) -> Outcome {
    let point = |rung: &crate::calibration::adaptive::Rung| TracePoint {
        seconds: rung.seconds,
        refactorisations: rung.counts.refactorisations,
        error: rung.error,
    };
    Outcome {
        phi: ladder.phi.clone(),
        error: ladder.rungs[ladder.taken].error,
        stop: ladder.stop,
        counts: ladder.rungs[ladder.rungs.len() - 1].counts,
        trace: ladder.rungs.iter().map(point).collect(),
    }
}

/// Nodes on the boundary of a body, ascending: the ends of the control grid, the boundary of a mesh.
fn boundary(body: &Body) -> Result<Vec<u32>> {
    let mut nodes: Vec<u32> = match &body.continuum {
        Continuum::Splines { patch, .. } => {
            let grid = patch.grid();
            let at_end = |node: usize| {
                let index = grid.index(node);
                (0..grid.dimension()).any(|a| index[a] == 0 || index[a] + 1 == grid.shape()[a])
            };
            (0..grid.len()).filter(|&node| at_end(node)).map(|node| node as u32).collect()
        }
        Continuum::Elements { mesh, .. } => {
            mesh.boundary_faces()?.iter().flat_map(|face| face.nodes().iter().copied()).collect()
        }
    };
    nodes.sort_unstable();
    nodes.dedup();
    Ok(nodes)
}

/// Nodes with a held component, ascending.
fn held(body: &Body) -> Vec<u32> {
    let is_held = |node: &usize| body.dofs.free(*node).contains(&FIXED);
    (0..body.dofs.nodes()).filter(is_held).map(|node| node as u32).collect()
}
