//! A symmetric operator on a coarse grid: 27 neighbours, a 3 x 3 block for each, in f32.
//!
//! ```text
//! (A u)_I = A_II u_I + sum over the forward offsets o of ( A_{I,I+o} u_{I+o} + A_{I-o,I}^T u_{I-o} )
//! ```
//!
//! Only the diagonal block and the 13 forward ones are stored, plane by plane, entry by entry: the numbers of one plane
//! of nodes lie together, and a product is a row of plain loops over it. The plane owns its sums.

use std::ops::Range;

use rayon::prelude::*;

use super::padded::{Padded, components};

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
        let count = (padded.forward().len() + 1) * ENTRIES * padded.plane() * padded.extents()[0];
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

    /// out = A u on one plane; `u` is a whole vector, `out` that plane of one.
    pub fn product(&self, u: &[f32], plane: usize, out: &mut [&mut [f32]; 3]) {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || self.product_in_place(u, plane, out),
        );
    }

    #[inline(always)]
    fn product_in_place(&self, u: &[f32], plane: usize, out: &mut [&mut [f32]; 3]) {
        let size = self.padded.plane();
        let start = self.padded.base() + plane * size;
        let u = components(u);
        out.iter_mut().for_each(|out| out.fill(0.0));
        self.add_blocks(plane, 0, false, 0..size, u.map(|u| &u[start..start + size]), out);
        for (o, &offset) in self.padded.forward().iter().enumerate() {
            let step = self.padded.step(offset);
            self.add_blocks(plane, o + 1, false, 0..size, u.map(|u| &u[start + step..start + step + size]), out);
            if plane < offset[0] as usize {
                continue;
            }
            // places of the plane where the backward neighbour lies in its own plane's numbers; the others have none
            let within = step as isize - offset[0] as isize * size as isize;
            let (first, last) = (within.max(0) as usize, (size as isize + within.min(0)) as usize);
            let u = u.map(|u| &u[start + first - step..start + last - step]);
            let [x, y, z] = &mut *out;
            let mut part = [&mut x[first..last], &mut y[first..last], &mut z[first..last]];
            let from = (first as isize - within) as usize;
            self.add_blocks(plane - offset[0] as usize, o + 1, true, from..from + last - first, u, &mut part);
        }
    }

    /// out += B u for block `o` of the places `range` of a plane, or B^T u.
    #[inline(always)]
    fn add_blocks(
        &self,
        plane: usize,
        o: usize,
        transposed: bool,
        range: Range<usize>,
        u: [&[f32]; 3],
        out: &mut [&mut [f32]; 3],
    ) {
        let count = range.len();
        let [ux, uy, uz] = u.map(|u| &u[..count]);
        for (r, out) in out.iter_mut().enumerate() {
            let [bx, by, bz] = [0, 1, 2].map(|c| {
                let entry = if transposed { 3 * c + r } else { 3 * r + c };
                &self.entry(plane, o, entry)[range.clone()][..count]
            });
            let out = &mut out[..count];
            for p in 0..count {
                out[p] += bx[p] * ux[p] + by[p] * uy[p] + bz[p] * uz[p];
            }
        }
    }
}
