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
    #[error("the {what} is a mechanism: node {node} can move along {direction} without resistance")]
    Mechanism {
        /// "spring network" or "reference body".
        what: String,
        /// A node that is loose (index in the control grid).
        node: usize,
        /// The axis along which it is loose: x, y or z.
        direction: char,
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
        "no equilibrium at {:.0} % of the load: {reason}, {residual:.2e} of the largest force is out of balance after {iterations} iterations, allowed {tolerance:.0e}",
        100.0 * load
    )]
    NoEquilibrium {
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

impl Error {
    /// An [`Error::Input`] for a scene key.
    pub fn input(key: impl Into<String>, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Input { key: key.into(), message: message.into(), help: help.into() }
    }

    /// What to do about it, if the error can say.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Input { help, .. } | Self::File { help, .. } => Some(help.clone()),
            Self::FoldedElement { .. } => {
                Some("move the control points, or the nodes of the mesh, so that no element folds".into())
            }
            Self::NotPositiveDefinite { .. } | Self::Mechanism { .. } => {
                Some("support more nodes, or use a topology with diagonals".into())
            }
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
