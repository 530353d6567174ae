//! Smoothed finite elements on good and on bad meshes, beside quadratic tetrahedra.
//!
//! The source of the smoothed methods (Y. Zhang et al., Math. Probl. Eng. 2017, 1467356) says that they are softer than
//! ordinary finite elements and suffer less from bad meshes; its figures are lost. Here both are measured: tip
//! deflection and first frequency of a cantilever, then amplitude and return time of its swing, on a regular mesh and on
//! distorted ones of several seeds. Every number is told in two ways: its change against the regular mesh of the same method,
//! and its distance from quadratic tetrahedra on a mesh fine enough not to matter. A single mesh proves nothing.

mod beam;

use std::fmt::Write;

use serde::Serialize;

use crate::clock::Progress;
use crate::error::Result;

pub use beam::Cost;
use beam::{WAYS, Way};

/// The name to reproduce it by.
pub const NAME: &str = "smoothed";

/// Share of a cell by which nodes are moved.
const ALPHA: f64 = 0.45;

/// Cells of the two meshes, and of the mesh of quadratic tetrahedra.
const MESHES: [[usize; 3]; 2] = [[10, 2, 2], [20, 4, 4]];
const QUADRATIC: [usize; 3] = [16, 4, 4];

/// Cells of the meshes whose steps are timed.
pub const TIMED: [[usize; 3]; 2] = [[20, 4, 4], [40, 8, 8]];

/// Seeds of the distorted meshes, and of those that swing, on the first of the meshes.
const SEEDS: [u64; 5] = [1, 2, 3, 4, 5];
const SWINGING: [u64; 3] = [1, 2, 3];

/// Two numbers of a method on one kind of mesh: on the regular mesh, and on the distorted ones.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// "t4", "smoothed_face", ...
    pub method: &'static str,
    /// Cells along the axes.
    pub cells: [usize; 3],
    /// Tip in m and first frequency in Hz; amplitude in m and return time in s of a swing.
    pub regular: [f64; 2],
    /// The same for each seed.
    pub distorted: Vec<[f64; 2]>,
}

/// A method and the cost of its step.
#[derive(Debug, Clone, Serialize)]
pub struct Timed {
    /// "t4", "smoothed_face", ...
    pub method: &'static str,
    /// Cells along the axes.
    pub cells: [usize; 3],
    /// Processor seconds and sizes.
    pub cost: Cost,
}

/// All that was measured.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Tip in m and first frequency in Hz of quadratic tetrahedra.
    pub quadratic: [f64; 2],
    /// Statics and frequencies.
    pub statics: Vec<Row>,
    /// Swings.
    pub swings: Vec<Row>,
    /// Steps.
    pub steps: Vec<Timed>,
}

/// Measures.
///
/// # Errors
/// Those of the solves and of the steps; an interruption.
pub fn run(progress: &Progress) -> Result<Comparison> {
    let mut statics = Vec::new();
    progress.enter("quadratic tetrahedra", 1);
    let quadratic = beam::sag_quadratic(&beam::mesh(QUADRATIC, 0.0, 0))?;
    for cells in MESHES {
        for way in WAYS {
            statics.push(row(*way, cells, &SEEDS, beam::sag, progress)?);
        }
    }
    let mut swings = Vec::new();
    for way in WAYS.iter().filter(|way| way.moves) {
        swings.push(row(*way, MESHES[0], &SWINGING, beam::swing, progress)?);
    }
    let steps = steps(&TIMED, progress)?;
    Ok(Comparison { quadratic, statics, swings, steps })
}

/// What a step costs by stage, with every method on regular meshes of so many cells.
///
/// # Errors
/// Those of the solves; an interruption.
pub fn steps(meshes: &[[usize; 3]], progress: &Progress) -> Result<Vec<Timed>> {
    let mut steps = Vec::new();
    for &cells in meshes {
        for way in WAYS {
            progress.enter(&format!("a step with {} on {}", way.name, name(cells)), 0);
            progress.check()?;
            steps.push(Timed { method: way.name, cells, cost: beam::cost(*way, &beam::mesh(cells, 0.0, 0))? });
        }
    }
    Ok(steps)
}

/// What is measured of a method on a mesh.
type Measure = fn(Way, &crate::geometry::mesh::Mesh) -> Result<[f64; 2]>;

