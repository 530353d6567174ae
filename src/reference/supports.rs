//! Do the supports hold the body?
//!
//! An elastic body in one piece moves without resistance only as a whole: by a translation or an infinitesimal
//! rotation, u(x) = t + r x (x - c), 3 numbers in the plane and 6 in space. The supports hold it when no such motion
//! leaves all held components at rest, that is when the rows of the rigid motions at the held components have full
//! rank. This is decided before anything is factored, because a factorisation of a singular matrix may succeed by
//! rounding.

use std::collections::BTreeMap;

use nalgebra_sparse::na::{DMatrix, SymmetricEigen};

use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::geometry::mesh::Mesh;

/// A motion whose held components stay below this share of its size (squared) counts as free.
const FREE: f64 = 1e-14;

/// Checks that no rigid motion of the nodes at `positions` (m, n x 3) is free.
///
/// # Errors
/// [`Error::Mechanism`] with the node and the axis that a free motion moves most.
pub fn check(positions: &[[f64; 3]], dofs: &DofMap) -> Result<()> {
    let all: Vec<(usize, [f64; 3])> = positions.iter().copied().enumerate().collect();
    check_piece(&all, dofs)
}

/// Checks every piece of a mesh by itself: pieces have no cell in common, and no node that is tied to one of the other.
///
/// # Errors
/// As [`check`], of the first piece that is not held.
pub fn check_pieces(mesh: &Mesh, dofs: &DofMap) -> Result<()> {
    let mut piece: Vec<usize> = (0..dofs.nodes()).map(|node| dofs.master(node)).collect();
    for cell in 0..mesh.cells() {
        let corners = mesh.corners(cell);
        let roots: Vec<usize> = corners.iter().map(|&node| root(&mut piece, node as usize)).collect();
        let first = roots.iter().copied().min().unwrap_or(0);
        roots.into_iter().for_each(|other| piece[other] = first);
    }
    let mut pieces = BTreeMap::<usize, Vec<(usize, [f64; 3])>>::new();
    for (node, &position) in mesh.positions().iter().enumerate() {
        pieces.entry(root(&mut piece, node)).or_default().push((node, position));
    }
    pieces.values().try_for_each(|nodes| check_piece(nodes, dofs))
}

/// The first node of the piece of a node; shortens the way there.
fn root(piece: &mut [usize], node: usize) -> usize {
    let mut at = node;
    while piece[at] != at {
        piece[at] = piece[piece[at]];
        at = piece[at];
    }
    at
}

/// Checks the nodes of one piece, each with its place.
fn check_piece(nodes: &[(usize, [f64; 3])], dofs: &DofMap) -> Result<()> {
    let motions = RigidMotions::of(nodes, dofs.dimension());
    let mut held = DMatrix::<f64>::zeros(motions.count, motions.count);
    for &(node, ref position) in nodes {
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
    for &(node, ref position) in nodes {
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
    fn of(nodes: &[(usize, [f64; 3])], dimension: usize) -> Self {
        let n = nodes.len().max(1) as f64;
        let centre = [0, 1, 2].map(|a| nodes.iter().map(|(_, p)| p[a]).sum::<f64>() / n);
        let radius = nodes
            .iter()
            .flat_map(|(_, p)| (0..3).map(move |a| (p[a] - centre[a]).abs()))
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
    use crate::geometry::mesh::CellKind;

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
    fn two_pieces_are_held_each_by_itself() {
        let mut positions = CORNERS.to_vec();
        positions.extend(CORNERS.map(|[x, y, z]| [x + 5.0, y, z]));
        let mut mesh = Mesh::new(2, positions.clone());
        mesh.push(CellKind::Quadrilateral, &[0, 2, 3, 1]);
        mesh.push(CellKind::Quadrilateral, &[4, 6, 7, 5]);
        let held = |nodes: &[usize]| {
            let mut fixed = vec![[false; 3]; 8];
            nodes.iter().for_each(|&node| fixed[node] = [true; 3]);
            DofMap::untied(2, &fixed)
        };
        let first = held(&[0, 1]);
        assert_eq!(check(&positions, &first), Ok(()));
        let loose = Error::Mechanism { what: "reference body".into(), node: 4, direction: 'x' };
        assert_eq!(check_pieces(&mesh, &first), Err(loose));
        assert_eq!(check_pieces(&mesh, &held(&[0, 1, 6, 7])), Ok(()));
        // tied at two nodes, the first piece holds the second
        let mut fixed = vec![[false; 3]; 8];
        fixed[..2].fill([true; 3]);
        let tied = DofMap::new(2, vec![0, 1, 2, 3, 2, 3, 6, 7], &fixed);
        assert_eq!(check_pieces(&mesh, &tied), Ok(()));
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
