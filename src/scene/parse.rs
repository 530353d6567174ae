//! From text to a [`Scene`]: reading, `--set`, TOML, types. Every failure keeps its line.

use std::path::Path;

use toml_edit::{Document, DocumentMut};

use crate::error::{Error, Result};

use super::choices::suggest;
use super::entries::{at, first};
use super::{Located, Scene, Source, check, overrides};

/// A scene that was read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// The scene.
    pub scene: Scene,
    /// Its text, to show the lines of later errors.
    pub source: Source,
    /// What is allowed but may not be meant.
    pub warnings: Vec<String>,
}

/// Largest scene file that is read, bytes.
pub const LARGEST_FILE: u64 = 128 << 10;

/// Reads a scene file, applies `--set KEY=VALUE`, parses and checks it.
///
/// A relative `geometry.file`, `load.file`, `springs.edge_file` or `calibration.springs` is taken from the folder of the scene.
///
/// # Errors
/// Whatever is wrong with the file or in it, with its line; exit status 2.
pub fn read(path: &Path, sets: &[String]) -> std::result::Result<Input, Located> {
    let mut source = Source { name: path.display().to_string(), text: read_text(path).map_err(Located::from)? };
    if !sets.is_empty() {
        source.text = edit(&source, sets)?;
    }
    let mut scene = parse(&source)?;
    if scene.name.is_empty() {
        scene.name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    }
    if let Some(folder) = path.parent() {
        scene.files_mut().for_each(|file| *file = folder.join(&file));
    }
    let warnings = check(&scene).map_err(|error| source.locate(error))?;
    Ok(Input { scene, source, warnings })
}

fn read_text(path: &Path) -> Result<String> {
    let wrong = |message: String, help: &str| Error::File { path: path.into(), message, help: help.into() };
    let cannot = |error: std::io::Error| wrong(format!("cannot be read: {error}"), "give the path of a scene (TOML)");
    let metadata = std::fs::metadata(path).map_err(cannot)?;
    if !metadata.is_file() {
        return Err(wrong("is not a regular file".into(), "give the path of a scene (TOML)"));
    }
    let size = metadata.len();
    if size > LARGEST_FILE {
        return Err(wrong(
            format!("{size} bytes are too many for a scene"),
            "a scene is at most 128 KiB of TOML; forces, bodies and sets of nodes go into files of their own",
        ));
    }
    let bytes = std::fs::read(path).map_err(cannot)?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..place].iter().filter(|&&byte| byte == b'\n').count();
        wrong(format!("line {line}: byte {place} is not UTF-8 text"), "save the scene as UTF-8")
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// The text with all `--set` applied.
fn edit(source: &Source, sets: &[String]) -> std::result::Result<String, Located> {
    let mut document: DocumentMut = source.text.parse().map_err(|error| syntax(source, &error))?;
    for set in sets {
        overrides::apply(&mut document, set)?;
    }
    Ok(document.to_string())
}

/// Parses a scene; nothing is checked beyond keys, types and that numbers are finite.
///
/// # Errors
/// With its line: text that is not TOML, an unknown or missing key, a wrong type, a number that is not finite.
pub fn parse(source: &Source) -> std::result::Result<Scene, Located> {
    let document = Document::parse(source.text.as_str()).map_err(|error| syntax(source, &error))?;
    if let Some(entry) = first(&document, |entry| entry.float.is_some_and(|value| !value.is_finite())) {
        let text = &source.text[entry.value.clone()];
        let error = Error::input(&entry.key, format!("{text} is not a finite number"), "give a finite number");
        return Err(source.place(error, entry.value.clone(), None));
    }
    toml::from_str(&source.text).map_err(|error| explain(source, &document, &error))
}

fn syntax(source: &Source, error: &toml_edit::TomlError) -> Located {
    let (message, help) = match error.message() {
        "duplicate key" => ("the key is given twice".to_owned(), "keep one of them"),
        message if message.ends_with("number overflowed") => {
            ("the number is too large".to_owned(), "floating-point numbers end near 1.8e308, whole numbers near 9.2e18")
        }
        message => (format!("not TOML: {message}"), "a line is KEY = VALUE, [TABLE] or [[load]]; strings need quotes"),
    };
    let span = error.span().unwrap_or_default();
    let line = 1 + source.text[..span.start.min(source.text.len())].matches('\n').count();
    let path = source.name.as_str().into();
    let error = Error::File { path, message: format!("line {line}: {message}"), help: help.into() };
    source.place(error, span, None)
}

