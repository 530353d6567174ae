//! Down and up one supernode for one right-hand side.
//!
//! A supernode is a dense block, columns one after another: a lower triangle (its own unknowns) above a rectangle (the
//! unknowns further on, listed in its pattern).
//!
//! ```text
//! down:  x_s = T^-1 x_s,          x_below -= R x_s          T the triangle, R the rectangle of supernode s
//! up:    x_s = T^-T (x_s - R^T x_below)
//! ```
//!
//! [`PANEL`] columns are taken together, so that x is read and written once for all of them. The order of every sum
//! is fixed. Each way is one function of its own: compiled into the loops around it, or for wider registers, it was slower
//! by a third on small fronts, and large ones come from memory.

use std::ops::{Div, Mul, Sub, SubAssign};

use crate::sparse::multifrontal::{Front, Number, Supernodes};

/// f64 or f32, as these loops need it.
pub trait Entry: Number + SubAssign + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {}

impl Entry for f64 {}
impl Entry for f32 {}

/// Columns taken together.
const PANEL: usize = 4;

/// Partial sums of a product of vectors, held side by side in registers.
const LANES: usize = 8;

/// One supernode: its width, its block, its pattern.
pub struct Supernode<'a, T> {
    width: usize,
    block: &'a [T],
    /// The unknowns further on, ascending.
    pub pattern: &'a [u32],
}

impl<'a, T: Entry> Supernode<'a, T> {
    /// Supernode s, whose front is `front`.
    pub fn new(supernodes: &'a Supernodes, front: &Front, factor: &'a [T], s: usize) -> Self {
        let rows = supernodes.col_ptr_for_row_idx()[s] as usize;
        Self {
            width: front.width,
            block: &factor[front.values..front.values + front.entries()],
            pattern: &supernodes.row_idx()[rows..][..front.rows],
        }
    }

    /// Solves for its own unknowns; `below` becomes what those further on lose, negative.
    #[inline(never)]
    pub fn down(&self, own: &mut [T], below: &mut [T]) {
        below.fill(T::default());
        let mut j = 0;
        while j < self.width {
            if self.width - j >= PANEL {
                down::<T, PANEL>(self, j, own, below);
                j += PANEL;
            } else {
                down::<T, 1>(self, j, own, below);
                j += 1;
            }
        }
    }

    /// Solves for its own unknowns with those further on in `below`.
    #[inline(never)]
    pub fn up(&self, own: &mut [T], below: &[T]) {
        let mut j = self.width;
        while j > 0 {
            if j.is_multiple_of(PANEL) {
                j -= PANEL;
                up::<T, PANEL>(self, j, own, below);
            } else {
                j -= 1;
                up::<T, 1>(self, j, own, below);
            }
        }
    }

    /// Its unknowns, w.
    pub fn width(&self) -> usize {
        self.width
    }

    /// T above R, column by column.
    pub fn block(&self) -> &'a [T] {
        self.block
    }

    #[inline(always)]
    fn height(&self) -> usize {
        self.width + self.pattern.len()
    }

    /// Entry (i, j) of the block.
    #[inline(always)]
    fn at(&self, i: usize, j: usize) -> T {
        self.block[j * self.height() + i]
    }

    /// Rows `from..to` of COUNT columns from `j` on.
    #[inline(always)]
    fn columns<const COUNT: usize>(&self, j: usize, from: usize, to: usize) -> [&'a [T]; COUNT] {
        let height = self.height();
        std::array::from_fn(|c| &self.block[(j + c) * height + from..(j + c) * height + to])
    }
}

/// Columns j .. j + COUNT of the way down: their unknowns, and what they take from those after them.
#[inline(always)]
fn down<T: Entry, const COUNT: usize>(node: &Supernode<T>, j: usize, own: &mut [T], below: &mut [T]) {
    let mut solved = [T::default(); COUNT];
    for c in 0..COUNT {
        let mut value = own[j + c];
        for (b, earlier) in solved[..c].iter().enumerate() {
            value -= node.at(j + c, j + b) * *earlier;
        }
        solved[c] = value / node.at(j + c, j + c);
        own[j + c] = solved[c];
    }
    subtract(&mut own[j + COUNT..], node.columns::<COUNT>(j, j + COUNT, node.width), &solved);
    subtract(below, node.columns::<COUNT>(j, node.width, node.height()), &solved);
}

/// Columns j .. j + COUNT of the way up.
#[inline(always)]
fn up<T: Entry, const COUNT: usize>(node: &Supernode<T>, j: usize, own: &mut [T], below: &[T]) {
    let mut sums = products(node.columns::<COUNT>(j, j + COUNT, node.width), &own[j + COUNT..]);
    let further = products(node.columns::<COUNT>(j, node.width, node.height()), below);
    for c in (0..COUNT).rev() {
        sums[c] += further[c];
        let mut value = own[j + c] - sums[c];
        for later in c + 1..COUNT {
            value -= node.at(j + later, j + c) * own[j + later];
        }
        own[j + c] = value / node.at(j + c, j + c);
    }
}

/// y -= sum_c column_c factor_c.
#[inline(always)]
fn subtract<T: Entry, const COUNT: usize>(y: &mut [T], columns: [&[T]; COUNT], factors: &[T; COUNT]) {
    let n = y.len();
    let columns = columns.map(|column| &column[..n]);
    for i in 0..n {
        let mut sum = T::default();
        for c in 0..COUNT {
            sum += columns[c][i] * factors[c];
        }
        y[i] -= sum;
    }
}

/// The products of the columns with x.
#[inline(always)]
fn products<T: Entry, const COUNT: usize>(columns: [&[T]; COUNT], x: &[T]) -> [T; COUNT] {
    let whole = x.len() / LANES * LANES;
    let mut lanes = [[T::default(); LANES]; COUNT];
    for start in (0..whole).step_by(LANES) {
        let part = &x[start..start + LANES];
        for c in 0..COUNT {
            let column = &columns[c][start..start + LANES];
            for i in 0..LANES {
                lanes[c][i] += column[i] * part[i];
            }
        }
    }
    std::array::from_fn(|c| {
        let mut sum = T::default();
        lanes[c].iter().for_each(|lane| sum += *lane);
        columns[c][whole..].iter().zip(&x[whole..]).for_each(|(a, x)| sum += *a * *x);
        sum
    })
}
