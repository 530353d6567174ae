//! What can go wrong, as values with numbers in them.
//!
//! Every failure that an input can cause is one of these. [`Error::exit_status`] says what the command line answers:
//! 2 when the input is wrong, 3 when the numbers do not allow it, 4 when a budget cannot be met, 130 when the user stopped it. An error that belongs
//! to a key of the scene carries that key, so that the scene reader can show the line.

use std::path::PathBuf;

/// The result of everything in springfit that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// A failure with its place and its numbers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A value that cannot be used: where (a scene key such as `geometry.degree`), what is wrong, what is allowed.
    #[error("{key}: {message}")]
    Input {
        /// Dotted path of the scene key the value belongs to.
        key: String,
        /// What is wrong, with the value.
        message: String,
        /// What is allowed, or what to do.
        help: String,
    },
    /// A file that cannot be read or written.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
        /// What to do.
        help: String,
    },
    /// The Jacobian of the geometry map, or of a cell, is zero or changes sign.
    #[error(
        "element {element:?} is folded: at Gauss point {point:?} the Jacobian determinant is {determinant:.3e}: zero, or of another sign than elsewhere"
    )]
    FoldedElement {
        /// Index of the knot span in each direction, or the number of the cell.
        element: Vec<usize>,
        /// Parametric coordinates of the point.
        point: Vec<f64>,
        /// Determinant of dx/dxi there.
        determinant: f64,
    },
    /// A stiffness matrix with a pivot that is not positive.
    #[error("the stiffness matrix is not positive definite: the pivot of free dof {dof} is not positive")]
    NotPositiveDefinite {
        /// Free degree of freedom whose pivot failed.
        dof: usize,
    },
    /// The network or body can move without resistance.
    #[error("the {what} is a mechanism with {modes} zero mode{}: {}", if *modes == 1 { "" } else { "s" }, list(motions))]
    Mechanism {
        /// "reference body", "spring network" before a fit, "fitted network" after it, "given network" where nothing is fitted.
        what: String,
        /// Independent ways to move without resistance.
        modes: usize,
        /// The first of them in words, such as "node 5 can move along x".
        motions: Vec<String>,
        /// What to do.
        help: String,
    },
    /// A run that would need more than there is, or more than the scene allows.
    #[error("the run needs about {estimate}, and {limit}")]
    OverLimit {
        /// What it needs, with its unit.
        estimate: String,
        /// What there is, in words with numbers.
        limit: String,
        /// What to do.
        help: String,
    },
    /// A solution whose residual stays too large after refinement.
    #[error("the linear solve is not accurate: backward error {backward_error:.2e}, allowed {limit:.0e}")]
    Inaccurate {
        /// Measured backward error (see `sparse::backward_error`).
        backward_error: f64,
        /// Largest accepted one.
        limit: f64,
    },
    /// Newton's method found no equilibrium under large displacements.
    #[error(
        "the {what} finds no equilibrium at {:.0} % of the load: {reason}, {residual:.2e} of the largest force is out of balance after {iterations} iterations, allowed {tolerance:.0e}",
        100.0 * load
    )]
    NoEquilibrium {
        /// "body" or "spring network", and under which load where that is known.
        what: String,
        /// Share of the load, 1 for all of it.
        load: f64,
        /// What stopped the search.
        reason: &'static str,
        /// Largest force out of balance, relative to the largest force.
        residual: f64,
        /// Largest accepted one.
        tolerance: f64,
        /// Iterations done.
        iterations: usize,
    },
    /// A time step above the limit of stability.
    #[error("the step of {step:e} s is unstable with {integrator}: {reason}")]
    UnstableStep {
        /// Name of the integrator.
        integrator: &'static str,
        /// The step asked for, s.
        step: f64,
        /// The limit, in words with numbers.
        reason: String,
        /// What to do.
        help: String,
    },
    /// Newton's method did not find the end of a time step.
    #[error(
        "step {step} did not converge: residual {residual:.2e} after {iterations} iterations of Newton's method, allowed {tolerance:.0e}"
    )]
    NotConverged {
        /// Number of the step, from 1.
        step: u64,
        /// Largest force out of balance, relative to the largest force.
        residual: f64,
        /// Largest accepted one.
        tolerance: f64,
        /// Iterations done.
        iterations: usize,
    },
    /// The motion grew without bound.
    #[error("the motion blew up at step {step}, {time:e} s: {what}")]
    BlowUp {
        /// Number of the step, from 1.
        step: u64,
        /// Time at its end, s.
        time: f64,
        /// What gave it away.
        what: String,
    },
    /// No network meets the budget of the scene; what was found is put out all the same.
    #[error("the budget cannot be met: {best}")]
    OverBudget {
        /// The best that was found, with its numbers and those of the budget.
        best: String,
    },
    /// The user stopped the run.
    #[error("interrupted")]
    Interrupted,
}

