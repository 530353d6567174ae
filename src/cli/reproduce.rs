//! `springfit reproduce`: the tables of the thesis, theirs beside ours.

use springfit::error::Error;

use super::Result;

/// Tables that can be computed again.
const TABLES: [&str; 5] = ["5.2", "5.3", "5.4", "5.5", "5.7"];

/// Computes the tables with these numbers, all when there are none.
///
/// # Errors
/// An unknown number.
pub fn run(ids: &[String], _json: bool) -> Result<()> {
    if let Some(unknown) = ids.iter().find(|id| !TABLES.contains(&id.as_str())) {
        let message = format!("there is no table {unknown}");
        return Err(Error::input("ID", message, format!("known tables are {}", TABLES.join(", "))).into());
    }
    Err(Error::input("reproduce", "the tables are not wired in yet", "use run").into())
}
