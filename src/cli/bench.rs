//! `springfit bench`: speed against error on this machine.

mod corotational;
mod tradeoff;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{Args, Subcommand};
use serde_json::{Value, json};
use springfit::clock::Progress;
use springfit::error::{Error, Result as Plain};
use springfit::export::write;
use springfit::report::bench::chart::{self, Labels, Series};
use springfit::report::bench::cube::{Cube, SIZES};
use springfit::report::bench::machine::Machine;
use springfit::report::bench::methods::{self, METHODS, Method};
use springfit::report::bench::solve::Rounds;
use springfit::report::bench::step::{Rig, Workers};
use springfit::report::bench::{bandwidth, calibrate, growth, matrix_market, solve, step, step_files, tables};
use springfit::scene;

use super::progress::{Watcher, stop_on_interrupt};
use super::run::set_threads;
use super::{Result, SceneArguments, terminal};

/// What is measured.
#[derive(Debug, Subcommand)]
pub enum Bench {
    /// K u = f on cubes, by every method and stage by stage
    Solve(SolveArguments),
    /// Error against time of every way to calibrate a scene
    Calibrate(CalibrateArguments),
    /// Whole runs on finer and finer cubes, a process each: how seconds and memory grow
    Growth(GrowthArguments),
    /// Networks of a scene at several resolutions and numbers of groups: error against the time of a step
    Tradeoff(tradeoff::TradeoffArguments),
    /// A network in motion: springs a second, share of the bandwidth, error of the step
    Step(StepArguments),
    /// A corotational beam in motion: what a step costs by stage, with every averaging of the strain
    Corotational(corotational::Arguments),
}

