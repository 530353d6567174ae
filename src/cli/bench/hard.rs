//! `springfit bench hard`: every path of solution on every hard problem.

use clap::Args;
use serde_json::json;
use springfit::error::Result;
use springfit::report::bench::hard;
use springfit::report::bench::machine::Machine;
use springfit::report::bench::tables;

use super::{Figures, OutputArguments, watched};

#[derive(Debug, Args)]
pub struct HardArguments {
    /// Only problems whose name contains this
    #[arg(long, default_value = "", value_name = "WORD")]
    case: String,
    #[command(flatten)]
    output: OutputArguments,
}

pub fn run(arguments: &HardArguments) -> Result<()> {
    let (progress, watcher) = watched(arguments.output.threads)?;
    let machine = Machine::measure();
    let rows = hard::run(&arguments.case, &progress)?;
    drop(watcher);
    let figures = Figures {
        name: "bench-hard",
        document: json!({ "schema": "springfit-bench-hard/1", "version": env!("CARGO_PKG_VERSION"), "machine": machine,
            "rows": rows }),
        chart: hard::svg(&rows),
        table: format!("{}\n\n{}", tables::machine(&machine), hard::table(&rows)),
    };
    figures.put_out(&arguments.output)
}
