//! Checks of `[springs]`: names, the number of groups, and the sets.

use crate::error::{Error, Result};
use crate::springs::grouping;

use super::super::check_load::check_place;
use super::super::choices::{known, names};
use super::super::springs::ADAPTIVE;
use super::super::{Gamma, GammaSweep, Kinematics, Scene, SpringSet, Springs};
use super::{length, positive, within};

/// Most groups that a grouping may be asked for.
const MOST_GROUPS: usize = 1_000_000;

pub(super) fn check(springs: &Springs) -> Result<()> {
    known("springs.topology", &springs.topology, &names("springs.topology"))?;
    known("springs.profile", springs.profile(), &names("springs.profile"))?;
    known("springs.grouping", &springs.grouping, &names("springs.grouping"))?;
    within("springs.groups", springs.groups, 1, MOST_GROUPS)?;
    if springs.topology == "list" && springs.edges.is_empty() && springs.edge_file.is_none() {
        let help = "add springs.edges = [[0, 1], ...] or springs.edge_file, or choose another topology";
        return Err(Error::input("springs.topology", "\"list\" has no springs of its own", help));
    }
    springs.sets.iter().enumerate().try_for_each(|(i, set)| check_set(set, i, &springs.sets[..i]))
}

/// What the grouping "adaptive" needs: an error of displacements to split by, and for `patience` loads that are held out.
pub(super) fn check_adaptive(scene: &Scene) -> Result<()> {
    let springs = &scene.springs;
    if let Some(error) = springs.max_error {
        positive("springs.max_error", error)?;
    }
    within("springs.patience", springs.patience.unwrap_or(1), 1, MOST_GROUPS)?;
    if springs.grouping != ADAPTIVE {
        return Ok(());
    }
    let objective = &scene.calibration.objective;
    if objective != "displacement" {
        let message =
            format!("\"{ADAPTIVE}\" splits groups by the error of displacements, and the objective is {objective}");
        return Err(Error::input("springs.grouping", message, "use objective = \"displacement\", or another grouping"));
    }
    if let Some(other) = scene.calibration.optimiser.as_deref().filter(|&name| name != "gauss_newton") {
        let message = format!("{other} cannot fit groups that change while they are fitted");
        return Err(Error::input("calibration.optimiser", message, "use gauss_newton, or leave the optimiser out"));
    }
    if scene.reference.kinematics == Kinematics::Corotational {
        let message =
            format!("\"{ADAPTIVE}\" splits groups by linear displacements, and reference.kinematics is corotational");
        return Err(Error::input("springs.grouping", message, "use linear kinematics, or another grouping"));
    }
    if springs.patience.is_some() && scene.load.iter().all(|load| load.fit) {
        let help = "add a [[load]] with fit = false, or remove patience";
        return Err(Error::input("springs.patience", "no load is held out, so no held-out error can rise", help));
    }
    Ok(())
}

fn check_set(set: &SpringSet, i: usize, earlier: &[SpringSet]) -> Result<()> {
    let key = format!("springs.sets[{i}]");
    if set.name == "rest" || earlier.iter().any(|other| other.name == set.name) {
        let help = "every group needs a name of its own; \"rest\" is that of the springs in no set";
        return Err(Error::input(format!("{key}.name"), format!("\"{}\" is taken", set.name), help));
    }
    let place = set.place();
    match (set.nodes.is_empty(), place.face.is_none() && place.set.is_none() && place.region.is_none()) {
        (false, true) => Ok(()),
        (false, false) => Err(Error::input(key, "several places are given", "keep one of face, set, box, nodes")),
        (true, _) => check_place(place, &key),
    }
}

/// Checks the boxes of the sets against a body in `dimension` directions.
pub(super) fn check_dimension(springs: &Springs, dimension: usize) -> Result<()> {
    for (i, set) in springs.sets.iter().enumerate() {
        let region = set.r#box.as_ref();
        length(&format!("springs.sets[{i}].box.min"), region.map(|region| region.min.len()), dimension)?;
        length(&format!("springs.sets[{i}].box.max"), region.map(|region| region.max.len()), dimension)?;
    }
    Ok(())
}

/// Settings that the grouping does not use.
pub(super) fn warnings(scene: &Scene) -> Vec<String> {
    let springs = &scene.springs;
    let uses_gamma = grouping::find(&springs.grouping).is_none_or(|rule| rule.uses_gamma);
    let idle = [
        ("calibration.gamma", !uses_gamma && scene.calibration.gamma != Gamma::Sweep(GammaSweep::default())),
        ("springs.max_error", springs.grouping != ADAPTIVE && springs.max_error.is_some()),
        ("springs.patience", springs.grouping != ADAPTIVE && springs.patience.is_some()),
        ("springs.sets", springs.grouping != "sets" && !springs.sets.is_empty()),
    ];
    let idle = idle.into_iter().filter(|(_, idle)| *idle);
    idle.map(|(key, _)| format!("{key} has no effect on the grouping \"{}\"", springs.grouping)).collect()
}
