//! Floor 0: sparse symmetric systems that are solved again and again on one pattern.
//!
//! | file | idea |
//! |---|---|
//! | [`pattern`] | which degrees of freedom couple: one CSR pattern, built once and shared |
//! | [`assemble`] | element matrices into that pattern, in parallel, with the same bits for any number of threads |
//! | [`ordering`] | elimination orders: nested dissection of a grid, minimum degree otherwise |
//! | [`cholesky`] | analysed once ([`cholesky::Symbolic`], shared), factored and solved often ([`cholesky::Factor`], one a worker) |
//! | [`single`] | a factor in single precision, as a preconditioner |
//! | [`product`] | the product with the triangle that the factor reads |
//! | `sweep` | down and up a factor, branches of its tree side by side |
//! | [`cg`] | preconditioned conjugate gradients, for a matrix that is only applied |
//! | [`vectors`] | products and sums of long vectors, whose bits do not depend on the threads |
//! | [`block_jacobi`] | the inverses of the diagonal blocks, a preconditioner for time steps |
//! | [`multigrid`] | a V-cycle on a grid of springs, a preconditioner whose work grows like the unknowns |
//! | [`fast_diagonalisation`] | the inverse of a sum of Kronecker products, a preconditioner on boxes of splines |
//! | `multifrontal` | the numbers of a factor, front by front, branches of its tree side by side |
//! | [`equilibrium`] | where an energy and a load balance: Newton's method on one pattern |
//! | [`backward_error`] | how well a solution satisfies its equations |
//! | [`condition`] | how much a solve amplifies errors, estimated from a few solves |
//! | [`zero_modes`] | how many ways there are to move without resistance, and which |

pub mod assemble;
pub mod backward_error;
pub mod block_jacobi;
pub mod cg;
pub mod cholesky;
pub mod condition;
pub mod equilibrium;
pub mod fast_diagonalisation;
mod multifrontal;
pub mod multigrid;
pub mod ordering;
pub mod pattern;
pub mod product;
pub mod single;
mod sweep;
pub mod vectors;
pub mod zero_modes;
