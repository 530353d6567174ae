//! `springfit new NAME`: a commented scene to start from.

use springfit::scene;

use super::{Result, terminal};

/// Prints the scene of a shape.
///
/// # Errors
/// An unknown shape.
pub fn run(name: &str) -> Result<()> {
    terminal::print(&scene::template(name)?)
}
