//! `bench growth`: how the time of a whole run grows with the mesh.
//!
//! Each size is a cube of n^3 control points with three load components, length groups and the default sweep, run from
//! the scene to the result by a process of its own, so that seconds and peak memory are those of one run. With the time T
//! and the number N of free degrees of freedom the *exponent* is the slope of the line through (log N, log T) with the
//! least squares, over the cubes of at least [`FIT_FROM`] control points an edge; small ones take their time elsewhere.
//!
//! Beside it stands the direct path (`solver.path = "direct"`, an f64 factorisation for every evaluation). Its
//! factorisations grow like N^2, so it is left out above a size.
//!
//! What a run finds is checked where one direct factorisation is feasible: the error at its phi, solved anew by the direct
//! path, against the error in its result.

use std::io::Read;
use std::path::{Path as FilePath, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use serde_json::Value;

use crate::calibration::objective::Objective;
use crate::calibration::objectives::displacement::{Displacement, Target, weights};
use crate::clock::{Progress, Stopwatch};
use crate::error::{Error, Result};
use crate::scene::{self, Scene, Source};
use crate::springs::affine::AffineStiffness;
use crate::springs::bounds;
use crate::springs::grouping::{self, Request};
use crate::springs::solver::{Path, SpringOperator};
use crate::study::{self, body, loads, network};

/// Control points along an edge that are measured unless others are asked for.
pub const SIZES: &[usize] = &[9, 13, 17, 25, 33, 49, 65];

/// The direct path is run up to this size unless told otherwise: at 33 its factorisations alone take minutes.
pub const DIRECT_UP_TO: usize = 25;

/// The direct path checks what a run found up to this size: one factorisation at 33 takes 1.4 GB, at 49 more than 10 GB.
pub const CHECKED_UP_TO: usize = 33;

/// Cubes that count for the exponent.
pub const FIT_FROM: usize = 17;

/// Time between two looks at a running process.
const LOOK: Duration = Duration::from_millis(20);

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Control points along an edge.
    pub size: usize,
    /// Free degrees of freedom.
    pub unknowns: u64,
    /// What `solver.path` was: auto or direct.
    pub path: &'static str,
    /// The path that the run took.
    pub taken: String,
    /// Seconds from the start of the process to its end.
    pub seconds: f64,
    /// Seconds of the processor, all threads together, where the system tells.
    pub processor: Option<f64>,
    /// Largest resident size of the process, bytes, where the system tells.
    pub peak_bytes: Option<u64>,
    /// Error of the fit, percent.
    pub e_rms: f64,
    /// Right-hand sides solved for while searching.
    pub solves: u64,
    /// Iterations of conjugate gradients while searching.
    pub iterations: u64,
    /// |e - e'| / e' of that error and the error e' of the direct path at the same phi; absent where a factorisation is not
    /// feasible.
    pub exact_difference: Option<f64>,
}

/// What is measured.
pub struct Plan<'a> {
    /// The program that runs a scene.
    pub program: &'a FilePath,
    /// Control points along an edge.
    pub sizes: &'a [usize],
    /// Largest size of the direct path.
    pub direct_up_to: usize,
    /// Threads of a run.
    pub threads: usize,
}

/// Runs all sizes on both paths.
///
/// # Errors
/// Those of a run; [`Error::Interrupted`].
pub fn run(plan: &Plan, progress: &Progress) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for &size in plan.sizes {
        rows.push(measure(plan, size, "auto", progress)?);
        if size <= plan.direct_up_to {
            rows.push(measure(plan, size, "direct", progress)?);
        }
    }
    Ok(rows)
}

