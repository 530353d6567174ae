//! The sweep over a block of nodes that sums the forces.
//!
//! With r = 1 / |d| the force of a spring on its first end is t d, on its second -t d,
//!
//! ```text
//! t = k (1 - l0 r) + c r (w . d) r
//! ```
//!
//! so one number t a spring is all that its second end needs: d is three differences of positions that lie in the cache.
//! The sweep goes through the nodes eight at a time. It computes t of the springs that lead forward, adds t d, and keeps
//! t in a ring that reaches back as far as the largest step; then it adds t d of the springs that come from behind,
//! with t from the ring. Each spring of a band is thus read and rooted once, without a force being written twice. Loose
//! springs follow from their lists. A node's sum is made in one place and in one order, so it does not depend on
//! how the nodes are cut into blocks.
//!
//! A block begins with the springs that lead into it: their t is computed again for the nodes one reach before it.
//!
//! Positions (and velocities) are turned into three lists just ahead of the sweep, into a window from one reach
//! before the block to one behind; places outside the body are zero, and there are no springs to them (k = 0).
//!
//! No closure stands in the inner loops: one that is not inlined is compiled without the wide registers, and calls the
//! instructions one by one (measured: a sixth of the speed).

use crate::lanes::{Kernel, LANES, Lanes};

use super::storage::Storage;

/// What one worker needs for a block.
#[derive(Debug, Clone, Default)]
pub(super) struct Workspace {
    /// Positions and velocities in the window; no velocities without damping.
    window: [Vec<f64>; 6],
    /// t of the last springs of each band.
    ring: Vec<f64>,
}

/// The nodes from `start` (a multiple of eight), as many as `out` has.
pub(super) struct Block<'a> {
    pub springs: &'a Storage,
    pub positions: &'a [[f64; 3]],
    pub velocities: &'a [[f64; 3]],
    pub start: usize,
    pub out: &'a mut [[f64; 3]],
    pub workspace: &'a mut Workspace,
}

impl Kernel for Block<'_> {
    #[inline(always)]
    fn run<const REGISTERS: u8>(self) {
        if self.springs.numbers == 3 { self.sweep::<REGISTERS, true>() } else { self.sweep::<REGISTERS, false>() }
    }
}

impl Block<'_> {
    #[inline(always)]
    fn sweep<const REGISTERS: u8, const DAMPED: bool>(self) {
        let Self { springs, positions, velocities, start, out, workspace } = self;
        let reach = springs.reach;
        let size = reach + LANES;
        workspace.fit(springs, out.len());
        for at in (0..reach).step_by(LANES) {
            workspace.take::<DAMPED>(positions, velocities, start, at, reach);
        }
        let end = reach + out.len().next_multiple_of(LANES);
        let mut slot = 0;
        for at in (0..end).step_by(LANES) {
            workspace.take::<DAMPED>(positions, velocities, start, at + reach, reach);
            // rows before the first node have no springs, and their place in the ring is zero
            if start + at >= reach {
                let row = (start + at - reach) / LANES;
                let mut sweep = Sweep { springs, window: &workspace.window, ring: &mut workspace.ring, at, slot };
                let mut sum = sweep.forward::<REGISTERS, DAMPED>(springs.bands_of(row));
                if at >= reach {
                    sweep.backward::<REGISTERS>(&mut sum);
                    sweep.loose::<REGISTERS, DAMPED>(row, positions, velocities, &mut sum);
                    write(&sum, &mut out[at - reach..]);
                }
            }
            slot = if slot + LANES == size { 0 } else { slot + LANES };
        }
    }
}

impl Workspace {
    /// Makes room for a block, once.
    fn fit(&mut self, springs: &Storage, nodes: usize) {
        let length = nodes.next_multiple_of(LANES) + 2 * springs.reach + LANES;
        for list in &mut self.window[..if springs.numbers == 3 { 6 } else { 3 }] {
            list.resize(length, 0.0);
        }
        // one row more: the first row of the ring again, so that eight numbers in a row never end behind it
        self.ring.clear();
        self.ring.resize(springs.steps.len() * (springs.reach + 2 * LANES), 0.0);
    }

