//! Experiment 4.I: a membrane of springs with known stiffness is released, and the acceleration objective (4.5) finds
//! the stiffness from its first accelerations.
//!
//! 2 m x 2 m, n x n masses of together 2 kg, edges 500 N/m, diagonals 400 N/m. The continuum of the objective is here the
//! membrane itself, with the full force (3.2). The problem is linear and its answer exact: an annealing that ends elsewhere
//! has not failed for lack of information.

use crate::calibration::objectives::acceleration::{Force, State, Target};
use crate::calibration::optimisers::least_squares;
use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::geometry::grid::Grid;
use crate::springs::grouping::{self, Grouping, Request};
use crate::springs::network::Network;
use crate::springs::{force, topology};

/// Side of the membrane, m.
const SIDE: f64 = 2.0;

/// Mass of the membrane, kg.
const MASS: f64 = 2.0;

/// Stiffness of edges and of diagonals, N/m.
pub const TRUTH: [f64; 2] = [500.0, 400.0];

/// Upper bound of both while they are searched, N/m.
const UPPER: f64 = 1e4;

/// Stiffness of edges and diagonals, N/m, found for a membrane of n x n masses.
///
/// `held` says which masses cannot move, by their place in the grid; `displace` is the state of the release in m at a
/// place in m, applied to the free ones.
///
/// # Errors
/// [`Error::Input`] for a state in which the springs of a kind do not pull.
pub fn recover(
    n: usize,
    held: &dyn Fn([usize; 3]) -> bool,
    displace: &dyn Fn([f64; 3]) -> [f64; 3],
) -> Result<Vec<f64>> {
    let grid = Grid::new(&[n, n]);
    let spacing = SIDE / (n - 1) as f64;
    let place = |node: usize| grid.index(node).map(|i| i as f64 * spacing);
    let positions: Vec<[f64; 3]> = (0..grid.len()).map(place).collect();
    let fixed: Vec<[bool; 3]> = (0..grid.len()).map(|node| [held(grid.index(node)); 3]).collect();
    let dofs = DofMap::untied(2, &fixed);
    let network = (named(topology::find("grid"), "topology")?.connect)(&grid, &positions, &dofs);
    let kinds = (named(grouping::find("kind"), "grouping")?.group)(&network, &Request::default())?;
    let moved = |node: usize| if fixed[node][0] { [0.0; 3] } else { displace(positions[node]) };
    let displacement: Vec<[f64; 3]> = (0..grid.len()).map(moved).collect();
    let resistance = resistance(&network, &kinds, &dofs, &displacement);
    let target = Target {
        network: &network,
        coefficients: &vec![1.0; network.springs.len()],
        dofs: &dofs,
        masses: &vec![MASS / grid.len() as f64; grid.len()],
        states: &[State { name: "the release".into(), displacement, resistance }],
        force: Force::Full,
    };
    least_squares::solve(&target.reduce(&kinds)?, &[UPPER; 2])
}

fn named<T>(found: Option<T>, what: &str) -> Result<T> {
    found.ok_or_else(|| Error::input(what, "is missing from its table", "report this"))
}

/// Forces that the true springs put against a state, on the free degrees of freedom, N.
fn resistance(network: &Network, kinds: &Grouping, dofs: &DofMap, displacement: &[[f64; 3]]) -> Vec<f64> {
    let mut resistance = vec![0.0; dofs.len()];
    for (spring, &kind) in network.springs.iter().zip(&kinds.group_of) {
        let [a, b] = spring.nodes.map(|node| node as usize);
        let at = |node: usize| [0, 1, 2].map(|c| network.positions[node][c] + displacement[node][c]);
        let pull = force::elastic(TRUTH[kind as usize], spring.length, at(a), at(b));
        for (node, sign) in [(a, -1.0), (b, 1.0)] {
            for (&dof, pull) in dofs.free(node).iter().zip(pull).filter(|(dof, _)| **dof != FIXED) {
                resistance[dof as usize] += sign * pull;
            }
        }
    }
    resistance
}
