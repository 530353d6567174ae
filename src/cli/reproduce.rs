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
    let found = match &compared {
        Ok(found) if found.is_none() || !tables.is_empty() => Some(reproduce::run(&tables, &progress)).transpose(),
        // nothing else was asked for, or it has failed
        _ => Ok(None),
    };
    drop(watcher);
    let (compared, found) = (compared?, found?);
    if json {
        let mut rows = found.map_or_else(Vec::new, |found| found.rows);
        rows.extend(compared.map(|compared| json!(compared)));
        return terminal::print(&format!("{:#}", json!(rows)));
    }
    if let Some(found) = found {
        terminal::print(found.text.trim())?;
    }
    compared.map_or(Ok(()), |compared| terminal::print(smoothed::table(&compared).trim()))
}
