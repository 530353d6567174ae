//! Gmsh version 2: every node and every element is one record.
//!
//! ```text
//! $Nodes      count, then   tag x y z
//! $Elements   count, then   tag type tags t1 t2 ... nodes        t1 is the physical group, 0 for none
//! ```
//!
//! An element in several physical groups stands there once a group, each time with another tag: it is one cell, in all of
//! their sets. The counts are text also in a binary file. There the elements come in blocks with one head, type count tags.

use super::gmsh::Reader;
use super::gmsh_kinds::{FileCell, file_cell};
use super::raw::{Group, Raw};
use super::source::{Encoding, Source};
use crate::error::Result;

/// The count that begins a section; what follows may be binary.
fn count(source: &mut Source, what: &str) -> Result<u64> {
    let encoding = std::mem::replace(&mut source.encoding, Encoding::Lines);
    let count = source.size(what)?;
    source.end_record(what)?;
    source.encoding = encoding;
    source.tag_width = 4;
    if !source.is_text() {
        source.rest_of_line();
    }
    Ok(count)
}

/// `$Nodes`.
pub(super) fn nodes(raw: &mut Raw, source: &mut Source) -> Result<()> {
    let count = count(source, "the number of nodes")?;
    raw.nodes.reserve(source.room(count, 8));
    for _ in 0..count {
        let tag = source.tag("the number of a node")?;
        let mut place = [0.0; 3];
        for (component, name) in place.iter_mut().zip(["x", "y", "z"]) {
            *component = source.coordinate(name)?;
        }
        source.end_record("a node")?;
        raw.nodes.push(tag, place);
    }
    Ok(())
}

/// `$Elements`.
pub(super) fn elements(reader: &mut Reader, source: &mut Source) -> Result<()> {
    let count = count(source, "the number of elements")?;
    let mut elements = Elements::default();
    let mut read = 0;
    while read < count {
        if source.is_text() {
            source.tag("the number of an element")?;
        }
        let kind = source.int("the type of an element")?;
        let kind = file_cell(kind, source)?;
        let block = if source.is_text() { 1 } else { u64::from(source.int("the length of a block")?.unsigned_abs()) };
        let tags = source.int("the number of tags")?;
        if block == 0 || block > count - read {
            let message = format!("a block of {block} elements where {} are left", count - read);
            return Err(source.refuse(message, "the counts do not fit each other: write the file again"));
        }
        if let (FileCell::Cell(kind), 0) = (kind, read) {
            reader.raw.reserve(kind, source.room(count, 6 + 2 * kind.corners()));
        }
        for _ in 0..block {
            element(reader, kind, tags, &mut elements, source)?;
        }
        read += block;
    }
    reader.raw.cells.iter_mut().zip(&elements.groups).for_each(|(cells, groups)| cells.unite(groups));
    Ok(())
}

/// What is kept of the elements that were read.
#[derive(Debug, Default)]
struct Elements {
    /// Dimension and group of the last one.
    last: Group,
    /// The group of every cell, as in [`Raw::cells`].
    groups: [Vec<i32>; 2],
}

/// One element behind its head: `tags` tags and its nodes.
fn element(reader: &mut Reader, kind: FileCell, tags: i32, so_far: &mut Elements, source: &mut Source) -> Result<()> {
    if !source.is_text() {
        source.tag("the number of an element")?;
    }
    let mut group = (kind.dimension() as i32, 0);
    for which in 0..tags {
        let tag = source.int("a tag of an element")?;
        if which == 0 {
            group.1 = tag.saturating_abs();
        }
    }
    if std::mem::replace(&mut so_far.last, group) != group {
        reader.run += 1;
    }
    if let FileCell::Cell(kind) = kind {
        so_far.groups[kind.dimension() - 2].push(group.1);
    }
    let groups = [group];
    reader.cell(kind, if group.1 == 0 { &[] } else { &groups }, source)
}
