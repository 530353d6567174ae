//! Meshes made from a few numbers: rectangles and boxes, disks, cylinders and balls.
//!
//! Each is first built of quadrilaterals or hexahedra and, if wanted, cut into triangles or tetrahedra (`cut`). Round bodies are
//! a core and shells around it (`round`), so that cells stay well-shaped when refined. At last the body is scaled along
//! each axis to the wanted extent: a disk becomes an ellipse, a ball a spheroid.

pub mod cut;
pub mod grid;
pub mod kuhn;
pub mod round;

use super::mesh::Mesh;
use super::patch::MAX_NODES;
use crate::error::{Error, Result};

/// A meshed body in the table.
#[derive(Debug, Clone, Copy)]
pub struct MeshShape {
    /// Name in a scene.
    pub name: &'static str,
    /// What it is, in a line.
    pub doc: &'static str,
    /// Directions, 2 or 3.
    pub dimension: usize,
    /// What each number of cells counts; as many as there are.
    pub counts: &'static [&'static str],
    /// Numbers of cells when a scene does not say.
    pub default_cells: &'static [usize],
    /// Extent along each axis (m); the third is 0 in the plane.
    pub default_size: [f64; 3],
    /// Builds it in its default size from its numbers of cells.
    build: fn(&[usize]) -> Mesh,
    /// Nodes that it will have.
    nodes: fn(&[usize]) -> u128,
}

/// The bodies that can be meshed by name.
pub const MESH_SHAPES: &[MeshShape] = &[
    MeshShape {
        name: "rectangle",
        doc: "the rectangle [0, 2] x [0, 2] in quadrilaterals",
        dimension: 2,
        counts: &["along x", "along y"],
        default_cells: &[8, 8],
        default_size: [2.0, 2.0, 0.0],
        build: |n| grid::regular([2.0, 2.0, 0.0], [n[0], n[1], 0]),
        nodes: |n| points(n[0]) * points(n[1]),
    },
    MeshShape {
        name: "box",
        doc: "the box [0, 2] x [0, 2] x [0, 2] in hexahedra",
        dimension: 3,
        counts: &["along x", "along y", "along z"],
        default_cells: &[5, 5, 5],
        default_size: [2.0; 3],
        build: |n| grid::regular([2.0; 3], [n[0], n[1], n[2]]),
        nodes: |n| points(n[0]) * points(n[1]) * points(n[2]),
    },
    MeshShape {
        name: "kuhn_box",
        doc: "the box [0, 1] x [0, 0.2] x [0, 0.2] in tetrahedra around the diagonals of its cells, nodes numbered x first",
        dimension: 3,
        counts: &["along x", "along y", "along z"],
        default_cells: &[10, 2, 2],
        default_size: [1.0, 0.2, 0.2],
        build: |n| kuhn::kuhn_box([1.0, 0.2, 0.2], [n[0], n[1], n[2]]),
        nodes: |n| points(n[0]) * points(n[1]) * points(n[2]),
    },
    MeshShape {
        name: "disk",
        doc: "the disk of radius 1 around the origin in quadrilaterals",
        dimension: 2,
        counts: &["across the core", "shells around it"],
        default_cells: &[4, 2],
        default_size: [2.0, 2.0, 0.0],
        build: |n| round::disk(1.0, n[0], n[1]),
        nodes: disk_nodes,
    },
    MeshShape {
        name: "cylinder",
        doc: "the cylinder of radius 1 around z, from 0 to 2, in hexahedra",
        dimension: 3,
        counts: &["across the core", "shells around it", "along z"],
        default_cells: &[4, 2, 6],
        default_size: [2.0; 3],
        build: |n| round::cylinder(1.0, 2.0, n[0], n[1], n[2]),
        nodes: |n| disk_nodes(n) * points(n[2]),
    },
    MeshShape {
        name: "ball",
        doc: "the ball of radius 1 around the origin in hexahedra",
        dimension: 3,
        counts: &["across the core", "shells around it"],
        default_cells: &[4, 2],
        default_size: [2.0; 3],
        build: |n| round::ball(1.0, n[0], n[1]),
        nodes: |n| points(n[0]).pow(3) + (6 * (n[0] as u128).pow(2) + 2) * n[1] as u128,
    },
];

fn points(cells: usize) -> u128 {
    cells as u128 + 1
}

