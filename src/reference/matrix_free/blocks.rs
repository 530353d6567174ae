//! One pass over the blocks of K, with a few planes of K at a time.
//!
//! With the gradients G_a = sqrt(s) dR_a/dx at the points of an element its share of the block of nodes a and b is
//!
//! ```text
//! K_ab = lambda S + mu S^T + mu tr(S) 1,   S = sum_q G_a G_b^T
//! ```
//!
//! (see [`crate::reference::stiffness`]). Blocks with a not after b (in C order) are summed in a window of p + 1 planes
//! of nodes a across the first direction; the partner b lies at one of (p_0 + 1)(2 p_1 + 1)(2 p_2 + 1) offsets. When no
//! further element touches a plane, its blocks are handed over line by line, and the plane is used anew. The body is
//! cut in slabs of planes, whatever the number of threads; elements at a cut are computed for both.

use std::ops::Range;

use rayon::prelude::*;

use super::geometry::{Body, PLAIN, Space};
use crate::geometry::patch::Patch;
use crate::lanes::{Kernel, LANES, Lanes, widest};
use crate::reference::material::Lame;

/// Planes of nodes in a slab.
pub(super) const PLANES: usize = 16;

/// The blocks of the nodes of a line with the nodes at one offset from them, in N/m.
pub(super) struct Line<'a> {
    /// K_ij of the blocks, one after another (row-major), each for all nodes of the line.
    pub blocks: &'a [f64],
    /// The first node of the line.
    pub first: usize,
    /// How far the partner of a node is behind it; 0 when it is the node itself.
    pub offset: usize,
    /// The nodes of the line, counted from the first, that have a partner.
    pub range: Range<usize>,
}

/// Hands every block of K (all nodes apart, none held) to `take` once, with what `begin` made for the slab of its nodes
/// (planes from, to); what came of the slabs, in their order.
pub(super) fn pass<S: Send>(
    body: &Body,
    lame: Lame,
    begin: impl Fn([usize; 2]) -> S + Sync,
    take: impl Fn(&mut S, Line) + Sync,
) -> Vec<S> {
    let planes = body.directions[0].functions;
    (0..planes.div_ceil(PLANES))
        .into_par_iter()
        .map(|s| {
            let range = [s * PLANES, ((s + 1) * PLANES).min(planes)];
            let mut sums = begin(range);
            widest(Slab { body, lame, range, window: Window::new(body), take: |line: Line| take(&mut sums, line) });
            sums
        })
        .collect()
}

/// Bytes of the window of one thread.
pub(super) fn window_bytes(patch: &Patch) -> usize {
    let p = patch.degree();
    let offsets = (p[0] + 1) * (2 * p[1] + 1) * (2 * p[2] + 1);
    let plane: usize = (1..patch.dimension()).map(|a| patch.knots(a).len()).product();
    (p[0] + 1) * plane * offsets * 9 * size_of::<f64>()
}

/// Blocks of a few planes of nodes.
struct Window {
    /// Plane (modulo p_0 + 1), line, offset, entry of the block, node of the line.
    blocks: Vec<f64>,
    /// Offsets along each direction.
    offsets: [usize; 3],
    /// Gradients of the functions of a batch: function, point, component.
    gradients: Vec<Lanes>,
    /// Weights of the nodes of a batch.
    space: Space,
}

impl Window {
    fn new(body: &Body) -> Self {
        let [d0, d1, d2] = &body.directions;
        let offsets = [d0.order, 2 * d1.order - 1, 2 * d2.order - 1];
        let size = d0.order * body.plane() * offsets.iter().product::<usize>() * 9;
        let gradients = vec![Lanes::ZERO; body.local() * body.points() * 3];
        Self { blocks: vec![0.0; size], offsets, gradients, space: Space::new(body) }
    }

    /// Numbers of one line.
    fn line(&self, body: &Body) -> usize {
        self.offsets.iter().product::<usize>() * 9 * body.directions[2].functions
    }
}

/// One slab.
struct Slab<'a, Take: FnMut(Line)> {
    body: &'a Body,
    lame: Lame,
    /// Planes of nodes.
    range: [usize; 2],
    window: Window,
    take: Take,
}

impl<Take: FnMut(Line)> Kernel for Slab<'_, Take> {
    #[inline(always)]
    fn run<const REGISTERS: u8>(mut self) {
        let body = self.body;
        let d0 = &body.directions[0];
        let [start, end] = self.range;
        let mut open = start;
        for e0 in (0..d0.elements()).filter(|&e| d0.first[e] < end && d0.first[e] + d0.order > start) {
            while open < d0.first[e0] {
                self.close(open);
                open += 1;
            }
            for e1 in 0..body.directions[1].elements() {
                for b in 0..body.batches.len() {
                    self.differentiate::<REGISTERS>(e0, e1, b);
                    self.add::<REGISTERS>(e0, e1, b);
                }
            }
        }
        (open..end).for_each(|plane| self.close(plane));
    }
}

