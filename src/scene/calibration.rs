//! `[calibration]`: how the spring stiffness is found.
//!
//! The gamma sweep (Algorithm 5.1) takes gamma = start, start - step, start - 2 step, ... while it is positive; every
//! value gives a grouping, and equal groupings are solved once. The defaults of the optimisers are those of
//! [`Settings`].

use std::fmt;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::calibration::objectives;
use crate::calibration::optimiser::Settings;
use crate::calibration::sweep;
use crate::error::{Error, Result};

use super::choices::names;
use super::known::Known;
use super::states::{Acceleration, MatrixDistance};

/// `[calibration]`: objective, optimiser, sweep and seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Calibration {
    /// What is made small (`springfit list objectives`).
    #[schemars(extend("enum" = names("calibration.objective")))]
    pub objective: String,
    /// How it is made small (`springfit list optimisers`); default: gauss_newton for displacement, least_squares for the
    /// linear objectives acceleration and matrix, none for formula and known.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("enum" = names("calibration.optimiser")))]
    pub optimiser: Option<String>,
    /// The formula, for the objective formula (`springfit list formulas`).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("enum" = names("calibration.formula")))]
    pub formula: Option<String>,
    /// The stiffness of every group, 0 or more, for the objective known: one number for all, numbers in the order of the groups, or
    /// a table by their names. In the unit of the profile, N/m where it is constant; of one cell where cells are counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Known>,
    /// The springs.json of a network, for the objective known: which springs there are, and the stiffness of each; a relative
    /// path starts at the folder of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub springs: Option<PathBuf>,
    /// Spread of the lengths in a group, above 0 and below 1: one number, or { start, step } for a sweep downwards.
    pub gamma: Gamma,
    /// Seed of every random number; the same seed gives the same result.
    pub seed: u64,
    /// Starting points of Gauss-Newton for each problem, 1 to 1000; default: 1 for one group, else 2 + 2 groups, at
    /// most 32. The first is a tenth of the bounds. With 128 groups or more, or a prior, one start at a common stiffness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub starts: Option<usize>,
    /// How strongly groups are drawn to a common value, percent, 0 or more: springs that differ from it by a factor of e
    /// cost as much as an error of so much. Default: 1 for the grouping "each", else 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub regularisation: Option<f64>,
    /// Whether the network is tried under loads that are not in the scene, which no fit sees: where it is too soft and too stiff, and
    /// errors under generated loads where no load has fit = false. Default: where that is cheap (springs and continuum
    /// are factored, at most 20000 free degrees of freedom).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub generalisation: Option<bool>,
    /// The objective matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub matrix: Option<MatrixDistance>,
    /// The objective acceleration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<Acceleration>,
    /// Simulated annealing, used by the optimisers annealing, hybrid and surrogate.
    pub annealing: Annealing,
    /// Gauss-Newton, used by the optimisers gauss_newton, hybrid and surrogate.
    pub gauss_newton: GaussNewton,
}

impl Default for Calibration {
    fn default() -> Self {
        Self {
            objective: "displacement".into(),
            optimiser: None,
            formula: None,
            stiffness: None,
            springs: None,
            gamma: Gamma::Sweep(GammaSweep::default()),
            seed: 1,
            starts: None,
            regularisation: None,
            generalisation: None,
            matrix: None,
            acceleration: None,
            annealing: Annealing::default(),
            gauss_newton: GaussNewton::default(),
        }
    }
}

impl Calibration {
    /// The optimiser: the given one, else that of the objective; none where nothing is optimised.
    pub fn optimiser(&self) -> Option<&str> {
        let usual = || objectives::find(&self.objective).and_then(|goal| goal.optimiser);
        self.optimiser.as_deref().or_else(usual)
    }

    /// Where the stiffness comes from: the optimiser or the formula, "none" where it is known.
    pub fn source(&self) -> &str {
        self.optimiser().or(self.formula.as_deref()).unwrap_or("none")
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
    /// The values, largest first.
    ///
    /// # Errors
    /// [`Error::Input`] for a value outside (0, 1), a step that is not positive, or too many values.
    pub fn values(&self) -> Result<Vec<f64>> {
        match self {
            Self::Fixed(value) if *value > 0.0 && *value < 1.0 => Ok(vec![*value]),
            Self::Fixed(value) => {
                let help = "give a number above 0 and below 1, or { start = 0.8, step = 0.1 }";
                Err(Error::input("calibration.gamma", format!("{value} is out of range"), help))
            }
            Self::Sweep(GammaSweep { start, step }) => sweep::gammas(*start, *step),
        }
    }
}

impl<'de> Deserialize<'de> for Gamma {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
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

    fn visit_f64<E>(self, value: f64) -> std::result::Result<Gamma, E> {
        Ok(Gamma::Fixed(value))
    }

    fn visit_i64<E>(self, value: i64) -> std::result::Result<Gamma, E> {
        Ok(Gamma::Fixed(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> std::result::Result<Gamma, E> {
        Ok(Gamma::Fixed(value as f64))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> std::result::Result<Gamma, A::Error> {
        GammaSweep::deserialize(MapAccessDeserializer::new(map)).map(Gamma::Sweep)
    }
}

/// `[calibration.annealing]`: bounded simulated annealing by independent chains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Annealing {
    /// Independent chains for each problem, 1 to 1024; they share the evaluations equally.
    pub chains: usize,
    /// Evaluations of the objective for each problem, all chains together.
    pub evaluations: usize,
    /// First temperature, as a fraction of the error at the start of a chain, above 0.
    pub initial_temperature: f64,
    /// Last temperature, as a fraction of the first, above 0 and below 1; it falls geometrically.
    pub final_temperature: f64,
}

impl Default for Annealing {
    fn default() -> Self {
        let Settings { chains, evaluations, initial_temperature, final_temperature, .. } = Settings::default();
        Self { chains, evaluations: evaluations as usize, initial_temperature, final_temperature }
    }
}

/// `[calibration.gauss_newton]`: damped Gauss-Newton (Levenberg-Marquardt) with the exact Jacobian.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GaussNewton {
    /// Factorisations that each start may spend, at least 1.
    pub refactorisations: usize,
    /// Factorisations that the best start may spend beyond that, 0 or more.
    pub polish: usize,
    /// Stops when a step lowers the error by less than this fraction of it, above 0.
    pub tolerance: f64,
}

impl Default for GaussNewton {
    fn default() -> Self {
        let Settings { refactorisations, polish, tolerance, .. } = Settings::default();
        Self { refactorisations: refactorisations as usize, polish: polish as usize, tolerance }
    }
}