fn disk_nodes(n: &[usize]) -> u128 {
    points(n[0]).pow(2) + 4 * n[0] as u128 * n[1] as u128
}

impl MeshShape {
    /// The body with these numbers of cells and this extent along each axis (m), cut into triangles or tetrahedra if wanted.
    ///
    /// # Errors
    /// [`Error::Input`] (`geometry.cells`, `geometry.size`) for numbers that make no mesh, or one with too many nodes.
    pub fn mesh(&self, cells: &[usize], size: &[f64], simplices: bool) -> Result<Mesh> {
        const MOST: usize = u32::MAX as usize;
        if cells.len() != self.counts.len() || cells.iter().any(|&n| n == 0 || n > MOST) {
            let help = format!("one whole number from 1 for each of: {}", self.counts.join(", "));
            return Err(Error::input(
                "geometry.cells",
                format!("cells {cells:?} for the mesh \"{}\"", self.name),
                help,
            ));
        }
        let nodes = (self.nodes)(cells);
        if nodes > MAX_NODES as u128 {
            let message = format!("cells {cells:?} make {nodes} nodes");
            return Err(Error::input("geometry.cells", message, format!("at most {MAX_NODES} nodes in all")));
        }
        if size.len() != self.dimension || size.iter().any(|&extent| !(extent.is_finite() && extent > 0.0)) {
            let help = format!("{} positive extents in metres", self.dimension);
            return Err(Error::input("geometry.size", format!("size {size:?} for the mesh \"{}\"", self.name), help));
        }
        let mut mesh = (self.build)(cells);
        if simplices {
            mesh = cut::simplices(&mesh);
        }
        for place in mesh.positions_mut() {
            for ((x, wanted), usual) in place.iter_mut().zip(size).zip(self.default_size) {
                *x *= wanted / usual;
            }
        }
        Ok(mesh)
    }
}

/// The meshed body of that name.
///
/// # Errors
/// [`Error::Input`] (`geometry.mesh`) for a name that is not in the table.
pub fn mesh_shape(name: &str) -> Result<&'static MeshShape> {
    MESH_SHAPES.iter().find(|shape| shape.name == name).ok_or_else(|| {
        let known = MESH_SHAPES.iter().map(|shape| shape.name).collect::<Vec<_>>().join(", ");
        Error::input("geometry.mesh", format!("there is no mesh \"{name}\""), format!("one of {known}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::quality::quality;

    #[test]
    fn every_mesh_has_its_nodes_its_extent_and_no_inverted_cell() {
        for shape in MESH_SHAPES {
            for simplices in [false, true] {
                let size = [3.0, 4.0, 5.0];
                let mesh = shape.mesh(shape.default_cells, &size[..shape.dimension], simplices).unwrap();
                assert_eq!(mesh.dimension(), shape.dimension, "{}", shape.name);
                assert_eq!(mesh.positions().len() as u128, (shape.nodes)(shape.default_cells), "{}", shape.name);
                assert!((mesh.extent() - size[shape.dimension - 1]).abs() < 1e-14, "{}: {}", shape.name, mesh.extent());
                assert!(quality(&mesh).unwrap().inverted.is_empty() && mesh.faces().is_ok(), "{}", shape.name);
            }
        }
    }

    #[test]
    fn numbers_that_make_no_mesh_are_refused() {
        let refusal = |name: &str, cells: &[usize], size: &[f64]| {
            mesh_shape(name).and_then(|shape| shape.mesh(cells, size, false)).unwrap_err().to_string()
        };
        assert_eq!(refusal("cone", &[1], &[1.0]), "geometry.mesh: there is no mesh \"cone\"");
        assert_eq!(refusal("ball", &[4], &[1.0; 3]), "geometry.cells: cells [4] for the mesh \"ball\"");
        assert_eq!(refusal("disk", &[4, 0], &[1.0; 2]), "geometry.cells: cells [4, 0] for the mesh \"disk\"");
        let huge = refusal("box", &[1 << 20; 3], &[1.0; 3]);
        assert!(huge.contains("make 1152924803144876033 nodes"), "{huge}");
        assert_eq!(
            refusal("box", &[1; 3], &[1.0, 0.0, 1.0]),
            "geometry.size: size [1.0, 0.0, 1.0] for the mesh \"box\""
        );
    }
}
