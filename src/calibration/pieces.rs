//! The pieces of a calibration that a run can keep and a later one need not do again.
//!
//! | stage | piece |
//! |---|---|
//! | [`Stage::Answer`] | a whole problem of the sweep |
//! | [`Stage::Start`] | one start of Gauss-Newton |
//! | [`Stage::Chain`] | one chain of annealing |
//! | [`Stage::Descent`] | Gauss-Newton from the end of a chain |
//! | [`Stage::Hop`] | Gauss-Newton from a perturbed best network |
//! | [`Stage::Polish`] | some factorisations of Gauss-Newton from the best of them |
//!
//! Every piece is a function of the problem, the seed, its own number and the pieces before it. So one that
//! is known takes the place of its work, and what follows is the same to the last bit. Where a piece is kept is not known
//! here: [`Kept`] asks and tells.

use serde::{Deserialize, Serialize};

use crate::calibration::optimiser::Outcome;
use crate::error::Result;

/// What a piece is a part of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// One start of Gauss-Newton.
    Start,
    /// One chain of annealing.
    Chain,
    /// Gauss-Newton from the end of a chain.
    Descent,
    /// One hop: Gauss-Newton from the best network with some groups moved.
    Hop,
    /// Some factorisations of Gauss-Newton from the best start or descent, or from the end of the polish before.
    Polish,
    /// A whole problem.
    Answer,
}

/// The name of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Piece {
    /// Index of the problem in its sweep.
    pub problem: usize,
    /// What it is a part of.
    pub stage: Stage,
    /// Its number among its like.
    pub number: usize,
}

/// What is known already, and who hears of what is found.
pub struct Kept<'a> {
    /// The outcome of a piece that an earlier run finished.
    pub known: &'a (dyn Fn(Piece) -> Option<Outcome> + Sync),
    /// Called once for every piece that this run finishes, from the thread that did.
    pub tell: &'a (dyn Fn(Piece, &Outcome) + Sync),
}

/// Nothing is known, nobody listens.
pub const NOTHING: Kept<'static> = Kept { known: &|_| None, tell: &|_, _| () };

impl Kept<'_> {
    /// The outcome of a piece: the known one, or that of the work.
    ///
    /// # Errors
    /// Those of the work; an error is not kept.
    pub fn or(&self, piece: Piece, work: impl FnOnce() -> Result<Outcome>) -> Result<Outcome> {
        if let Some(known) = (self.known)(piece) {
            return Ok(known);
        }
        let outcome = work()?;
        (self.tell)(piece, &outcome);
        Ok(outcome)
    }
}
