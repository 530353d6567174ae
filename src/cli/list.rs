//! `springfit list`: everything that a scene chooses by name.

use serde_json::{Map, Value, json};
use springfit::scene::{KINDS, Kind, find_kind};

use super::{Result, terminal};

/// Prints one table, or all of them.
///
/// # Errors
/// An unknown table.
pub fn run(kind: Option<&str>, json: bool) -> Result<()> {
    let kinds: Vec<&Kind> = match kind {
        Some(name) => vec![find_kind(name)?],
        None => KINDS.iter().collect(),
    };
    let text = match json {
        true => format!("{:#}", Value::Object(kinds.iter().map(|kind| (kind.name.into(), table(kind))).collect())),
        false => kinds.iter().map(|kind| lines(kind)).collect::<Vec<_>>().join("\n"),
    };
    terminal::print(&text)
}

/// A table as JSON: its key and its names.
fn table(kind: &Kind) -> Value {
    let names: Map<String, Value> =
        (kind.choices)().iter().map(|choice| (choice.name.into(), choice.doc.into())).collect();
    json!({ "key": kind.key, "names": names })
}

fn lines(kind: &Kind) -> String {
    let choices = (kind.choices)();
    let width = choices.iter().map(|choice| choice.name.len()).max().unwrap_or(0);
    let mut text = format!("{} ({})\n", kind.name, kind.key);
    for choice in choices {
        text += &format!("  {:width$}  {}\n", choice.name, choice.doc);
    }
    text
}