fn row(way: Way, cells: [usize; 3], seeds: &[u64], measure: Measure, progress: &Progress) -> Result<Row> {
    progress.enter(&format!("{} on {}", way.name, name(cells)), seeds.len() as u64 + 1);
    let on = |alpha: f64, seed: u64| {
        progress.check()?;
        let found = measure(way, &beam::mesh(cells, alpha, seed));
        progress.advance(1);
        found
    };
    let regular = on(0.0, 0)?;
    let distorted = seeds.iter().map(|&seed| on(ALPHA, seed)).collect::<Result<_>>()?;
    Ok(Row { method: way.name, cells, regular, distorted })
}

fn name(cells: [usize; 3]) -> String {
    cells.map(|n| n.to_string()).join("x")
}

impl Row {
    /// Mean, least and largest change on the distorted meshes of a number against the regular one, percent.
    pub fn change(&self, number: usize) -> [f64; 3] {
        let changes = self.distorted.iter().map(|found| 100.0 * (found[number] / self.regular[number] - 1.0));
        let (mut sum, mut least, mut most) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
        for change in changes {
            sum += change;
            least = least.min(change);
            most = most.max(change);
        }
        [sum / self.distorted.len().max(1) as f64, least, most]
    }

    /// Of the distorted meshes, the number that is farthest from a true value.
    pub fn farthest(&self, number: usize, truth: f64) -> f64 {
        let numbers = self.distorted.iter().map(|found| found[number]);
        numbers.max_by(|a, b| (a - truth).abs().total_cmp(&(b - truth).abs())).unwrap_or(f64::NAN)
    }
}

/// The comparison as tables for people.
pub fn table(found: &Comparison) -> String {
    let [tip, frequency] = found.quadratic;
    let mut text = format!(
        "Smoothed finite elements: a cantilever under its weight, nodes moved by up to {ALPHA} cells, {} seeds\n\
         quadratic tetrahedra on {}: tip {tip:.4} m, first frequency {frequency:.4} Hz\n\n",
        SEEDS.len(),
        name(QUADRATIC)
    );
    write_rows(&mut text, &found.statics, ["tip m", "f1 Hz"], Some(found.quadratic));
    let _ = writeln!(text, "\nthe swing after letting go, implicit midpoint, {} seeds", SWINGING.len());
    write_rows(&mut text, &found.swings, ["amplitude", "return s"], None);
    text + "\n" + &step_table(&found.steps)
}

/// What a step costs, by stage, and the whole of it with the faster solve over that of plain elements (t4) on the same mesh.
pub fn step_table(steps: &[Timed]) -> String {
    let mut text = format!(
        "one step, processor milliseconds\n{:<20}{:<9}{:>8}{:>9}{:>16}{:>10}{:>10}{:>10}{:>12}{:>9}\n",
        "method", "cells", "domains", "blocks", "rotation+force", "assembly", "Cholesky", "CG", "iterations", "of t4"
    );
    for Timed { method, cells, cost } in steps {
        let times = [cost.force, cost.assembly, cost.direct, cost.iterative].map(|seconds| 1e3 * seconds);
        let [force, assembly, direct, iterative] = times;
        let plain = steps.iter().find(|other| other.method == WAYS[0].name && other.cells == *cells);
        let ratio = plain.map_or(String::new(), |plain| format!("{:.2}", cost.whole() / plain.cost.whole()));
        let (cells, Cost { domains, blocks, iterations, .. }) = (name(*cells), cost);
        let _ = writeln!(
            text,
            "{method:<20}{cells:<9}{domains:>8}{blocks:>9}{force:>16.2}{assembly:>10.2}{direct:>10.2}{iterative:>10.2}{iterations:>12}{ratio:>9}"
        );
    }
    text
}

/// Rows of two numbers; with a true value of each also the number on the worst mesh.
fn write_rows(text: &mut String, rows: &[Row], titles: [&str; 2], truth: Option<[f64; 2]>) {
    let _ = write!(text, "{:<20}{:<9}", "method", "cells");
    for title in titles {
        let worst = if truth.is_some() { "worst" } else { "" };
        let _ = write!(text, "{title:>10}{:>26}{worst:>9}", "distorted: mean (range)");
    }
    text.push('\n');
    for row in rows {
        let _ = write!(text, "{:<20}{:<9}", row.method, name(row.cells));
        for number in 0..2 {
            let [mean, least, most] = row.change(number);
            let change = format!("{mean:+.1} % ({least:+.1}..{most:+.1})");
            let worst = truth.map_or(String::new(), |truth| format!("{:.4}", row.farthest(number, truth[number])));
            let _ = write!(text, "{:>10.4}{change:>26}{worst:>9}", row.regular[number]);
        }
        text.push('\n');
    }
}
