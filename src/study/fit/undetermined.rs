//! Groups that a fit does not determine: told where the others can be fitted, refused where no group of a set can.
//!
//! | what | objectives | consequence |
//! |---|---|---|
//! | no spring of the group acts on a free node | all that are fitted | left out: the network does not depend on it |
//! | its column is empty ([`crate::calibration::linear`]) | matrix, acceleration | left out: the others do not depend on it |
//! | the columns of a set depend on each other | matrix, acceleration | refused: none of the set has a number, and the displacements depend on the choice |
//!
//! A group that is left out has the part of its upper bound that the others have of theirs in the mean
//! ([`crate::calibration::linear::complete`]).

use crate::calibration::linear::Reduced;
use crate::calibration::sweep::{Search, SweepProblem};
use crate::error::{Error, Result};
use crate::springs::grouping::Grouping;

use super::Given;

/// Most groups that a message names at a time, and most sets of groups.
const NAMED: (usize, usize) = (6, 3);

/// For every group of a problem whether what is made small depends on it.
pub fn determined(given: &Given, problem: &SweepProblem, grouping: &Grouping) -> Vec<bool> {
    match &problem.search {
        Search::Linear(reduced) => reduced.seen(),
        Search::Displacement | Search::Large(_) => grouping.acting(&given.lattice.network, &given.body.dofs),
        Search::Known(_) => vec![true; grouping.groups.len()],
    }
}

/// A word for each reason why groups were left out; `phi` and `upper` like `determined`, one a group.
pub fn words(given: &Given, grouping: &Grouping, determined: &[bool], phi: &[f64], upper: &[f64]) -> Vec<String> {
    let acting = grouping.acting(&given.lattice.network, &given.body.dofs);
    let unseen = match given.scene.calibration.objective.as_str() {
        "matrix" => {
            "their springs end at held nodes, and the off-diagonal blocks hold no such spring \
             (calibration.matrix.reading = \"full\" sees them)"
        }
        _ => {
            "in every state their springs keep their length, or pull in balance (add a snapshot that stretches them, such as \
             { loads = [0.01] })"
        }
    };
    let of_kind = |acts: bool, why: &str| {
        let left_out: Vec<usize> = (0..phi.len()).filter(|&a| !determined[a] && acting[a] == acts).collect();
        let &first = left_out.first()?;
        Some(format!(
            "the fit does not determine {} of {} groups ({}): {why}; each has the part of its upper bound that the fitted groups \
             have in the mean, {:.2} %",
            left_out.len(),
            phi.len(),
            names(grouping, &left_out),
            100.0 * phi[first] / upper[first]
        ))
    };
    [of_kind(false, "their springs act on no free node"), of_kind(true, unseen)].into_iter().flatten().collect()
}

/// Refuses a linear problem that leaves groups without a number of their own.
///
/// # Errors
/// [`Error::Input`] with the names of the groups that depend on each other; or when nothing depends on any group.
pub fn check(objective: &str, reduced: &Reduced, grouping: &Grouping) -> Result<()> {
    let help = match objective {
        "acceleration" => {
            "use fewer groups, more and different snapshots, or states that are not uniform: { loads = [0.01] }"
        }
        _ => "use fewer groups: unite these",
    };
    let refusal = |message: String, help: &str| Err(Error::input("calibration.objective", message, help));
    if !reduced.seen().contains(&true) {
        let help = match objective {
            "acceleration" => "add a snapshot that stretches the springs, such as { loads = [0.01] }",
            _ => "hold less of the body, or use the reading \"full\"",
        };
        return refusal("nothing that is compared depends on the stiffness of any group".into(), help);
    }
    let sets = reduced.dependent();
    if sets.is_empty() {
        return Ok(());
    }
    let mut told: Vec<String> = sets.iter().take(NAMED.1).map(|set| names(grouping, set)).collect();
    if sets.len() > NAMED.1 {
        told.push(format!("{} more sets", sets.len() - NAMED.1));
    }
    let message = format!(
        "the equations do not determine {} of {} groups, which act as others of their set do: {}",
        sets.iter().map(Vec::len).sum::<usize>(),
        grouping.groups.len(),
        told.join("; ")
    );
    refusal(message, help)
}

/// The names of some groups.
fn names(grouping: &Grouping, groups: &[usize]) -> String {
    let mut names: Vec<String> =
        groups.iter().take(NAMED.0).map(|&group| format!("\"{}\"", grouping.groups[group].name)).collect();
    if groups.len() > NAMED.0 {
        names.push(format!("{} more", groups.len() - NAMED.0));
    }
    names.join(", ")
}
