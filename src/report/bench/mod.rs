//! Speed against error on this machine: what `springfit bench` measures and shows.
//!
//! Seconds say nothing without the error that was bought with them, and little without the machine: every row carries
//! both, and rates are also given as a share of what a dense matrix product reaches here ([`machine`]).
//!
//! | file | idea |
//! |---|---|
//! | [`cube`] | the problem of every size: a cube of n^3 control points |
//! | [`solve`] | K(phi) u = f by every method: seconds, error, memory, rate |
//! | [`methods`] | the methods: names and functions |
//! | [`calibrate`] | error against time of every way to calibrate a scene |
//! | [`growth`] | whole runs on finer and finer cubes: how time and memory grow |
//! | [`mod@hard`] | every path of solution on problems that are as bad as can be |
//! | [`step`] | a network in motion: springs a second, share of the bandwidth, error of the step |
//! | [`step_files`] | that network as files for other programs |
//! | [`bandwidth`] | how fast this machine reads |
//! | [`machine`] | the machine: processor, load, rate of a dense product |
//! | [`tables`] | tables for a person |
//! | [`chart`] | an SVG of error against time |
//! | [`matrix_market`] | the same systems as files for other solvers |

pub mod bandwidth;
pub mod calibrate;
pub mod chart;
pub mod cube;
pub mod growth;
pub mod hard;
pub mod machine;
pub mod matrix_market;
pub mod methods;
pub mod solve;
pub mod step;
pub mod step_files;
pub mod tables;
