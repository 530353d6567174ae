//! What the objectives other than the displacement compare with, and the problem of each grouping.
//!
//! | objective | made once | made for each grouping |
//! |---|---|---|
//! | matrix (3.17) | K_ref | the least-squares problem of its groups |
//! | acceleration (4.5) | states, K_ref u in each, masses | the same |
//! | formula, known | the groups and their stiffness ([`super::given_stiffness`]) | nothing |

use nalgebra_sparse::CsrMatrix;

use crate::calibration::objectives::{self, acceleration, matrix};
use crate::calibration::sweep::Search;
use crate::error::Result;
use crate::geometry::dofs::FIXED;
use crate::reference::{Case, mass, stiffness};
use crate::scene::{Masses, Scene, Snapshot};
use crate::springs::grouping::Grouping;

use super::body::Body;
use super::fit::{Given, Matrices, check_determined};
use super::given_stiffness;
use super::large;
use super::loads::LoadCase;
use super::network::Lattice;

/// Forces on free nodes below this fraction of the largest force of a state are rounding.
const AT_REST: f64 = 1e-10;

/// What springs are compared with, the same for every grouping.
pub enum Goal {
    /// The displacements of the reference.
    Displacement,
    /// Those of a reference that turns.
    Large(large::Goal),
    /// Its stiffness matrix, kept here where the reference did not store one.
    Matrix(Option<CsrMatrix<f64>>),
    /// Its forces in given states, and the mass of every node.
    Acceleration(Vec<acceleration::State>, Vec<f64>),
    /// Nothing: phi of every group is given.
    Given(Vec<f64>),
}

/// The goal of a scene.
///
/// # Errors
/// [`crate::error::Error::Input`] where a formula does not apply, or given numbers are not those of the groups; what the
/// integration of the reference can fail with.
pub fn goal(given: &Given) -> Result<Goal> {
    match given.scene.calibration.objective.as_str() {
        "matrix" => stored_or_assembled(given).map(Goal::Matrix),
        "acceleration" => Ok(Goal::Acceleration(states(given)?, node_masses(given.scene, given.body)?)),
        _ => match given_stiffness::given(given.scene, given.body, given.lattice)? {
            Some((_, phi)) => Ok(Goal::Given(phi)),
            None if large::is_asked(given.scene) => large::goal(given).map(Goal::Large),
            None => Ok(Goal::Displacement),
        },
    }
}

impl Goal {
    /// What is made small for one grouping.
    ///
    /// # Errors
    /// [`crate::error::Error::Input`] where the equations do not tell groups apart.
    pub fn search<'a>(&'a self, given: &'a Given, grouping: &'a Grouping) -> Result<Search<'a>> {
        let Lattice { network, coefficients, .. } = given.lattice;
        let dofs = &given.body.dofs;
        match self {
            Self::Displacement => Ok(Search::Displacement),
            Self::Large(large::Goal { symbolic, linear }) => {
                let search = large::search(given.scene);
                let target =
                    objectives::large::Target { network, grouping, coefficients, dofs, symbolic, search, linear };
                Ok(Search::Large(target))
            }
            Self::Matrix(_) => {
                let reduced = self.matrix(given).expect("a matrix goal").reduce(grouping);
                check_determined("matrix", &reduced, grouping)?;
                Ok(Search::Linear(reduced))
            }
            Self::Acceleration(states, masses) => {
                let linear = given.scene.calibration.acceleration.as_ref().is_some_and(|settings| settings.linear);
                let force = if linear { acceleration::Force::Linearised } else { acceleration::Force::Full };
                let target = acceleration::Target { network, coefficients, dofs, masses, states, force };
                let reduced = target.reduce(grouping)?;
                check_determined("acceleration", &reduced, grouping)?;
                Ok(Search::Linear(reduced))
            }
            Self::Given(phi) => Ok(Search::Known(phi.clone())),
        }
    }

    /// What the matrices compare and what no spring can answer for; none for other objectives.
    pub fn matrices(&self, given: &Given) -> Option<Matrices> {
        let target = self.matrix(given)?;
        Some(Matrices { compared_frobenius: target.norm(), outside_pattern: target.outside() })
    }

    fn matrix<'a>(&'a self, given: &Given<'a>) -> Option<matrix::Target<'a>> {
        let Self::Matrix(own) = self else { return None };
        let Lattice { network, coefficients, .. } = given.lattice;
        let stiffness = own.as_ref().or(given.reference.stiffness.as_ref())?;
        let reading = given.scene.calibration.matrix.clone().unwrap_or_default().reading;
        Some(matrix::Target { network, coefficients, dofs: &given.body.dofs, stiffness, reading })
    }
}

