//! K x without K.
//!
//! For each batch of elements: the displacement (times weights) goes to the Gauss points by three contractions a component,
//! its reference derivatives are three more, the geometry makes them physical, Hooke's law makes stress of them, and the
//! transposes of the same steps bring the forces back:
//!
//! ```text
//! h_ci = sqrt(s) du_c/dx_i = sum_r A_ri dv_c/dr + c_i v_c
//! t_ci = mu (h_ci + h_ic) + lambda tr(h) delta_ci
//! f_cr = sum_i A_ri t_ci,   g_c = sum_i c_i t_ci;      y = B^T (sum_r C_r^T f_r + g)
//! ```
//!
//! (sum factorisation: S. A. Orszag, J. Comput. Phys. 37, 1980). For a triquadratic element that is about 5,000
//! multiplications and additions, half of them at the points. Layers of elements across the first direction are gathered in slabs. A slab adds into its
//! own planes of nodes; planes that two slabs share are summed afterwards in the order of the slabs. The slabs are those
//! of the body, not of the threads: the bits do not depend on how many there are.

use rayon::prelude::*;

use super::direction::transposed;
use super::geometry::{Batch, Body, PLAIN, Space, differentiate};
use super::lanes::{Around, contract};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::lanes::{Kernel, Lanes, widest};
use crate::reference::material::Lame;

/// Layers of elements in a slab, at least; never fewer than the degree, so that only neighbours share planes.
const LAYERS: usize = 4;

/// Nodes that one task of a copy takes.
const NODES_PER_TASK: usize = 1 << 13;

/// The stiffness of a body over its free degrees of freedom.
pub(super) struct Operator<'a> {
    pub body: &'a Body,
    pub dofs: &'a DofMap,
    pub lame: Lame,
    /// C transposed of each direction.
    collocation: [Vec<f64>; 3],
    /// First and last layer of elements (exclusive), first and last plane of nodes (exclusive) of each slab.
    slabs: Vec<[usize; 4]>,
    /// Nodes that are tied to another, with that one.
    ties: Vec<[usize; 2]>,
}

/// Everything that a product writes besides its result.
pub(super) struct Workspace {
    /// Displacement times weight of all nodes, component by component.
    nodal: Vec<f64>,
    /// Forces of each slab on its planes, component by component, and the tensors of its batches.
    slabs: Vec<(Vec<f64>, Tensors)>,
    /// Forces on all nodes, component by component.
    forces: Vec<f64>,
}

/// Tensors of one batch.
struct Tensors {
    space: Space,
    /// v of each component at the Gauss points.
    values: Vec<Lanes>,
    /// dv/dr: component, direction, point; then f in their place.
    slopes: Vec<Lanes>,
    /// Sum of the forces of a component at the Gauss points.
    sums: Vec<Lanes>,
}

impl<'a> Operator<'a> {
    /// The operator of a body made of one material.
    pub fn new(body: &'a Body, dofs: &'a DofMap, lame: Lame) -> Self {
        let d0 = &body.directions[0];
        let layers = LAYERS.max(d0.order - 1);
        let collocation = [0, 1, 2].map(|a| transposed(&body.directions[a].collocation, body.directions[a].points));
        let slabs = (0..d0.elements())
            .step_by(layers)
            .map(|start| {
                let end = (start + layers).min(d0.elements());
                [start, end, d0.first[start], d0.first[end - 1] + d0.order]
            })
            .collect();
        let ties =
            (0..body.nodes()).map(|node| [node, dofs.master(node)]).filter(|[node, master]| node != master).collect();
        Self { body, dofs, lame, collocation, slabs, ties }
    }

    /// Space for products.
    pub fn workspace(&self) -> Workspace {
        let (nodes, plane) = (self.body.nodes(), self.body.plane());
        let d = self.body.dimension;
        let slabs = self.slabs.iter().map(|slab| (vec![0.0; d * (slab[3] - slab[2]) * plane], Tensors::new(self.body)));
        Workspace { nodal: vec![0.0; d * nodes], slabs: slabs.collect(), forces: vec![0.0; d * nodes] }
    }

