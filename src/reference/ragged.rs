//! Lists of different lengths, one after another in one array.

/// Rows of items; row i is `items[starts[i]..starts[i + 1]]`.
#[derive(Debug, Clone)]
pub struct Ragged<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for Ragged<T> {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl<T> Ragged<T> {
    /// Adds an item to the last row, which [`Ragged::close`] ends.
    pub fn push(&mut self, item: T) {
        self.items.push(item);
    }

    /// Ends the row that was being written.
    pub fn close(&mut self) {
        self.starts.push(self.items.len() as u32);
    }

    /// One row.
    pub fn row(&self, i: usize) -> &[T] {
        &self.items[self.range(i)]
    }

    /// The items of the row that is being written.
    pub fn open_row(&mut self) -> &mut [T] {
        &mut self.items[self.starts[self.starts.len() - 1] as usize..]
    }

    /// All items, row after row.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Where a row stands among all items.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }
}

impl<T: Copy> Ragged<T> {
    /// `rows` rows from pairs of a row and an item; within a row the items keep their order.
    pub fn gather(rows: usize, pairs: impl Iterator<Item = (u32, T)>) -> Self {
        let mut pairs: Vec<(u32, T)> = pairs.collect();
        pairs.sort_by_key(|pair| pair.0);
        let mut starts = vec![0; rows + 1];
        pairs.iter().for_each(|pair| starts[pair.0 as usize + 1] += 1);
        (0..rows).for_each(|row| starts[row + 1] += starts[row]);
        Self { starts, items: pairs.into_iter().map(|pair| pair.1).collect() }
    }
}
