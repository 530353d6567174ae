//! Damping of the springs (4.18).
//!
//! ```text
//! c_ij = (2 / alpha) sqrt(k_ij (m_i + m_j)) / l0_ij
//! ```
//!
//! alpha > 0 is the user's number: the larger, the less damping. k in N/m, m in kg, l0 in m, c in N s/m.

use super::network::Network;

/// c_ij of every spring.
///
/// `stiffness` is k of every spring, N/m, multiplicity included; `masses` is one for each node, kg.
///
/// # Panics
/// When there is not one stiffness for every spring.
pub fn coefficients(network: &Network, stiffness: &[f64], masses: &[f64], alpha: f64) -> Vec<f64> {
    assert_eq!(network.springs.len(), stiffness.len(), "one stiffness for every spring");
    let damping = |([a, b], length, k): ([u32; 2], f64, f64)| {
        2.0 / alpha * (k * (masses[a as usize] + masses[b as usize])).sqrt() / length
    };
    let ends = network.springs.iter().map(|spring| (spring.nodes, spring.length));
    ends.zip(stiffness).map(|((nodes, length), &k)| damping((nodes, length, k))).collect()
}
