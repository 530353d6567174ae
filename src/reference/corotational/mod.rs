//! Corotational elasticity by domain: small strains in turned axes.
//!
//! A domain k (an element, a smoothing domain, a quadrature point; see [`crate::reference::methods::smoothed`]) has the
//! deformation gradient F_k = sum_a x_a gbar_ka^T of the present places x_a. Its rotation R_k is taken out
//! ([`rotation`]), and what is left is small and linear:
//!
//! ```text
//!     e_k = sym(R_k^T F_k) - 1                                  strain
//!     psi = mu e:e + lambda/2 tr(e)^2,   E = sum_k V_k psi      energy, J
//!     P_k = R_k (2 mu e_k + lambda tr(e_k) 1)                   first Piola-Kirchhoff stress, Pa
//!     f_a = - sum_k V_k P_k gbar_ka                             force, N
//! ```
//!
//! With the exact R_k the force is the exact gradient of E, because R^T dR is skew and contracts to nothing with symmetric
//! tensors; and it has no resultant torque, because P_k F_k^T is symmetric. (M. Mueller and M. Gross, Graphics Interface
//! 2004; by smoothing domain: Y. Zhang et al., Math. Probl. Eng. 2017, 1467356.)
//!
//! Only the second derivative has to know how R turns ([`Tangent`]).
//!
//! | file | idea |
//! |---|---|
//! | [`rotation`] | the rotation in a gradient: singular values with a sign, Newton steps from the last one |
//! | [`plane`] | the same in two dimensions |
//! | [`body`] | energy, force and products with the tangent, without a matrix |
//! | [`twist`] | what the turning of R adds to the second derivative |
//! | [`matrix`] | the tangent as a sparse matrix, filled again in place |
//! | [`held`] | the same over the free degrees of freedom |
//! | [`statics`] | equilibrium under large displacements, and the answers to load cases |
//! | [`inversion`] | which cells and domains are turned inside out |

pub mod body;
pub mod held;
pub mod inversion;
pub mod matrix;
pub mod plane;
pub mod rotation;
pub mod statics;
pub mod twist;

/// Which second derivative of the energy.
///
/// ```text
///     d2E = sum_k V_k (2 mu e':e' + lambda tr(e')^2)   with e' = sym(R^T dF)          warped
///         + sum_k V_k sum_{i<j} c_ij (q_ij : dF)^2                                    twist, see [`twist`]
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Tangent {
    /// Linear stiffness in turned axes, positive semidefinite; misses the stiffness that comes from stress.
    Warped,
    /// The second derivative.
    Exact,
    /// The second derivative without the negative part of the twist, positive semidefinite.
    Positive,
}