/// Turns an error of the deserialiser into one of ours: key, value, what is allowed.
fn explain(source: &Source, document: &Document<&str>, error: &toml::de::Error) -> Located {
    let span = error.span().unwrap_or_default();
    let message = error.message();
    let here = at(document, &span).map_or(String::new(), |entry| entry.key);
    let here = here.as_str();
    let quoted = quoted(message);
    if let Some(rest) = message.strip_prefix("missing field ") {
        let name = rest.trim_matches('`');
        let key = if here.is_empty() { name.to_owned() } else { format!("{here}.{name}") };
        let error = Error::input(&key, "is missing", format!("add {key}; `springfit schema` describes every key"));
        return source.place(error, span, Some(format!("{name} is not here")));
    }
    let error = match message {
        _ if message.starts_with("unknown field") && quoted.len() > 1 => {
            Error::input(here, "unknown key", suggest(quoted[0], &quoted[1..], "known keys here are"))
        }
        _ if message.starts_with("unknown variant") && quoted.len() > 1 => {
            let help = suggest(quoted[0], &quoted[1..], "known names are");
            Error::input(here, format!("unknown name \"{}\"", quoted[0]), help)
        }
        _ => wrong_type(here, &source.text, span.clone(), message),
    };
    source.place(error, span, None)
}

/// "invalid type: string "x", expected f64" in the words of a user.
fn wrong_type(key: &str, text: &str, span: std::ops::Range<usize>, message: &str) -> Error {
    let value = text.get(span).unwrap_or_default();
    let expected = message.rsplit_once("expected ").map_or(message, |(_, expected)| expected);
    let expected = match expected {
        "f64" => "a number",
        "usize" | "u64" => "a whole number from 0",
        "a boolean" => "true or false",
        "a string" | "path string" | "wanted string or table" => "a string in quotes",
        "a sequence" if key == "load" => "[[load]], one table a load case",
        "a sequence" => "an array such as [1, 2]",
        expected if expected.starts_with("struct ") => "a table",
        expected => expected,
    };
    Error::input(key, format!("{value} cannot be used here"), format!("expected {expected}"))
}

/// The words between backquotes.
fn quoted(message: &str) -> Vec<&str> {
    message.split('`').skip(1).step_by(2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(text: &str) -> std::result::Result<Scene, Located> {
        parse(&Source { name: "a.toml".into(), text: text.into() })
    }

    #[test]
    fn the_smallest_scene_has_every_default() {
        let scene = scene("[material]\nyoung = 1\npoisson = 0\n").unwrap();
        assert_eq!(scene.calibration.gamma.values().unwrap().len(), 8);
        assert_eq!(scene.calibration.annealing.evaluations, 5000);
        assert_eq!(scene.springs.grouping, "length");
        assert_eq!(scene.dynamics, None);
    }

    #[test]
    fn a_scene_written_out_is_the_same_scene() {
        let text = "[material]\nyoung = 1\npoisson = 0\n[calibration]\ngamma = 0.25\n[dynamics]\nalpha = 3\n[[load]]\npoint = { node = 1, force = [1, 2] }\n[support]\nbox = { min = [0, 0], max = [1, 1] }\n";
        let scene = scene(text).unwrap();
        let again = super::tests::scene(&toml::to_string(&scene).unwrap()).unwrap();
        assert_eq!(scene, again);
    }

    #[test]
    fn types_are_explained_in_plain_words() {
        let material = "[material]\nyoung = 1\npoisson = 0\n";
        for (text, key, help) in [
            ("[material]\nyoung = 'x'\npoisson = 0\n", "material.young", "expected a number"),
            ("[material]\npoisson = 0\n", "material.young", "add material.young"),
            ("[calibration]\ngamma = 'x'\n", "calibration.gamma", "a number or { start"),
            ("[calibration]\ngamma = { stat = 0.1 }\n", "calibration.gamma.stat", "did you mean \"start\""),
            ("[calibration]\nstarts = -1\n", "calibration.starts", "a whole number"),
            ("[springs]\nweighting = 'cell'\n", "springs.weighting", "did you mean \"cells\""),
            ("[geometry]\nfile = 3\n", "geometry.file", "a string"),
            ("[geometry]\nmerge_seam = 3\n", "geometry.merge_seam", "true or false"),
            ("[geometry]\nsize = 3\n", "geometry.size", "an array"),
            ("[load]\nfit = true\n", "load", "[[load]]"),
            ("geometry = 3\n", "geometry", "a table"),
            ("[[load]]\nfit = true\n[[load]]\nbody_force = [1, 'x']\n", "load[1].body_force[1]", "a number"),
        ] {
            let text = if text.contains("[material]") { text.to_owned() } else { format!("{text}{material}") };
            let error = scene(&text).unwrap_err().error;
            let Error::Input { key: found, .. } = &error else { panic!("{error}") };
            assert_eq!(found, key, "{text}");
            assert!(error.help().unwrap().contains(help), "{text}: {:?}", error.help());
        }
    }

    #[test]
    fn byte_order_mark_and_carriage_returns_are_fine() {
        let folder = std::env::temp_dir();
        let path = folder.join(format!("springfit-crlf-{}.toml", std::process::id()));
        std::fs::write(&path, "\u{feff}[material]\r\nyoung = 1\r\npoisson = 0.2\r\n").unwrap();
        let text = read_text(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(scene(&text).unwrap().material.poisson, 0.2);
    }
}
