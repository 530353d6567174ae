//! From what a file holds to a mesh that can be computed on, with a word about everything that was changed.
//!
//! In this order: the cells of the highest dimension; corners that are different; coordinates in the plane for flat
//! meshes; cells turned to a positive measure, none without one; faces shared by two cells at most; nodes of no cell left out;
//! then the warnings about folds and flat corners.

use std::collections::HashMap;
use std::path::Path;

use super::MeshFile;
use super::raw::{Group, MARKER, MOST_GROUPS, Nodes, Raw};
use crate::error::{Error, Result};
use crate::geometry::mesh::faces::{Crowded, listed};
use crate::geometry::mesh::nodes::renumbered;
use crate::geometry::mesh::quality::quality;
use crate::geometry::mesh::{CellKind, Mesh};

/// A cell has no measure when it is below this share of its extent to the power of its dimension.
const NO_MEASURE: f64 = 1e-15;

/// Makes the mesh.
pub(super) fn finish(mut raw: Raw, path: &Path) -> Result<MeshFile> {
    let refuse = |message: String, help: &str| Error::File { path: path.to_owned(), message, help: help.to_owned() };
    let dimension = match (raw.cells[0].kinds.len(), raw.cells[1].kinds.len()) {
        (0, 0) => {
            let message = "the file holds no triangles, quadrilaterals, tetrahedra or hexahedra";
            return Err(refuse(message.into(), "mesh the body in two or three dimensions before saving"));
        }
        (_, 0) => 2,
        _ => 3,
    };
    let sets = sets(&mut raw, &refuse)?;
    if u32::try_from(raw.cells[dimension - 2].corners.len()).is_err() {
        return Err(refuse(
            "the cells have more than 4294967295 corners together".into(),
            "mesh the body more coarsely",
        ));
    }
    let cells = std::mem::take(&mut raw.cells[dimension - 2]);
    raw.cells = Default::default();
    let (mut nodes, mut warnings) = (raw.nodes, Vec::new());
    let positions = std::mem::take(&mut nodes.positions);
    let mut mesh = Mesh::from_parts(dimension, positions, cells.kinds, cells.corners);
    let place = |cell: usize| match cells.lines[cell] {
        0 => format!("cell {cell} (from 0)"),
        line => format!("line {line}: the cell"),
    };
    if dimension == 2 {
        flatten(&mut mesh, &nodes, &mut warnings, &refuse)?;
    }
    check_corners(&mesh, &place, &nodes, &refuse)?;
    turn(&mut mesh, &place, &mut warnings, &refuse)?;
    check_faces(&mesh, &cells.lines, &nodes, &mut warnings, &refuse)?;
    let all = mesh.positions().len();
    let loose = mesh.drop_loose_nodes();
    if !loose.is_empty() {
        let tags = listed(loose.iter().map(|&node| nodes.tag(node)));
        warnings.push(format!("{} of {all} nodes are no corner of a cell and were left out: {tags}", loose.len()));
    }
    let sets = sets.into_iter().map(|(name, members)| (name, renumbered(&members, &loose)));
    let sets: Vec<(String, Vec<u32>)> = sets.filter(|(_, members)| !members.is_empty()).collect();
    look_at(&mesh, &mut warnings);
    Ok(MeshFile { mesh, sets, warnings })
}

type Refuse<'a> = &'a dyn Fn(String, &str) -> Error;

/// Named sets of nodes: those that the file names in its order, then the others by dimension and number.
fn sets(raw: &mut Raw, refuse: Refuse) -> Result<Vec<(String, Vec<u32>)>> {
    let mut members = std::mem::take(&mut raw.members);
    members.sort_unstable();
    members.dedup();
    let mut groups: Vec<&[(Group, u32)]> = members.chunk_by(|a, b| a.0 == b.0).collect();
    if groups.len() > MOST_GROUPS {
        let message = format!("the file has {} groups", groups.len());
        return Err(refuse(
            message,
            &format!("at most {MOST_GROUPS} groups are read: give cells of one part one number"),
        ));
    }
    let order: HashMap<Group, usize> = raw.names.iter().zip(0..).map(|((key, _), at)| (*key, at)).collect();
    let given = |key: Group| order.get(&key).copied().filter(|&at| !raw.names[at].1.is_empty());
    groups.sort_by_key(|group| given(group[0].0).unwrap_or(usize::MAX));
    let mut sets: Vec<(String, Vec<u32>)> = Vec::with_capacity(groups.len());
    let mut numbers = HashMap::new();
    for group in groups {
        let key = group[0].0;
        let name = given(key).map_or_else(|| plain_name(key), |at| raw.names[at].1.clone());
        let at = *numbers.entry(name.clone()).or_insert(sets.len());
        if at == sets.len() {
            sets.push((name, Vec::with_capacity(group.len())));
        }
        sets[at].1.extend(group.iter().map(|member| member.1));
    }
    for (_, nodes) in &mut sets {
        nodes.sort_unstable();
        nodes.dedup();
    }
    Ok(sets)
}

/// Name of a group without one.
fn plain_name((dimension, number): Group) -> String {
    let kind = match dimension {
        MARKER => "marker",
        0 => "point",
        1 => "line",
        2 => "surface",
        _ => "volume",
    };
    format!("{kind} {number}")
}

