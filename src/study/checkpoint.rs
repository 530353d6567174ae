//! What a long run has finished so far, in a file that a later run goes on from.
//!
//! `checkpoint.json` lies in the output folder while a run is under way and is removed when its results are there. It
//! holds the outcome of every finished piece of the sweep ([`crate::calibration::pieces`]): problems, and starts and
//! chains of the problems under way. Floating-point numbers are written so that reading gives back every bit. What is
//! cheap beside the search is not in it and done again: the reference, the springs, the confirmation of each answer.
//!
//! The file is always whole, see [`mod@crate::export::write`]. It is written when a piece is finished, but so seldom
//! that writing takes at most a twentieth of the time ([`SHARE`]): on a fast disk some milliseconds of work are lost when
//! the machine stops, on a slow one what was finished in the last twenty times that a write takes.
//!
//! A checkpoint serves the run that made it and no other: [`Checkpoint::resume`] compares schema, version, seed and every
//! key of the scene, and the sweep compares the numbers that it begins with (forces, reference, bounds, groups, as a
//! digest of their bits), which differ when a file behind the scene has changed. A digest of the whole guards against
//! damage.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::calibration::optimiser::Outcome;
use crate::calibration::pieces::{Piece, Stage};
use crate::clock::Stopwatch;
use crate::error::{Error, Result};
use crate::export::write;
use crate::scene::Scene;

/// Name of the file in the output folder.
pub const NAME: &str = "checkpoint.json";

/// Name and version of its format.
pub const SCHEMA: &str = "springfit-checkpoint/1";

/// Part of the time that may go into writing checkpoints.
pub const SHARE: f64 = 0.05;

/// What is in the file, beside its schema and the digest of this.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    version: String,
    seed: u64,
    scene: Value,
    sweeps: Vec<Sweep>,
}

/// One sweep; a run may need a second one, on another path of solution.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Sweep {
    /// [`digest`] of the numbers that it began with.
    inputs: String,
    /// How many problems it has.
    problems: usize,
    /// In the order of the pieces.
    pieces: Vec<(Piece, Outcome)>,
}

/// The checkpoint of a run.
pub struct Checkpoint {
    /// None: nothing is kept.
    path: Option<PathBuf>,
    state: Mutex<State>,
}

struct State {
    content: Content,
    /// The sweeps of the run before.
    earlier: Vec<Sweep>,
    /// Time since the last write ended, and how long to wait from there, s.
    pause: (Stopwatch, f64),
    unwritten: bool,
    failure: Option<Error>,
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finished {
    /// Problems that are answered.
    pub answers: usize,
    /// Problems of the sweep.
    pub problems: usize,
    /// Starts and chains that are finished in the other problems.
    pub others: usize,
    /// Smallest error of an answer, percent.
    pub least_error: Option<f64>,
}

impl Checkpoint {
    /// Keeps nothing.
    pub fn none() -> Self {
        Self::with(None, Content { version: String::new(), seed: 0, scene: Value::Null, sweeps: vec![] }, vec![])
    }

    /// A new checkpoint of a scene in a folder. What an earlier run left there is replaced when a piece is finished.
    pub fn begin(folder: &Path, scene: &Scene) -> Self {
        Self::with(Some(folder.join(NAME)), Content::of(scene), vec![])
    }

