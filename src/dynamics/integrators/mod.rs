//! The integrators, one file each; [`super::integrator::INTEGRATORS`] is their table.

pub mod central_difference;
pub mod implicit_euler;
pub mod leapfrog;
pub mod midpoint;
pub mod newmark;
