//! Edges and faces of a mesh, and its boundary.
//!
//! Faces are found by the sorted tuple of their nodes: every cell lists its faces, the list is sorted, and equal tuples are
//! one face. A face belongs to one cell (the boundary) or to two. A face of three cells or more is no part of a body
//! and is refused. On a tetrahedral mesh, faces = 2 cells + boundary faces / 2.

use super::Mesh;
use crate::error::{Error, Result};

/// Behind the last node of an edge or a triangle.
const NONE: u32 = u32::MAX;

/// What one cell shares with another, or with the outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    nodes: [u32; 4],
    /// The cell that has it, the first of the two.
    pub cell: u32,
    /// The other cell; none at the boundary.
    pub neighbour: Option<u32>,
}

impl Face {
    /// Its nodes, counter-clockwise seen from outside its `cell`: 2 in the plane, 3 or 4 in space.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.nodes.iter().position(|&node| node == NONE).unwrap_or(4)]
    }
}

/// A face of one cell while it looks for the other: its three smallest nodes, ascending, and the cell. No two faces of a
/// conforming mesh share three nodes, so the fourth of a quadrilateral need not be kept.
type Side = ([u32; 3], u32);

/// A face that cannot be in a body: its nodes, ascending, and the cells that claim it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Crowded {
    /// Nodes of the face, or the three that two different faces share.
    pub nodes: Vec<u32>,
    /// The cells, ascending: three or more, or the two whose faces differ.
    pub cells: Vec<u32>,
}

impl Crowded {
    /// What is wrong, with the nodes and the cells named by the caller's words for them.
    pub fn message(&self, nodes: &str, cells: &str) -> String {
        match self.cells.len() {
            2 => format!("two faces share the nodes {nodes} but differ in another: cells {cells}"),
            count => format!("the face of the nodes {nodes} is shared by {count} cells: {cells}"),
        }
    }

    /// What to do about it.
    pub const HELP: &str = "a face joins two cells at most: remove the cells that overlap or are there twice";
}

/// The first numbers of a list, with "..." where there are more than eight.
pub fn listed(numbers: impl ExactSizeIterator<Item = u64>) -> String {
    const SHOWN: usize = 8;
    let more = if numbers.len() > SHOWN { ", ..." } else { "" };
    numbers.take(SHOWN).map(|number| number.to_string()).collect::<Vec<_>>().join(", ") + more
}

