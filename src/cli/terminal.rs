//! What reaches the terminal: results on stdout, warnings and errors on stderr, and one line for a mistake of ours.
//!
//! A closed pipe (`springfit list | head`) is the reader's wish, not an error. Errors are drawn by miette: on a terminal
//! with colours and folded lines, elsewhere plain and unfolded, so that they can be searched.

use std::io::{ErrorKind, IsTerminal, Write};
use std::path::PathBuf;

use miette::{MietteHandlerOpts, Report};
use springfit::error::Error;
use springfit::scene::Located;

/// Installs the ways that errors and panics are shown.
pub fn prepare() {
    let terminal = std::io::stderr().is_terminal();
    // Fails only when called twice.
    let _ = miette::set_hook(Box::new(move |_| Box::new(MietteHandlerOpts::new().wrap_lines(terminal).build())));
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|place| format!(" at {}:{}", place.file(), place.line())).unwrap_or_default();
        let reason = reason_of(panic).replace('\n', " ");
        tell(&format!("internal error{place}: {reason}; please report it together with the scene"));
    }));
}

/// Prints a result.
///
/// # Errors
/// [`Error::File`] when stdout cannot be written, except to a closed pipe.
pub fn print(text: &str) -> super::Result<()> {
    let mut out = std::io::stdout().lock();
    let end = if text.ends_with('\n') { "" } else { "\n" };
    match write!(out, "{text}{end}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::File {
            path: PathBuf::from("standard output"),
            message: format!("cannot be written: {error}"),
            help: "make room, or print elsewhere".into(),
        }
        .into()),
        _ => Ok(()),
    }
}

/// A line for a person.
pub fn tell(line: &str) {
    // Nobody is left to hear of it when stderr is closed.
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Warnings, a line each.
pub fn warn(warnings: &[String]) {
    for warning in warnings {
        tell(&format!("warning: {warning}"));
    }
}

/// Shows an error with its line.
pub fn report(error: &Located) {
    match &error.error {
        Error::Interrupted => tell("interrupted"),
        _ => tell(format!("{:?}", Report::new(error.clone())).trim_end()),
    }
}

/// What a panic says.
fn reason_of<'a>(panic: &'a std::panic::PanicHookInfo) -> &'a str {
    let payload = panic.payload();
    let text = payload.downcast_ref::<&str>().copied().or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no reason given")
}
