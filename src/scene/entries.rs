//! The keys of a TOML document with their places in the text.
//!
//! Three questions are answered from them: where is this key (an error of a later check), which key is here (an error of
//! the deserialiser, which knows byte ranges only), and which numbers are not finite. The document is walked for every
//! question, and a path is written out for its answer only: the paths of all keys together can be as long as the square
//! of the file.

use std::ops::{ControlFlow, Range};

use toml_edit::{Document, Item, TableLike, Value};

/// One key of the document.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    /// Path such as `load[1].traction.face`.
    pub key: String,
    /// Byte range of the value; of a table, its header.
    pub value: Range<usize>,
    /// Byte range of the key itself; of an array element, that of the value.
    pub name: Range<usize>,
    /// The number, if the value is a floating-point number.
    pub float: Option<f64>,
}

/// What a walk calls at every key, each table before what it holds; it ends the walk with a break. The key of the entry is
/// the path.
type Visit<'a> = dyn FnMut(&Entry) -> ControlFlow<()> + 'a;

/// The first entry, in the order of the walk, of which the question is true.
pub(super) fn first(document: &Document<&str>, mut question: impl FnMut(&Entry) -> bool) -> Option<Entry> {
    let mut found = None;
    walk(document, &mut |entry| {
        if question(entry) {
            found = Some(entry.clone());
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    });
    found
}

/// The entry of this key, or else of the nearest key above it that is there.
pub(super) fn nearest(document: &Document<&str>, key: &str) -> Option<Entry> {
    let mut best: Option<Entry> = None;
    walk(document, &mut |entry| {
        let above = key.strip_prefix(&entry.key).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
        if above && best.as_ref().is_none_or(|best| best.key.len() < entry.key.len()) {
            best = Some(entry.clone());
        }
        ControlFlow::Continue(())
    });
    best
}

/// The innermost entry whose key or value covers this byte range.
pub(super) fn at(document: &Document<&str>, span: &Range<usize>) -> Option<Entry> {
    let covers = |range: &Range<usize>| range.start <= span.start && span.end <= range.end && !range.is_empty();
    let mut last = None;
    walk(document, &mut |entry| {
        if covers(&entry.name) || covers(&entry.value) {
            last = Some(entry.clone());
        }
        ControlFlow::Continue(())
    });
    last
}

fn walk(document: &Document<&str>, visit: &mut Visit) {
    let mut here = Entry { key: String::new(), value: 0..0, name: 0..0, float: None };
    // a break has said all that there is to say
    let _ = walk_table(document.as_table(), &mut here, visit);
}

fn walk_table(table: &dyn TableLike, here: &mut Entry, visit: &mut Visit) -> ControlFlow<()> {
    let above = here.key.len();
    for (name, item) in table.iter() {
        if above > 0 {
            here.key.push('.');
        }
        here.key.push_str(name);
        let place = table.key(name).and_then(|key| key.span()).unwrap_or_default();
        here.value = item.span().unwrap_or_else(|| place.clone());
        (here.name, here.float) = (place, item.as_float());
        visit(here)?;
        walk_item(item, here, visit)?;
        here.key.truncate(above);
    }
    ControlFlow::Continue(())
}

fn walk_item(item: &Item, here: &mut Entry, visit: &mut Visit) -> ControlFlow<()> {
    match item {
        Item::ArrayOfTables(tables) => {
            for (i, table) in tables.iter().enumerate() {
                let above = enter(here, i, table.span(), None);
                visit(here)?;
                walk_table(table, here, visit)?;
                here.key.truncate(above);
            }
            ControlFlow::Continue(())
        }
        Item::Table(table) => walk_table(table, here, visit),
        Item::Value(value) => walk_value(value, here, visit),
        Item::None => ControlFlow::Continue(()),
    }
}

fn walk_value(value: &Value, here: &mut Entry, visit: &mut Visit) -> ControlFlow<()> {
    match value {
        Value::Array(array) => {
            for (i, element) in array.iter().enumerate() {
                let above = enter(here, i, element.span(), element.as_float());
                visit(here)?;
                walk_value(element, here, visit)?;
                here.key.truncate(above);
            }
            ControlFlow::Continue(())
        }
        Value::InlineTable(table) => walk_table(table, here, visit),
        _ => ControlFlow::Continue(()),
    }
}

/// Goes to element `i` of the array here; returns the length of the path above it.
fn enter(here: &mut Entry, i: usize, place: Option<Range<usize>>, float: Option<f64>) -> usize {
    let above = here.key.len();
    here.key.push_str(&format!("[{i}]"));
    here.value = place.unwrap_or_default();
    here.name = here.value.clone();
    here.float = float;
    above
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "name = 'x'\n[a]\nb.c = [1.5, { d = nan }]\n[[l]]\ne = 1\n[[l]]\nf = { g = 2 }\n";

    #[test]
    fn keys_are_found_by_path_and_by_place() {
        let document = Document::parse(TEXT).unwrap();
        let mut entries = Vec::new();
        walk(&document, &mut |entry| {
            entries.push(entry.clone());
            ControlFlow::Continue(())
        });
        let keys: Vec<&str> = entries.iter().map(|entry| entry.key.as_str()).collect();
        let expected = [
            "name",
            "a",
            "a.b",
            "a.b.c",
            "a.b.c[0]",
            "a.b.c[1]",
            "a.b.c[1].d",
            "l",
            "l[0]",
            "l[0].e",
            "l[1]",
            "l[1].f",
        ];
        assert_eq!(keys[..12], expected);
        for entry in &entries {
            assert_eq!(nearest(&document, &entry.key).map(|found| found.name), Some(entry.name.clone()));
        }
        let text = |key: &str| nearest(&document, key).map(|entry| &TEXT[entry.value]);
        assert_eq!(text("l[1].f.g"), Some("2"));
        assert_eq!(text("l[1].nothing.here"), Some("[[l]]"));
        assert_eq!(text("a.b.c[7]"), Some("[1.5, { d = nan }]"));
        assert_eq!(text("nothing"), None);
        assert_eq!(first(&document, |entry| entry.float.is_some_and(f64::is_nan)).unwrap().key, "a.b.c[1].d");
        let place = TEXT.find("nan").unwrap();
        assert_eq!(at(&document, &(place..place + 3)).unwrap().key, "a.b.c[1].d");
        let place = TEXT.find("g = 2").unwrap();
        assert_eq!(at(&document, &(place..place + 1)).unwrap().key, "l[1].f.g");
    }
}
