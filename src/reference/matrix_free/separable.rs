//! A preconditioner: the nearest body whose stiffness falls apart into univariate ones.
//!
//! On the parameter box the part of K that couples component c with itself is
//!
//! ```text
//! integral of sum_rs Q_rs dN_a/dxi_r dN_b/dxi_s,   Q_rr = |J| (mu |grad xi_r|^2 + (lambda + mu) (dxi_r/dx_c)^2)
//! ```
//!
//! The coupling of different components and the mixed terms r != s are left out (the first costs a constant by Korn's
//! inequality, the second one that depends on how skew the body is). The rest would be a sum of Kronecker products if
//! the coefficients were products,
//!
//! ```text
//! Q_rr(xi) = t_r(xi_r) product over b != r of m_b(xi_b).
//! ```
//!
//! The closest ones in the mean square of the logarithm are plain means: log t_r is the mean of log Q_rr over the other
//! directions, log m_b the mean of log Q_rr - mean(log Q_rr) over the other directions and over r != b. With
//! K_r = integral of t_r N' N' and M_b = integral of m_b N N the inverse is a [`FastDiagonalisation`]
//! (G. Sangalli, M. Tani, SIAM J. Sci. Comput. 38, 2016; coefficients: M. Montardini, G. Sangalli, M. Tani, Comput.
//! Methods Appl. Mech. Eng. 339, 2018). What is not a product is put right node by node: the diagonal of P is scaled to
//! that of K from both sides.
//!
//! A face that is held as a whole takes the first or last function out of its direction; a last plane that is tied to
//! the first one closes the direction. Any other support or tie is treated on the surrounding box: held unknowns enter
//! with zero and are not looked at, tied ones enter with equal shares and are summed. The result stays symmetric and
//! positive, it only takes more iterations.
//!
//! Measured to 1e-12: cubes 35 to 46 iterations from 5^3 to 65^3, spheroids 42 to 57. Where the coordinate lines become
//! parallel, as at the four corners of a disc made of one patch, the mixed terms are as large as the others: tori take
//! 87 iterations with 9 x 5 x 5 control points and 364 with 65 x 33 x 33. (A direct solve of the skew elements added to
//! M brings that to 227, and costs as much time as it saves. Arithmetic or harmonic means in place of the geometric
//! ones, or all Gauss points, gain a twentieth at most; the coupling of the components put right node
//! by node too, by the roots of the 3 x 3 blocks, takes tori from 220 to 180 and leaves cubes and spheroids as they
//! are.)

use rayon::prelude::*;

use super::direction::Direction;
use super::geometry::Body;
use super::lanes::{Around, contract, contract_last};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::geometry::grid::Grid;
use crate::lanes::{Kernel, LANES, Lanes, widest};
use crate::reference::material::Lame;
use crate::sparse::fast_diagonalisation::{self, FastDiagonalisation, Pencil};

/// Numbers that one task of a copy takes.
const PER_TASK: usize = 1 << 13;

/// M ~ K^-1 over the free degrees of freedom.
pub(super) struct Preconditioner {
    blocks: Vec<Block>,
    /// Component and place in its box of every free degree of freedom.
    places: Vec<(u8, u32)>,
    /// The further places of those that stand at several: free degree of freedom, component, place.
    further: Vec<(u32, u8, u32)>,
    /// Largest diagonal entry of K in N/m (without its mixed terms).
    pub largest_diagonal: f64,
}

/// One component of the displacement.
struct Block {
    inverse: FastDiagonalisation,
    /// Free degree of freedom at each place, FIXED if none.
    dofs: Vec<u32>,
    /// Root of diagonal of P over diagonal of K, over the number of places that share the degree of freedom.
    scale: Vec<f64>,
}

/// Space for [`Preconditioner::apply`].
#[derive(Default)]
pub(super) struct Workspace {
    values: Vec<Vec<f64>>,
    inner: fast_diagonalisation::Workspace,
}