    /// Turns eight nodes into lists, those at the place `at` of the window.
    #[inline(always)]
    fn take<const DAMPED: bool>(
        &mut self,
        positions: &[[f64; 3]],
        velocities: &[[f64; 3]],
        start: usize,
        at: usize,
        reach: usize,
    ) {
        let [x, y, z, u, v, w] = &mut self.window;
        turn(positions, start + at, reach, [x, y, z].map(|list| &mut list[at..at + LANES]));
        if DAMPED {
            turn(velocities, start + at, reach, [u, v, w].map(|list| &mut list[at..at + LANES]));
        }
    }
}

/// Writes eight nodes from number `shifted - back` into three lists; zeros where there is no such node.
#[inline(always)]
fn turn(from: &[[f64; 3]], shifted: usize, back: usize, to: [&mut [f64]; 3]) {
    let node = |l: usize| (shifted + l).checked_sub(back);
    let eight = node(0).and_then(|first| from.get(first..first + LANES));
    if let Some(eight) = eight {
        for (axis, list) in to.into_iter().enumerate() {
            for (value, node) in list.iter_mut().zip(eight) {
                *value = node[axis];
            }
        }
    } else {
        for (axis, list) in to.into_iter().enumerate() {
            for (l, value) in list.iter_mut().enumerate() {
                *value = node(l).and_then(|node| from.get(node)).map_or(0.0, |x| x[axis]);
            }
        }
    }
}

/// One row of nodes.
struct Sweep<'a> {
    springs: &'a Storage,
    window: &'a [Vec<f64>; 6],
    ring: &'a mut [f64],
    /// Where the row lies in the window.
    at: usize,
    /// Where it lies in the ring.
    slot: usize,
}

impl Sweep<'_> {
    /// Numbers of one band in the ring.
    #[inline(always)]
    fn stride(&self) -> usize {
        self.springs.reach + 2 * LANES
    }

    /// Three of the lists of the window at a place.
    #[inline(always)]
    fn lists<const FIRST: usize>(&self, at: usize) -> [Lanes; 3] {
        let [x, y, z] = [&self.window[FIRST], &self.window[FIRST + 1], &self.window[FIRST + 2]];
        // SAFETY: places are at most one reach before or behind a row of the block, and the window has that margin
        unsafe { [load(x, at), load(y, at), load(z, at)] }
    }

    /// Springs of the bands that begin at the row: keeps their t, and returns the sum of their forces.
    #[inline(always)]
    fn forward<const REGISTERS: u8, const DAMPED: bool>(&mut self, bands: &[Lanes]) -> [Lanes; 3] {
        let x = self.lists::<0>(self.at);
        let v = if DAMPED { self.lists::<3>(self.at) } else { [Lanes::ZERO; 3] };
        let stride = self.stride();
        let mut sum = [Lanes::ZERO; 3];
        for (band, (&step, numbers)) in
            self.springs.steps.iter().zip(bands.chunks_exact(if DAMPED { 3 } else { 2 })).enumerate()
        {
            let d = minus::<REGISTERS>(self.lists::<0>(self.at + step), x);
            let w = if DAMPED { minus::<REGISTERS>(self.lists::<3>(self.at + step), v) } else { v };
            let t = factor::<REGISTERS, DAMPED>(numbers, d, w);
            for axis in 0..3 {
                sum[axis] = sum[axis].plus::<REGISTERS>(t, d[axis]);
            }
            let place = band * stride + self.slot;
            // SAFETY: the slot is at most one reach, and each band has two rows more
            unsafe { store(self.ring, place, t) };
            if self.slot == 0 {
                // SAFETY: as above
                unsafe { store(self.ring, place + stride - LANES, t) };
            }
        }
        sum
    }

    /// Springs of the bands that end at the row.
    #[inline(always)]
    fn backward<const REGISTERS: u8>(&self, sum: &mut [Lanes; 3]) {
        let x = self.lists::<0>(self.at);
        let (stride, size) = (self.stride(), self.springs.reach + LANES);
        for (band, &step) in self.springs.steps.iter().enumerate() {
            let d = minus::<REGISTERS>(self.lists::<0>(self.at - step), x);
            let back = if self.slot >= step { self.slot - step } else { self.slot + size - step };
            // SAFETY: below the size of the ring, behind which there is one row more
            let t = unsafe { load(self.ring, band * stride + back) };
            for axis in 0..3 {
                sum[axis] = sum[axis].plus::<REGISTERS>(t, d[axis]);
            }
        }
    }

    /// Loose springs of the row.
    #[inline(always)]
    fn loose<const REGISTERS: u8, const DAMPED: bool>(
        &self,
        row: usize,
        positions: &[[f64; 3]],
        velocities: &[[f64; 3]],
        sum: &mut [Lanes; 3],
    ) {
        let entries = self.springs.starts[row]..self.springs.starts[row + 1];
        let numbers = if DAMPED { 3 } else { 2 };
        let others = &self.springs.others[entries.clone()];
        let numbers = self.springs.loose[entries.start * numbers..entries.end * numbers].chunks_exact(numbers);
        let x = self.lists::<0>(self.at);
        let v = if DAMPED { self.lists::<3>(self.at) } else { [Lanes::ZERO; 3] };
        for (others, numbers) in others.iter().zip(numbers) {
            let d = minus::<REGISTERS>(gathered(positions, others), x);
            let w = if DAMPED { minus::<REGISTERS>(gathered(velocities, others), v) } else { v };
            let t = factor::<REGISTERS, DAMPED>(numbers, d, w);
            for axis in 0..3 {
                sum[axis] = sum[axis].plus::<REGISTERS>(t, d[axis]);
            }
        }
    }
}

