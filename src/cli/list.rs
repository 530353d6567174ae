//! `springfit list`: everything that is chosen by name, in a scene or on the command line.

use serde_json::{Map, Value, json};
use springfit::error::Error;
use springfit::export::EXPORTERS;
use springfit::export::formats::FORMATS;
use springfit::scene::{Choice, KINDS, Kind};

use super::{Result, terminal};

/// What results are written with: the tables that no scene key chooses from.
const OUTPUT_KINDS: [Kind; 2] = [
    Kind { name: "files", key: "run --out", choices: files },
    Kind { name: "exporters", key: "export --to", choices: exporters },
];

fn files() -> Vec<Choice> {
    EXPORTERS.iter().map(|exporter| Choice { name: exporter.name, doc: exporter.doc }).collect()
}

fn exporters() -> Vec<Choice> {
    FORMATS.iter().map(|format| Choice { name: format.name, doc: format.doc }).collect()
}

/// Prints one table, or all of them.
///
/// # Errors
/// An unknown table.
pub fn run(kind: Option<&str>, json: bool) -> Result<()> {
    let mut kinds: Vec<&Kind> = KINDS.iter().chain(&OUTPUT_KINDS).collect();
    let names = kinds.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", ");
    kinds.retain(|table| kind.is_none_or(|name| name == table.name));
    if kinds.is_empty() {
        let message = format!("there is no table {}", kind.unwrap_or_default());
        return Err(Error::input("KIND", message, format!("the tables are {names}")).into());
    }
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
