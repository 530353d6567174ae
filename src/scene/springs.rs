//! `[springs]` and `[dynamics]`: the network, its masses and its damping.

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

/// `[dynamics]`: what is computed for a later time integration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Dynamics {
    /// How the mass of the body is shared among the control points; needs `material.density`.
    pub masses: Masses,
    /// Damping constant alpha of (4.18) in s, above 0: c = 2 sqrt(k (m_i + m_j)) / (alpha l0); absent: no damping.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// Time integrator the network is meant for (`springfit list integrators`).
    #[schemars(extend("enum" = names("dynamics.integrator")))]
    pub integrator: String,
}

impl Default for Dynamics {
    fn default() -> Self {
        Self { masses: Masses::Element, alpha: None, integrator: "leapfrog".into() }
    }
}

/// How the mass of the body is shared among the control points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Masses {
    /// (3.12): every element shares its mass equally among its control points.
    Element,
    /// (3.11): the lumped diagonal of the mass matrix.
    Lumped,
}