/// t of eight springs from (k, l0) or (k, l0, c).
#[inline(always)]
fn factor<const REGISTERS: u8, const DAMPED: bool>(numbers: &[Lanes], d: [Lanes; 3], w: [Lanes; 3]) -> Lanes {
    let root = dot::<REGISTERS>(d, d).inverse_root::<REGISTERS>();
    let t = numbers[0].times::<REGISTERS>(Lanes::all(1.0).less::<REGISTERS>(numbers[1], root));
    if !DAMPED {
        return t;
    }
    // where the ends meet, the root is near 1e154 and its square overflows; (w . d) is zero there and comes first
    let approach = dot::<REGISTERS>(w, d).times::<REGISTERS>(root);
    t.plus::<REGISTERS>(numbers[2].times::<REGISTERS>(root), approach)
}

#[inline(always)]
fn minus<const REGISTERS: u8>(a: [Lanes; 3], b: [Lanes; 3]) -> [Lanes; 3] {
    [a[0].minus::<REGISTERS>(b[0]), a[1].minus::<REGISTERS>(b[1]), a[2].minus::<REGISTERS>(b[2])]
}

#[inline(always)]
fn dot<const REGISTERS: u8>(a: [Lanes; 3], b: [Lanes; 3]) -> Lanes {
    a[0].times::<REGISTERS>(b[0]).plus::<REGISTERS>(a[1], b[1]).plus::<REGISTERS>(a[2], b[2])
}

/// The components of eight nodes.
#[inline(always)]
fn gathered(from: &[[f64; 3]], nodes: &[u32; LANES]) -> [Lanes; 3] {
    let eight = nodes.map(|node| from[node as usize]);
    [0, 1, 2].map(|axis| Lanes(eight.map(|node| node[axis])))
}

/// Writes a row of forces, as many as there are nodes left.
#[inline(always)]
fn write(sum: &[Lanes; 3], out: &mut [[f64; 3]]) {
    let values = |l: usize| [sum[0].0[l], sum[1].0[l], sum[2].0[l]];
    if let Some(eight) = out.first_chunk_mut::<LANES>() {
        *eight = std::array::from_fn(values);
    } else {
        out.iter_mut().enumerate().for_each(|(l, out)| *out = values(l));
    }
}

/// Eight numbers from a place.
///
/// # Safety
/// `at + LANES` is not behind the end.
#[inline(always)]
unsafe fn load(from: &[f64], at: usize) -> Lanes {
    debug_assert!(at + LANES <= from.len());
    // SAFETY: what the caller promises
    Lanes(unsafe { from.as_ptr().add(at).cast::<[f64; LANES]>().read() })
}

/// Writes eight numbers to a place.
///
/// # Safety
/// `at + LANES` is not behind the end.
#[inline(always)]
unsafe fn store(to: &mut [f64], at: usize, value: Lanes) {
    debug_assert!(at + LANES <= to.len());
    // SAFETY: what the caller promises
    unsafe { to.as_mut_ptr().add(at).cast::<[f64; LANES]>().write(value.0) };
}