    /// The checkpoint that an earlier run of the same scene left in a folder; a new one if there is none.
    ///
    /// # Errors
    /// [`Error::File`] that names the file and what differs: damage, version, seed or a key of the scene.
    pub fn resume(folder: &Path, scene: &Scene) -> Result<Self> {
        let path = folder.join(NAME);
        if path.exists() && !path.is_file() {
            return Err(refusal(&path, "is not a regular file".into()));
        }
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::begin(folder, scene)),
            Err(error) => return Err(refusal(&path, format!("cannot be read: {error}"))),
        };
        let ours = Content::of(scene);
        let theirs = parse(&bytes).map_err(|message| refusal(&path, message))?;
        ours.agrees_with(&theirs).map_err(|message| refusal(&path, message))?;
        Ok(Self::with(Some(path), ours, theirs.sweeps))
    }

    fn with(path: Option<PathBuf>, content: Content, earlier: Vec<Sweep>) -> Self {
        let pause = (Stopwatch::start(), 0.0);
        Self { path, state: Mutex::new(State { content, earlier, pause, unwritten: false, failure: None }) }
    }

    /// Enters a sweep that begins with these inputs and `groups[i]` groups in the problem of index `i`.
    ///
    /// # Errors
    /// [`Error::File`] when the sweep of the earlier run began with others.
    pub fn enter(&self, inputs: u64, groups: &[(usize, usize)]) -> Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        let mut state = self.state();
        let inputs = format!("{inputs:016x}");
        let number = state.content.sweeps.len();
        let pieces = match state.earlier.get(number) {
            None => vec![],
            Some(sweep) if sweep.inputs != inputs => {
                let what =
                    "comes from other numbers: a file that the scene names has changed, or the machine is another";
                return Err(refusal(path, what.into()));
            }
            Some(sweep) => sweep.pieces.clone(),
        };
        let fits = |(piece, outcome): &(Piece, Outcome)| groups.contains(&(piece.problem, outcome.phi.len()));
        if !pieces.iter().all(fits) || !pieces.is_sorted_by_key(|(piece, _)| *piece) {
            return Err(refusal(path, "has pieces of problems that the scene does not have".into()));
        }
        state.content.sweeps.push(Sweep { inputs, problems: groups.len(), pieces });
        Ok(())
    }

    /// The outcome of a piece of the sweep under way.
    pub fn known(&self, piece: Piece) -> Option<Outcome> {
        let state = self.state();
        let pieces = &state.content.sweeps.last()?.pieces;
        pieces.binary_search_by_key(&piece, |(known, _)| *known).ok().map(|place| pieces[place].1.clone())
    }

    /// Keeps a finished piece, and writes the file if it is time to. False when that failed: the run should stop then, see
    /// [`Checkpoint::failure`].
    pub fn keep(&self, piece: Piece, outcome: &Outcome) -> bool {
        let Some(path) = &self.path else { return true };
        let mut state = self.state();
        let Some(sweep) = state.content.sweeps.last_mut().filter(|_| is_finite(outcome)) else { return true };
        if piece.stage == Stage::Answer {
            sweep.pieces.retain(|(other, _)| other.problem != piece.problem);
        }
        let place = sweep.pieces.partition_point(|(other, _)| *other < piece);
        sweep.pieces.insert(place, (piece, outcome.clone()));
        state.unwritten = true;
        if state.failure.is_none() && state.pause.0.seconds() >= state.pause.1 {
            state.failure = state.write(path).err();
        }
        state.failure.is_none()
    }

    /// Why the file could not be written while the run was under way.
    pub fn failure(&self) -> Option<Error> {
        self.state().failure.clone()
    }

    /// Writes what is finished and not yet in the file.
    ///
    /// # Errors
    /// [`Error::File`]; the file is then as it was.
    pub fn flush(&self) -> Result<()> {
        match &self.path {
            Some(path) if self.state().unwritten => self.state().write(path),
            _ => Ok(()),
        }
    }

    /// Removes the file: its run has ended.
    ///
    /// # Errors
    /// [`Error::File`] when it cannot be removed.
    pub fn remove(&self) -> Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        match fs::remove_file(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                let help = "the results are complete; remove it by hand".into();
                Err(Error::File { path: path.clone(), message: format!("cannot be removed: {error}"), help })
            }
            _ => Ok(()),
        }
    }

    /// The file; none where nothing is kept.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// How far the run under way is, or the one that it goes on from.
    pub fn finished(&self) -> Finished {
        let state = self.state();
        let sweep = state.content.sweeps.last().or(state.earlier.last());
        let pieces = sweep.map_or(&[][..], |sweep| &sweep.pieces);
        let answers: Vec<f64> =
            pieces.iter().filter(|(piece, _)| piece.stage == Stage::Answer).map(|(_, found)| found.error).collect();
        Finished {
            answers: answers.len(),
            problems: sweep.map_or(0, |sweep| sweep.problems),
            others: pieces.len() - answers.len(),
            least_error: answers.into_iter().reduce(f64::min),
        }
    }

    /// The state; a thread that panicked while it held it has at most left out a piece.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl State {
    fn write(&mut self, path: &Path) -> Result<()> {
        let watch = Stopwatch::start();
        write::whole(path, text(&self.content).as_bytes()).map_err(|error| match error {
            Error::File { path, message, .. } => {
                let help = "make room or give write access, then go on with --resume".into();
                Error::File { path, message, help }
            }
            other => other,
        })?;
        self.pause = (Stopwatch::start(), watch.seconds() / SHARE);
        self.unwritten = false;
        Ok(())
    }
}

