//! Between a grid and the next coarser one: interpolation P and restriction P^T.
//!
//! A direction with n nodes that is halved keeps the nodes 0, 2, 4, ... and its last one: n/2 + 1 nodes. Every node has
//! the coordinate t on the coarse line: J at the kept node J, J + a/(a+b) at the node between J and J + 1, where a and b
//! are the mean distances to the two (1/2 on an even grid). Interpolation is linear in t along each direction,
//!
//! ```text
//! (P u)_i = prod over directions of (1 - |t_i - J|)  u_J      over the neighbours J,
//! ```
//!
//! with zeros at held components. A direction that is not halved has t = i. Restriction is the transpose.

use rayon::prelude::*;

use super::padded::{Held, Padded, components, pieces};

/// Interpolation from a coarse grid to a fine one.
#[derive(Debug, Clone)]
pub struct Transfer {
    /// Layout of the fine grid.
    pub fine: Padded,
    /// Layout of the coarse grid.
    pub coarse: Padded,
    /// Coordinate of every fine node on the coarse line, for each direction.
    pub coordinates: [Vec<f32>; 3],
    /// The fine node under every coarse node, for each direction.
    pub kept: [Vec<usize>; 3],
}

/// Restriction of one coarse node along a direction: its fine neighbours and their weights.
struct Children {
    first: usize,
    weights: [f32; 3],
    count: usize,
}

impl Transfer {
    /// Halves the marked directions of a grid with nodes at `positions` (three components).
    pub fn new(fine: &Padded, positions: &[f32], halved: [bool; 3]) -> Self {
        let n = fine.extents();
        let kept: [Vec<usize>; 3] = [0, 1, 2].map(|d| match halved[d] {
            true => (0..n[d] - 1).step_by(2).chain([n[d] - 1]).collect(),
            false => (0..n[d]).collect(),
        });
        let coordinates = [0, 1, 2].map(|d| {
            let mut t = vec![0.0; n[d]];
            for (coarse, &node) in kept[d].iter().enumerate() {
                t[node] = coarse as f32;
                if node > 0 && kept[d][coarse - 1] + 1 < node {
                    let before = mean_distance(fine, positions, d, node - 2);
                    let after = mean_distance(fine, positions, d, node - 1);
                    let ratio = (before / (before + after)) as f32;
                    t[node - 1] = coarse as f32 - 1.0 + if ratio > 0.0 && ratio < 1.0 { ratio } else { 0.5 };
                }
            }
            t
        });
        let coarse = Padded::new([kept[0].len(), kept[1].len(), kept[2].len()]);
        Self { fine: fine.clone(), coarse, coordinates, kept }
    }

    fn children(&self, direction: usize, coarse: usize) -> Children {
        let kept = &self.kept[direction];
        let first = if coarse > 0 { kept[coarse - 1] + 1 } else { kept[0] };
        let last = kept.get(coarse + 1).map_or(kept[coarse], |next| next - 1);
        let t = &self.coordinates[direction][first..=last];
        let mut weights = [0.0; 3];
        weights.iter_mut().zip(t).for_each(|(w, t)| *w = 1.0 - (t - coarse as f32).abs());
        Children { first, weights, count: t.len() }
    }

    /// Numbers of workspace that a transfer needs.
    pub fn scratch(&self) -> usize {
        let (fine, coarse) = (self.fine.extents(), self.coarse.extents());
        (fine[0] * coarse[2]).max(coarse[0] * fine[2])
    }

    /// coarse = P^T fine; `held` belongs to the coarse grid.
    pub fn restrict(&self, fine: &[f32], held: &Held, coarse: &mut [f32], scratch: &mut [f32]) {
        let width = self.fine.extents()[2];
        pieces(&self.coarse, coarse, self.coarse.plane()).zip(scratch.par_chunks_mut(width)).enumerate().for_each(
            |(plane, (mut out, row))| {
                pulp::Arch::new().dispatch(
                    #[inline(always)]
                    || self.restrict_plane(components(fine), plane, &mut out, row),
                );
                held.clear(self.coarse.base() + plane * self.coarse.plane(), &mut out);
            },
        );
    }

    #[inline(always)]
    fn restrict_plane(&self, fine: [&[f32]; 3], plane: usize, out: &mut [&mut [f32]; 3], row: &mut [f32]) {
        let [_, rows, columns] = self.coarse.extents();
        let above = self.children(0, plane);
        for j in 0..rows {
            let beside = self.children(1, j);
            for (out, fine) in out.iter_mut().zip(fine) {
                row.fill(0.0);
                for (i0, w0) in (above.first..).zip(&above.weights[..above.count]) {
                    for (i1, w1) in (beside.first..).zip(&beside.weights[..beside.count]) {
                        let start = self.fine.at([i0, i1, 0]);
                        let weight = w0 * w1;
                        row.iter_mut().zip(&fine[start..]).for_each(|(row, fine)| *row += weight * fine);
                    }
                }
                let out = &mut out[j * self.coarse.row()..][..columns];
                for (k, out) in out.iter_mut().enumerate() {
                    let along = self.children(2, k);
                    let weights = &along.weights[..along.count];
                    *out = weights.iter().zip(&row[along.first..]).fold(0.0, |sum, (w, row)| sum + w * row);
                }
            }
        }
    }

