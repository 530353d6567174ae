//! Groups, bounds and fits: Algorithm 5.1 on the network of a scene.
//!
//! Every gamma gives a grouping; equal groupings are one problem. Each problem is an affine stiffness K(phi) on the one
//! analysed pattern with the bounds (5.8) of its groups. The best row of the sweep is the calibrated network: its springs get their
//! stiffness, and it is loaded with all cases, fitted and held out.
//!
//! | file | idea |
//! |---|---|
//! | `given` | what a fit works on, and its steps |
//! | `calibration` | what it found |
//! | `undetermined` | groups that the data do not determine |

mod calibration;
mod given;
mod undetermined;

use std::sync::Arc;

use crate::calibration::errors;
use crate::calibration::optimiser::{self, Optimiser, Settings};
use crate::calibration::sweep::{self, Solved, SweepProblem};
use crate::clock::Progress;
use crate::error::{Error, Result};
use crate::scene::{ADAPTIVE, Scene};
use crate::springs::grouping::{self, Grouping, Request};

use super::adaptive;
use super::body::Body;
use super::checkpoint::Checkpoint;
use super::given_stiffness;
use super::linear_fit::{self, Goal};
use super::network::Lattice;
use super::spring_sets;

pub use calibration::{Calibration, Matrices, Row};
pub use given::Given;
pub(super) use given::LARGEST_JACOBIAN;
pub(super) use undetermined::check as check_determined;

/// Fits the network of a scene to the reference; what is finished goes into the checkpoint, what is in it is not done again.
///
/// # Errors
/// [`Error::Input`] for a name or gamma that is not allowed; those of the optimiser; [`Error::File`] for a checkpoint of
/// another run or one that cannot be written.
pub fn calibrate(given: Given, progress: &Progress, checkpoint: &Checkpoint) -> Result<Calibration> {
    if given.scene.springs.grouping == ADAPTIVE {
        return adaptive::calibrate(given, progress, checkpoint);
    }
    let (gammas, groupings) = group(given.scene, given.body, given.lattice)?;
    let goal = linear_fit::goal(&given)?;
    let same = sweep::first_equal(&groupings);
    let distinct: Vec<usize> = (0..groupings.len()).filter(|&i| same[i] == i).collect();
    given.check_memory(distinct.iter().map(|&i| groupings[i].groups.len()).max().unwrap_or(0))?;
    let problems: Vec<SweepProblem> =
        distinct.iter().map(|&i| given.problem(&goal, &groupings[i], i)).collect::<Result<_>>()?;
    let solved = given.solve(&problems, progress, checkpoint)?;
    let displacements: Vec<Vec<f64>> = distinct
        .iter()
        .zip(&solved)
        .map(|(&i, found)| given.moved(found, &groupings[i], progress))
        .collect::<Result<_>>()?;
    let answer = |i: usize| distinct.iter().position(|&d| d == same[i]).unwrap_or(0);
    let sweep: Vec<Row> = (0..gammas.len())
        .map(|i| {
            let Solved { outcome, error_difference, seconds, .. } = &solved[answer(i)];
            let errors = errors::over_cases(&given.fitted_errors(&displacements[answer(i)]));
            let error_difference = match goal {
                Goal::Large(_) => Some((outcome.error - errors.e_rms).abs() / errors.e_rms),
                _ => *error_difference,
            };
            let outcome = Arc::new(outcome.clone());
            Row {
                gamma: gammas[i],
                groups: groupings[i].groups.len(),
                solved_by: same[i],
                errors,
                error_difference,
                seconds: *seconds,
                outcome,
            }
        })
        .collect();
    let best = (0..sweep.len()).min_by(|&i, &j| rank(&sweep[i], &sweep[j])).expect("a sweep has a row");
    let grouping = groupings[best].clone();
    given.finish(sweep, best, grouping, &problems[answer(best)], goal.matrices(&given))
}

/// Rows by error; of equals the one with fewer groups, then the earlier.
fn rank(a: &Row, b: &Row) -> std::cmp::Ordering {
    a.errors.e_rms.total_cmp(&b.errors.e_rms).then(a.groups.cmp(&b.groups))
}

/// The gammas of a scene (one entry without gamma for a grouping that does not use it) and their groupings.
pub(super) fn group(scene: &Scene, body: &Body, lattice: &Lattice) -> Result<(Vec<Option<f64>>, Vec<Grouping>)> {
    match given_stiffness::given(scene, body, lattice)? {
        Some((grouping, _)) => Ok((vec![None], vec![grouping])),
        None => rule_groups(scene, body, lattice),
    }
}

/// The gammas of a scene and the groupings by its rule.
pub(super) fn rule_groups(scene: &Scene, body: &Body, lattice: &Lattice) -> Result<(Vec<Option<f64>>, Vec<Grouping>)> {
    let name = &scene.springs.grouping;
    let rule = grouping::find(name).ok_or_else(|| {
        Error::input("springs.grouping", format!("there is no grouping {name}"), "see `springfit list groupings`")
    })?;
    let gammas: Vec<Option<f64>> = match rule.uses_gamma {
        true => scene.calibration.gamma.values()?.into_iter().map(Some).collect(),
        false => vec![None],
    };
    let sets = spring_sets::sets(scene, body)?;
    let usual = Request { groups: scene.springs.groups, sets: &sets, ..Request::default() };
    let one = |gamma: &Option<f64>| {
        let request = Request { gamma: gamma.unwrap_or(usual.gamma), ..usual };
        (rule.group)(&lattice.network, &request)
    };
    let groupings = gammas.iter().map(one).collect::<Result<_>>()?;
    Ok((gammas, groupings))
}

/// The optimiser of a scene and its settings; one that fits nothing has none and gets the one that does nothing beside it.
pub(super) fn optimiser(scene: &Scene) -> Result<(&'static Optimiser, Settings)> {
    let given = &scene.calibration;
    let name = given.optimiser().unwrap_or("least_squares");
    let optimiser = optimiser::find(name).ok_or_else(|| {
        let message = format!("there is no optimiser {name}");
        Error::input("calibration.optimiser", message, "see `springfit list optimisers`")
    })?;
    let settings = Settings {
        starts: given.starts,
        refactorisations: given.gauss_newton.refactorisations as u64,
        polish: given.gauss_newton.polish as u64,
        tolerance: given.gauss_newton.tolerance,
        chains: given.annealing.chains,
        evaluations: given.annealing.evaluations as u64,
        initial_temperature: given.annealing.initial_temperature,
        final_temperature: given.annealing.final_temperature,
    };
    Ok((optimiser, settings))
}
