//! `springfit reproduce`: the tables of the thesis, theirs beside ours.

use std::io::IsTerminal;
use std::sync::Arc;

use serde_json::json;
use springfit::clock::Progress;
use springfit::report::reproduce;

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
    let found = reproduce::run(ids, &progress);
    drop(watcher);
    let found = found?;
    match json {
        true => terminal::print(&format!("{:#}", json!(found.rows))),
        false => terminal::print(found.text.trim()),
    }
}