/// K_ref where the reference did not store it.
fn stored_or_assembled(given: &Given) -> Result<Option<CsrMatrix<f64>>> {
    if given.reference.stiffness.is_some() {
        return Ok(None);
    }
    let points = given.body.integration_points()?;
    let pattern = stiffness::pattern(&points, &given.body.dofs);
    stiffness::stiffness(&points, given.body.lame, &given.body.dofs, &pattern).map(Some)
}

/// Masses of the nodes for a density of 1: only their ratios count.
fn node_masses(scene: &Scene, body: &Body) -> Result<Vec<f64>> {
    let points = body.integration_points()?;
    match scene.dynamics.as_ref().map(|dynamics| dynamics.masses) {
        Some(Masses::Lumped) => mass::lumped(&points, 1.0, &body.dofs),
        _ => mass::equal_shares(&points, 1.0, &body.dofs),
    }
}

/// The states of all snapshots.
fn states(given: &Given) -> Result<Vec<acceleration::State>> {
    let settings = given.scene.calibration.acceleration.clone().unwrap_or_default();
    let mut states = Vec::new();
    for (i, snapshot) in settings.snapshots.iter().enumerate() {
        match snapshot {
            Snapshot { loads: Some(fractions), .. } => states.extend(history(given, fractions)?),
            Snapshot { stretch, gradient, .. } => {
                let gradient = match (stretch, gradient) {
                    (Some(stretch), _) => diagonal(stretch),
                    (_, rows) => rows.clone().unwrap_or_default(),
                };
                let name = format!("snapshots[{i}]");
                states.push(state(given, name, affine(given.body.positions(), &gradient))?);
            }
        }
    }
    Ok(states)
}

/// The static states of the fitted load cases at some fractions of their loads; there the continuum resists with the load.
///
/// # Errors
/// Those of [`large::history`].
fn history(given: &Given, fractions: &[f64]) -> Result<Vec<acceleration::State>> {
    let scaled = |values: &[f64], by: f64| -> Vec<f64> { values.iter().map(|value| value * by).collect() };
    let fitted = given.loads.iter().zip(&given.reference.cases).filter(|(case, _)| case.fit);
    let of_case = |(case, solved): (&LoadCase, &Case)| -> Result<Vec<acceleration::State>> {
        let displacements = match large::is_asked(given.scene) {
            true => large::history(given, case, fractions)?,
            false => fractions.iter().map(|&fraction| scaled(&solved.displacement, fraction)).collect(),
        };
        let state = |(&fraction, displacement): (&f64, &Vec<f64>)| acceleration::State {
            name: format!("{fraction} of {}", case.name),
            displacement: given.body.dofs.expand(displacement),
            resistance: scaled(&case.load.forces, fraction),
        };
        Ok(fractions.iter().zip(&displacements).map(state).collect())
    };
    Ok(fitted.map(of_case).collect::<Result<Vec<_>>>()?.concat())
}

/// The matrix with these numbers on its diagonal.
fn diagonal(values: &[f64]) -> Vec<Vec<f64>> {
    let row = |a: usize| (0..values.len()).map(|b| if a == b { values[a] } else { 0.0 }).collect();
    (0..values.len()).map(row).collect()
}

/// u = G x at every node. Held nodes move along: a translation makes no force, so it does not matter which point of
/// the body stays.
fn affine(positions: &[[f64; 3]], gradient: &[Vec<f64>]) -> Vec<[f64; 3]> {
    let at = |x: &[f64; 3]| {
        let mut u = [0.0; 3];
        for (u, row) in u.iter_mut().zip(gradient) {
            *u = row.iter().zip(x).map(|(g, x)| g * x).sum();
        }
        u
    };
    positions.iter().map(at).collect()
}

/// A state of all nodes with the force of the continuum in it: K_ref u, or that of the turned domains.
fn state(given: &Given, name: String, displacement: Vec<[f64; 3]>) -> Result<acceleration::State> {
    let body = given.body;
    let forces = match large::is_asked(given.scene) {
        true => large::resistance(given, &displacement)?,
        false => stiffness::internal_forces(&body.integration_points()?, body.lame, &displacement)?,
    };
    let mut resistance = vec![0.0; body.dofs.len()];
    for (node, force) in forces.iter().enumerate() {
        for (&dof, force) in body.dofs.free(node).iter().zip(force).filter(|(dof, _)| **dof != FIXED) {
            resistance[dof as usize] += force;
        }
    }
    let largest = |numbers: &mut dyn Iterator<Item = f64>| numbers.fold(0.0, |most: f64, f| most.max(f.abs()));
    let everywhere = largest(&mut forces.iter().flatten().copied());
    if largest(&mut resistance.iter().copied()) <= AT_REST * everywhere {
        // a uniform stretch pulls at the boundary only: with all of that held, free nodes rest up to rounding
        resistance.fill(0.0);
    }
    Ok(acceleration::State { name, displacement, resistance })
}