impl Preconditioner {
    /// Makes the preconditioner; `None` when the coefficients cannot be separated (not positive or not finite).
    pub fn new(body: &Body, dofs: &DofMap, lame: Lame) -> Option<Self> {
        let means = Means::of(body, lame);
        let diagonal = diagonal(body, dofs, lame);
        let mut blocks = Vec::new();
        let mut places = vec![(0, FIXED); dofs.len()];
        let mut further = Vec::new();
        for c in 0..body.dimension {
            let kept = kept(body, dofs, c);
            let pencils = [0, 1, 2].map(|a| means.pencil(body, c, a, &kept[a]));
            let inverse = FastDiagonalisation::new(&pencils)?;
            let mut block = Block {
                dofs: vec![FIXED; inverse.extents().iter().product()],
                scale: separable_diagonal(&pencils),
                inverse,
            };
            block.settle(body, dofs, c, &kept, &mut places, &mut further);
            blocks.push(block);
        }
        let mut sums = vec![0.0; dofs.len()];
        let mut count = vec![0.0; dofs.len()];
        for block in &blocks {
            for (&dof, p) in block.dofs.iter().zip(&block.scale).filter(|(dof, _)| **dof != FIXED) {
                sums[dof as usize] += p;
                count[dof as usize] += 1.0;
            }
        }
        for block in &mut blocks {
            for (&dof, scale) in block.dofs.iter().zip(&mut block.scale) {
                *scale = match dof {
                    FIXED => 0.0,
                    dof => (sums[dof as usize] / diagonal[dof as usize]).sqrt() / count[dof as usize],
                };
                if !scale.is_finite() {
                    return None;
                }
            }
        }
        let largest_diagonal = diagonal.iter().fold(0.0, |most: f64, &k| most.max(k));
        Some(Self { blocks, places, further, largest_diagonal })
    }

    /// z = M r.
    pub fn apply(&self, r: &[f64], z: &mut [f64], work: &mut Workspace) {
        work.values.resize_with(self.blocks.len(), Vec::new);
        for (block, values) in self.blocks.iter().zip(&mut work.values) {
            values.resize(block.dofs.len(), 0.0);
            values.par_chunks_mut(PER_TASK).enumerate().for_each(|(chunk, part)| {
                let (dofs, scale) = (&block.dofs[chunk * PER_TASK..], &block.scale[chunk * PER_TASK..]);
                for ((value, &dof), scale) in part.iter_mut().zip(dofs).zip(scale) {
                    *value = if dof == FIXED { 0.0 } else { scale * r[dof as usize] };
                }
            });
            block.inverse.apply(values, &mut work.inner);
        }
        let values = &work.values;
        let at = |c: u8, place: u32| {
            let (c, place) = (c as usize, place as usize);
            self.blocks[c].scale[place] * values[c][place]
        };
        z.par_chunks_mut(PER_TASK).zip(self.places.par_chunks(PER_TASK)).for_each(|(part, places)| {
            part.iter_mut().zip(places).for_each(|(value, &(c, place))| *value = at(c, place));
        });
        for &(dof, c, place) in &self.further {
            z[dof as usize] += at(c, place);
        }
    }
}

impl Block {
    /// Finds the free degree of freedom of every place of component `c`.
    fn settle(
        &mut self,
        body: &Body,
        dofs: &DofMap,
        c: usize,
        kept: &[Vec<Option<usize>>; 3],
        places: &mut [(u8, u32)],
        further: &mut Vec<(u32, u8, u32)>,
    ) {
        let [_, n1, n2] = self.inverse.extents();
        let grid = grid(body);
        for node in 0..grid.len() {
            let (index, dof) = (grid.index(node), dofs.free(node)[c]);
            let (Some(i), Some(j), Some(k)) = (kept[0][index[0]], kept[1][index[1]], kept[2][index[2]]) else {
                continue;
            };
            let place = (i * n1 + j) * n2 + k;
            if dof == FIXED || self.dofs[place] != FIXED {
                continue;
            }
            self.dofs[place] = dof;
            match places[dof as usize].1 {
                FIXED => places[dof as usize] = (c as u8, place as u32),
                _ => further.push((dof, c as u8, place as u32)),
            }
        }
    }
}