/// Refuses a cell that has a node twice.
fn check_corners(mesh: &Mesh, place: &dyn Fn(usize) -> String, nodes: &Nodes, refuse: Refuse) -> Result<()> {
    for cell in 0..mesh.cells() {
        let corners = mesh.corners(cell);
        if let Some(i) = (1..corners.len()).find(|&i| corners[..i].contains(&corners[i])) {
            let message = format!("{} has node {} at two corners", place(cell), nodes.tag(corners[i]));
            return Err(refuse(message, "every corner of a cell is another node: mesh the body again"));
        }
    }
    Ok(())
}

/// Moves a flat mesh to z = 0, and refuses a surface in space.
fn flatten(mesh: &mut Mesh, nodes: &Nodes, warnings: &mut Vec<String>, refuse: Refuse) -> Result<()> {
    const FLAT: f64 = 1e-12;
    let first = mesh.corners(0)[0];
    let height = mesh.positions()[first as usize][2];
    let tolerance = FLAT * mesh.extent();
    for cell in 0..mesh.cells() {
        for &node in mesh.corners(cell) {
            let z = mesh.positions()[node as usize][2];
            if (z - height).abs() > tolerance {
                let (tag, first) = (nodes.tag(node), nodes.tag(first));
                let message = format!("a surface in space: node {first} has z = {height}, node {tag} z = {z}");
                return Err(refuse(message, "give a mesh in the x-y plane, or tetrahedra or hexahedra"));
            }
        }
    }
    if height != 0.0 {
        warnings.push(format!("the mesh lies in the plane z = {height} and was moved to z = 0"));
    }
    mesh.positions_mut().iter_mut().for_each(|place| place[2] = 0.0);
    Ok(())
}

/// Turns cells of negative measure; refuses those without one.
fn turn(mesh: &mut Mesh, place: &dyn Fn(usize) -> String, warnings: &mut Vec<String>, refuse: Refuse) -> Result<()> {
    for cell in 0..mesh.cells() {
        let measure = mesh.measure(cell).abs();
        let size = mesh.cell_extent(cell).powi(mesh.dimension() as i32);
        if !measure.is_finite() || !size.is_finite() {
            let message = format!("{} is too large to be measured", place(cell));
            return Err(refuse(message, "give the coordinates in metres"));
        }
        if measure <= NO_MEASURE * size {
            let what = if mesh.dimension() == 2 { "area" } else { "volume" };
            let message = format!("{} has no {what}: {measure:.3e} in an extent of {size:.3e}", place(cell));
            return Err(refuse(message, "remove the flat cell, or mesh the body again"));
        }
    }
    let turned = mesh.orient();
    if turned > 0 {
        warnings.push(format!("{turned} of {} cells were numbered the wrong way round and were turned", mesh.cells()));
    }
    Ok(())
}

/// Refuses faces of more than two cells and cells that are there twice; counts faces whose cells lie on one side.
fn check_faces(mesh: &Mesh, lines: &[u32], nodes: &Nodes, warnings: &mut Vec<String>, refuse: Refuse) -> Result<()> {
    let named = |cells: &[u32]| {
        if cells.iter().all(|&cell| lines[cell as usize] > 0) {
            "of lines ".to_owned() + &listed(cells.iter().map(|&cell| lines[cell as usize].into()))
        } else {
            listed(cells.iter().map(|&cell| cell.into())) + " (from 0)"
        }
    };
    let (mut folds, mut first, mut double) = (0_usize, None, None);
    let seen = mesh.visit_faces(|face| {
        if let (true, Some(other)) = (mesh.is_fold(&face), face.neighbour) {
            folds += 1;
            first.get_or_insert(face);
            let corners = mesh.corners(face.cell as usize);
            if mesh.corners(other as usize).iter().all(|node| corners.contains(node)) {
                double.get_or_insert([face.cell, other]);
            }
        }
    });
    seen.map_err(|crowded| {
        let tags = listed(crowded.nodes.iter().map(|&node| nodes.tag(node)));
        refuse(crowded.message(&tags, &named(&crowded.cells)), Crowded::HELP)
    })?;
    if let Some(cells) = double {
        return Err(refuse(format!("the cells {} have the same corners", named(&cells)), "keep one of them"));
    }
    if let Some(face) = first {
        let tags = listed(face.nodes().iter().map(|&node| nodes.tag(node)));
        warnings.push(format!(
            "{folds} faces have both their cells on one side, so the mesh overlaps itself: the first has the nodes {tags}"
        ));
    }
    Ok(())
}

/// Warnings about what is legal but seldom meant.
fn look_at(mesh: &Mesh, warnings: &mut Vec<String>) {
    let Some(quality) = quality(mesh) else { return };
    if let Some(first) = quality.inverted.first() {
        let kind = match mesh.kind(*first as usize) {
            CellKind::Quadrilateral => "quadrilaterals",
            _ => "cells",
        };
        warnings.push(format!(
            "{} {kind} are folded at a corner, cell {first} (from 0) among them: computations on them are unsound",
            quality.inverted.len()
        ));
    }
}
