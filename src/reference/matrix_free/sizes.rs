//! How large K is, without storing it: sqrt(sum K_ij^2), |K|_1 and |K| x.
//!
//! All three are sums over the blocks that `blocks` hands over. A block of two nodes a, b counts for the rows of both,
//!
//! ```text
//! (|K| x)_a += |K_ab| x_b,   (|K| x)_b += |K_ab|^T x_a,   x >= 0
//! ```
//!
//! and |K|_1 is the largest entry of |K| 1, since K is symmetric. A slab sums the rows of its own planes of nodes and of the p_0
//! planes behind them; the slabs are added afterwards in their order, so the bits do not depend on the threads. The block
//! of tied nodes is part of the block of their masters, and only the whole has a size: those few are listed and summed at
//! the end. Rows and columns that are held are absent.

use super::blocks::{self, Line, PLANES};
use super::geometry::Body;
use crate::geometry::dofs::{DofMap, FIXED};
use crate::geometry::patch::Patch;
use crate::reference::material::Lame;

/// The size of K over the free degrees of freedom.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sizes {
    /// sqrt(sum of K_ij^2) in N/m.
    pub frobenius: f64,
    /// |K|_1, the largest sum of the sizes in a column, in N/m.
    pub norm: f64,
    /// Entries of the longest row, those of held nodes included.
    pub longest_row: usize,
    /// |K| |x| of every x.
    pub products: Vec<Vec<f64>>,
}

/// The block of two masters, the first not after the second.
type TiedBlock = ((u32, u32), [[f64; 3]; 3]);

/// Measures K, and multiplies its size by that of each of `vectors` (over the free degrees of freedom).
pub(super) fn sizes(body: &Body, dofs: &DofMap, lame: Lame, vectors: &[&[f64]]) -> Sizes {
    let grid = Nodes::new(body, dofs, vectors);
    let slabs = blocks::pass(body, lame, |planes| grid.begin(planes), |sums: &mut Sums, line| grid.add(line, sums));
    let (nodes, mut squares, mut tied) = (body.nodes(), 0.0, Vec::new());
    let mut fields = vec![0.0; grid.fields.len()];
    for slab in slabs {
        squares += slab.squares;
        tied.extend(slab.tied);
        for (field, part) in fields.chunks_exact_mut(nodes).zip(slab.rows.chunks_exact(slab.length)) {
            field[slab.first..].iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
    }
    let row = |field: &[f64], dof: usize| {
        let (node, c) = dofs.owner(dof);
        if grid.tied[node] { 0.0 } else { field[c * nodes + node] }
    };
    let rows = fields.chunks_exact(3 * nodes).map(|field| (0..dofs.len()).map(|dof| row(field, dof)).collect());
    let mut products: Vec<Vec<f64>> = rows.collect();
    squares += add_tied(dofs, tied, vectors, &mut products);
    let norm = products.remove(0).into_iter().fold(0.0, f64::max);
    Sizes { frobenius: squares.sqrt(), norm, longest_row: longest_row(body, dofs), products }
}

/// Bytes that [`sizes`] takes at most for `vectors` vectors, with `threads` threads.
pub(super) fn bytes(patch: &Patch, dofs: usize, vectors: usize, threads: usize) -> usize {
    let nodes = patch.points().len();
    // x and |K| x of all nodes, those of the slabs with the planes that they share; ones are a vector too
    let fields = (vectors + 1) * 8 * 3 * (3 * nodes + nodes * patch.degree()[0] / PLANES);
    blocks::window_bytes(patch) * threads + fields + (vectors + 1) * 8 * dofs
}

/// What a pass knows of the nodes.
struct Nodes<'a> {
    body: &'a Body,
    dofs: &'a DofMap,
    /// Nodes that are one with another.
    tied: Vec<bool>,
    /// Ones, then each |x|, three components of all nodes each; 0 where a component is held, tied or absent.
    fields: Vec<f64>,
}

/// The sums of one slab.
struct Sums {
    squares: f64,
    /// |K| times the fields, for the nodes of the slab and of the planes behind it.
    rows: Vec<f64>,
    /// First of these nodes, and their number.
    first: usize,
    length: usize,
    tied: Vec<TiedBlock>,
}

