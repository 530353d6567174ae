//! `[converged]`: the body once more on a finer mesh, to tell the error of the springs from that of the mesh.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[converged]`: a finer solution of the same body under the same loads that all errors are measured against as well.
/// Absent: none is computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Converged {
    /// How often every knot span is halved, 0 to 4.
    pub halvings: usize,
    /// How much every degree is raised, 0 to 4; at least one of the two is above 0.
    pub elevations: usize,
}

impl Default for Converged {
    fn default() -> Self {
        Self { halvings: 1, elevations: 1 }
    }
}
