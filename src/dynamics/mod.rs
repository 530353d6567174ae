//! Floor 3: bodies and networks in motion.
//!
//! | file | idea |
//! |---|---|
//! | [`model`] | what an integrator sees of a body that moves |
//! | [`linear`] | K, C and M of a linear body |
//! | [`falling`] | the plain explicit step that speed is measured on |
//! | [`forces`] | forces of springs at any stretch and turn |
//! | [`springs`] | a network with those forces, and its tangents |
//! | [`corotational`] | an elastic body at any turn |
//! | [`external`] | external forces in time |
//! | [`integrator`] | the table of integrators; [`integrators`] has a file for each |
//! | [`stepper`] | a body on its way: state, accounts, one step after the other |
//! | [`implicit`] | the end of an implicit step: Newton's method |
//! | [`eigen`] | the largest eigenvalue of a symmetric operator |
//! | [`stability`] | how large a step may be |
//! | [`energy`] | the energies of a motion and their balance |
//! | [`motion`] | a motion, recorded |

pub mod corotational;
pub mod eigen;
pub mod energy;
pub mod external;
pub mod falling;
pub mod forces;
pub mod implicit;
pub mod integrator;
pub mod integrators;
pub mod linear;
pub mod model;
pub mod motion;
mod product;
pub mod springs;
pub mod stability;
pub mod stepper;
