//! Meshes from files: Gmsh 2.2 and 4.1 (text and binary), TetGen and Triangle (.node with .ele), legacy VTK (text and binary).
//!
//! From a file that holds cells of several dimensions, such as a body with its boundary, the cells of the highest are the
//! mesh. Groups (Gmsh's physical groups, TetGen's boundary markers) become named sets of nodes. Cells numbered the wrong
//! way round are turned; nodes that are the corner of no cell, as the centres of circles in Gmsh, are left out and the rest
//! numbered anew in the order of the file. What was changed is told in the warnings.
//!
//! Refused, with file, line and remedy: cells of other kinds and of higher order, cells without volume, faces shared by
//! more than two cells, coordinates that are not finite, surfaces in space, and everything that does not follow the format.
//! Memory is bounded by the size of the file, whatever the file says about itself: at most 64 MB and ten times the file.

mod gmsh;
mod gmsh_kinds;
mod gmsh_old;
mod raw;
mod sound;
mod source;
mod tetgen;
mod vtk;

use std::path::Path;

use super::mesh::Mesh;
use crate::error::{Error, Result};

/// A mesh as a file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    /// Nodes and cells; every cell has a positive measure.
    pub mesh: Mesh,
    /// Named sets of nodes, ascending, in the order of the file.
    pub sets: Vec<(String, Vec<u32>)>,
    /// What was changed or looks wrong, in sentences.
    pub warnings: Vec<String>,
}

/// A kind of file in the table.
#[derive(Debug, Clone, Copy)]
pub struct MeshFormat {
    /// Extension of the file.
    pub extension: &'static str,
    /// What it is, in a line.
    pub doc: &'static str,
    parse: fn(&Path, &[u8]) -> Result<MeshFile>,
}

/// The kinds of file that are read, by extension.
pub const MESH_FORMATS: &[MeshFormat] = &[
    MeshFormat {
        extension: "msh",
        doc: "Gmsh 2.2 or 4.1, text or binary; physical groups are sets of nodes",
        parse: gmsh::parse,
    },
    MeshFormat {
        extension: "vtk",
        doc: "legacy VTK, text or binary: unstructured grids and polygons",
        parse: vtk::parse,
    },
    MeshFormat {
        extension: "node",
        doc: "TetGen or Triangle nodes; the cells are in the .ele file beside it",
        parse: tetgen::parse,
    },
    MeshFormat {
        extension: "ele",
        doc: "TetGen or Triangle cells; the nodes are in the .node file beside it",
        parse: tetgen::parse,
    },
];

/// Whether the extension is that of a mesh file.
pub fn reads(path: &Path) -> bool {
    format_of(path).is_ok()
}

/// Reads a mesh; the extension says which format it is.
///
/// # Errors
/// [`Error::File`] with the line and a remedy, for all that the module page lists.
pub fn read(path: &Path) -> Result<MeshFile> {
    let format = format_of(path)?;
    (format.parse)(path, &bytes_of(path)?)
}

/// The mesh in `bytes`, which `path` names: its extension says the format. Of TetGen's two files the other one is read.
///
/// # Errors
/// As [`read`].
pub fn parse(path: &Path, bytes: &[u8]) -> Result<MeshFile> {
    (format_of(path)?.parse)(path, bytes)
}

pub use tetgen::parse_pair as parse_tetgen;

fn format_of(path: &Path) -> Result<&'static MeshFormat> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or("").to_ascii_lowercase();
    MESH_FORMATS.iter().find(|format| format.extension == extension).ok_or_else(|| {
        let known = MESH_FORMATS.iter().map(|format| format!(".{}", format.extension)).collect::<Vec<_>>().join(", ");
        let message = format!("\".{extension}\" is no mesh file that can be read");
        Error::File { path: path.to_owned(), message, help: format!("one of {known}") }
    })
}

/// All of a regular file.
fn bytes_of(path: &Path) -> Result<Vec<u8>> {
    let refuse = |message: String| Error::File {
        path: path.to_owned(),
        message,
        help: "give a mesh file that can be read".into(),
    };
    // A device or a pipe has no size that would bound the memory.
    let about = std::fs::metadata(path).map_err(|error| refuse(error.to_string()))?;
    if !about.is_file() {
        return Err(refuse("not a regular file".into()));
    }
    std::fs::read(path).map_err(|error| refuse(error.to_string()))
}