#[derive(Debug, Args)]
pub struct SolveArguments {
    /// Control points along an edge of each cube
    #[arg(long, value_delimiter = ',', default_value = "9,13,17,25", value_name = "N,...")]
    sizes: Vec<usize>,
    /// Methods; all when absent
    #[arg(long, value_delimiter = ',', value_name = "NAME,...")]
    methods: Vec<String>,
    /// Measured rounds after one warm-up
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeat: u32,
    /// Also write the systems as Matrix Market files into this folder
    #[arg(long, value_name = "DIR")]
    write: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

#[derive(Debug, Args)]
pub struct CalibrateArguments {
    #[command(flatten)]
    input: SceneArguments,
    #[command(flatten)]
    output: OutputArguments,
}

#[derive(Debug, Args)]
pub struct GrowthArguments {
    /// Control points along an edge of each cube
    #[arg(long, value_delimiter = ',', default_values_t = growth::SIZES.to_vec(), value_name = "N,...")]
    sizes: Vec<usize>,
    /// Largest size of the direct path, whose factorisations grow like the square of the unknowns
    #[arg(long, default_value_t = growth::DIRECT_UP_TO, value_name = "N")]
    direct_up_to: usize,
    #[command(flatten)]
    output: OutputArguments,
}

#[derive(Debug, Args)]
pub struct StepArguments {
    /// Control points along an edge of each cube
    #[arg(long, value_delimiter = ',', default_value = "17,33", value_name = "N,...")]
    sizes: Vec<usize>,
    /// Damping (4.18) with this alpha in s; none when absent
    #[arg(long, value_name = "ALPHA")]
    alpha: Option<f64>,
    /// Measured rounds after a warm-up
    #[arg(long, default_value_t = 15, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeat: u32,
    /// Also write the networks as files for other programs into this folder
    #[arg(long, value_name = "DIR")]
    write: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

#[derive(Debug, Args)]
struct OutputArguments {
    /// Threads; all of the machine when absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
    /// Folder for the JSON and an SVG of error against time
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Measures, prints and writes.
///
/// # Errors
/// A wrong call or scene, a folder that cannot be written to, or an interruption.
pub fn run(what: &Bench) -> Result<()> {
    match what {
        Bench::Solve(arguments) => Ok(run_solve(arguments)?),
        Bench::Calibrate(arguments) => run_calibrate(arguments),
        Bench::Growth(arguments) => Ok(run_growth(arguments)?),
        Bench::Tradeoff(arguments) => tradeoff::run(arguments),
        Bench::Step(arguments) => Ok(run_step(arguments)?),
        Bench::Corotational(arguments) => Ok(corotational::run(arguments)?),
    }
}

fn run_solve(arguments: &SolveArguments) -> Plain<()> {
    check_sizes(&arguments.sizes)?;
    let methods: Vec<&Method> = match arguments.methods.is_empty() {
        true => METHODS.iter().collect(),
        false => arguments.methods.iter().map(|name| methods::find(name)).collect::<Plain<_>>()?,
    };
    let (progress, watcher) = watched(arguments.output.threads)?;
    progress.enter("dense product", 0);
    let machine = Machine::measure();
    let mut rows = Vec::new();
    for &size in &arguments.sizes {
        progress.enter(&format!("{size}^3 springs"), 0);
        let cube = Cube::new(size)?;
        if let Some(folder) = &arguments.write {
            matrix_market::save(&cube, folder)?;
        }
        let rounds = Rounds { repeat: arguments.repeat as usize, progress: &progress };
        for method in &methods {
            rows.extend(solve::measure(method, &cube, rounds, &machine)?);
        }
    }
    drop(watcher);
    let points = |row: &solve::Row| (row.evaluation.median, row.residual, format!("{}^3", row.size));
    let of = |method: &&Method| rows.iter().filter(|row| row.method == method.name).map(points).collect();
    let series: Vec<_> = methods.iter().map(|method| Series { name: method.name.into(), points: of(method) }).collect();
    let labels = Labels { title: "one new phi: factor and solve", time: "seconds", error: "|f - K u| / |f|" };
    let figures = Figures {
        name: "bench-solve",
        document: json!({ "schema": "springfit-bench-solve/1", "version": env!("CARGO_PKG_VERSION"), "machine": machine,
            "repeat": arguments.repeat, "rows": rows }),
        chart: chart::svg(&labels, &series),
        table: format!("{}\n\n{}", tables::machine(&machine), tables::solve(&rows)),
    };
    figures.put_out(&arguments.output)
}

fn check_sizes(sizes: &[usize]) -> Plain<()> {
    match sizes.iter().find(|size| !SIZES.contains(size)) {
        None => Ok(()),
        Some(size) => {
            let help = format!("from {} to {} control points along an edge", SIZES.start(), SIZES.end());
            Err(Error::input("--sizes", format!("{size} is out of range"), help))
        }
    }
}

fn run_calibrate(arguments: &CalibrateArguments) -> Result<()> {
    let input = scene::read(&arguments.input.scene, &arguments.input.set)?;
    terminal::warn(&input.warnings);
    let (progress, watcher) = watched(arguments.output.threads)?;
    let machine = Machine::measure();
    let rows = calibrate::run(&input.scene, &progress).map_err(|error| input.source.locate(error))?;
    drop(watcher);
    let points = |row: &calibrate::Row| row.trace.iter().map(|point| (point.0, point.2, String::new())).collect();
    let series: Vec<_> = rows.iter().map(|row| Series { name: row.variant.into(), points: points(row) }).collect();
    let title = format!("{}: {} groups", input.scene.name, rows.first().map_or(0, |row| row.groups));
    let labels = Labels { title: &title, time: "seconds", error: "e_rms, percent" };
    let figures = Figures {
        name: "bench-calibrate",
        document: json!({ "schema": "springfit-bench-calibrate/1", "version": env!("CARGO_PKG_VERSION"),
            "machine": machine, "scene": input.scene, "rows": rows }),
        chart: chart::svg(&labels, &series),
        table: format!("{}\n\n{}", tables::machine(&machine), tables::calibrate(&rows)),
    };
    Ok(figures.put_out(&arguments.output)?)
}

fn run_growth(arguments: &GrowthArguments) -> Plain<()> {
    check_sizes(&arguments.sizes)?;
    let (progress, watcher) = watched(arguments.output.threads)?;
    let machine = Machine::measure();
    let program = std::env::current_exe().map_err(|error| Error::File {
        path: "springfit".into(),
        message: format!("this program does not find itself: {error}"),
        help: "call it by its full path".into(),
    })?;
    let GrowthArguments { sizes, direct_up_to, .. } = arguments;
    let plan = growth::Plan { program: &program, sizes, direct_up_to: *direct_up_to, threads: machine.threads };
    let rows = growth::run(&plan, &progress)?;
    drop(watcher);
    let point = |row: &growth::Row| (row.unknowns as f64, row.seconds, format!("{}^3", row.size));
    let series = ["auto", "direct"].map(|path| {
        let exponent = growth::exponent(&rows, path).map_or(String::new(), |e| format!(", dofs^{e:.2}"));
        let points = rows.iter().filter(|row| row.path == path).map(point).collect();
        Series { name: format!("{path}{exponent}"), points }
    });
    let labels =
        Labels { title: "cube, from the scene to the result", time: "free degrees of freedom", error: "seconds" };
    let exponents = json!({ "auto": growth::exponent(&rows, "auto"), "direct": growth::exponent(&rows, "direct") });
    let figures = Figures {
        name: "bench-growth",
        document: json!({ "schema": "springfit-bench-growth/1", "version": env!("CARGO_PKG_VERSION"),
            "machine": machine, "direct_up_to": direct_up_to, "exponent_from": growth::FIT_FROM,
            "exponents": exponents, "rows": rows }),
        chart: chart::svg(&labels, &series),
        table: format!("{}\n\n{}", tables::machine(&machine), tables::growth(&rows, *direct_up_to)),
    };
    figures.put_out(&arguments.output)
}

fn run_step(arguments: &StepArguments) -> Plain<()> {
    check_sizes(&arguments.sizes)?;
    if let Some(alpha) = arguments.alpha.filter(|alpha| !(alpha.is_finite() && *alpha > 0.0)) {
        return Err(Error::input("--alpha", format!("{alpha} is out of range"), "a number of seconds above 0"));
    }
    let (progress, watcher) = watched(arguments.output.threads)?;
    progress.enter("dense product", 0);
    let machine = Machine::measure();
    let mut counts = vec![1, machine.threads];
    counts.dedup();
    progress.enter("rate of memory", 0);
    let workers =
        counts.into_iter().map(|threads| Workers::start(threads, bandwidth::LARGE)).collect::<Plain<Vec<_>>>()?;
    let mut rows = Vec::new();
    for &size in &arguments.sizes {
        progress.enter(&format!("{size}^3 springs"), 0);
        let rig = Rig::new(size, arguments.alpha)?;
        if let Some(folder) = &arguments.write {
            step_files::save(&rig, folder)?;
        }
        for workers in &workers {
            rows.push(step::measure(&rig, workers, arguments.repeat as usize, &progress)?);
        }
    }
    drop(watcher);
    let figures = Figures {
        name: "bench-step",
        document: json!({ "schema": "springfit-bench-step/1", "version": env!("CARGO_PKG_VERSION"), "machine": machine,
            "alpha": arguments.alpha, "repeat": arguments.repeat, "rows": rows }),
        chart: step_chart(&rows),
        table: format!("{}\n\n{}", tables::machine(&machine), tables::step(&rows)),
    };
    figures.put_out(&arguments.output)
}

/// Error against the time that a simulated second takes, with the largest safe step, half and a quarter of it.
fn step_chart(rows: &[step::Row]) -> String {
    let points = |row: &step::Row| {
        let second = step::spent(&row.whole_step, row.threads) / row.step;
        row.errors.iter().zip([1.0, 2.0, 4.0]).map(|(&error, times)| (times * second, error, String::new())).collect()
    };
    let name = |row: &step::Row| format!("{}^3, {} threads", row.size, row.threads);
    let series: Vec<_> = rows.iter().map(|row| Series { name: name(row), points: points(row) }).collect();
    let labels = Labels {
        title: "leapfrog: the largest safe step, half and a quarter of it",
        time: "seconds spent on a second of motion",
        error: "distance from a run with a tenth of the step, over the distance moved",
    };
    chart::svg(&labels, &series)
}

/// Threads, progress and its bar.
fn watched(threads: Option<u16>) -> Plain<(Arc<Progress>, Watcher)> {
    set_threads(threads)?;
    let progress = Arc::new(Progress::default());
    stop_on_interrupt(&progress);
    let watcher = Watcher::start(Arc::clone(&progress), std::io::stderr().is_terminal());
    Ok((progress, watcher))
}

/// What was measured, in its three forms.
struct Figures {
    name: &'static str,
    document: Value,
    chart: String,
    table: String,
}

impl Figures {
    fn put_out(&self, to: &OutputArguments) -> Plain<()> {
        let document = format!("{:#}\n", self.document);
        if let Some(folder) = &to.out {
            let path = |ending: &str| Path::new(folder).join(format!("{}.{ending}", self.name));
            write::whole(&path("json"), document.as_bytes())?;
            write::whole(&path("svg"), self.chart.as_bytes())?;
        }
        let text = if to.json { &document } else { &self.table };
        terminal::print(text.trim_end()).map_err(|located| located.error)
    }
}
