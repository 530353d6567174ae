//! The coarse operator A_c = P^T A P, coarse cell by coarse cell.
//!
//! Every coupling of the fine grid - a spring with c D D^T, or a block between two neighbours - lies in one coarse cell,
//! so that it only meets the up to eight coarse nodes I, J around it:
//!
//! ```text
//! spring a-b:   (A_c)_IJ += c (w_bI F_b D - w_aI F_a D) (w_bJ F_b D - w_aJ F_a D)^T     (F: free components of a node)
//! block a-b:    (A_c)_IJ += w_aI w_bJ A_ab,    (A_c)_JI += its transpose
//! ```
//!
//! A cell gathers its couplings in a dense 24 x 24 matrix. A layer of cells between two coarse planes writes the blocks
//! of the lower plane, and those within the upper plane to a store of its own that is added afterwards: layers are done
//! in parallel, and every sum has one order.

use rayon::prelude::*;

use super::bars::Bars;
use super::blocks::{Blocks, ENTRIES};
use super::padded::{FORWARD, components};
use super::transfer::Transfer;

/// What a cell gathers: half of (A_c)_IJ, for each entry of the 3 x 3 blocks an 8 x 8 matrix over the nodes.
type Cell = [[[f32; 8]; 8]; ENTRIES];

/// Forward offsets within a plane, and the diagonal.
const WITHIN: usize = 5;

/// The couplings of a fine grid.
pub enum Fine<'a> {
    /// Springs, and the free components of every place as bits.
    Bars(&'a Bars<f32>, &'a [u8]),
    /// Blocks, zero where a component is held.
    Blocks(&'a Blocks),
}

/// Writes A_c. `free`: bits of the free components of every coarse place.
pub fn coarsen(fine: &Fine, transfer: &Transfer, free: &[u8], upper: &mut Vec<f32>, coarse: &mut Blocks) {
    let size = transfer.coarse.plane();
    let planes = transfer.coarse.extents()[0];
    let layers = planes.saturating_sub(1).max(1);
    upper.clear();
    upper.resize(planes * WITHIN * ENTRIES * size, 0.0);
    coarse.planes_mut().zip(upper.par_chunks_exact_mut(WITHIN * ENTRIES * size)).take(layers).enumerate().for_each(
        |(layer, (lower, upper))| {
            lower.fill(0.0);
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || coarsen_layer(fine, transfer, free, layer, lower, upper),
            );
        },
    );
    coarse.planes_mut().skip(layers).for_each(|plane| plane.fill(0.0));
    coarse.planes_mut().skip(1).zip(upper.par_chunks_exact(WITHIN * ENTRIES * size)).for_each(|(plane, upper)| {
        plane.iter_mut().zip(upper).for_each(|(plane, upper)| *plane += upper);
    });
}

#[inline(always)]
fn coarsen_layer(fine: &Fine, transfer: &Transfer, free: &[u8], layer: usize, lower: &mut [f32], upper: &mut [f32]) {
    let [_, rows, columns] = transfer.coarse.extents().map(|n| n.saturating_sub(1).max(1));
    let mut cell: Cell = [[[0.0; 8]; 8]; ENTRIES];
    for j in 0..rows {
        for k in 0..columns {
            let corner = [layer, j, k];
            cell.iter_mut().flatten().for_each(|row| row.fill(0.0));
            match fine {
                Fine::Bars(bars, free) => gather_bars(bars, free, transfer, corner, &mut cell),
                Fine::Blocks(blocks) => gather_blocks(blocks, transfer, corner, &mut cell),
            }
            scatter(&cell, transfer, free, corner, lower, upper);
        }
    }
}

/// First and last fine node from which a coupling with this step lies in the coarse interval `interval`.
#[inline(always)]
fn starts(transfer: &Transfer, direction: usize, interval: usize, step: i8) -> std::ops::Range<usize> {
    let kept = &transfer.kept[direction];
    if kept.len() == 1 {
        return 0..usize::from(step == 0);
    }
    let (first, next) = (kept[interval], kept[interval + 1]);
    match step {
        0 => first..next + usize::from(interval + 2 == kept.len()),
        1 => first..next,
        _ => first + 1..next + 1,
    }
}

/// Weights of a fine node on the eight nodes of a coarse cell, the last direction fastest.
#[inline(always)]
fn weights(transfer: &Transfer, corner: [usize; 3], index: [usize; 3]) -> [f32; 8] {
    let high: [f32; 3] = std::array::from_fn(|d| transfer.coordinates[d][index[d]] - corner[d] as f32);
    let along = high.map(|high| [1.0 - high, high]);
    std::array::from_fn(|node| along[0][node >> 2] * along[1][node >> 1 & 1] * along[2][node & 1])
}

