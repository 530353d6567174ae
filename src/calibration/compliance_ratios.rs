//! How far a network can be trusted on other loads: the smooth loads under which it is too soft and too stiff, beside the continuum.
//!
//! A load f moves the continuum by K_ref^-1 f and the network by K(phi)^-1 f. The *compliance ratio* compares the work that
//! it does,
//!
//! ```text
//! lambda(f) = (f . K(phi)^-1 f) / (f . K_ref^-1 f)
//! ```
//!
//! 1 for a network that is right for f, more where it is too soft, infinite for a mechanism, less where it is too
//! stiff. Over all loads that says little: springs cannot follow waves as short as a cell, and sound networks of the torus
//! have ratios from 10 to 50 there (measured), as do those that are open. So f runs over the loads of degree 2 in the place
//! ([`crate::reference::polynomial_loads`]): q <= 30 solves. With Q (n x q) an orthonormal basis of them and f = Q x,
//!
//! ```text
//! A x = lambda B x,     A = Q^T K(phi)^-1 Q,     B = Q^T K_ref^-1 Q
//! ```
//!
//! and the largest and the smallest lambda bound the ratio of every load of the space. Fits on one load that are 1 to 16 % off under it
//! have ratios from .60 to 1.33 on the cube, .16 to 3.5 on the ellipse, .09 to 2.0 on the torus and .05 to 1.2 on the spheroid, whose
//! inner layer is held: the stiff side is the worse one as a rule. With B = L L^T they are those of
//! L^-1 A L^-T. Where several loads have the extremal ratio alike, as on a body with symmetries, the one that is told is the
//! part of the first field that has most of itself among them: it does not depend on the last bits.

use nalgebra_sparse::na::{Cholesky, DMatrix, DVector, SymmetricEigen};

use crate::error::Result;
use crate::sparse::vectors::{add, dot, norm, scale};
use crate::springs::solver::SpringSolver;

/// A field whose part of its own is shorter than this fraction of it follows from those before it.
const DEPENDENT: f64 = 1e-6;

/// Ratios as near as this, relative, are the same.
const SAME: f64 = 1e-6;

/// Largest relative residual of a solve.
const TOLERANCE: f64 = 1e-6;

/// Force fields of length 1 that are orthogonal to each other, and how they are made of given ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    /// Free degrees of freedom.
    unknowns: usize,
    /// Q: one field after the other, q x n.
    pub forces: Vec<f64>,
    /// Column j of T in Q = G T, with G the given fields: q x q.
    combinations: Vec<Vec<f64>>,
    /// Which of the given fields gave each: the others follow from those before them.
    pub kept: Vec<usize>,
}

impl Basis {
    /// Takes fields over the free degrees of freedom, by Gram and Schmidt in their order.
    pub fn new<'a>(unknowns: usize, given: impl ExactSizeIterator<Item = &'a [f64]>) -> Self {
        let count = given.len();
        let mut basis = Self { unknowns, forces: vec![], combinations: vec![], kept: vec![] };
        for (i, field) in given.enumerate() {
            let (mut own, mut combination) = (field.to_vec(), vec![0.0; count]);
            combination[i] = 1.0;
            // twice, so that rounding does not stay
            for _ in 0..2 {
                for (other, of) in basis.forces.chunks_exact(unknowns.max(1)).zip(&basis.combinations) {
                    let shared = dot(other, &own);
                    add(-shared, other, &mut own);
                    add(-shared, of, &mut combination);
                }
            }
            let length = norm(&own);
            if length > DEPENDENT * norm(field) {
                scale(1.0 / length, &mut own);
                scale(1.0 / length, &mut combination);
                basis.forces.extend(own);
                basis.combinations.push(combination);
                basis.kept.push(i);
            }
        }
        basis
    }

    /// Q^T V for q vectors V (q x n).
    fn gram(&self, vectors: &[f64]) -> DMatrix<f64> {
        let (n, q) = (self.unknowns.max(1), self.kept.len());
        let entry = |i: usize, j: usize| dot(&self.forces[i * n..][..n], &vectors[j * n..][..n]);
        // both are symmetric but for rounding
        DMatrix::from_fn(q, q, |i, j| 0.5 * (entry(i, j) + entry(j, i)))
    }
}

/// The load of an extremal ratio.
#[derive(Debug, Clone, PartialEq)]
pub struct Extreme {
    /// lambda.
    pub ratio: f64,
    /// Coefficient of every given field in the load, N; forces on the free degrees of freedom have a root mean square of 1 N.
    pub coefficients: Vec<f64>,
    /// How much of the square of the load lies along each field of the basis; the sum is 1.
    pub shares: Vec<f64>,
    /// K(phi)^-1 f over the free degrees of freedom, m.
    pub motion: Vec<f64>,
}

/// Both ends of the compliance ratios.
#[derive(Debug, Clone, PartialEq)]
pub struct Extremes {
    /// Where the network is softest beside the continuum.
    pub softest: Extreme,
    /// Where it is stiffest.
    pub stiffest: Extreme,
    /// The largest ratio of the loads that the first fields span alone.
    pub softest_of_first: f64,
}

