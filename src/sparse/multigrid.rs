//! Geometric multigrid on a structured grid of 3 x 3 blocks: a V-cycle in f32 as a preconditioner.
//!
//! The hierarchy halves the grid until few nodes are left. On every grid the smoother removes what oscillates, and what
//! is smooth is handed to the next coarser one:
//!
//! ```text
//! x = S r,    r' = r - A x,    x += P M_c P^T r',    x += S (r - A x)          M_c: the same one grid coarser
//! ```
//!
//! with A_c = P^T A P, so that the correction is the best one in the energy norm. The cycle is a fixed symmetric positive
//! definite operator (to rounding): a preconditioner for conjugate gradients in f64, whose number of iterations does
//! then not depend on the size of the grid.
//!
//! Only the directions in which neighbours are near are halved: one in which they are further apart than [`NEAR`] times
//! the nearest waits until the others have caught up.
//!
//! | file | idea |
//! |---|---|
//! | [`padded`] | vectors with a margin: a neighbour is a constant step away |
//! | [`bars`] | the product of the springs without a matrix |
//! | [`blocks`] | the product on coarse grids: 27 neighbours, 3 x 3 blocks |
//! | [`transfer`] | interpolation and restriction |
//! | [`galerkin`] | A_c = P^T A P, cell by cell |
//! | [`level`] | one grid: diagonal, Chebyshev smoother |
//! | [`coarsest`] | the direct solve at the end |

pub mod bars;
pub mod blocks;
pub mod coarsest;
pub mod galerkin;
pub mod level;
pub mod padded;
pub mod transfer;

use rayon::prelude::*;

use bars::Bars;
use blocks::Blocks;
use coarsest::Coarsest;
use galerkin::Fine;
use level::{FIRST, Level, Operator, SECOND};
use padded::Padded;
use transfer::{Transfer, spacing};

/// A direction is halved when its neighbours are at most this much further apart than the nearest.
pub const NEAR: f64 = 1.6;

/// A grid with at most this many nodes is solved directly.
pub const COARSEST: usize = 64;

/// Columns that go through a product or a cycle in step, at most.
pub const TOGETHER: usize = 4;

/// Numbers that one task serves.
const PIECE: usize = 16_384;

/// The hierarchy of grids.
#[derive(Debug, Clone)]
pub struct Multigrid {
    levels: Vec<Level>,
    transfers: Vec<Transfer>,
    coarsest: Coarsest,
    upper: Vec<f32>,
    scratch: Vec<f32>,
}

impl Multigrid {
    /// The hierarchy over springs at `positions` (three components on `padded`, any unit) with the free components of
    /// every place as bits; [`Multigrid::update`] gives it numbers. None when the grid is too small to be halved.
    pub fn new(padded: &Padded, positions: Vec<f32>, free: Vec<u8>) -> Option<Self> {
        let count = padded.forward().len();
        let bars = Bars { positions: positions.clone(), coefficients: vec![0.0; count * padded.len()] };
        let mut levels = vec![Level::new(padded.clone(), Operator::Bars(bars), free)];
        let (mut transfers, mut positions) = (Vec::new(), positions);
        loop {
            let finest = levels.last().expect("the first level is there");
            let Some(halved) = directions(&finest.padded, &positions) else { break };
            let transfer = Transfer::new(&finest.padded, &positions, halved);
            let mut free = vec![0; transfer.coarse.len()];
            transfer.for_each_kept(|from, to| free[to] = finest.free[from]);
            positions = transfer.inject(&positions);
            let blocks = Operator::Blocks(Blocks::new(&transfer.coarse));
            levels.push(Level::new(transfer.coarse.clone(), blocks, free));
            transfers.push(transfer);
        }
        let last = levels.last().filter(|_| !transfers.is_empty())?;
        let coarsest = Coarsest::new(&last.padded, &last.free);
        let scratch = vec![0.0; transfers.iter().map(Transfer::scratch).max().unwrap_or(0)];
        Some(Self { coarsest, scratch, upper: Vec::new(), levels, transfers })
    }

    /// The coefficients of the springs on the finest grid, one component for each forward offset: write here, then
    /// [`Multigrid::update`].
    pub fn coefficients_mut(&mut self) -> &mut [f32] {
        match &mut self.levels[0].operator {
            Operator::Bars(bars) => &mut bars.coefficients,
            Operator::Blocks(_) => unreachable!("the finest grid holds springs"),
        }
    }

    /// Computes all coarse operators and smoothers from the coefficients.
    pub fn update(&mut self) {
        self.levels[0].prepare();
        for (depth, transfer) in self.transfers.iter().enumerate() {
            let (finer, coarser) = self.levels.split_at_mut(depth + 1);
            let (finer, coarser) = (&finer[depth], &mut coarser[0]);
            let fine = match &finer.operator {
                Operator::Bars(bars) => Fine::Bars(bars, &finer.free),
                Operator::Blocks(blocks) => Fine::Blocks(blocks),
            };
            if let Operator::Blocks(blocks) = &mut coarser.operator {
                galerkin::coarsen(&fine, transfer, &coarser.free, &mut self.upper, blocks);
            }
            coarser.prepare();
        }
        let last = self.levels.last().expect("a hierarchy has levels");
        if let Operator::Blocks(blocks) = &last.operator {
            self.coarsest.factor(&last.padded, blocks);
        }
    }

