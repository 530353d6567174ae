//! A network under large displacements: its energy, forces and second derivative with the full force (3.2), and where it is
//! in equilibrium with a load ([`crate::sparse::equilibrium`]).
//!
//! ```text
//! E(u) = sum_s k_s/2 (l_s - l0_s)^2,     dE/du_a = - sum over the springs at a of T_s n_s
//! ```
//!
//! Small displacements give K(phi) u = f again. k in N/m; k_s = phi_a w_s is linear in the numbers of the groups, and so is
//! dE/du: the force of a group for phi_a = 1 is what [`LargeSprings::force_of`] writes.

use super::affine;
use super::force;
use super::grouping::Grouping;
use super::members::unknowns;
use super::network::Network;
use super::weighting;
use crate::geometry::dofs::{DofMap, FIXED};
use crate::sparse::equilibrium::{Curvature, Potential};
use crate::sparse::pattern::Pattern;

/// Ends of the four blocks of a spring in a matrix, and their signs.
const BLOCKS: [(usize, usize, f64); 4] = [(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)];

/// Stands for an entry that is not in the pattern, because a component is held.
const NOWHERE: u32 = u32::MAX;

/// A network, its stiffness, and where its nodes are.
#[derive(Debug, Clone)]
pub struct LargeSprings<'a> {
    network: &'a Network,
    coefficients: &'a [f64],
    grouping: &'a Grouping,
    dofs: &'a DofMap,
    pattern: Pattern,
    /// For each spring the places of its four blocks in the pattern.
    entries: Vec<[[[u32; 3]; 3]; 4]>,
    stiffness: Vec<f64>,
    places: Vec<[f64; 3]>,
    forces: Vec<[f64; 3]>,
}

impl<'a> LargeSprings<'a> {
    /// A network at rest, without stiffness yet; `coefficients` is w_s of every spring.
    ///
    /// # Panics
    /// When there is not one group and one coefficient for every spring.
    pub fn new(network: &'a Network, grouping: &'a Grouping, coefficients: &'a [f64], dofs: &'a DofMap) -> Self {
        assert_eq!(network.springs.len(), grouping.group_of.len(), "one group for every spring");
        assert_eq!(network.springs.len(), coefficients.len(), "one coefficient for every spring");
        let pattern = affine::pattern(network, dofs);
        let entries = network.springs.iter().map(|spring| entries(&pattern, &unknowns(spring.nodes, dofs))).collect();
        Self {
            stiffness: vec![0.0; network.springs.len()],
            places: network.positions.clone(),
            forces: vec![[0.0; 3]; network.positions.len()],
            network,
            coefficients,
            grouping,
            dofs,
            pattern,
            entries,
        }
    }

    /// Gives the springs of every group their number, N/m times the unit of its profile.
    pub fn set(&mut self, phi: &[f64]) {
        self.stiffness = weighting::stiffness(self.grouping, self.coefficients, phi);
    }

    /// Writes the derivative of dE/du by the number of one group where the network was placed: N a unit of phi.
    pub fn force_of(&self, group: usize, out: &mut [f64]) {
        out.fill(0.0);
        let members = (0..self.network.springs.len()).filter(|&s| self.grouping.group_of[s] as usize == group);
        for s in members {
            let pull = self.pull(s, self.coefficients[s]);
            for (node, sign) in self.network.springs[s].nodes.into_iter().zip([-1.0, 1.0]) {
                for (&dof, pull) in self.dofs.free(node as usize).iter().zip(pull).filter(|(dof, _)| **dof != FIXED) {
                    out[dof as usize] += sign * pull;
                }
            }
        }
    }

    /// Force on the first end of a spring with the stiffness `k`.
    fn pull(&self, s: usize, k: f64) -> [f64; 3] {
        let spring = &self.network.springs[s];
        let [a, b] = spring.nodes.map(|node| self.places[node as usize]);
        force::elastic(k, spring.length, a, b)
    }
}

/// Where the four blocks of a spring are.
fn entries(pattern: &Pattern, ends: &[[u32; 3]; 2]) -> [[[u32; 3]; 3]; 4] {
    BLOCKS.map(|(p, q, _)| {
        ends[p].map(|row| {
            ends[q].map(|column| match row == FIXED || column == FIXED {
                true => NOWHERE,
                false => pattern.position(row as usize, column as usize).expect("ends of a spring couple") as u32,
            })
        })
    })
}

