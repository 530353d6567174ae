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

use std::sync::Arc;

use crate::calibration::objectives::displacement::Target;
use crate::dense::{dot, gram_of_rows};
use crate::error::{Error, Result};
use crate::sparse::cholesky::Symbolic;
use crate::springs::affine::AffineStiffness;

use super::packed;

/// A column whose part outside the span is below this fraction of it is in the span.
const IN_SPAN: f64 = 1e-10;

/// The basis and the projected problem. Immutable while walkers use it.
pub struct Galerkin<'a> {
    pub(super) target: Target<'a>,
    /// The springs, assembled.
    pub(super) springs: &'a AffineStiffness,
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
    ///
    /// # Errors
    /// [`Error::Input`] when the springs are not assembled.
    pub fn new(target: Target<'a>) -> Result<Self> {
        let (springs, _) = assembled(&target)?;
        Ok(Self::empty(target, springs))
    }

    fn empty(target: Target<'a>, springs: &'a AffineStiffness) -> Self {
        let cases = target.weights.len();
        Self {
            target,
            springs,
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
        *self = Self::empty(self.target, self.springs);
    }

    /// The problem that is projected.
    pub fn target(&self) -> Target<'a> {
        self.target
    }

    /// Number r of columns.
    pub fn rank(&self) -> usize {
        self.vectors.len() / self.unknowns()
    }

    /// Column j of V.
    pub fn vector(&self, j: usize) -> &[f64] {
        &self.vectors[j * self.unknowns()..(j + 1) * self.unknowns()]
    }

    pub(super) fn unknowns(&self) -> usize {
        self.springs.unknowns()
    }

    /// Norm of the part of a reference that the basis cannot represent, m.
    pub(super) fn rest(&self, case: usize) -> f64 {
        let n = self.unknowns();
        let rest = &self.remainder[case * n..(case + 1) * n];
        dot(rest, rest).sqrt()
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

    /// The normalised part of a column outside the span; orthogonalised until nothing more falls off.
    fn outside(&self, column: &[f64]) -> Option<Vec<f64>> {
        let length = |vector: &[f64]| dot(vector, vector).sqrt();
        let mut vector = column.to_vec();
        let smallest = IN_SPAN * length(column);
        let mut left = length(column);
        for _ in 0..3 {
            if left.is_nan() || left <= smallest {
                return None;
            }
            let before = length(&vector);
            vector.iter_mut().for_each(|v| *v /= before);
            for j in 0..self.rank() {
                let share = dot(self.vector(j), &vector);
                packed::add(-share, self.vector(j), &mut vector);
            }
            left *= length(&vector);
        }
        let after = length(&vector);
        (left > smallest).then(|| vector.iter().map(|v| v / after).collect())
    }

    fn append(&mut self, vector: &[f64]) {
        let n = self.unknowns();
        self.vectors.extend_from_slice(vector);
        let springs = self.springs.springs();
        let first = self.elongations.len();
        self.elongations.resize(first + springs, 0.0);
        self.springs.elongations(vector, &mut self.elongations[first..]);
        for (case, rest) in self.remainder.chunks_exact_mut(n).enumerate() {
            self.forces[case].push(dot(vector, &self.target.forces[case * n..(case + 1) * n]));
            self.aims[case].push(dot(vector, &self.target.reference[case * n..(case + 1) * n]));
            packed::add(-dot(vector, rest), vector, rest);
        }
    }

    /// Projects K_a on the columns from `before` on, and packs anew.
    fn project(&mut self, before: usize) {
        let r = self.rank();
        if r == before {
            return;
        }
        let stiffness = self.springs;
        let mut next = vec![0.0; stiffness.groups() * packed::len(r)];
        for (a, into) in next.chunks_exact_mut(packed::len(r)).enumerate() {
            for j in 0..before {
                let from = a * packed::len(before) + packed::start(before, j);
                into[packed::start(r, j)..][..before - j].copy_from_slice(&self.stiffness[from..from + before - j]);
            }
            let products = gram_of_rows(&self.elongations, stiffness.springs(), stiffness.group_springs(a), before);
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

/// The assembled springs of a problem.
///
/// # Errors
/// [`Error::Input`] when there are none.
pub(super) fn assembled<'a>(target: &Target<'a>) -> Result<(&'a AffineStiffness, &'a Arc<Symbolic>)> {
    target.operator.assembled().ok_or_else(|| {
        let help = "use solver.path = \"stale\" or \"direct\", or another optimiser";
        Error::input(
            "calibration.optimiser",
            "the surrogate needs factors, and this network is solved by multigrid",
            help,
        )
    })
}