/// Calls `f` with the forward offset's number and the two ends of every coupling in a coarse cell.
#[inline(always)]
fn for_each_coupling(
    transfer: &Transfer,
    corner: [usize; 3],
    mut f: impl FnMut(usize, [usize; 3], [usize; 3], &[f32; 8], &[f32; 8]),
) {
    let first = [0, 1, 2].map(|d| transfer.kept[d][corner[d]]);
    let extents = transfer.fine.extents();
    let mut table = [[0.0; 8]; 27];
    for (local, row) in table.iter_mut().enumerate() {
        let index = [first[0] + local / 9, first[1] + local / 3 % 3, first[2] + local % 3];
        if (0..3).all(|d| index[d] < extents[d]) {
            *row = weights(transfer, corner, index);
        }
    }
    let local = |index: [usize; 3]| (index[0] - first[0]) * 9 + (index[1] - first[1]) * 3 + index[2] - first[2];
    for (o, offset) in std::iter::once([0; 3]).chain(transfer.fine.forward().iter().copied()).enumerate() {
        for i in starts(transfer, 0, corner[0], offset[0]) {
            for j in starts(transfer, 1, corner[1], offset[1]) {
                for k in starts(transfer, 2, corner[2], offset[2]) {
                    let a = [i, j, k];
                    let b = [0, 1, 2].map(|d| (a[d] as isize + offset[d] as isize) as usize);
                    f(o, a, b, &table[local(a)], &table[local(b)]);
                }
            }
        }
    }
}

#[inline(always)]
fn gather_bars(bars: &Bars<f32>, free: &[u8], transfer: &Transfer, corner: [usize; 3], cell: &mut Cell) {
    let len = transfer.fine.len();
    let x = components(&bars.positions);
    for_each_coupling(transfer, corner, |o, a, b, weight_a, weight_b| {
        if o == 0 {
            return;
        }
        let (p, q) = (transfer.fine.at(a), transfer.fine.at(b));
        let c = bars.coefficients[(o - 1) * len + p];
        if c == 0.0 {
            return;
        }
        let root = c.sqrt();
        let h: [[f32; 8]; 3] = std::array::from_fn(|e| {
            let pull = root * (x[e][q] - x[e][p]);
            let at_a = if free[p] & (1 << e) != 0 { pull } else { 0.0 };
            let at_b = if free[q] & (1 << e) != 0 { pull } else { 0.0 };
            std::array::from_fn(|node| at_b * weight_b[node] - at_a * weight_a[node])
        });
        for node in 0..8 {
            if weight_a[node] != 0.0 || weight_b[node] != 0.0 {
                for (entry, r, s, half) in
                    [(0, 0, 0, 0.5), (1, 0, 1, 1.0), (2, 0, 2, 1.0), (4, 1, 1, 0.5), (5, 1, 2, 1.0), (8, 2, 2, 0.5)]
                {
                    let factor = half * h[r][node];
                    let row = &mut cell[entry][node];
                    for other in 0..8 {
                        row[other] += factor * h[s][other];
                    }
                }
            }
        }
    });
}

#[inline(always)]
fn gather_blocks(blocks: &Blocks, transfer: &Transfer, corner: [usize; 3], cell: &mut Cell) {
    for_each_coupling(transfer, corner, |o, a, _, weight_a, weight_b| {
        let mut block = blocks.block(a, o);
        if o == 0 {
            // the diagonal block is its own transpose and is counted with it
            block.iter_mut().for_each(|value| *value *= 0.5);
        }
        for node in 0..8 {
            if weight_a[node] != 0.0 {
                for (entry, value) in block.iter().enumerate() {
                    let factor = weight_a[node] * value;
                    let row = &mut cell[entry][node];
                    for other in 0..8 {
                        row[other] += factor * weight_b[other];
                    }
                }
            }
        }
    });
}

/// Adds the matrix of a cell and its transpose to the blocks of the coarse grid.
#[inline(always)]
fn scatter(cell: &Cell, transfer: &Transfer, free: &[u8], corner: [usize; 3], lower: &mut [f32], upper: &mut [f32]) {
    let (extents, size) = (transfer.coarse.extents(), transfer.coarse.plane());
    let place = |node: usize| [corner[0] + (node >> 2), corner[1] + (node >> 1 & 1), corner[2] + (node & 1)];
    let inside = |index: [usize; 3]| (0..3).all(|d| index[d] < extents[d]);
    for a in (0..8).filter(|&a| inside(place(a))) {
        for b in (0..8).filter(|&b| inside(place(b))) {
            let (from, to) = (place(a), place(b));
            let offset: [i8; 3] = std::array::from_fn(|d| (b >> (2 - d) & 1) as i8 - (a >> (2 - d) & 1) as i8);
            let Some(o) = block_of(a, b, offset) else { continue };
            let store = if a >> 2 == 0 { &mut *lower } else { &mut *upper };
            let within = from[1] * transfer.coarse.row() + from[2];
            let (mask_a, mask_b) = (free[transfer.coarse.at(from)], free[transfer.coarse.at(to)]);
            for entry in 0..ENTRIES {
                let (r, c) = (entry / 3, entry % 3);
                if mask_a & (1 << r) != 0 && mask_b & (1 << c) != 0 {
                    store[(o * ENTRIES + entry) * size + within] += cell[entry][a][b] + cell[3 * c + r][b][a];
                }
            }
        }
    }
}

/// The number of the block between two nodes of a cell, if its offset is forward.
#[inline(always)]
fn block_of(a: usize, b: usize, offset: [i8; 3]) -> Option<usize> {
    if a == b {
        return Some(0);
    }
    // forward: the first step that is not zero is +1, which is so when the node's number grows
    if b > a && offset.iter().find(|&&step| step != 0) == Some(&1) {
        return FORWARD.iter().position(|&forward| forward == offset).map(|o| o + 1);
    }
    None
}
