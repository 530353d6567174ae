//! Gmsh files: the header, the sections, and version 4.1.
//!
//! A file is a row of sections `$Name` ... `$EndName`. Read are `$PhysicalNames`, `$Entities` (which groups an entity is in),
//! `$Nodes` and `$Elements`; others are passed over. In version 4.1 nodes and elements come in blocks, one an entity:
//!
//! ```text
//! $Nodes      blocks nodes least-tag greatest-tag,   a block: dimension entity parametric count, tags, places
//! $Elements   blocks cells least-tag greatest-tag,   a block: dimension entity type count, then tag and nodes of each
//! ```
//!
//! Text and binary hold the same numbers in the same order: int 4 bytes, size and real 8.

use std::path::Path;

use super::gmsh_kinds::{FileCell, file_cell};
use super::raw::{Group, MOST_GROUPS, Raw};
use super::source::{Encoding, Source, shown};
use super::{MeshFile, gmsh_old, sound};
use crate::error::Result;

/// Entities times groups that are kept.
const MOST_MEMBERSHIPS: usize = 1 << 20;

/// Reads any version.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<MeshFile> {
    let mut source = Source::new(path, bytes, None);
    let old = header(&mut source)?;
    let mut reader = Reader { raw: Raw::default(), groups: Vec::new(), seen: [false; 2], run: 0 };
    while let Some(word) = source.keyword() {
        reader.section(word, old, &mut source)?;
    }
    if let Some(missing) = ["$Nodes", "$Elements"].iter().zip(reader.seen).find(|(_, seen)| !seen) {
        let message = format!("the file ends without a section {}", missing.0);
        return Err(source.refuse(message, "it is cut off, or holds no mesh: save the mesh, not the geometry"));
    }
    sound::finish(reader.raw, path)
}

/// Reads `$MeshFormat`; true for version 2.
fn header(source: &mut Source) -> Result<bool> {
    const HELP: &str = "save the mesh as version 4.1 or 2.2 (in Gmsh: Mesh.MshFileVersion = 4.1)";
    source.expect("$MeshFormat")?;
    let version = source.word("the version")?;
    let old = match version {
        b"2" | b"2.0" | b"2.1" | b"2.2" => true,
        b"4.1" => false,
        _ => return Err(source.refuse(format!("version {} is not read", shown(version)), HELP)),
    };
    let binary = source.int("the file type")?;
    let width = source.int("the data size")?;
    if !(0..=1).contains(&binary) || width != 8 {
        return Err(
            source.refuse(format!("file type {binary} with data size {width}"), "file type 0 or 1, data size 8")
        );
    }
    source.end_record("the version")?;
    if binary == 1 {
        source.rest_of_line();
        source.encoding = Encoding::LittleEndian;
        let one = source.int("the number 1 that shows the order of bytes")?;
        if one != 1 {
            let message = "the file was written on a machine with the other order of bytes";
            return Err(source.refuse(message, "save the mesh as text"));
        }
    }
    source.expect("$EndMeshFormat")?;
    Ok(old)
}

/// What the sections leave behind.
pub(super) struct Reader {
    pub(super) raw: Raw,
    /// Dimension and number of an entity, and a group that it is in; sorted.
    groups: Vec<(i32, i32, i32)>,
    /// Whether nodes and elements were there.
    seen: [bool; 2],
    /// Blocks of elements so far.
    pub(super) run: u32,
}

impl Reader {
    fn section(&mut self, word: &[u8], old: bool, source: &mut Source) -> Result<()> {
        const LONGEST: usize = 64;
        let name = shown(word);
        if word.len() > LONGEST || !word.starts_with(b"$") || word.starts_with(b"$End") {
            let message = format!("\"{name}\" stands where a section should start");
            return Err(source.refuse(message, "sections start with $Name and end with $EndName"));
        }
        match (name.as_str(), old) {
            ("$PhysicalNames", _) => self.names(source)?,
            ("$Entities", false) => self.binary(source, Self::entities)?,
            ("$Nodes", _) => {
                self.once(0, source)?;
                if old {
                    gmsh_old::nodes(&mut self.raw, source)?
                } else {
                    self.binary(source, Self::nodes)?
                }
                self.raw.nodes.index(source)?;
            }
            ("$Elements", _) => {
                self.once(1, source)?;
                if old { gmsh_old::elements(self, source)? } else { self.binary(source, Self::elements)? }
            }
            _ => {
                let end = [b"$End", &word[1..]].concat();
                if !source.pass(&end) {
                    let message = format!("the section {name} has no end");
                    return Err(source.refuse(message, "the file is cut off: write it again"));
                }
                return Ok(());
            }
        }
        source.expect(&format!("$End{}", &name[1..]))
    }

    /// Refuses a second section of a kind, and elements before nodes.
    fn once(&mut self, which: usize, source: &Source) -> Result<()> {
        if which == 1 && !self.seen[0] {
            return Err(source.refuse("$Elements stands before $Nodes", "write the nodes first, as Gmsh does"));
        }
        if std::mem::replace(&mut self.seen[which], true) {
            return Err(source.refuse("the section is there twice", "one mesh a file"));
        }
        Ok(())
    }

    /// Reads a section whose numbers start behind the line of its name.
    fn binary(&mut self, source: &mut Source, read: fn(&mut Self, &mut Source) -> Result<()>) -> Result<()> {
        if !source.is_text() {
            source.rest_of_line();
        }
        read(self, source)
    }