impl Potential for LargeSprings<'_> {
    fn name(&self) -> &'static str {
        "spring network"
    }

    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn place(&mut self, u: &[f64]) {
        for (dof, u) in u.iter().enumerate() {
            let (node, component) = self.dofs.owner(dof);
            self.places[node][component] = self.network.positions[node][component] + u;
        }
    }

    fn energy(&self) -> f64 {
        let energy = |(spring, k): (&super::network::Spring, &f64)| {
            let [a, b] = spring.nodes.map(|node| self.places[node as usize]);
            force::energy(*k, spring.length, a, b)
        };
        self.network.springs.iter().zip(&self.stiffness).map(energy).sum()
    }

    fn internal_force(&mut self, out: &mut [f64]) {
        self.forces.fill([0.0; 3]);
        for s in 0..self.network.springs.len() {
            let pull = self.pull(s, self.stiffness[s]);
            let [a, b] = self.network.springs[s].nodes;
            for (c, pull) in pull.into_iter().enumerate() {
                self.forces[a as usize][c] -= pull;
                self.forces[b as usize][c] += pull;
            }
        }
        for (dof, out) in out.iter_mut().enumerate() {
            let (node, component) = self.dofs.owner(dof);
            *out = self.forces[node][component];
        }
    }

    fn largest_force(&self) -> f64 {
        self.forces.as_flattened().iter().fold(0.0, |most: f64, f| most.max(f.abs()))
    }

    fn rounding(&self) -> f64 {
        // the lengths of some ten springs around a node are each off by a few units in the last place
        let pairs = self.network.springs.iter().zip(&self.stiffness);
        64.0 * f64::EPSILON * pairs.map(|(spring, k)| k * spring.length).fold(0.0, f64::max)
    }

    fn tangent(&mut self, curvature: Curvature, values: &mut [f64]) {
        values.fill(0.0);
        for ((spring, k), entries) in self.network.springs.iter().zip(&self.stiffness).zip(&self.entries) {
            let [a, b] = spring.nodes.map(|node| self.places[node as usize]);
            let block = force::tangent(*k, spring.length, a, b, curvature == Curvature::Positive);
            for (entries, (_, _, sign)) in entries.iter().zip(BLOCKS) {
                for (entry, value) in entries.as_flattened().iter().zip(block.as_flattened()) {
                    if *entry != NOWHERE {
                        values[*entry as usize] += sign * value;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::equilibrium::{Newton, Search};
    use crate::springs::grouping::Group;
    use crate::springs::network::{Kind, Spring};

    /// Two springs of rest length 1 in a line, held at the ends 2 apart, pulled across in the middle by f: with the angle
    /// a, f = 2 k (1/cos a - 1) sin a.
    #[test]
    fn a_string_pulled_across_answers_by_its_length_alone() {
        let (direction, kind, offset) = ([1.0, 0.0, 0.0], Kind::Edge, [1, 0, 0]);
        let spring = |a| Spring { nodes: [a, a + 1], length: 1.0, direction, kind, offset, cells: 1 };
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let network = Network { dimension: 2, positions, springs: vec![spring(0), spring(1)], zero_length: 0 };
        let group = Group { name: "all".into(), springs: 2, length: 1.0 };
        let grouping = Grouping { group_of: vec![0, 0], groups: vec![group] };
        let dofs = DofMap::untied(2, &[[true; 3], [false; 3], [true; 3]]);
        let ones = vec![1.0; 2];
        let mut springs = LargeSprings::new(&network, &grouping, &ones, &dofs);
        springs.set(&[50.0]);
        let mut newton = Newton::new(Potential::pattern(&springs), None).expect("small");
        let angle = 0.4_f64;
        let force = 2.0 * 50.0 * (1.0 / angle.cos() - 1.0) * angle.sin();
        // at rest nothing resists: the search has to find its way without a positive definite tangent
        let found = newton.solve(&mut springs, &[0.0, force], &[0.0, 0.0], Search::default()).expect("it holds");
        assert!((found.displacement[1] - angle.tan()).abs() < 1e-8 && found.displacement[0].abs() < 1e-9);
        let mut of_group = [0.0; 2];
        springs.force_of(0, &mut of_group);
        assert!((50.0 * of_group[1] - force).abs() < 1e-7 * force);
    }
}
