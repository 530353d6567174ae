//! Forces of springs at any stretch and turn.
//!
//! A spring of stiffness k, damping c and rest length l0 joins the nodes a and b. With d = x_b - x_a, n = d / |d| and
//! w = v_b - v_a the force on a is (thesis 3.2 and 3.3)
//!
//! ```text
//! f_a = (k (|d| - l0) + c (w . n)) n,      f_b = -f_a,      energy (3.1)  E = sum_s k/2 (|d| - l0)^2
//! ```
//!
//! Positions in m, velocities in m/s, k in N/m, c in N s/m, forces in N, energy in J. These forces act on the nodes: what
//! an integrator calls the internal force has the other sign. A spring whose ends meet has no direction and pulls
//! nowhere. Forces are exact to a few units in the last place of k |d|, k l0 and c |w|, as those of the formula.
//!
//! Nodes are cut into blocks, one or a few for each thread, and each block is one sweep over a stream of springs. A node's
//! sum is made in one place and one order: forces and energy have the same bits for any number of threads.
//!
//! | file | idea |
//! |---|---|
//! | `storage` | springs in the order of the sweep: bands without indices, and lists for the rest |
//! | `sweep` | the forces of a block of nodes, eight at a time, each spring of a band once |
//!
//! **What bounds it.** A spring of a band on a cube costs 16 bytes and its share of 72 bytes a node (position read, force
//! written and its line fetched first) and of the empty places at the sides, 23 bytes in all, and 27 vector instructions for
//! eight springs on two ports. At 2.7 GHz that is at most 1.6 thousand million springs a second for each thread, 37 GB/s,
//! more than memory gives: beyond the caches memory bounds it, inside them arithmetic. `springfit bench step` measures
//! both sides. With a root and a quotient in place of the estimate (34 cycles for eight) it would be 500 to 600 million at most
//! and bound by arithmetic everywhere; with every spring computed from both of its ends, 1.1 thousand million.

mod storage;
mod sweep;

use rayon::prelude::*;

use crate::lanes::{LANES, widest};
use crate::springs::network::Network;

use storage::Storage;
use sweep::{Block, Workspace};

/// Nodes that are worth a block of their own: less work than that is done sooner than another thread begins.
const BLOCK: usize = 1024;

/// Rows of nodes whose energies are summed before they join the total.
const ROWS: usize = 128;

/// The springs of a network, ready to be asked for their forces.
#[derive(Debug, Clone)]
pub struct SpringForces {
    springs: Storage,
    workspaces: Vec<Workspace>,
}

impl SpringForces {
    /// The springs of a network; `stiffness` in N/m and `damping` in N s/m, one for each spring, multiplicity included.
    ///
    /// # Panics
    /// When there is not one stiffness (and damping, if any) for every spring.
    pub fn new(network: &Network, stiffness: &[f64], damping: Option<&[f64]>) -> Self {
        assert_eq!(network.springs.len(), stiffness.len(), "one stiffness for every spring");
        assert!(damping.is_none_or(|c| c.len() == stiffness.len()), "one damping for every spring");
        Self { springs: Storage::new(network, stiffness, damping), workspaces: Vec::new() }
    }

    /// Bytes of one evaluation of all forces that go to or come from beyond the caches, when they are too small: springs
    /// and positions (velocities with damping) read, forces written, and the lines that are written read before.
    pub fn bytes(&self) -> usize {
        let read = if self.springs.numbers == 3 { 2 } else { 1 };
        self.springs.bytes() + self.springs.nodes * (read + 2) * size_of::<[f64; 3]>()
    }

    /// Forces on every node in N at the positions x (m) and velocities v (m/s); all of one entry a node. Without damping
    /// the velocities are not looked at.
    ///
    /// # Panics
    /// When a slice has not one entry for every node.
    pub fn forces(&mut self, x: &[[f64; 3]], v: &[[f64; 3]], out: &mut [[f64; 3]]) {
        let springs = &self.springs;
        assert_eq!([x.len(), v.len(), out.len()], [springs.nodes; 3], "one entry for every node");
        let blocks = (springs.nodes / BLOCK.max(springs.reach)).clamp(1, rayon::current_num_threads());
        let nodes = springs.rows().div_ceil(blocks) * LANES;
        self.workspaces.resize(blocks, Workspace::default());
        let serve = |index: usize, out, workspace| {
            let start = index * nodes;
            widest(Block { springs, positions: x, velocities: v, start, out, workspace });
        };
        match &mut self.workspaces[..] {
            [one] => serve(0, out, one),
            many => {
                let blocks = out.par_chunks_mut(nodes).zip(many).enumerate();
                blocks.for_each(|(index, (out, workspace))| serve(index, out, workspace));
            }
        }
    }

    /// Elastic energy (3.1) in J at the positions x (m), one for each node.
    ///
    /// # Panics
    /// When there is not one position for every node.
    pub fn energy(&self, x: &[[f64; 3]]) -> f64 {
        let springs = &self.springs;
        assert_eq!(x.len(), springs.nodes, "one position for every node");
        let some = |part: usize| {
            let rows = part * ROWS..((part + 1) * ROWS).min(springs.rows());
            rows.map(|row| springs.energy_of(row, x)).sum::<f64>()
        };
        let parts: Vec<f64> = (0..springs.rows().div_ceil(ROWS)).into_par_iter().map(some).collect();
        parts.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::springs::network::{Kind, Spring};

    /// One spring of rest length 2 along x.
    fn pair() -> Network {
        let spring = Spring {
            nodes: [0, 1],
            length: 2.0,
            direction: [1.0, 0.0, 0.0],
            kind: Kind::Edge,
            offset: [0, 0, 1],
            cells: 1,
        };
        Network { dimension: 3, positions: vec![[0.0; 3], [2.0, 0.0, 0.0]], springs: vec![spring], zero_length: 0 }
    }

    #[test]
    fn thesis_3_2_and_3_3_a_turned_and_stretched_spring() {
        let mut forces = SpringForces::new(&pair(), &[10.0], Some(&[3.0]));
        let (x, v) = ([[1.0, 1.0, 1.0], [1.0, 4.0, 5.0]], [[0.0, 0.5, 0.0], [7.0, 0.5, 2.0]]);
        let mut out = [[f64::NAN; 3]; 2];
        forces.forces(&x, &v, &mut out);
        // |d| = 5 along (0, 0.6, 0.8); 10 N/m over 3 m, and 3 N s/m at 2 x 0.8 m/s
        let pull = 30.0 + 3.0 * 1.6;
        for (axis, n) in [0.0, 0.6, 0.8].into_iter().enumerate() {
            assert!((out[0][axis] - pull * n).abs() < 1e-13, "{out:?}");
            assert_eq!(out[1][axis], -out[0][axis]);
        }
        assert!((forces.energy(&x) - 45.0).abs() < 1e-13);
    }

    #[test]
    fn ends_that_meet_pull_nowhere() {
        let mut forces = SpringForces::new(&pair(), &[10.0], Some(&[3.0]));
        let mut out = [[f64::NAN; 3]; 2];
        forces.forces(&[[1.0; 3]; 2], &[[0.0; 3], [1.0; 3]], &mut out);
        assert_eq!(out, [[0.0; 3]; 2]);
        assert_eq!(forces.energy(&[[1.0; 3]; 2]), 20.0);
    }
}
