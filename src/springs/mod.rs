//! Floor 2: the springs. Who is joined to whom, which springs share a stiffness, and the stiffness matrix K(phi).
//!
//! The order of work: [`topology`] and [`edge_list`] join the nodes (control points, or those of a mesh) into a [`network::Network`]; [`grouping`] sorts its springs
//! into m groups; [`profiles`] and [`weighting`] say what one number phi_a of a group means for a spring, k_s = phi_a w_s; [`bounds`]
//! limits phi; [`affine`] turns phi into the stiffness matrix, [`members`] multiplies with its parts. [`solver`] solves with it for one phi after another, by
//! factors or by iterations with an old or rough factor, and [`prediction`] says which is cheaper. On fine grids
//! [`stencil`] multiplies with K(phi) without storing it, and [`multigrid_solver`] solves. [`damping`] is for bodies that
//! move. [`mechanism`] finds networks that move without resistance, [`residual`] says how well a solution holds. [`force`] is the
//! force of one spring, [`statics`] the equilibrium of all under large displacements, [`formulas`] are stiffnesses from the literature.

pub mod affine;
pub mod bounds;
pub mod damping;
pub mod edge_list;
pub mod force;
pub mod formulas;
pub mod grouping;
mod iterative;
pub mod mechanism;
pub mod members;
mod mesh_topology;
pub mod multigrid_solver;
pub mod network;
pub mod prediction;
pub mod profiles;
pub mod residual;
pub mod solver;
pub mod statics;
pub mod stencil;
pub mod topology;
pub mod weighting;
