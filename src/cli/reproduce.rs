//! `springfit reproduce`: the tables of the thesis, theirs beside ours, and the comparison of smoothed methods.

use std::io::IsTerminal;
use std::sync::Arc;

use serde_json::json;
use springfit::clock::Progress;
use springfit::report::{reproduce, smoothed};

use super::progress::{Watcher, stop_on_interrupt};
use super::{Result, terminal};

/// Computes the tables with these numbers, all when there are none.
///
/// # Errors
/// An unknown number, or an interruption.
pub fn run(ids: &[String], json: bool) -> Result<()> {
    let progress = Arc::new(Progress::default());
    stop_on_interrupt(&progress);
    let watcher = Watcher::start(Arc::clone(&progress), std::io::stderr().is_terminal());
    let compared = ids.iter().any(|id| id == smoothed::NAME).then(|| smoothed::run(&progress)).transpose();
    let tables: Vec<String> = ids.iter().filter(|id| *id != smoothed::NAME).cloned().collect();
    let rows = match &compared {
        Ok(found) if found.is_none() || !tables.is_empty() => reproduce::run(&tables, &progress),
        // nothing else was asked for, or it has failed
        _ => Ok(Vec::new()),
    };
    drop(watcher);
    let (compared, rows) = (compared?, rows?);
    if json {
        let found = match compared {
            Some(compared) => json!({ "tables": rows, "smoothed": compared }),
            None => json!(rows),
        };
        return terminal::print(&format!("{found:#}"));
    }
    if !rows.is_empty() {
        terminal::print(reproduce::table(&rows).trim())?;
    }
    compared.map_or(Ok(()), |compared| terminal::print(smoothed::table(&compared).trim()))
}