impl<'a> Nodes<'a> {
    fn new(body: &'a Body, dofs: &'a DofMap, vectors: &[&[f64]]) -> Self {
        let nodes = body.nodes();
        let mut count = vec![0u32; nodes];
        (0..nodes).for_each(|node| count[dofs.master(node)] += 1);
        let tied: Vec<bool> = (0..nodes).map(|node| count[dofs.master(node)] > 1).collect();
        let mut fields = vec![0.0; (1 + vectors.len()) * 3 * nodes];
        for (v, field) in fields.chunks_exact_mut(3 * nodes).enumerate() {
            for (node, _) in tied.iter().enumerate().filter(|(_, tied)| !**tied) {
                for (c, &dof) in dofs.free(node).iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
                    field[c * nodes + node] = if v == 0 { 1.0 } else { vectors[v - 1][dof as usize].abs() };
                }
            }
        }
        Self { body, dofs, tied, fields }
    }

    /// Empty sums of the slab of these planes.
    fn begin(&self, [start, end]: [usize; 2]) -> Sums {
        let (plane, d0) = (self.body.plane(), &self.body.directions[0]);
        let length = ((end + d0.order - 1).min(d0.functions) - start) * plane;
        let rows = vec![0.0; self.fields.len() / self.body.nodes() * length];
        Sums { squares: 0.0, rows, first: start * plane, length, tied: Vec::new() }
    }

    /// Adds the blocks of a line.
    #[inline(always)]
    fn add(&self, line: Line, sums: &mut Sums) {
        let (nodes, d) = (self.body.nodes(), self.body.dimension);
        let Line { blocks, first, offset, range } = line;
        let (a, b, count) = (first + range.start, first + range.start + offset, range.len());
        let factor = if offset == 0 { 1.0 } else { 2.0 };
        for (entry, k) in blocks.chunks_exact(blocks.len() / 9).enumerate() {
            let (i, j, k) = (entry / 3, entry % 3, &k[range.clone()]);
            if i >= d || j >= d {
                continue;
            }
            let (left, right) = (&self.fields[i * nodes + a..][..count], &self.fields[j * nodes + b..][..count]);
            sums.squares += factor * k.iter().zip(left).zip(right).map(|((k, l), r)| k * k * l * r).sum::<f64>();
            for f in (0..self.fields.len() / nodes).step_by(3) {
                let row = &mut sums.rows[(f + i) * sums.length + a - sums.first..][..count];
                let x = &self.fields[(f + j) * nodes + b..][..count];
                row.iter_mut().zip(k).zip(x).for_each(|((sum, k), x)| *sum += k.abs() * x);
                if offset != 0 {
                    let row = &mut sums.rows[(f + j) * sums.length + b - sums.first..][..count];
                    let x = &self.fields[(f + i) * nodes + a..][..count];
                    row.iter_mut().zip(k).zip(x).for_each(|((sum, k), x)| *sum += k.abs() * x);
                }
            }
        }
        for n in range.filter(|n| self.tied[first + n] || self.tied[first + n + offset]) {
            let block = std::array::from_fn(|i| std::array::from_fn(|j| blocks[(3 * i + j) * (blocks.len() / 9) + n]));
            list_tied(self.dofs, first + n, first + n + offset, block, &mut sums.tied);
        }
    }
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

/// Sums the parts of every block of tied nodes and adds its rows to the products with ones and with each of `vectors`;
/// the sum of the squares.
fn add_tied(dofs: &DofMap, mut blocks: Vec<TiedBlock>, vectors: &[&[f64]], products: &mut [Vec<f64>]) -> f64 {
    blocks.sort_by_key(|block| block.0);
    let mut squares = 0.0;
    for parts in blocks.chunk_by(|a, b| a.0 == b.0) {
        let (a, b) = parts[0].0;
        for (i, &row) in dofs.free(a as usize).iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
            for (j, &column) in dofs.free(b as usize).iter().enumerate().filter(|(_, dof)| **dof != FIXED) {
                let k: f64 = parts.iter().map(|(_, part)| part[i][j]).sum();
                squares += if a == b { k * k } else { 2.0 * k * k };
                for (v, product) in products.iter_mut().enumerate() {
                    let size = |dof: u32| if v == 0 { 1.0 } else { vectors[v - 1][dof as usize].abs() };
                    product[row as usize] += k.abs() * size(column);
                    if a != b {
                        product[column as usize] += k.abs() * size(row);
                    }
                }
            }
        }
    }
    squares
}

