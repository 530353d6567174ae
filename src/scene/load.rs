//! `[[load]]`: one table a load case.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::BoxRegion;

/// A load case: exactly one of `force_per_node`, `traction`, `body_force` and `point`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Name of the load case in the result; default `load N`, counted from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Whether the springs are fitted to this case; false: it is held out, and only its error is reported.
    #[serde(default = "fitted")]
    pub fit: bool,
    /// The same force in N on every free control point, one component a direction of space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_per_node: Option<Vec<f64>>,
    /// A constant force per area on a part of the boundary.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction: Option<Traction>,
    /// A constant force per volume in N/m^3, such as density times gravity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_force: Option<Vec<f64>>,
    /// A force on one control point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<PointForce>,
}

/// A constant force per area on a part of the boundary: a face, and for finite elements also a set or a box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Traction {
    /// Face of the grid: x-, x+, y-, y+, z-, z+.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<String>,
    /// Named set of nodes in the file of a mesh: the sides of cells between its nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub set: Option<String>,
    /// The sides of cells whose corners lie in an axis-parallel box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub r#box: Option<BoxRegion>,
    /// Force per area in Pa, one component a direction of space; in 2D the area is edge length times thickness.
    pub value: Vec<f64>,
}

/// A force on one control point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointForce {
    /// Number of the control point, from 0 in C order of the control grid (last index fastest).
    pub node: usize,
    /// Force in N, one component a direction of space.
    pub force: Vec<f64>,
}

/// The names of the kinds of load, as they are written in a scene.
pub(super) const LOAD_KINDS: [&str; 4] = ["force_per_node", "traction", "body_force", "point"];

impl Load {
    /// A fitted case with the same force in N on every free control point.
    pub fn force_per_node(force: Vec<f64>) -> Self {
        Self { name: None, fit: true, force_per_node: Some(force), traction: None, body_force: None, point: None }
    }

    /// The vector of the load, and its key inside the load table; `None` when the table names no kind.
    ///
    /// N, Pa or N/m^3 according to the kind; when several kinds are given, the first in the order of
    /// `force_per_node`, `traction`, `body_force`, `point`.
    pub fn vector(&self) -> Option<(&'static str, &[f64])> {
        None.or(self.force_per_node.as_ref().map(|force| ("force_per_node", force.as_slice())))
            .or(self.traction.as_ref().map(|traction| ("traction.value", traction.value.as_slice())))
            .or(self.body_force.as_ref().map(|force| ("body_force", force.as_slice())))
            .or(self.point.as_ref().map(|point| ("point.force", point.force.as_slice())))
    }

    /// The kinds of load this table names.
    pub(super) fn kinds(&self) -> Vec<&'static str> {
        let given =
            [self.force_per_node.is_some(), self.traction.is_some(), self.body_force.is_some(), self.point.is_some()];
        LOAD_KINDS.into_iter().zip(given).filter(|&(_, given)| given).map(|(kind, _)| kind).collect()
    }
}

fn fitted() -> bool {
    true
}
