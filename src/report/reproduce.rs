//! Tables and experiments of the two sources, theirs beside ours.
//!
//! | file | what |
//! |---|---|
//! | `linear`, `chapter4`, `meshes`, [`release`] | chapter 4 and table 5.6 of the thesis: the objectives that are linear in the stiffness |
//! | `displacement` | the other tables of chapter 5: displacement calibrations |
//! | [`motion`] | experiments 4.II and 5.V: networks in motion |
//! | [`frontier`] | errors on loads outside the fit: groups that adapt beside groups by length |
//! | [`steady`] | the ladder of the frontier in other units, node numbers, threads and seeds |
//! | [`strain`] | the global strain (4.17) of the six bodies, by other definitions and under other supports |
//! | `words` | the sentences, each made from the numbers beside it |
//! | [`smoothed`] | the second source: smoothed finite elements on good and bad meshes |
//!
//! The thesis's figures that fix the supports are lost, and some of its values contradict each other; its tables are
//! targets to stand beside, never numbers to meet.

mod chapter4;
mod displacement;
pub mod frontier;
mod linear;
mod meshes;
pub mod motion;
pub mod release;
pub mod smoothed;
pub mod steady;
pub mod strain;
mod words;

use serde::Serialize;
use serde_json::Value;

use crate::clock::Progress;
use crate::error::{Error, Result};
use crate::report::thesis::TABLES;

/// What can be reproduced, in the order of the sources.
pub fn known() -> Vec<&'static str> {
    let linear = linear::TABLES.iter().map(|(id, _)| *id);
    let displacement = TABLES.iter().map(|table| table.id);
    linear
        .chain(displacement)
        .chain(motion::known())
        .chain([strain::NAME, smoothed::NAME, frontier::NAME, steady::NAME])
        .collect()
}

/// What was reproduced.
#[derive(Debug, Default)]
pub struct Reproduced {
    /// One object a row, each with its `table`.
    pub rows: Vec<Value>,
    /// The tables for people.
    pub text: String,
    /// Plots of the experiments in motion: name of the file and SVG.
    pub plots: Vec<(String, String)>,
}

impl Reproduced {
    /// Appends rows and their table.
    fn add<T: Serialize>(&mut self, rows: &[T], text: &str) {
        self.rows.extend(rows.iter().filter_map(|row| serde_json::to_value(row).ok()));
        self.text += text;
    }
}

/// Reproduces the tables and experiments with these numbers (all when empty).
///
/// # Errors
/// [`Error::Input`] for a number that is not known; whatever a run can fail with.
pub fn run(ids: &[String], progress: &Progress) -> Result<Reproduced> {
    for id in ids.iter().filter(|id| *id != "all") {
        if !known().contains(&id.as_str()) {
            let help = format!("the tables and experiments are {}, or all", known().join(", "));
            return Err(Error::input("ID", format!("there is no table {id}"), help));
        }
    }
    let all = ids.is_empty() || ids.iter().any(|id| id == "all");
    let wanted = |id: &str| all || ids.iter().any(|given| given == id);
    let mut found = Reproduced::default();
    let mut rows = Vec::new();
    for (id, _) in linear::TABLES.iter().filter(|(id, _)| wanted(id)) {
        rows.extend(linear::run(id, progress)?);
    }
    found.add(&rows, &linear::text(&rows));
    let rows = displacement::run(&wanted, progress)?;
    found.add(&rows, &displacement::text(&rows));
    let moving: Vec<String> = motion::known().into_iter().filter(|id| wanted(id)).map(str::to_owned).collect();
    let rows = motion::run(&moving, progress)?;
    found.add(&rows, &motion::table(&rows));
    found.plots = motion::plots(&rows);
    if wanted(strain::NAME) {
        let rows = strain::run(progress)?;
        found.add(&rows, &strain::table(&rows));
    }
    if wanted(smoothed::NAME) {
        let compared = smoothed::run(progress)?;
        let text = smoothed::table(&compared);
        found.add(&[compared], &text);
    }
    if wanted(frontier::NAME) {
        let rows = frontier::run(None, progress)?;
        found.add(&rows, &frontier::table(&rows));
    }
    if wanted(steady::NAME) {
        let rows = steady::run(None, None, progress)?;
        found.add(&rows, &steady::table(&rows));
    }
    Ok(found)
}