/// The control grid with three directions.
fn grid(body: &Body) -> Grid {
    Grid::new(&[0, 1, 2].map(|a| body.directions[a].functions))
}

/// For component `c` the unknown that each function of each direction stands for; none where a whole face is held.
fn kept(body: &Body, dofs: &DofMap, c: usize) -> [Vec<Option<usize>>; 3] {
    let grid = grid(body);
    [0, 1, 2].map(|a| {
        let n = grid.extents()[a];
        let plane = |i: usize| (0..grid.len()).filter(move |&node| grid.index(node)[a] == i);
        let held = |i: usize| plane(i).all(|node| dofs.free(node)[c] == FIXED);
        let (first, last) = (n > 1 && held(0), n > 1 && held(n - 1));
        let closed = n > 2
            && !first
            && !last
            && plane(0).zip(plane(n - 1)).all(|(start, end)| dofs.master(start) == dofs.master(end));
        let unknown = |i: usize| match i {
            0 if first => None,
            i if i + 1 == n && last => None,
            i if i + 1 == n && closed => Some(0),
            i => Some(i - usize::from(first)),
        };
        (0..n).map(unknown).collect()
    })
}

/// Diagonal of the sum of Kronecker products.
fn separable_diagonal(pencils: &[Pencil; 3]) -> Vec<f64> {
    let at = |a: usize, matrix: &[f64], i: usize| matrix[i * (pencils[a].size + 1)];
    let mut diagonal = Vec::with_capacity(pencils.iter().map(|p| p.size).product());
    let [p0, p1, p2] = pencils;
    for i in 0..p0.size {
        for j in 0..p1.size {
            let (k0, m0) = (at(0, &p0.stiffness, i), at(0, &p0.mass, i));
            let (k1, m1) = (at(1, &p1.stiffness, j), at(1, &p1.mass, j));
            let (mixed, mass) = (k0 * m1 + m0 * k1, m0 * m1);
            diagonal.extend((0..p2.size).map(|k| mixed * at(2, &p2.mass, k) + mass * at(2, &p2.stiffness, k)));
        }
    }
    diagonal
}

/// Coefficient Q_rr of component c from A at a Gauss point, times its weight on [-1, 1]^3 and W^-2.
#[inline(always)]
fn coefficient<const REGISTERS: u8>(a: &[Lanes], lame: Lame, c: usize, r: usize) -> Lanes {
    let square = a[3 * r].times::<REGISTERS>(a[3 * r]).plus::<REGISTERS>(a[3 * r + 1], a[3 * r + 1]);
    let square = square.plus::<REGISTERS>(a[3 * r + 2], a[3 * r + 2]);
    let along = Lanes::all(lame.lambda + lame.mu).times::<REGISTERS>(a[3 * r + c]);
    Lanes::all(lame.mu).times::<REGISTERS>(square).plus::<REGISTERS>(along, a[3 * r + c])
}

/// Sums and counts of log Q_rr of component c along direction b: `of[(c * 3 + r) * 3 + b]`, one pair for each Gauss
/// point of direction b.
struct Means {
    of: Vec<Vec<(f64, f64)>>,
}

impl Means {
    /// Means over the points of each element that lie on one of its middle lines: the others say little more.
    fn of(body: &Body, lame: Lame) -> Self {
        let length = |b: usize| body.directions[b].elements() * body.directions[b].points;
        let empty = || -> Vec<Vec<(f64, f64)>> { (0..27).map(|i| vec![(0.0, 0.0); length(i % 3)]).collect() };
        let layers: Vec<Vec<Vec<(f64, f64)>>> = (0..body.directions[0].elements())
            .into_par_iter()
            .map(|e0| {
                let mut sums = empty();
                sample_layer(body, lame, e0, &mut sums);
                sums
            })
            .collect();
        let mut of = empty();
        for layer in &layers {
            for (sum, part) in of.iter_mut().flatten().zip(layer.iter().flatten()) {
                sum.0 += part.0;
                sum.1 += part.1;
            }
        }
        Self { of }
    }

