//! Experiment 4.IV: the acceleration approach on irregular membranes with groups by length (4.11-4.13), theirs beside ours.
//!
//! The drawings of the meshes are lost; ours have the printed numbers of nodes and springs (table 4.1) and are all
//! quadrilaterals (see data/meshes). They travel inside the program and are read as a user's file would be. gamma is the one that
//! comes nearest to the printed number of groups; support, load and initial state are those of our other experiments of the chapter.

use std::path::{Path, PathBuf};
use std::{env, fs, process};

use crate::clock::Progress;
use crate::error::{Error, Result};
use crate::report::reproduce::linear::{Found, Row, answer, calibrate, named};
use crate::report::reproduce::words;
use crate::scene::{self, Source};
use crate::study::plan;

/// A mesh with what the thesis prints about it.
struct Membrane {
    name: &'static str,
    mesh: &'static [u8],
    /// Lines of `[support]`: the lowest nodes, as in our other experiments of the chapter. With the whole rim of the circle
    /// held, a uniform stretch would pull no free node.
    support: &'static str,
    /// Nodes, springs (table 4.1) and groups that the thesis prints.
    sizes: [usize; 3],
    theirs: [f64; 2],
}

const MEMBRANES: &[Membrane] = &[
    Membrane {
        name: "irregular square",
        mesh: include_bytes!("../../../data/meshes/irregular_square.msh"),
        support: "sets = [\"bottom\"]",
        sizes: [101, 328, 6],
        theirs: [2.42, 8.77],
    },
    Membrane {
        name: "circle",
        mesh: include_bytes!("../../../data/meshes/circle_membrane.msh"),
        support: "box = { min = [-1.0, -1.0], max = [1.0, -0.8] }",
        sizes: [89, 316, 24],
        theirs: [12.706, 22.49],
    },
];

/// The ways each is calibrated: a name, and lines of `[calibration]`.
const APPROACHES: &[(&str, &str)] = &[
    (
        "acceleration, y by 10 %",
        "objective = \"acceleration\"\nacceleration = { snapshots = [{ stretch = [0.0, 0.1] }] }\n",
    ),
    ("acceleration, each axis by 10 %", "objective = \"acceleration\"\n"),
    ("displacement, best fit", ""),
];

/// A mesh as a file, gone with the value.
struct MeshOnDisk(PathBuf);

impl MeshOnDisk {
    fn new(membrane: &Membrane) -> Result<Self> {
        let name = format!("springfit-{}-{}.msh", process::id(), membrane.name.replace(' ', "-"));
        let path = env::temp_dir().join(name);
        fs::write(&path, membrane.mesh).map_err(|error| Error::File {
            path: path.clone(),
            message: format!("cannot be written: {error}"),
            help: "make room in the folder for temporary files".into(),
        })?;
        Ok(Self(path))
    }
}

impl Drop for MeshOnDisk {
    fn drop(&mut self) {
        // a file that is left behind in the folder for temporary files does no harm
        let _ = fs::remove_file(&self.0);
    }
}

/// The rows of both membranes.
///
/// # Errors
/// Interruption, or a folder for temporary files that cannot be written.
pub fn run(table: &'static str, progress: &Progress) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for membrane in MEMBRANES {
        let file = MeshOnDisk::new(membrane)?;
        let (gamma, sizes) = nearest_gamma(membrane, &file.0)?;
        let first = rows.len();
        for &(approach, lines) in APPROACHES {
            progress.check()?;
            let text = format!("{}gamma = {gamma:?}\n{lines}", scene_text(membrane, &file.0));
            let (found, refusal) = answer(calibrate(membrane.name, text, progress))?;
            rows.push(Row {
                table,
                body: membrane.name.into(),
                approach: format!("{approach}, {} groups", sizes[2]),
                theirs: approach.starts_with("acceleration").then_some(membrane.theirs),
                their_stiffness: vec![],
                ours: found.as_ref().map(|found| found.errors),
                stiffness: found.map_or(vec![], |Found { stiffness, .. }| stiffness),
                note: refusal,
            });
        }
        explain(membrane, sizes, &mut rows[first..]);
    }
    Ok(rows)
}

/// A word behind the last row that stands beside the printed error.
fn explain(membrane: &Membrane, sizes: [usize; 3], rows: &mut [Row]) {
    let beside: Vec<&Row> = rows.iter().filter(|row| row.theirs.is_some()).collect();
    let placed = words::linear(membrane.theirs[0], &named(&beside), "support, load and initial state");
    if let Some(last) = rows.iter_mut().rev().find(|row| row.theirs.is_some() && row.ours.is_some()) {
        last.note = format!("{}; {placed}", words::mesh(membrane.sizes, sizes));
    }
}

/// The scene up to the gamma of its calibration.
fn scene_text(membrane: &Membrane, path: &Path) -> String {
    format!(
        "name = \"{}\"\n[geometry]\nfile = {:?}\n[material]\nyoung = 14630.0\npoisson = 0.3333333333333333\n\
         [support]\n{}\n[[load]]\nforce_per_node = [250.0, -400.0]\n[springs]\nweighting = \"springs\"\n\
         [calibration]\n",
        membrane.name,
        path.display().to_string(),
        membrane.support
    )
}

/// The gamma, of two decimals and three below 0.02, whose number of groups is nearest to the printed one; and the numbers of
/// nodes, springs and groups.
fn nearest_gamma(membrane: &Membrane, path: &Path) -> Result<(f64, [usize; 3])> {
    let mut rows = Vec::new();
    for sweep in ["{ start = 0.8, step = 0.01 }", "{ start = 0.019, step = 0.001 }"] {
        let text = format!("{}gamma = {sweep}\n", scene_text(membrane, path));
        let source = Source { name: membrane.name.to_owned(), text };
        let plan = plan::plan(&scene::parse(&source).map_err(|located| located.error)?)?;
        let sizes = |groups| [plan.sizes.control_points, plan.sizes.springs, groups];
        rows.extend(plan.sweep.iter().filter_map(|(gamma, groups)| Some(((*gamma)?, sizes(*groups)))));
    }
    let nearest = rows.into_iter().min_by_key(|(_, sizes)| sizes[2].abs_diff(membrane.sizes[2]));
    Ok(nearest.expect("a sweep has a value"))
}