/// The exponent of seconds in degrees of freedom of one path; `None` with fewer than two cubes to fit.
pub fn exponent(rows: &[Row], path: &str) -> Option<f64> {
    let points: Vec<(f64, f64)> = rows
        .iter()
        .filter(|row| row.path == path && row.size >= FIT_FROM)
        .map(|row| ((row.unknowns as f64).ln(), row.seconds.ln()))
        .collect();
    let count = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
    let spread: f64 = points.iter().map(|p| (p.0 - mean.0).powi(2)).sum();
    let together: f64 = points.iter().map(|p| (p.0 - mean.0) * (p.1 - mean.1)).sum();
    (spread > 0.0).then(|| together / spread)
}

/// One run in a process of its own, and its check.
fn measure(plan: &Plan, size: usize, path: &'static str, progress: &Progress) -> Result<Row> {
    progress.enter(&format!("{size}^3 {path}"), 0);
    let text = scene::template("cube")?;
    let file = TemporaryFile::new(&text)?;
    let control_points = format!("geometry.control_points=[{size}, {size}, {size}]");
    let watch = Stopwatch::start();
    let mut command = Command::new(plan.program);
    command.arg("run").arg(&file.0).args(["--json", "--quiet", "--threads", &plan.threads.to_string()]);
    command.args(["--set", &control_points, "--set", &format!("solver.path={path}")]);
    let printed = output(command, progress)?;
    let seconds = watch.seconds();
    let result: Value = serde_json::from_str(&printed).map_err(|error| failure(plan.program, error.to_string()))?;
    let (sizes, found) = (&result["sizes"], &result["calibration"]);
    let e_rms = found["e_rms"].as_f64().unwrap_or(f64::NAN);
    let exact_difference = match path {
        "auto" if size <= CHECKED_UP_TO => {
            progress.enter(&format!("{size}^3 check"), 0);
            let exact = exact_error(&text, size, found, progress)?;
            Some((e_rms - exact).abs() / exact)
        }
        _ => None,
    };
    Ok(Row {
        size,
        unknowns: sizes["free_dofs"].as_u64().unwrap_or(0),
        path,
        taken: found["solver"]["path"].as_str().unwrap_or("unknown").into(),
        seconds,
        processor: result["processor_seconds"].as_f64(),
        peak_bytes: result["peak_memory_bytes"].as_u64(),
        e_rms,
        solves: found["counts"]["solves"].as_u64().unwrap_or(0),
        iterations: sum_of_rows(found),
        exact_difference,
    })
}

/// Iterations of all different rows of a sweep.
fn sum_of_rows(found: &Value) -> u64 {
    let rows = found["sweep"].as_array().into_iter().flatten().filter(|row| row["same_groups_as"].is_null());
    rows.filter_map(|row| row["solver"]["cg_iterations"].as_u64()).sum()
}

/// The error at the phi of a result, by the direct path.
fn exact_error(text: &str, size: usize, found: &Value, progress: &Progress) -> Result<f64> {
    let source = Source { name: "cube".into(), text: text.into() };
    let mut scene: Scene = scene::parse(&source).map_err(|located| located.error)?;
    scene.geometry.control_points = Some(vec![size; 3]);
    scene.solver.path = Path::Direct;
    let body = body::build(&scene)?;
    let cases = loads::build(&body.resolved, &body)?;
    let reference = study::solve_reference(&body, &cases, progress)?;
    let lattice = network::build(&body.resolved, &body)?;
    let group = grouping::find("length").expect("the table has it").group;
    let grouping = group(&lattice.network, &Request::with_gamma(found["gamma"].as_f64().unwrap_or(f64::NAN)))?;
    let symbolic = Arc::clone(lattice.symbolic.as_ref().expect("the direct path has an analysis"));
    let stiffness = AffineStiffness::new(&lattice.network, &grouping, &lattice.coefficients, &body.dofs, &symbolic);
    let groups = found["groups"].as_array().into_iter().flatten();
    let phi: Vec<f64> = groups.filter_map(|group| group["stiffness"].as_f64()).collect();
    let target = Target {
        operator: &SpringOperator::Assembled { stiffness, symbolic },
        upper: &bounds::upper_bounds(&grouping, &lattice.spring_bounds, &lattice.factors),
        forces: &cases[0].load.forces,
        reference: &reference.cases[0].displacement,
        weights: &weights(&[reference.cases[0].u_max], body.dofs.masters().count()),
    };
    Displacement::new(target).error(&phi)
}

