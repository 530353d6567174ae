//! `[[load]]`: one table a load case.
//!
//! Besides loads of engineering (tractions, body forces, point forces) there are load fields that try a network from all
//! sides: torsion, bending, radial and random smooth forces on the control points (see
//! [`crate::reference::load_fields`]), and forces from a file.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Axis, BoxRegion};

/// A load case: exactly one kind of load (`force_per_node`, `traction`, `body_force`, `point`, `patch`, `torsion`,
/// `bending`, `radial`, `random_smooth`, `file`).
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
    /// A force shared equally by the free control points of a face, of a set or inside a box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patch: Option<PatchForce>,
    /// Forces on all control points that turn the body about an axis through its centre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion: Option<Torsion>,
    /// Forces on all control points that bend the body: along one axis, growing linearly along another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending: Option<Bending>,
    /// Force in N on a control point 1 m from the centre, away from it; in proportion to the distance elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radial: Option<f64>,
    /// Random forces that vary smoothly over the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub random_smooth: Option<RandomSmooth>,
    /// A JSON file with a force in N for every control point; a relative path starts at the folder of the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The body in `file`, if it holds several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// The case in `file`, if it holds several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub case: Option<String>,
    /// Largest displacement of the continuum (a corotational one linearised at rest) in m that the load is scaled to; absent:
    /// the load is taken as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_displacement: Option<f64>,
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

/// A force shared equally by the free control points of a face, of a set or inside a box; exactly one of the three.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchForce {
    /// Face of the control grid: x-, x+, y-, y+, z-, z+.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<String>,
    /// Named set of nodes of a mesh file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub set: Option<String>,
    /// All control points inside an axis-parallel box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub r#box: Option<BoxRegion>,
    /// The whole force in N, one component a direction of space.
    pub force: Vec<f64>,
}

/// Forces on all control points that turn the body about an axis through its centre.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Torsion {
    /// The axis; default z, the only one in 2D.
    #[serde(default = "z")]
    pub axis: Axis,
    /// Force in N on a control point 1 m from the axis; default 1.
    #[serde(default = "one")]
    pub force: f64,
}

/// Forces on all control points that bend the body: along one axis, growing linearly along another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bending {
    /// The axis along which the force grows, zero at the centre.
    pub along: Axis,
    /// The direction of the force.
    pub direction: Axis,
    /// Force in N on a control point 1 m from the centre; default 1.
    #[serde(default = "one")]
    pub force: f64,
}

/// Random forces that vary smoothly over the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomSmooth {
    /// Seed of the field; the same seed gives the same field.
    pub seed: u64,
    /// Root mean square of a component of the force in N, over all fields; default 1.
    #[serde(default = "one")]
    pub force: f64,
}

/// Where a traction or a patch load acts: one of a face, a named set of a mesh file and a box.
#[derive(Debug, Clone, Copy)]
pub struct Place<'a> {
    /// Face of the control grid.
    pub face: Option<&'a str>,
    /// Named set of nodes.
    pub set: Option<&'a str>,
    /// Axis-parallel box.
    pub region: Option<&'a BoxRegion>,
}

impl Traction {
    /// Where it acts.
    pub fn place(&self) -> Place<'_> {
        Place { face: self.face.as_deref(), set: self.set.as_deref(), region: self.r#box.as_ref() }
    }
}

impl PatchForce {
    /// Where it acts.
    pub fn place(&self) -> Place<'_> {
        Place { face: self.face.as_deref(), set: self.set.as_deref(), region: self.r#box.as_ref() }
    }
}

/// The names of the kinds of load, as they are written in a scene.
pub(super) const LOAD_KINDS: [&str; 10] = [
    "force_per_node",
    "traction",
    "body_force",
    "point",
    "patch",
    "torsion",
    "bending",
    "radial",
    "random_smooth",
    "file",
];

impl Load {
    /// A fitted case without a kind of load yet.
    fn empty() -> Self {
        Self {
            name: None,
            fit: true,
            force_per_node: None,
            traction: None,
            body_force: None,
            point: None,
            patch: None,
            torsion: None,
            bending: None,
            radial: None,
            random_smooth: None,
            file: None,
            body: None,
            case: None,
            max_displacement: None,
        }
    }

    /// A fitted case with the same force in N on every free control point.
    pub fn force_per_node(force: Vec<f64>) -> Self {
        Self { force_per_node: Some(force), ..Self::empty() }
    }

    /// The vector of the load, and its key inside the load table; `None` when the kind has none.
    ///
    /// N, Pa or N/m^3 according to the kind; when several kinds are given, the first in the order of
    /// `force_per_node`, `traction`, `body_force`, `point`, `patch`.
    pub fn vector(&self) -> Option<(&'static str, &[f64])> {
        None.or(self.force_per_node.as_ref().map(|force| ("force_per_node", force.as_slice())))
            .or(self.traction.as_ref().map(|traction| ("traction.value", traction.value.as_slice())))
            .or(self.body_force.as_ref().map(|force| ("body_force", force.as_slice())))
            .or(self.point.as_ref().map(|point| ("point.force", point.force.as_slice())))
            .or(self.patch.as_ref().map(|patch| ("patch.force", patch.force.as_slice())))
    }

    /// The strength of a load field, and its key inside the load table; `None` when the load is none.
    pub fn strength(&self) -> Option<(&'static str, f64)> {
        None.or(self.torsion.as_ref().map(|torsion| ("torsion.force", torsion.force)))
            .or(self.bending.as_ref().map(|bending| ("bending.force", bending.force)))
            .or(self.radial.map(|force| ("radial", force)))
            .or(self.random_smooth.as_ref().map(|random| ("random_smooth.force", random.force)))
    }

    /// The places that the load names, with their keys inside the load table.
    pub(super) fn places(&self) -> Vec<(&'static str, Place<'_>)> {
        let traction = self.traction.iter().map(|traction| ("traction", traction.place()));
        traction.chain(self.patch.iter().map(|patch| ("patch", patch.place()))).collect()
    }

    /// The axes that the load names, with their keys inside the load table.
    pub(super) fn axes(&self) -> Vec<(&'static str, Axis)> {
        let torsion = self.torsion.iter().map(|torsion| ("torsion.axis", torsion.axis));
        let bending = self.bending.iter();
        let bending = bending.flat_map(|b| [("bending.along", b.along), ("bending.direction", b.direction)]);
        torsion.chain(bending).collect()
    }

    /// The kinds of load this table names.
    pub(super) fn kinds(&self) -> Vec<&'static str> {
        let given = [
            self.force_per_node.is_some(),
            self.traction.is_some(),
            self.body_force.is_some(),
            self.point.is_some(),
            self.patch.is_some(),
            self.torsion.is_some(),
            self.bending.is_some(),
            self.radial.is_some(),
            self.random_smooth.is_some(),
            self.file.is_some(),
        ];
        LOAD_KINDS.into_iter().zip(given).filter(|&(_, given)| given).map(|(kind, _)| kind).collect()
    }
}

fn fitted() -> bool {
    true
}

fn one() -> f64 {
    1.0
}

fn z() -> Axis {
    Axis::Z
}
