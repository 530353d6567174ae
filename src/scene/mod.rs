//! A scene: the TOML text of a user as checked values.
//!
//! One settings struct a room below: what `[geometry]`, `[material]`, `[support]`, `[[load]]`, `[reference]`,
//! `[springs]`, `[calibration]`, `[solver]`, `[limits]` and `[dynamics]` may say. SI units throughout. The way of a scene:
//!
//! ```text
//! text --set--> text --toml--> Scene --check--> Scene + warnings --resolve--> Scene with every default written out
//!      overrides.rs     parse.rs        check.rs                   resolve.rs
//! ```
//!
//! The doc comment of a field is also its description in the JSON Schema (`springfit schema`) and its comment in
//! `springfit new`: its first sentence must stand alone and name the unit. Whatever is wrong becomes a [`Located`]
//! error that shows the line of the text. Values whose default depends on the body are `Option` here and are filled
//! in by [`resolve`].

mod body;
mod budget;
mod calibration;
mod check;
mod check_load;
mod choices;
mod converged;
mod dynamics;
mod entries;
mod known;
mod limits;
mod load;
mod located;
mod overrides;
mod parse;
mod reference;
mod resolve;
mod solver;
mod springs;
mod states;
mod support;
mod template;

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use body::{Axis, BoxRegion, Distortion, Geometry, Material};
pub use budget::Budget;
pub use calibration::{Annealing, Calibration, Gamma, GammaSweep, GaussNewton};
pub use check::{check, check_body, check_method};
pub use choices::{Choice, KINDS, Kind};
pub use converged::Converged;
pub use dynamics::{Dynamics, Initial, Linear, Masses, Model, Step};
pub use known::Known;
pub use limits::{Limits, Memory};
pub use load::{Bending, Load, PatchForce, Place, PointForce, RandomSmooth, Torsion, Traction};
pub use located::{Located, Source};
pub use parse::{Input, LARGEST_FILE, parse, read};
pub use reference::{Kinematics, Plane, Reference};
pub use resolve::resolve;
pub use solver::Solver;
pub use springs::{ADAPTIVE, SpringSet, Springs};
pub use states::{Acceleration, MatrixDistance, Snapshot};
pub use support::{Support, Supports};
pub use template::template;

/// Everything a run needs to know; the top level of a scene file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name of the scene, printed in the result; the name of the file when absent.
    #[serde(default)]
    pub name: String,
    /// The body.
    #[serde(default)]
    pub geometry: Geometry,
    /// The isotropic linear elastic material.
    pub material: Material,
    /// The control points that are held; several `[[support]]` tables where they are held in different components.
    #[serde(default)]
    pub support: Supports,
    /// The load cases, one `[[load]]` table each.
    #[serde(default)]
    pub load: Vec<Load>,
    /// The continuum model that the springs are compared with.
    #[serde(default)]
    pub reference: Reference,
    /// A finer solution that tells the error of the springs from that of the mesh; absent: none is computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub converged: Option<Converged>,
    /// The spring network.
    #[serde(default)]
    pub springs: Springs,
    /// How the spring stiffness is found.
    #[serde(default)]
    pub calibration: Calibration,
    /// How the springs are solved.
    #[serde(default)]
    pub solver: Solver,
    /// What a run may take.
    #[serde(default, skip_serializing_if = "is_default")]
    pub limits: Limits,
    /// How wrong and how slow the network may be; absent: the network is built as the other tables say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<Budget>,
    /// Masses, damping and motion; absent: none of them is computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dynamics: Option<Dynamics>,
}

fn is_default(limits: &Limits) -> bool {
    *limits == Limits::default()
}

/// Regularisation of the grouping "each" unless the scene says otherwise, percent.
const REGULARISATION_OF_EACH: f64 = 1.0;

impl Scene {
    /// The files that it names: body, loads, springs.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let loads = self.load.iter_mut().filter_map(|load| load.file.as_mut());
        let springs = self.springs.edge_file.iter_mut().chain(&mut self.calibration.springs);
        self.geometry.file.iter_mut().chain(loads).chain(springs)
    }

    /// Whether the fit has room for a prior that draws groups together.
    pub fn takes_regularisation(&self) -> bool {
        self.calibration.objective == "displacement"
            && self.calibration.optimiser() != Some("surrogate")
            && self.reference.kinematics == Kinematics::Linear
    }

    /// The strength of the prior that draws groups together, percent; 0 for none.
    pub fn regularisation(&self) -> f64 {
        let usual =
            if self.springs.grouping == "each" && self.takes_regularisation() { REGULARISATION_OF_EACH } else { 0.0 };
        self.calibration.regularisation.unwrap_or(usual)
    }

    /// Name of a load case: its own, or `load N` counted from 1.
    pub fn load_name(&self, index: usize) -> String {
        self.load[index].name.clone().unwrap_or_else(|| format!("load {}", index + 1))
    }
}

/// The JSON Schema of a scene (draft 2020-12).
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Scene).to_value()
}
