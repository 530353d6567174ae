//! Lists of numbers, and lists of lists, as files hold them, in little memory.
//!
//! A vector that grows while a file is read holds up to three times its numbers, and a vector of short vectors many times
//! its numbers. Here they lie behind each other in chunks of a fixed length, which never move: 8 bytes a number and 4 a
//! row, where the shortest text of a number takes 2 and of a row 3.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{DeserializeSeed, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// Values in a chunk.
const CHUNK: usize = 4096;

/// A list in chunks.
#[derive(Debug, Clone)]
pub struct Chunks<T>(Vec<Vec<T>>);

impl<T> Default for Chunks<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Chunks<T> {
    fn push(&mut self, value: T) {
        match self.0.last_mut() {
            Some(chunk) if chunk.len() < CHUNK => chunk.push(value),
            // a list of a few values takes no more than they do
            None => self.0.push(vec![value]),
            Some(_) => {
                let mut chunk = Vec::with_capacity(CHUNK);
                chunk.push(value);
                self.0.push(chunk);
            }
        }
    }

    /// How many values there are.
    pub fn len(&self) -> usize {
        self.0.iter().map(Vec::len).sum()
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The values in their order.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.0.iter().flatten()
    }
}

/// Rows of numbers.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    numbers: Chunks<f64>,
    lengths: Chunks<u32>,
}

impl Rows {
    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.lengths.len()
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.lengths.is_empty()
    }

    /// Makes something of every row; the first failure ends it.
    ///
    /// # Errors
    /// That of the first row that `make` refuses; it is given the number of the row and its numbers.
    pub fn map<T, E>(&self, mut make: impl FnMut(usize, &[f64]) -> Result<T, E>) -> Result<Vec<T>, E> {
        // rows without numbers are none that anyone makes much of
        let mut made = Vec::with_capacity(self.len().min(self.numbers.len()));
        let mut numbers = self.numbers.iter();
        let mut row = Vec::new();
        for (i, &length) in self.lengths.iter().enumerate() {
            row.clear();
            row.extend(numbers.by_ref().take(length as usize));
            made.push(make(i, &row)?);
        }
        Ok(made)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Chunks<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for List<T> {
            type Value = Chunks<T>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a list of numbers")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Chunks<T>, A::Error> {
                let mut chunks = Chunks::default();
                while let Some(value) = list.next_element()? {
                    chunks.push(value);
                }
                Ok(chunks)
            }
        }
        deserializer.deserialize_seq(List(PhantomData))
    }
}

/// Appends one row.
struct Row<'a>(&'a mut Rows);

impl<'de> DeserializeSeed<'de> for Row<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Row<'_> {
    type Value = ();
    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a list of numbers")
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut row: A) -> Result<(), A::Error> {
        let mut length = 0;
        while let Some(number) = row.next_element()? {
            self.0.numbers.push(number);
            length += 1;
        }
        self.0.lengths.push(length);
        Ok(())
    }
}

impl<'de> Deserialize<'de> for Rows {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct All;
        impl<'de> Visitor<'de> for All {
            type Value = Rows;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a list of lists of numbers")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Rows, A::Error> {
                let mut rows = Rows::default();
                while list.next_element_seed(Row(&mut rows))?.is_some() {}
                Ok(rows)
            }
        }
        deserializer.deserialize_seq(All)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_were_across_chunks() {
        let rows: Vec<Vec<f64>> = (0..3000).map(|i| (0..i % 5).map(|j| f64::from(10 * i + j)).collect()).collect();
        let text = serde_json::to_string(&rows).expect("numbers");
        let read: Rows = serde_json::from_str(&text).expect("rows");
        assert_eq!((read.len(), read.is_empty()), (3000, false));
        let same = |i: usize, row: &[f64]| if row == rows[i] { Ok(()) } else { Err(i) };
        assert_eq!(read.map(same).map(|all| all.len()), Ok(3000));
        let list: Chunks<usize> = serde_json::from_str("[3, 4]").expect("a list");
        assert_eq!((list.len(), list.iter().copied().collect::<Vec<_>>()), (2, vec![3, 4]));
        for wrong in ["3", "[3]", "[[\"a\"]]", "[[1], null]", "{}"] {
            assert!(serde_json::from_str::<Rows>(wrong).is_err(), "{wrong}");
        }
    }
}
