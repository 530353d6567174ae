//! The checks of `tests/reference/verification.json` that concern finite elements: P1, P3, P4, E4, E5, E9, and what every
//! method has to do: rigid motions cost nothing, masses add up, a grid of Q4 is a patch of degree 1.

mod cook;
mod cylinder;
mod every_method;
mod locking;
mod patch_test;
mod problem;
#[path = "../verification_iga/table.rs"]
mod table;
mod timoshenko;
