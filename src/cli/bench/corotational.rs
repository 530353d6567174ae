//! `springfit bench corotational`: what a step of the corotational beam costs, by stage.

use clap::Args;
use serde_json::json;
use springfit::error::{Error, Result};
use springfit::report::bench::chart::{self, Labels, Series};
use springfit::report::bench::machine::Machine;
use springfit::report::bench::tables;
use springfit::report::reproduce::smoothed::{self, TIMED, Timed};

use super::{Figures, OutputArguments, watched};

/// Cells along the beam over cells across it.
const SLENDER: usize = 5;

/// Most cells along the beam.
const MOST: usize = 200;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Cells along the beam of each mesh, multiples of 5; a fifth of them along its other edges
    #[arg(long, value_delimiter = ',', default_values_t = TIMED.map(|cells| cells[0]), value_name = "N,...")]
    sizes: Vec<usize>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Measures the steps, and puts them out.
///
/// # Errors
/// A size out of range; an interruption; a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(size) = arguments.sizes.iter().find(|&&size| size == 0 || size > MOST || size % SLENDER != 0) {
        let help = format!("multiples of {SLENDER} up to {MOST} cells along the beam");
        return Err(Error::input("--sizes", format!("{size} is out of range"), help));
    }
    let (progress, watcher) = watched(arguments.output.threads)?;
    let machine = Machine::measure();
    let meshes: Vec<[usize; 3]> = arguments.sizes.iter().map(|&n| [n, n / SLENDER, n / SLENDER]).collect();
    let rows = smoothed::steps(&meshes, &progress)?;
    drop(watcher);
    let points = |row: &Timed| (row.cost.domains as f64, row.cost.whole(), row.cells[0].to_string());
    let mut methods: Vec<&str> = rows.iter().map(|row| row.method).collect();
    methods.dedup();
    methods.truncate(rows.len() / meshes.len().max(1));
    let of = |method: &str| rows.iter().filter(|row| row.method == method).map(points).collect();
    let series: Vec<_> = methods.iter().map(|method| Series { name: (*method).into(), points: of(method) }).collect();
    let labels = Labels { title: "one step of a corotational beam", time: "domains", error: "processor seconds" };
    let figures = Figures {
        name: "bench-corotational",
        document: json!({ "schema": "springfit-bench-corotational/1", "version": env!("CARGO_PKG_VERSION"),
            "machine": machine, "rows": rows }),
        chart: chart::svg(&labels, &series),
        table: format!("{}\n\n{}", tables::machine(&machine), smoothed::step_table(&rows)),
    };
    figures.put_out(&arguments.output)
}
