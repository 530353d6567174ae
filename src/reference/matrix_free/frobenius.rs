//! sqrt(sum of K_ij^2) over the free degrees of freedom, with a few planes of K at a time.
//!
//! With the gradients G_a = sqrt(s) dR_a/dx at the points of an element its share of the block of nodes a and b is
//!
//! ```text
//! K_ab = lambda S + mu S^T + mu tr(S) 1,   S = sum_q G_a G_b^T
//! ```
//!
//! (see [`crate::reference::stiffness`]). Blocks with a before b (in C order) are summed in a window of p + 1 planes of
//! nodes a across the first direction; the partner b lies at one of (p_0 + 1)(2 p_1 + 1)(2 p_2 + 1) offsets. When no
//! further element touches a plane, its squares are added up, twice for a != b, and the plane is used anew. The body is
//! cut in slabs of planes that are summed one by one; elements at a cut are computed for both. Blocks of tied nodes belong
//! to the block of their masters: those few are listed and summed at the end.

use rayon::prelude::*;

use super::geometry::{Body, PLAIN, Space};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::geometry::patch::Patch;
use crate::lanes::{Kernel, LANES, Lanes, widest};
use crate::reference::material::Lame;

/// Planes of nodes in a slab.
const PLANES: usize = 16;

/// The block of two masters, the first not after the second.
type TiedBlock = ((u32, u32), [[f64; 3]; 3]);

/// sqrt(sum of K_ij^2) in N/m.
pub(super) fn norm(body: &Body, dofs: &DofMap, lame: Lame) -> f64 {
    let planes = body.directions[0].functions;
    let mut count = vec![0u32; body.nodes()];
    (0..body.nodes()).for_each(|node| count[dofs.master(node)] += 1);
    let tied: Vec<bool> = (0..body.nodes()).map(|node| count[dofs.master(node)] > 1).collect();
    let alone: Vec<f64> = (0..3)
        .flat_map(|c| {
            let moves = |node: usize| c < body.dimension && dofs.free(node)[c] != FIXED && !tied[node];
            (0..body.nodes()).map(move |node| if moves(node) { 1.0 } else { 0.0 }).collect::<Vec<f64>>()
        })
        .collect();
    let slabs: Vec<(f64, Vec<TiedBlock>)> = (0..planes.div_ceil(PLANES))
        .into_par_iter()
        .map(|s| {
            let range = [s * PLANES, ((s + 1) * PLANES).min(planes)];
            let mut sums = (0.0, Vec::new());
            let window = Window::new(body);
            widest(Slab { body, dofs, lame, alone: &alone, tied: &tied, range, window, sums: &mut sums });
            sums
        })
        .collect();
    let mut blocks: Vec<TiedBlock> = Vec::new();
    let mut sum = 0.0;
    for (part, listed) in slabs {
        sum += part;
        blocks.extend(listed);
    }
    (sum + tied_squares(dofs, blocks)).sqrt()
}

/// Bytes of the window of one thread.
pub(super) fn window_bytes(patch: &Patch) -> usize {
    let p = patch.degree();
    let offsets = (p[0] + 1) * (2 * p[1] + 1) * (2 * p[2] + 1);
    let plane: usize = (1..patch.dimension()).map(|a| patch.knots(a).len()).product();
    (p[0] + 1) * plane * offsets * 9 * size_of::<f64>()
}

/// Squares of the blocks of tied nodes, each summed over its parts.
fn tied_squares(dofs: &DofMap, mut blocks: Vec<TiedBlock>) -> f64 {
    blocks.sort_by_key(|block| block.0);
    blocks
        .chunk_by(|a, b| a.0 == b.0)
        .map(|parts| {
            let (a, b) = parts[0].0;
            let (a, b) = (a as usize, b as usize);
            let mut sum = 0.0;
            for (i, &row) in dofs.free(a).iter().enumerate() {
                for (j, &column) in dofs.free(b).iter().enumerate() {
                    if row != FIXED && column != FIXED {
                        sum += parts.iter().map(|(_, part)| part[i][j]).sum::<f64>().powi(2);
                    }
                }
            }
            if a == b { sum } else { 2.0 * sum }
        })
        .sum()
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

/// The sum of one slab.
struct Slab<'a> {
    body: &'a Body,
    dofs: &'a DofMap,
    lame: Lame,
    /// 1 where a component of a node is free and not tied; component by component, three of them.
    alone: &'a [f64],
    tied: &'a [bool],
    /// Planes of nodes.
    range: [usize; 2],
    window: Window,
    sums: &'a mut (f64, Vec<TiedBlock>),
}

