//! What must not change a network: units, node numbers, threads and seeds.
//!
//! The ladder of groups that adapt on each of the six bodies, fitted to c0 and to F ([`super::frontier`]), is climbed once more for
//! every change that leaves the body the same: another unit of stress or of length, a pool of 1 to 8 threads, another seed. Nodes
//! are numbered anew on a mesh of the body (its control points and the cells between them), whose file is written twice, for a patch has
//! no numbers to change; the loads are fields there. Told are whether the springs fall into the same groups, and how far the
//! errors move.

use std::fmt::Write;
use std::fs;

use serde::Serialize;

use crate::clock::Progress;
use crate::error::{Error, Result};
use crate::geometry::dofs::FIXED;
use crate::geometry::mesh::Mesh;
use crate::scene::{self, Scene};
use crate::study::body::{self, Body};
use crate::study::continuum::Continuum;
use crate::study::fit::Calibration;

use super::frontier::{Bench, ROWS, plain_scene};

/// The word that asks for this table.
pub const NAME: &str = "steady";

/// Groups of the ladders.
const GROUPS: usize = 32;

/// One ladder beside that of the unchanged body.
#[derive(Debug, Clone, Serialize)]
pub struct Compared {
    /// "steady".
    pub table: &'static str,
    /// The body.
    pub body: &'static str,
    /// "c0" or "F"; on meshes one field or three.
    pub fitted: &'static str,
    /// What was changed.
    pub change: String,
    /// True when every spring has the group that it had.
    pub same_groups: bool,
    /// |e - e'| / e' of the fitted error.
    pub error: f64,
    /// The same of the error on the loads that were held out.
    pub held_out: f64,
}

/// A ladder that was climbed.
struct Climbed {
    group_of: Vec<u32>,
    error: f64,
    held_out: f64,
}

/// The table, or the rows of some bodies with ladders of so many groups.
///
/// # Errors
/// Whatever a study can fail with.
pub fn run(bodies: Option<&[&str]>, groups: Option<usize>, progress: &Progress) -> Result<Vec<Compared>> {
    let groups = groups.unwrap_or(GROUPS);
    let mut rows = Vec::new();
    let wanted = |body: &str| bodies.is_none_or(|bodies| bodies.contains(&body));
    for asked in ROWS.iter().take(6).filter(|asked| wanted(asked.body)) {
        for (fitted, all) in [("c0", false), ("F", true)] {
            let scene = plain_scene(asked)?;
            let climb =
                |scene: &Scene| Bench::of(scene, asked, all, progress).and_then(|b| climbed(&b, groups, progress));
            let base = climb(&scene)?;
            let mut add = |change: &str, other: Climbed| rows.push(compared(asked.body, fitted, change, &base, other));
            for factor in [1e-3, 1e3] {
                let mut other = scene.clone();
                other.material.young *= factor;
                add(&format!("E x {factor:e}"), climb(&other)?);
            }
            add("millimetres", climb(&in_millimetres(&scene)?)?);
            for threads in [1, 8] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let pool = pool.map_err(|error| Error::input("threads", error.to_string(), "use fewer"))?;
                add(&format!("{threads} threads"), pool.install(|| climb(&scene))?);
            }
            for seed in 2..=10 {
                let mut other = scene.clone();
                other.calibration.seed = seed;
                add(&format!("seed {seed}"), climb(&other)?);
            }
            let (base, other) = numbered_anew(&scene, all, groups, progress)?;
            rows.push(compared(asked.body, fitted, "nodes renumbered (mesh)", &base, other));
        }
    }
    Ok(rows)
}

fn climbed(bench: &Bench, groups: usize, progress: &Progress) -> Result<Climbed> {
    let Calibration { ladder, grouping, .. } = bench.ladder(groups, progress)?;
    let last = ladder.last().ok_or(Error::Interrupted)?;
    Ok(Climbed { group_of: grouping.group_of, error: last.error, held_out: last.held_out.unwrap_or(f64::NAN) })
}

fn compared(body: &'static str, fitted: &'static str, change: &str, base: &Climbed, other: Climbed) -> Compared {
    let apart = |a: f64, b: f64| ((a - b) / b).abs();
    Compared {
        table: NAME,
        body,
        fitted,
        change: change.to_owned(),
        same_groups: base.group_of == other.group_of,
        error: apart(other.error, base.error),
        held_out: apart(other.held_out, base.held_out),
    }
}

/// The same body with lengths in mm, forces in N and stresses in N/mm^2.
fn in_millimetres(scene: &Scene) -> Result<Scene> {
    let mut scene = body::build(scene)?.resolved;
    let size = scene.geometry.size.get_or_insert_with(Vec::new);
    size.iter_mut().for_each(|extent| *extent *= 1e3);
    scene.material.young *= 1e-6;
    Ok(scene)
}

