//! Every key of a TOML document with its place in the text, in one flat list.
//!
//! Three questions are answered from it: where is this key (an error of a later check), which key is here (an error of
//! the deserialiser, which knows byte ranges only), and which numbers are not finite.

use std::ops::Range;

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

/// All keys of a document, each table before what it holds.
pub(super) fn entries(document: &Document<&str>) -> Vec<Entry> {
    let mut entries = Vec::new();
    walk_table(document.as_table(), "", &mut entries);
    entries
}

fn walk_table(table: &dyn TableLike, path: &str, entries: &mut Vec<Entry>) {
    for (name, item) in table.iter() {
        let key = if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
        let place = table.key(name).and_then(|key| key.span()).unwrap_or_default();
        push(entries, &key, place.clone(), item.span().unwrap_or(place), item.as_float());
        walk_item(item, &key, entries);
    }
}

fn walk_item(item: &Item, path: &str, entries: &mut Vec<Entry>) {
    match item {
        Item::ArrayOfTables(tables) => {
            for (i, table) in tables.iter().enumerate() {
                let key = format!("{path}[{i}]");
                let place = table.span().unwrap_or_default();
                push(entries, &key, place.clone(), place, None);
                walk_table(table, &key, entries);
            }
        }
        Item::Table(table) => walk_table(table, path, entries),
        Item::Value(value) => walk_value(value, path, entries),
        Item::None => {}
    }
}

fn walk_value(value: &Value, path: &str, entries: &mut Vec<Entry>) {
    match value {
        Value::Array(array) => {
            for (i, element) in array.iter().enumerate() {
                let key = format!("{path}[{i}]");
                let place = element.span().unwrap_or_default();
                push(entries, &key, place.clone(), place, element.as_float());
                walk_value(element, &key, entries);
            }
        }
        Value::InlineTable(table) => walk_table(table, path, entries),
        _ => {}
    }
}

fn push(entries: &mut Vec<Entry>, key: &str, name: Range<usize>, value: Range<usize>, float: Option<f64>) {
    entries.push(Entry { key: key.to_owned(), value, name, float });
}

/// The entry of this key, or else of the nearest key above it that is there.
pub(super) fn nearest<'a>(entries: &'a [Entry], key: &str) -> Option<&'a Entry> {
    let mut key = key;
    loop {
        if let Some(entry) = entries.iter().find(|entry| entry.key == key) {
            return Some(entry);
        }
        key = &key[..key.rfind(['.', '['])?];
    }
}

/// The innermost entry whose key or value covers this byte range.
pub(super) fn at<'a>(entries: &'a [Entry], span: &Range<usize>) -> Option<&'a Entry> {
    let covers = |range: &Range<usize>| range.start <= span.start && span.end <= range.end && !range.is_empty();
    entries.iter().rev().find(|entry| covers(&entry.name) || covers(&entry.value))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "name = 'x'\n[a]\nb.c = [1.5, { d = nan }]\n[[l]]\ne = 1\n[[l]]\nf = { g = 2 }\n";

    #[test]
    fn keys_are_found_by_path_and_by_place() {
        let document = Document::parse(TEXT).unwrap();
        let entries = entries(&document);
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
            assert_eq!(nearest(&entries, &entry.key).map(|found| &found.name), Some(&entry.name));
        }
        let text = |key: &str| nearest(&entries, key).map(|entry| &TEXT[entry.value.clone()]);
        assert_eq!(text("l[1].f.g"), Some("2"));
        assert_eq!(text("l[1].nothing.here"), Some("[[l]]"));
        assert_eq!(text("a.b.c[7]"), Some("[1.5, { d = nan }]"));
        assert_eq!(text("nothing"), None);
        let place = TEXT.find("nan").unwrap();
        assert_eq!(at(&entries, &(place..place + 3)).unwrap().key, "a.b.c[1].d");
        let place = TEXT.find("g = 2").unwrap();
        assert_eq!(at(&entries, &(place..place + 1)).unwrap().key, "l[1].f.g");
    }
}
