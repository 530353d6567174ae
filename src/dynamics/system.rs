//! The linear systems of implicit steps, (m M + c C + k K) x = b.
//!
//! Two ways. A sparse Cholesky factor, analysed once: exact, and one factor serves a whole run of a linear body. Or conjugate
//! gradients with the inverses of the blocks of the nodes (block Jacobi), which start at the answer of the last system: the
//! mass on the diagonal keeps the condition small where steps are short, and no factor is stored.
//!
//! A matrix that is not positive definite (a compressed spring pushes sideways) gets more mass until it is.

use std::sync::Arc;

use nalgebra_sparse::CsrMatrix;

use crate::dense::dot;
use crate::error::{Error, Result};
use crate::sparse::block_jacobi::BlockJacobi;
use crate::sparse::cg;
use crate::sparse::cholesky::{Factor, Symbolic};
use crate::sparse::ordering::minimum_degree;
use crate::sparse::pattern::Pattern;

use super::model::Model;
use super::product::multiply;

/// Factors of the mass that are tried on a matrix that is not positive definite.
const SHIFTS: [f64; 8] = [0.0, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6];

/// Iterations of conjugate gradients for each unknown, and some more, before they are given up.
const ITERATIONS: usize = 10;

/// How the linear systems of implicit steps are solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LinearSolver {
    /// By a sparse factor.
    Cholesky,
    /// By conjugate gradients with block Jacobi.
    Gradients {
        /// |b - A x| / |b| that ends them.
        tolerance: f64,
    },
}

/// The matrix m M + c C + k K, and how it is solved with.
pub(super) struct System {
    way: Way,
    sum: Sum,
    /// Whether the matrix stays as it is: that of a linear body.
    pub lasting: bool,
}

/// Its parts and their sum.
struct Sum {
    matrix: CsrMatrix<f64>,
    diagonal: Vec<usize>,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    /// The coefficients of M, C and K in the matrix.
    coefficients: [f64; 3],
}

enum Way {
    Factor(Box<Factor>),
    Gradients(Box<Gradients>),
}

struct Gradients {
    pattern: Pattern,
    jacobi: BlockJacobi,
    work: cg::Workspace,
    tolerance: f64,
}

/// What a solve has cost.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spent {
    pub factorisations: u64,
    pub iterations: u64,
}

impl System {
    /// Makes room for a body; `symbolic` is an analysis of its pattern, if there is one.
    pub fn new(model: &dyn Model, symbolic: Option<&Arc<Symbolic>>, solver: LinearSolver) -> Result<Self> {
        let pattern = model.pattern();
        let way = match solver {
            LinearSolver::Cholesky => Way::Factor(Box::new(Factor::new(match symbolic {
                Some(symbolic) => Arc::clone(symbolic),
                None => Symbolic::analyse(pattern, minimum_degree(pattern)?)?,
            }))),
            LinearSolver::Gradients { tolerance } => Way::Gradients(Box::new(Gradients {
                jacobi: BlockJacobi::new(pattern, |unknown| model.node(unknown)),
                work: cg::Workspace::new(pattern.len()),
                pattern: pattern.clone(),
                tolerance,
            })),
        };
        let zeros = vec![0.0; pattern.entries()];
        let matrix = CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), zeros.clone());
        let diagonal = |i| pattern.position(i, i).expect("the diagonal is stored");
        let sum = Sum {
            matrix: matrix.expect("one value for each entry of the pattern"),
            diagonal: (0..pattern.len()).map(diagonal).collect(),
            stiffness: zeros.clone(),
            damping: zeros,
            coefficients: [0.0; 3],
        };
        Ok(Self { way, sum, lasting: false })
    }

    /// Whether the matrix with these coefficients is ready.
    pub fn has(&self, coefficients: [f64; 3]) -> bool {
        self.lasting && self.sum.coefficients == coefficients
    }

    /// Takes the tangents at (u, v); true when the matrix will be nothing but mass.
    pub fn tangents(&mut self, model: &mut dyn Model, [u, v]: [&[f64]; 2], coefficients: [f64; 3]) -> bool {
        self.sum.coefficients = coefficients;
        model.tangent(u, v, &mut self.sum.stiffness, &mut self.sum.damping);
        coefficients[2] == 0.0 && self.sum.damping.iter().all(|&c| c == 0.0)
    }

    /// Makes the matrix ready for [`System::solve`].
    ///
    /// # Errors
    /// Those of the factorisation.
    pub fn prepare(&mut self, masses: &[f64]) -> Result<Spent> {
        let mut spent = Spent::default();
        match &mut self.way {
            Way::Gradients(gradients) => {
                self.sum.compose(0.0, masses);
                gradients.jacobi.load(self.sum.matrix.values());
            }
            Way::Factor(factor) => {
                for shift in SHIFTS {
                    self.sum.compose(shift, masses);
                    factor.load(&self.sum.matrix);
                    spent.factorisations += 1;
                    match factor.refactor() {
                        Err(Error::NotPositiveDefinite { .. }) if shift < SHIFTS[SHIFTS.len() - 1] => {}
                        outcome => return outcome.map(|()| spent),
                    }
                }
            }
        }
        Ok(spent)
    }

    /// Solves with the matrix; `x` holds a guess for the iteration.
    ///
    /// # Errors
    /// [`Error::Inaccurate`] when the tolerance is not reached; those of [`Factor::solve`].
    pub fn solve(&mut self, masses: &[f64], b: &[f64], x: &mut [f64]) -> Result<Spent> {
        let mut spent = Spent::default();
        let gradients = match &mut self.way {
            Way::Factor(factor) => return factor.solve(b, x).map(|_| spent),
            Way::Gradients(gradients) => gradients,
        };
        for shift in SHIFTS {
            if shift > 0.0 {
                self.sum.compose(shift, masses);
                gradients.jacobi.load(self.sum.matrix.values());
            }
            let (outcome, definite) = gradients.iterate(self.sum.matrix.values(), b, x);
            spent.iterations += outcome.iterations as u64;
            if outcome.reached(gradients.tolerance) {
                return Ok(spent);
            }
            if definite {
                return Err(Error::Inaccurate { backward_error: outcome.residual, limit: gradients.tolerance });
            }
        }
        Err(Error::NotPositiveDefinite { dof: 0 })
    }
}

impl Sum {
    /// matrix = (1 + shift) m M + c C + k K
    fn compose(&mut self, shift: f64, masses: &[f64]) {
        let [m, c, k] = self.coefficients;
        let values = self.matrix.values_mut();
        for ((value, damping), stiffness) in values.iter_mut().zip(&self.damping).zip(&self.stiffness) {
            *value = c * damping + k * stiffness;
        }
        for (&place, mass) in self.diagonal.iter().zip(masses) {
            values[place] += (1.0 + shift) * m * mass;
        }
    }
}

impl Gradients {
    /// Iterates; false when a direction was met that the matrix does not resist.
    fn iterate(&mut self, values: &[f64], b: &[f64], x: &mut [f64]) -> (cg::Outcome, bool) {
        let Self { pattern, jacobi, work, tolerance } = self;
        let mut definite = true;
        let mut apply = |p: &[f64], q: &mut [f64]| {
            multiply(pattern, values, p, q);
            definite &= dot(p, q) > 0.0;
        };
        let mut precondition = |r: &[f64], z: &mut [f64]| jacobi.apply(r, z);
        let most = ITERATIONS * (b.len() + ITERATIONS);
        let outcome = cg::solve(&mut apply, &mut precondition, b, x, *tolerance, most, work);
        (outcome, definite)
    }
}
