//! The text of a checkpoint: what it holds, whose it is, and whether it is whole.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::calibration::adaptive::Standing;
use crate::calibration::optimiser::Outcome;
use crate::calibration::pieces::Piece;
use crate::scene::Scene;
use crate::study::budget::Point;

/// Name and version of the format.
pub const SCHEMA: &str = "springfit-checkpoint/2";

/// What is in the file, beside its schema and the digest of this.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Content {
    version: String,
    seed: u64,
    scene: Value,
    /// [`digest`] of every file that the scene names.
    files: BTreeMap<PathBuf, String>,
    /// The networks of every resolution that the walk of a budget has been through.
    pub walked: Vec<Vec<Point>>,
    /// The ladder of the run under way: of the resolution after those, or of the scene itself.
    pub ladder: Option<Climbed>,
    /// Its sweeps.
    pub sweeps: Vec<Sweep>,
}

/// A ladder of groups that adapt.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Climbed {
    /// [`digest`] of the numbers that it began with.
    pub inputs: String,
    /// Where it stands.
    pub standing: Standing,
}

/// One sweep; a run may need a second one, on another path of solution.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sweep {
    /// [`digest`] of the numbers that it began with.
    pub inputs: String,
    /// How many problems it has.
    pub problems: usize,
    /// In the order of the pieces.
    pub pieces: Vec<(Piece, Outcome)>,
}

impl Content {
    /// Of a run that is never written.
    pub fn empty() -> Self {
        let (version, files) = (String::new(), BTreeMap::new());
        Self { version, seed: 0, scene: Value::Null, files, walked: vec![], ladder: None, sweeps: vec![] }
    }

    /// Of a run of a scene, with nothing finished.
    pub fn of(scene: &Scene) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            seed: scene.calibration.seed,
            scene: serde_json::to_value(scene).expect("a scene can be written as JSON"),
            files: scene.clone().files_mut().map(|path| (path.clone(), digest_of_file(path))).collect(),
            ..Self::empty()
        }
    }

    /// Says what differs, if the other one is not of the same run.
    pub fn agrees_with(&self, other: &Self) -> std::result::Result<(), String> {
        if self.version != other.version {
            return Err(format!("was made by version {}, this is {}", other.version, self.version));
        }
        if self.seed != other.seed {
            return Err(format!("was made with the seed {}, this run has {}", other.seed, self.seed));
        }
        if let Some((key, theirs, ours)) = difference("", &other.scene, &self.scene) {
            return Err(format!("was made with {key} = {theirs}, this run has {ours}"));
        }
        match self.files.iter().find(|(path, digest)| other.files.get(*path) != Some(digest)) {
            None => Ok(()),
            Some((path, _)) => Err(format!("comes from other numbers: {} has changed", path.display())),
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
pub(super) fn text(content: &Content) -> String {
    let content = serde_json::to_value(content).expect("names and numbers can be written as JSON");
    let digest = digest(content.to_string().bytes());
    json!({ "schema": SCHEMA, "digest": format!("{digest:016x}"), "content": content }).to_string()
}

/// The content of a file, or what is wrong with it.
pub(super) fn parse(bytes: &[u8]) -> std::result::Result<Content, String> {
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
    go_on(0xcbf2_9ce4_8422_2325, bytes)
}

/// The digest with further bytes.
fn go_on(digest: u64, bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(digest, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// The digest of a file, a buffer at a time; empty where it cannot be read, which its own reader will tell.
fn digest_of_file(path: &Path) -> String {
    let read = || -> std::io::Result<u64> {
        let mut file = BufReader::new(File::open(path)?);
        let mut hash = digest([]);
        loop {
            let bytes = file.fill_buf()?;
            let length = bytes.len();
            if length == 0 {
                return Ok(hash);
            }
            hash = go_on(hash, bytes.iter().copied());
            file.consume(length);
        }
    };
    // a pipe would give its bytes only once
    let known = if path.is_file() { read().ok() } else { None };
    known.map(|hash| format!("{hash:016x}")).unwrap_or_default()
}

/// JSON has no infinity and no NaN.
pub(super) fn is_finite(outcome: &Outcome) -> bool {
    let points = outcome.trace.iter().flat_map(|point| [point.seconds, point.error]);
    outcome.phi.iter().copied().chain([outcome.error]).chain(points).all(f64::is_finite)
}
