//! The body: `[geometry]`, `[material]` and `[support]`.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::shapes::{self, Shape};

use super::choices::names;

/// `[geometry]`: a shape by name, or a patch or a mesh from a file; exactly one of the two.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Geometry {
    /// Name of a shape (`springfit list shapes`).
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

/// `[support]`: the held control points are all that a face, a number or the box names.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Support {
    /// Faces of the control grid: "x-" has the first index of the first direction, "x+" the last; y and z likewise.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faces: Vec<String>,
    /// Numbers of control points, from 0 in C order of the control grid (last index fastest).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<usize>,
    /// Named sets of nodes in the file of a mesh, such as Gmsh's physical groups.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sets: Vec<String>,
    /// All control points inside an axis-parallel box.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r#box: Option<BoxRegion>,
    /// Components that are held; default: all that the body has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub components: Option<Vec<Axis>>,
    /// Holds the rigid motions that the rest leaves free, by as few components as it takes (six of a free solid); default
    /// false: a body that can move as a whole is an error.
    pub fix_rigid: bool,
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
