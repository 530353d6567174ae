//! A network of springs in motion, at any stretch and turn.
//!
//! The forces are those of [`super::forces`]. For the spring between a and b with d = x_b - x_a, l = |d|, n = d / l, the
//! tangents are blocks that act on u_b - u_a and v_b - v_a:
//!
//! ```text
//! K_s = k n n^T + k (1 - l0 / l) (1 - n n^T)        stretched springs hold sideways, compressed ones give way
//! C_s = c n n^T
//! ```
//!
//! (how the damping force turns with the spring is left out of K_s: it is not symmetric).
//!
//! Whatever the motion, K_s <= k 1 and C_s <= c 1, since n n^T <= 1 and 1 - l0 / l < 1. With K and C made of k 1 and c 1
//! ([`isotropic`]) the limit of [`super::stability`] is therefore one for every state of the network, the price
//! being that it is smaller than the limit at rest.

use std::sync::OnceLock;

use nalgebra_sparse::CsrMatrix;

use crate::geometry::dofs::{DofMap, FIXED};
use crate::sparse::pattern::Pattern;
use crate::springs::affine;
use crate::springs::force;
use crate::springs::network::Network;

use super::forces::SpringForces;
use super::linear::{Damping, LinearModel};
use super::model::Model;
use super::stability::Linearised;

/// Ends of the four blocks of a spring in a matrix, and their signs.
const BLOCKS: [(usize, usize, f64); 4] = [(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)];

/// A spring as its tangents need it.
#[derive(Debug, Clone, Copy)]
struct Bar {
    nodes: [u32; 2],
    length: f64,
    stiffness: f64,
    damping: f64,
}

/// A network with masses, and where its nodes are.
#[derive(Debug, Clone)]
pub struct SpringModel<'a> {
    dofs: &'a DofMap,
    network: &'a Network,
    forces: SpringForces,
    bars: Vec<Bar>,
    masses: Vec<f64>,
    /// Made when it is asked for: explicit steps need none.
    pattern: OnceLock<Pattern>,
    rounding: f64,
    /// Places, velocities and forces of the nodes.
    places: Vec<[f64; 3]>,
    velocities: Vec<[f64; 3]>,
    node_forces: Vec<[f64; 3]>,
}

/// Stiffness and damping of every spring, N/m and N s/m, multiplicity included; no damping when there is none.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients<'a> {
    /// k.
    pub stiffness: &'a [f64],
    /// c.
    pub damping: Option<&'a [f64]>,
}

impl<'a> SpringModel<'a> {
    /// A network at rest. `masses` is one for each node, kg; tied nodes have theirs on their masters.
    ///
    /// # Panics
    /// When there is not one mass for every node and one coefficient for every spring.
    pub fn new(network: &'a Network, dofs: &'a DofMap, of: Coefficients, masses: &[f64]) -> Self {
        assert_eq!(network.positions.len(), masses.len(), "one mass for every node");
        let bars: Vec<Bar> = (network.springs.iter().zip(of.stiffness).enumerate())
            .map(|(s, (spring, &stiffness))| Bar {
                nodes: spring.nodes,
                length: spring.length,
                stiffness,
                damping: of.damping.map_or(0.0, |damping| damping[s]),
            })
            .collect();
        let strongest = bars.iter().map(|bar| bar.stiffness * bar.length).fold(0.0, f64::max);
        let zero = vec![[0.0; 3]; masses.len()];
        Self {
            dofs,
            network,
            forces: SpringForces::new(network, of.stiffness, of.damping),
            masses: (0..dofs.len()).map(|dof| masses[dofs.owner(dof).0]).collect(),
            pattern: OnceLock::new(),
            // the lengths of some ten springs around a node are each off by a few units in the last place
            rounding: 64.0 * f64::EPSILON * strongest,
            bars,
            places: network.positions.clone(),
            velocities: zero.clone(),
            node_forces: zero,
        }
    }

    /// The network linearised at rest, as a linear model.
    pub fn linear(&mut self) -> LinearModel {
        let rest = vec![0.0; self.dofs.len()];
        let Linearised { pattern, stiffness, damping, masses, .. } = Linearised::at(self, &rest, None);
        let damping = if damping.iter().any(|&c| c != 0.0) { Damping::Matrix(damping) } else { Damping::None };
        let matrix = CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), stiffness);
        LinearModel::new(&matrix.expect("one value for each entry of the pattern"), damping, masses)
    }

    /// Moves the nodes: places = rest + u, with velocities v.
    fn place(&mut self, u: &[f64], v: &[f64]) {
        for dof in 0..self.dofs.len() {
            let (node, component) = self.dofs.owner(dof);
            self.places[node][component] = self.network.positions[node][component] + u[dof];
            self.velocities[node][component] = v[dof];
        }
    }

    /// d and l of a spring where the nodes are.
    fn stretch(&self, bar: &Bar) -> ([f64; 3], f64) {
        let [a, b] = bar.nodes.map(|node| self.places[node as usize]);
        let d = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        (d, (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt())
    }
}

