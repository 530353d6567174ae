//! The lists of a legacy VTK file: heads of sections, the points of each cell in the old form and the new, types of cells.

use super::raw::unsupported;
use super::source::{Encoding, Source, shown};
use crate::error::Result;

/// Reads the head of a section, which is text: its numbers, then whether a word ends it.
pub(super) fn head(source: &mut Source, counts: &mut [u64], what: &str) -> Result<Vec<u8>> {
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

/// The points of each cell.
#[derive(Default)]
pub(super) struct Lists {
    /// Where the points of a cell end in `points`.
    pub(super) ends: Vec<u32>,
    /// The points, cell after cell.
    pub(super) points: Vec<u32>,
    /// Line of each cell; empty where cells have no lines of their own.
    pub(super) lines: Vec<u32>,
}

impl Lists {
    /// The section behind its keyword.
    pub(super) fn read(source: &mut Source) -> Result<Self> {
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
pub(super) fn cell_types(source: &mut Source) -> Result<Vec<u8>> {
    let mut count = [0];
    head(source, &mut count, "the number of types")?;
    let mut types = Vec::with_capacity(source.room(count[0], 2));
    for _ in 0..count[0] {
        let kind = source.int("the type of a cell")?;
        types.push(u8::try_from(kind).map_err(|_| unsupported(source, &format!("cell of VTK's type {kind}")))?);
    }
    Ok(types)
}
