//! `[budget]`: how wrong the network may be, and how long a step of it may take.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[budget]`: the cheapest network that meets it is built, whatever `geometry.control_points` says; absent: no search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Largest e_rms in percent, over the load cases that are held out (over the fitted ones where none is held out).
    pub max_error: f64,
    /// Largest time in s for one explicit step of the network on this machine, with all threads; absent: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_time: Option<f64>,
    /// The finest grid of control points that is tried; default: `geometry.control_points`, or without it twice the spans of
    /// the shape's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finest: Option<Vec<usize>>,
}
