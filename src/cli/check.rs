//! `springfit check`: is the scene valid, and what would it build?

use serde_json::json;
use springfit::scene;

use super::{Result, SceneArguments, terminal};

/// Reads and checks a scene and prints it with every default filled in.
///
/// # Errors
/// Whatever is wrong with the scene.
pub fn run(arguments: &SceneArguments, json: bool) -> Result<()> {
    let input = scene::read(&arguments.scene, &arguments.set)?;
    terminal::warn(&input.warnings);
    match json {
        true => terminal::print(&format!("{:#}", json!({ "scene": input.scene, "warnings": input.warnings }))),
        false => terminal::print(&format!("{}: the scene is valid", input.source.name)),
    }
}
