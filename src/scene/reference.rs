//! `[reference]`: the continuum model that the springs are compared with.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::choices::names;

/// `[reference]`: method and plane of the continuum model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Reference {
    /// Method of the continuum model (`springfit list methods`); default: iga for patches, elements that fit for meshes.
    #[schemars(extend("enum" = names("reference.method")))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// Plane assumption of a body in 2D; default stress. Not for 3D.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<Plane>,
    /// Thickness of a body in 2D in m, above 0; default 1. Not for 3D.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f64>,
    /// Gauss points per direction and knot span beyond degree + 1, 0 to 32; more for strongly rational patches. Not for finite elements.
    pub extra_gauss_points: usize,
    /// How far the continuum may turn and bend: linear, or corotational (linear triangles and tetrahedra, smoothed or not).
    pub kinematics: Kinematics,
    /// Equal steps in which the loads of a corotational continuum grow, 1 to 1000.
    pub load_steps: usize,
}

impl Default for Reference {
    fn default() -> Self {
        Self {
            method: None,
            plane: None,
            thickness: None,
            extra_gauss_points: 0,
            kinematics: Kinematics::Linear,
            load_steps: 4,
        }
    }
}

/// What displacements a continuum can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kinematics {
    /// Small ones: forces in proportion to displacements.
    Linear,
    /// Small strains in axes that turn with the body: any turn, and large bending.
    Corotational,
}

/// What a body in 2D does across its thickness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Plane {
    /// Free to contract: thin sheets.
    Stress,
    /// Held: long prisms.
    Strain,
}