    /// y = K x over the free degrees of freedom (m to N).
    pub fn apply(&self, x: &[f64], y: &mut [f64], work: &mut Workspace) {
        self.spread(x, &mut work.nodal);
        let nodal: &[f64] = &work.nodal;
        self.slabs.par_iter().zip(work.slabs.par_iter_mut()).for_each(|(&slab, (forces, tensors))| {
            forces.fill(0.0);
            widest(Product { operator: self, slab, nodal, forces, tensors });
        });
        self.collect(&mut work.forces, &work.slabs, y);
    }

    /// Displacements of the free degrees of freedom to all nodes, times their weights.
    fn spread(&self, x: &[f64], nodal: &mut [f64]) {
        let nodes = self.body.nodes();
        for (c, field) in nodal.chunks_exact_mut(nodes).enumerate() {
            field.par_chunks_mut(NODES_PER_TASK).enumerate().for_each(|(chunk, part)| {
                let first = chunk * NODES_PER_TASK;
                for (i, value) in part.iter_mut().enumerate() {
                    let dof = self.dofs.free(first + i)[c];
                    *value = if dof == FIXED { 0.0 } else { self.body.weights[first + i] * x[dof as usize] };
                }
            });
        }
    }

    /// Sums the slabs on every plane of nodes, and the tied nodes of every degree of freedom.
    fn collect(&self, forces: &mut [f64], slabs: &[(Vec<f64>, Tensors)], y: &mut [f64]) {
        let (nodes, plane) = (self.body.nodes(), self.body.plane());
        for (c, field) in forces.chunks_exact_mut(nodes).enumerate() {
            field.par_chunks_mut(plane).enumerate().for_each(|(i, out)| {
                out.fill(0.0);
                for (&[_, _, first, last], (part, _)) in self.slabs.iter().zip(slabs) {
                    if (first..last).contains(&i) {
                        let from = &part[(c * (last - first) + i - first) * plane..][..plane];
                        out.iter_mut().zip(from).for_each(|(sum, force)| *sum += force);
                    }
                }
                out.iter_mut().zip(&self.body.weights[i * plane..]).for_each(|(sum, weight)| *sum *= weight);
            });
            for &[node, master] in &self.ties {
                field[master] += field[node];
            }
        }
        let forces: &[f64] = forces;
        y.par_chunks_mut(NODES_PER_TASK).enumerate().for_each(|(chunk, part)| {
            for (i, value) in part.iter_mut().enumerate() {
                let (node, c) = self.dofs.owner(chunk * NODES_PER_TASK + i);
                *value = forces[c * nodes + node];
            }
        });
    }
}

impl Tensors {
    fn new(body: &Body) -> Self {
        let size = body.points();
        let zeros = |count: usize| vec![Lanes::ZERO; count * size];
        Self { space: Space::new(body), values: zeros(3), slopes: zeros(9), sums: zeros(1) }
    }
}

/// The forces of one slab.
struct Product<'a> {
    operator: &'a Operator<'a>,
    slab: [usize; 4],
    nodal: &'a [f64],
    forces: &'a mut [f64],
    tensors: &'a mut Tensors,
}

impl Kernel for Product<'_> {
    #[inline(always)]
    fn run<const REGISTERS: u8>(self) {
        let body = self.operator.body;
        let [start, end, ..] = self.slab;
        let mut product = self;
        for e0 in start..end {
            for e1 in 0..body.directions[1].elements() {
                for (b, batch) in body.batches.iter().enumerate() {
                    product.strain::<REGISTERS>(e0, e1, batch);
                    let factors = body.factors_of(e0, e1, b);
                    match body.rational {
                        true => product.stress::<REGISTERS, true>(factors),
                        false => product.stress::<REGISTERS, false>(factors),
                    }
                    product.balance::<REGISTERS>(e0, e1, batch);
                }
            }
        }
    }
}