/// A body that is at least as stiff and as damped as the network in any of its states: every spring acts in all
/// directions with its k and c. One unknown a node, since all directions are alike. `masses` is one for each node, kg.
///
/// # Panics
/// When there is not one mass for every node and one coefficient for every spring.
pub fn isotropic(network: &Network, dofs: &DofMap, of: Coefficients, masses: &[f64]) -> Linearised {
    assert_eq!(network.positions.len(), masses.len(), "one mass for every node");
    assert_eq!(network.springs.len(), of.stiffness.len(), "one stiffness for every spring");
    let moves = |&node: &usize| dofs.free(node).iter().any(|&dof| dof != FIXED);
    let free: Vec<usize> = dofs.masters().filter(moves).collect();
    let mut unknown = vec![FIXED; masses.len()];
    free.iter().enumerate().for_each(|(i, &node)| unknown[node] = i as u32);
    let ends: Vec<[u32; 2]> = network.springs.iter().map(|s| s.nodes.map(|node| unknown[node as usize])).collect();
    let pattern = Pattern::from_cliques(free.len(), ends.iter().map(|ends| ends.as_slice()));
    let (mut stiffness, mut damping) = (vec![0.0; pattern.entries()], vec![0.0; pattern.entries()]);
    for (s, ends) in ends.iter().enumerate() {
        for (p, q, sign) in BLOCKS {
            if ends[p] != FIXED && ends[q] != FIXED {
                let place = pattern.position(ends[p] as usize, ends[q] as usize).expect("ends of a spring couple");
                stiffness[place] += sign * of.stiffness[s];
                damping[place] += sign * of.damping.map_or(0.0, |damping| damping[s]);
            }
        }
    }
    let masses = free.iter().map(|&node| masses[node]).collect();
    Linearised { pattern, stiffness, damping, masses, symbolic: None }
}

impl Model for SpringModel<'_> {
    fn unknowns(&self) -> usize {
        self.masses.len()
    }

    fn masses(&self) -> &[f64] {
        &self.masses
    }

    fn node(&self, unknown: usize) -> usize {
        self.dofs.owner(unknown).0
    }

    fn elastic_energy(&mut self, u: &[f64]) -> f64 {
        for (dof, u) in u.iter().enumerate() {
            let (node, component) = self.dofs.owner(dof);
            self.places[node][component] = self.network.positions[node][component] + u;
        }
        self.forces.energy(&self.places)
    }

    fn internal_force(&mut self, u: &[f64], v: &[f64], out: &mut [f64]) {
        self.place(u, v);
        self.forces.forces(&self.places, &self.velocities, &mut self.node_forces);
        for (dof, out) in out.iter_mut().enumerate() {
            let (node, component) = self.dofs.owner(dof);
            *out = -self.node_forces[node][component];
        }
    }

    fn dissipated_power(&mut self, u: &[f64], v: &[f64]) -> f64 {
        self.place(u, v);
        let power = |bar: &Bar| {
            let (d, length) = self.stretch(bar);
            let [a, b] = bar.nodes.map(|node| self.velocities[node as usize]);
            let rate = (0..3).map(|c| d[c] * (b[c] - a[c])).sum::<f64>();
            if length > 0.0 { bar.damping * (rate / length).powi(2) } else { 0.0 }
        };
        self.bars.iter().filter(|bar| bar.damping != 0.0).map(power).sum()
    }

    fn pattern(&self) -> &Pattern {
        self.pattern.get_or_init(|| affine::pattern(self.network, self.dofs))
    }

    fn tangent(&mut self, u: &[f64], v: &[f64], stiffness: &mut [f64], damping: &mut [f64]) {
        self.place(u, v);
        stiffness.fill(0.0);
        damping.fill(0.0);
        let pattern = self.pattern();
        for bar in &self.bars {
            let (d, length) = self.stretch(bar);
            if length == 0.0 {
                continue;
            }
            let n = d.map(|d| d / length);
            let [a, b] = bar.nodes.map(|node| self.places[node as usize]);
            let elastic = force::tangent(bar.stiffness, bar.length, a, b, false);
            for (p, q, sign) in BLOCKS {
                let [rows, columns] = [p, q].map(|end| self.dofs.free(bar.nodes[end] as usize));
                for (i, &row) in rows.iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
                    for (j, &column) in columns.iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
                        let place = pattern.position(row as usize, column as usize).expect("ends couple");
                        stiffness[place] += sign * elastic[i][j];
                        damping[place] += sign * bar.damping * n[i] * n[j];
                    }
                }
            }
        }
    }

    fn rounding(&self) -> f64 {
        self.rounding
    }

    fn is_linear(&self) -> bool {
        false
    }
}