/// What a process prints; it ends with the run that started it.
fn output(mut command: Command, progress: &Progress) -> Result<String> {
    let program = PathBuf::from(command.get_program());
    let fail = |error: std::io::Error| failure(&program, error.to_string());
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().map_err(fail)?;
    // read beside the run, or a full pipe would stop it
    let [printed, complaint] =
        [reader(child.stdout.take()), reader(child.stderr.take())].map(|pipe| pipe.expect("both are piped"));
    let status = wait(&mut child, progress).and_then(|status| status.map_err(fail))?;
    let text = |reader: std::thread::JoinHandle<String>| reader.join().unwrap_or_default();
    match status.code() {
        Some(0) => Ok(text(printed)),
        Some(130) => Err(Error::Interrupted),
        _ => Err(failure(&program, text(complaint).trim().to_owned())),
    }
}

/// The end of a process, which is ended when the user stops the run.
fn wait(child: &mut Child, progress: &Progress) -> Result<std::io::Result<std::process::ExitStatus>> {
    loop {
        if let Some(ended) = child.try_wait().transpose() {
            return Ok(ended);
        }
        if let Err(stopped) = progress.check() {
            // it may have ended by itself in the meantime
            let _ = child.kill();
            let _ = child.wait();
            return Err(stopped);
        }
        std::thread::sleep(LOOK);
    }
}

/// Reads a pipe to its end on a thread of its own.
fn reader(pipe: Option<impl Read + Send + 'static>) -> Option<std::thread::JoinHandle<String>> {
    let mut pipe = pipe?;
    Some(std::thread::spawn(move || {
        let mut bytes = Vec::new();
        // what was read before an error is still worth showing
        let _ = pipe.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    }))
}

fn failure(program: &FilePath, message: String) -> Error {
    Error::File { path: program.into(), message, help: "run this size alone: springfit run with --set".into() }
}

/// A scene in the folder for temporary files, removed when it is dropped.
struct TemporaryFile(PathBuf);

impl TemporaryFile {
    fn new(text: &str) -> Result<Self> {
        let path = std::env::temp_dir().join(format!("springfit-growth-{}.toml", std::process::id()));
        std::fs::write(&path, text).map_err(|error| Error::File {
            path: path.clone(),
            message: error.to_string(),
            help: "the folder for temporary files must be writable".into(),
        })?;
        Ok(Self(path))
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        // a file that is gone already is what is wanted
        let _ = std::fs::remove_file(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_is_the_slope_of_the_fine_cubes_of_one_path() {
        let row = |size: usize, path, seconds| Row {
            size,
            unknowns: 3 * (size as u64).pow(3),
            path,
            taken: path.into(),
            seconds,
            processor: None,
            peak_bytes: None,
            e_rms: 1.0,
            solves: 1,
            iterations: 1,
            exact_difference: None,
        };
        let time = |size: usize, power: f64| 1e-6 * (3.0 * (size as f64).powi(3)).powf(power);
        let mut rows: Vec<Row> = [17, 33, 65].into_iter().map(|n| row(n, "auto", time(n, 1.1))).collect();
        rows.extend([9, 17, 25].into_iter().map(|n| row(n, "direct", if n == 9 { 7.0 } else { time(n, 2.0) })));
        assert!((exponent(&rows, "auto").expect("three cubes") - 1.1).abs() < 1e-12);
        assert!((exponent(&rows, "direct").expect("two cubes") - 2.0).abs() < 1e-12);
        assert_eq!(exponent(&rows[..1], "auto"), None);
    }
}