impl Product<'_> {
    /// v and dv/dr at the Gauss points.
    #[inline(always)]
    fn strain<const REGISTERS: u8>(&mut self, e0: usize, e1: usize, batch: &Batch) {
        let body = self.operator.body;
        let size = body.points();
        let Tensors { space, values, slopes, .. } = &mut *self.tensors;
        if body.dimension == 2 {
            // nothing moves across the plane; the step before left a force here
            slopes[6 * size..].fill(Lanes::ZERO);
            values[2 * size..].fill(Lanes::ZERO);
        }
        for (c, field) in self.nodal.chunks_exact(body.nodes()).enumerate() {
            let values = &mut values[c * size..][..size];
            space.gather(body, field, e0, e1, batch);
            space.interpolate::<REGISTERS>(body, e0, e1, batch, values);
            differentiate::<REGISTERS>(body, values, &mut slopes[3 * c * size..][..3 * size]);
        }
    }

    /// f in the place of dv/dr, g in the place of v.
    #[inline(always)]
    fn stress<const REGISTERS: u8, const RATIONAL: bool>(&mut self, factors: &[Lanes]) {
        let size = self.operator.body.points();
        let (lambda, mu) = (Lanes::all(self.operator.lame.lambda), Lanes::all(self.operator.lame.mu));
        let Tensors { values, slopes, .. } = &mut *self.tensors;
        let (values, slopes) = (&mut values[..3 * size], &mut slopes[..9 * size]);
        for (q, factors) in factors.chunks_exact(if RATIONAL { 12 } else { PLAIN }).enumerate().take(size) {
            let mut h = [[Lanes::ZERO; 3]; 3];
            for c in 0..3 {
                for i in 0..3 {
                    if RATIONAL {
                        h[c][i] = factors[PLAIN + i].times::<REGISTERS>(values[c * size + q]);
                    }
                    for r in 0..3 {
                        h[c][i] = h[c][i].plus::<REGISTERS>(factors[3 * r + i], slopes[(3 * c + r) * size + q]);
                    }
                }
            }
            let pressure = lambda.times::<REGISTERS>(h[0][0].add::<REGISTERS>(h[1][1]).add::<REGISTERS>(h[2][2]));
            for c in 0..3 {
                let t: [Lanes; 3] = std::array::from_fn(|i| {
                    let shear = mu.times::<REGISTERS>(h[c][i].add::<REGISTERS>(h[i][c]));
                    if i == c { shear.add::<REGISTERS>(pressure) } else { shear }
                });
                for r in 0..3 {
                    let sum = factors[3 * r].times::<REGISTERS>(t[0]).plus::<REGISTERS>(factors[3 * r + 1], t[1]);
                    slopes[(3 * c + r) * size + q] = sum.plus::<REGISTERS>(factors[3 * r + 2], t[2]);
                }
                if RATIONAL {
                    let sum = factors[PLAIN].times::<REGISTERS>(t[0]).plus::<REGISTERS>(factors[PLAIN + 1], t[1]);
                    values[c * size + q] = sum.plus::<REGISTERS>(factors[PLAIN + 2], t[2]);
                }
            }
        }
    }

    /// Forces at the Gauss points to the nodes of the slab.
    #[inline(always)]
    fn balance<const REGISTERS: u8>(&mut self, e0: usize, e1: usize, batch: &Batch) {
        let body = self.operator.body;
        let [d0, d1, d2] = &body.directions;
        let [_, _, first, last] = self.slab;
        let size = body.points();
        let Tensors { space, values, slopes, sums } = &mut *self.tensors;
        let [c0, c1, c2] = &self.operator.collocation;
        for (c, field) in self.forces.chunks_exact_mut((last - first) * body.plane()).enumerate() {
            let part = |r: usize| &slopes[(3 * c + r) * size..][..size];
            if body.rational {
                sums.copy_from_slice(&values[c * size..][..size]);
            } else {
                sums.fill(Lanes::ZERO);
            }
            let around = Around { before: d0.points * d1.points, after: 1 };
            contract::<REGISTERS, true>(c2, d2.points, around, part(2), sums);
            let around = Around { before: d0.points, after: d2.points };
            contract::<REGISTERS, true>(c1, d1.points, around, part(1), sums);
            let around = Around { before: 1, after: d1.points * d2.points };
            contract::<REGISTERS, true>(c0, d0.points, around, part(0), sums);
            space.test::<REGISTERS>(body, e0, e1, batch, sums);
            space.scatter(body, field, first, e0, e1, batch);
        }
    }
}
