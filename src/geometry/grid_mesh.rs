//! A structured grid of nodes as a mesh.
//!
//! Cell (i, j, k) of the grid becomes a quadrilateral or a hexahedron. It can also be cut into simplices: for each order
//! of the directions there is one path along the edges from its first corner to its last, and the corners of the path
//! span one of d! triangles or tetrahedra (Kuhn's cut). Neighbours cut their common face along the same diagonal.
//!
//! A grid whose directions are left-handed in space makes cells of negative measure; then all cells are numbered the other
//! way round. Single cells that are folded stay so: filling their integration points finds them.

use super::grid::Grid;
use super::mesh::{CellKind, Mesh};

/// Corners of a cell of the grid (C order, last direction fastest) in the order of a quadrilateral or hexahedron.
const QUADRILATERAL: [usize; 4] = [0, 2, 3, 1];
const HEXAHEDRON: [usize; 8] = [0, 4, 6, 2, 1, 5, 7, 3];

/// Kuhn's simplices, all of positive measure in a right-handed cell: corners in C order.
const TRIANGLES: [[usize; 3]; 2] = [[0, 2, 3], [0, 3, 1]];
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 4, 6, 7], [0, 4, 7, 5], [0, 2, 7, 6], [0, 2, 3, 7], [0, 1, 5, 7], [0, 1, 7, 3]];

/// The cells of `grid` as cells of one `kind`; `positions` are the places of its nodes in m.
///
/// # Panics
/// When there is not one position for every node, or the kind has another dimension than the grid.
pub fn mesh_of_grid(grid: &Grid, positions: Vec<[f64; 3]>, kind: CellKind) -> Mesh {
    assert_eq!(grid.len(), positions.len(), "one position for every node");
    assert_eq!(grid.dimension(), kind.dimension(), "cells of the dimension of the grid");
    let left_handed = signed_measure(grid, &positions) < 0.0;
    let mut mesh = Mesh::new(grid.dimension(), positions);
    for cell in grid.cells() {
        for piece in pieces(kind) {
            let mut corners: Vec<u32> = piece.iter().map(|&corner| cell[corner]).collect();
            if left_handed {
                corners = kind.turned().iter().map(|&corner| corners[corner]).collect();
            }
            mesh.push(kind, &corners);
        }
    }
    mesh
}

/// The cells that one cell of the grid becomes.
fn pieces(kind: CellKind) -> Vec<&'static [usize]> {
    match kind {
        CellKind::Triangle => TRIANGLES.iter().map(|corners| corners.as_slice()).collect(),
        CellKind::Quadrilateral => vec![&QUADRILATERAL],
        CellKind::Tetrahedron => TETRAHEDRA.iter().map(|corners| corners.as_slice()).collect(),
        CellKind::Hexahedron => vec![&HEXAHEDRON],
    }
}

/// Sum of the measures of all simplices, negative for a left-handed grid.
fn signed_measure(grid: &Grid, positions: &[[f64; 3]]) -> f64 {
    let measure = |cell: &[u32], corners: &[usize]| {
        let at = |corner: usize| positions[cell[corners[corner]] as usize];
        let origin = at(0);
        let edge = |corner: usize| [0, 1, 2].map(|a| at(corner)[a] - origin[a]);
        let (u, v) = (edge(1), edge(2));
        let w = if corners.len() == 4 { edge(3) } else { [0.0, 0.0, 1.0] };
        u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0])
    };
    let kind = if grid.dimension() == 2 { CellKind::Triangle } else { CellKind::Tetrahedron };
    grid.cells().iter().flat_map(|cell| pieces(kind).into_iter().map(move |piece| measure(cell, piece))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn positions(grid: &Grid, mirrored: bool) -> Vec<[f64; 3]> {
        let place = |node: usize| grid.index(node).map(|i| i as f64);
        (0..grid.len()).map(place).map(|[x, y, z]| [if mirrored { -x } else { x }, y, z]).collect()
    }

    #[test]
    fn every_cell_is_positive_whatever_the_hand_of_the_grid() {
        for (shape, kinds) in [
            (vec![3, 4], [CellKind::Quadrilateral, CellKind::Triangle]),
            (vec![3, 2, 4], [CellKind::Hexahedron, CellKind::Tetrahedron]),
        ] {
            let grid = Grid::new(&shape);
            for (kind, mirrored) in kinds.into_iter().flat_map(|kind| [(kind, false), (kind, true)]) {
                let mesh = mesh_of_grid(&grid, positions(&grid, mirrored), kind);
                assert_eq!(mesh.cells(), grid.cells().len() * pieces(kind).len());
                let share = 1.0 / pieces(kind).len() as f64;
                let right = |cell: usize| (mesh.measure(cell) - share).abs() < 1e-15;
                assert!((0..mesh.cells()).all(right), "{kind:?} {mirrored}");
            }
        }
    }

    #[test]
    fn neighbours_share_the_diagonals_of_their_faces() {
        let grid = Grid::new(&[3, 3, 3]);
        let mesh = mesh_of_grid(&grid, positions(&grid, false), CellKind::Tetrahedron);
        let mut faces = std::collections::HashMap::<Vec<u32>, usize>::new();
        for cell in 0..mesh.cells() {
            for left_out in 0..4 {
                let mut face = mesh.corners(cell).to_vec();
                face.remove(left_out);
                face.sort_unstable();
                *faces.entry(face).or_default() += 1;
            }
        }
        assert_eq!(faces.values().filter(|&&count| count == 1).count(), 6 * 4 * 2, "two triangles a boundary square");
        assert!(faces.values().all(|&count| count <= 2));
    }
}
