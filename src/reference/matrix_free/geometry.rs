//! The map of a spline body at all its Gauss points.
//!
//! Let v_a = w_a u_a be displacements times weights. With W = sum_a w_a N_a a displacement is u = v / W where
//! v = sum_a v_a N_a is a spline, and with reference coordinates r in [-1, 1]^3, J = dx/dr and the volume s of the point,
//!
//! ```text
//! sqrt(s) du/dx_i = sum_r A_ri dv/dr + c_i v,    A_ri = sqrt(s) (J^-1)_ri / W,    c_i = -sum_r A_ri (dW/dr) / W.
//! ```
//!
//! The root of the volume is put in, so that an integral of a product of two gradients is a plain sum over the points.
//! Stored are the 9 numbers A_ri, row by row, and the 3 numbers c_i where the weights are not all equal: 1.9 kB for a
//! triquadratic element, against 26 kB for its matrix. A plane body has the missing direction in the middle, with
//! dx/dr = (0, 0, -1) there: the determinant keeps its sign.

use rayon::prelude::*;

use super::direction::{Direction, transposed};
use super::lanes::{Around, contract, contract_last};
use crate::error::{Error, Result};
use crate::geometry::patch::Patch;
use crate::lanes::{Kernel, LANES, Lanes, widest};
use crate::reference::methods::nurbs;

/// Numbers of a Gauss point: A, then c on rational bodies.
pub(super) const PLAIN: usize = 9;
const RATIONAL: usize = 12;

/// Eight neighbours along the last direction; where a row of elements ends, the last one is repeated with volume zero.
#[derive(Debug, Clone)]
pub(super) struct Batch {
    /// First function of each lane.
    pub first: [usize; LANES],
    /// The lanes begin one function after another, and none is a repetition.
    pub consecutive: bool,
    /// Lanes that are elements.
    pub elements: usize,
    /// B of each lane, points x order.
    pub values: Vec<Lanes>,
    /// Derivatives on [-1, 1] of each lane, points x order.
    pub slopes: Vec<Lanes>,
    /// The transpose of `values`.
    pub transposed: Vec<Lanes>,
}

/// A body as the fast paths see it.
#[derive(Debug, Clone)]
pub(super) struct Body {
    /// Directions of the control grid, the absent one of a plane body in the middle.
    pub directions: [Direction; 3],
    /// B transposed of the first two directions, span by span.
    pub transposed: [Vec<f64>; 2],
    /// 2 or 3.
    pub dimension: usize,
    /// Weights of the control points.
    pub weights: Vec<f64>,
    /// Not all weights are equal.
    pub rational: bool,
    /// The batches of a row of elements.
    pub batches: Vec<Batch>,
    /// A and c: element along the first direction, along the second, batch, point, number.
    pub factors: Vec<Lanes>,
    /// Volume of the body in m^3 (with the thickness in two dimensions).
    pub volume: f64,
}

/// Tensors of one batch that every kernel needs.
pub(super) struct Space {
    pub nodal: Vec<Lanes>,
    half: [Vec<Lanes>; 2],
}

impl Body {
    /// Tabulates a patch with `extra` Gauss points beyond degree + 1; `thickness` in m counts in two dimensions.
    ///
    /// # Errors
    /// [`Error::FoldedElement`], of the first element that is.
    pub fn new(patch: &Patch, extra: usize, thickness: f64) -> Result<Self> {
        let direction = |a: usize| Direction::new(patch.knots(a), extra);
        let directions = match patch.dimension() {
            2 => [direction(0), Direction::absent(), direction(1)],
            _ => [direction(0), direction(1), direction(2)],
        };
        let transpose =
            |d: &Direction| (0..d.elements()).flat_map(|e| transposed(d.values_of(e), d.order)).collect::<Vec<_>>();
        let weights = patch.weights().to_vec();
        let mut body = Self {
            transposed: [transpose(&directions[0]), transpose(&directions[1])],
            dimension: patch.dimension(),
            rational: weights.iter().any(|&w| w != weights[0]),
            batches: batches(&directions[2]),
            directions,
            weights,
            factors: Vec::new(),
            volume: 0.0,
        };
        body.map(patch, nurbs::orientation(patch) * if patch.dimension() == 2 { thickness } else { 1.0 })?;
        Ok(body)
    }

    /// Gauss points of an element.
    pub fn points(&self) -> usize {
        self.directions.iter().map(|d| d.points).product()
    }

    /// Functions that act on an element.
    pub fn local(&self) -> usize {
        self.directions.iter().map(|d| d.order).product()
    }

