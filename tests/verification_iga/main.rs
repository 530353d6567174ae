//! The checks of `tests/reference/verification.json` that concern isogeometric elasticity: P1, P2, E1 to E4, E9.

mod bodies;
mod kirsch;
mod lame;
mod patch_test;
mod problem;
mod table;
mod timoshenko;
