//! The body: `[geometry]` and `[material]`.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::meshes::{self, MeshRequest, MeshShape};
use crate::geometry::shapes::{self, Shape};

use super::choices::names;

/// `[geometry]`: a shape by name, or a patch or a mesh from a file; exactly one of the two.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Geometry {
    /// Name of a shape (`springfit list shapes`): a patch with control points, or a mesh with cells.
    #[schemars(extend("enum" = names("geometry.shape")))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<String>,
    /// A patch (.json) or a mesh (.msh, .vtk, .node, .ele); a relative path starts at the folder of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Extents of the shape along x, y (and z) in m; default: those of the shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<Vec<f64>>,
    /// Control points (nodes of finite elements) along each grid direction; default: those of the shape. Finer grids refine
    /// the same body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control_points: Option<Vec<usize>>,
    /// Numbers of cells of a mesh, as many as its shape has counts (`springfit list shapes`); default: those of the shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<Vec<usize>>,
    /// Moves the nodes of a mesh from their regular places at random; for `kuhn_box`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Distortion>,
    /// Polynomial degree along each grid direction, 1 to 9; default: that of the shape. Not for finite elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub degree: Option<Vec<usize>>,
    /// Joins control points at equal positions, as at the seam of the torus; default false: the body is slit there.
    pub merge_seam: bool,
}

impl Geometry {
    /// The entry of the shape table, if a shape is given and known.
    pub fn known_shape(&self) -> Option<&'static Shape> {
        self.shape.as_deref().and_then(shapes::find)
    }

    /// The entry of the table of meshed bodies, if one is given and known.
    pub fn known_mesh(&self) -> Option<&'static MeshShape> {
        self.shape.as_deref().and_then(meshes::find)
    }

    /// What the scene asks of a meshed body, with the defaults of the shape where it says nothing; its cells not cut.
    pub fn mesh_request(&self, shape: &MeshShape) -> MeshRequest {
        let usual = shape.default_request();
        MeshRequest {
            cells: self.cells.clone().unwrap_or(usual.cells),
            size: self.size.clone().unwrap_or(usual.size),
            simplices: usual.simplices,
            distortion: self.distortion.as_ref().map(|distortion| (distortion.alpha, distortion.seed)),
        }
    }
}

/// Nodes moved from their regular places, each along every axis by a random share of a cell's width; those on the boundary stay
/// in it, and no cell is inverted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Distortion {
    /// Largest share of a cell's width that a node is moved by, 0 to 1.
    pub alpha: f64,
    /// Seed of the random numbers; default 1.
    #[serde(default = "first_seed")]
    pub seed: u64,
}

fn first_seed() -> u64 {
    1
}

/// `[material]`: isotropic linear elasticity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus E in Pa, above 0.
    pub young: f64,
    /// Poisson's ratio, above -1 and below 0.5; plane stress allows 0.5.
    pub poisson: f64,
    /// Mass density in kg/m^3, above 0; needed by `[dynamics]` only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
}

/// An axis-parallel box, its faces included.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxRegion {
    /// Smallest coordinates in m.
    pub min: Vec<f64>,
    /// Largest coordinates in m.
    pub max: Vec<f64>,
}

/// A coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The first component.
    X,
    /// The second component.
    Y,
    /// The third component, in 3D only.
    Z,
}

impl Axis {
    /// All three, in order.
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// Index of the component: 0, 1, 2.
    pub fn index(self) -> usize {
        self as usize
    }
}