    /// Control points.
    pub fn nodes(&self) -> usize {
        self.weights.len()
    }

    /// Control points in a plane across the first direction.
    pub fn plane(&self) -> usize {
        self.directions[1].functions * self.directions[2].functions
    }

    /// Numbers stored for a Gauss point.
    pub fn width(&self) -> usize {
        if self.rational { RATIONAL } else { PLAIN }
    }

    /// Stored numbers of one layer of elements across the first direction.
    fn layer(&self) -> usize {
        self.directions[1].elements() * self.batches.len() * self.points() * self.width()
    }

    /// A and c of a batch.
    #[inline(always)]
    pub fn factors_of(&self, e0: usize, e1: usize, batch: usize) -> &[Lanes] {
        let size = self.points() * self.width();
        &self.factors[((e0 * self.directions[1].elements() + e1) * self.batches.len() + batch) * size..][..size]
    }

    /// The transpose of B of one span of the first or second direction.
    #[inline(always)]
    pub fn transposed_of(&self, a: usize, element: usize) -> &[f64] {
        let size = self.directions[a].points * self.directions[a].order;
        &self.transposed[a][element * size..][..size]
    }

    /// Number of the first node of line (a0, a1) of the elements (e0, e1), counted from plane `plane`.
    #[inline(always)]
    pub fn line(&self, e0: usize, e1: usize, a0: usize, a1: usize, plane: usize) -> usize {
        let [d0, d1, d2] = &self.directions;
        ((d0.first[e0] + a0 - plane) * d1.functions + d1.first[e1] + a1) * d2.functions
    }

    /// Bytes that [`Body::new`] keeps for a patch, without making it.
    pub fn bytes(patch: &Patch, extra: usize) -> usize {
        let count = |a: usize| patch.knots(a).spans().len();
        let last = patch.dimension() - 1;
        let rows: usize = (0..last).map(count).product();
        let points: usize = patch.degree()[..patch.dimension()].iter().map(|p| p + 1 + extra).product();
        let rational = patch.weights().iter().any(|&w| w != patch.weights()[0]);
        let width = if rational { RATIONAL } else { PLAIN };
        rows * count(last).div_ceil(LANES) * points * width * size_of::<Lanes>() + 8 * patch.weights().len()
    }

    /// Fills `factors` and `volume`; `scale` is the orientation times the thickness.
    fn map(&mut self, patch: &Patch, scale: f64) -> Result<()> {
        let nodes = self.nodes();
        let mut fields = self.weights.clone();
        for i in 0..3 {
            fields.extend(patch.points().iter().zip(&self.weights).map(|(x, w)| w * x[i]));
        }
        let mut factors = vec![Lanes::ZERO; self.directions[0].elements() * self.layer()];
        let body: &Self = self;
        let volumes: Vec<Result<f64>> = factors
            .par_chunks_mut(body.layer())
            .enumerate()
            .map(|(e0, layer)| {
                let mut outcome = Ok(0.0);
                widest(Mapping { body, patch, fields: &fields, nodes, scale, e0, layer, outcome: &mut outcome });
                outcome
            })
            .collect();
        self.volume = volumes.into_iter().sum::<Result<f64>>()?;
        self.factors = factors;
        Ok(())
    }
}

/// The batches of a row of elements along a direction.
fn batches(direction: &Direction) -> Vec<Batch> {
    let count = direction.elements();
    let size = direction.points * direction.order;
    (0..count.div_ceil(LANES))
        .map(|b| {
            let element: [usize; LANES] = std::array::from_fn(|l| (b * LANES + l).min(count - 1));
            let first = element.map(|e| direction.first[e]);
            let elements = LANES.min(count - b * LANES);
            let table =
                |of: &[f64]| -> Vec<Lanes> { (0..size).map(|i| Lanes(element.map(|e| of[e * size + i]))).collect() };
            let values = table(&direction.values);
            let transposed =
                (0..direction.order).flat_map(|j| values.iter().skip(j).step_by(direction.order).copied()).collect();
            let consecutive = elements == LANES && (0..LANES).all(|l| first[l] == first[0] + l);
            Batch { first, consecutive, elements, values, slopes: table(&direction.slopes), transposed }
        })
        .collect()
}

impl Space {
    pub fn new(body: &Body) -> Self {
        let size = body.directions.iter().map(|d| d.order.max(d.points)).product();
        let zeros = || vec![Lanes::ZERO; size];
        Self { nodal: zeros(), half: [zeros(), zeros()] }
    }

