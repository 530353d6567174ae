//! Ways to find the smallest error.

pub mod annealing;
pub mod basins;
pub mod descent;
pub mod gauss_newton;
pub mod hybrid;
pub mod least_squares;
pub mod many;
pub mod reduced;
pub mod surrogate;