    /// Mean of log Q_rr of component c at every Gauss point of direction b, and over all.
    fn mean(&self, c: usize, r: usize, b: usize) -> (Vec<f64>, f64) {
        let pairs = &self.of[(c * 3 + r) * 3 + b];
        let total = pairs.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
        (pairs.iter().map(|(sum, count)| sum / count).collect(), total.0 / total.1)
    }

    /// The pencil of direction a for component c over the unknowns of `kept`.
    fn pencil(&self, body: &Body, c: usize, a: usize, kept: &[Option<usize>]) -> Pencil {
        let direction = &body.directions[a];
        if direction.functions == 1 {
            return Pencil::absent();
        }
        let stiffness = self.mean(c, a, a).0.iter().map(|t| t.exp()).collect::<Vec<f64>>();
        let others: Vec<usize> = (0..3).filter(|&r| r != a && body.directions[r].functions > 1).collect();
        let mut mass = vec![0.0; stiffness.len()];
        for &r in &others {
            let (along, all) = self.mean(c, r, a);
            mass.iter_mut().zip(&along).for_each(|(m, y)| *m += (y - all) / others.len() as f64);
        }
        let mass: Vec<f64> = mass.iter().map(|m| m.exp()).collect();
        let size = kept.iter().flatten().max().map_or(0, |last| last + 1);
        Pencil {
            size,
            stiffness: univariate(direction, kept, size, &stiffness, true),
            mass: univariate(direction, kept, size, &mass, false),
        }
    }
}

/// Integral of a coefficient times N_i N_j, or times N_i' N_j' (`slopes`), over the parameter.
fn univariate(direction: &Direction, kept: &[Option<usize>], size: usize, of: &[f64], slopes: bool) -> Vec<f64> {
    let mut matrix = vec![0.0; size * size];
    for e in 0..direction.elements() {
        let half = direction.middles[e][1];
        let (table, factor) = match slopes {
            true => (direction.slopes_of(e), 1.0 / half),
            false => (direction.values_of(e), half),
        };
        for (q, row) in table.chunks_exact(direction.order).enumerate() {
            let weight = factor * direction.weights[q] * of[e * direction.points + q];
            for (i, left) in row.iter().enumerate() {
                for (j, right) in row.iter().enumerate() {
                    if let (Some(i), Some(j)) = (kept[direction.first[e] + i], kept[direction.first[e] + j]) {
                        matrix[i * size + j] += weight * left * right;
                    }
                }
            }
        }
    }
    matrix
}

