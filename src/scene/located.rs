//! Errors that show their line: an [`Error`] with the text of the scene and the place in it.
//!
//! A scene key such as `load[1].force_per_node` is looked up in the parsed document. If the key is not there, the
//! nearest table above it that is there stands for it; in an empty file that is its beginning.

use std::ops::Range;

use miette::{LabeledSpan, NamedSource, SourceCode};
use toml_edit::Document;

use crate::error::Error;

use super::entries::{first, nearest};

/// A scene as text, with the name of its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// The file, as the user named it.
    pub name: String,
    /// Its text, `--set` applied.
    pub text: String,
}

/// An error and, where it belongs to a key of the scene, the line it comes from.
#[derive(Debug, Clone)]
pub struct Located {
    /// What went wrong.
    pub error: Error,
    place: Option<Box<Place>>,
}

#[derive(Debug, Clone)]
struct Place {
    source: NamedSource<String>,
    span: Range<usize>,
    label: Option<String>,
}

impl Source {
    /// Puts an error at the line of the key it comes from: its own, or that of the setting that made what failed. Other
    /// errors stay without a line, and so do all in a text that is not TOML.
    pub fn locate(&self, error: Error) -> Located {
        let Ok(document) = Document::parse(self.text.as_str()) else { return error.into() };
        let Some(key) = key_of(&error, &self.text, &document) else { return error.into() };
        let missing = Some(format!("{key} is not here"));
        match nearest(&document, &key) {
            Some(entry) if entry.key == key => self.place(error, entry.value.clone(), None),
            Some(entry) => self.place(error, entry.value.clone(), missing),
            None => self.place(error, 0..0, missing),
        }
    }

    /// Puts an error at a byte range of the text.
    pub(super) fn place(&self, error: Error, span: Range<usize>, label: Option<String>) -> Located {
        let end = self.text.len();
        let span = span.start.min(end)..span.end.min(end);
        let source = NamedSource::new(&self.name, self.text.clone());
        Located { error, place: Some(Box::new(Place { source, span, label })) }
    }
}

impl Located {
    /// Exit status of the command line, see [`Error::exit_status`].
    pub fn exit_status(&self) -> u8 {
        self.error.exit_status()
    }
}

impl From<Error> for Located {
    fn from(error: Error) -> Self {
        Self { error, place: None }
    }
}

impl std::fmt::Display for Located {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for Located {}

impl miette::Diagnostic for Located {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        self.error.help().map(|help| Box::new(help) as _)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place.as_ref().map(|place| &place.source as _)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let place = self.place.as_ref()?;
        let label = LabeledSpan::new(place.label.clone(), place.span.start, place.span.len());
        Some(Box::new(std::iter::once(label)))
    }
}

/// The scene key behind an error: its own, or the setting that made what failed.
fn key_of(error: &Error, text: &str, document: &Document<&str>) -> Option<String> {
    let given = |key: &str| first(document, |entry| entry.key == key);
    match error {
        Error::Input { key, .. } => Some(key.clone()),
        Error::File { path, .. } => {
            let files = ["geometry.file", "springs.edge_file", "calibration.springs"].into_iter().filter_map(given);
            let name = |value: std::ops::Range<usize>| text[value].trim_matches(['"', '\'']);
            files.into_iter().find(|entry| path.ends_with(name(entry.value.clone()))).map(|entry| entry.key)
        }
        Error::FoldedElement { .. } => Some("geometry".into()),
        Error::Mechanism { what, .. } if ["fitted", "given"].iter().any(|word| what.starts_with(word)) => {
            Some("calibration".into())
        }
        Error::Mechanism { what, .. } => {
            let topology = given("springs.topology").filter(|_| what.starts_with("spring"));
            Some(topology.map_or("support".into(), |entry| entry.key))
        }
        Error::OverLimit { limit, .. } => {
            let key = ["limits.memory", "limits.seconds"].into_iter().find(|key| limit.starts_with(key));
            Some(key.unwrap_or("geometry.control_points").into())
        }
        Error::UnstableStep { .. } | Error::NotConverged { .. } | Error::BlowUp { .. } => Some("dynamics.step".into()),
        _ => None,
    }
}
