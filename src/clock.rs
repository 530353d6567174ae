//! Time spent and work done: a stopwatch, and the progress that a long run shows.
//!
//! [`Progress`] is a few atomic counters shared by the worker threads and whoever draws the bar. Workers only add to
//! it and ask whether the user has stopped the run; nothing that is computed depends on it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::error::{Error, Result};

/// Seconds since it was started.
#[derive(Debug, Clone, Copy)]
pub struct Stopwatch(Instant);

impl Stopwatch {
    /// Starts now.
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

/// Seconds that the processor has worked for this process so far, all threads together; `None` where the system does not
/// tell. Unlike the time on the wall it does not run while others have the processor.
#[cfg(unix)]
pub fn processor_seconds() -> Option<f64> {
    use nix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).ok()?;
    Some(time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64)
}

/// Seconds that the processor has worked for this process so far: not known on this system.
#[cfg(not(unix))]
pub fn processor_seconds() -> Option<f64> {
    None
}

/// What a run is doing, how far it is, and whether it should stop.
#[derive(Debug, Default)]
pub struct Progress {
    stage: Mutex<String>,
    done: AtomicU64,
    total: AtomicU64,
    interrupt: Interrupt,
}

/// Whether the user has stopped the run: what a long loop deep in the house looks at. Clones see the same; one that was
/// made by default is never set.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// # Errors
    /// [`Error::Interrupted`] after [`Progress::cancel`].
    pub fn check(&self) -> Result<()> {
        if self.0.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
    }
}

impl Progress {
    /// Enters a stage of `total` units of work (0: not known).
    pub fn enter(&self, stage: &str, total: u64) {
        *self.stage.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = stage.to_owned();
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
    }

    /// Counts finished units of the stage.
    pub fn advance(&self, units: u64) {
        self.done.fetch_add(units, Ordering::Relaxed);
    }

    /// The stage, the units done and the units in all.
    pub fn snapshot(&self) -> (String, u64, u64) {
        let stage = self.stage.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).clone();
        (stage, self.done.load(Ordering::Relaxed), self.total.load(Ordering::Relaxed))
    }

    /// Asks all workers to stop at their next look.
    pub fn cancel(&self) {
        self.interrupt.0.store(true, Ordering::Relaxed);
    }

    /// # Errors
    /// [`Error::Interrupted`] after [`Progress::cancel`].
    pub fn check(&self) -> Result<()> {
        self.interrupt.check()
    }

    /// What a solver looks at while it iterates.
    pub fn interrupt(&self) -> Interrupt {
        self.interrupt.clone()
    }
}
