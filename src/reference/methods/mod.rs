//! The methods: how each fills the integration points of its elements.

pub mod nurbs;
