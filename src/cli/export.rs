//! `springfit export`: a finished run in the format of another program.

use std::path::Path;

use springfit::export::formats;

use super::{Result, terminal};

/// Writes the run in the folder `run` in the format `name` into the folder `out`, into its own when there is none, and
/// prints the files, one a line.
///
/// # Errors
/// An unknown format, a folder without a result, a file that cannot be read or written.
pub fn run(run: &Path, name: &str, out: Option<&Path>) -> Result<()> {
    let files = formats::export(run, name, out.unwrap_or(run))?;
    let lines: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    terminal::print(&lines.join("\n"))
}
