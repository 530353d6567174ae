//! `springfit bench tradeoff`: how much time a smaller error costs.

use clap::Args;
use serde_json::json;
use springfit::report::bench::machine::Machine;
use springfit::report::bench::tables;
use springfit::report::budget;
use springfit::scene::{self, Budget};
use springfit::study::budget::walk;
use springfit::study::checkpoint::Checkpoint;

use super::super::{Result, SceneArguments, terminal};
use super::{Figures, OutputArguments, watched};

#[derive(Debug, Args)]
pub struct TradeoffArguments {
    #[command(flatten)]
    input: SceneArguments,
    /// The finest grid of control points; geometry.control_points, or twice the spans of the shape's own, when absent
    #[arg(long, value_delimiter = ',', value_name = "N,...")]
    finest: Option<Vec<usize>>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Walks all resolutions of a scene and puts out error against the time of a step and of the calibration.
///
/// # Errors
/// A wrong scene, a folder that cannot be written to, or an interruption.
pub fn run(arguments: &TradeoffArguments) -> Result<()> {
    let mut input = scene::read(&arguments.input.scene, &arguments.input.set)?;
    terminal::warn(&input.warnings);
    // springs without stiffness are dropped as a budget does it; there is no limit to any of its numbers
    input.scene.budget.get_or_insert(Budget { max_error: f64::INFINITY, step_time: None, finest: None });
    let (progress, watcher) = watched(arguments.output.threads)?;
    let machine = Machine::measure();
    let front = walk(&input.scene, arguments.finest.as_deref(), &progress, &Checkpoint::none(), |_| false)
        .map_err(|error| input.source.locate(error))?;
    drop(watcher);
    let figures = Figures {
        name: "bench-tradeoff",
        document: json!({ "schema": "springfit-bench-tradeoff/1", "version": env!("CARGO_PKG_VERSION"),
            "machine": machine, "scene": input.scene.name, "front": budget::tried(&front) }),
        chart: budget::svg(&front),
        table: format!("{}\n\n{}", tables::machine(&machine), budget::table(&front, None)),
    };
    Ok(figures.put_out(&arguments.output)?)
}