impl Kernel for Slab<'_> {
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

impl Slab<'_> {
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

    /// Adds the squares of a finished plane of nodes and empties it.
    fn close(&mut self, plane: usize) {
        let body = self.body;
        let [d0, d1, d2] = &body.directions;
        let (n1, n2) = (d1.functions, d2.functions);
        let [o0, o1, o2] = self.window.offsets;
        let line = self.window.line(body);
        for i1 in 0..n1 {
            let start = ((plane % d0.order) * n1 + i1) * line;
            for offset in 0..o0 * o1 * o2 {
                let step = [offset / (o1 * o2), offset / o2 % o1, offset % o2];
                let (b0, b1) = (plane + step[0], i1 + step[1]);
                if b0 >= d0.functions || b1 < d1.order - 1 || b1 - (d1.order - 1) >= n1 {
                    continue;
                }
                let a = (plane * n1 + i1) * n2;
                // number of the node at offset from node 0 of the line; nodes beyond the ends of the line do not exist
                let b = ((b0 * n1 + b1 - (d1.order - 1)) * n2 + step[2]) as isize - (d2.order - 1) as isize;
                let low = (d2.order - 1).saturating_sub(step[2]);
                let high = n2.min((n2 + d2.order - 1).saturating_sub(step[2]));
                let same = step == [0, d1.order - 1, d2.order - 1];
                let blocks = &self.window.blocks[start + offset * 9 * n2..][..9 * n2];
                self.sums.0 += if same { 1.0 } else { 2.0 } * self.squares(blocks, a, b, low..high);
                for i2 in (low..high).filter(|&i2| self.tied[a + i2] || self.tied[(b + i2 as isize) as usize]) {
                    let (a, b) = (a + i2, (b + i2 as isize) as usize);
                    let block = std::array::from_fn(|i| std::array::from_fn(|j| blocks[(3 * i + j) * n2 + i2]));
                    list_tied(self.dofs, a, b, block, &mut self.sums.1);
                }
            }
            self.window.blocks[start..][..line].fill(0.0);
        }
    }

    /// Sum of the squares of the blocks of nodes a + i and b + i that are free and not tied.
    fn squares(&self, blocks: &[f64], a: usize, b: isize, range: std::ops::Range<usize>) -> f64 {
        let nodes = self.body.nodes();
        let mut sum = 0.0;
        for (entry, row) in blocks.chunks_exact(blocks.len() / 9).enumerate() {
            let left = &self.alone[entry / 3 * nodes + a..][range.clone()];
            let first = (b + range.start as isize) as usize;
            let right = &self.alone[entry % 3 * nodes + first..][..range.len()];
            sum += row[range.clone()].iter().zip(left).zip(right).map(|((k, l), r)| k * k * l * r).sum::<f64>();
        }
        sum
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

/// Lists the block of nodes a and b (and its transpose when their masters are one) under their masters.
fn list_tied(dofs: &DofMap, a: usize, b: usize, block: [[f64; 3]; 3], list: &mut Vec<TiedBlock>) {
    let (first, second) = (dofs.master(a) as u32, dofs.master(b) as u32);
    let turned = [0, 1, 2].map(|i| [0, 1, 2].map(|j| block[j][i]));
    match first.cmp(&second) {
        std::cmp::Ordering::Less => list.push(((first, second), block)),
        std::cmp::Ordering::Greater => list.push(((second, first), turned)),
        std::cmp::Ordering::Equal => {
            list.push(((first, first), block));
            if a != b {
                list.push(((first, first), turned));
            }
        }
    }
}
