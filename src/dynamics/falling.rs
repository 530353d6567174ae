//! A network that falls: leapfrog as a simulator would write it, and nothing beside it.
//!
//! ```text
//! v_{n+1/2} = v_{n-1/2} + h (f(x_n, v_{n-1/2}) / m + g),      x_{n+1} = x_n + h v_{n+1/2}
//! ```
//!
//! No energies, no records, no loads but g: what a step of a network costs is measured on it. Nodes are held in all
//! components or in none. x in m, v in m/s, f in N, m in kg, g in m/s^2, h in s.

use rayon::prelude::*;

use super::forces::SpringForces;

/// Nodes that one task moves.
const PIECE: usize = 2048;

/// A network on its way.
pub struct Falling {
    forces: SpringForces,
    positions: Vec<[f64; 3]>,
    /// v_{n-1/2}.
    velocities: Vec<[f64; 3]>,
    pulls: Vec<[f64; 3]>,
    mobility: Vec<f64>,
    acceleration: [f64; 3],
    step: f64,
}

impl Falling {
    /// At rest at the time 0: v_{-1/2} is such that the first step adds half of what the others add.
    ///
    /// `mobility` is 1/m of every node in 1/kg, zero where it is held; `acceleration` is g.
    ///
    /// # Panics
    /// When there is not one mobility for every position.
    pub fn new(
        forces: SpringForces,
        positions: Vec<[f64; 3]>,
        mobility: Vec<f64>,
        acceleration: [f64; 3],
        step: f64,
    ) -> Self {
        assert_eq!(positions.len(), mobility.len(), "one mobility for every position");
        let back = |&mobility: &f64| acceleration.map(|g| if mobility > 0.0 { -0.5 * step * g } else { 0.0 });
        Self {
            velocities: mobility.iter().map(back).collect(),
            pulls: vec![[0.0; 3]; positions.len()],
            forces,
            positions,
            mobility,
            acceleration,
            step,
        }
    }

    /// Where the nodes are, m.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// [`SpringForces::bytes`].
    pub fn bytes(&self) -> usize {
        self.forces.bytes()
    }

    /// The forces at the present positions.
    pub fn pull(&mut self) {
        self.forces.forces(&self.positions, &self.velocities, &mut self.pulls);
    }

    /// One step.
    pub fn advance(&mut self) {
        self.pull();
        let (step, acceleration) = (self.step, self.acceleration);
        let nodes = self.positions.par_chunks_mut(PIECE).zip(self.velocities.par_chunks_mut(PIECE));
        let given = self.pulls.par_chunks(PIECE).zip(self.mobility.par_chunks(PIECE));
        nodes.zip(given).for_each(|((positions, velocities), (pulls, mobility))| {
            for (((x, v), f), mobility) in positions.iter_mut().zip(velocities).zip(pulls).zip(mobility) {
                let free = if *mobility > 0.0 { step } else { 0.0 };
                for axis in 0..3 {
                    v[axis] += free * (f[axis] * mobility + acceleration[axis]);
                    x[axis] += step * v[axis];
                }
            }
        });
    }
}
