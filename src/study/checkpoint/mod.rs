//! What a long run has finished so far, in a file that a later run goes on from.
//!
//! `checkpoint.json` lies in the output folder while a run is under way and is removed when its results are there. It
//! holds the outcome of every finished piece of the sweep ([`crate::calibration::pieces`]): problems, and starts and
//! chains of the problems under way; of a ladder of groups that adapt the rung that it stands on; of the walk of a budget the
//! networks of every finished resolution, with the step times that were measured, so that going on decides as before.
//! Floating-point numbers are written so that reading gives back every bit. What is
//! cheap beside the search is not in it and done again: the reference, the springs, the confirmation of each answer.
//!
//! The file is always whole, see [`mod@crate::export::write`]. It is written when a piece is finished, but so seldom
//! that writing takes at most a twentieth of the time ([`SHARE`]): on a fast disk some milliseconds of work are lost when
//! the machine stops, on a slow one what was finished in the last twenty times that a write takes.
//!
//! A checkpoint serves the run that made it and no other: [`Checkpoint::resume`] compares schema, version, seed, every key
//! of the scene and every file that it names, and the sweep compares the numbers that it begins with (forces, reference,
//! bounds, groups, as a digest of their bits), which differ on another machine. A digest of the whole guards against
//! damage.

mod content;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use crate::calibration::adaptive::Standing;
use crate::calibration::optimiser::Outcome;
use crate::calibration::pieces::{Piece, Stage};
use crate::clock::Stopwatch;
use crate::error::{Error, Result};
use crate::export::write;
use crate::scene::Scene;

use super::budget::Point;
use content::{Climbed, Content, Sweep, is_finite};
pub use content::{SCHEMA, digest};

/// Name of the file in the output folder.
pub const NAME: &str = "checkpoint.json";

/// Part of the time that may go into writing checkpoints.
pub const SHARE: f64 = 0.05;

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
    /// Resolutions that the walk of a budget is done with.
    pub resolutions: usize,
    /// Rungs of a ladder.
    pub rungs: usize,
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
        Self::with(None, Content::empty(), vec![])
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
        Self::from_bytes(&path, &bytes, scene)
    }

    /// The checkpoint in the bytes of a file.
    ///
    /// # Errors
    /// As [`Checkpoint::resume`].
    pub fn from_bytes(path: &Path, bytes: &[u8], scene: &Scene) -> Result<Self> {
        let mut ours = Content::of(scene);
        let theirs = content::parse(bytes).map_err(|message| refusal(path, message))?;
        ours.agrees_with(&theirs).map_err(|message| refusal(path, message))?;
        (ours.walked, ours.ladder) = (theirs.walked, theirs.ladder);
        Ok(Self::with(Some(path.to_owned()), ours, theirs.sweeps))
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
                let what = "comes from other numbers: the body or its reference is another, or the machine";
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
        state.changed(path).is_ok()
    }

    /// The networks that the walk of a budget found with so many control points.
    pub fn walked(&self, control_points: &[usize]) -> Option<Vec<Point>> {
        let state = self.state();
        let there = |points: &&Vec<Point>| points.first().is_some_and(|point| point.control_points == control_points);
        state.content.walked.iter().find(there).cloned()
    }

    /// Keeps the networks of a resolution; the ladder and the sweeps that led to them are over.
    ///
    /// # Errors
    /// Why the file could not be written.
    pub fn keep_walked(&self, points: &[Point]) -> Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        let mut state = self.state();
        let numbers = |point: &Point| [point.fitted, point.error, point.step_seconds, point.calibration_seconds];
        if !points.iter().flat_map(numbers).all(f64::is_finite) {
            return Ok(());
        }
        state.content.walked.push(points.to_vec());
        state.content.ladder = None;
        state.content.sweeps.clear();
        state.earlier.clear();
        state.changed(path)
    }

    /// Where a ladder stood that began with these inputs; none where it has to begin anew.
    pub fn ladder(&self, inputs: u64) -> Option<Standing> {
        let state = self.state();
        let climbed = state.content.ladder.as_ref()?;
        (climbed.inputs == format!("{inputs:016x}")).then(|| climbed.standing.clone())
    }

    /// Keeps where the ladder stands.
    ///
    /// # Errors
    /// Why the file could not be written.
    pub fn keep_ladder(&self, inputs: u64, standing: &Standing) -> Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        let mut state = self.state();
        let rungs = standing.rungs.iter().flat_map(|rung| [Some(rung.error), rung.held_out]).flatten();
        if !rungs.chain(standing.last.phi.iter().copied()).all(f64::is_finite) {
            return Ok(());
        }
        let inputs = format!("{inputs:016x}");
        state.content.ladder = Some(Climbed { inputs, standing: standing.clone() });
        state.changed(path)
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
            resolutions: state.content.walked.len(),
            rungs: state.content.ladder.as_ref().map_or(0, |climbed| climbed.standing.rungs.len()),
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
    /// After something new: writes the file if it is time to. Once that failed, so does all that follows.
    fn changed(&mut self, path: &Path) -> Result<()> {
        self.unwritten = true;
        if self.failure.is_none() && self.pause.0.seconds() >= self.pause.1 {
            self.failure = self.write(path).err();
        }
        self.failure.clone().map_or(Ok(()), Err)
    }

    fn write(&mut self, path: &Path) -> Result<()> {
        let watch = Stopwatch::start();
        write::whole(path, content::text(&self.content).as_bytes()).map_err(|error| match error {
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

fn refusal(path: &Path, message: String) -> Error {
    let help = "give what it was made with, or run without --resume, which begins anew and replaces it".into();
    Error::File { path: path.into(), message: format!("cannot be resumed: {message}"), help }
}
