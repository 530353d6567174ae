//! The reduced basis: V (n x r) with orthonormal columns, and everything projected on it.
//!
//! ```text
//! u ~ V y,     K_r(phi) y = V^T f,     K_r(phi) = sum_a phi_a V^T K_a V
//! ```
//!
//! V^T K_a V is the Gram matrix of the elongations of the basis vectors over the springs of group a, so projecting all
//! groups costs springs x r^2 and never forms K_a. Because V is orthonormal the distance to the reference is
//!
//! ```text
//! |V y - u_ref|^2 = |y - V^T u_ref|^2 + |u_ref - V V^T u_ref|^2
//! ```
//!
//! and nothing of length n is left online. The last term is carried as a vector and deflated with every new column, so it
//! does not suffer from cancellation.

use std::borrow::Cow;

use crate::calibration::objectives::displacement::Target;
use crate::dense::gram_of_rows;
use crate::sparse::vectors::{add, add_all, dot, dots, norm, scale};
use crate::springs::members::Members;

use super::packed;

/// A column whose part outside the span is below this fraction of it is in the span.
const IN_SPAN: f64 = 1e-10;

/// A vector that keeps at least this part of its length is orthogonal to the basis to rounding (Kahan's and Parlett's
/// criterion).
const NEARLY_ALL: f64 = 0.7;

/// The basis and the projected problem. Immutable while walkers use it.
pub struct Galerkin<'a> {
    pub(super) target: Target<'a>,
    springs: Cow<'a, Members>,
    /// V, column after column.
    vectors: Vec<f64>,
    /// Elongations of the basis vectors (springs x r).
    elongations: Vec<f64>,
    /// V^T K_a V, packed, group after group.
    pub(super) stiffness: Vec<f64>,
    /// V^T f of each case.
    pub(super) forces: Vec<Vec<f64>>,
    /// V^T u_ref of each case.
    pub(super) aims: Vec<Vec<f64>>,
    /// u_ref - V V^T u_ref of each case (cases x n).
    remainder: Vec<f64>,
}

impl<'a> Galerkin<'a> {
    /// An empty basis.
    pub fn new(target: Target<'a>) -> Self {
        let cases = target.weights.len();
        Self {
            target,
            springs: target.operator.members(),
            vectors: Vec::new(),
            elongations: Vec::new(),
            stiffness: Vec::new(),
            forces: vec![Vec::new(); cases],
            aims: vec![Vec::new(); cases],
            remainder: target.reference.to_vec(),
        }
    }

    /// Forgets all columns.
    pub fn clear(&mut self) {
        [&mut self.vectors, &mut self.elongations, &mut self.stiffness].into_iter().for_each(Vec::clear);
        self.forces.iter_mut().chain(&mut self.aims).for_each(Vec::clear);
        self.remainder.copy_from_slice(self.target.reference);
    }

    /// The problem that is projected.
    pub fn target(&self) -> Target<'a> {
        self.target
    }

    /// Bytes of a basis of `columns` columns over so many free degrees of freedom and springs.
    pub fn bytes(unknowns: usize, springs: usize, columns: usize) -> usize {
        8 * (unknowns + springs) * columns
    }

    /// Number r of columns.
    pub fn rank(&self) -> usize {
        self.vectors.len() / self.unknowns()
    }

    /// Column j of V.
    pub fn vector(&self, j: usize) -> &[f64] {
        &self.vectors[j * self.unknowns()..(j + 1) * self.unknowns()]
    }

    /// out = V y.
    pub fn combine(&self, y: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        y.iter().enumerate().for_each(|(j, y)| add(*y, self.vector(j), out));
    }

    pub(super) fn unknowns(&self) -> usize {
        self.springs.unknowns()
    }

    /// Norm of the part of a reference that the basis cannot represent, m.
    pub(super) fn rest(&self, case: usize) -> f64 {
        let n = self.unknowns();
        norm(&self.remainder[case * n..(case + 1) * n])
    }

    /// Adds what the columns (n x any number, column-major) have outside the span; returns how many were added.
    pub fn enrich(&mut self, columns: &[f64]) -> usize {
        let (n, before) = (self.unknowns(), self.rank());
        for column in columns.chunks_exact(n) {
            if let Some(vector) = self.outside(column) {
                self.append(&vector);
            }
        }
        self.project(before);
        self.rank() - before
    }

    /// The normalised part of a column outside the span. What falls off a vector of length 1 leaves rounding in the span,
    /// as large against the rest as that is small: the vector is orthogonalised until nearly nothing falls off.
    fn outside(&self, column: &[f64]) -> Option<Vec<f64>> {
        let mut vector = column.to_vec();
        let mut left = norm(column);
        let smallest = IN_SPAN * left;
        let mut shares = vec![0.0; self.rank()];
        let mut length = left;
        loop {
            if left.is_nan() || left <= smallest {
                return None;
            }
            scale(1.0 / length, &mut vector);
            dots(&self.vectors, &vector, &mut shares);
            shares.iter_mut().for_each(|share| *share = -*share);
            add_all(&shares, &self.vectors, &mut vector);
            length = norm(&vector);
            left *= length;
            if length > NEARLY_ALL {
                scale(1.0 / length, &mut vector);
                return Some(vector);
            }
        }
    }

    fn append(&mut self, vector: &[f64]) {
        let n = self.unknowns();
        self.vectors.extend_from_slice(vector);
        let springs = self.springs.len();
        let first = self.elongations.len();
        self.elongations.resize(first + springs, 0.0);
        self.springs.elongations(vector, &mut self.elongations[first..]);
        for (case, rest) in self.remainder.chunks_exact_mut(n).enumerate() {
            self.forces[case].push(dot(vector, &self.target.forces[case * n..(case + 1) * n]));
            self.aims[case].push(dot(vector, &self.target.reference[case * n..(case + 1) * n]));
            add(-dot(vector, rest), vector, rest);
        }
    }

    /// Projects K_a on the columns from `before` on, and packs anew.
    fn project(&mut self, before: usize) {
        let r = self.rank();
        if r == before {
            return;
        }
        let springs = &self.springs;
        let mut next = vec![0.0; springs.groups() * packed::len(r)];
        for (a, into) in next.chunks_exact_mut(packed::len(r)).enumerate() {
            for j in 0..before {
                let from = a * packed::len(before) + packed::start(before, j);
                into[packed::start(r, j)..][..before - j].copy_from_slice(&self.stiffness[from..from + before - j]);
            }
            let products = gram_of_rows(&self.elongations, springs.len(), springs.group(a), before);
            for (column, products) in (before..r).zip(products.chunks_exact(r)) {
                for (row, &product) in products.iter().enumerate() {
                    if row < before {
                        into[packed::start(r, row) + column - row] = product;
                    } else if row >= column {
                        into[packed::start(r, column) + row - column] = product;
                    }
                }
            }
        }
        self.stiffness = next;
    }
}
