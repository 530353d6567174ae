//! What the body of a scene is made of: the patch of a shape or a file, or a mesh with the method of its elements.
//!
//! A patch under a method for meshes becomes a grid of nodes on the body, cut into the cells of the method
//! ([`mod@crate::geometry::grid_mesh`]); `geometry.control_points` says how many nodes there are. A meshed shape
//! ([`crate::geometry::meshes`]) has its own cells, which a method for triangles or tetrahedra cuts; its sides are named sets.

use std::path::Path;

use crate::error::{Error, Result};
use crate::export;
use crate::geometry::grid::Grid;
use crate::geometry::grid_mesh::mesh_of_grid;
use crate::geometry::mesh::{CellKind, Mesh};
use crate::geometry::mesh_files::{self, MESH_FORMATS, MeshFile};
use crate::geometry::meshes::MeshShape;
use crate::geometry::patch::Patch;
use crate::geometry::shapes::{self, Shape, ShapeRequest};
use crate::geometry::{file, selection};
use crate::reference::locking::Spans;
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
        /// Named sets of nodes: those of the file of the mesh, or the sides of a meshed shape.
        sets: Vec<(String, Vec<u32>)>,
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

    /// The mesh, if it is one.
    pub fn mesh(&self) -> Option<&Mesh> {
        match self {
            Self::Splines { .. } => None,
            Self::Elements { mesh, .. } => Some(mesh),
        }
    }

    /// What its method works on.
    pub fn spans(&self) -> Spans<'_> {
        match self {
            Self::Splines { patch, .. } => Spans::Patch(patch),
            Self::Elements { mesh, .. } => Spans::Cells(mesh),
        }
    }

    /// The grid of the nodes; a mesh from a file has none.
    pub fn grid(&self) -> Option<Grid> {
        match self {
            Self::Splines { patch, .. } => Some(patch.grid()),
            Self::Elements { grid, .. } => *grid,
        }
    }

    /// The named sets of nodes.
    fn sets(&self) -> &[(String, Vec<u32>)] {
        match self {
            Self::Splines { .. } => &[],
            Self::Elements { sets, .. } => sets,
        }
    }

    /// The nodes of a face, ascending: the set of this name, else a face of the grid; `key` is the scene key that asks.
    ///
    /// # Errors
    /// [`Error::Input`] at `key` for a face that is not there.
    pub fn face_nodes(&self, face: &str, key: &str) -> Result<Vec<u32>> {
        if let Some((_, nodes)) = self.sets().iter().find(|(set, _)| set == face) {
            return Ok(nodes.clone());
        }
        let grid = self.grid().ok_or_else(|| {
            let help = "name a set of nodes of the file, or give a box";
            Error::input(key, format!("a mesh from a file has no face \"{face}\""), help)
        })?;
        selection::face_nodes(&grid, face)
    }

    /// The nodes of a named set, ascending; `key` is the scene key that asks.
    ///
    /// # Errors
    /// [`Error::Input`] at `key` with the sets that there are.
    pub fn set_nodes(&self, name: &str, key: &str) -> Result<Vec<u32>> {
        let sets = self.sets();
        if let Some((_, nodes)) = sets.iter().find(|(set, _)| set == name) {
            return Ok(nodes.clone());
        }
        let names: Vec<&str> = sets.iter().map(|(set, _)| set.as_str()).collect();
        let help = match names.is_empty() {
            true => "the body has no named sets; they come from the file of a mesh, or from a shape that is a mesh"
                .to_owned(),
            false => format!("the sets of the body are {}", names.join(", ")),
        };
        Err(Error::input(key, format!("there is no set \"{name}\""), help))
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

/// The body of a scene, its method, and what the reader of a mesh has to say.
pub struct Built {
    /// The body.
    pub continuum: Continuum,
    /// Its method.
    pub method: &'static Method,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// The body of a scene and its method.
///
/// # Errors
/// [`Error::Input`] at the key that does not fit; [`Error::File`] for a file that cannot be read.
pub fn build(scene: &Scene) -> Result<Built> {
    let named = scene.reference.method.as_deref().map(known_method).transpose()?;
    let or_default = |named: Option<&'static Method>| named.map_or_else(|| known_method(DEFAULT_METHOD), Ok);
    let (continuum, method) = match (&scene.geometry.file, scene.geometry.known_mesh()) {
        (Some(path), _) if mesh_files::reads(path) => return mesh_file(path, named),
        (Some(path), _) => patch_file(path, or_default(named)?)?,
        (None, Some(meshed)) => mesh_shape(scene, meshed, named)?,
        (None, None) => shape(scene, or_default(named)?)?,
    };
    Ok(Built { continuum, method, warnings: Vec::new() })
}

fn known_method(name: &str) -> Result<&'static Method> {
    methods::find(name).ok_or_else(|| {
        Error::input("reference.method", format!("there is no method {name:?}"), "see `springfit list methods`")
    })
}

/// A mesh with the method that is named, or the one that takes its cells.
fn mesh_file(path: &Path, named: Option<&'static Method>) -> Result<Built> {
    let MeshFile { mesh, sets, warnings } = mesh_files::read(path)?;
    let (method, points) = method_for(&mesh, named, "the file holds a mesh")?;
    Ok(Built { continuum: Continuum::Elements { mesh, grid: None, sets, points }, method, warnings })
}

/// The method that is named, or the one that takes the cells of a mesh; `because` says why a method for patches is wrong.
fn method_for(mesh: &Mesh, named: Option<&'static Method>, because: &str) -> Result<(&'static Method, MeshPoints)> {
    let method = named.unwrap_or_else(|| methods::default_for(mesh));
    let MethodBody::Mesh { points, .. } = method.body else {
        let message = format!("\"{}\" works on patches, and {because}", method.name);
        let help = format!("leave it out, or use \"{}\"", methods::default_for(mesh).name);
        return Err(Error::input("reference.method", message, help));
    };
    method.check(mesh)?;
    Ok((method, points))
}

/// A meshed shape, cut into simplices for a method that takes no other cells.
fn mesh_shape(
    scene: &Scene,
    shape: &MeshShape,
    named: Option<&'static Method>,
) -> Result<(Continuum, &'static Method)> {
    named.map_or(Ok(()), |method| scene::check_method(method, shape.dimension))?;
    let mut request = scene.geometry.mesh_request(shape);
    let cell = named.and_then(Method::cell);
    request.simplices = cell.is_some_and(|cell| matches!(cell, CellKind::Triangle | CellKind::Tetrahedron));
    let mesh = shape.mesh(&request)?;
    let (method, points) = method_for(&mesh, named, &format!("the shape \"{}\" is a mesh", shape.name))?;
    let (sets, grid) = (shape.sides(&mesh, &request.size), shape.grid(&request.cells));
    Ok((Continuum::Elements { mesh, grid, sets, points }, method))
}

fn patch_file(path: &Path, method: &'static Method) -> Result<(Continuum, &'static Method)> {
    match method.body {
        MethodBody::Patch(points) => Ok((Continuum::Splines { patch: file::read_patch(path)?, points }, method)),
        MethodBody::Mesh { .. } => {
            let message = format!("\"{}\" works on meshes, and the file is none", method.name);
            let known: Vec<String> = MESH_FORMATS.iter().map(|format| format!(".{}", format.extension)).collect();
            let help = format!("use \"iga\" for a patch; files of meshes end in {}", known.join(", "));
            Err(Error::input("reference.method", message, help))
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
            Continuum::Elements {
                mesh: mesh_of_grid(&grid, positions, cells[0]),
                grid: Some(grid),
                sets: vec![],
                points,
            }
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
