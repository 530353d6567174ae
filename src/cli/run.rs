//! `springfit run`: scene in, calibrated springs out.

use std::io::IsTerminal;
use std::sync::Arc;

use springfit::clock::Progress;
use springfit::error::Error;
use springfit::export::write;
use springfit::report::ladder;
use springfit::report::result::Document;
use springfit::report::summary;
use springfit::scene::{self, Input};
use springfit::study;

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
fn study(arguments: &RunArguments, input: &Input, progress: &Progress) -> springfit::error::Result<()> {
    let mut study = study::run(&input.scene, progress)?;
    if !arguments.quiet {
        terminal::warn(&study.warnings);
    }
    study.warnings.splice(0..0, input.warnings.iter().cloned());
    let document = Document::of(&study).to_json();
    if let Some(folder) = &arguments.out {
        study.export(folder)?;
        if !study.calibration.ladder.is_empty() {
            write::whole(&folder.join("ladder.svg"), ladder::plot(&study.calibration.ladder).as_bytes())?;
        }
        write::whole(&folder.join("result.json"), document.as_bytes())?;
    }
    let text = if arguments.json { document } else { summary::run(&study) };
    terminal::print(text.trim_end()).map_err(|located| located.error)
}

/// The worker threads of everything parallel.
///
/// # Errors
/// When the system does not give that many.
pub fn set_threads(threads: Option<u16>) -> springfit::error::Result<()> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    let wrong = |error| Error::input("--threads", format!("{error}"), "ask for fewer threads");
    builder.build_global().map_err(wrong)
}