    /// z = M r for whole columns on the finest grid: one V-cycle each, up to [`TOGETHER`] of them in step. Every r must be
    /// zero at held components and in the margin. The bits of a column do not depend on the others.
    pub fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let n = 3 * self.levels[0].padded.len();
        for (r, z) in r.chunks(TOGETHER * n).zip(z.chunks_mut(TOGETHER * n)) {
            let count = r.len() / n;
            self.levels.iter_mut().for_each(|level| level.make_room(count));
            let mut scales = [0.0; TOGETHER];
            for ((r, to), scale) in r.chunks_exact(n).zip(self.levels[0].r.chunks_exact_mut(n)).zip(&mut scales) {
                *scale = round_into(r, to);
            }
            match count {
                1 => self.cycle::<1>(),
                2 => self.cycle::<2>(),
                3 => self.cycle::<3>(),
                _ => self.cycle::<TOGETHER>(),
            }
            for ((z, x), scale) in z.chunks_exact_mut(n).zip(self.levels[0].x.chunks_exact(n)).zip(scales) {
                z.par_iter_mut().with_min_len(PIECE).zip(x).for_each(|(z, x)| *z = scale * f64::from(*x));
            }
        }
    }

    fn cycle<const COLUMNS: usize>(&mut self) {
        cycle::<COLUMNS>(&mut self.levels, &self.transfers, &mut self.coarsest, &mut self.scratch);
    }

    /// Nodes along each direction on every grid, from the finest.
    pub fn extents(&self) -> Vec<[usize; 3]> {
        self.levels.iter().map(|level| level.padded.extents()).collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let levels: usize = self.levels.iter().map(Level::bytes).sum();
        levels + self.coarsest.bytes() + 4 * (self.upper.len() + self.scratch.len())
    }
}

/// The directions to halve next; none when the grid is coarse enough.
fn directions(padded: &Padded, positions: &[f32]) -> Option<[bool; 3]> {
    let n = padded.extents();
    if padded.nodes() <= COARSEST || n.iter().all(|&n| n <= 2) {
        return None;
    }
    let spacing = spacing(padded, positions);
    let nearest = (0..3).filter(|&d| n[d] > 2).map(|d| spacing[d]).fold(f64::INFINITY, f64::min);
    Some([0, 1, 2].map(|d| n[d] > 2 && spacing[d] <= NEAR * nearest))
}

/// Rounds r over a power of two, which brings it into the range of f32 without changing its digits, and returns that. What
/// is zero or no number becomes zero, and the factor zero or no number.
fn round_into(r: &[f64], to: &mut [f32]) -> f64 {
    let largest = r.par_iter().with_min_len(PIECE).map(|r| r.abs()).reduce(|| 0.0, f64::max);
    if largest == 0.0 || !largest.is_finite() {
        to.fill(0.0);
        return 0.0 * largest;
    }
    let scale = largest.log2().floor().exp2();
    let down = 1.0 / scale;
    to.par_iter_mut().with_min_len(PIECE).zip(r).for_each(|(to, r)| *to = (r * down) as f32);
    scale
}

/// One V-cycle for each column: `levels[0].x` from `levels[0].r`.
fn cycle<const COLUMNS: usize>(
    levels: &mut [Level],
    transfers: &[Transfer],
    coarsest: &mut Coarsest,
    scratch: &mut [f32],
) {
    let [level, coarser @ ..] = levels else { return };
    let n = 3 * level.padded.len();
    let Some((transfer, transfers)) = transfers.split_first() else {
        let columns = level.r.chunks_exact(n).zip(level.x.chunks_exact_mut(n));
        return columns.take(COLUMNS).for_each(|(r, x)| coarsest.solve(r, x));
    };
    let lambda = level.lambda;
    level.start::<COLUMNS>(FIRST / lambda);
    level.descend::<COLUMNS>(0, SECOND.0, SECOND.1 / lambda);
    level.advance::<COLUMNS>(1);
    level.descend::<COLUMNS>(1, 0.0, 0.0);
    let m = 3 * transfer.coarse.len();
    for (fine, coarse) in level.r.chunks_exact(n).zip(coarser[0].r.chunks_exact_mut(m)).take(COLUMNS) {
        transfer.restrict(fine, &coarser[0].held, coarse, scratch);
    }
    cycle::<COLUMNS>(coarser, transfers, coarsest, scratch);
    for (coarse, fine) in coarser[0].x.chunks_exact(m).zip(level.z[0].chunks_exact_mut(n)).take(COLUMNS) {
        transfer.prolong(coarse, &level.held, fine, scratch);
    }
    level.advance::<COLUMNS>(0);
    level.descend::<COLUMNS>(0, 0.0, FIRST / lambda);
    level.advance::<COLUMNS>(1);
    level.descend::<COLUMNS>(1, SECOND.0, SECOND.1 / lambda);
    level.advance::<COLUMNS>(0);
}