/// Adds log Q_rr of one layer of elements to the sums.
fn sample_layer(body: &Body, lame: Lame, e0: usize, sums: &mut [Vec<(f64, f64)>]) {
    let [d0, d1, d2] = &body.directions;
    let points = [d0.points, d1.points, d2.points];
    let index = |q: usize| [q / (points[1] * points[2]), q / points[2] % points[1], q % points[2]];
    let present: Vec<usize> = (0..3).filter(|&r| body.directions[r].functions > 1).collect();
    let sampled: Vec<usize> =
        (0..body.points()).filter(|&q| (0..3).filter(|&a| index(q)[a] != points[a] / 2).count() <= 1).collect();
    for e1 in 0..d1.elements() {
        for (b, batch) in body.batches.iter().enumerate() {
            let factors = body.factors_of(e0, e1, b);
            for &q in &sampled {
                let (index, a) = (index(q), &factors[q * body.width()..]);
                for c in 0..body.dimension {
                    for &r in &present {
                        let coefficient = coefficient::<0>(a, lame, c, r);
                        for l in 0..batch.elements {
                            let element = [e0, e1, b * LANES + l];
                            let half = [0, 1, 2].map(|a| body.directions[a].middles[element[a]][1]);
                            let scale = half[r] * half[r] / (half[0] * half[1] * half[2] * body.weight(q));
                            let log = (coefficient.0[l] * scale).ln();
                            for along in 0..3 {
                                let place = element[along] * points[along] + index[along];
                                let sum = &mut sums[(c * 3 + r) * 3 + along][place];
                                sum.0 += log;
                                sum.1 += 1.0;
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Diagonal of K over the free degrees of freedom, without its mixed terms r != s and those of c: as much as P has.
fn diagonal(body: &Body, dofs: &DofMap, lame: Lame) -> Vec<f64> {
    let plane = body.plane();
    let order = body.directions[0].order;
    let layers: Vec<Vec<f64>> = (0..body.directions[0].elements())
        .into_par_iter()
        .map(|e0| {
            let mut out = vec![0.0; body.dimension * order * plane];
            widest(Diagonal { body, lame, e0, out: &mut out });
            out
        })
        .collect();
    let mut diagonal = vec![0.0; dofs.len()];
    for (e0, layer) in layers.iter().enumerate() {
        let first = body.directions[0].first[e0] * plane;
        for (c, field) in layer.chunks_exact(order * plane).enumerate() {
            for (i, value) in field.iter().enumerate() {
                let (dof, weight) = (dofs.free(first + i)[c], body.weights[first + i]);
                if dof != FIXED {
                    diagonal[dof as usize] += weight * weight * value;
                }
            }
        }
    }
    diagonal
}

/// The diagonal of one layer of elements.
struct Diagonal<'a> {
    body: &'a Body,
    lame: Lame,
    e0: usize,
    /// Component, plane of the layer, node in the plane.
    out: &'a mut [f64],
}

impl Kernel for Diagonal<'_> {
    #[inline(always)]
    fn run<const REGISTERS: u8>(self) {
        let Self { body, lame, e0, out } = self;
        let [d0, d1, d2] = &body.directions;
        let size = body.points().max(body.local());
        let mut space = super::geometry::Space::new(body);
        let mut tensors = [const { Vec::new() }; 4];
        tensors.iter_mut().for_each(|t: &mut Vec<Lanes>| t.resize(size, Lanes::ZERO));
        let [field, half, quarter, sums] = &mut tensors;
        for e1 in 0..d1.elements() {
            for (b, batch) in body.batches.iter().enumerate() {
                let factors = body.factors_of(e0, e1, b);
                for c in 0..body.dimension {
                    space.nodal.fill(Lanes::ZERO);
                    for r in 0..3 {
                        for (value, a) in field.iter_mut().zip(factors.chunks_exact(body.width())) {
                            *value = coefficient::<REGISTERS>(a, lame, c, r);
                        }
                        let around = Around { before: 1, after: d1.points * d2.points };
                        contract::<REGISTERS, false>(&squares(d0, e0, r == 0), d0.order, around, field, quarter);
                        let around = Around { before: d0.order, after: d2.points };
                        contract::<REGISTERS, false>(&squares(d1, e1, r == 1), d1.order, around, quarter, half);
                        let last: Vec<Lanes> = (0..d2.order)
                            .flat_map(|j| {
                                let table = if r == 2 { &batch.slopes } else { &batch.values };
                                table.iter().skip(j).step_by(d2.order).map(|t| t.times::<REGISTERS>(*t))
                            })
                            .collect();
                        contract_last::<REGISTERS>(&last, d2.order, d0.order * d1.order, half, sums);
                        space
                            .nodal
                            .iter_mut()
                            .zip(sums.iter())
                            .for_each(|(sum, part)| *sum = sum.add::<REGISTERS>(*part));
                    }
                    let plane = d0.order * body.plane();
                    space.scatter(body, &mut out[c * plane..][..plane], d0.first[e0], e0, e1, batch);
                }
            }
        }
    }
}

/// Squares of the values, or of the slopes, of one span; function by function.
fn squares(direction: &Direction, element: usize, slopes: bool) -> Vec<f64> {
    let table = if slopes { direction.slopes_of(element) } else { direction.values_of(element) };
    (0..direction.order).flat_map(|j| table.iter().skip(j).step_by(direction.order).map(|t| t * t)).collect()
}
