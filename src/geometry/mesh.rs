//! A mesh: nodes in space and the cells between them.
//!
//! Cells are triangles and quadrilaterals in two dimensions, tetrahedra and hexahedra in three; a mesh may mix the two of
//! its dimension. The corners of a cell are numbered as in VTK:
//!
//! ```text
//! triangle 0 1 2, quadrilateral 0 1 2 3     counter-clockwise
//! tetrahedron 0 1 2 3                       0 1 2 counter-clockwise seen from 3, so that det(x1-x0, x2-x0, x3-x0) > 0
//! hexahedron 0 1 2 3 4 5 6 7                the bottom 0 1 2 3 as a quadrilateral, 4 5 6 7 above them
//! ```
//!
//! Positions are in m, n x 3, z = 0 in two dimensions.

pub mod faces;
pub mod measure;
pub mod nodes;
pub mod parts;
pub mod quality;

/// What a cell is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CellKind {
    /// Three corners in the plane.
    Triangle,
    /// Four corners in the plane.
    Quadrilateral,
    /// Four corners in space.
    Tetrahedron,
    /// Eight corners in space.
    Hexahedron,
}

impl CellKind {
    /// Number of corners.
    pub fn corners(self) -> usize {
        match self {
            Self::Triangle => 3,
            Self::Quadrilateral | Self::Tetrahedron => 4,
            Self::Hexahedron => 8,
        }
    }

    /// Directions of the space that it fills, 2 or 3.
    pub fn dimension(self) -> usize {
        match self {
            Self::Triangle | Self::Quadrilateral => 2,
            Self::Tetrahedron | Self::Hexahedron => 3,
        }
    }
}

/// Nodes and cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    dimension: usize,
    positions: Vec<[f64; 3]>,
    kinds: Vec<CellKind>,
    starts: Vec<u32>,
    corners: Vec<u32>,
}

impl Mesh {
    /// A mesh without cells; `dimension` is 2 or 3, positions in m.
    ///
    /// # Panics
    /// When the dimension is another: a caller's mistake.
    pub fn new(dimension: usize, positions: Vec<[f64; 3]>) -> Self {
        assert!(dimension == 2 || dimension == 3, "a mesh has 2 or 3 dimensions, not {dimension}");
        Self { dimension, positions, kinds: Vec::new(), starts: vec![0], corners: Vec::new() }
    }

    /// A mesh of cells that are already in lists: their kinds, and their corners one cell after the other.
    ///
    /// # Panics
    /// As [`Mesh::push`].
    pub(in crate::geometry) fn from_parts(
        dimension: usize,
        positions: Vec<[f64; 3]>,
        kinds: Vec<CellKind>,
        corners: Vec<u32>,
    ) -> Self {
        assert!(kinds.iter().all(|kind| kind.dimension() == dimension), "the cells have the dimension of the mesh");
        assert_eq!(kinds.iter().map(|kind| kind.corners()).sum::<usize>(), corners.len(), "corners for every cell");
        assert!(corners.iter().all(|&node| (node as usize) < positions.len()), "every corner is a node");
        let mut starts = Vec::with_capacity(kinds.len() + 1);
        starts.push(0);
        starts.extend(kinds.iter().scan(0, |end, kind| {
            *end += kind.corners() as u32;
            Some(*end)
        }));
        Self { dimension, positions, kinds, starts, corners }
    }

    /// Appends a cell.
    ///
    /// # Panics
    /// When the cell is not of the mesh's dimension, has another number of corners, or a corner that is no node.
    pub fn push(&mut self, kind: CellKind, corners: &[u32]) {
        assert_eq!(kind.dimension(), self.dimension, "the cell has the dimension of the mesh");
        assert_eq!(kind.corners(), corners.len(), "as many corners as the cell has");
        assert!(corners.iter().all(|&node| (node as usize) < self.positions.len()), "every corner is a node");
        self.kinds.push(kind);
        self.corners.extend_from_slice(corners);
        self.starts.push(self.corners.len() as u32);
    }

    /// Directions of the space, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Places of the nodes in m.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Places of the nodes in m, to be moved.
    pub fn positions_mut(&mut self) -> &mut [[f64; 3]] {
        &mut self.positions
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.kinds.len()
    }

    /// What a cell is.
    pub fn kind(&self, cell: usize) -> CellKind {
        self.kinds[cell]
    }

    /// The nodes at the corners of a cell.
    pub fn corners(&self, cell: usize) -> &[u32] {
        &self.corners[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Places of the first N corners of a cell (m).
    ///
    /// # Panics
    /// When the cell has fewer than N corners.
    pub fn places<const N: usize>(&self, cell: usize) -> [[f64; 3]; N] {
        let corners = self.corners(cell);
        std::array::from_fn(|corner| self.positions[corners[corner] as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_several_kinds_stand_one_after_the_other() {
        let at = |x: f64, y: f64| [x, y, 0.0];
        let mut mesh = Mesh::new(2, vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0), at(2.0, 0.5)]);
        mesh.push(CellKind::Quadrilateral, &[0, 1, 2, 3]);
        mesh.push(CellKind::Triangle, &[1, 4, 2]);
        assert_eq!(mesh.cells(), 2);
        assert_eq!((mesh.kind(1), mesh.corners(1)), (CellKind::Triangle, [1, 4, 2].as_slice()));
        assert_eq!(mesh.corners(0).len(), mesh.kind(0).corners());
    }
}