/// Most degrees of freedom that share an element with one.
fn longest_row(body: &Body, dofs: &DofMap) -> usize {
    let partners: [Vec<usize>; 3] = [0, 1, 2].map(|a| {
        let d = &body.directions[a];
        let of = |i: usize| {
            let touched = || d.first.iter().filter(|&&first| (first..first + d.order).contains(&i));
            touched().max().map_or(0, |last| last + d.order) - touched().min().unwrap_or(&0)
        };
        (0..d.functions).map(of).collect()
    });
    let mut partners_of = vec![0; body.nodes()];
    for node in 0..body.nodes() {
        let [n1, n2] = [1, 2].map(|a| body.directions[a].functions);
        let [i, j, k] = [node / (n1 * n2), node / n2 % n1, node % n2];
        partners_of[dofs.master(node)] += partners[0][i] * partners[1][j] * partners[2][k];
    }
    body.dimension * partners_of.into_iter().max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::dofs::tie_coincident;
    use crate::geometry::selection::face_nodes;
    use crate::geometry::shapes;
    use crate::reference::material::{Material, Plane};
    use crate::reference::methods::nurbs;
    use crate::reference::stiffness;

    #[test]
    fn the_sizes_are_those_of_the_assembled_matrix() {
        for (name, control_points, degree, merged) in [
            ("square", &[9, 20][..], &[2, 3][..], false),
            ("circle", &[35, 7], &[2, 2], true),
            ("cube", &[18, 5, 6], &[3, 1, 2], false),
            ("torus", &[33, 6, 5], &[2, 2, 2], true),
            ("spheroid", &[9, 18, 3], &[2, 2, 1], true),
        ] {
            let shape = shapes::find(name).unwrap();
            let mut request = shape.default_request();
            (request.control_points, request.degree) = (control_points.to_vec(), degree.to_vec());
            let patch = (shape.build)(&request).unwrap();
            let mut held = vec![[false; 3]; patch.points().len()];
            face_nodes(&patch.grid(), shape.fixed_face)
                .unwrap()
                .iter()
                .for_each(|&node| held[node as usize] = [true; 3]);
            let middle = held.len() / 2;
            held[middle][1] = true;
            let master = match merged {
                true => tie_coincident(patch.points(), 1e-9),
                false => (0..held.len() as u32).collect(),
            };
            let dofs = DofMap::new(patch.dimension(), master, &held);
            let lame = Material { young: 2.0, poisson: 0.3 }.lame(patch.dimension(), Plane::Stress).unwrap();
            let points = nurbs::integration_points(&patch, 0, 0.7);
            let stiffness = stiffness::stiffness(&points, lame, &dofs, &stiffness::pattern(&points, &dofs)).unwrap();
            let vectors = [3.0, 7.0].map(|step| (0..dofs.len()).map(|i| (step * i as f64).sin()).collect::<Vec<f64>>());
            let body = Body::new(&patch, 0, 0.7).unwrap();
            let found = sizes(&body, &dofs, lame, &[&vectors[0], &vectors[1]]);

            let product = |row: usize, x: &dyn Fn(usize) -> f64| -> f64 {
                let row = stiffness.row(row);
                row.col_indices().iter().zip(row.values()).map(|(&column, k)| k.abs() * x(column).abs()).sum()
            };
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b;
            for (v, vector) in vectors.iter().enumerate() {
                for (row, found) in found.products[v].iter().enumerate() {
                    let exact = product(row, &|column| vector[column]);
                    assert!(close(*found, exact), "{name}, row {row}: {found} and {exact}");
                }
            }
            let norm = (0..dofs.len()).map(|row| product(row, &|_| 1.0)).fold(0.0, f64::max);
            let frobenius = stiffness.values().iter().map(|k| k * k).sum::<f64>().sqrt();
            assert!(close(found.norm, norm) && close(found.frobenius, frobenius), "{name}: {found:?}");
            let longest = stiffness.row_iter().map(|row| row.nnz()).max().unwrap();
            println!("{name}: longest row {longest}, taken for {}", found.longest_row);
            assert!(found.longest_row >= longest, "{name}: {longest} and {}", found.longest_row);
        }
    }
}
