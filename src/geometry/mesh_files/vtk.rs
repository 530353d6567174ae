//! Legacy VTK files (VTK User's Guide, "VTK File Formats"): unstructured grids, and polygons of poly data.
//!
//! ```text
//! # vtk DataFile Version 3.0          CELLS cells numbers      to version 4: for each cell its count and its points
//! title                               CELLS offsets numbers    from version 5: OFFSETS type ..., CONNECTIVITY type ...
//! ASCII or BINARY                     CELL_TYPES cells         a number a cell; POLYGONS have none
//! DATASET UNSTRUCTURED_GRID
//! POINTS points type
//! ```
//!
//! Points are counted from 0. Lines of text may be broken anywhere; binary numbers have the high byte first. What belongs to
//! points and cells (POINT_DATA, CELL_DATA) comes last and is not read.

use std::path::Path;

use super::raw::{Raw, unsupported};
use super::source::{Encoding, Source, shown};
use super::{MeshFile, sound};
use crate::error::Result;
use crate::geometry::mesh::CellKind;

const TRIANGLE: u8 = 5;
const POLYGON: u8 = 7;
const QUADRILATERAL: u8 = 9;

/// Cells that are read: VTK's number, the kind, and the order of its corners.
const CELLS: &[(u8, CellKind, &[usize])] = &[
    (TRIANGLE, CellKind::Triangle, &[0, 1, 2]),
    (8, CellKind::Quadrilateral, &[0, 1, 3, 2]),
    (QUADRILATERAL, CellKind::Quadrilateral, &[0, 1, 2, 3]),
    (10, CellKind::Tetrahedron, &[0, 1, 2, 3]),
    (11, CellKind::Hexahedron, &[0, 1, 3, 2, 4, 5, 7, 6]),
    (12, CellKind::Hexahedron, &[0, 1, 2, 3, 4, 5, 6, 7]),
];

/// Cells that are not read, by name.
const OTHERS: &[(u8, &str)] = &[
    (6, "strip of triangles"),
    (POLYGON, "polygon with neither 3 nor 4 corners"),
    (13, "prism"),
    (14, "pyramid"),
    (21, "second-order line"),
    (22, "second-order triangle (6 nodes)"),
    (23, "second-order quadrilateral (8 nodes)"),
    (24, "second-order tetrahedron (10 nodes)"),
    (25, "second-order hexahedron (20 nodes)"),
    (26, "second-order prism (15 nodes)"),
    (27, "second-order pyramid (13 nodes)"),
    (28, "second-order quadrilateral (9 nodes)"),
    (29, "second-order hexahedron (27 nodes)"),
    (42, "polyhedron"),
    (69, "Lagrange triangle of higher order"),
    (70, "Lagrange quadrilateral of higher order"),
    (71, "Lagrange tetrahedron of higher order"),
    (72, "Lagrange hexahedron of higher order"),
];

/// Points and lines, which are passed over.
const PARTS: std::ops::RangeInclusive<u8> = 1..=4;

/// Reads a file.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<MeshFile> {
    let mut source = Source::new(path, bytes, None);
    let polygons = header(&mut source)?;
    let (mut raw, mut lists, mut types) = (Raw::default(), None, None);
    while let Some(word) = source.keyword() {
        match (word, polygons) {
            (b"POINTS", _) => points(&mut raw, &mut source)?,
            (b"CELLS", false) | (b"POLYGONS", true) => {
                if lists.replace(Lists::read(&mut source)?).is_some() {
                    return Err(source.refuse("the cells are there twice", "one mesh a file"));
                }
            }
            (b"CELL_TYPES", false) => types = Some(cell_types(&mut source)?),
            (b"VERTICES" | b"LINES", true) => drop(Lists::read(&mut source)?),
            (b"TRIANGLE_STRIPS", true) => return Err(unsupported(&source, "strip of triangles")),
            (b"FIELD", _) => field(&mut source)?,
            (b"METADATA", _) => metadata(&mut source),
            (b"POINT_DATA" | b"CELL_DATA", _) => break,
            _ => {
                let message = format!("\"{}\" stands where a section should start", shown(word));
                return Err(source.refuse(message, "sections are POINTS, CELLS, CELL_TYPES, POLYGONS, FIELD, METADATA"));
            }
        }
    }
    let Some(lists) = lists else {
        return Err(source.refuse("the file holds no cells", "write the cells of the mesh, not only its points"));
    };
    assemble(&mut raw, lists, types, polygons, &source)?;
    sound::finish(raw, path)
}

