//! `[springs]`: the network.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::springs::weighting::Weighting;

use super::choices::names;

/// `[springs]`: which springs there are and which of them share a stiffness.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Springs {
    /// Which control points are joined (`springfit list topologies`).
    #[schemars(extend("enum" = names("springs.topology")))]
    pub topology: String,
    /// How often a spring counts.
    pub weighting: Weighting,
    /// How stiffness runs through a group (`springfit list profiles`): what its springs share.
    #[schemars(extend("enum" = names("springs.profile")))]
    pub profile: String,
    /// Which springs form a group (`springfit list groupings`); "length" uses `calibration.gamma`.
    #[schemars(extend("enum" = names("springs.grouping")))]
    pub grouping: String,
    /// Most groups, for a grouping that chooses their number; default 16.
    pub groups: usize,
}

impl Default for Springs {
    fn default() -> Self {
        Self {
            topology: "grid".into(),
            weighting: Weighting::default(),
            profile: "constant".into(),
            grouping: "length".into(),
            groups: 16,
        }
    }
}
