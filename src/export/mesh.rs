//! The cells of a mesh, with the reference displacement at their nodes (m); between the nodes both are (multi)linear, as
//! in the elements. Corners are numbered as VTK does.

use crate::geometry::mesh::{CellKind, Mesh};

use super::Calibrated;
use super::vtu::{self, Cells, Field, UnstructuredGrid};

/// The text of body.vtu of a mesh.
pub fn document(mesh: &Mesh, results: &Calibrated) -> Vec<u8> {
    let moved = |case| Field::vector(results.field_name("displacement_reference", case), case.reference);
    vtu::document(&UnstructuredGrid {
        points: mesh.positions().to_vec(),
        cells: cells(mesh),
        point_fields: results.cases.iter().map(moved).collect(),
        cell_fields: vec![],
    })
}

/// The cells with their type numbers.
pub(super) fn cells(mesh: &Mesh) -> Cells {
    let mut cells = Cells::default();
    for cell in 0..mesh.cells() {
        let kind = match mesh.kind(cell) {
            CellKind::Triangle => vtu::TRIANGLE,
            CellKind::Quadrilateral => vtu::QUADRILATERAL,
            CellKind::Tetrahedron => vtu::TETRAHEDRON,
            CellKind::Hexahedron => vtu::HEXAHEDRON,
        };
        cells.push(kind, mesh.corners(cell));
    }
    cells
}