    /// Collects the numbers of a nodal field that act on a batch.
    #[inline(always)]
    pub fn gather(&mut self, body: &Body, field: &[f64], e0: usize, e1: usize, batch: &Batch) {
        let [d0, d1, d2] = &body.directions;
        let mut at = 0;
        for a0 in 0..d0.order {
            for a1 in 0..d1.order {
                let row = &field[body.line(e0, e1, a0, a1, 0)..][..d2.functions];
                for a2 in 0..d2.order {
                    self.nodal[at] = match batch.consecutive {
                        true => Lanes(row[batch.first[0] + a2..][..LANES].try_into().expect("eight lanes")),
                        false => Lanes(batch.first.map(|first| row[first + a2])),
                    };
                    at += 1;
                }
            }
        }
    }

    /// Values at the Gauss points of the gathered field.
    #[inline(always)]
    pub fn interpolate<const REGISTERS: u8>(
        &mut self,
        body: &Body,
        e0: usize,
        e1: usize,
        batch: &Batch,
        out: &mut [Lanes],
    ) {
        let [d0, d1, d2] = &body.directions;
        let [half, quarter] = &mut self.half;
        contract_last::<REGISTERS>(&batch.values, d2.points, d0.order * d1.order, &self.nodal, half);
        let around = Around { before: d0.order, after: d2.points };
        contract::<REGISTERS, false>(d1.values_of(e1), d1.points, around, half, quarter);
        let around = Around { before: 1, after: d1.points * d2.points };
        contract::<REGISTERS, false>(d0.values_of(e0), d0.points, around, quarter, out);
    }

    /// The transpose of [`Space::interpolate`]: numbers at the Gauss points to the nodes, into `nodal`.
    #[inline(always)]
    pub fn test<const REGISTERS: u8>(&mut self, body: &Body, e0: usize, e1: usize, batch: &Batch, points: &[Lanes]) {
        let [d0, d1, d2] = &body.directions;
        let [half, quarter] = &mut self.half;
        let around = Around { before: 1, after: d1.points * d2.points };
        contract::<REGISTERS, false>(body.transposed_of(0, e0), d0.order, around, points, quarter);
        let around = Around { before: d0.order, after: d2.points };
        contract::<REGISTERS, false>(body.transposed_of(1, e1), d1.order, around, quarter, half);
        contract_last::<REGISTERS>(&batch.transposed, d2.order, d0.order * d1.order, half, &mut self.nodal);
    }

    /// Adds `nodal` to a nodal field that begins at node plane `plane`.
    #[inline(always)]
    pub fn scatter(&self, body: &Body, field: &mut [f64], plane: usize, e0: usize, e1: usize, batch: &Batch) {
        let [d0, d1, d2] = &body.directions;
        let mut at = 0;
        for a0 in 0..d0.order {
            for a1 in 0..d1.order {
                let row = &mut field[body.line(e0, e1, a0, a1, plane)..][..d2.functions];
                for a2 in 0..d2.order {
                    if batch.consecutive {
                        let places = &mut row[batch.first[0] + a2..][..LANES];
                        places.iter_mut().zip(&self.nodal[at].0).for_each(|(place, value)| *place += value);
                    } else {
                        for l in 0..batch.elements {
                            row[batch.first[l] + a2] += self.nodal[at].0[l];
                        }
                    }
                    at += 1;
                }
            }
        }
    }
}

/// Derivatives along the three reference directions of a field known at the Gauss points, one after the other in `out`.
#[inline(always)]
pub(super) fn differentiate<const REGISTERS: u8>(body: &Body, values: &[Lanes], out: &mut [Lanes]) {
    let [d0, d1, d2] = &body.directions;
    let size = body.points();
    let around = [
        Around { before: 1, after: d1.points * d2.points },
        Around { before: d0.points, after: d2.points },
        Around { before: d0.points * d1.points, after: 1 },
    ];
    for ((direction, around), out) in body.directions.iter().zip(around).zip(out.chunks_exact_mut(size)) {
        contract::<REGISTERS, false>(&direction.collocation, direction.points, around, values, out);
    }
}

/// The map of one layer of elements.
struct Mapping<'a> {
    body: &'a Body,
    patch: &'a Patch,
    fields: &'a [f64],
    nodes: usize,
    scale: f64,
    e0: usize,
    layer: &'a mut [Lanes],
    outcome: &'a mut Result<f64>,
}

