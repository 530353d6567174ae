//! TetGen's tetrahedra and Triangle's triangles: nodes in one file, cells in another.
//!
//! ```text
//! .node   nodes dimension attributes markers(0/1),   then   tag x y (z) attributes marker
//! .ele    cells nodes-a-cell attributes,             then   tag nodes attributes
//! ```
//!
//! Numbers begin at 0 or 1; `#` begins a remark. Markers other than 0 become the sets "marker 1", "marker 2", ...

use std::path::Path;

use super::raw::{MARKER, Raw, unsupported};
use super::source::Source;
use super::{MeshFile, bytes_of, sound};
use crate::error::Result;
use crate::geometry::mesh::CellKind;

/// One of the two files; the other lies beside it.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<MeshFile> {
    let is_nodes = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("node"));
    let other = path.with_extension(if is_nodes { "ele" } else { "node" });
    let other_bytes = bytes_of(&other)?;
    if is_nodes { parse_pair(path, bytes, &other, &other_bytes) } else { parse_pair(&other, &other_bytes, path, bytes) }
}

/// Both files.
///
/// # Errors
/// [`crate::error::Error::File`] with the file, the line and a remedy.
pub fn parse_pair(node_path: &Path, nodes: &[u8], cell_path: &Path, cells: &[u8]) -> Result<MeshFile> {
    let mut raw = Raw::default();
    let dimension = read_nodes(&mut raw, &mut Source::new(node_path, nodes, Some(b'#')))?;
    read_cells(&mut raw, dimension, &mut Source::new(cell_path, cells, Some(b'#')))?;
    sound::finish(raw, cell_path)
}

/// A number of the head that may be left out.
fn optional(source: &mut Source, what: &str) -> Result<i32> {
    if source.line_goes_on() { source.int(what) } else { Ok(0) }
}

/// The nodes; their dimension.
fn read_nodes(raw: &mut Raw, source: &mut Source) -> Result<i32> {
    let count = source.size("the number of nodes")?;
    let dimension = source.int("the dimension")?;
    if !(2..=3).contains(&dimension) {
        return Err(source.refuse(format!("the dimension is {dimension}"), "2 (Triangle) or 3 (TetGen)"));
    }
    let attributes = optional(source, "the number of attributes")?;
    let markers = optional(source, "the number of markers")?;
    source.end_record("the head")?;
    raw.nodes.reserve(source.room(count, 6));
    for node in 0..count {
        let tag = source.size("the number of a node")?;
        let mut place = [0.0; 3];
        for (component, name) in place.iter_mut().zip(["x", "y", "z"]).take(dimension as usize) {
            *component = source.coordinate(name)?;
        }
        for _ in 0..attributes {
            source.real("an attribute of a node")?;
        }
        for _ in 0..markers {
            let marker = source.int("the marker of a node")?;
            if marker != 0 {
                raw.members.push(((MARKER, marker), node as u32));
            }
        }
        source.end_record("a node")?;
        raw.nodes.push(tag, place);
    }
    if source.keyword().is_some() {
        return Err(
            source.refuse(format!("more follows behind the last of {count} nodes"), "the head counts the nodes")
        );
    }
    raw.nodes.index(source)?;
    Ok(dimension)
}

/// The cells.
fn read_cells(raw: &mut Raw, dimension: i32, source: &mut Source) -> Result<()> {
    let count = source.size("the number of cells")?;
    let corners = source.int("the number of nodes of a cell")?;
    let kind = match (dimension, corners) {
        (2, 3) => CellKind::Triangle,
        (3, 4) => CellKind::Tetrahedron,
        (2, 6) => return Err(unsupported(source, "second-order triangle (6 nodes)")),
        (3, 10) => return Err(unsupported(source, "second-order tetrahedron (10 nodes)")),
        _ => return Err(unsupported(source, &format!("cell with {corners} nodes in {dimension} dimensions"))),
    };
    let attributes = optional(source, "the number of attributes")?;
    source.end_record("the head")?;
    raw.reserve(kind, source.room(count, 2 + 2 * kind.corners()));
    for _ in 0..count {
        source.size("the number of a cell")?;
        let mut nodes = [0; 4];
        for node in &mut nodes[..kind.corners()] {
            let tag = source.tag("a node of a cell")?;
            *node = raw.nodes.corner(tag, source)?;
        }
        raw.push(kind, &nodes[..kind.corners()], source.line());
        for _ in 0..attributes {
            source.real("an attribute of a cell")?;
        }
        source.end_record("a cell")?;
    }
    if source.keyword().is_some() {
        return Err(
            source.refuse(format!("more follows behind the last of {count} cells"), "the head counts the cells")
        );
    }
    Ok(())
}
