//! A motion, recorded.

use serde::Serialize;

use crate::clock::Progress;
use crate::error::{Error, Result};

use super::energy::Energies;
use super::stepper::Stepper;

/// What was recorded of a motion: one entry for each recorded time, the start included.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Motion {
    /// Times in s.
    pub times: Vec<f64>,
    /// Displacements u over the free degrees of freedom at those times, m.
    pub frames: Vec<Vec<f64>>,
    /// Energies at those times, J.
    pub energies: Vec<Energies>,
    /// Global strain (4.17) of the network at those times, percent.
    pub strain: Vec<f64>,
}

/// How long a motion is and what is recorded of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Schedule {
    /// Steps of the run.
    pub steps: u64,
    /// Steps from one record to the next; the last step is always recorded.
    pub every: u64,
}

/// Steps between two looks at whether the user has stopped the run.
const LOOK: u64 = 64;

impl Motion {
    /// Records where the body is.
    fn record(&mut self, stepper: &mut Stepper, strain: &dyn Fn(&[f64]) -> f64) -> Result<()> {
        let energies = Energies::of(stepper);
        let state = stepper.state();
        if !energies.mechanical().is_finite() {
            let what = "its energy is not a finite number any more".into();
            return Err(Error::BlowUp { step: state.step, time: state.time, what });
        }
        self.times.push(state.time);
        self.strain.push(strain(&state.displacement));
        self.frames.push(state.displacement.clone());
        self.energies.push(energies);
        Ok(())
    }
}

/// Steps a body through a schedule. `strain(u)` is the global strain in percent of a displacement over the free degrees
/// of freedom.
///
/// # Errors
/// Those of [`Stepper::advance`]; [`Error::Interrupted`].
///
/// # Panics
/// When a record is asked for every 0 steps.
pub fn run(
    stepper: &mut Stepper,
    schedule: Schedule,
    strain: &dyn Fn(&[f64]) -> f64,
    progress: &Progress,
) -> Result<Motion> {
    let mut motion = Motion::default();
    motion.record(stepper, strain)?;
    for step in 1..=schedule.steps {
        stepper.advance()?;
        if step % schedule.every == 0 || step == schedule.steps {
            motion.record(stepper, strain)?;
        }
        if step % LOOK == 0 {
            progress.check()?;
            progress.advance(LOOK);
        }
    }
    Ok(motion)
}