/// The ladder on the mesh of a body, and with its nodes and cells in another order, the groups in the order of the first.
fn numbered_anew(scene: &Scene, all: bool, groups: usize, progress: &Progress) -> Result<(Climbed, Climbed)> {
    let mut meshed = scene.clone();
    let dimension = body::build(scene)?.dofs.dimension();
    meshed.reference.method = Some(if dimension == 2 { "q4" } else { "b8" }.into());
    meshed.geometry.degree = None;
    let Body { continuum: Continuum::Elements { mesh, .. }, dofs, .. } = body::build(&meshed)? else {
        return Err(Error::input("reference.method", "elements have no mesh", "use a meshed body"));
    };
    let held: Vec<usize> = (0..dofs.nodes()).filter(|&node| dofs.free(node).contains(&FIXED)).collect();
    let nodes = mesh.positions().len();
    let stride = (nodes / 3..).find(|stride| gcd(*stride, nodes) == 1).unwrap_or(1);
    let orders: [Vec<usize>; 2] = [(0..nodes).collect(), (0..nodes).map(|node| node * stride % nodes).collect()];
    let mut found = Vec::new();
    for (number, order) in orders.iter().enumerate() {
        let path = std::env::temp_dir().join(format!("springfit-{}-{number}.vtk", std::process::id()));
        fs::write(&path, vtk(&mesh, order))
            .map_err(|error| Error::input("TMPDIR", error.to_string(), "make room there"))?;
        let mut scene = meshed.clone();
        (scene.geometry.shape, scene.geometry.control_points) = (None, None);
        (scene.geometry.size, scene.geometry.file) = (None, Some(path.clone()));
        let support = scene::Support { nodes: held.iter().map(|&node| order[node]).collect(), ..Default::default() };
        scene.support = support.into();
        let climbed = Bench::of_fields(&scene, all, progress).and_then(|bench| {
            let springs = bench.ends()?;
            climbed(&bench, groups, progress).map(|climbed| (climbed, springs))
        });
        let _ = fs::remove_file(&path);
        found.push(climbed?);
    }
    let ((base, ends), (mut other, moved)) = (found.swap_remove(0), found.swap_remove(0));
    let group = |pair: &[u32; 2]| {
        let [a, b] = pair.map(|node| orders[1][node as usize] as u32);
        moved.iter().position(|ends| *ends == [a.min(b), a.max(b)]).map_or(u32::MAX, |spring| other.group_of[spring])
    };
    other.group_of = ends.iter().map(group).collect();
    Ok((base, other))
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// A mesh as a legacy VTK file: node i has the number order[i], and cells come last first.
fn vtk(mesh: &Mesh, order: &[usize]) -> String {
    let mut places = vec![[0.0; 3]; order.len()];
    mesh.positions().iter().zip(order).for_each(|(x, &new)| places[new] = *x);
    let mut text =
        format!("# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n", places.len());
    for [x, y, z] in places {
        let _ = writeln!(text, "{x:?} {y:?} {z:?}");
    }
    let cells: Vec<&[u32]> = (0..mesh.cells()).rev().map(|cell| mesh.corners(cell)).collect();
    let numbers: usize = cells.iter().map(|corners| corners.len() + 1).sum();
    let _ = writeln!(text, "CELLS {} {numbers}", cells.len());
    for corners in &cells {
        let numbers: Vec<String> = corners.iter().map(|&node| order[node as usize].to_string()).collect();
        let _ = writeln!(text, "{} {}", corners.len(), numbers.join(" "));
    }
    let kind = if mesh.dimension() == 2 { 9 } else { 12 };
    let _ = writeln!(text, "CELL_TYPES {}\n{}", cells.len(), vec![kind.to_string(); cells.len()].join("\n"));
    text
}

/// The table for people: for every body and change the largest differences.
pub fn table(rows: &[Compared]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut text = format!(
        "\nSteady: the ladder to {GROUPS} groups after changes that leave the body the same; relative changes of the errors\n\
         {:<10} {:<6} {:<24} {:>12} {:>10} {:>10}\n",
        "body", "fitted", "change", "same groups", "fitted", "held out"
    );
    for row in rows {
        let same = if row.same_groups { "yes" } else { "NO" };
        let _ = writeln!(
            text,
            "{:<10} {:<6} {:<24} {same:>12} {:>10.1e} {:>10.1e}",
            row.body, row.fitted, row.change, row.error, row.held_out
        );
    }
    let seeds = rows.iter().filter(|row| row.change.starts_with("seed"));
    let spread = seeds.fold(0.0, |most: f64, row| most.max(row.held_out));
    let _ = writeln!(
        text,
        "{} of {} ladders have the same groups; over ten seeds the held-out error moves by {:.1e} of itself",
        rows.iter().filter(|row| row.same_groups).count(),
        rows.len(),
        spread
    );
    text
}
