//! Building a front: entries of A, and the updates of its children added where their rows are.
//!
//! Columns of a front do not depend on each other here, so a large front is built in blocks of columns, side by side.

use std::ops::Range;

use super::plan::{Front, Join, Run};
use super::{Job, Number, both};

/// Columns of a large front that are not divided further.
const BLOCK: usize = 96;

/// Columns `places` of a front, column-major with `height` rows, of which the first is row `shift` of the front.
struct Block<'a, T> {
    numbers: &'a mut [T],
    places: Range<usize>,
    height: usize,
    shift: usize,
}

impl<T> Block<'_, T> {
    fn halves(self) -> (Self, Self) {
        let Self { numbers, places, height, shift } = self;
        let middle = places.start + places.len() / 2;
        let (left, right) = numbers.split_at_mut((middle - places.start) * height);
        (
            Block { numbers: left, places: places.start..middle, height, shift },
            Block { numbers: right, places: middle..places.end, height, shift },
        )
    }

    fn is_whole(&self, tiled: bool) -> bool {
        !tiled || self.places.len() <= BLOCK
    }
}

impl<T: Number> Job<'_, T> {
    /// The front's own columns: A, then the children; `updates` begins at place `shift` of the workspace.
    pub(super) fn columns(&self, front: &Front, columns: &mut [T], updates: &[T], shift: usize, tiled: bool) {
        let block = Block { numbers: columns, places: 0..front.width, height: front.height(), shift: 0 };
        self.columns_of_block(front, block, updates, shift, tiled);
    }

    fn columns_of_block(&self, front: &Front, mut block: Block<T>, updates: &[T], shift: usize, tiled: bool) {
        if !block.is_whole(tiled) {
            let (left, right) = block.halves();
            let half = |block| self.columns_of_block(front, block, updates, shift, tiled);
            both(|| half(left), || half(right));
            return;
        }
        block.numbers.fill(T::default());
        let start = front.values + block.places.start * block.height;
        let column = |place: usize| self.lower_starts[front.first + place] as usize;
        let entries = column(block.places.start)..column(block.places.end);
        for (&target, &value) in self.plan.targets[entries.clone()].iter().zip(&self.values[entries]) {
            block.numbers[target as usize - start] += value;
        }
        for join in &self.plan.joins[front.joins.clone()] {
            let child = &self.plan.fronts[join.child];
            self.add(join, &updates[child.update - shift..][..child.rows.pow(2)], &mut block);
        }
    }

    /// The children in the update of a front.
    pub(super) fn rest_of_children(&self, front: &Front, updates: &mut [T], shift: usize, tiled: bool) {
        let (w, r) = (front.width, front.rows);
        for join in &self.plan.joins[front.joins.clone()] {
            let child = &self.plan.fronts[join.child];
            let (child, update) = two(updates, child.update - shift, child.rows.pow(2), front.update - shift, r.pow(2));
            self.add_in_blocks(join, child, Block { numbers: update, places: w..w + r, height: r, shift: w }, tiled);
        }
    }

    fn add_in_blocks(&self, join: &Join, child: &[T], mut block: Block<T>, tiled: bool) {
        if block.is_whole(tiled) {
            return self.add(join, child, &mut block);
        }
        let (left, right) = block.halves();
        both(|| self.add_in_blocks(join, child, left, tiled), || self.add_in_blocks(join, child, right, tiled));
    }

    fn add(&self, join: &Join, child: &[T], block: &mut Block<T>) {
        let rows = self.plan.fronts[join.child].rows;
        self.simd.dispatch(|| add_columns(&self.plan.runs[join.runs.clone()], child, rows, block));
    }
}

/// Two stretches that do not overlap: the first to read, the second to write.
fn two<T>(all: &mut [T], from: usize, from_len: usize, to: usize, to_len: usize) -> (&[T], &mut [T]) {
    if from < to {
        let (head, tail) = all.split_at_mut(to);
        (&head[from..from + from_len], &mut tail[..to_len])
    } else {
        let (head, tail) = all.split_at_mut(from);
        (&tail[..from_len], &mut head[to..to + to_len])
    }
}

/// Adds those columns of a child's update (column-major, `rows` rows, lower triangle) that belong to a block.
#[inline(always)]
fn add_columns<T: Number>(runs: &[Run], child: &[T], rows: usize, block: &mut Block<T>) {
    let mut first = runs.partition_point(|run| ((run.to + run.length) as usize) <= block.places.start);
    while first < runs.len() && (runs[first].to as usize) < block.places.end {
        let Run { from, to, length } = runs[first];
        let (from, to) = (from as usize, to as usize);
        let skip = block.places.start.saturating_sub(to);
        for column in skip..(length as usize).min(block.places.end - to) {
            let start = (to + column - block.places.start) * block.height;
            let target = &mut block.numbers[start..start + block.height];
            add_column(&runs[first..], &child[(from + column) * rows..][..rows], column, target, block.shift);
        }
        first += 1;
    }
}

/// Adds one column from its diagonal on, which is entry `skip` of the first run.
#[inline(always)]
fn add_column<T: Number>(runs: &[Run], child: &[T], mut skip: usize, target: &mut [T], shift: usize) {
    for run in runs {
        let (from, to) = (run.from as usize + skip, run.to as usize + skip - shift);
        let length = run.length as usize - skip;
        for (target, value) in target[to..to + length].iter_mut().zip(&child[from..from + length]) {
            *target += *value;
        }
        skip = 0;
    }
}
