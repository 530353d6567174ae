//! `[dynamics]`: masses, damping, and the motion of the body.
//!
//! Without `duration` and `steps` nothing moves: masses, damping and the largest safe step are computed for a later
//! simulation. With one of them the body is moved, once for each alpha.

use std::fmt;

use schemars::JsonSchema;
use serde::de::Visitor;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::dynamics::integrator;
use crate::dynamics::stepper::Settings;
use crate::error::{Error, Result};
use crate::reference::corotational::Tangent;

use super::check::{positive, within};
use super::choices::{known, names};
use super::{Kinematics, Scene};

/// `[dynamics]`: masses and damping for a simulation, and the motion of the body if `duration` or `steps` is given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Dynamics {
    /// How the mass of the body is shared among the control points; needs `material.density`.
    pub masses: Masses,
    /// Damping constant alpha of (4.18) in s, above 0: c = 2 sqrt(k (m_i + m_j)) / (alpha l0); absent: no damping.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// Several alpha in s in place of one: the body is moved once with each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub alphas: Vec<f64>,
    /// Rayleigh damping [alpha_R in 1/s, beta_R in s] of the model "reference", each from 0: C = alpha_R M + beta_R K.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rayleigh: Option<[f64; 2]>,
    /// What is moved.
    pub model: Model,
    /// Time integrator (`springfit list integrators`); default leapfrog, semi_implicit_euler for a corotational continuum.
    #[schemars(extend("enum" = names("dynamics.integrator")))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integrator: Option<String>,
    /// Which second derivative of the energy implicit steps of a corotational continuum use; default: warped for
    /// semi_implicit_euler, exact for midpoint, otherwise positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tangent: Option<Tangent>,
    /// How the linear systems of implicit steps are solved.
    pub linear_solver: Linear,
    /// |b - A x| / |b| that ends the conjugate gradients of `linear_solver = "cg"`, 1e-14 to 1e-2.
    pub linear_tolerance: f64,
    /// beta and gamma of the integrator "newmark", 2 beta >= gamma >= 1/2.
    pub newmark: [f64; 2],
    /// Step in s, above 0, or "auto": the largest safe step times `safety`; default "auto" where the body moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<Step>,
    /// Part of the largest safe step that "auto" takes, above 0 and at most 1.
    pub safety: f64,
    /// Time of the motion in s, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
    /// Steps of the motion, in place of `duration`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u64>,
    /// How the motion starts.
    pub initial: Initial,
    /// True: the supports let go and no load case acts while the body moves; false: they hold it.
    pub free: bool,
    /// Velocity in m/s that all free nodes start with, one component a direction of space; absent: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Vec<f64>>,
    /// Angular velocity in rad/s about the centre of mass that all free nodes start with: 3 components, 1 in 2D.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angular_velocity: Option<Vec<f64>>,
    /// Name of the load case that acts, or from whose static state the body is released; default: the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_case: Option<String>,
    /// Time in s at which the load ends and the body swings freely (a step force); absent: it acts for ever.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_until: Option<f64>,
    /// Table of [time in s, factor] that the load follows by straight lines, times ascending; in place of `load_until`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub load_factors: Vec<[f64; 2]>,
    /// Acceleration of gravity in m/s^2, one component a direction of space; absent: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gravity: Option<Vec<f64>>,
    /// Recorded times beside the start, equally spaced, 1 to 100000.
    pub frames: u64,
    /// Time in s from one record to the next, in place of `frames`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<f64>,
    /// Largest force out of balance that ends Newton's method, relative to the largest force, 1e-13 to 1e-3.
    pub tolerance: f64,
}

impl Default for Dynamics {
    fn default() -> Self {
        let Settings { newmark, tolerance, .. } = Settings::with_step(0.0);
        Self {
            masses: Masses::Element,
            alpha: None,
            alphas: Vec::new(),
            rayleigh: None,
            model: Model::Springs,
            integrator: None,
            tangent: None,
            linear_solver: Linear::Cholesky,
            linear_tolerance: 1e-10,
            newmark,
            step: None,
            safety: 0.9,
            duration: None,
            steps: None,
            initial: Initial::Rest,
            free: false,
            velocity: None,
            angular_velocity: None,
            load_case: None,
            load_until: None,
            load_factors: Vec::new(),
            gravity: None,
            frames: 200,
            interval: None,
            tolerance,
        }
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

/// What is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Model {
    /// The calibrated springs with their forces at any stretch and turn.
    Springs,
    /// The calibrated springs, linear about their rest.
    SpringsLinear,
    /// The continuum of `[reference]`, linear or corotational as its `kinematics` says.
    Reference,
}

impl Model {
    /// The name in a scene and in a result.
    pub fn name(self) -> &'static str {
        match self {
            Self::Springs => "springs",
            Self::SpringsLinear => "springs_linear",
            Self::Reference => "reference",
        }
    }
}

/// How the linear systems of implicit steps are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Linear {
    /// Sparse Cholesky, analysed once.
    Cholesky,
    /// Conjugate gradients with the inverses of the blocks of the nodes.
    Cg,
}

