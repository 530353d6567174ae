//! Floor 3: bodies and networks in motion.
//!
//! | file | idea |
//! |---|---|
//! | [`model`] | what an integrator sees of a body that moves |

pub mod model;
