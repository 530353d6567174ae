//! The edges and the faces of a cell.
//!
//! A face is what a cell shares with its neighbour: in two dimensions an edge, in three a triangle or a quadrilateral. Its
//! corners are given as the outside sees them, counter-clockwise; in the plane the cell lies to the left of the edge.

use super::CellKind;

impl CellKind {
    /// Pairs of corners joined by an edge: 3, 4, 6 or 12.
    pub fn edges(self) -> &'static [[usize; 2]] {
        match self {
            Self::Triangle => &[[0, 1], [1, 2], [2, 0]],
            Self::Quadrilateral => &[[0, 1], [1, 2], [2, 3], [3, 0]],
            Self::Tetrahedron => &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
            Self::Hexahedron => {
                const BOX: [[usize; 2]; 12] =
                    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
                &BOX
            }
        }
    }

    /// Corners of each face: 3 or 4 faces in the plane, 4 or 6 in space.
    pub fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Triangle => &[&[0, 1], &[1, 2], &[2, 0]],
            Self::Quadrilateral => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
            Self::Tetrahedron => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
            Self::Hexahedron => {
                &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]]
            }
        }
    }

    /// For each corner the corners at the other ends of its edges, right-handed in a cell of positive measure; two in the plane,
    /// three in space.
    pub fn around(self) -> &'static [&'static [usize]] {
        match self {
            Self::Triangle => &[&[1, 2], &[2, 0], &[0, 1]],
            Self::Quadrilateral => &[&[1, 3], &[2, 0], &[3, 1], &[0, 2]],
            Self::Tetrahedron => &[&[1, 2, 3], &[2, 0, 3], &[0, 1, 3], &[0, 2, 1]],
            Self::Hexahedron => {
                &[&[1, 3, 4], &[2, 0, 5], &[3, 1, 6], &[0, 2, 7], &[7, 5, 0], &[4, 6, 1], &[5, 7, 2], &[6, 4, 3]]
            }
        }
    }

    /// The order of corners that turns a cell of negative measure into one of positive measure.
    pub fn turned(self) -> &'static [usize] {
        match self {
            Self::Triangle => &[0, 2, 1],
            Self::Quadrilateral => &[0, 3, 2, 1],
            Self::Tetrahedron => &[0, 1, 3, 2],
            Self::Hexahedron => &[4, 5, 6, 7, 0, 1, 2, 3],
        }
    }
}
