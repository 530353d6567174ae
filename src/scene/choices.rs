//! What can be chosen by name: tables of a name and a line, read by the check, the schema and `springfit list`.
//!
//! A table lists only what is built. A choice gets here with the code behind it.

use std::sync::LazyLock;

use crate::calibration::{objectives, optimiser};
use crate::dynamics::integrator::INTEGRATORS;
use crate::error::{Error, Result};
use crate::reference::methods;
use crate::springs::{formulas, grouping, profiles, topology, weighting};

use crate::geometry::meshes::MESH_SHAPES;
use crate::geometry::shapes;

/// A name that a scene may use, and what it means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    /// The name, as a scene writes it.
    pub name: &'static str,
    /// One line about it.
    pub doc: &'static str,
}

/// A table of choices, with the scene key that it belongs to.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Name of the table for `springfit list`.
    pub name: &'static str,
    /// The scene key that takes one of its names.
    pub key: &'static str,
    /// The names.
    pub choices: fn() -> Vec<Choice>,
}

/// Every table, in the order of the scene.
pub const KINDS: &[Kind] = &[
    Kind { name: "shapes", key: "geometry.shape", choices: shape_choices },
    Kind { name: "methods", key: "reference.method", choices: method_choices },
    Kind { name: "topologies", key: "springs.topology", choices: topology_choices },
    Kind { name: "weightings", key: "springs.weighting", choices: weighting_choices },
    Kind { name: "profiles", key: "springs.profile", choices: profile_choices },
    Kind { name: "groupings", key: "springs.grouping", choices: grouping_choices },
    Kind { name: "objectives", key: "calibration.objective", choices: objective_choices },
    Kind { name: "formulas", key: "calibration.formula", choices: formula_choices },
    Kind { name: "optimisers", key: "calibration.optimiser", choices: optimiser_choices },
    Kind { name: "integrators", key: "dynamics.integrator", choices: integrator_choices },
];

/// Patches and meshes, each with the keys of `[geometry]` that it takes.
fn shape_choices() -> Vec<Choice> {
    static LINES: LazyLock<Vec<(&str, String)>> = LazyLock::new(|| {
        let patches = shapes::SHAPES.iter();
        let patches = patches.map(|shape| (shape.name, format!("{} (size, control_points, degree)", shape.doc)));
        let meshes = MESH_SHAPES.iter().map(|shape| {
            let distortion = if shape.distorts() { ", distortion" } else { "" };
            let keys = format!("size, cells = [{}]{distortion}", shape.counts.join(", "));
            (shape.name, format!("{} ({keys})", shape.doc))
        });
        patches.chain(meshes).collect()
    });
    LINES.iter().map(|(name, doc)| Choice { name, doc }).collect()
}

fn method_choices() -> Vec<Choice> {
    methods::METHODS.iter().map(|method| Choice { name: method.name, doc: method.doc }).collect()
}

fn topology_choices() -> Vec<Choice> {
    topology::TOPOLOGIES.iter().map(|topology| Choice { name: topology.name, doc: topology.doc }).collect()
}

fn weighting_choices() -> Vec<Choice> {
    weighting::WEIGHTINGS.iter().map(|&(name, doc)| Choice { name, doc }).collect()
}

fn profile_choices() -> Vec<Choice> {
    profiles::PROFILES.iter().map(|profile| Choice { name: profile.name, doc: profile.doc }).collect()
}

fn grouping_choices() -> Vec<Choice> {
    grouping::GROUPINGS.iter().map(|rule| Choice { name: rule.name, doc: rule.doc }).collect()
}

fn objective_choices() -> Vec<Choice> {
    objectives::OBJECTIVES.iter().map(|goal| Choice { name: goal.name, doc: goal.doc }).collect()
}

fn formula_choices() -> Vec<Choice> {
    formulas::FORMULAS.iter().map(|formula| Choice { name: formula.name, doc: formula.doc }).collect()
}

fn optimiser_choices() -> Vec<Choice> {
    optimiser::OPTIMISERS.iter().map(|optimiser| Choice { name: optimiser.name, doc: optimiser.doc }).collect()
}

fn integrator_choices() -> Vec<Choice> {
    INTEGRATORS.iter().map(|integrator| Choice { name: integrator.name, doc: integrator.doc }).collect()
}

/// Faces of the control grid: first and last index of each direction.
pub(super) const FACES: [&str; 6] = ["x-", "x+", "y-", "y+", "z-", "z+"];

/// The names of the table that a scene key chooses from; empty for other keys.
pub(super) fn names(key: &str) -> Vec<&'static str> {
    let kind = KINDS.iter().find(|kind| kind.key == key);
    kind.map_or_else(Vec::new, |kind| (kind.choices)().iter().map(|choice| choice.name).collect())
}

/// Checks a name against the known ones.
///
/// # Errors
/// [`Error::Input`] at `key` that lists the known names, with the nearest of them if one is near.
pub(super) fn known(key: &str, name: &str, names: &[&str]) -> Result<()> {
    if names.contains(&name) {
        return Ok(());
    }
    Err(Error::input(key, format!("unknown name \"{name}\""), suggest(name, names, "known names are")))
}

/// "did you mean ...?" when a name is near, then all the names after `intro`.
pub(super) fn suggest(word: &str, names: &[&str], intro: &str) -> String {
    let all = format!("{intro} {}", names.join(", "));
    let near = names.iter().map(|name| (distance(word, name), name)).min();
    match near {
        Some((distance, name)) if 3 * distance <= word.chars().count() => {
            format!("did you mean \"{name}\"? {all}")
        }
        _ => all,
    }
}

/// Edits (insert, delete, replace a letter) that turn one word into the other (Levenshtein).
fn distance(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &b) in to.iter().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[to.len()]
}

#[cfg(test)]
mod tests {
    use super::super::Kinematics;
    use super::*;

    #[test]
    fn a_near_name_is_offered_and_a_far_one_is_not() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert!(suggest("lenght", &["length", "kind"], "known names are").starts_with("did you mean \"length\"?"));
        assert_eq!(suggest("q4", &["iga"], "known names are"), "known names are iga");
    }

    #[test]
    fn every_default_is_a_name_of_its_table() {
        let calibration = super::super::Calibration::default();
        let springs = super::super::Springs::default();
        for (key, name) in [
            ("springs.profile", springs.profile().to_owned()),
            ("springs.topology", springs.topology),
            ("springs.grouping", springs.grouping),
            ("calibration.optimiser", calibration.optimiser().expect("displacement has one").to_owned()),
            ("calibration.objective", calibration.objective),
            ("dynamics.integrator", super::super::Dynamics::default().integrator(Kinematics::Linear).to_owned()),
        ] {
            assert!(names(key).contains(&name.as_str()), "{key} = {name}");
        }
        assert!(names("geometry.size").is_empty());
    }
}
