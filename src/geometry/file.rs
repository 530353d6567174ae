//! A patch from a JSON file:
//!
//! ```json
//! {
//!   "degree": [2, 1],
//!   "knots": [[0, 0, 0, 1, 1, 1], [0, 0, 1, 1]],
//!   "points": [[0, 0], [0, 1], [1, 0], [1, 1], [2, 0], [2, 1]],
//!   "weights": [1, 1, 1, 1, 1, 1]
//! }
//! ```
//!
//! One degree and one knot vector a direction (2 or 3 of them), points in metres with as many coordinates as directions,
//! in C order of the control grid (last index fastest). Without weights all of them are 1.

use std::path::Path;

use serde::Deserialize;

use super::knots::KnotVector;
use super::patch::Patch;
use super::rows::{Chunks, Rows};
use crate::error::{Error, Result};

/// The file as it stands.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PatchFile {
    degree: Chunks<usize>,
    knots: Rows,
    points: Rows,
    weights: Option<Chunks<f64>>,
}

/// Reads a patch.
///
/// # Errors
/// [`Error::File`] with the line, and the entry such as `knots[1][4]`: a file that cannot be read, is not JSON of this
/// form, or holds values that [`KnotVector::new`] or [`Patch::new`] refuse.
pub fn read_patch(path: &Path) -> Result<Patch> {
    let refuse = |error: std::io::Error| file_error(path, error.to_string(), "give a patch file that can be read");
    // A device or a pipe has no size that would bound the memory.
    if !std::fs::metadata(path).map_err(refuse)?.is_file() {
        return Err(file_error(path, "not a regular file".into(), "give a patch file"));
    }
    parse_patch(&std::fs::read_to_string(path).map_err(refuse)?, path)
}

/// The patch in `text`; `path` is what errors name.
///
/// # Errors
/// As [`read_patch`].
pub fn parse_patch(text: &str, path: &Path) -> Result<Patch> {
    let help = "a patch file has the keys degree, knots, points and, if wanted, weights";
    let file: PatchFile = serde_json::from_str(text).map_err(|error| file_error(path, error.to_string(), help))?;
    build(file).map_err(|error| match error {
        Error::Input { key, message, help } => {
            let place = key.trim_start_matches("geometry.");
            let line = line_of(text, place).map_or(String::new(), |line| format!("line {line}, "));
            file_error(path, format!("{line}{place}: {message}"), &help)
        }
        other => other,
    })
}

/// Checks the counts that only the file has, then leaves the rest to the constructors.
fn build(file: PatchFile) -> Result<Patch> {
    let dimension = file.degree.len();
    if file.knots.len() != dimension {
        let message = format!("{} knot vectors for {dimension} degrees", file.knots.len());
        return Err(Error::input("knots", message, "one knot vector and one degree for each of 2 or 3 directions"));
    }
    if !(2..=3).contains(&dimension) {
        return Err(Error::input("degree", format!("{dimension} degrees"), "one for each of 2 or 3 directions"));
    }
    let degrees: Vec<usize> = file.degree.iter().copied().collect();
    let knots = file
        .knots
        .map(|a, values| KnotVector::new(degrees[a], values.to_vec()).map_err(|error| in_direction(error, a)))?;
    let points = file.points.map(|i, point| coordinates(i, point, dimension))?;
    let weights = file.weights.map_or_else(|| vec![1.0; points.len()], |weights| weights.iter().copied().collect());
    Patch::new(knots, points, weights)
}

/// A point of the file as three coordinates.
fn coordinates(i: usize, point: &[f64], dimension: usize) -> Result<[f64; 3]> {
    if point.len() != dimension {
        let message = format!("point {i} has {} coordinates", point.len());
        return Err(Error::input(format!("points[{i}]"), message, format!("as many as directions: {dimension}")));
    }
    Ok(std::array::from_fn(|a| point.get(a).copied().unwrap_or(0.0)))
}

/// Adds the direction to the key of a knot vector's error: `geometry.knots[4]` becomes `knots[a][4]`.
fn in_direction(error: Error, a: usize) -> Error {
    match error {
        Error::Input { key, message, help } => {
            let place = key.replacen("geometry.", "", 1);
            let name_end = place.find('[').unwrap_or(place.len());
            Error::input(format!("{}[{a}]{}", &place[..name_end], &place[name_end..]), message, help)
        }
        other => other,
    }
}

