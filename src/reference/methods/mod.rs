//! The methods: how each fills the integration points of its elements.

pub mod nurbs;
pub mod smoothed;
pub mod t10;
