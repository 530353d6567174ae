//! The distances between network and continuum, and their table.
//!
//! | name | what shall agree | in phi |
//! |---|---|---|
//! | [`displacement`] (5.7) | the displacements under the same forces | not linear |
//! | [`large`] (5.7) | the displacements of a body that turns and of the springs in equilibrium | not linear |
//! | [`acceleration`] (4.5) | the accelerations in the same states | linear |
//! | [`matrix`] (3.17) | the stiffness matrices | linear |
//! | formula | nothing is fitted: a formula of the literature gives every spring its stiffness | |
//! | known | nothing is fitted: the scene or a file gives the stiffness | |
//!
//! The linear ones are least squares with bounds and solved in one step; [`linear`] shows them to any other optimiser.

pub mod acceleration;
pub mod displacement;
pub mod large;
pub mod linear;
pub mod matrix;

/// An objective as a scene names it.
#[derive(Debug, Clone, Copy)]
pub struct Goal {
    /// Name in the scene.
    pub name: &'static str,
    /// One line for `list`.
    pub doc: &'static str,
    /// True when its residual is linear in the stiffness.
    pub linear: bool,
    /// The optimiser that a scene without one gets; none where nothing is optimised.
    pub optimiser: Option<&'static str>,
    /// What to do about a network that its fit has opened, beside using fewer groups.
    pub against_mechanisms: &'static [&'static str],
}

/// What to do where no other setting of the objective closes a network.
const FIT_DISPLACEMENTS: &str = "fit the displacements (calibration.objective = \"displacement\")";

/// All objectives.
pub const OBJECTIVES: &[Goal] = &[
    Goal {
        name: "displacement",
        doc: "root mean square displacement error in percent of the largest (5.7)",
        linear: false,
        optimiser: Some("gauss_newton"),
        against_mechanisms: &["fit more load cases"],
    },
    Goal {
        name: "acceleration",
        doc: "difference of the accelerations in given states (4.5), solved in one step",
        linear: true,
        optimiser: Some("least_squares"),
        against_mechanisms: &["add snapshots that deform the body in other ways", FIT_DISPLACEMENTS],
    },
    Goal {
        name: "matrix",
        doc: "Frobenius distance of the stiffness matrices (3.17), solved in one step",
        linear: true,
        optimiser: Some("least_squares"),
        against_mechanisms: &[FIT_DISPLACEMENTS],
    },
    Goal {
        name: "formula",
        doc: "nothing is fitted: calibration.formula gives the stiffness (3.13, 3.14)",
        linear: false,
        optimiser: None,
        against_mechanisms: &[FIT_DISPLACEMENTS],
    },
    Goal {
        name: "known",
        doc: "nothing is fitted: a network that exists is judged; calibration.stiffness or calibration.springs gives it",
        linear: false,
        optimiser: None,
        against_mechanisms: &["make springs stiffer there", "add springs"],
    },
];

/// The objective of this name.
pub fn find(name: &str) -> Option<&'static Goal> {
    OBJECTIVES.iter().find(|goal| goal.name == name)
}
