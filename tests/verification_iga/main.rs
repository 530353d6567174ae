//! The checks of `tests/reference/verification.json` that concern isogeometric elasticity: P1, P2, E1 to E4, E9;
//! and the error of a mesh against a finer one where both are known.

mod bodies;
mod converged;
mod kirsch;
mod lame;
mod patch_test;
mod problem;
mod table;
mod timoshenko;
