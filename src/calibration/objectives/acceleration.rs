//! The acceleration objective (4.5): released from the same states, network and continuum shall start alike.
//!
//! In a state u (displacements of all nodes, at rest) the bodies accelerate by
//!
//! ```text
//! a_ref = M^-1 (f_ext - K_ref u),        a(phi) = M^-1 (f_ext + sum_a phi_a f_a(u))
//! ```
//!
//! where f_a(u) is the force that the springs of group a exert on the nodes for phi_a = 1: the full force (3.2) of the displaced
//! springs, or its linearisation -K_a u. Either is linear in phi. Both bodies carry the same lumped masses M; then
//! the external force cancels in a_ref - a(phi), and so does damping, for nothing moves yet. M itself does not cancel:
//! 1 / m_i stays as the weight of the equations of node i, and nodes at an edge of the body, which are lighter, count
//! more. Masses that differed between the two would leave f_ext in and fit stiffness to a difference of masses.
//!
//! ```text
//! e = 100 sqrt( mean_c |a_ref,c - a_c(phi)|^2 / |M^-1 K_ref u_c|^2 )     percent, over the free degrees of freedom
//! ```
//!
//! Which states: the thesis asks for the state of largest elastic energy in a motion. In an undamped release without
//! load that is the initial one, for the energy is conserved; so the states are given fields of displacement, and
//! no motion has to be integrated. Several states (snapshots, or the static states of a load that grows) are averaged,
//! each relative to its own accelerations.
//!
//! A linear continuum knows no rotation, the full force does: large states then compare a body with one that bends
//! differently. A corotational continuum turns as the springs do. In its states K_ref u stands for its force dE/du, and a
//! static state of a load c resists with c itself; all stays linear in phi, so that springs are fitted to forces at any turn in
//! one step. Static states of slender bodies fit badly, though: there a small force is left of large ones that cancel, in the
//! body and not in the network. Uniform states do better.
//! Springs that a state neither stretches nor shortens have no part in it; a group that none of the states stretches is
//! left out ([`crate::calibration::linear`]).
//! Nor do uniform states tell many groups apart: a homogeneous network (weighting "cells") of central springs has two moduli
//! on a square or cubic grid, c11 and c12 = c44, so the third kind of a cube needs a state that is not uniform, or weighting
//! "springs", which makes the border another network than the inside.

use crate::calibration::linear::{Reduced, Rows};
use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::springs::force;
use crate::springs::grouping::Grouping;
use crate::springs::network::Network;

/// The elastic force of the springs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Force {
    /// (3.2) at the displaced nodes.
    Full,
    /// Linearised at rest.
    Linearised,
}

/// A state that both bodies are released from.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Its name, for messages.
    pub name: String,
    /// Displacement of every node, held ones included, m.
    pub displacement: Vec<[f64; 3]>,
    /// K_ref u, or dE/du of a corotational continuum, over the free degrees of freedom, N.
    pub resistance: Vec<f64>,
}

/// The fixed part of an acceleration problem.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The springs.
    pub network: &'a Network,
    /// w_s of every spring, 1 or 1/m.
    pub coefficients: &'a [f64],
    /// The degrees of freedom.
    pub dofs: &'a DofMap,
    /// Mass of every node in any unit, zero where it is tied to another.
    pub masses: &'a [f64],
    /// The states.
    pub states: &'a [State],
    /// Which force the springs exert.
    pub force: Force,
}

impl Target<'_> {
    /// The least-squares problem of a grouping, distances in percent.
    ///
    /// # Errors
    /// [`Error::Input`] for a state in which the continuum rests.
    pub fn reduce(&self, grouping: &Grouping) -> Result<Reduced> {
        let groups = grouping.groups.len();
        let mut rows = Rows::new(groups);
        let mut row = vec![0.0; groups + 1];
        let mut terms = vec![0.0; groups];
        for state in self.states {
            let weights = self.weights(state)?;
            let forces = self.forces(state, grouping);
            self.add_terms(state, grouping, &weights, &mut terms);
            for (dof, weight) in weights.iter().enumerate() {
                for (group, entry) in row[..groups].iter_mut().enumerate() {
                    *entry = -weight * forces[group * self.dofs.len() + dof];
                }
                row[groups] = weight * state.resistance[dof];
                rows.push(&row);
            }
        }
        let terms: Vec<f64> = terms.into_iter().map(f64::sqrt).collect();
        Ok(rows.reduced(100.0 / (self.states.len() as f64).sqrt(), &terms))
    }

    /// Adds the squares of the terms that the pulls of every group are made of: a pull is a stiffness times a difference of places
    /// (of displacements, where it is linearised), and the difference is known to the rounding of these.
    fn add_terms(&self, state: &State, grouping: &Grouping, weights: &[f64], squares: &mut [f64]) {
        let size = |v: [f64; 3]| v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (s, spring) in self.network.springs.iter().enumerate() {
            let of_node = |node: u32| match self.force {
                Force::Full => size(self.network.positions[node as usize]) + size(state.displacement[node as usize]),
                Force::Linearised => size(state.displacement[node as usize]),
            };
            let term = self.coefficients[s] * spring.nodes.into_iter().map(of_node).sum::<f64>();
            let dofs = spring.nodes.into_iter().flat_map(|node| self.dofs.free(node as usize));
            let heaviest =
                dofs.filter(|dof| **dof != FIXED).fold(0.0_f64, |most, &dof| most.max(weights[dof as usize]));
            squares[grouping.group_of[s] as usize] += (heaviest * term).powi(2);
        }
    }

    /// 1 / m_i for every free degree of freedom, over the norm of the accelerations of the continuum.
    fn weights(&self, state: &State) -> Result<Vec<f64>> {
        let inverse: Vec<f64> = (0..self.dofs.len()).map(|dof| 1.0 / self.masses[self.dofs.owner(dof).0]).collect();
        let pairs = inverse.iter().zip(&state.resistance);
        let norm = pairs.map(|(weight, force)| (weight * force).powi(2)).sum::<f64>().sqrt();
        if norm > 0.0 {
            return Ok(inverse.into_iter().map(|weight| weight / norm).collect());
        }
        let message = format!("no free node of the continuum is pulled in the state {}", state.name);
        Err(Error::input("calibration.acceleration.snapshots", message, "give a state that deforms the body"))
    }

    /// Forces of every group at phi = 1 on the free degrees of freedom (groups x n), N.
    fn forces(&self, state: &State, grouping: &Grouping) -> Vec<f64> {
        let n = self.dofs.len();
        let mut forces = vec![0.0; n * grouping.groups.len()];
        for (s, spring) in self.network.springs.iter().enumerate() {
            let [a, b] = spring.nodes.map(|node| node as usize);
            let (ua, ub) = (state.displacement[a], state.displacement[b]);
            let at = |node: usize, u: [f64; 3]| [0, 1, 2].map(|c| self.network.positions[node][c] + u[c]);
            let pull = match self.force {
                Force::Full => force::elastic(self.coefficients[s], spring.length, at(a, ua), at(b, ub)),
                Force::Linearised => force::linearised(self.coefficients[s], spring.direction, ua, ub),
            };
            let column = &mut forces[grouping.group_of[s] as usize * n..][..n];
            for (node, sign) in [(a, 1.0), (b, -1.0)] {
                for (&dof, pull) in self.dofs.free(node).iter().zip(pull).filter(|(dof, _)| **dof != FIXED) {
                    column[dof as usize] += sign * pull;
                }
            }
        }
        forces
    }
}
