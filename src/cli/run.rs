//! `springfit run`: scene in, calibrated springs out.
//!
//! With an output folder a run keeps what it has finished ([`springfit::study::checkpoint`]). However it ends early
//! (Ctrl-C, a kill, a full disk, an error), `--resume` goes on from there to the same results. The results appear together
//! ([`springfit::export::folder`]); then the checkpoint goes.

use std::io::IsTerminal;
use std::sync::Arc;

use springfit::clock::Progress;
use springfit::error::Error;
use springfit::export::folder::Folder;
use springfit::export::write;
use springfit::readable::significant;
use springfit::report::ladder;
use springfit::report::result::Document;
use springfit::report::{budget, summary};
use springfit::scene::{self, Input};
use springfit::study::checkpoint::{Checkpoint, Finished};
use springfit::study::{self, Study};

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

/// Takes the folder, runs the study and puts out its result.
fn study(arguments: &RunArguments, input: &Input, progress: &Progress) -> springfit::error::Result<()> {
    let Some(path) = &arguments.out else {
        let study = study::run(&input.scene, progress)?;
        return put_out(arguments, input, study, None);
    };
    let folder = Folder::open(path)?;
    let checkpoint = match arguments.resume {
        true => Checkpoint::resume(path, &input.scene)?,
        false => Checkpoint::begin(path, &input.scene),
    };
    let word = match (arguments.resume, checkpoint.path().is_some_and(|path| path.exists())) {
        (true, false) => Some("there is no checkpoint to resume: the run begins anew"),
        (false, true) => Some("the checkpoint of an unfinished run will be replaced; --resume goes on from it"),
        _ => None,
    };
    if let Some(word) = word.filter(|_| !arguments.quiet) {
        terminal::warn(&[word.into()]);
    }
    let watched = || {
        let study = study::run_keeping(&input.scene, progress, &checkpoint)?;
        put_out(arguments, input, study, Some((&folder, &checkpoint)))
    };
    watched().inspect_err(|error| keep(&checkpoint, error, arguments.quiet))
}

/// Writes the result where it is wanted; with it in the folder the checkpoint has done its work.
fn put_out(
    arguments: &RunArguments,
    input: &Input,
    mut study: Study,
    folder: Option<(&Folder, &Checkpoint)>,
) -> springfit::error::Result<()> {
    if !arguments.quiet {
        terminal::warn(&study.warnings);
    }
    study.warnings.splice(0..0, input.warnings.iter().cloned());
    let document = Document::of(&study).to_json();
    if let Some((folder, checkpoint)) = folder {
        folder.publish(|staging| {
            let mut files = study.export(staging)?;
            if let Some(outcome) = &study.budget {
                files.push(staging.join("front.svg"));
                write::whole(&staging.join("front.svg"), budget::svg(&outcome.front).as_bytes())?;
            }
            if !study.calibration.ladder.is_empty() {
                files.push(staging.join("ladder.svg"));
                write::whole(&staging.join("ladder.svg"), ladder::plot(&study.calibration.ladder).as_bytes())?;
            }
            files.push(staging.join("result.json"));
            write::whole(&staging.join("result.json"), document.as_bytes())?;
            Ok(files)
        })?;
        checkpoint.remove()?;
    }
    let text = if arguments.json { document } else { summary::run(&study) };
    terminal::print(text.trim_end()).map_err(|located| located.error)?;
    match (&study.budget, &input.scene.budget) {
        (Some(outcome), Some(budget)) => outcome.check(budget),
        _ => Ok(()),
    }
}

/// After a run that did not come to its end: puts what is finished into the checkpoint, and says how to go on. Where the
/// numbers or the input are to blame, going on would end the same way: then there is no checkpoint.
fn keep(checkpoint: &Checkpoint, error: &Error, quiet: bool) {
    let Finished { resolutions, rungs, answers, problems, others, least_error } = checkpoint.finished();
    let Some(path) = checkpoint.path().filter(|_| resolutions + rungs + answers + others > 0) else { return };
    if !matches!(error, Error::Interrupted | Error::File { .. }) {
        // the error of the run is the one to tell
        let _ = checkpoint.remove();
        return;
    }
    let flushed = checkpoint.flush();
    if quiet {
        return;
    }
    if let Err(failure) = flushed.as_ref().map_err(|failure| failure.to_string()) {
        terminal::tell(&format!("warning: what was finished last is lost: {failure}"));
    }
    let least =
        least_error.map(|error| format!(", smallest error so far {} %", significant(error, 5))).unwrap_or_default();
    let of_some = |count: usize, what: &str| if count > 0 { format!("{count} {what}; ") } else { String::new() };
    let walked = of_some(resolutions, "resolutions") + &of_some(rungs, "rungs of a ladder");
    terminal::tell(&format!(
        "finished: {walked}{answers} of {problems} problems{least}; {others} starts, chains or steps of others. The same \
         call with --resume goes on from {}",
        path.display()
    ));
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
