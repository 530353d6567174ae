//! Meshes made from a few numbers: rectangles and boxes, disks, cylinders and balls.
//!
//! Each is first built of quadrilaterals or hexahedra and, if wanted, cut into triangles or tetrahedra (`cut`). Round bodies are
//! a core and shells around it (`round`), so that cells stay well-shaped when refined. At last the body is scaled along
//! each axis to the wanted extent: a disk becomes an ellipse, a ball a spheroid. Its sides have names (`sides`).
//!
//! The box of tetrahedra can be distorted (`kuhn`), to see what a bad mesh does to a method.

pub mod cut;
pub mod grid;
pub mod kuhn;
pub mod round;
pub mod sides;

use super::grid::Grid;
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
    /// Side that is usually held.
    pub fixed_face: &'static str,
    /// Builds it in its default size from its numbers of cells.
    build: fn(&[usize]) -> Mesh,
    /// Nodes that it will have.
    nodes: fn(&[usize]) -> u128,
    /// Its sides, from the places of the nodes in its default size.
    sides: fn(&[[f64; 3]]) -> Vec<sides::Set>,
    /// Whether its nodes are those of a grid, in the order of [`Grid`].
    on_grid: bool,
    /// Moves its nodes from their regular places: size, cells, alpha and seed.
    distort: Option<fn(&mut Mesh, [f64; 3], [usize; 3], f64, u64)>,
}

/// What a scene asks of a meshed body.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshRequest {
    /// Numbers of cells, as many as the body has counts.
    pub cells: Vec<usize>,
    /// Extent along each axis (m).
    pub size: Vec<f64>,
    /// Whether quadrilaterals and hexahedra are cut into triangles and tetrahedra.
    pub simplices: bool,
    /// How far nodes are moved, in widths of a cell, and the seed of their directions; none: not at all.
    pub distortion: Option<(f64, u64)>,
}

/// Largest distortion, in widths of a cell.
pub const MOST_DISTORTION: f64 = 1.0;

/// The bodies that can be meshed by name.
pub const MESH_SHAPES: &[MeshShape] = &[
    MeshShape {
        name: "rectangle",
        doc: "the rectangle [0, 2] x [0, 2] in quadrilaterals",
        dimension: 2,
        counts: &["along x", "along y"],
        default_cells: &[8, 8],
        default_size: [2.0, 2.0, 0.0],
        fixed_face: "x-",
        build: |n| grid::regular([2.0, 2.0, 0.0], [n[0], n[1], 0]),
        nodes: |n| points(n[0]) * points(n[1]),
        sides: |x| sides::ends(x, 0..2),
        on_grid: true,
        distort: None,
    },
    MeshShape {
        name: "box",
        doc: "the box [0, 2] x [0, 2] x [0, 2] in hexahedra",
        dimension: 3,
        counts: &["along x", "along y", "along z"],
        default_cells: &[5, 5, 5],
        default_size: [2.0; 3],
        fixed_face: "z-",
        build: |n| grid::regular([2.0; 3], [n[0], n[1], n[2]]),
        nodes: |n| points(n[0]) * points(n[1]) * points(n[2]),
        sides: |x| sides::ends(x, 0..3),
        on_grid: true,
        distort: None,
    },
    MeshShape {
        name: "kuhn_box",
        doc: "the box [0, 1] x [0, 0.2] x [0, 0.2] in tetrahedra around the diagonals of its cells, nodes numbered x first",
        dimension: 3,
        counts: &["along x", "along y", "along z"],
        default_cells: &[10, 2, 2],
        default_size: [1.0, 0.2, 0.2],
        fixed_face: "x-",
        build: |n| kuhn::kuhn_box([1.0, 0.2, 0.2], [n[0], n[1], n[2]]),
        nodes: |n| points(n[0]) * points(n[1]) * points(n[2]),
        sides: |x| sides::ends(x, 0..3),
        on_grid: false,
        distort: Some(kuhn::distort),
    },
    MeshShape {
        name: "disk",
        doc: "the disk of radius 1 around the origin in quadrilaterals",
        dimension: 2,
        counts: &["across the core", "shells around it"],
        default_cells: &[4, 2],
        default_size: [2.0, 2.0, 0.0],
        fixed_face: "x-",
        build: |n| round::disk(1.0, n[0], n[1]),
        nodes: disk_nodes,
        sides: |x| sides::round(x, 2, "rim"),
        on_grid: false,
        distort: None,
    },
    MeshShape {
        name: "cylinder",
        doc: "the cylinder of radius 1 around z, from 0 to 2, in hexahedra",
        dimension: 3,
        counts: &["across the core", "shells around it", "along z"],
        default_cells: &[4, 2, 6],
        default_size: [2.0; 3],
        fixed_face: "z-",
        build: |n| round::cylinder(1.0, 2.0, n[0], n[1], n[2]),
        nodes: |n| disk_nodes(n) * points(n[2]),
        sides: |x| [sides::round(x, 2, "side"), sides::ends(x, 2..3)].concat(),
        on_grid: false,
        distort: None,
    },
    MeshShape {
        name: "ball",
        doc: "the ball of radius 1 around the origin in hexahedra",
        dimension: 3,
        counts: &["across the core", "shells around it"],
        default_cells: &[4, 2],
        default_size: [2.0; 3],
        fixed_face: "z-",
        build: |n| round::ball(1.0, n[0], n[1]),
        nodes: |n| points(n[0]).pow(3) + (6 * (n[0] as u128).pow(2) + 2) * n[1] as u128,
        sides: |x| sides::round(x, 3, "surface"),
        on_grid: false,
        distort: None,
    },
];