impl Mesh {
    /// Pairs of nodes joined by an edge, the smaller number first, ascending, each once.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges = Vec::new();
        for cell in 0..self.cells() {
            let corners = self.corners(cell);
            edges.extend(self.kind(cell).edges().iter().map(|&[a, b]| {
                let (a, b) = (corners[a], corners[b]);
                [a.min(b), a.max(b)]
            }));
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// All faces (in two dimensions edges), ascending by their sorted nodes.
    ///
    /// # Errors
    /// [`Error::Input`] (`geometry.file`) when more than two cells share a face, with the nodes and the cells.
    pub fn faces(&self) -> Result<Vec<Face>> {
        let mut faces = Vec::new();
        self.visit_faces(|face| faces.push(face)).map_err(|crowded| {
            let nodes = listed(crowded.nodes.iter().map(|&node| node.into()));
            let cells = listed(crowded.cells.iter().map(|&cell| cell.into())) + " (counted from 0)";
            Error::input("geometry.file", crowded.message(&nodes, &cells), Crowded::HELP)
        })?;
        Ok(faces)
    }

    /// The faces of one cell only, ascending by their sorted nodes.
    ///
    /// # Errors
    /// As [`Mesh::faces`].
    pub fn boundary_faces(&self) -> Result<Vec<Face>> {
        let mut faces = self.faces()?;
        faces.retain(|face| face.neighbour.is_none());
        Ok(faces)
    }

    /// Shows every face to `see`, in the order of [`Mesh::faces`], and stops at one that cannot be in a body.
    pub fn visit_faces(&self, mut see: impl FnMut(Face)) -> std::result::Result<(), Crowded> {
        for shared in self.sides().chunk_by(|a, b| a.0 == b.0) {
            let (key, cell) = shared[0];
            let nodes = self.face_nodes(key, cell);
            let neighbour = shared.get(1).map(|other| other.1);
            let differs = |other| sorted(self.face_nodes(key, other)) != sorted(nodes);
            if shared.len() > 2 || neighbour.is_some_and(differs) {
                let whole = sorted(if shared.len() > 2 { nodes } else { [key[0], key[1], key[2], NONE] });
                return Err(Crowded {
                    nodes: whole.into_iter().filter(|&node| node != NONE).collect(),
                    cells: shared.iter().map(|side| side.1).collect(),
                });
            }
            see(Face { nodes, cell, neighbour });
        }
        Ok(())
    }

    /// True when the two cells of a face lie on the same side of it: one of them is folded over, or there twice. In a sound
    /// mesh of turned cells (`orient`) the two see the face in opposite orders.
    pub fn is_fold(&self, face: &Face) -> bool {
        let Some(other) = face.neighbour else { return false };
        let seen = face.nodes();
        let its = Face { nodes: self.face_nodes(key_of(seen), other), cell: other, neighbour: None };
        let its = its.nodes();
        let at = its.iter().position(|&node| node == seen[0]);
        match seen.len() {
            2 => its[0] == seen[0],
            count => at.is_some_and(|at| its[(at + 1) % count] == seen[1]),
        }
    }

    /// The faces of all cells, sorted by their nodes and then by cell.
    fn sides(&self) -> Vec<Side> {
        let count = (0..self.cells()).map(|cell| self.kind(cell).faces().len()).sum();
        let mut sides = Vec::with_capacity(count);
        for cell in 0..self.cells() {
            let corners = self.corners(cell);
            for local in self.kind(cell).faces() {
                let mut nodes = [NONE; 4];
                local.iter().zip(&mut nodes).for_each(|(&corner, node)| *node = corners[corner]);
                sides.push((key_of(&nodes), cell as u32));
            }
        }
        sides.sort_unstable();
        sides
    }

    /// Nodes of the face of a cell that has this key, as its outside sees them.
    fn face_nodes(&self, key: [u32; 3], cell: u32) -> [u32; 4] {
        let corners = self.corners(cell as usize);
        let nodes = self.kind(cell as usize).faces().iter().map(|local| {
            let mut nodes = [NONE; 4];
            local.iter().zip(&mut nodes).for_each(|(&corner, node)| *node = corners[corner]);
            nodes
        });
        nodes.into_iter().find(|nodes| key_of(nodes) == key).expect("the key is that of a face of the cell")
    }
}

/// The three smallest nodes of a face, ascending.
fn key_of(nodes: &[u32]) -> [u32; 3] {
    let mut all = [NONE; 4];
    all[..nodes.len()].copy_from_slice(nodes);
    let [a, b, c, _] = sorted(all);
    [a, b, c]
}

fn sorted(mut nodes: [u32; 4]) -> [u32; 4] {
    nodes.sort_unstable();
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::CellKind;
    use crate::geometry::meshes::kuhn::kuhn_box;

    #[test]
    fn smoothed_fem_section_8_faces_of_a_box() {
        let mesh = kuhn_box([1.0, 0.2, 0.2], [10, 2, 2]);
        let faces = mesh.faces().unwrap();
        let boundary = mesh.boundary_faces().unwrap();
        assert_eq!(boundary.len(), 2 * 2 * (10 * 2 + 10 * 2 + 2 * 2));
        assert_eq!(faces.len(), 2 * mesh.cells() + boundary.len() / 2);
        let euler =
            mesh.positions().len() as i64 - mesh.edges().len() as i64 + faces.len() as i64 - mesh.cells() as i64;
        assert_eq!(euler, 1);
        assert!(!faces.iter().any(|face| mesh.is_fold(face)));
        // 2 edges + 1 diagonal per node pair: the pattern of 951 blocks in the reference.
        assert_eq!(mesh.positions().len() + 2 * mesh.edges().len(), 951);
    }

    /// Volume by the divergence theorem: it is right only when every boundary face is seen from outside.
    #[test]
    fn boundary_faces_look_outwards() {
        let mesh = kuhn_box([1.0, 2.0, 3.0], [2, 2, 2]);
        let volume: f64 = mesh
            .boundary_faces()
            .unwrap()
            .iter()
            .map(|face| {
                let at = |i: usize| mesh.positions()[face.nodes()[i] as usize];
                crate::geometry::mesh::measure::tetrahedron_volume([[0.0; 3], at(0), at(1), at(2)])
            })
            .sum();
        assert!((volume - 6.0).abs() < 1e-14, "{volume}");
    }

    #[test]
    fn a_face_of_three_cells_is_refused_with_nodes_and_cells() {
        let places = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 1.0, 1.0]];
        let mut mesh = Mesh::new(3, places.to_vec());
        mesh.push(CellKind::Tetrahedron, &[0, 1, 2, 3]);
        mesh.push(CellKind::Tetrahedron, &[0, 2, 1, 4]);
        assert_eq!(mesh.faces().unwrap().len(), 7);
        mesh.push(CellKind::Tetrahedron, &[0, 1, 2, 5]);
        let refusal = mesh.faces().unwrap_err().to_string();
        assert!(refusal.contains("nodes 0, 1, 2 is shared by 3 cells: 0, 1, 2"), "{refusal}");
    }

    #[test]
    fn cells_on_one_side_of_their_face_are_folds() {
        let mut mesh = Mesh::new(2, vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.5, 0.4, 0.0]]);
        mesh.push(CellKind::Triangle, &[0, 1, 2]);
        mesh.push(CellKind::Triangle, &[0, 1, 3]);
        let faces = mesh.faces().unwrap();
        let folds: Vec<&Face> = faces.iter().filter(|face| mesh.is_fold(face)).collect();
        assert_eq!((folds.len(), folds[0].nodes(), folds[0].neighbour), (1, [0, 1].as_slice(), Some(1)));
    }

    #[test]
    fn faces_that_differ_in_one_node_only_do_not_join() {
        let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mut mesh = Mesh::new(3, square.iter().copied().chain(square.map(|[x, y, _]| [x, y, 1.0])).collect());
        mesh.positions.push([0.5, 0.5, -1.0]);
        mesh.push(CellKind::Hexahedron, &[0, 1, 2, 3, 4, 5, 6, 7]);
        mesh.push(CellKind::Tetrahedron, &[0, 2, 1, 8]);
        let refusal = mesh.faces().unwrap_err().to_string();
        assert!(refusal.contains("share the nodes 0, 1, 2 but differ in another: cells 0, 1"), "{refusal}");
    }
}
