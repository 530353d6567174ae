//! `[calibration]`: how the spring stiffness is found.
//!
//! The gamma sweep (Algorithm 5.1) takes gamma = start, start - step, start - 2 step, ... while it is positive; every
//! value gives a grouping, and equal groupings are solved once. Annealing (Algorithm 3.1) accepts a worse state with
//! the probability exp(-rise / T) (Metropolis); the temperature falls geometrically, T -> cooling T, after a fixed
//! number of moves, and the moves stay inside the bounds (5.8).

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::choices::names;

/// `[calibration]`: objective, optimiser, sweep and seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Calibration {
    /// What is made small (`springfit list objectives`).
    #[schemars(extend("enum" = names("calibration.objective")))]
    pub objective: String,
    /// How it is made small (`springfit list optimisers`).
    #[schemars(extend("enum" = names("calibration.optimiser")))]
    pub optimiser: String,
    /// Spread of the lengths in a group, above 0 and below 1: one number, or { start, step } for a sweep downwards.
    pub gamma: Gamma,
    /// Seed of every random number; the same seed gives the same result.
    pub seed: u64,
    /// Starting points of Gauss-Newton for each problem, 1 to 1000; the first is a tenth of the bounds.
    pub starts: usize,
    /// Simulated annealing, used by the optimisers annealing and hybrid.
    pub annealing: Annealing,
    /// Gauss-Newton, used by the optimisers gauss_newton and hybrid.
    pub gauss_newton: GaussNewton,
}

impl Default for Calibration {
    fn default() -> Self {
        Self {
            objective: "displacement".into(),
            optimiser: "gauss_newton".into(),
            gamma: Gamma::Sweep(GammaSweep::default()),
            seed: 1,
            starts: 3,
            annealing: Annealing::default(),
            gauss_newton: GaussNewton::default(),
        }
    }
}

/// The spread of lengths in a group: one value, or a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Gamma {
    /// One value.
    Fixed(f64),
    /// A sweep downwards (Algorithm 5.1).
    Sweep(GammaSweep),
}

/// A sweep of gamma: start, start - step, ... while positive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GammaSweep {
    /// First and largest value, above 0 and below 1.
    pub start: f64,
    /// Decrement, above 0.
    pub step: f64,
}

impl Default for GammaSweep {
    fn default() -> Self {
        Self { start: 0.8, step: 0.1 }
    }
}

impl Gamma {
    /// The values, largest first. Rounded to 1e-12, so that 0.8 - 5 * 0.1 is 0.3.
    pub fn values(&self) -> Vec<f64> {
        match self {
            Self::Fixed(value) => vec![*value],
            Self::Sweep(GammaSweep { start, step }) => (0..self.count())
                .map(|i| {
                    let value = start - i as f64 * step;
                    let rounded = (value * 1e12).round() / 1e12;
                    if rounded > 0.0 { rounded } else { value }
                })
                .collect(),
        }
    }

    /// Number of values; a value that differs from zero by rounding only does not count.
    pub(super) fn count(&self) -> usize {
        match self {
            Self::Fixed(_) => 1,
            Self::Sweep(GammaSweep { start, step }) => ((start / step - 1e-9).ceil() as usize).max(1),
        }
    }
}

impl<'de> Deserialize<'de> for Gamma {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(GammaVisitor)
    }
}

/// Reads a number or a table; serde's own untagged reading would lose the place and the reason of an error.
struct GammaVisitor;

impl<'de> Visitor<'de> for GammaVisitor {
    type Value = Gamma;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number or { start = ..., step = ... }")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Gamma, E> {
        Ok(Gamma::Fixed(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Gamma, E> {
        Ok(Gamma::Fixed(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Gamma, E> {
        Ok(Gamma::Fixed(value as f64))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Gamma, A::Error> {
        GammaSweep::deserialize(MapAccessDeserializer::new(map)).map(Gamma::Sweep)
    }
}

/// `[calibration.annealing]`: bounded simulated annealing by independent chains.
///
/// Sources: Metropolis et al. (1953) for the acceptance, Kirkpatrick et al. (1983) for the first temperature and the
/// geometric cooling, Corana et al. (1987) for moves that adapt their length and for the factor 0.85.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Annealing {
    /// Independent chains for each problem, 1 to 1024; they share the evaluations equally.
    pub chains: usize,
    /// Evaluations of the objective for each problem, all chains together.
    pub evaluations: usize,
    /// First temperature in percent of error, above 0; absent: such that four of five worse first moves are accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial_temperature: Option<f64>,
    /// Factor on the temperature after each level, above 0 and below 1.
    pub cooling: f64,
    /// Moves of a chain at each temperature, at least 1.
    pub moves_per_temperature: usize,
    /// Largest first move as a share of the range between the bounds, above 0 and up to 1; it adapts at each level.
    pub step: f64,
}

impl Default for Annealing {
    fn default() -> Self {
        Self {
            chains: 4,
            evaluations: 5000,
            initial_temperature: None,
            cooling: 0.85,
            moves_per_temperature: 20,
            step: 0.2,
        }
    }
}

/// `[calibration.gauss_newton]`: damped Gauss-Newton (Levenberg-Marquardt) with the exact Jacobian.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GaussNewton {
    /// Largest number of iterations from each start, at least 1.
    pub iterations: usize,
    /// Stops when an iteration lowers the error by less than this share of it, above 0.
    pub tolerance: f64,
}

impl Default for GaussNewton {
    fn default() -> Self {
        Self { iterations: 20, tolerance: 1e-8 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn algorithm_5_1_sweep_stops_above_zero() {
        let sweep = |start, step| Gamma::Sweep(GammaSweep { start, step });
        assert_eq!(sweep(0.8, 0.1).values(), [0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]);
        assert_eq!(sweep(0.5, 0.2).values(), [0.5, 0.3, 0.1]);
        assert_eq!(sweep(0.5, 0.9).values(), [0.5]);
        assert_eq!(sweep(1e-13, 1.0).values(), [1e-13]);
        assert_eq!(Gamma::Fixed(0.25).values(), [0.25]);
    }
}