impl Kernel for Mapping<'_> {
    #[inline(always)]
    fn run<const REGISTERS: u8>(self) {
        let Self { body, e0, .. } = self;
        let (size, width) = (body.points(), body.width());
        let mut space = Space::new(body);
        let mut values = vec![Lanes::ZERO; 4 * size];
        let mut slopes = vec![Lanes::ZERO; 12 * size];
        let mut volume = 0.0;
        for e1 in 0..body.directions[1].elements() {
            for (b, batch) in body.batches.iter().enumerate() {
                for (f, field) in self.fields.chunks_exact(self.nodes).enumerate() {
                    space.gather(body, field, e0, e1, batch);
                    let values = &mut values[f * size..][..size];
                    space.interpolate::<REGISTERS>(body, e0, e1, batch, values);
                    differentiate::<REGISTERS>(body, values, &mut slopes[3 * f * size..][..3 * size]);
                }
                let at = (e1 * body.batches.len() + b) * size * width;
                for q in 0..size {
                    let out = &mut self.layer[at + q * width..][..width];
                    for l in 0..batch.elements {
                        let x: [f64; 4] = std::array::from_fn(|f| values[f * size + q].0[l]);
                        let dx = std::array::from_fn(|f| std::array::from_fn(|r| slopes[(3 * f + r) * size + q].0[l]));
                        let point = Point::new(body.dimension, x, dx);
                        let s = point.determinant * self.scale * body.weight(q);
                        if s.is_nan() || s <= 0.0 {
                            *self.outcome = Err(self.body.folded(self.patch, [e0, e1, b * LANES + l], q, point));
                            return;
                        }
                        volume += s;
                        point.write(s.sqrt(), out, l);
                    }
                }
            }
        }
        *self.outcome = Ok(volume);
    }
}

/// The map at one Gauss point.
struct Point {
    weight: f64,
    weight_slope: [f64; 3],
    determinant: f64,
    /// dr/dx, row r.
    inverse: [[f64; 3]; 3],
}

impl Point {
    /// From (W, W x) and their derivatives.
    fn new(dimension: usize, x: [f64; 4], dx: [[f64; 3]; 4]) -> Self {
        let mut j: [[f64; 3]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|r| (dx[i + 1][r] - x[i + 1] / x[0] * dx[0][r]) / x[0]));
        if dimension == 2 {
            j[2] = [0.0, -1.0, 0.0];
        }
        let minor = |i: usize, r: usize| {
            let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (r + 1) % 3, (r + 2) % 3);
            j[a][c] * j[b][d] - j[a][d] * j[b][c]
        };
        let determinant = j[0][0] * minor(0, 0) + j[0][1] * minor(0, 1) + j[0][2] * minor(0, 2);
        let inverse = std::array::from_fn(|r| std::array::from_fn(|i| minor(i, r) / determinant));
        Self { weight: x[0], weight_slope: dx[0], determinant, inverse }
    }

    /// Writes A and, if there is room, c of lane l.
    fn write(&self, root: f64, out: &mut [Lanes], l: usize) {
        let scale = root / self.weight;
        for r in 0..3 {
            for i in 0..3 {
                out[3 * r + i].0[l] = scale * self.inverse[r][i];
            }
        }
        if out.len() == RATIONAL {
            for i in 0..3 {
                let sum: f64 = (0..3).map(|r| out[3 * r + i].0[l] * self.weight_slope[r]).sum();
                out[PLAIN + i].0[l] = -sum / self.weight;
            }
        }
    }
}

impl Body {
    /// Gauss weight of point q of an element, on [-1, 1]^3.
    pub fn weight(&self, q: usize) -> f64 {
        let [d0, d1, d2] = &self.directions;
        let (n1, n2) = (d1.points, d2.points);
        d0.weights[q / (n1 * n2)] * d1.weights[q / n2 % n1] * d2.weights[q % n2]
    }

    /// The error of a Gauss point whose volume is not positive.
    fn folded(&self, patch: &Patch, element: [usize; 3], q: usize, point: Point) -> Error {
        let (n1, n2) = (self.directions[1].points, self.directions[2].points);
        let index = [q / (n1 * n2), q / n2 % n1, q % n2];
        let axes: &[usize] = if patch.dimension() == 2 { &[0, 2] } else { &[0, 1, 2] };
        let half = |a: usize| self.directions[a].middles[element[a]][1];
        Error::FoldedElement {
            element: axes.iter().map(|&a| self.directions[a].spans[element[a]]).collect(),
            point: axes
                .iter()
                .map(|&a| self.directions[a].middles[element[a]][0] + half(a) * self.directions[a].places[index[a]])
                .collect(),
            determinant: point.determinant / axes.iter().map(|&a| half(a)).product::<f64>(),
        }
    }
}
