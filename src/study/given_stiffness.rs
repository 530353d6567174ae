//! Networks whose stiffness is given, not fitted: by a formula, by the scene for each group, or by a file for each spring.
//!
//! | objective | given by | groups |
//! |---|---|---|
//! | formula (3.13, 3.14) | `calibration.formula` | springs that need the same number |
//! | known | `calibration.stiffness`: one number a group | those of `springs.grouping` |
//! | known | `calibration.springs`: a springs.json ([`super::springs_file`]) | those of the file, divided where its springs need several numbers |

use std::borrow::Cow;

use crate::error::{Error, Result};
use crate::geometry::grid_mesh::mesh_of_grid;
use crate::geometry::mesh::{CellKind, Mesh};
use crate::scene::{Known, Plane, Scene};
use crate::springs::formulas;
use crate::springs::grouping::Grouping;
use crate::springs::grouping::numbers::by_numbers;
use crate::springs::network::Network;

use super::body::Body;
use super::continuum::Continuum;
use super::fit;
use super::network::Lattice;

/// The groups of a scene that gives their stiffness, and phi of each; none where it is fitted.
///
/// # Errors
/// [`Error::Input`] where the formula does not apply, and for groups without a number and numbers without a group.
pub fn given(scene: &Scene, body: &Body, lattice: &Lattice) -> Result<Option<(Grouping, Vec<f64>)>> {
    let Lattice { network, coefficients, .. } = lattice;
    let needed = |k: &[f64]| k.iter().zip(coefficients).map(|(k, w)| k / w).collect::<Vec<f64>>();
    match (scene.calibration.objective.as_str(), &lattice.from_file, &scene.calibration.stiffness) {
        ("formula", ..) => {
            let numbers = needed(&formula_stiffness(scene, body, network)?);
            let class_of = vec![0; numbers.len()];
            Ok(Some(by_numbers(network, &numbers, &class_of, &["formula".to_owned()])))
        }
        ("known", Some(file), _) => {
            Ok(Some(by_numbers(network, &needed(&file.stiffness), &file.class_of, &file.names)))
        }
        ("known", None, Some(known)) => {
            // check has seen to it that all gammas are one, or that all groups have one number
            let (_, groupings) = fit::rule_groups(scene, body, lattice)?;
            let grouping = groupings.into_iter().next().expect("a sweep has a gamma");
            let phi = numbers_of(known, &grouping)?;
            Ok(Some((grouping, phi)))
        }
        _ => Ok(None),
    }
}

/// One number for each group.
fn numbers_of(known: &Known, grouping: &Grouping) -> Result<Vec<f64>> {
    let names: Vec<&str> = grouping.groups.iter().map(|group| group.name.as_str()).collect();
    let groups = || format!("the groups are {}", names.join(", "));
    let wrong =
        |key: &str, message: String| Err(Error::input(format!("calibration.stiffness{key}"), message, groups()));
    match known {
        Known::All(value) => Ok(vec![*value; names.len()]),
        Known::InOrder(values) if values.len() == names.len() => Ok(values.clone()),
        Known::InOrder(values) => wrong("", format!("{} numbers for {} groups", values.len(), names.len())),
        Known::ByName(values) => {
            if let Some(other) = values.keys().find(|name| !names.contains(&name.as_str())) {
                return wrong(&format!(".{other}"), format!("there is no group \"{other}\""));
            }
            match names.iter().find(|name| !values.contains_key(**name)) {
                Some(missing) => wrong("", format!("the group \"{missing}\" has no number")),
                None => Ok(names.iter().map(|name| values[*name]).collect()),
            }
        }
    }
}

/// Stiffness of every spring by the formula of the scene, N/m.
fn formula_stiffness(scene: &Scene, body: &Body, network: &Network) -> Result<Vec<f64>> {
    let name = scene.calibration.formula.as_deref().unwrap_or_default();
    let formula = formulas::find(name).ok_or_else(|| {
        Error::input("calibration.formula", format!("there is no formula {name:?}"), "see `springfit list formulas`")
    })?;
    formula.stiffness(&formulas::Given {
        mesh: &cells(body),
        network,
        dofs: &body.dofs,
        young: scene.material.young,
        poisson: scene.material.poisson,
        thickness: body.thickness,
        plane_strain: scene.reference.plane == Some(Plane::Strain),
    })
}

/// The cells between the nodes: those of the elements, or of the control grid.
fn cells(body: &Body) -> Cow<'_, Mesh> {
    match &body.continuum {
        Continuum::Elements { mesh, .. } => Cow::Borrowed(mesh),
        Continuum::Splines { patch, .. } => {
            let kind = if patch.dimension() == 2 { CellKind::Quadrilateral } else { CellKind::Hexahedron };
            Cow::Owned(mesh_of_grid(&patch.grid(), patch.points().to_vec(), kind))
        }
    }
}

/// Word where a reference is smoother than the cells that formulas are made for.
pub fn warning(scene: &Scene, body: &Body) -> Option<String> {
    let degree = body.continuum.reach();
    (scene.calibration.objective == "formula" && degree > 1).then(|| {
        format!(
            "the formula is made for linear elements; the reference has degree {degree}, its nodes are control points"
        )
    })
}