/// Finds them among the loads of a basis under which the continuum moves by `answers` (m, q x n). `solver` holds K(phi); `first` says how
/// many of the basis count as the first fields. None when there is no load, or the answers are none of an elastic body.
///
/// # Errors
/// Where a solve is not accurate.
pub fn extremes(solver: &mut SpringSolver, basis: &Basis, answers: &[f64], first: usize) -> Result<Option<Extremes>> {
    let mut moved = vec![0.0; basis.forces.len()];
    solver.solve(&basis.forces, &mut moved, TOLERANCE)?;
    let (a, b) = (basis.gram(&moved), basis.gram(answers));
    let leading = |matrix: &DMatrix<f64>| matrix.view((0, 0), (first, first)).into_owned();
    let softest_of_first = Pencil::new(&leading(&a), leading(&b)).map_or(0.0, |pencil| pencil.values.max());
    let Some(pencil) = Pencil::new(&a, b) else { return Ok(None) };
    let of = |ratio: f64| extreme(basis, &moved, ratio, &pencil.load(ratio));
    Ok(Some(Extremes { softest: of(pencil.values.max()), stiffest: of(pencil.values.min()), softest_of_first }))
}

/// The load Q x.
fn extreme(basis: &Basis, moved: &[f64], ratio: f64, x: &DVector<f64>) -> Extreme {
    let n = basis.unknowns;
    let x = x * ((n as f64).sqrt() / x.norm());
    let shares = x.iter().map(|x| x * x / n as f64).collect();
    let (mut motion, mut coefficients) = (vec![0.0; n], vec![0.0; basis.combinations[0].len()]);
    for ((x, moved), of) in x.iter().zip(moved.chunks_exact(n)).zip(&basis.combinations) {
        add(*x, moved, &mut motion);
        add(*x, of, &mut coefficients);
    }
    Extreme { ratio, coefficients, shares, motion }
}

/// A x = lambda B x, solved.
struct Pencil {
    /// L of B = L L^T.
    lower: DMatrix<f64>,
    /// lambda.
    values: DVector<f64>,
    /// y = L^T x of each, orthonormal columns.
    vectors: DMatrix<f64>,
}

impl Pencil {
    /// Takes symmetric matrices; none where B is not positive definite, or empty.
    fn new(a: &DMatrix<f64>, b: DMatrix<f64>) -> Option<Self> {
        if b.is_empty() {
            return None;
        }
        let lower = Cholesky::new(b)?.unpack();
        let half = lower.solve_lower_triangular(a)?;
        let whole = lower.solve_lower_triangular(&half.transpose())?;
        let found = SymmetricEigen::new(0.5 * (&whole + whole.transpose()));
        Some(Self { lower, values: found.eigenvalues, vectors: found.eigenvectors })
    }

    /// x of the load with this ratio: the part, among all loads that have it, of the first field that has most of itself
    /// there, up to its length.
    fn load(&self, ratio: f64) -> DVector<f64> {
        let there: Vec<usize> =
            (0..self.values.len()).filter(|&i| (self.values[i] - ratio).abs() <= SAME * ratio.abs()).collect();
        let space = self.vectors.select_columns(&there);
        let mut best = (0.0, DVector::zeros(self.values.len()));
        for field in 0..self.values.len() {
            let field = self.lower.row(field).transpose();
            let part = &space * space.tr_mul(&field);
            let share = part.norm() / field.norm();
            if share > best.0 * (1.0 + SAME) {
                best = (share, part);
            }
        }
        self.lower.tr_solve_lower_triangular(&best.1).expect("a factor has no zero on its diagonal")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_basis_is_orthonormal_and_leaves_out_what_follows_from_others() {
        let given: [&[f64]; 3] = [&[2.0, 0.0], &[3.0, 1e-9], &[4.0, 0.5]];
        let basis = Basis::new(2, given.into_iter());
        assert_eq!((basis.kept.as_slice(), basis.forces.as_slice()), (&[0, 2][..], &[1.0, 0.0, 0.0, 1.0][..]));
        for (field, of) in basis.forces.chunks(2).zip(&basis.combinations) {
            let made: Vec<f64> = (0..2).map(|i| given.iter().zip(of).map(|(g, c)| g[i] * c).sum()).collect();
            assert_eq!(made, field);
        }
    }

    #[test]
    fn a_pencil_has_the_ratios_of_two_springs_in_turned_axes() {
        // A = R diag(3, .5) R^T, B = R diag(1, 2) R^T: ratios 3 and 1/4 along the turned axes
        let turn = DMatrix::from_row_slice(2, 2, &[0.8, -0.6, 0.6, 0.8]);
        let turned = |d: [f64; 2]| &turn * DMatrix::from_diagonal(&DVector::from_row_slice(&d)) * turn.transpose();
        let pencil = Pencil::new(&turned([3.0, 0.5]), turned([1.0, 2.0])).expect("definite");
        for (ratio, axis) in [(3.0, [0.8, 0.6]), (0.25, [-0.6, 0.8])] {
            let found = pencil.values.iter().find(|value| (**value - ratio).abs() < 1e-14).expect("a value");
            let load = pencil.load(*found).normalize();
            let along = (load[0] * axis[0] + load[1] * axis[1]).abs();
            assert!((along - 1.0).abs() < 1e-14, "{load}");
        }
        assert!(Pencil::new(&turned([1.0, 1.0]), turned([1.0, -1.0])).is_none());
    }

    #[test]
    fn among_loads_of_one_ratio_the_first_field_is_told_whatever_the_last_bits() {
        let b = DMatrix::identity(3, 3);
        for bit in [-1e-15, 0.0, 1e-15] {
            let a = DMatrix::from_row_slice(3, 3, &[2.0, bit, 0.0, bit, 2.0 - bit, 0.0, 0.0, 0.0, 1.0]);
            let pencil = Pencil::new(&a, b.clone()).expect("definite");
            let load = pencil.load(pencil.values.max());
            assert!((load[0] - 1.0).abs() < 1e-12 && load[1].abs() < 1e-12, "{bit}: {load}");
        }
    }
}