/// The first lines; true for poly data.
fn header(source: &mut Source) -> Result<bool> {
    if !source.starts_with(b"# vtk DataFile Version") {
        let message = "the file does not begin with \"# vtk DataFile Version\"";
        return Err(source.refuse(message, "give a legacy VTK file (.vtk); the XML formats (.vtu, .vtp) are not read"));
    }
    source.rest_of_line();
    source.rest_of_line();
    let encoding = match source.keyword() {
        Some(b"ASCII") => Encoding::Words,
        Some(b"BINARY") => Encoding::BigEndian,
        other => {
            let message = format!("\"{}\" stands where ASCII or BINARY should", shown(other.unwrap_or_default()));
            return Err(source.refuse(message, "the third line says how numbers are written"));
        }
    };
    source.expect("DATASET")?;
    let polygons = match source.keyword() {
        Some(b"UNSTRUCTURED_GRID") => false,
        Some(b"POLYDATA") => true,
        other => {
            let message = format!("the data set is \"{}\"", shown(other.unwrap_or_default()));
            return Err(source.refuse(message, "UNSTRUCTURED_GRID or POLYDATA; save the mesh as an unstructured grid"));
        }
    };
    source.encoding = encoding;
    Ok(polygons)
}

/// Reads the head of a section, which is text: its numbers, then whether a word ends it.
fn head(source: &mut Source, counts: &mut [u64], what: &str) -> Result<Vec<u8>> {
    let encoding = std::mem::replace(&mut source.encoding, Encoding::Lines);
    for count in counts {
        *count = source.size(what)?;
    }
    let word = if source.line_goes_on() { source.word("a type")?.to_ascii_lowercase() } else { Vec::new() };
    source.end_record("the head of a section")?;
    source.encoding = encoding;
    if !source.is_text() {
        source.rest_of_line();
    }
    Ok(word)
}

/// POINTS.
fn points(raw: &mut Raw, source: &mut Source) -> Result<()> {
    let mut count = [0];
    let kind = head(source, &mut count, "the number of points")?;
    let read = match kind.as_slice() {
        b"double" => Source::real,
        b"float" => Source::single,
        _ => return Err(source.refuse(format!("points of type \"{}\"", shown(&kind)), "float or double")),
    };
    if !raw.nodes.positions.is_empty() {
        return Err(source.refuse("the points are there twice", "one mesh a file"));
    }
    raw.nodes.reserve(source.room(count[0], 6));
    for point in 0..count[0] {
        let mut place = [0.0; 3];
        for (component, name) in place.iter_mut().zip(["x", "y", "z"]) {
            let value = read(source, name)?;
            *component = source.finite(value, name)?;
        }
        raw.nodes.push(point, place);
    }
    raw.nodes.index(source)
}

/// The points of each cell.
#[derive(Default)]
struct Lists {
    /// Where the points of a cell end in `points`.
    ends: Vec<u32>,
    points: Vec<u32>,
    /// Line of each cell; empty where cells have no lines of their own.
    lines: Vec<u32>,
}

impl Lists {
    fn read(source: &mut Source) -> Result<Self> {
        let mut counts = [0; 2];
        head(source, &mut counts, "the number of cells")?;
        let [cells, numbers] = counts;
        if source.clone().keyword() == Some(b"OFFSETS") {
            Self::by_offsets(source, cells, numbers)
        } else {
            Self::by_counts(source, cells, numbers)
        }
    }

    /// To version 4: each cell begins with its number of points.
    fn by_counts(source: &mut Source, cells: u64, numbers: u64) -> Result<Self> {
        let mut lists = Self::default();
        lists.ends.reserve(source.room(cells, 2));
        lists.lines.reserve(source.room(cells, 2));
        lists.points.reserve(source.room(numbers.saturating_sub(cells), 2));
        for _ in 0..cells {
            let count = source.int("the number of points of a cell")?;
            lists.lines.push(u32::try_from(source.line()).unwrap_or(0));
            for _ in 0..count {
                let point = source.int("a point of a cell")?;
                lists.push(point.into(), source)?;
            }
            lists.ends.push(lists.points.len() as u32);
        }
        let read = cells + lists.points.len() as u64;
        if read != numbers {
            let message = format!("the section says {numbers} numbers, its cells hold {read}");
            return Err(source.refuse(message, "the counts do not fit each other: write the file again"));
        }
        Ok(lists)
    }

    /// From version 5: where each cell begins, then all points.
    fn by_offsets(source: &mut Source, offsets: u64, numbers: u64) -> Result<Self> {
        let mut lists = Self::default();
        let read = integers(source, "OFFSETS")?;
        lists.ends.reserve(source.room(offsets, 2));
        let mut before = 0;
        for which in 0..offsets {
            let offset = read(source, "an offset")?;
            let allowed = if which == 0 { 0..=0 } else { before..=numbers as i64 };
            if !allowed.contains(&offset) || u32::try_from(offset).is_err() {
                let message = format!("offset {which} is {offset}, not in {}..={}", allowed.start(), allowed.end());
                return Err(source.refuse(message, "offsets grow from 0 to the number of points of all cells"));
            }
            before = offset;
            if which > 0 {
                lists.ends.push(offset as u32);
            }
        }
        if before != numbers as i64 {
            let message = format!("the last offset is {before}, but the cells have {numbers} points");
            return Err(source.refuse(message, "the counts do not fit each other: write the file again"));
        }
        let read = integers(source, "CONNECTIVITY")?;
        lists.points.reserve(source.room(numbers, 2));
        for _ in 0..numbers {
            let point = read(source, "a point of a cell")?;
            lists.push(point, source)?;
        }
        Ok(lists)
    }

