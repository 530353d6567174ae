//! `[springs]`: the network.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::springs::weighting::{Law, Weighting};

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
    /// What the springs of a group share.
    pub law: Law,
    /// Which springs form a group (`springfit list groupings`); "length" uses `calibration.gamma`.
    #[schemars(extend("enum" = names("springs.grouping")))]
    pub grouping: String,
}

impl Default for Springs {
    fn default() -> Self {
        Self {
            topology: "grid".into(),
            weighting: Weighting::default(),
            law: Law::default(),
            grouping: "length".into(),
        }
    }
}
