//! `springfit compare`: two finished runs side by side.

use std::path::Path;

use springfit::export::finished;
use springfit::report::compare::Comparison;

use super::{Result, terminal};

/// Prints the runs in two folders side by side; that they are of different bodies or loads is a warning.
///
/// # Errors
/// A folder without a result, a file that cannot be read.
pub fn run(folders: [&Path; 2], json: bool) -> Result<()> {
    let [first, second] = folders.map(finished::read_result);
    let names = folders.map(|folder| folder.display().to_string());
    let comparison = Comparison::new(names, &[first?, second?]);
    terminal::warn(comparison.warning().as_slice());
    match json {
        true => terminal::print(&comparison.to_json()),
        false => terminal::print(comparison.table().trim_end()),
    }
}
