//! The bytes of a mesh file, read number by number, as text or binary.
//!
//! Text is read in records: numbers stand on one line, and a line that ends too early or goes on too long is refused where
//! it is. Formats that may break lines anywhere (VTK) are read freely. Binary numbers have no lines: errors name the byte.
//! Nothing is stored here, so a file that claims more than it holds costs nothing.

use std::path::Path;

use crate::error::{Error, Result};

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// Words between blanks, a record a line.
    Lines,
    /// Words between blanks, lines broken anywhere.
    Words,
    /// Binary, the low byte first.
    LittleEndian,
    /// Binary, the high byte first.
    BigEndian,
}

/// A place in a file.
#[derive(Debug, Clone)]
pub(super) struct Source<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    line: usize,
    in_record: bool,
    comment: Option<u8>,
    /// Bytes of a node's number in a binary file, 8 or 4.
    pub(super) tag_width: usize,
    /// How the next numbers are written.
    pub(super) encoding: Encoding,
}

impl<'a> Source<'a> {
    /// The start of a file; `comment` begins a remark that ends with the line.
    pub(super) fn new(path: &'a Path, bytes: &'a [u8], comment: Option<u8>) -> Self {
        Self { path, bytes, at: 0, line: 1, in_record: false, comment, tag_width: 8, encoding: Encoding::Lines }
    }

    /// An error at this place.
    pub(super) fn refuse(&self, message: impl std::fmt::Display, help: impl Into<String>) -> Error {
        let place = if self.is_text() { format!("line {}", self.line) } else { format!("byte {}", self.at) };
        Error::File { path: self.path.to_owned(), message: format!("{place}: {message}"), help: help.into() }
    }

    /// This file with errors at another line; as it is for line 0.
    pub(super) fn at_line(&self, line: usize) -> Self {
        Self { line: if line > 0 { line } else { self.line }, ..self.clone() }
    }

    /// True when the next bytes are these.
    pub(super) fn starts_with(&self, bytes: &[u8]) -> bool {
        self.bytes[self.at..].starts_with(bytes)
    }

    /// The line of the last word, 0 in a binary file.
    pub(super) fn line(&self) -> usize {
        if self.is_text() { self.line } else { 0 }
    }

    /// Bytes not read yet: what is claimed to follow cannot be more.
    pub(super) fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Bytes of the whole file.
    pub(super) fn length(&self) -> usize {
        self.bytes.len()
    }

    /// Room for `claimed` records of at least `least` bytes: no more than the file can hold.
    pub(super) fn room(&self, claimed: u64, least: usize) -> usize {
        usize::try_from(claimed).unwrap_or(usize::MAX).min(self.remaining() / least + 1)
    }

    pub(super) fn is_text(&self) -> bool {
        matches!(self.encoding, Encoding::Lines | Encoding::Words)
    }

    /// Passes blanks and remarks, lines too if wanted; true when a word follows.
    fn skip_blanks(&mut self, lines: bool) -> bool {
        while let Some(&byte) = self.bytes.get(self.at) {
            match byte {
                b'\n' if !lines => return false,
                b'\n' => self.line += 1,
                byte if byte.is_ascii_whitespace() => {}
                byte if Some(byte) == self.comment => {
                    let rest = &self.bytes[self.at..];
                    self.at += rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
                    continue;
                }
                _ => return true,
            }
            self.at += 1;
        }
        false
    }

    fn take_word(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// The next word wherever it is; none at the end of the file. It is on its own: a record starts behind it.
    pub(super) fn keyword(&mut self) -> Option<&'a [u8]> {
        self.in_record = false;
        self.skip_blanks(true).then(|| self.take_word())
    }

