//! Floor 3: bodies and networks in motion.
//!
//! | file | idea |
//! |---|---|
//! | [`model`] | what an integrator sees of a body that moves |
//! | [`forces`] | forces of springs at any stretch and turn |

pub mod forces;
pub mod model;
