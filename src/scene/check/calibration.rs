//! Checks of `[calibration]`: which optimiser serves which objective, and the states and the formula they need.

use crate::calibration::objectives::{self, Goal};
use crate::calibration::optimiser::{self, Serves};
use crate::calibration::optimisers::least_squares;
use crate::error::{Error, Result};
use crate::springs::grouping;

use super::super::choices::{known, names};
use super::super::states::SNAPSHOT_KINDS;
use super::super::{Annealing, Calibration, GaussNewton, Known, Scene, Snapshot};
use super::{length, positive, within};

/// Largest displacement gradient of a snapshot: beyond it a body is no longer the same.
const LARGEST_GRADIENT: f64 = 10.0;

pub(super) fn check(calibration: &Calibration) -> Result<()> {
    known("calibration.objective", &calibration.objective, &names("calibration.objective"))?;
    check_optimiser(calibration)?;
    check_formula(calibration)?;
    check_known(calibration)?;
    for (i, snapshot) in calibration.acceleration.iter().flat_map(|given| &given.snapshots).enumerate() {
        check_snapshot(snapshot, &format!("calibration.acceleration.snapshots[{i}]"))?;
    }
    check_regularisation(calibration)?;
    calibration.gamma.values()?;
    within("calibration.starts", calibration.starts.unwrap_or(1), 1, 1000)?;
    let Annealing { chains, evaluations, initial_temperature, final_temperature } = calibration.annealing;
    within("calibration.annealing.chains", chains, 1, 1024)?;
    within("calibration.annealing.evaluations", evaluations, chains, 1_000_000_000)?;
    positive("calibration.annealing.initial_temperature", initial_temperature)?;
    positive("calibration.annealing.final_temperature", final_temperature)?;
    if final_temperature >= 1.0 {
        let message = format!("{final_temperature} is not below 1: the temperature would not fall");
        return Err(Error::input("calibration.annealing.final_temperature", message, "give a number below 1"));
    }
    let GaussNewton { refactorisations, polish, tolerance } = calibration.gauss_newton;
    within("calibration.gauss_newton.refactorisations", refactorisations, 1, 100_000)?;
    within("calibration.gauss_newton.polish", polish, 0, 100_000)?;
    positive("calibration.gauss_newton.tolerance", tolerance)
}

/// An optimiser that the objective cannot be given to.
fn check_optimiser(calibration: &Calibration) -> Result<()> {
    let Some(name) = &calibration.optimiser else { return Ok(()) };
    known("calibration.optimiser", name, &names("calibration.optimiser"))?;
    let (Some(goal), Some(optimiser)) = (objectives::find(&calibration.objective), optimiser::find(name)) else {
        return Ok(());
    };
    let Goal { name: objective, linear, optimiser: usual, .. } = goal;
    match (usual, optimiser.serves) {
        (None, _) => {
            let message = format!("{name} has nothing to do: nothing is fitted with the objective {objective}");
            Err(Error::input("calibration.optimiser", message, "leave the optimiser out, or choose another objective"))
        }
        (_, Serves::Linear) if !linear => Err(least_squares::not_linear(objective)),
        (_, Serves::Displacement) if *objective != "displacement" => {
            let message = format!("{name} works on displacements, and {objective} is fitted without any");
            Err(Error::input("calibration.optimiser", message, "use least_squares, or leave the optimiser out"))
        }
        _ => Ok(()),
    }
}

/// A prior that is not one, or that nobody would look at.
fn check_regularisation(calibration: &Calibration) -> Result<()> {
    let Some(strength) = calibration.regularisation else { return Ok(()) };
    let wrong = |message: String, help: &str| Err(Error::input("calibration.regularisation", message, help));
    match calibration.optimiser() {
        _ if strength < 0.0 => wrong(format!("{strength} is negative"), "give 0, or an error in percent such as 1.0"),
        _ if calibration.objective != "displacement" => {
            let message = format!("the objective {} takes none", calibration.objective);
            wrong(message, "remove it; it goes with the objective displacement")
        }
        Some("surrogate") => wrong("the surrogate takes none".into(), "remove it, or use gauss_newton or annealing"),
        _ => Ok(()),
    }
}

fn check_formula(calibration: &Calibration) -> Result<()> {
    let known_names = names("calibration.formula");
    match (&calibration.formula, calibration.objective == "formula") {
        (Some(formula), true) => known("calibration.formula", formula, &known_names),
        (Some(_), false) => {
            let message = format!("the objective is {}, not a formula", calibration.objective);
            Err(Error::input("calibration.formula", message, "set objective = \"formula\", or remove formula"))
        }
        (None, true) => {
            let help = format!("add calibration.formula, one of {}", known_names.join(", "));
            Err(Error::input("calibration.objective", "no formula is given", help))
        }
        (None, false) => Ok(()),
    }
}

/// The stiffness of the objective known: given once, and none that a spring cannot have.
fn check_known(calibration: &Calibration) -> Result<()> {
    let (stiffness, springs) = (&calibration.stiffness, &calibration.springs);
    let given = [("stiffness", stiffness.is_some()), ("springs", springs.is_some())];
    let first = given.into_iter().find(|(_, given)| *given).map(|(key, _)| format!("calibration.{key}"));
    match (calibration.objective == "known", first) {
        (false, Some(key)) => {
            let message = format!("the objective is {}, which does not read it", calibration.objective);
            return Err(Error::input(key, message, "set objective = \"known\", or remove it"));
        }
        (true, None) => {
            let help = "add calibration.stiffness with a number a group, or calibration.springs with a springs.json";
            return Err(Error::input("calibration.objective", "no stiffness is given", help));
        }
        _ => {}
    }
    if stiffness.is_some() && springs.is_some() {
        let message = "gives the stiffness of every spring, and calibration.stiffness that of every group";
        return Err(Error::input("calibration.springs", message, "keep one of them"));
    }
    let numbers = stiffness.as_ref().map(Known::keyed).unwrap_or_default();
    if let Some((key, value)) = numbers.iter().find(|(_, value)| *value < 0.0) {
        let help = "a number from 0; 0 takes the springs of the group out";
        return Err(Error::input(format!("calibration.stiffness{key}"), format!("{value} is negative"), help));
    }
    match !numbers.is_empty() && numbers.iter().all(|(_, value)| *value == 0.0) {
        true => Err(Error::input("calibration.stiffness", "no spring is left", "give one group a number above 0")),
        false => Ok(()),
    }
}

