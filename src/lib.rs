//! springfit fits mass-spring models to continuum elasticity, fast, with the error stated.
//!
//! The floors, from below; a file imports from its own room and from lower floors only:
//!
//! | floor | rooms |
//! |---|---|
//! | 6 | [`report`]: a study as a document, as tables, beside the tables of the sources |
//! | 5 | [`study`]: from a scene to a calibrated network, the method step by step |
//! | 4 | [`scene`]: the text of a user as checked settings; [`export`]: springs and fields as files |
//! | 3 | [`calibration`]: objectives, optimisers, the gamma sweep; [`dynamics`]: bodies and networks in motion |
//! | 2 | [`mod@reference`]: the elastic body, solved; [`springs`]: networks, groups, the stiffness matrix K(phi) |
//! | 1 | [`geometry`]: knots, patches, shapes, degrees of freedom |
//! | 0 | [`sparse`]: patterns, assembly, orders, Cholesky; [`dense`], [`rng`], [`clock`], [`memory`], [`readable`], [`error`]; `lanes`: eight numbers in a register |
#![warn(missing_docs)]

pub mod calibration;
pub mod clock;
pub mod dense;
pub mod dynamics;
pub mod error;
pub mod export;
pub mod geometry;
mod lanes;
pub mod memory;
pub mod readable;
pub mod reference;
pub mod report;
pub mod rng;
pub mod scene;
pub mod sparse;
pub mod springs;
pub mod study;
