//! A symmetric operator on a coarse grid: 27 neighbours, a 3 x 3 block for each, in f32.
//!
//! ```text
//! (A u)_I = A_II u_I + sum over the forward offsets o of ( A_{I,I+o} u_{I+o} + A_{I-o,I}^T u_{I-o} )
//! ```
//!
//! Only the diagonal block and the 13 forward ones are stored, plane by plane, entry by entry: the numbers of one plane
//! of nodes lie together. A product takes as many neighbouring places as a register holds, and keeps the sums of all columns
//! for them in registers: a block is loaded once for all columns, and a place owns its sums.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::padded::{Padded, Piece, SPARE, components};

/// Blocks of a plane: the diagonal, then the forward offsets.
#[derive(Debug, Clone)]
pub struct Blocks {
    padded: Padded,
    values: Vec<f32>,
}

/// Numbers of a block.
pub const ENTRIES: usize = 9;

impl Blocks {
    /// All zeros on a grid.
    pub fn new(padded: &Padded) -> Self {
        let count = (padded.forward().len() + 1) * ENTRIES * padded.plane() * padded.extents()[0] + SPARE;
        Self { padded: padded.clone(), values: vec![0.0; count] }
    }

    /// Numbers stored for one plane of nodes.
    pub fn plane_len(&self) -> usize {
        (self.padded.forward().len() + 1) * ENTRIES * self.padded.plane()
    }

    /// All planes, each of [`Blocks::plane_len`] numbers.
    pub fn planes_mut(&mut self) -> rayon::slice::ChunksExactMut<'_, f32> {
        let size = self.plane_len();
        self.values.par_chunks_exact_mut(size)
    }

    /// Entry (row, column) of block `o` (0: the diagonal, else a forward offset + 1) over the places of a plane.
    pub fn entry(&self, plane: usize, o: usize, entry: usize) -> &[f32] {
        let size = self.padded.plane();
        let start = plane * self.plane_len() + (o * ENTRIES + entry) * size;
        &self.values[start..start + size]
    }

    /// Block `o` of a node, row-major.
    pub fn block(&self, index: [usize; 3], o: usize) -> [f32; ENTRIES] {
        let within = index[1] * self.padded.row() + index[2];
        std::array::from_fn(|entry| self.entry(index[0], o, entry)[within])
    }

    /// The diagonal blocks of a plane: `straight` takes xx, yy, zz, `mixed` xy, xz, yz.
    pub fn diagonal(&self, plane: usize, straight: &mut [&mut [f32]; 3], mixed: &mut [&mut [f32]; 3]) {
        for (a, (straight, mixed)) in straight.iter_mut().zip(mixed).enumerate() {
            straight.copy_from_slice(self.entry(plane, 0, 4 * a));
            mixed.copy_from_slice(self.entry(plane, 0, [1, 2, 5][a]));
        }
    }

    /// Bytes of the numbers.
    pub fn bytes(&self) -> usize {
        4 * self.values.len()
    }

    /// out = A u on places from `start`, all of one plane, for some columns: `u` are whole vectors, `out` a piece of each.
    pub fn product<const COLUMNS: usize>(&self, u: [&[f32]; COLUMNS], start: usize, out: &mut Piece<f32, COLUMNS>) {
        pulp::Arch::new().dispatch(Product { blocks: self, u: u.map(components), start, out });
    }

    /// The numbers from a place of the first entry of a block on.
    #[inline(always)]
    fn from(&self, plane: usize, o: usize, within: isize) -> &[f32] {
        let start = plane * self.plane_len() + o * ENTRIES * self.padded.plane();
        &self.values[(start as isize + within) as usize..]
    }
}

/// A product to be computed on a piece; columns share what is read of the blocks, in registers.
struct Product<'a, 'b, const COLUMNS: usize> {
    blocks: &'a Blocks,
    u: [[&'a [f32]; 3]; COLUMNS],
    start: usize,
    out: &'a mut Piece<'b, f32, COLUMNS>,
}

impl<const COLUMNS: usize> WithSimd for Product<'_, '_, COLUMNS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        const { assert!(S::F32_LANES <= SPARE) };
        let Self { blocks, u, start, out } = self;
        let padded = &blocks.padded;
        let size = padded.plane();
        let (plane, within) = ((start - padded.base()) / size, (start - padded.base()) % size);
        // the last row is empty, and so is the last place before it
        let count = out[0][0].len().min((size - padded.row() - 1).saturating_sub(within));
        for first in (0..count).step_by(S::F32_LANES) {
            let mut sum = [[simd.splat_f32s(0.0); 3]; COLUMNS];
            let place = start + first;
            let within = (within + first) as isize;
            add_block::<S, COLUMNS, false>(simd, blocks.from(plane, 0, within), size, &u, place, &mut sum);
            for (o, &offset) in padded.forward().iter().enumerate() {
                let step = padded.step(offset);
                let ahead = blocks.from(plane, o + 1, within);
                add_block::<S, COLUMNS, false>(simd, ahead, size, &u, place + step, &mut sum);
                let planes = offset[0] as usize;
                if plane >= planes {
                    // in the first row this begins in the empty row of the entry before: zeros, as there is no neighbour
                    let behind = blocks.from(plane - planes, o + 1, within + (planes * size) as isize - step as isize);
                    add_block::<S, COLUMNS, true>(simd, behind, size, &u, place - step, &mut sum);
                }
            }
            let last = S::F32_LANES.min(count - first);
            for k in 0..COLUMNS {
                for a in 0..3 {
                    simd.partial_store_f32s(&mut out[k][a][first..first + last], sum[k][a]);
                }
            }
        }
        out.iter_mut().flatten().for_each(|out| out[count..].fill(0.0));
    }
}

/// sum += B u for the block whose entries begin in `from`, `size` apart, or B^T u.
#[inline(always)]
fn add_block<S: Simd, const COLUMNS: usize, const TRANSPOSED: bool>(
    simd: S,
    from: &[f32],
    size: usize,
    u: &[[&[f32]; 3]; COLUMNS],
    place: usize,
    sum: &mut [[S::f32s; 3]; COLUMNS],
) {
    let mut b = [simd.splat_f32s(0.0); ENTRIES];
    for (entry, b) in b.iter_mut().enumerate() {
        *b = take::<S>(from, entry * size);
    }
    for (sum, u) in sum.iter_mut().zip(u) {
        let u = [take::<S>(u[0], place), take::<S>(u[1], place), take::<S>(u[2], place)];
        for (r, sum) in sum.iter_mut().enumerate() {
            for (c, u) in u.into_iter().enumerate() {
                let entry = if TRANSPOSED { 3 * c + r } else { 3 * r + c };
                *sum = simd.mul_add_e_f32s(b[entry], u, *sum);
            }
        }
    }
}

/// A register full of numbers. Inlined always: outside of the dispatched function it would not have the wide registers.
#[inline(always)]
fn take<S: Simd>(v: &[f32], p: usize) -> S::f32s {
    S::as_simd_f32s(&v[p..p + S::F32_LANES]).0[0]
}