    /// fine = P coarse; `held` belongs to the fine grid.
    pub fn prolong(&self, coarse: &[f32], held: &Held, fine: &mut [f32], scratch: &mut [f32]) {
        let width = self.coarse.extents()[2];
        pieces(&self.fine, fine, self.fine.plane()).zip(scratch.par_chunks_mut(width)).enumerate().for_each(
            |(plane, (mut out, row))| {
                pulp::Arch::new().dispatch(
                    #[inline(always)]
                    || self.prolong_plane(components(coarse), plane, &mut out, row),
                );
                held.clear(self.fine.base() + plane * self.fine.plane(), &mut out);
            },
        );
    }

    #[inline(always)]
    fn prolong_plane(&self, coarse: [&[f32]; 3], plane: usize, out: &mut [&mut [f32]; 3], row: &mut [f32]) {
        let [_, rows, _] = self.fine.extents();
        let last = row.len() - 1;
        for j in 0..rows {
            for (out, coarse) in out.iter_mut().zip(coarse) {
                row.fill(0.0);
                for (j0, w0) in parents(self.coordinates[0][plane]) {
                    for (j1, w1) in parents(self.coordinates[1][j]) {
                        if w0 * w1 > 0.0 {
                            let start = self.coarse.at([j0, j1, 0]);
                            let weight = w0 * w1;
                            row.iter_mut().zip(&coarse[start..]).for_each(|(row, coarse)| *row += weight * coarse);
                        }
                    }
                }
                for (out, &t) in out[j * self.fine.row()..].iter_mut().zip(&self.coordinates[2]) {
                    let low = t as usize;
                    let high = t - low as f32;
                    *out = (1.0 - high) * row[low] + high * row[(low + 1).min(last)];
                }
            }
        }
    }

    /// The values of a fine vector (three components) at the kept nodes.
    pub fn inject(&self, fine: &[f32]) -> Vec<f32> {
        let mut coarse = vec![0.0; 3 * self.coarse.len()];
        for (from, to) in components(fine).into_iter().zip(coarse.chunks_exact_mut(self.coarse.len())) {
            self.for_each_kept(|fine, coarse| to[coarse] = from[fine]);
        }
        coarse
    }

    /// Calls `f` with the fine and the coarse place of every coarse node.
    pub fn for_each_kept(&self, mut f: impl FnMut(usize, usize)) {
        for (i, &a) in self.kept[0].iter().enumerate() {
            for (j, &b) in self.kept[1].iter().enumerate() {
                for (k, &c) in self.kept[2].iter().enumerate() {
                    f(self.fine.at([a, b, c]), self.coarse.at([i, j, k]));
                }
            }
        }
    }
}

/// The two coarse neighbours of a coordinate with their weights; the second weighs nothing on a coarse node.
#[inline(always)]
fn parents(t: f32) -> [(usize, f32); 2] {
    let low = t as usize;
    let high = t - low as f32;
    [(low, 1.0 - high), (low + 1, high)]
}

/// Mean distance of the nodes with index i and i + 1 along a direction.
fn mean_distance(padded: &Padded, positions: &[f32], direction: usize, i: usize) -> f64 {
    let mut extents = padded.extents();
    extents[direction] = 1;
    let mut offset = [0; 3];
    offset[direction] = 1;
    let step = padded.step(offset);
    let x = components(positions);
    let (mut sum, mut count) = (0.0, 0);
    for a in 0..extents[0] {
        for b in 0..extents[1] {
            for c in 0..extents[2] {
                let mut index = [a, b, c];
                index[direction] = i;
                let p = padded.at(index);
                sum += x.iter().map(|x| f64::from(x[p + step] - x[p]).powi(2)).sum::<f64>().sqrt();
                count += 1;
            }
        }
    }
    sum / f64::from(count)
}

/// Mean distance of neighbours along each direction; 0 along a direction with one node.
pub fn spacing(padded: &Padded, positions: &[f32]) -> [f64; 3] {
    [0, 1, 2].map(|d| {
        let cells = padded.extents()[d] - 1;
        (0..cells).map(|i| mean_distance(padded, positions, d, i)).sum::<f64>() / cells.max(1) as f64
    })
}
