//! `[solver]`: how the springs are solved while their stiffness is sought.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::springs::solver::{Path, Settings};

/// `[solver]`: how the springs are solved during the search; what it finds is always confirmed by a direct solve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Solver {
    /// Which factor serves an evaluation.
    pub path: Path,
    /// Largest relative residual of an iterative solution, 1e-14 to 1e-6; a direct one is accurate to rounding.
    pub tolerance: f64,
}

impl Default for Solver {
    fn default() -> Self {
        let Settings { path, tolerance } = Settings::default();
        Self { path, tolerance }
    }
}
