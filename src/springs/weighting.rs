//! How often a spring counts, and what the number of its group means for it.
//!
//! ```text
//! k_s = phi_a w_s,     w_s = c_s p_s
//! ```
//!
//! with phi_a the number of the group of the spring, p_s the factor of its profile ([`super::profiles`]), and c_s the number
//! of grid cells that contain the spring (weighting "cells": as when every cell assembles its own springs, the reading that
//! agrees with (3.13)) or 1 (weighting "springs").

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

/// All weightings: the word in the scene, and what it does, in a line.
pub const WEIGHTINGS: &[(&str, &str)] = &[
    (
        "cells",
        "multiplicity: a spring counts once for each cell that contains it, as when every cell assembles its own",
    ),
    ("springs", "every spring counts once"),
];

impl Weighting {
    /// c_s.
    pub fn count(self, spring: &Spring) -> f64 {
        match self {
            Self::Cells => f64::from(spring.cells),
            Self::Springs => 1.0,
        }
    }
}

/// w_s of all springs: the stiffness of a spring is the number of its group times this. `factors` is p_s of every spring.
///
/// # Panics
/// When there is not one factor for every spring.
pub fn coefficients(network: &Network, weighting: Weighting, factors: &[f64]) -> Vec<f64> {
    assert_eq!(network.springs.len(), factors.len(), "one factor for every spring");
    network.springs.iter().zip(factors).map(|(spring, factor)| weighting.count(spring) * factor).collect()
}

/// k_s of all springs, N/m: what one simulates with. `coefficients` is w_s of every spring, `phi` one number a group.
///
/// # Panics
/// When there is not one coefficient for every spring.
pub fn stiffness(grouping: &Grouping, coefficients: &[f64], phi: &[f64]) -> Vec<f64> {
    assert_eq!(grouping.group_of.len(), coefficients.len(), "one coefficient for every spring");
    grouping.group_of.iter().zip(coefficients).map(|(&group, w)| phi[group as usize] * w).collect()
}
