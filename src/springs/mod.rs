//! Floor 2: the springs. Who is joined to whom, which springs share a stiffness, and the stiffness matrix K(phi).
//!
//! The order of work: [`topology`] joins the control points into a [`network::Network`]; [`grouping`] sorts its springs
//! into m groups; [`weighting`] says what one number phi_a of a group means for a spring, k_s = phi_a w_s; [`bounds`]
//! limits phi; [`affine`] turns phi into the stiffness matrix. [`masses`] and [`damping`] are for bodies that move.

pub mod affine;
pub mod bounds;
pub mod damping;
pub mod grouping;
pub mod masses;
pub mod multigrid_solver;
pub mod network;
pub mod stencil;
pub mod topology;
pub mod weighting;