/// Groups of several gammas have no one list of numbers.
pub(super) fn check_groups_of_known(scene: &Scene) -> Result<()> {
    let Calibration { stiffness, gamma, .. } = &scene.calibration;
    let one_each = matches!(stiffness, Some(Known::InOrder(_) | Known::ByName(_)));
    let uses_gamma = grouping::find(&scene.springs.grouping).is_some_and(|rule| rule.uses_gamma);
    if one_each && uses_gamma && gamma.values()?.len() > 1 {
        let message = format!("the groups by {} are others at every gamma of a sweep", scene.springs.grouping);
        let help = "give the gamma of the groups, such as gamma = 0.5, or choose another springs.grouping";
        return Err(Error::input("calibration.gamma", message, help));
    }
    Ok(())
}

fn check_snapshot(snapshot: &Snapshot, key: &str) -> Result<()> {
    let kinds = snapshot.kinds();
    let [kind] = kinds[..] else {
        let message = match kinds[..] {
            [] => "no state is given".to_owned(),
            _ => format!("{} are given together", kinds.join(" and ")),
        };
        return Err(Error::input(key, message, format!("give one of {}", SNAPSHOT_KINDS.join(", "))));
    };
    let numbers: Vec<f64> = match snapshot {
        Snapshot { stretch: Some(stretch), .. } => stretch.clone(),
        Snapshot { gradient: Some(rows), .. } => rows.concat(),
        Snapshot { loads, .. } => loads.clone().unwrap_or_default(),
    };
    let key = format!("{key}.{kind}");
    if kind == "loads" && (numbers.is_empty() || numbers.contains(&0.0)) {
        let help = "give fractions that are not zero, such as [0.5, 1.0]";
        return Err(Error::input(key, format!("{numbers:?} is no load history"), help));
    }
    if numbers.iter().all(|&x| x == 0.0) {
        return Err(Error::input(key, format!("{numbers:?} moves nothing"), "give a number that is not zero"));
    }
    match numbers.iter().find(|x| kind != "loads" && x.abs() > LARGEST_GRADIENT) {
        Some(large) => Err(Error::input(key, format!("{large} is out of range"), "0.1 is a strain of 10 %")),
        None => Ok(()),
    }
}

/// Checks the states of the acceleration objective against a body in `dimension` directions.
pub(super) fn check_dimension(calibration: &Calibration, dimension: usize) -> Result<()> {
    for (i, snapshot) in calibration.acceleration.iter().flat_map(|given| &given.snapshots).enumerate() {
        let key = format!("calibration.acceleration.snapshots[{i}]");
        length(&format!("{key}.stretch"), snapshot.stretch.as_ref().map(Vec::len), dimension)?;
        length(&format!("{key}.gradient"), snapshot.gradient.as_ref().map(Vec::len), dimension)?;
        for (row, entries) in snapshot.gradient.iter().flatten().enumerate() {
            length(&format!("{key}.gradient[{row}]"), Some(entries.len()), dimension)?;
        }
    }
    Ok(())
}

/// Settings of an objective or a grouping that is not used.
pub(super) fn warnings(scene: &Scene) -> Vec<String> {
    let Calibration { objective, matrix, acceleration, .. } = &scene.calibration;
    let given = [("matrix", matrix.is_some()), ("acceleration", acceleration.is_some())];
    let idle = given.into_iter().filter(|&(name, given)| given && name != objective);
    let mut warnings: Vec<String> =
        idle.map(|(name, _)| format!("calibration.{name} has no effect on the objective {objective}")).collect();
    let (springs, usual) = (&scene.springs, super::super::Springs::default());
    let from_file = scene.calibration.springs.is_some();
    if (objective == "formula" || from_file) && springs.grouping != usual.grouping {
        let what = if from_file { "the file" } else { "the formula" };
        warnings.push(format!("springs.grouping has no effect: {what} gives every spring its stiffness"));
    }
    let listed = [
        ("topology", springs.topology != usual.topology),
        ("edges", !springs.edges.is_empty()),
        ("edge_file", springs.edge_file.is_some()),
    ];
    let idle = listed.into_iter().filter(|(_, given)| from_file && *given);
    warnings.extend(
        idle.map(|(key, _)| format!("springs.{key} has no effect: calibration.springs says which springs there are")),
    );
    warnings
}

/// Settings that mean little beside a continuum that turns.
pub(super) fn warnings_of_large(calibration: &Calibration) -> Vec<String> {
    let linear = calibration.acceleration.as_ref().is_some_and(|settings| settings.linear);
    let starts = calibration.starts.is_some() && calibration.objective == "displacement";
    let told = [
        (linear, "calibration.acceleration.linear compares forces at rest with a continuum that turns"),
        (
            starts,
            "calibration.starts has no effect beside a corotational continuum: the search begins at the best balance",
        ),
    ];
    told.into_iter().filter(|(given, _)| *given).map(|(_, text)| text.to_owned()).collect()
}