/// How a motion starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Initial {
    /// At rest; the load begins to act.
    Rest,
    /// In the static state of the load case, which no longer acts.
    Released,
}

/// A step: a number, or the largest safe one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// This many seconds.
    Fixed(f64),
    /// The largest safe step times `safety`.
    Auto,
}

impl Serialize for Step {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        match self {
            Self::Fixed(step) => serializer.serialize_f64(*step),
            Self::Auto => serializer.serialize_str("auto"),
        }
    }
}

impl JsonSchema for Step {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Step".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "anyOf": [{ "type": "number" }, { "const": "auto" }] })
    }
}

impl<'de> Deserialize<'de> for Step {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(StepVisitor)
    }
}

/// Reads a number or "auto", with the place of an error.
struct StepVisitor;

impl Visitor<'_> for StepVisitor {
    type Value = Step;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number of seconds or \"auto\"")
    }

    fn visit_f64<E>(self, value: f64) -> std::result::Result<Step, E> {
        Ok(Step::Fixed(value))
    }

    fn visit_i64<E>(self, value: i64) -> std::result::Result<Step, E> {
        Ok(Step::Fixed(value as f64))
    }

    fn visit_str<E: serde::de::Error>(self, value: &str) -> std::result::Result<Step, E> {
        match value {
            "auto" => Ok(Step::Auto),
            other => Err(E::invalid_value(serde::de::Unexpected::Str(other), &self)),
        }
    }
}

impl Dynamics {
    /// True when the body is to be moved.
    pub fn moves(&self) -> bool {
        self.duration.is_some() || self.steps.is_some()
    }

    /// The integrator: the given one, else the one that suits what moves.
    pub fn integrator(&self, kinematics: Kinematics) -> &str {
        let usual = if self.turns(kinematics) { "semi_implicit_euler" } else { "leapfrog" };
        self.integrator.as_deref().unwrap_or(usual)
    }

    /// Whether a corotational continuum is what moves.
    pub fn turns(&self, kinematics: Kinematics) -> bool {
        self.model == Model::Reference && kinematics == Kinematics::Corotational
    }

    /// The second derivative for an integrator of a corotational continuum.
    pub fn tangent(&self, integrator: &str) -> Tangent {
        self.tangent.unwrap_or(match integrator {
            "semi_implicit_euler" => Tangent::Warped,
            "midpoint" => Tangent::Exact,
            _ => Tangent::Positive,
        })
    }

    /// Every alpha that is asked for; one entry without a number when there is no damping by (4.18).
    pub fn all_alphas(&self) -> Vec<Option<f64>> {
        match (self.alpha, self.alphas.is_empty()) {
            (_, false) => self.alphas.iter().copied().map(Some).collect(),
            (alpha, true) => vec![alpha],
        }
    }
}

/// Checks what needs no body.
///
/// # Errors
/// [`Error::Input`] at the first value that cannot be used.
pub(super) fn check(scene: &Scene, dynamics: &Dynamics) -> Result<()> {
    let kinematics = scene.reference.kinematics;
    known("dynamics.integrator", dynamics.integrator(kinematics), &names("dynamics.integrator"))?;
    check_large(scene, dynamics)?;
    if scene.material.density.is_none() {
        let help = "masses need it: add material.density in kg/m^3";
        return Err(Error::input("material.density", "is missing", help));
    }
    check_damping(dynamics)?;
    check_steps(dynamics, kinematics)?;
    check_forces(scene, dynamics)?;
    let [beta, gamma] = dynamics.newmark;
    if gamma < 0.5 || 2.0 * beta < gamma {
        let message = format!("[{beta}, {gamma}] is stable for small steps only");
        return Err(Error::input("dynamics.newmark", message, "give 2 beta >= gamma >= 1/2, such as [0.25, 0.5]"));
    }
    if (1e-13..=1e-3).contains(&dynamics.tolerance) {
        return Ok(());
    }
    let message = format!("{:e} is out of range", dynamics.tolerance);
    Err(Error::input("dynamics.tolerance", message, "give a number from 1e-13 to 1e-3"))
}

fn check_damping(dynamics: &Dynamics) -> Result<()> {
    if let Some(alpha) = dynamics.alpha {
        positive("dynamics.alpha", alpha)?;
        if !dynamics.alphas.is_empty() {
            return Err(Error::input("dynamics.alphas", "both alpha and alphas are given", "keep one of the two"));
        }
    }
    for (i, &alpha) in dynamics.alphas.iter().enumerate() {
        positive(&format!("dynamics.alphas[{i}]"), alpha)?;
    }
    let of_springs = dynamics.alpha.is_some() || !dynamics.alphas.is_empty();
    if of_springs && dynamics.model == Model::Reference && dynamics.moves() {
        let help = "remove alpha and give dynamics.rayleigh, or move the springs";
        return Err(Error::input("dynamics.model", "the continuum has no springs that alpha could damp", help));
    }
    let Some(rayleigh) = dynamics.rayleigh else { return Ok(()) };
    if dynamics.model != Model::Reference {
        let help = "give alpha, or set dynamics.model to \"reference\"";
        return Err(Error::input("dynamics.rayleigh", "springs are damped by alpha (4.18)", help));
    }
    match rayleigh.iter().position(|&number| number < 0.0) {
        None => Ok(()),
        Some(i) => {
            let message = format!("{} is negative", rayleigh[i]);
            Err(Error::input(format!("dynamics.rayleigh[{i}]"), message, "give a number from 0"))
        }
    }
}

