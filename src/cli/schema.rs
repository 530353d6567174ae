//! `springfit schema`: the JSON Schema of a scene, for editors that complete and check TOML.

use springfit::scene;

use super::{Result, terminal};

/// Prints the schema.
///
/// # Errors
/// Only when stdout cannot be written.
pub fn run() -> Result<()> {
    terminal::print(&format!("{:#}", scene::schema()))
}
