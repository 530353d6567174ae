//! The command line. What the commands do is in [`cli`], one file each; this file reads the call and answers with an
//! exit status: 0 done; 2 the input or the call is wrong; 3 the numbers do not allow it; 4 a budget cannot be met; 130
//! interrupted.
//!
//! Results go to stdout, everything for a person to stderr. No panic reaches a user as such: a mistake of ours prints
//! one line that asks to report it, and exits with 3, since the input is not to blame and no result is there.

use std::process::ExitCode;

use clap::Parser;

mod cli;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Exit status after a mistake of ours.
const INTERNAL: u8 = 3;

fn main() -> ExitCode {
    cli::terminal::prepare();
    let call = cli::Call::parse();
    match std::panic::catch_unwind(|| cli::run(&call)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            cli::terminal::report(&error);
            ExitCode::from(error.exit_status())
        }
        Err(_) => ExitCode::from(INTERNAL),
    }
}
