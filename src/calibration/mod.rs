//! Floor 3: find the stiffness phi of the spring groups.
//!
//! | file | idea |
//! |---|---|
//! | [`objective`] | what is minimised, as an optimiser sees it: error, residual, Jacobian, bounds |
//! | [`objectives`] | the distances between network and continuum, and their table |
//! | [`linear`] | those that are linear in phi, reduced to a triangle |
//! | [`optimiser`] | what every optimiser is given and gives back; their table |
//! | [`optimisers`] | annealing, Gauss-Newton, hybrid, bounded least squares |
//! | [`pieces`] | what a run can keep and a later one need not do again |
//! | [`prior`] | what draws groups together that the data leave free |
//! | [`compliance_ratios`] | where the network is too soft and too stiff on other loads |
//! | [`errors`] | how far the calibrated network is from the continuum |
//! | [`adaptive`] | groups that split where the error asks for it |
//! | [`surrogate`] | a reduced basis of displacements with an error bound |
//! | [`sweep`] | Algorithm 5.1: groupings over gamma, equal ones solved once |

pub mod adaptive;
pub mod compliance_ratios;
pub mod errors;
pub mod linear;
pub mod objective;
pub mod objectives;
pub mod optimiser;
pub mod optimisers;
pub mod pieces;
pub mod prior;
pub mod surrogate;
pub mod sweep;