fn points(cells: usize) -> u128 {
    cells as u128 + 1
}

fn disk_nodes(n: &[usize]) -> u128 {
    points(n[0]).pow(2) + 4 * n[0] as u128 * n[1] as u128
}

impl MeshShape {
    /// The request that a scene without numbers makes.
    pub fn default_request(&self) -> MeshRequest {
        MeshRequest {
            cells: self.default_cells.to_vec(),
            size: self.default_size[..self.dimension].to_vec(),
            simplices: false,
            distortion: None,
        }
    }

    /// Whether it can be distorted.
    pub fn distorts(&self) -> bool {
        self.distort.is_some()
    }

    /// The body with these numbers of cells and this extent along each axis, cut into triangles or tetrahedra if wanted.
    ///
    /// # Errors
    /// [`Error::Input`] (`geometry.cells`, `geometry.size`, `geometry.distortion`) for numbers that make no mesh, or one with
    /// too many nodes.
    pub fn mesh(&self, request: &MeshRequest) -> Result<Mesh> {
        self.check(request)?;
        let MeshRequest { cells, size, simplices, distortion } = request;
        let mut mesh = (self.build)(cells);
        if *simplices {
            mesh = cut::simplices(&mesh);
        }
        for place in mesh.positions_mut() {
            for ((x, wanted), usual) in place.iter_mut().zip(size).zip(self.default_size) {
                *x *= wanted / usual;
            }
        }
        if let (Some(distort), &Some((alpha, seed))) = (self.distort, distortion) {
            let (mut extent, mut counts) = ([0.0; 3], [0; 3]);
            extent.iter_mut().zip(size).for_each(|(extent, size)| *extent = *size);
            counts.iter_mut().zip(cells).for_each(|(count, cells)| *count = *cells);
            distort(&mut mesh, extent, counts, alpha, seed);
        }
        Ok(mesh)
    }

    /// Nodes of a mesh with these numbers of cells, as many as there are counts.
    pub fn nodes(&self, cells: &[usize]) -> u128 {
        (self.nodes)(cells)
    }

    /// Checks the numbers of a request.
    ///
    /// # Errors
    /// As [`MeshShape::mesh`].
    pub fn check(&self, MeshRequest { cells, size, distortion, .. }: &MeshRequest) -> Result<()> {
        const MOST: usize = u32::MAX as usize;
        if cells.len() != self.counts.len() || cells.iter().any(|&n| n == 0 || n > MOST) {
            let help = format!("one whole number from 1 for each of: {}", self.counts.join(", "));
            let message = format!("cells {cells:?} for the mesh \"{}\"", self.name);
            return Err(Error::input("geometry.cells", message, help));
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
        let Some((alpha, _)) = distortion else { return Ok(()) };
        if !self.distorts() {
            let able: Vec<&str> = MESH_SHAPES.iter().filter(|shape| shape.distorts()).map(|shape| shape.name).collect();
            let help = format!("remove it; it is for {}", able.join(", "));
            let message = format!("the mesh \"{}\" cannot be distorted", self.name);
            return Err(Error::input("geometry.distortion", message, help));
        }
        if !(0.0..=MOST_DISTORTION).contains(alpha) {
            let help =
                format!("a number from 0 to {MOST_DISTORTION}: the share of a cell's width that a node is moved by");
            return Err(Error::input("geometry.distortion.alpha", format!("{alpha} is out of range"), help));
        }
        Ok(())
    }

    /// Its sides as named sets of nodes: ends of a flat body, parts of a round surface (`sides`); `size` is that of the mesh.
    ///
    /// # Panics
    /// When `size` has another length than the body has directions.
    pub fn sides(&self, mesh: &Mesh, size: &[f64]) -> Vec<sides::Set> {
        assert_eq!(size.len(), self.dimension, "one extent a direction");
        let usual = |x: &[f64; 3]| {
            let mut place = *x;
            for ((x, size), usual) in place.iter_mut().zip(size).zip(self.default_size) {
                *x *= usual / size;
            }
            place
        };
        (self.sides)(&mesh.positions().iter().map(usual).collect::<Vec<_>>())
    }

    /// The grid that the nodes of a mesh with so many cells lie on, if they do.
    pub fn grid(&self, cells: &[usize]) -> Option<Grid> {
        self.on_grid.then(|| Grid::new(&cells.iter().map(|n| n + 1).collect::<Vec<_>>()))
    }
}

/// The meshed body of that name.
pub fn find(name: &str) -> Option<&'static MeshShape> {
    MESH_SHAPES.iter().find(|shape| shape.name == name)
}

#[cfg(test)]
mod tests;
