//! `springfit reproduce`: the tables and experiments of the thesis, theirs beside ours.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};
use springfit::clock::Progress;
use springfit::export::write;
use springfit::report::{reproduce, reproduce_motion};

use super::progress::{Watcher, stop_on_interrupt};
use super::{Result, terminal};

/// Computes the tables with these numbers, all when there are none.
///
/// # Errors
/// An unknown number, an interruption, or a folder that cannot be written.
pub fn run(ids: &[String], out: Option<&Path>, json: bool) -> Result<()> {
    let progress = Arc::new(Progress::default());
    stop_on_interrupt(&progress);
    let watcher = Watcher::start(Arc::clone(&progress), std::io::stderr().is_terminal());
    let rows = compare(ids, &progress);
    drop(watcher);
    let (rows, moving) = rows?;
    if let Some(folder) = out {
        for (name, text) in reproduce_motion::plots(&moving) {
            write::whole(&folder.join(name), text.as_bytes())?;
        }
    }
    match json {
        true => {
            let both = json!(rows).as_array().into_iter().chain(json!(moving).as_array()).flatten().cloned().collect();
            terminal::print(&format!("{:#}", Value::Array(both)))
        }
        false => terminal::print(format!("{}{}", reproduce::table(&rows), reproduce_motion::table(&moving)).trim()),
    }
}

/// The rows of tables and of experiments in motion.
fn compare(
    ids: &[String],
    progress: &Progress,
) -> springfit::error::Result<(Vec<reproduce::Comparison>, Vec<reproduce_motion::Comparison>)> {
    let experiments = reproduce_motion::known();
    let all = ids.is_empty() || ids.iter().any(|id| id == "all");
    let (moving, tables): (Vec<String>, Vec<String>) = match all {
        true => (experiments.iter().map(|&id| id.to_owned()).collect(), ids.to_vec()),
        false => ids.iter().cloned().partition(|id| experiments.contains(&id.as_str())),
    };
    let rows = if all || !tables.is_empty() { reproduce::run(&tables, progress)? } else { Vec::new() };
    Ok((rows, reproduce_motion::run(&moving, progress)?))
}
