//! `[springs]`: the network.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::springs::weighting::Weighting;

use super::BoxRegion;
use super::choices::names;
use super::load::Place;

/// The grouping whose groups are split while they are fitted.
pub const ADAPTIVE: &str = "adaptive";

/// `[springs]`: which springs there are and which of them share a stiffness.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Springs {
    /// Which control points are joined (`springfit list topologies`).
    #[schemars(extend("enum" = names("springs.topology")))]
    pub topology: String,
    /// Springs beside those of the topology: pairs of node numbers, from 0.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub edges: Vec<[u32; 2]>,
    /// A file with such pairs, one a line; a relative path starts at the folder of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edge_file: Option<PathBuf>,
    /// How often a spring counts (`springfit list weightings`).
    pub weighting: Weighting,
    /// How stiffness runs through a group (`springfit list profiles`): what its springs share; default constant, and
    /// inverse_square for the grouping "adaptive".
    #[schemars(extend("enum" = names("springs.profile")))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<String>,
    /// Which springs form a group (`springfit list groupings`); "length" uses `calibration.gamma`.
    #[schemars(extend("enum" = names("springs.grouping")))]
    pub grouping: String,
    /// Most groups, for a grouping that chooses their number; default 16.
    pub groups: usize,
    /// The error in percent at which the grouping "adaptive" stops splitting, above 0: that of the held-out loads, of the fitted
    /// ones where none is held out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_error: Option<f64>,
    /// Splits without a lower error of the held-out loads after which the grouping "adaptive" stops and returns to the groups
    /// with the lowest one, at least 1; absent: it does not look.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patience: Option<usize>,
    /// Parts of the body with groups of their own, for the grouping "sets": one `[[springs.sets]]` table each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sets: Vec<SpringSet>,
}

/// A part of the body: the springs between its nodes. Exactly one of face, set, box and nodes says which these are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpringSet {
    /// Name of the group.
    pub name: String,
    /// Face of the control grid: x-, x+, y-, y+, z-, z+.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<String>,
    /// Named set of nodes in the file of a mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub set: Option<String>,
    /// All nodes inside an axis-parallel box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub r#box: Option<BoxRegion>,
    /// Numbers of nodes, from 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<usize>,
}

impl SpringSet {
    /// Where its nodes are, unless their numbers are given.
    pub fn place(&self) -> Place<'_> {
        Place { face: self.face.as_deref(), set: self.set.as_deref(), region: self.r#box.as_ref() }
    }
}

impl Springs {
    /// The profile that is given, or the one that the grouping begins with.
    pub fn profile(&self) -> &str {
        let usual = if self.grouping == ADAPTIVE { "inverse_square" } else { "constant" };
        self.profile.as_deref().unwrap_or(usual)
    }
}

impl Default for Springs {
    fn default() -> Self {
        Self {
            topology: "grid".into(),
            edges: Vec::new(),
            edge_file: None,
            weighting: Weighting::default(),
            profile: None,
            grouping: "length".into(),
            groups: 16,
            max_error: None,
            patience: None,
            sets: Vec::new(),
        }
    }
}