    /// `$PhysicalNames`: text in every file; a count, then dimension, number and name in quotes.
    fn names(&mut self, source: &mut Source) -> Result<()> {
        let encoding = std::mem::replace(&mut source.encoding, Encoding::Lines);
        let count = source.size("the number of names")?;
        source.end_record("the number of names")?;
        if count > MOST_GROUPS as u64 {
            return Err(source.refuse(format!("{count} names of groups"), format!("at most {MOST_GROUPS}")));
        }
        for _ in 0..count {
            let dimension = source.int("the dimension of a group")?;
            let number = source.int("the number of a group")?;
            if !source.line_goes_on() {
                return Err(source.refuse(format!("group {number} has no name"), "give it a name in quotes"));
            }
            let quoted = String::from_utf8_lossy(source.rest_of_line());
            self.raw.names.push(((dimension, number), quoted.trim_matches('"').to_owned()));
        }
        source.encoding = encoding;
        Ok(())
    }

    /// `$Entities`: only their groups are kept.
    fn entities(&mut self, source: &mut Source) -> Result<()> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = source.size("a number of entities")?;
        }
        source.end_record("the numbers of entities")?;
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                let entity = source.int("the number of an entity")?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    source.real("a bound of an entity")?;
                }
                for _ in 0..source.size("the number of groups")? {
                    let group = source.int("a group")?;
                    if self.groups.len() == MOST_MEMBERSHIPS {
                        let message = format!("the entities are in more than {MOST_MEMBERSHIPS} groups together");
                        return Err(source.refuse(message, "put each entity into fewer groups"));
                    }
                    self.groups.push((dimension, entity, group));
                }
                if dimension > 0 {
                    for _ in 0..source.size("the number of bounding entities")? {
                        source.int("a bounding entity")?;
                    }
                }
                source.end_record("an entity")?;
            }
        }
        self.groups.sort_unstable();
        Ok(())
    }

    /// `$Nodes`: first the tags of a block, then its places.
    fn nodes(&mut self, source: &mut Source) -> Result<()> {
        let (blocks, total) = totals(source)?;
        self.raw.nodes.reserve(source.room(total, 8));
        let mut read = 0_u64;
        for _ in 0..blocks {
            let dimension = source.int("the dimension of a block")?;
            source.int("the entity of a block")?;
            let parametric = source.int("whether the block is parametric")?;
            let count = source.size("the number of nodes of a block")?;
            source.end_record("the head of a block")?;
            let mut tags = source.clone();
            for _ in 0..count {
                source.size("the number of a node")?;
                source.end_record("the number of a node")?;
            }
            for _ in 0..count {
                let tag = tags.size("the number of a node")?;
                tags.end_record("the number of a node")?;
                let mut place = [0.0; 3];
                for (component, name) in place.iter_mut().zip(["x", "y", "z"]) {
                    *component = source.coordinate(name)?;
                }
                for _ in 0..if parametric == 0 { 0 } else { dimension.clamp(0, 3) } {
                    source.real("a parameter of a node")?;
                }
                source.end_record("the place of a node")?;
                self.raw.nodes.push(tag, place);
            }
            read += count;
        }
        check_total(source, "nodes", total, read)
    }

    /// `$Elements`.
    fn elements(&mut self, source: &mut Source) -> Result<()> {
        let (blocks, total) = totals(source)?;
        let mut read = 0_u64;
        for _ in 0..blocks {
            let dimension = source.int("the dimension of a block")?;
            let entity = source.int("the entity of a block")?;
            let kind = source.int("the type of a block")?;
            let kind = file_cell(kind, source)?;
            if usize::try_from(dimension) != Ok(kind.dimension()) {
                let message = format!("cells of dimension {} in an entity of dimension {dimension}", kind.dimension());
                return Err(source.refuse(message, "the type of a block has the dimension of its entity"));
            }
            let count = source.size("the number of cells of a block")?;
            source.end_record("the head of a block")?;
            let start = self.groups.partition_point(|&(d, e, _)| (d, e) < (dimension, entity));
            let end = self.groups.partition_point(|&(d, e, _)| (d, e) <= (dimension, entity));
            let groups: Vec<Group> =
                self.groups[start..end].iter().map(|&(d, _, group)| (d, group.saturating_abs())).collect();
            self.run += 1;
            if let FileCell::Cell(kind) = kind {
                self.raw.reserve(kind, source.room(count, 2 + 2 * kind.corners()));
            }
            for _ in 0..count {
                source.size("the number of a cell")?;
                self.cell(kind, &groups, source)?;
            }
            read += count;
        }
        check_total(source, "cells", total, read)
    }

    /// The corners of a cell, to the end of its record.
    pub(super) fn cell(&mut self, kind: FileCell, groups: &[Group], source: &mut Source) -> Result<()> {
        let mut corners = [0; 8];
        for corner in &mut corners[..kind.corners()] {
            let tag = source.tag("a node of a cell")?;
            *corner = self.raw.nodes.corner(tag, source)?;
        }
        let corners = &corners[..kind.corners()];
        if let FileCell::Cell(kind) = kind {
            self.raw.push(kind, corners, source.line());
        }
        source.end_record("a cell")?;
        if groups.is_empty() { Ok(()) } else { self.raw.enroll(groups, self.run, corners, source) }
    }
}

/// Numbers of blocks and of records in all.
fn totals(source: &mut Source) -> Result<(u64, u64)> {
    let blocks = source.size("the number of blocks")?;
    let total = source.size("how many there are")?;
    source.size("the least number")?;
    source.size("the greatest number")?;
    source.end_record("the head of the section")?;
    Ok((blocks, total))
}

fn check_total(source: &Source, what: &str, claimed: u64, read: u64) -> Result<()> {
    if claimed == read {
        return Ok(());
    }
    Err(source.refuse(
        format!("the section says {claimed} {what}, its blocks hold {read}"),
        "the counts do not fit each other: write the file again",
    ))
}
