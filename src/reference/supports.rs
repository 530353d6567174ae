//! Do the supports hold the body?
//!
//! An elastic body in one piece moves without resistance only as a whole: by a translation or an infinitesimal
//! rotation, u(x) = t + r x (x - c), 3 numbers in the plane and 6 in space. The supports hold it when no such motion
//! leaves all held components at rest, that is when the rows of the rigid motions at the held components have full
//! rank. This is decided before anything is factored, because a factorisation of a singular matrix may succeed by
//! rounding.

use nalgebra_sparse::na::{DMatrix, SymmetricEigen};

use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, FIXED};

/// A motion whose held components stay below this share of its size (squared) counts as free.
const FREE: f64 = 1e-14;

/// Checks that no rigid motion of the nodes at `positions` (m, n x 3) is free.
///
/// # Errors
/// [`Error::Mechanism`] with the node and the axis that a free motion moves most.
pub fn check(positions: &[[f64; 3]], dofs: &DofMap) -> Result<()> {
    let motions = RigidMotions::of(positions, dofs.dimension());
    let mut held = DMatrix::<f64>::zeros(motions.count, motions.count);
    for (node, position) in positions.iter().enumerate() {
        for i in (0..dofs.dimension()).filter(|&i| dofs.free(node)[i] == FIXED) {
            let row = motions.component(*position, i);
            for a in 0..motions.count {
                for b in 0..motions.count {
                    held[(a, b)] += row[a] * row[b];
                }
            }
        }
    }
    let modes = SymmetricEigen::new(held);
    let (weakest, &strength) = match modes.eigenvalues.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)) {
        Some(found) => found,
        None => return Ok(()),
    };
    if strength > FREE * modes.eigenvalues.max() {
        return Ok(());
    }
    let motion = modes.eigenvectors.column(weakest);
    let mut most = (0.0, 0, 0);
    for (node, position) in positions.iter().enumerate() {
        for i in (0..dofs.dimension()).filter(|&i| dofs.free(node)[i] != FIXED) {
            let row = motions.component(*position, i);
            let moved = row.iter().zip(motion.iter()).map(|(r, m)| r * m).sum::<f64>().abs();
            // a clear winner only: equal motions go to the first node and axis, whatever the rounding
            if moved > most.0 * (1.0 + 1e-9) {
                most = (moved, node, i);
            }
        }
    }
    Err(Error::Mechanism { what: "reference body".into(), node: most.1, direction: ['x', 'y', 'z'][most.2] })
}

/// Translations and rotations of a body, scaled so that all are of the same size.
struct RigidMotions {
    count: usize,
    dimension: usize,
    centre: [f64; 3],
    radius: f64,
}

impl RigidMotions {
    fn of(positions: &[[f64; 3]], dimension: usize) -> Self {
        let n = positions.len().max(1) as f64;
        let centre = [0, 1, 2].map(|a| positions.iter().map(|p| p[a]).sum::<f64>() / n);
        let radius = positions
            .iter()
            .flat_map(|p| (0..3).map(move |a| (p[a] - centre[a]).abs()))
            .fold(f64::MIN_POSITIVE, f64::max);
        Self { count: if dimension == 2 { 3 } else { 6 }, dimension, centre, radius }
    }

    /// Component i of every motion at a place: translations first, then rotations about z (2D) or about x, y, z.
    fn component(&self, position: [f64; 3], i: usize) -> [f64; 6] {
        let x = [0, 1, 2].map(|a| (position[a] - self.centre[a]) / self.radius);
        let mut motions = [0.0; 6];
        motions[i] = 1.0;
        // (e_axis x x)_i is x_(i-axis step) with the sign of the cyclic order
        for axis in 0..3 {
            let turned = if i == (axis + 1) % 3 {
                -x[(axis + 2) % 3]
            } else if i == (axis + 2) % 3 {
                x[(axis + 1) % 3]
            } else {
                0.0
            };
            if self.dimension == 3 {
                motions[3 + axis] = turned;
            } else if axis == 2 {
                motions[2] = turned;
            }
        }
        motions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0]];

    fn outcome(dimension: usize, positions: &[[f64; 3]], held: &[(usize, usize)]) -> Result<()> {
        let mut fixed = vec![[false; 3]; positions.len()];
        for &(node, component) in held {
            fixed[node][component] = true;
        }
        check(positions, &DofMap::untied(dimension, &fixed))
    }

    #[test]
    fn hard_case_rigid_body() {
        assert_eq!(outcome(2, &CORNERS, &[(0, 0), (0, 1), (1, 0)]), Ok(()));
        let loose = outcome(2, &CORNERS, &[(0, 0), (0, 1)]);
        assert_eq!(loose, Err(Error::Mechanism { what: "reference body".into(), node: 1, direction: 'x' }));
        assert!(outcome(2, &CORNERS, &[]).is_err());
        // two held in y at different places, nothing in x: slides along x
        let slides = outcome(2, &CORNERS, &[(0, 1), (2, 1)]);
        assert_eq!(slides, Err(Error::Mechanism { what: "reference body".into(), node: 0, direction: 'x' }));
    }

    #[test]
    fn a_solid_held_along_a_line_turns_about_it() {
        let mut positions = CORNERS.to_vec();
        positions.extend(CORNERS.map(|[x, y, _]| [x, y, 3.0]));
        let line: Vec<(usize, usize)> = [0, 4].iter().flat_map(|&n| (0..3).map(move |i| (n, i))).collect();
        assert!(outcome(3, &positions, &line).is_err());
        let plane: Vec<(usize, usize)> = [0, 1, 2].iter().flat_map(|&n| (0..3).map(move |i| (n, i))).collect();
        assert_eq!(outcome(3, &positions, &plane), Ok(()));
    }
}
