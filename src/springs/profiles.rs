//! What the springs of one group have in common.
//!
//! The calibration finds one number phi_a for each group. A spring s of the group that counts c_s times
//! ([`super::weighting`]) has the stiffness
//!
//! ```text
//! k_s = phi_a w_s,     w_s = c_s p_s
//! ```
//!
//! and the *profile* says how the factor p_s > 0 runs through a group: springs of unlike length can share a number and yet
//! differ in stiffness the way those of an elastic body do. Cut a bar of section A and modulus E into springs of length l: each
//! has the stiffness E A / l. Fill space with cells of side l: the section that a spring stands for is l^2 in three
//! dimensions, and the stiffness grows like l. On a body whose cells are drawn out, a long spring has many short ones
//! beside it, each of which answers for the same volume V: its stiffness falls like E V / l^2, as in the bound (4.19) and in
//! Van Gelder's formula (3.14).
//!
//! The unit of phi is that of the profile, so that k_s is in N/m. Upper bounds follow: [`super::bounds::upper_bounds`].

use super::network::Network;

/// A way to share one number among the springs of a group, chosen by its name.
pub struct Profile {
    /// The word in the scene.
    pub name: &'static str,
    /// What it does, in a line.
    pub doc: &'static str,
    /// Unit of phi.
    pub unit: &'static str,
    /// True when the factors come from the stiffness matrix of the continuum.
    pub needs_matrix: bool,
    /// The factor p_s of every spring, positive. The second argument is the stiffness of every spring in a fit of the
    /// matrices, over c_s (N/m); empty unless the profile needs it.
    pub factor: fn(&Network, &[f64]) -> Vec<f64>,
}

/// All profiles.
pub const PROFILES: &[Profile] = &[
    Profile {
        name: "constant",
        doc: "one stiffness k for the springs of a group",
        unit: "N/m",
        needs_matrix: false,
        factor: |network, _| vec![1.0; network.springs.len()],
    },
    Profile {
        name: "axial_rigidity",
        doc: "one axial rigidity EA for the springs of a group: k = EA / l0",
        unit: "N",
        needs_matrix: false,
        factor: |network, _| network.springs.iter().map(|spring| 1.0 / spring.length).collect(),
    },
    Profile {
        name: "inverse_square",
        doc: "k falls like 1 / l0^2 within a group, as for springs that stand for equal volumes",
        unit: "N m",
        needs_matrix: false,
        factor: |network, _| network.springs.iter().map(|spring| spring.length.powi(-2)).collect(),
    },
    Profile {
        name: "matrix_fit",
        doc: "k follows a fit of every spring to the stiffness matrix of the continuum (3.17)",
        unit: "1",
        needs_matrix: true,
        factor: |_, fitted| fitted.to_vec(),
    },
];

/// The profile of this name.
pub fn find(name: &str) -> Option<&'static Profile> {
    PROFILES.iter().find(|profile| profile.name == name)
}
