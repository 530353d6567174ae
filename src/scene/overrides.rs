//! `--set KEY=VALUE`: changes to the text of a scene before it is read.
//!
//! The text itself is edited, so an error in a changed value shows its line like any other. A value is TOML; a bare word
//! is taken for a string, so that `--set springs.grouping=kind` needs no quotes. Elements of arrays and load cases are
//! reached by number: `load[0].fit` or `load.0.fit`.

use toml_edit::{DocumentMut, Item, Table, Value};

use crate::error::{Error, Result};

/// No key of a scene lies deeper.
const MOST_STEPS: usize = 16;

/// Sets a key of the document.
///
/// # Errors
/// [`Error::Input`] when `set` is not KEY=VALUE, the value is not TOML, or the key leads through something that is
/// neither a table nor an array.
pub(super) fn apply(document: &mut DocumentMut, set: &str) -> Result<()> {
    let wrong = |message: String| {
        Error::input(
            format!("--set {set}"),
            message,
            "--set KEY=VALUE, as in --set springs.grouping=kind or --set load[0].fit=false",
        )
    };
    let (key, value) = set.split_once('=').ok_or_else(|| wrong("there is no \"=\"".into()))?;
    let steps: Vec<&str> = key.trim().split(['.', '[']).map(|step| step.trim_end_matches(']').trim()).collect();
    if steps.iter().any(|step| step.is_empty()) || steps.len() > MOST_STEPS {
        return Err(wrong(format!("\"{key}\" is not a key")));
    }
    let value = read_value(value.trim()).map_err(|reason| wrong(format!("the value is not TOML: {reason}")))?;
    let mut place = document.as_item_mut();
    for (depth, step) in steps.iter().enumerate() {
        place = child(place, step).ok_or_else(|| wrong(format!("{} has no \"{step}\"", parent(&steps[..depth]))))?;
    }
    // The comment behind the old value stays where it is.
    let decor = place.as_value().map(|old| old.decor().clone());
    *place = Item::Value(value);
    if let (Some(decor), Some(value)) = (decor, place.as_value_mut()) {
        *value.decor_mut() = decor;
    }
    Ok(())
}

/// The item under a step; a key that is not there yet is made, an element of an array is not.
fn child<'a>(item: &'a mut Item, step: &str) -> Option<&'a mut Item> {
    if item.is_none() {
        *item = Item::Table(Table::new());
    }
    if item.is_table_like() {
        return item.as_table_like_mut().map(|table| table.entry(step).or_insert(Item::None));
    }
    let index: usize = step.parse().ok()?;
    item.get_mut(index)
}

fn parent(steps: &[&str]) -> String {
    if steps.is_empty() { "the scene".into() } else { steps.join(".") }
}

/// A TOML value, or a bare word as a string.
fn read_value(text: &str) -> std::result::Result<Value, String> {
    text.parse::<Value>().or_else(|error| {
        let bare = text.starts_with(char::is_alphabetic) && !text.contains(['"', '\'', '\n', '=']);
        if bare { Ok(Value::from(text)) } else { Err(error.message().to_owned()) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(text: &str, set: &str) -> Result<String> {
        let mut document: DocumentMut = text.parse().unwrap();
        apply(&mut document, set).map(|()| document.to_string())
    }

    #[test]
    fn a_value_changes_and_the_comment_stays() {
        let text = "[a]\nb = 1 # one\n[[l]]\nf = [1, 2]\n";
        assert_eq!(set(text, "a.b=2").unwrap(), "[a]\nb = 2 # one\n[[l]]\nf = [1, 2]\n");
        assert_eq!(set(text, "a.b = kind").unwrap(), "[a]\nb = \"kind\" # one\n[[l]]\nf = [1, 2]\n");
        assert_eq!(set(text, "l[0].f[1]=5").unwrap(), "[a]\nb = 1 # one\n[[l]]\nf = [1, 5]\n");
        assert_eq!(set(text, "l.0.f=[3]").unwrap(), "[a]\nb = 1 # one\n[[l]]\nf = [3]\n");
    }

    #[test]
    fn a_new_key_gets_its_table() {
        let text = set("[a]\nb = 1\n", "c.d.e=1e3").unwrap();
        let table: toml::Table = toml::from_str(&text).unwrap();
        assert_eq!(table["c"]["d"]["e"].as_float(), Some(1e3));
        assert_eq!(table["a"]["b"].as_integer(), Some(1));
        let text = set("[a]\nb = 1\n", "name=x").unwrap();
        assert_eq!(toml::from_str::<toml::Table>(&text).unwrap()["name"].as_str(), Some("x"));
    }

    #[test]
    fn what_cannot_be_set_says_why() {
        let text = "[a]\nb = 1\n[[l]]\nf = 1\n";
        for (wrong, reason) in [
            ("a.b", "no \"=\""),
            ("=1", "is not a key"),
            ("a..b=1", "is not a key"),
            ("a.b=[1", "not TOML"),
            ("a.b.c=1", "a.b has no \"c\""),
            ("l[3].f=1", "l has no \"3\""),
        ] {
            let message = set(text, wrong).unwrap_err().to_string();
            assert!(message.contains(reason), "{wrong}: {message}");
        }
    }
}
