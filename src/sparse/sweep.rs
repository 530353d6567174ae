//! L L^T x = b for one right-hand side: down L, then up L^T.
//!
//! A solve reads every number of L twice and computes two operations with each: it is as fast as L comes from memory.
//! faer's sweeps are made for many columns at once, where the numbers of L are used again and again; for one column its
//! calls cost more than the work. So one column goes through here. A supernode is a dense block, columns one after
//! another: a lower triangle (its own unknowns) above a rectangle (the unknowns further on, listed in its pattern).
//!
//! ```text
//! down:  x_s = T^-1 x_s,          x_below -= R x_s          T the triangle, R the rectangle of supernode s
//! up:    x_s = T^-T (x_s - R^T x_below)
//! ```
//!
//! [`PANEL`] columns are taken together, so that x is read and written once for all of them. The order of every sum
//! is fixed. The element type is f64 or f32.

use std::ops::{AddAssign, Div, Mul, Sub, SubAssign};

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// Columns taken together.
const PANEL: usize = 4;

/// Partial sums of a product of vectors, held side by side in registers.
const LANES: usize = 8;

/// One supernode: its first unknown, its width, its block, its pattern.
struct Supernode<'a, T> {
    first: usize,
    width: usize,
    block: &'a [T],
    pattern: &'a [u32],
}

impl<'a, T: Copy> Supernode<'a, T> {
    fn new(supernodes: &'a SymbolicSupernodalCholesky<u32>, factor: &'a [T], s: usize) -> Self {
        let (first, end) = (supernodes.supernode_begin()[s] as usize, supernodes.supernode_end()[s] as usize);
        let values = supernodes.col_ptr_for_val();
        let rows = supernodes.col_ptr_for_row_idx()[s] as usize;
        Self {
            first,
            width: end - first,
            block: &factor[values[s] as usize..values[s + 1] as usize],
            pattern: &supernodes.row_idx()[rows..][..supernodes.nnz_per_super()[s] as usize],
        }
    }

    fn height(&self) -> usize {
        self.width + self.pattern.len()
    }

    /// Entry (i, j) of the block.
    fn at(&self, i: usize, j: usize) -> T {
        self.block[j * self.height() + i]
    }

    /// Rows `from..to` of COUNT columns from `j` on.
    fn columns<const COUNT: usize>(&self, j: usize, from: usize, to: usize) -> [&'a [T]; COUNT] {
        let height = self.height();
        std::array::from_fn(|c| &self.block[(j + c) * height + from..(j + c) * height + to])
    }
}

/// Solves L L^T x = b in place, in elimination order; `below` is workspace of length n.
///
/// # Panics
/// When a slice is shorter than n, or `factor` is not a factor of these supernodes.
pub(super) fn solve<T>(supernodes: &SymbolicSupernodalCholesky<u32>, factor: &[T], x: &mut [T], below: &mut [T])
where
    T: Copy + Default + AddAssign + SubAssign + Sub<Output = T> + Mul<Output = T> + Div<Output = T>,
{
    for s in 0..supernodes.n_supernodes() {
        let node = Supernode::new(supernodes, factor, s);
        let below = &mut below[..node.pattern.len()];
        below.fill(T::default());
        let mut j = 0;
        while j < node.width {
            if node.width - j >= PANEL {
                down::<T, PANEL>(&node, j, x, below);
                j += PANEL;
            } else {
                down::<T, 1>(&node, j, x, below);
                j += 1;
            }
        }
        for (&i, value) in node.pattern.iter().zip(below.iter()) {
            x[i as usize] += *value;
        }
    }
    for s in (0..supernodes.n_supernodes()).rev() {
        let node = Supernode::new(supernodes, factor, s);
        let below = &mut below[..node.pattern.len()];
        for (&i, value) in node.pattern.iter().zip(below.iter_mut()) {
            *value = x[i as usize];
        }
        let mut j = node.width;
        while j > 0 {
            if j.is_multiple_of(PANEL) {
                j -= PANEL;
                up::<T, PANEL>(&node, j, x, below);
            } else {
                j -= 1;
                up::<T, 1>(&node, j, x, below);
            }
        }
    }
}

/// Columns j .. j + COUNT of the way down: their unknowns, and what they take from those after them.
fn down<T, const COUNT: usize>(node: &Supernode<T>, j: usize, x: &mut [T], below: &mut [T])
where
    T: Copy + Default + SubAssign + Sub<Output = T> + Mul<Output = T> + Div<Output = T> + AddAssign,
{
    let own = &mut x[node.first..node.first + node.width];
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
fn up<T, const COUNT: usize>(node: &Supernode<T>, j: usize, x: &mut [T], below: &[T])
where
    T: Copy + Default + SubAssign + Sub<Output = T> + Mul<Output = T> + Div<Output = T> + AddAssign,
{
    let own = &mut x[node.first..node.first + node.width];
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
fn subtract<T, const COUNT: usize>(y: &mut [T], columns: [&[T]; COUNT], factors: &[T; COUNT])
where
    T: Copy + Default + SubAssign + AddAssign + Mul<Output = T>,
{
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
fn products<T, const COUNT: usize>(columns: [&[T]; COUNT], x: &[T]) -> [T; COUNT]
where
    T: Copy + Default + AddAssign + Mul<Output = T>,
{
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
