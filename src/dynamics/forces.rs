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
//! nowhere.

use crate::springs::network::Network;

/// The springs of a network, ready to be asked for their forces.
#[derive(Debug, Clone)]
pub struct SpringForces {
    nodes: usize,
    springs: Vec<Stretched>,
}

/// What the force of one spring depends on.
#[derive(Debug, Clone, Copy)]
struct Stretched {
    ends: [u32; 2],
    length: f64,
    stiffness: f64,
    damping: f64,
}

impl SpringForces {
    /// The springs of a network; `stiffness` in N/m and `damping` in N s/m, one for each spring, multiplicity included.
    ///
    /// # Panics
    /// When there is not one stiffness (and damping, if any) for every spring.
    pub fn new(network: &Network, stiffness: &[f64], damping: Option<&[f64]>) -> Self {
        assert_eq!(network.springs.len(), stiffness.len(), "one stiffness for every spring");
        assert!(damping.is_none_or(|c| c.len() == stiffness.len()), "one damping for every spring");
        let springs = network.springs.iter().zip(stiffness).enumerate().map(|(s, (spring, &stiffness))| Stretched {
            ends: spring.nodes,
            length: spring.length,
            stiffness,
            damping: damping.map_or(0.0, |damping| damping[s]),
        });
        Self { nodes: network.positions.len(), springs: springs.collect() }
    }

    /// Forces on every node in N at the positions x (m) and velocities v (m/s); all of one entry a node.
    ///
    /// # Panics
    /// When a slice has not one entry for every node.
    pub fn forces(&mut self, x: &[[f64; 3]], v: &[[f64; 3]], out: &mut [[f64; 3]]) {
        assert_eq!([x.len(), v.len(), out.len()], [self.nodes; 3], "one entry for every node");
        out.fill([0.0; 3]);
        for spring in &self.springs {
            let [a, b] = spring.ends.map(|end| end as usize);
            let (d, w) = (difference(x[b], x[a]), difference(v[b], v[a]));
            let length = dot(d, d).sqrt();
            if length > 0.0 {
                let n = d.map(|d| d / length);
                let pull = spring.stiffness * (length - spring.length) + spring.damping * dot(w, n);
                for axis in 0..3 {
                    out[a][axis] += pull * n[axis];
                    out[b][axis] -= pull * n[axis];
                }
            }
        }
    }

    /// Elastic energy (3.1) in J at the positions x (m), one for each node.
    ///
    /// # Panics
    /// When there is not one position for every node.
    pub fn energy(&self, x: &[[f64; 3]]) -> f64 {
        assert_eq!(x.len(), self.nodes, "one position for every node");
        let energy = |spring: &Stretched| {
            let d = difference(x[spring.ends[1] as usize], x[spring.ends[0] as usize]);
            0.5 * spring.stiffness * (dot(d, d).sqrt() - spring.length).powi(2)
        };
        self.springs.iter().map(energy).sum()
    }
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
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
