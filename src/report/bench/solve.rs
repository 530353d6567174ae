//! `bench solve`: K(phi) u = f on cubes, by every method, stage by stage.
//!
//! A method ([`super::methods`]) does one warm-up and then `repeat` rounds of what `springfit
//! run` does with a new phi: write the values, factor (or set up what takes its place), solve. Each stage has its median
//! and its minimum over the rounds, and the median of its processor time: the median is what a user sees on this machine
//! today, the other two are what the machine can do when nobody else uses it. The error is the residual |f - K u| / |f| against the springs themselves, and,
//! where the method measures it, the componentwise backward error (`sparse::backward_error`).

use serde::Serialize;
use std::hint::black_box;

use crate::clock::{self, Progress, Stopwatch};
use crate::error::Result;
use crate::memory;

use super::cube::Cube;
use super::machine::Machine;
use super::methods::Method;

/// Seconds of one stage over the rounds.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// The middle round.
    pub median: f64,
    /// The fastest round.
    pub least: f64,
    /// The middle round in seconds of the processor, all threads together, where the system tells: on a busy machine the
    /// figure to compare on one thread.
    pub processor: Option<f64>,
    /// All rounds in their order.
    pub rounds: Vec<f64>,
    /// All rounds in seconds of the processor; empty where the system does not tell.
    pub processor_rounds: Vec<f64>,
}

/// What one method did on one cube.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Control points along an edge.
    pub size: usize,
    /// Free degrees of freedom.
    pub unknowns: usize,
    /// Name of the method.
    pub method: &'static str,
    /// Once for a pattern: elimination order and symbolic factorisation, or their counterpart.
    pub analyse: Seconds,
    /// Values of K for a new phi.
    pub update: Seconds,
    /// Factorisation for new values, or its counterpart.
    pub refactor: Seconds,
    /// One right-hand side, its check included.
    pub solve: Seconds,
    /// Value update, factorisation and solve of the same round together.
    pub evaluation: Seconds,
    /// |f - K u| / |f|, the largest of all rounds.
    pub residual: f64,
    /// Componentwise backward error, the largest of all rounds, where the method measures it.
    pub backward_error: Option<f64>,
    /// Iterations of a solve, where there are any.
    pub iterations: Option<usize>,
    /// Bytes of one worker: factor, values and workspace.
    pub factor_bytes: usize,
    /// Largest resident size of the process so far (small sizes first, or it says nothing), where the system tells.
    pub peak_bytes: Option<u64>,
    /// Floating-point operations of a factorisation.
    pub flop: f64,
    /// Rate of a factorisation, Gflop/s, from its processor time where the system tells, else from its fastest round.
    pub gflops: f64,
    /// That rate as a share of a dense product on one thread.
    pub share: f64,
}

/// Rounds, and whoever watches them.
#[derive(Clone, Copy)]
pub struct Rounds<'a> {
    /// Measured rounds after one warm-up.
    pub repeat: usize,
    /// Counts rounds and asks whether to stop.
    pub progress: &'a Progress,
}

/// Measures one method on one cube; `None` where the method does not fit the cube.
///
/// # Errors
/// Those of the method, and [`crate::error::Error::Interrupted`].
pub fn measure(method: &Method, cube: &Cube, rounds: Rounds, machine: &Machine) -> Result<Option<Row>> {
    rounds.progress.enter(&format!("{}^3 {}", cube.size, method.name), rounds.repeat as u64 + 1);
    let mut row = (method.measure)(cube, rounds)?;
    if let Some(row) = &mut row {
        row.share = row.gflops / machine.dense_gflops;
    }
    Ok(row)
}

/// Rounds of one stage on two clocks: the wall and the processor.
#[derive(Default)]
pub(super) struct Rounded {
    wall: Vec<f64>,
    processor: Vec<f64>,
}

impl Rounded {
    /// Runs `stage`, and adds its seconds unless this is the warm-up.
    pub(super) fn time<T>(&mut self, round: usize, stage: impl FnOnce() -> T) -> T {
        let (processor, watch) = (clock::processor_seconds(), Stopwatch::start());
        let result = black_box(stage());
        if round > 0 {
            self.wall.push(watch.seconds());
            self.processor.extend(processor.zip(clock::processor_seconds()).map(|(before, after)| after - before));
        }
        result
    }

    /// Medians and minimum; zeros when there are no rounds.
    fn seconds(self) -> Seconds {
        Seconds {
            median: median(&self.wall).unwrap_or_default(),
            least: self.wall.iter().copied().reduce(f64::min).unwrap_or_default(),
            processor: median(&self.processor),
            rounds: self.wall,
            processor_rounds: self.processor,
        }
    }
}

/// The middle value, or the mean of the middle two.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    (count > 0).then(|| 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]))
}

/// Rounds of every stage; the warm-up is not in them.
#[derive(Default)]
pub(super) struct Stages {
    pub(super) analyse: Rounded,
    pub(super) update: Rounded,
    pub(super) refactor: Rounded,
    pub(super) solve: Rounded,
}

impl Stages {
    /// The row of a method; its errors, memory and operations are left at zero.
    pub(super) fn row(self, method: &'static str, cube: &Cube) -> Row {
        let sum = |clock: fn(&Rounded) -> &Vec<f64>| {
            let rounds = clock(&self.update).iter().zip(clock(&self.refactor)).zip(clock(&self.solve));
            rounds.map(|((update, refactor), solve)| update + refactor + solve).collect()
        };
        let evaluation = Rounded { wall: sum(|stage| &stage.wall), processor: sum(|stage| &stage.processor) };
        Row {
            size: cube.size,
            unknowns: cube.forces.len(),
            method,
            analyse: self.analyse.seconds(),
            update: self.update.seconds(),
            refactor: self.refactor.seconds(),
            solve: self.solve.seconds(),
            evaluation: evaluation.seconds(),
            residual: 0.0,
            backward_error: None,
            iterations: None,
            factor_bytes: 0,
            peak_bytes: memory::peak_bytes(),
            flop: 0.0,
            gflops: 0.0,
            share: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_number_of_rounds_is_between_the_middle_two() {
        assert_eq!(median(&[4.0, 1.0, 3.0, 9.0]), Some(3.5));
        assert_eq!(median(&[2.0, 1.0, 9.0]), Some(2.0));
        assert_eq!(median(&[]), None);
    }
}
