//! `springfit check`: is the scene valid, and what would it build?

use serde_json::json;
use springfit::report::summary;
use springfit::scene;
use springfit::study::plan;

use super::{Result, SceneArguments, terminal};

/// Reads and checks a scene and prints it with every default filled in.
///
/// # Errors
/// Whatever is wrong with the scene.
pub fn run(arguments: &SceneArguments, json: bool) -> Result<()> {
    let input = scene::read(&arguments.scene, &arguments.set)?;
    let mut plan = plan::plan(&input.scene).map_err(|error| input.source.locate(error))?;
    plan.warnings.splice(0..0, input.warnings.iter().cloned());
    terminal::warn(&plan.warnings);
    match json {
        true => terminal::print(&format!("{:#}", json!(plan))),
        false => terminal::print(summary::check(&plan).trim_end()),
    }
}
