//! The integrators by name.
//!
//! All are one-step methods from (u, v, a) at t_n to (u, v, a) at t_{n+1} = t_n + h. The order is the power of h with which
//! the error at a given time falls.
//!
//! | name | order | energy of a linear body | largest stable step |
//! |---|---|---|---|
//! | leapfrog | 2 (1 with damping) | swings by (omega h)^2/4, no drift | (2/omega)(sqrt(1 + zeta^2) - zeta) |
//! | central_difference | 2 | as leapfrog | 2/omega |
//! | newmark (1/4, 1/2) | 2 | kept | none |
//! | midpoint | 2 | kept | none |
//! | implicit_euler | 1 | falls by 1/(1 + omega^2 h^2) a step | none |

use super::integrators::{central_difference, implicit_euler, leapfrog, midpoint, newmark};
use super::stepper::Stepper;
use crate::error::Result;

/// What bounds the step of an integrator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stability {
    /// Nothing: every step is stable on a linear body.
    Unconditional,
    /// The elastic force is explicit, the damping is not: h < 2/omega.
    Elastic,
    /// Elastic and damping force are explicit, the damping at the velocity half a step before: h^2 K + 2 h C < 4 M.
    ElasticAndDamping,
}

/// A way to step in time, chosen by its name.
pub struct Integrator {
    /// The word in the scene.
    pub name: &'static str,
    /// What it does, in a line.
    pub doc: &'static str,
    /// What bounds its step.
    pub stability: Stability,
    /// One step: moves the state of the stepper, but for its time, and leaves in `acting` the external force it saw.
    pub advance: fn(&mut Stepper) -> Result<()>,
}

impl std::fmt::Debug for Integrator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl Integrator {
    /// True when its step is bounded.
    pub fn is_explicit(&self) -> bool {
        self.stability != Stability::Unconditional
    }
}

/// All integrators.
pub const INTEGRATORS: &[Integrator] = &[
    Integrator {
        name: "leapfrog",
        doc: "explicit, one force evaluation a step, damping at the last half step (3.7-3.8 with full steps)",
        stability: Stability::ElasticAndDamping,
        advance: leapfrog::advance,
    },
    Integrator {
        name: "central_difference",
        doc: "explicit elastic force, damping centred in time: its step does not bound the damping",
        stability: Stability::Elastic,
        advance: central_difference::advance,
    },
    Integrator {
        name: "newmark",
        doc: "implicit, average acceleration (beta 1/4, gamma 1/2) unless told otherwise; keeps the energy of linear bodies",
        stability: Stability::Unconditional,
        advance: newmark::advance,
    },
    Integrator {
        name: "implicit_euler",
        doc: "implicit, first order, damps fast motion whatever the step",
        stability: Stability::Unconditional,
        advance: implicit_euler::advance,
    },
    Integrator {
        name: "midpoint",
        doc: "implicit midpoint, second order; keeps linear and angular momentum, and the energy of linear bodies",
        stability: Stability::Unconditional,
        advance: midpoint::advance,
    },
];

/// The integrator of this name.
pub fn find(name: &str) -> Option<&'static Integrator> {
    INTEGRATORS.iter().find(|integrator| integrator.name == name)
}
