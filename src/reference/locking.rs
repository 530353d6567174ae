//! A word about locking that knows the method.
//!
//! Whether a method locks is in the table of methods ([`super::methods::losses`]), measured; here it becomes a sentence: from
//! which Poisson's ratio on, how far off at the given one, and what does not lock on the same body. Plane stress leaves
//! the thickness free, so that nothing locks. Where the numbers themselves become unsure near nu = 1/2, the bound of the
//! error of the solution tells it ([`crate::sparse::condition`]).

use crate::geometry::mesh::{CellKind, Mesh};
use crate::geometry::patch::Patch;
use crate::reference::methods::losses::{Loss, Losses, POISSON, locks_from};
use crate::reference::methods::{METHODS, Method, MethodBody};

/// What a method works on.
#[derive(Debug, Clone, Copy)]
pub enum Spans<'a> {
    /// The knot spans of a patch.
    Patch(&'a Patch),
    /// The cells of a mesh.
    Cells(&'a Mesh),
}

/// What a user should know about a method at this Poisson's ratio on a body that is not in plane stress; none where the
/// method does not lock.
pub fn warning(method: &Method, body: Spans, poisson: f64) -> Option<String> {
    let at = POISSON.iter().rposition(|&measured| measured <= poisson)?;
    let (what, loss) = match body {
        Spans::Patch(patch) => on_patch(method, patch)?,
        Spans::Cells(mesh) => on_mesh(method, mesh, at)?,
    };
    let first = locks_from(&loss).filter(|&first| first <= at)?;
    let remedy = match body {
        Spans::Patch(patch) => higher_degree(method, patch, at),
        Spans::Cells(mesh) => other_methods(mesh, at),
    };
    Some(format!(
        "material.poisson = {poisson}: {what} locks from nu = {} on, it moves too little (measured on Cook's panel with 4 cells \
         a direction: {:.0} % too little at nu = {}); {remedy}",
        POISSON[first], loss[at], POISSON[at]
    ))
}

/// The least degree of a patch, and its loss.
fn on_patch(method: &Method, patch: &Patch) -> Option<(String, Loss)> {
    let degree = least_degree(patch);
    let loss = of_degree(method, patch.dimension(), degree)?;
    Some((format!("\"{}\" of degree {degree}", method.name), loss))
}

/// The kind of cells of a mesh that locks most at one of [`POISSON`], and its loss.
fn on_mesh(method: &Method, mesh: &Mesh, at: usize) -> Option<(String, Loss)> {
    let (kind, loss) = worst(method, mesh, at)?;
    Some((format!("\"{}\" on {}", method.name, plural(kind)), loss))
}

fn worst(method: &Method, mesh: &Mesh, at: usize) -> Option<(CellKind, Loss)> {
    let there = |kind: &CellKind| (0..mesh.cells()).any(|cell| mesh.kind(cell) == *kind);
    of_cells(method).filter(|(kind, _)| there(kind)).max_by(|a, b| a.1[at].total_cmp(&b.1[at]))
}

/// The kinds of cells that a method takes, and its loss on each; none for a patch.
fn of_cells(method: &Method) -> impl Iterator<Item = (CellKind, Loss)> {
    let (kinds, losses): (&[CellKind], &[Loss]) = match (method.body, method.losses) {
        (MethodBody::Mesh { cells, .. }, Losses::Cells(losses)) => (cells, losses),
        _ => (&[], &[]),
    };
    kinds.iter().copied().zip(losses.iter().copied())
}

fn least_degree(patch: &Patch) -> usize {
    patch.degree()[..patch.dimension()].iter().copied().min().unwrap_or(1)
}

/// The loss of splines; that of the highest degree measured for those above it.
fn of_degree(method: &Method, dimension: usize, degree: usize) -> Option<Loss> {
    match method.losses {
        Losses::Degrees(losses) => losses[dimension - 2].get(..degree).unwrap_or(losses[dimension - 2]).last().copied(),
        Losses::Cells(_) => None,
    }
}

fn higher_degree(method: &Method, patch: &Patch, at: usize) -> String {
    let measured = |degree: usize| of_degree(method, patch.dimension(), degree).map(|loss| (degree, loss));
    let higher = (least_degree(patch) + 1..).map_while(measured).find(|(_, loss)| locks_from(loss).is_none());
    higher.map_or_else(
        || "take a higher degree".into(),
        |(degree, loss)| format!("degree {degree} on the same spans loses {:.0} %", loss[at].max(0.0)),
    )
}

/// The methods that do not lock on a mesh and what they lose; else those that do not on other cells.
fn other_methods(mesh: &Mesh, at: usize) -> String {
    let sound = |(_, loss): &(CellKind, Loss)| locks_from(loss).is_none();
    let word =
        |method: &Method, cells: &str, loss: Loss| format!("\"{}\"{cells} ({:.0} %)", method.name, loss[at].max(0.0));
    let on_these = METHODS
        .iter()
        .filter(|method| method.check(mesh).is_ok())
        .filter_map(|method| worst(method, mesh, at).filter(sound).map(|(_, loss)| word(method, "", loss)));
    let on_these: Vec<String> = on_these.collect();
    if !on_these.is_empty() {
        return format!("on the same mesh these do not lock: {}", on_these.join(", "));
    }
    let of_dimension = METHODS.iter().filter(|method| method.dimension() == Some(mesh.dimension()));
    let on_others = of_dimension.flat_map(|method| {
        of_cells(method).filter(sound).map(move |(kind, loss)| word(method, &format!(" on {}", plural(kind)), loss))
    });
    format!("on other cells these do not lock: {}", on_others.collect::<Vec<_>>().join(", "))
}

fn plural(kind: CellKind) -> &'static str {
    match kind {
        CellKind::Triangle => "triangles",
        CellKind::Quadrilateral => "quadrilaterals",
        CellKind::Tetrahedron => "tetrahedra",
        CellKind::Hexahedron => "hexahedra",
    }
}