impl<Take: FnMut(Line)> Slab<'_, Take> {
    /// Gradients of all functions of a batch at all points, times the root of the volume.
    #[inline(always)]
    fn differentiate<const REGISTERS: u8>(&mut self, e0: usize, e1: usize, b: usize) {
        let body = self.body;
        let [d0, d1, d2] = &body.directions;
        let (factors, batch) = (body.factors_of(e0, e1, b), &body.batches[b]);
        let space = &mut self.window.space;
        space.gather(body, &body.weights, e0, e1, batch);
        let (size, width) = (body.points(), body.width());
        for f in 0..body.local() {
            let [f0, f1, f2] = [f / (d1.order * d2.order), f / d2.order % d1.order, f % d2.order];
            let weight = space.nodal[f];
            for q in 0..size {
                let [q0, q1, q2] = [q / (d1.points * d2.points), q / d2.points % d1.points, q % d2.points];
                let (at0, at1, at2) = (q0 * d0.order + f0, q1 * d1.order + f1, q2 * d2.order + f2);
                let (u, v, w) = (d0.values_of(e0)[at0], d1.values_of(e1)[at1], batch.values[at2]);
                let (du, dv) = (d0.slopes_of(e0)[at0], d1.slopes_of(e1)[at1]);
                let slopes = [
                    w.times::<REGISTERS>(Lanes::all(du * v)),
                    w.times::<REGISTERS>(Lanes::all(u * dv)),
                    batch.slopes[at2].times::<REGISTERS>(Lanes::all(u * v)),
                ];
                let factors = &factors[q * width..][..width];
                for i in 0..3 {
                    let mut sum = factors[i].times::<REGISTERS>(slopes[0]);
                    sum = sum.plus::<REGISTERS>(factors[3 + i], slopes[1]);
                    sum = sum.plus::<REGISTERS>(factors[6 + i], slopes[2]);
                    if body.rational {
                        let value = w.times::<REGISTERS>(Lanes::all(u * v));
                        sum = sum.plus::<REGISTERS>(factors[PLAIN + i], value);
                    }
                    self.window.gradients[(f * size + q) * 3 + i] = sum.times::<REGISTERS>(weight);
                }
            }
        }
    }

    /// Adds the blocks of a batch to the window.
    #[inline(always)]
    fn add<const REGISTERS: u8>(&mut self, e0: usize, e1: usize, b: usize) {
        let body = self.body;
        let [d0, d1, d2] = &body.directions;
        let index = |f: usize| [f / (d1.order * d2.order), f / d2.order % d1.order, f % d2.order];
        let (size, batch) = (body.points() * 3, &body.batches[b]);
        let [_, o1, o2] = self.window.offsets;
        let line = self.window.line(body);
        let (lambda, mu) = (Lanes::all(self.lame.lambda), Lanes::all(self.lame.mu));
        for f in 0..body.local() {
            let a = index(f);
            let plane = d0.first[e0] + a[0];
            if !(self.range[0]..self.range[1]).contains(&plane) {
                continue;
            }
            let start = ((plane % d0.order) * d1.functions + d1.first[e1] + a[1]) * line;
            for g in f..body.local() {
                let c = index(g);
                let offset = ((c[0] - a[0]) * o1 + c[1] + d1.order - 1 - a[1]) * o2 + c[2] + d2.order - 1 - a[2];
                let gradients = &self.window.gradients;
                let s = outer::<REGISTERS>(&gradients[f * size..][..size], &gradients[g * size..][..size]);
                let trace = mu.times::<REGISTERS>(s[0][0].add::<REGISTERS>(s[1][1]).add::<REGISTERS>(s[2][2]));
                for entry in 0..9 {
                    let (i, j) = (entry / 3, entry % 3);
                    let diagonal = if i == j { trace } else { Lanes::ZERO };
                    let k = diagonal.plus::<REGISTERS>(mu, s[j][i]).plus::<REGISTERS>(lambda, s[i][j]);
                    let row = &mut self.window.blocks[start + (offset * 9 + entry) * d2.functions + a[2]..];
                    if batch.consecutive {
                        let row = &mut row[batch.first[0]..][..LANES];
                        row.iter_mut().zip(&k.0).for_each(|(sum, k)| *sum += k);
                    } else {
                        (0..batch.elements).for_each(|l| row[batch.first[l]] += k.0[l]);
                    }
                }
            }
        }
    }

    /// Hands over a finished plane of nodes and empties it.
    fn close(&mut self, plane: usize) {
        let [d0, d1, d2] = &self.body.directions;
        let (n1, n2) = (d1.functions, d2.functions);
        let [o0, o1, o2] = self.window.offsets;
        let (middle, own) = ([0, d1.order - 1, d2.order - 1], (d1.order - 1) * n2 + d2.order - 1);
        let size = self.window.line(self.body);
        for i1 in 0..n1 {
            let start = ((plane % d0.order) * n1 + i1) * size;
            for place in 0..o0 * o1 * o2 {
                let step = [place / (o1 * o2), place / o2 % o1, place % o2];
                // lines beyond the ends of the body do not exist, nodes before a are not summed
                let outside = plane + step[0] >= d0.functions || !(middle[1]..middle[1] + n1).contains(&(i1 + step[1]));
                if outside || step < middle {
                    continue;
                }
                (self.take)(Line {
                    blocks: &self.window.blocks[start + place * 9 * n2..][..9 * n2],
                    first: (plane * n1 + i1) * n2,
                    offset: (step[0] * n1 + step[1]) * n2 + step[2] - own,
                    range: middle[2].saturating_sub(step[2])..n2.min((n2 + middle[2]).saturating_sub(step[2])),
                });
            }
            self.window.blocks[start..][..size].fill(0.0);
        }
    }
}

/// sum_q G_a G_b^T of two functions, three numbers a point.
#[inline(always)]
fn outer<const REGISTERS: u8>(a: &[Lanes], b: &[Lanes]) -> [[Lanes; 3]; 3] {
    let mut sums = [[Lanes::ZERO; 3]; 3];
    for (a, b) in a.chunks_exact(3).zip(b.chunks_exact(3)) {
        for i in 0..3 {
            for j in 0..3 {
                sums[i][j] = sums[i][j].plus::<REGISTERS>(a[i], b[j]);
            }
        }
    }
    sums
}
