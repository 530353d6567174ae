//! Forces from a JSON file: one force for every control point.
//!
//! ```text
//! [[80, -40, 40], [0, 0, 0], ...]                                      the forces of one case
//! { "cases": { "push": [[80, -40, 40], ...], ... } }                   several cases
//! { "bodies": { "cube": { "cases": { "push": [[...], ...] } } } }      several bodies
//! ```
//!
//! Forces in N in the order of the control points, one component a direction of space. Other keys are left to the user.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::Deserialize;

use crate::error::{Error, Result};

/// Largest file that is read, bytes.
const LARGEST_FILE: u64 = 1 << 28;

type Forces = Vec<Vec<f64>>;

#[derive(Deserialize)]
struct Cases {
    cases: BTreeMap<String, Forces>,
}

#[derive(Deserialize)]
struct Bodies {
    bodies: BTreeMap<String, Cases>,
}

/// Which forces of a file are meant.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// The body, if the file holds several.
    pub body: Option<&'a str>,
    /// The case, if the file holds several.
    pub case: Option<&'a str>,
    /// Directions of the body, 2 or 3.
    pub dimension: usize,
    /// Control points of the body.
    pub nodes: usize,
}

/// Reads the forces in N on every control point, nodes x 3.
///
/// # Errors
/// [`Error::File`] with the place in the file: text that is not such a document, another number of forces or components;
/// [`Error::Input`] at `load.body` or `load.case` for one that is not there.
pub fn read(path: &Path, wanted: Wanted) -> Result<Vec<[f64; 3]>> {
    let wrong = |message: String, help: &str| Error::File { path: path.into(), message, help: help.into() };
    let cannot =
        |error: std::io::Error| wrong(format!("cannot be read: {error}"), "give the path of a JSON file with forces");
    let metadata = fs::metadata(path).map_err(cannot)?;
    if !metadata.is_file() || metadata.len() > LARGEST_FILE {
        let message = format!("is not a regular file of at most {LARGEST_FILE} bytes");
        return Err(wrong(message, "give the path of a JSON file with forces"));
    }
    parse(&fs::read_to_string(path).map_err(cannot)?, path, wanted)
}

/// The forces in the text of such a file; errors name it by `path`.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: &Path, wanted: Wanted) -> Result<Vec<[f64; 3]>> {
    let wrong = |message: String, help: &str| Error::File { path: path.into(), message, help: help.into() };
    let unreadable = |error: serde_json::Error| {
        wrong(format!("{error}"), "one force [x, y, z] in N for every control point; see `springfit schema`, load.file")
    };
    let forces = if text.trim_start().starts_with('[') {
        serde_json::from_str::<Forces>(text).map_err(unreadable)?
    } else if let Some(body) = wanted.body {
        let bodies = serde_json::from_str::<Bodies>(text).map_err(unreadable)?.bodies;
        pick(pick(bodies, "body", Some(body))?.cases, "case", wanted.case)?
    } else {
        let cases = serde_json::from_str::<Cases>(text).map_err(unreadable)?.cases;
        pick(cases, "case", wanted.case)?
    };
    pad(&forces, wanted).map_err(|(message, help)| wrong(message, &help))
}

/// The entry of this name, or the only one; the key of an error is `load.body` or `load.case`.
fn pick<T>(mut all: BTreeMap<String, T>, what: &str, name: Option<&str>) -> Result<T> {
    let known = all.keys().take(20).cloned().collect::<Vec<_>>().join(", ");
    let name = match (name, all.len()) {
        (Some(name), _) => name.to_owned(),
        (None, 1) => known.clone(),
        (None, count) => {
            let message = format!("the file holds {count} of them, and the scene does not say which");
            return Err(Error::input(format!("load.{what}"), message, format!("one of {known}")));
        }
    };
    let missing = || {
        Error::input(format!("load.{what}"), format!("the file has no {what} \"{name}\""), format!("it has {known}"))
    };
    all.remove(&name).ok_or_else(missing)
}

/// The forces with three components, if there are as many as the body asks for.
fn pad(forces: &Forces, wanted: Wanted) -> std::result::Result<Vec<[f64; 3]>, (String, String)> {
    if forces.len() != wanted.nodes {
        let help = "give one for every control point, in their order".to_owned();
        return Err((format!("{} forces for {} control points", forces.len(), wanted.nodes), help));
    }
    if let Some(node) = forces.iter().position(|force| force.len() != wanted.dimension) {
        let message = format!("the force of control point {node} has {} components", forces[node].len());
        return Err((message, format!("give {}, one for each direction", wanted.dimension)));
    }
    Ok(forces.iter().map(|force| std::array::from_fn(|i| force.get(i).copied().unwrap_or(0.0))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attempt(text: &str, body: Option<&str>, case: Option<&str>) -> std::result::Result<Vec<[f64; 3]>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("forces.json");
        fs::write(&path, text).unwrap();
        let read = read(&path, Wanted { body, case, dimension: 2, nodes: 2 });
        read.map_err(|error| format!("{error}; {}", error.help().unwrap()))
    }

    #[test]
    fn forces_are_found_in_a_list_a_case_and_a_body() {
        let expected = vec![[1.0, 2.0, 0.0], [3.0, 4.0, 0.0]];
        assert_eq!(attempt("[[1,2],[3,4]]", None, None).unwrap(), expected);
        assert_eq!(attempt(r#"{"cases":{"push":[[1,2],[3,4]]}}"#, None, None).unwrap(), expected);
        let bodies = r#"{"what":"","bodies":{"a":{"control_points":[2],"cases":{"push":[[1,2],[3,4]],"pull":[]}}}}"#;
        assert_eq!(attempt(bodies, Some("a"), Some("push")).unwrap(), expected);
    }

    #[test]
    fn what_is_wrong_with_a_file_is_said_with_its_place() {
        let cases = r#"{"cases":{"a":[[1,2],[3,4]],"b":[]}}"#;
        for (text, body, case, expected) in [
            ("[[1,2],[3]]", None, None, "control point 1 has 1 components; give 2"),
            ("[[1,2]]", None, None, "1 forces for 2 control points"),
            ("[[1,2],[3,x]]", None, None, "line 1 column"),
            ("[[1,2],[3,1e999]]", None, None, "out of range"),
            (cases, None, None, "load.case: the file holds 2 of them, and the scene does not say which; one of a, b"),
            (cases, None, Some("c"), "has no case \"c\"; it has a, b"),
            (cases, Some("cube"), None, "missing field `bodies`"),
            ("", None, None, "EOF"),
        ] {
            let found = attempt(text, body, case).unwrap_err();
            assert!(found.contains(expected), "{text}: {found}");
        }
    }
}
