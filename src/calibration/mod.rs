//! Floor 3: find the stiffness phi of the spring groups.
//!
//! | file | idea |
//! |---|---|
//! | [`objective`] | what is minimised, as an optimiser sees it: error, residual, Jacobian, bounds |
//! | [`objectives`] | the distances between network and continuum, and their table |
//! | [`linear`] | those that are linear in phi, reduced to a triangle |
//! | [`optimiser`] | what every optimiser is given and gives back; their table |
//! | [`optimisers`] | annealing, Gauss-Newton, hybrid, bounded least squares |
//! | [`errors`] | how far the calibrated network is from the continuum |
//! | [`adaptive`] | groups that split where the error asks for it |
//! | [`surrogate`] | a reduced basis of displacements with an error bound |
//! | [`sweep`] | Algorithm 5.1: groupings over gamma, equal ones solved once |

pub mod adaptive;
pub mod errors;
pub mod linear;
pub mod objective;
pub mod objectives;
pub mod optimiser;
pub mod optimisers;
pub mod surrogate;
pub mod sweep;