impl Content {
    fn of(scene: &Scene) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            seed: scene.calibration.seed,
            scene: serde_json::to_value(scene).expect("a scene can be written as JSON"),
            sweeps: vec![],
        }
    }

    /// Says what differs, if the other one is not of the same run.
    fn agrees_with(&self, other: &Self) -> std::result::Result<(), String> {
        if self.version != other.version {
            return Err(format!("was made by version {}, this is {}", other.version, self.version));
        }
        if self.seed != other.seed {
            return Err(format!("was made with the seed {}, this run has {}", other.seed, self.seed));
        }
        match difference("", &other.scene, &self.scene) {
            None => Ok(()),
            Some((key, theirs, ours)) => Err(format!("was made with {key} = {theirs}, this run has {ours}")),
        }
    }
}

/// The first key whose values differ, and both values.
fn difference(key: &str, a: &Value, b: &Value) -> Option<(String, String, String)> {
    match (a, b) {
        (Value::Object(of_a), Value::Object(of_b)) => {
            let keys = of_a.keys().chain(of_b.keys().filter(|name| !of_a.contains_key(*name)));
            let join = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
            keys.into_iter().find_map(|name| {
                let value = |of: &serde_json::Map<String, Value>| of.get(name).cloned().unwrap_or_default();
                difference(&join(name), &value(of_a), &value(of_b))
            })
        }
        (Value::Array(of_a), Value::Array(of_b)) if of_a.len() == of_b.len() => {
            let mut pairs = of_a.iter().zip(of_b).enumerate();
            pairs.find_map(|(i, (a, b))| difference(&format!("{key}[{i}]"), a, b))
        }
        _ if a == b => None,
        _ => Some((key.to_owned(), shown(a), shown(b))),
    }
}

/// A value for a message: short, and a word where there is none.
fn shown(value: &Value) -> String {
    let text = if value.is_null() { "nothing".into() } else { value.to_string() };
    if text.chars().count() <= 60 { text } else { text.chars().take(60).chain("...".chars()).collect() }
}

/// The text of the file.
fn text(content: &Content) -> String {
    let content = serde_json::to_value(content).expect("names and numbers can be written as JSON");
    let digest = digest(content.to_string().bytes());
    json!({ "schema": SCHEMA, "digest": format!("{digest:016x}"), "content": content }).to_string()
}

/// The content of a file, or what is wrong with it.
fn parse(bytes: &[u8]) -> std::result::Result<Content, String> {
    let damaged = |error: serde_json::Error| format!("is damaged: {error}");
    let mut file: Value = serde_json::from_slice(bytes).map_err(damaged)?;
    if file["schema"] != SCHEMA {
        return Err(format!("has the schema {}, not \"{SCHEMA}\"", shown(&file["schema"])));
    }
    let content = file.get_mut("content").map(Value::take).unwrap_or_default();
    if file["digest"] != format!("{:016x}", digest(content.to_string().bytes())) {
        return Err("is damaged: its digest is not that of its content".into());
    }
    serde_json::from_value(content).map_err(damaged)
}

/// FNV-1a (G. Fowler, L. Noll, K.-P. Vo, 1991): tells accidents, not attacks.
pub fn digest(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// JSON has no infinity and no NaN.
fn is_finite(outcome: &Outcome) -> bool {
    let points = outcome.trace.iter().flat_map(|point| [point.seconds, point.error]);
    outcome.phi.iter().copied().chain([outcome.error]).chain(points).all(f64::is_finite)
}

fn refusal(path: &Path, message: String) -> Error {
    let help = "give what it was made with, or run without --resume, which begins anew and replaces it".into();
    Error::File { path: path.into(), message: format!("cannot be resumed: {message}"), help }
}
