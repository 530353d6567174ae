//! `springfit run`: scene in, calibrated springs out.

use std::io::IsTerminal;
use std::sync::Arc;

use springfit::clock::Progress;
use springfit::error::Error;
use springfit::scene::{self, Input};

use super::progress::{Watcher, stop_on_interrupt};
use super::{Result, RunArguments, terminal};

/// Reads the scene, runs the study, and prints or writes the result.
///
/// # Errors
/// Whatever is wrong with the scene, its numbers or the output folder.
pub fn run(arguments: &RunArguments) -> Result<()> {
    let mut input = scene::read(&arguments.input.scene, &arguments.input.set)?;
    if let Some(seed) = arguments.seed {
        input.scene.calibration.seed = seed;
    }
    if !arguments.quiet {
        terminal::warn(&input.warnings);
    }
    set_threads(arguments.threads)?;
    let progress = Arc::new(Progress::default());
    stop_on_interrupt(&progress);
    let watcher = Watcher::start(Arc::clone(&progress), std::io::stderr().is_terminal() && !arguments.quiet);
    let outcome = study(arguments, &input, &progress);
    drop(watcher);
    outcome.map_err(|error| input.source.locate(error))
}

/// Runs the study and puts out its result.
fn study(_arguments: &RunArguments, _input: &Input, progress: &Progress) -> springfit::error::Result<()> {
    progress.check()?;
    Err(Error::input("run", "the scene is valid, but the study is not wired in yet", "use check"))
}

/// The worker threads of everything parallel.
fn set_threads(threads: Option<u16>) -> Result<()> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    let wrong = |error| Error::input("--threads", format!("{error}"), "ask for fewer threads");
    builder.build_global().map_err(wrong).map_err(Into::into)
}