/// Line (from 1) on which the entry `place`, such as `knots[1][4]`, starts in `text`, which is a valid patch file.
fn line_of(text: &str, place: &str) -> Option<usize> {
    let (mut line, mut key, mut counters) = (1, "", Vec::<usize>::new());
    let mut between = true;
    let mut rest = text.bytes().enumerate();
    while let Some((at, byte)) = rest.next() {
        let starts_value = byte == b'[' || (between && (byte == b'-' || byte.is_ascii_digit()));
        if starts_value && is_place(place, key, &counters) {
            return Some(line);
        }
        between = b" \t\r\n,:[".contains(&byte);
        match byte {
            b'\n' => line += 1,
            b'[' => counters.push(0),
            b']' => drop(counters.pop()),
            b',' => counters.iter_mut().next_back().into_iter().for_each(|counter| *counter += 1),
            b'"' => {
                let end = at + 1 + text[at + 1..].find('"')?;
                key = &text[at + 1..end];
                rest.nth(end - at - 1);
            }
            _ => {}
        }
    }
    None
}

/// True when `place` is the key followed by the counters in brackets.
fn is_place(place: &str, key: &str, counters: &[usize]) -> bool {
    place
        .strip_prefix(key)
        .is_some_and(|indices| indices == counters.iter().map(|counter| format!("[{counter}]")).collect::<String>())
}

fn file_error(path: &Path, message: String, help: &str) -> Error {
    Error::File { path: path.to_owned(), message, help: help.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "{\n \"degree\": [2, 1],\n \"knots\": [\n  [0, 0, 0, 1, 1, 1],\n  [0, 0, 1, 1]],\n \"points\": [\n  [0, 0], [0, 1],\n  [1, 0], [1, 1],\n  [2, 0], [2, 1]],\n \"weights\": [1, 1,\n  0.5, 0.5,\n  1, 1]\n}\n";

    fn refusal(text: &str) -> String {
        parse_patch(text, Path::new("body.json")).unwrap_err().to_string()
    }

    #[test]
    fn a_file_is_the_patch_it_spells() {
        let patch = parse_patch(GOOD, Path::new("body.json")).unwrap();
        assert_eq!(patch.degree(), [2, 1, 0]);
        assert_eq!(patch.points()[3], [1.0, 1.0, 0.0]);
        assert_eq!(patch.weights()[2], 0.5);
        let unweighted = format!("{}}}", &GOOD[..GOOD.find(",\n \"weights").unwrap()]);
        assert_eq!(parse_patch(&unweighted, Path::new("body.json")).unwrap().weights(), [1.0; 6]);
    }

    #[test]
    fn wrong_values_are_named_with_file_line_and_index() {
        let cases = [
            (("0.5, 0.5", "0.5, -0.5"), "body.json: line 11, weights[3]: weight 3 is -0.5"),
            (("[1, 0]", "[1, 0, 0]"), "body.json: line 8, points[2]: point 2 has 3 coordinates"),
            (
                ("[0, 0, 1, 1]]", "[0, 0, 2, 1]]"),
                "body.json: line 5, knots[1][3]: knot 3 is 1, below the one before, 2",
            ),
            (("[2, 1],\n \"k", "[2, 0],\n \"k"), "body.json: line 2, degree[1]: degree 0 is not possible"),
            (
                ("[2, 0], [2, 1]]", "[2, 0]]"),
                "line 6, points: 5 control points, but the knots make a grid of [3, 2] nodes",
            ),
            (("\"weights\"", "\"weight\""), "unknown field `weight`"),
            (("[2, 1],\n \"k", "[2],\n \"k"), "body.json: line 3, knots: 2 knot vectors for 1 degrees"),
            (("0.5, 0.5", "1e400, 0.5"), "number out of range at line 11"),
            (("0.5, 0.5", "NaN, 0.5"), "at line 11"),
        ];
        for ((from, to), message) in cases {
            let refusal = refusal(&GOOD.replacen(from, to, 1));
            assert!(refusal.contains(message), "{refusal}");
        }
    }

    #[test]
    fn malformed_files_are_refused_and_nothing_panics() {
        let whole = GOOD.trim_end();
        for end in 0..whole.len() {
            assert!(parse_patch(&whole[..end], Path::new("cut.json")).is_err());
        }
        for at in 0..whole.len() {
            for byte in ["[", "]", "\"", "\\", ",", "-", "9", "e", "{"] {
                let _ = parse_patch(&format!("{}{byte}{}", &whole[..at], &whole[at + 1..]), Path::new("flip.json"));
            }
        }
        assert!(refusal(&"[".repeat(100_000)).contains("line 1"));
        assert!(refusal(&format!("\u{feff}{GOOD}")).contains("line 1"));
        assert!(refusal("").contains("line 1"));
        assert!(parse_patch(&GOOD.replace('\n', "\r\n"), Path::new("crlf.json")).is_ok());
        assert!(matches!(read_patch(Path::new("/no/such/file")), Err(Error::File { .. })));
        assert!(matches!(read_patch(Path::new("/")), Err(Error::File { .. })));
    }
}
