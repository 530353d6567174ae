//! `springfit reproduce`: the tables and experiments of the thesis, theirs beside ours, and the comparison of smoothed
//! finite elements.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};
use springfit::clock::Progress;
use springfit::export::write;
use springfit::report::{reproduce, reproduce_motion, smoothed};

use super::progress::{Watcher, stop_on_interrupt};
use super::{Result, terminal};

/// Computes the tables with these numbers, all those of the thesis when there are none.
///
/// # Errors
/// An unknown number, an interruption, or a folder that cannot be written.
pub fn run(ids: &[String], out: Option<&Path>, json: bool) -> Result<()> {
    let progress = Arc::new(Progress::default());
    stop_on_interrupt(&progress);
    let watcher = Watcher::start(Arc::clone(&progress), std::io::stderr().is_terminal());
    let found = compare(ids, &progress);
    drop(watcher);
    let Found { rows, moving, smoothed } = found?;
    if let Some(folder) = out {
        for (name, text) in reproduce_motion::plots(&moving) {
            write::whole(&folder.join(name), text.as_bytes())?;
        }
    }
    if json {
        let thesis: Vec<Value> =
            json!(rows).as_array().into_iter().chain(json!(moving).as_array()).flatten().cloned().collect();
        let all: Vec<Value> = [thesis, smoothed.iter().map(|smoothed| json!(smoothed)).collect::<Vec<_>>()].concat();
        return terminal::print(&format!("{:#}", Value::Array(all)));
    }
    let smoothed = smoothed.as_ref().map_or(String::new(), smoothed::table);
    terminal::print(format!("{}{}{smoothed}", reproduce::table(&rows), reproduce_motion::table(&moving)).trim())
}

/// Rows of tables, of experiments in motion, and the comparison of smoothed finite elements.
struct Found {
    rows: Vec<reproduce::Comparison>,
    moving: Vec<reproduce_motion::Comparison>,
    smoothed: Option<smoothed::Comparison>,
}

fn compare(ids: &[String], progress: &Progress) -> springfit::error::Result<Found> {
    let experiments = reproduce_motion::known();
    let all = ids.is_empty() || ids.iter().any(|id| id == "all");
    let (smoothing, thesis): (Vec<String>, Vec<String>) = ids.iter().cloned().partition(|id| id == smoothed::NAME);
    let (moving, tables): (Vec<String>, Vec<String>) = match all {
        true => (experiments.iter().map(|&id| id.to_owned()).collect(), thesis),
        false => thesis.into_iter().partition(|id| experiments.contains(&id.as_str())),
    };
    Ok(Found {
        rows: if all || !tables.is_empty() { reproduce::run(&tables, progress)? } else { Vec::new() },
        moving: reproduce_motion::run(&moving, progress)?,
        smoothed: (!smoothing.is_empty()).then(|| smoothed::run(progress)).transpose()?,
    })
}
