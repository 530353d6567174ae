//! The numbers that Gmsh gives to kinds of cells (Gmsh reference manual, "MSH file format").

use super::raw::unsupported;
use super::source::Source;
use crate::error::{Error, Result};
use crate::geometry::mesh::CellKind;

/// What a cell of a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FileCell {
    /// A cell of a mesh.
    Cell(CellKind),
    /// A point or a straight line, which can only put its nodes into a group: number of nodes.
    Part(usize),
}

impl FileCell {
    /// Number of nodes.
    pub(super) fn corners(self) -> usize {
        match self {
            Self::Cell(kind) => kind.corners(),
            Self::Part(count) => count,
        }
    }

    /// 0 for a point, 1 for a line, 2 or 3 for cells.
    pub(super) fn dimension(self) -> usize {
        match self {
            Self::Cell(kind) => kind.dimension(),
            Self::Part(count) => count - 1,
        }
    }
}

/// Kinds that are not read, by number.
const OTHERS: &[(i32, &str)] = &[
    (6, "prism"),
    (7, "pyramid"),
    (8, "second-order line (3 nodes)"),
    (9, "second-order triangle (6 nodes)"),
    (10, "second-order quadrilateral (9 nodes)"),
    (11, "second-order tetrahedron (10 nodes)"),
    (12, "second-order hexahedron (27 nodes)"),
    (13, "second-order prism (18 nodes)"),
    (14, "second-order pyramid (14 nodes)"),
    (16, "second-order quadrilateral (8 nodes)"),
    (17, "second-order hexahedron (20 nodes)"),
    (18, "second-order prism (15 nodes)"),
    (19, "second-order pyramid (13 nodes)"),
    (20, "third-order triangle (9 nodes)"),
    (21, "third-order triangle (10 nodes)"),
    (26, "third-order line (4 nodes)"),
    (29, "third-order tetrahedron (20 nodes)"),
    (36, "third-order quadrilateral (16 nodes)"),
    (92, "third-order hexahedron (64 nodes)"),
];

/// The kind with this number.
///
/// # Errors
/// A kind that is not read, by its name.
pub(super) fn file_cell(number: i32, source: &Source) -> Result<FileCell> {
    let refuse = || -> Error {
        let name = OTHERS.iter().find(|(other, _)| *other == number).map_or("cell unknown here", |(_, name)| name);
        unsupported(source, &format!("{name}, Gmsh's type {number}"))
    };
    Ok(match number {
        1 => FileCell::Part(2),
        2 => FileCell::Cell(CellKind::Triangle),
        3 => FileCell::Cell(CellKind::Quadrilateral),
        4 => FileCell::Cell(CellKind::Tetrahedron),
        5 => FileCell::Cell(CellKind::Hexahedron),
        15 => FileCell::Part(1),
        _ => return Err(refuse()),
    })
}
