//! K(phi), forces, masses and damping as Matrix Market files (NIST), over the free unknowns.
//!
//! Symmetric matrices are given by their lower triangle ("coordinate real symmetric"), numbered from 1; forces as a dense
//! array, one column a load case. Every number has the digits that f64 has. K = sum_s k_s n_s n_s^T over both ends is the
//! stiffness of the network at rest, C = sum_s c_s n_s n_s^T likewise, M is diagonal.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::dynamics::springs::{Coefficients, SpringModel};
use crate::dynamics::stability::Linearised;
use crate::error::Result;
use crate::export::finished::Finished;
use crate::export::write;
use crate::sparse::pattern::Pattern;

/// Writes stiffness.mtx, forces.mtx where there are loads, mass.mtx and damping.mtx where there are some, and unknowns.csv.
pub(super) fn write(run: &Finished, folder: &Path) -> Result<Vec<PathBuf>> {
    let (springs, dofs) = (&run.springs, &run.dofs);
    let of = Coefficients { stiffness: &springs.k, damping: springs.c.as_deref() };
    let ones = vec![1.0; springs.nodes.len()];
    let mut model = SpringModel::new(&run.network, dofs, of, springs.masses.as_ref().unwrap_or(&ones));
    let Linearised { pattern, stiffness, damping, masses, .. } =
        Linearised::at(&mut model, &vec![0.0; dofs.len()], None);
    let mut files = vec![("stiffness.mtx", symmetric(&pattern, &stiffness)), ("unknowns.csv", unknowns(run))];
    if springs.c.is_some() {
        files.push(("damping.mtx", symmetric(&pattern, &damping)));
    }
    if springs.masses.is_some() {
        let diagonal = masses.iter().enumerate().map(|(i, &mass)| (i, i, mass));
        files.push(("mass.mtx", lower_triangle(masses.len(), masses.len(), diagonal)));
    }
    if !springs.loads.is_empty() {
        let force = |forces: &Vec<Vec<f64>>, dof| forces[dofs.owner(dof).0][dofs.owner(dof).1];
        let loads: Vec<Vec<f64>> =
            springs.loads.iter().map(|load| (0..dofs.len()).map(|dof| force(&load.forces, dof)).collect()).collect();
        files.push(("forces.mtx", columns(&loads)));
    }
    let one = |(name, text): (&str, String)| {
        let path = folder.join(name);
        write::whole(&path, text.as_bytes()).map(|()| path)
    };
    files.into_iter().map(one).collect()
}

/// The lower triangle of a symmetric matrix on a pattern of both triangles.
fn symmetric(pattern: &Pattern, values: &[f64]) -> String {
    let n = pattern.len();
    let lower = |row: usize| {
        let first = pattern.offsets()[row];
        let each = pattern.row(row).iter().enumerate().filter(move |&(_, &column)| column <= row);
        each.map(move |(place, &column)| (row, column, values[first + place]))
    };
    let entries = (0..n).map(|row| lower(row).count()).sum();
    lower_triangle(n, entries, (0..n).flat_map(lower))
}

/// The text of an n x n symmetric matrix from the entries (row, column, value) of its lower triangle, counted from 0.
pub fn lower_triangle(n: usize, entries: usize, lower: impl Iterator<Item = (usize, usize, f64)>) -> String {
    let mut text = format!("%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {entries}\n");
    lower.for_each(|(row, column, value)| text.push_str(&format!("{} {} {value:e}\n", row + 1, column + 1)));
    text
}

/// The text of a dense matrix from its columns, all of one length.
pub fn columns(columns: &[Vec<f64>]) -> String {
    let rows = columns.first().map_or(0, Vec::len);
    let mut text = format!("%%MatrixMarket matrix array real general\n{rows} {}\n", columns.len());
    columns.iter().flatten().for_each(|value| text.push_str(&format!("{value:e}\n")));
    text
}

/// Whose each unknown is: its number from 1, the node and the control point from 0, the axis.
fn unknowns(run: &Finished) -> String {
    let mut text = "unknown,node,control_point,axis\n".to_owned();
    for dof in 0..run.dofs.len() {
        let (node, component) = run.dofs.owner(dof);
        let _ = writeln!(text, "{},{node},{},{}", dof + 1, run.springs.nodes[node], ['x', 'y', 'z'][component]);
    }
    text
}
