//! Floor 7: the commands of `springfit`, one file each.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use springfit::scene::Located;

mod bench;
mod check;
mod compare;
mod export;
mod list;
mod new;
mod progress;
mod reproduce;
mod run;
mod schema;
pub mod terminal;

/// The result of a command.
pub type Result<T> = std::result::Result<T, Located>;

/// Finds the spring stiffness that makes a mass-spring network deform like an elastic continuum.
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true, after_help = EXIT_STATUS)]
pub struct Call {
    #[command(subcommand)]
    command: Command,
}

const EXIT_STATUS: &str = "Exit status: 0 done; 2 the input or the call is wrong; 3 the numbers do not allow it; \
                           4 a budget cannot be met; 130 interrupted.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Calibrate the springs of a scene
    Run(RunArguments),
    /// Say what a scene would build, without building it
    Check {
        #[command(flatten)]
        input: SceneArguments,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Print a commented scene of a shape
    New {
        /// Name of the shape (springfit list shapes)
        name: String,
    },
    /// Print what can be chosen by name
    List {
        /// One table only: shapes, methods, topologies, groupings, ...
        kind: Option<String>,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Measure speed against error on this machine
    Bench {
        #[command(subcommand)]
        what: bench::Bench,
    },
    /// Print tables and experiments of the thesis, theirs beside ours
    Reproduce {
        /// Numbers of tables and experiments, such as 4.I or 5.2, or "smoothed"; all when none is given
        id: Vec<String>,
        /// Folder for the plots of experiments in motion
        #[arg(long)]
        out: Option<std::path::PathBuf>,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Write a finished run in the format of another program
    Export {
        /// Folder of the run: springfit run SCENE --out DIR
        dir: PathBuf,
        /// The format (springfit list exporters)
        #[arg(long, value_name = "NAME")]
        to: String,
        /// Folder for the files; that of the run when absent
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Print two finished runs side by side: errors, both sides on other loads, steps, groups
    Compare {
        /// Folder of a run: springfit run SCENE --out DIR
        first: PathBuf,
        /// Folder of the other
        second: PathBuf,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Print the JSON Schema of a scene
    Schema,
}

/// A scene and changes to it.
#[derive(Debug, Args)]
struct SceneArguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// Change a key of the scene, such as --set springs.grouping=kind or --set load[0].fit=false
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

#[derive(Debug, Args)]
struct RunArguments {
    #[command(flatten)]
    input: SceneArguments,
    /// Folder for result.json, springs.json and the fields (VTU)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    /// Seed of the random numbers, instead of calibration.seed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,
    /// Threads; all of the machine when absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Go on from the checkpoint that an interrupted run of the same scene left in DIR
    #[arg(long, requires = "out")]
    resume: bool,
    /// Neither progress nor warnings
    #[arg(long)]
    quiet: bool,
}

/// Does what the call asks for.
///
/// # Errors
/// Whatever stopped the command; [`Located::exit_status`] is the answer to the shell.
pub fn run(call: &Call) -> Result<()> {
    match &call.command {
        Command::Run(arguments) => run::run(arguments),
        Command::Check { input, json } => check::run(input, *json),
        Command::New { name } => new::run(name),
        Command::List { kind, json } => list::run(kind.as_deref(), *json),
        Command::Bench { what } => bench::run(what),
        Command::Reproduce { id, out, json } => reproduce::run(id, out.as_deref(), *json),
        Command::Export { dir, to, out } => export::run(dir, to, out.as_deref()),
        Command::Compare { first, second, json } => compare::run([first, second], *json),
        Command::Schema => schema::run(),
    }
}
