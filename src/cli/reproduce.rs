//! `springfit reproduce`: the tables and experiments of the sources, theirs beside ours.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;

use serde_json::json;
use springfit::clock::Progress;
use springfit::export::write;
use springfit::report::reproduce;

use super::progress::{Watcher, stop_on_interrupt};
use super::{Result, terminal};

/// Computes the tables with these numbers, all when there are none; plots of motions go into the folder `out`.
///
/// # Errors
/// An unknown number, a folder that cannot be written, or an interruption.
pub fn run(ids: &[String], out: Option<&Path>, json: bool) -> Result<()> {
    let progress = Arc::new(Progress::default());
    stop_on_interrupt(&progress);
    let watcher = Watcher::start(Arc::clone(&progress), std::io::stderr().is_terminal());
    let found = reproduce::run(ids, &progress);
    drop(watcher);
    let found = found?;
    if let Some(folder) = out {
        for (name, text) in &found.plots {
            write::whole(&folder.join(name), text.as_bytes())?;
        }
    }
    match json {
        true => terminal::print(&format!("{:#}", json!(found.rows))),
        false => terminal::print(found.text.trim()),
    }
}