/// What to do about a reference body that is a mechanism.
const LOOSE_BODY: &str = "support more nodes or components, or let support.fix_rigid = true hold what is loose";

/// What to do about springs that are a mechanism before any fit.
const LOOSE_SPRINGS: &str = "support more nodes, or use a topology with diagonals";

/// Most motions that a message names.
const NAMED_MOTIONS: usize = 6;

/// Motions in one line; the last of many are left out.
fn list(motions: &[String]) -> String {
    let mut text = motions.iter().take(NAMED_MOTIONS).map(String::as_str).collect::<Vec<_>>().join(", ");
    if motions.len() > NAMED_MOTIONS {
        text += ", ...";
    }
    text
}

/// A direction in words: an axis where it is one, otherwise its components.
pub fn direction_name(direction: [f64; 3]) -> String {
    let size = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    let unit = direction.map(|x| if size > 0.0 { x / size } else { 0.0 });
    match unit.iter().position(|x| x.abs() > 1.0 - 1e-6) {
        Some(axis) => ["x", "y", "z"][axis].to_owned(),
        None => format!("({:.2}, {:.2}, {:.2})", unit[0], unit[1], unit[2]),
    }
}

impl Error {
    /// An [`Error::Input`] for a scene key.
    pub fn input(key: impl Into<String>, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Input { key: key.into(), message: message.into(), help: help.into() }
    }

    /// An [`Error::Mechanism`] with the usual help for a reference body or for springs.
    pub fn mechanism(what: impl Into<String>, modes: usize, motions: Vec<String>) -> Self {
        let what = what.into();
        let help = if what.starts_with("reference") { LOOSE_BODY } else { LOOSE_SPRINGS };
        Self::Mechanism { what, modes, motions, help: help.into() }
    }

    /// The same with what to do about a mechanism that a fit has made.
    pub fn advised(mut self, advice: String) -> Self {
        if let Self::Mechanism { help, .. } = &mut self {
            *help = advice;
        }
        self
    }

    /// The same with the load under which no equilibrium was found.
    pub fn under(mut self, load: &str) -> Self {
        if let Self::NoEquilibrium { what, .. } = &mut self {
            *what += &format!(" under the load {load}");
        }
        self
    }

    /// What to do about it, if the error can say.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Input { help, .. } | Self::File { help, .. } => Some(help.clone()),
            Self::FoldedElement { .. } => {
                Some("move the control points, or the nodes of the mesh, so that no element folds".into())
            }
            Self::NotPositiveDefinite { .. } => Some(LOOSE_SPRINGS.into()),
            Self::Mechanism { help, .. } | Self::OverLimit { help, .. } => Some(help.clone()),
            Self::Inaccurate { .. } => Some("reduce the spread of the stiffness, or repair flat cells".into()),
            Self::NoEquilibrium { .. } => Some("apply the load in more steps, or reduce it".into()),
            Self::UnstableStep { help, .. } => Some(help.clone()),
            Self::NotConverged { .. } => Some("reduce dynamics.step".into()),
            Self::BlowUp { .. } => Some("reduce dynamics.step, or take an implicit integrator".into()),
            Self::OverBudget { .. } => {
                Some("allow a larger error or a longer step, more groups, or a finer grid (budget.finest)".into())
            }
            Self::Interrupted => None,
        }
    }

    /// Exit status of the command line: 2 wrong input, 3 the numbers do not allow it, 4 a budget that
    /// cannot be met, 130 interrupted.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Input { .. } | Self::File { .. } => 2,
            Self::FoldedElement { .. }
            | Self::NotPositiveDefinite { .. }
            | Self::Mechanism { .. }
            | Self::OverLimit { .. }
            | Self::Inaccurate { .. }
            | Self::NoEquilibrium { .. }
            | Self::UnstableStep { .. }
            | Self::NotConverged { .. }
            | Self::BlowUp { .. } => 3,
            Self::OverBudget { .. } => 4,
            Self::Interrupted => 130,
        }
    }
}
