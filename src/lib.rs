//! springfit fits mass-spring models to continuum elasticity, fast, with the error stated.
//!
//! The floors, from below; a file imports from its own room and from lower floors only:
//!
//! | floor | rooms |
//! |---|---|
//! | 4 | [`export`]: springs and fields as files |
//! | 2 | [`springs`]: networks, groups, the stiffness matrix K(phi) |
//! | 1 | [`geometry`]: knots, patches, shapes, degrees of freedom |
//! | 0 | [`sparse`]: patterns, assembly, orders, Cholesky; [`error`], [`clock`] |
#![warn(missing_docs)]

pub mod calibration;
pub mod clock;
pub mod dense;
pub mod error;
pub mod export;
pub mod geometry;
pub mod rng;
pub mod sparse;
pub mod springs;
