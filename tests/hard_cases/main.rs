//! The hard cases: what breaks programs of this kind, a test for each, named in `springfit list hard-cases`.

mod bodies;
mod common;
mod files;
mod motion;
mod numbers;
mod promises;
mod runs;
mod springs;
mod supports;
mod table;
mod zero_modes;