/// What only some bodies and solvers have.
fn check_large(scene: &Scene, dynamics: &Dynamics) -> Result<()> {
    if dynamics.tangent.is_some() && !dynamics.turns(scene.reference.kinematics) {
        let help = "remove it; or set dynamics.model = \"reference\" and reference.kinematics = \"corotational\"";
        return Err(Error::input("dynamics.tangent", "only a corotational continuum has a choice of tangents", help));
    }
    if (1e-14..=1e-2).contains(&dynamics.linear_tolerance) {
        return Ok(());
    }
    let message = format!("{:e} is out of range", dynamics.linear_tolerance);
    Err(Error::input("dynamics.linear_tolerance", message, "give a number from 1e-14 to 1e-2"))
}

fn check_steps(dynamics: &Dynamics, kinematics: Kinematics) -> Result<()> {
    if let Some(Step::Fixed(step)) = dynamics.step {
        positive("dynamics.step", step)?;
    }
    let name = dynamics.integrator(kinematics);
    let implicit = integrator::find(name).is_some_and(|integrator| !integrator.is_explicit());
    if implicit && dynamics.moves() && !matches!(dynamics.step, Some(Step::Fixed(_))) {
        let message = format!("every step is stable with {name}");
        return Err(Error::input("dynamics.step", message, "give the step in s that is accurate enough"));
    }
    positive("dynamics.safety", dynamics.safety)?;
    if dynamics.safety > 1.0 {
        return Err(Error::input("dynamics.safety", format!("{} is above 1", dynamics.safety), "give at most 1"));
    }
    if let Some(duration) = dynamics.duration {
        positive("dynamics.duration", duration)?;
        if dynamics.steps.is_some() {
            return Err(Error::input("dynamics.steps", "both duration and steps are given", "keep one of the two"));
        }
    }
    if let Some(steps) = dynamics.steps {
        within("dynamics.steps", usize::try_from(steps).unwrap_or(usize::MAX), 1, 1_000_000_000)?;
    }
    within("dynamics.frames", usize::try_from(dynamics.frames).unwrap_or(usize::MAX), 1, 100_000)?;
    dynamics.interval.map_or(Ok(()), |interval| positive("dynamics.interval", interval))
}

fn check_forces(scene: &Scene, dynamics: &Dynamics) -> Result<()> {
    if let Some(name) = &dynamics.load_case {
        let all: Vec<String> = (0..scene.load.len()).map(|i| scene.load_name(i)).collect();
        let all: Vec<&str> = all.iter().map(String::as_str).collect();
        known("dynamics.load_case", name, &all)?;
    }
    let ends = [("load_until", dynamics.load_until.is_some()), ("load_factors", !dynamics.load_factors.is_empty())];
    match ends.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect::<Vec<_>>()[..] {
        [_, second] => {
            let key = format!("dynamics.{second}");
            return Err(Error::input(key, "both load_until and load_factors are given", "keep one of the two"));
        }
        [key] if dynamics.free => {
            let help = "remove it, or set dynamics.free to false";
            return Err(Error::input(format!("dynamics.{key}"), "no load case acts on a free body", help));
        }
        [key] if dynamics.initial == Initial::Released => {
            let help = "remove it: a released body is not loaded any more; or set dynamics.initial to \"rest\"";
            return Err(Error::input(format!("dynamics.{key}"), "the body is released from its load", help));
        }
        _ => {}
    }
    if let Some(until) = dynamics.load_until {
        positive("dynamics.load_until", until)?;
    }
    match dynamics.load_factors.windows(2).position(|pair| pair[0][0] >= pair[1][0]) {
        None => Ok(()),
        Some(i) => {
            let message = format!(
                "the time {} does not come after {}",
                dynamics.load_factors[i + 1][0],
                dynamics.load_factors[i][0]
            );
            Err(Error::input(format!("dynamics.load_factors[{}]", i + 1), message, "give the times in ascending order"))
        }
    }
}

/// A turn has three components in space and one in the plane.
pub(super) fn check_spin(dynamics: &Dynamics, dimension: usize) -> Result<()> {
    let components = if dimension == 2 { 1 } else { 3 };
    match &dynamics.angular_velocity {
        Some(given) if given.len() != components => {
            let message = format!("{} numbers for a body in {dimension}D", given.len());
            Err(Error::input("dynamics.angular_velocity", message, format!("give {components}")))
        }
        _ => Ok(()),
    }
}
