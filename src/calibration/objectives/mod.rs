//! The distances between network and continuum.

pub mod displacement;
