//! What the number of a group means for one of its springs.
//!
//! The calibration finds one number phi_a for each group. A spring s of the group has the stiffness
//!
//! ```text
//! k_s = phi_a w_s,     w_s = c_s            (law "stiffness": phi is a stiffness, N/m)
//!                      w_s = c_s / l0_s     (law "axial_rigidity": phi is EA, N)
//! ```
//!
//! with c_s the number of grid cells that contain the spring (weighting "cells": as when every cell assembles its own
//! springs, the reading that agrees with (3.13)) or 1 (weighting "springs").

use super::grouping::Grouping;
use super::network::{Network, Spring};

/// How often a spring counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Weighting {
    /// Once for each grid cell that contains it.
    #[default]
    Cells,
    /// Once.
    Springs,
}

/// What the springs of a group have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// The stiffness k, N/m.
    #[default]
    Stiffness,
    /// The axial rigidity EA, N: k = EA / l0.
    AxialRigidity,
}

/// w_s: the stiffness of a spring is the number of its group times this. 1 or 1/m.
pub fn coefficient(spring: &Spring, weighting: Weighting, law: Law) -> f64 {
    let count = match weighting {
        Weighting::Cells => f64::from(spring.cells),
        Weighting::Springs => 1.0,
    };
    match law {
        Law::Stiffness => count,
        Law::AxialRigidity => count / spring.length,
    }
}

/// w_s of all springs, one each.
pub fn coefficients(network: &Network, weighting: Weighting, law: Law) -> Vec<f64> {
    network.springs.iter().map(|spring| coefficient(spring, weighting, law)).collect()
}

/// k_s of all springs, N/m: what one simulates with. `coefficients` is w_s of every spring, `phi` one number a group.
///
/// # Panics
/// When there is not one coefficient for every spring.
pub fn stiffness(grouping: &Grouping, coefficients: &[f64], phi: &[f64]) -> Vec<f64> {
    assert_eq!(grouping.group_of.len(), coefficients.len(), "one coefficient for every spring");
    grouping.group_of.iter().zip(coefficients).map(|(&group, w)| phi[group as usize] * w).collect()
}