    /// The next word of the record.
    pub(super) fn word(&mut self, what: &str) -> Result<&'a [u8]> {
        let lines = !self.in_record || self.encoding == Encoding::Words;
        if !self.skip_blanks(lines) {
            let end = if self.at == self.bytes.len() { "file" } else { "line" };
            return Err(self.refuse(
                format!("the {end} ends where {what} should stand"),
                "the file is cut off or not of this format: write it again",
            ));
        }
        self.in_record = true;
        Ok(self.take_word())
    }

    /// The next word where a section or a keyword starts; it must be `expected`.
    pub(super) fn expect(&mut self, expected: &str) -> Result<()> {
        let found = self.keyword().map(shown);
        if found.as_deref() == Some(expected) {
            return Ok(());
        }
        let found = found.map_or("the end of the file".into(), |word| format!("\"{word}\""));
        Err(self.refuse(
            format!("{found} stands where {expected} should"),
            "the counts do not fit what follows, or the file is cut off: write it again",
        ))
    }

    /// True when the line goes on.
    pub(super) fn line_goes_on(&mut self) -> bool {
        self.skip_blanks(false)
    }

    /// Ends the record: nothing more stands on its line.
    pub(super) fn end_record(&mut self, what: &str) -> Result<()> {
        if self.encoding == Encoding::Lines && self.skip_blanks(false) {
            let word = shown(self.take_word());
            return Err(self.refuse(
                format!("\"{word}\" stands behind the end of {what}"),
                "one record a line, with as many numbers as the format says",
            ));
        }
        self.in_record = false;
        Ok(())
    }

    /// Passes the rest of the line and its end, and gives it.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        self.line += usize::from(length < rest.len());
        self.in_record = false;
        rest[..length].trim_ascii()
    }

    /// Goes behind `marker`, which must stand at the start of a line; false when there is none.
    pub(super) fn pass(&mut self, marker: &[u8]) -> bool {
        let rest = &self.bytes[self.at..];
        let found = rest.windows(marker.len() + 1).position(|window| window[0] == b'\n' && &window[1..] == marker);
        if let Some(start) = found {
            self.line += rest[..=start].iter().filter(|&&byte| byte == b'\n').count();
            self.at += start + 1 + marker.len();
            self.in_record = false;
        }
        found.is_some()
    }

    /// The next N bytes of a binary file.
    fn raw<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let Some(bytes) = self.bytes[self.at..].first_chunk::<N>() else {
            return Err(
                self.refuse(format!("the file ends where {what} should stand"), "the file is cut off: write it again")
            );
        };
        self.at += N;
        Ok(if self.encoding == Encoding::BigEndian { reversed(*bytes) } else { *bytes })
    }

    /// A signed integer: four bytes in a binary file.
    pub(super) fn int(&mut self, what: &str) -> Result<i32> {
        if self.is_text() { self.parsed(what, "a whole number") } else { Ok(i32::from_le_bytes(self.raw(what)?)) }
    }

    /// A count or a number of a node: eight bytes in a binary file.
    pub(super) fn size(&mut self, what: &str) -> Result<u64> {
        if self.is_text() {
            self.parsed(what, "a whole number from 0")
        } else {
            Ok(u64::from_le_bytes(self.raw(what)?))
        }
    }

    /// The number of a node: [`Source::tag_width`] bytes in a binary file.
    pub(super) fn tag(&mut self, what: &str) -> Result<u64> {
        if self.is_text() || self.tag_width == 8 {
            self.size(what)
        } else {
            Ok(u32::from_le_bytes(self.raw(what)?).into())
        }
    }

    /// A real number, whatever it is: eight bytes in a binary file.
    pub(super) fn real(&mut self, what: &str) -> Result<f64> {
        if self.is_text() { self.parsed(what, "a number") } else { Ok(f64::from_le_bytes(self.raw(what)?)) }
    }

    /// A real number of four bytes in a binary file.
    pub(super) fn single(&mut self, what: &str) -> Result<f64> {
        if self.is_text() { self.real(what) } else { Ok(f32::from_le_bytes(self.raw(what)?).into()) }
    }

    /// A byte of a binary file.
    pub(super) fn byte(&mut self, what: &str) -> Result<u8> {
        Ok(self.raw::<1>(what)?[0])
    }

    /// A coordinate: a real number that is finite.
    pub(super) fn coordinate(&mut self, what: &str) -> Result<f64> {
        let value = self.real(what)?;
        self.finite(value, what)
    }

    /// The value, if it is a place in space.
    pub(super) fn finite(&self, value: f64, what: &str) -> Result<f64> {
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.refuse(format!("{what} is {value}"), "coordinates are finite numbers in metres"))
    }

    fn parsed<T: std::str::FromStr>(&mut self, what: &str, kind: &str) -> Result<T> {
        let word = self.word(what)?;
        let value = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        value.ok_or_else(|| {
            self.refuse(format!("{what} is \"{}\", not {kind}", shown(word)), format!("{what} must be {kind}"))
        })
    }
}

fn reversed<const N: usize>(mut bytes: [u8; N]) -> [u8; N] {
    bytes.reverse();
    bytes
}

/// A word as an error shows it: not longer than 40 characters, and printable.
pub(super) fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text: String = String::from_utf8_lossy(&word[..word.len().min(LONGEST)])
        .chars()
        .map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c })
        .collect();
    if word.len() > LONGEST { text + "..." } else { text }
}