    fn push(&mut self, point: i64, source: &Source) -> Result<()> {
        let number = u32::try_from(point);
        self.points
            .push(number.map_err(|_| source.refuse(format!("a cell names point {point}"), "points count from 0"))?);
        Ok(())
    }
}

type ReadInteger = fn(&mut Source, &str) -> Result<i64>;

/// The head of a row of integers, and how they are read.
fn integers(source: &mut Source, name: &str) -> Result<ReadInteger> {
    source.expect(name)?;
    let kind = head(source, &mut [], name)?;
    match kind.as_slice() {
        b"vtktypeint64" | b"long" => Ok(|source, what| {
            let value = source.size(what)?;
            i64::try_from(value).map_err(|_| source.refuse(format!("{what} is {value}"), "points count from 0"))
        }),
        b"vtktypeint32" | b"int" | b"vtkidtype" => Ok(|source, what| source.int(what).map(i64::from)),
        _ => Err(source.refuse(format!("{name} of type \"{}\"", shown(&kind)), "vtktypeint64 or int")),
    }
}

/// CELL_TYPES.
fn cell_types(source: &mut Source) -> Result<Vec<u8>> {
    let mut count = [0];
    head(source, &mut count, "the number of types")?;
    let mut types = Vec::with_capacity(source.room(count[0], 2));
    for _ in 0..count[0] {
        let kind = source.int("the type of a cell")?;
        types.push(u8::try_from(kind).map_err(|_| unsupported(source, &format!("cell of VTK's type {kind}")))?);
    }
    Ok(types)
}

/// FIELD before the cells: passed over.
fn field(source: &mut Source) -> Result<()> {
    let encoding = std::mem::replace(&mut source.encoding, Encoding::Lines);
    source.word("the name of a field")?;
    let arrays = source.size("the number of arrays")?;
    source.end_record("the head of a field")?;
    source.encoding = encoding;
    for _ in 0..arrays {
        source.keyword();
        let mut counts = [0; 2];
        let kind = head(source, &mut counts, "a size of an array")?;
        let width: usize = match kind.as_slice() {
            b"char" | b"unsigned_char" => 1,
            b"short" | b"unsigned_short" => 2,
            b"int" | b"unsigned_int" | b"float" | b"vtkidtype" => 4,
            b"long" | b"unsigned_long" | b"vtktypeint64" | b"double" => 8,
            _ => {
                let message = format!("an array of type \"{}\" before the cells", shown(&kind));
                return Err(source.refuse(message, "save the mesh without field data"));
            }
        };
        for _ in 0..counts[0].saturating_mul(counts[1]) {
            if source.is_text() {
                source.word("a value of a field")?;
            } else {
                for _ in 0..width {
                    source.byte("a value of a field")?;
                }
            }
        }
    }
    Ok(())
}

/// METADATA: passed over to the next empty line.
fn metadata(source: &mut Source) {
    source.rest_of_line();
    while source.remaining() > 0 && !source.rest_of_line().is_empty() {}
}

/// Gives every cell its kind.
fn assemble(raw: &mut Raw, lists: Lists, types: Option<Vec<u8>>, polygons: bool, source: &Source) -> Result<()> {
    let types = match types {
        Some(types) if types.len() == lists.ends.len() => types,
        Some(types) => {
            let message = format!("{} types for {} cells", types.len(), lists.ends.len());
            return Err(source.refuse(message, "CELL_TYPES gives one number a cell"));
        }
        None if polygons => vec![POLYGON; lists.ends.len()],
        None => return Err(source.refuse("the section CELL_TYPES is missing", "CELL_TYPES gives one number a cell")),
    };
    let points = raw.nodes.positions.len();
    let mut start = 0;
    for (cell, (&end, &number)) in lists.ends.iter().zip(&types).enumerate() {
        let corners = &lists.points[start..end as usize];
        start = end as usize;
        let line = lists.lines.get(cell).map_or(0, |&line| line as usize);
        let source = source.at_line(line);
        if let Some(&point) = corners.iter().find(|&&point| point as usize >= points) {
            let message = format!("cell {cell} names point {point}, but the file has {points} points, counted from 0");
            return Err(source.refuse(message, "name points of the file"));
        }
        let number = match (number, corners.len()) {
            (POLYGON, 3) => TRIANGLE,
            (POLYGON, 4) => QUADRILATERAL,
            _ => number,
        };
        let Some((_, kind, order)) = CELLS.iter().find(|(known, ..)| *known == number) else {
            if PARTS.contains(&number) {
                continue;
            }
            let name = OTHERS.iter().find(|(other, _)| *other == number).map_or("cell unknown here", |(_, name)| name);
            return Err(unsupported(&source, &format!("{name}, VTK's type {number}: cell {cell} (from 0)")));
        };
        if corners.len() != kind.corners() {
            let message = format!("cell {cell} of VTK's type {number} has {} points", corners.len());
            return Err(source.refuse(message, format!("it must have {}", kind.corners())));
        }
        let mut turned = [0; 8];
        order.iter().zip(&mut turned).for_each(|(&corner, node)| *node = corners[corner]);
        raw.push(*kind, &turned[..order.len()], line);
    }
    Ok(())
}
