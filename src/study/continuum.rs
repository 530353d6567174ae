//! What the body of a scene is made of: the patch of a shape or a file, or a mesh with the method of its elements.
//!
//! A shape under a method for meshes becomes a grid of nodes on the body, cut into the cells of the method
//! ([`mod@crate::geometry::grid_mesh`]); `geometry.control_points` says how many nodes there are.

use std::path::Path;

use crate::error::{Error, Result};
use crate::export;
use crate::geometry::file;
use crate::geometry::grid::Grid;
use crate::geometry::grid_mesh::mesh_of_grid;
use crate::geometry::mesh::Mesh;
use crate::geometry::patch::Patch;
use crate::geometry::shapes::{self, Shape, ShapeRequest};
use crate::reference::methods::{self, MeshPoints, Method, MethodBody, PatchPoints};
use crate::scene::{self, Scene};

/// The method of a body when neither the scene nor a mesh says another.
const DEFAULT_METHOD: &str = "iga";

/// The nodes of a body and what joins them.
pub enum Continuum {
    /// A patch: nodes are its control points.
    Splines {
        /// The patch.
        patch: Patch,
        /// How the method fills its integration points.
        points: PatchPoints,
    },
    /// A mesh: nodes are its nodes.
    Elements {
        /// The mesh.
        mesh: Mesh,
        /// The grid that its nodes lie on, if there is one.
        grid: Option<Grid>,
        /// How the method fills its integration points.
        points: MeshPoints,
    },
}

impl Continuum {
    /// Directions, 2 or 3.
    pub fn dimension(&self) -> usize {
        match self {
            Self::Splines { patch, .. } => patch.dimension(),
            Self::Elements { mesh, .. } => mesh.dimension(),
        }
    }

    /// Places of the nodes, m.
    pub fn positions(&self) -> &[[f64; 3]] {
        match self {
            Self::Splines { patch, .. } => patch.points(),
            Self::Elements { mesh, .. } => mesh.positions(),
        }
    }

    /// The grid of the nodes; a mesh from a file has none.
    pub fn grid(&self) -> Option<Grid> {
        match self {
            Self::Splines { patch, .. } => Some(patch.grid()),
            Self::Elements { grid, .. } => *grid,
        }
    }

    /// Largest difference of the grid indices of two nodes that act in one element.
    pub fn reach(&self) -> usize {
        match self {
            Self::Splines { patch, .. } => patch.degree().into_iter().max().unwrap_or(1),
            Self::Elements { .. } => 1,
        }
    }

    /// The body as the exporters take it.
    pub fn exported(&self) -> export::Body<'_> {
        match self {
            Self::Splines { patch, .. } => export::Body::Patch(patch),
            Self::Elements { mesh, .. } => export::Body::Mesh(mesh),
        }
    }

    /// Number of knot spans or cells.
    pub fn elements(&self) -> usize {
        match self {
            Self::Splines { patch, .. } => patch.elements().len(),
            Self::Elements { mesh, .. } => mesh.cells(),
        }
    }
}

/// The body of a scene and its method.
///
/// # Errors
/// [`Error::Input`] at the key that does not fit; [`Error::File`] for a file that cannot be read.
pub fn build(scene: &Scene) -> Result<(Continuum, &'static Method)> {
    let named = scene.reference.method.as_deref().map(known_method).transpose()?;
    match &scene.geometry.file {
        Some(path) => patch_file(path, named),
        None => shape(scene, named.map_or_else(|| known_method(DEFAULT_METHOD), Ok)?),
    }
}

fn known_method(name: &str) -> Result<&'static Method> {
    methods::find(name).ok_or_else(|| {
        Error::input("reference.method", format!("there is no method {name:?}"), "see `springfit list methods`")
    })
}

fn patch_file(path: &Path, named: Option<&'static Method>) -> Result<(Continuum, &'static Method)> {
    let method = named.map_or_else(|| known_method(DEFAULT_METHOD), Ok)?;
    match method.body {
        MethodBody::Patch(points) => Ok((Continuum::Splines { patch: file::read_patch(path)?, points }, method)),
        MethodBody::Mesh { .. } => {
            let message = format!("\"{}\" works on meshes, and the file holds a patch", method.name);
            Err(Error::input("reference.method", message, "use \"iga\", or a file with a mesh"))
        }
    }
}

fn shape(scene: &Scene, method: &'static Method) -> Result<(Continuum, &'static Method)> {
    let geometry = &scene.geometry;
    let name = geometry.shape.as_deref().unwrap_or_default();
    let shape = shapes::find(name).ok_or_else(|| {
        Error::input("geometry.shape", format!("there is no shape {name:?}"), "see `springfit list shapes`")
    })?;
    scene::check_method(method, shape.dimension)?;
    let request = request(geometry, shape);
    let continuum = match method.body {
        MethodBody::Patch(points) => Continuum::Splines { patch: (shape.build)(&request)?, points },
        MethodBody::Mesh { cells, points } => {
            let positions = shape.nodes(&request)?;
            let grid = Grid::new(&request.control_points);
            Continuum::Elements { mesh: mesh_of_grid(&grid, positions, cells[0]), grid: Some(grid), points }
        }
    };
    Ok((continuum, method))
}

/// The request of a scene, with the defaults of the shape where it says nothing.
fn request(geometry: &scene::Geometry, shape: &Shape) -> ShapeRequest {
    let default = shape.default_request();
    ShapeRequest {
        control_points: geometry.control_points.clone().unwrap_or(default.control_points),
        degree: geometry.degree.clone().unwrap_or(default.degree),
        size: geometry.size.clone().unwrap_or(default.size),
    }
}
