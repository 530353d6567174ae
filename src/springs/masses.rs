//! Masses of the nodes.
//!
//! ```text
//! "element" (3.12)   m_i = sum_e rho V_e / n_e               equal shares of each element e around node i
//! "lumped"  (3.11)   m_i = sum_j M_ij = rho int N_i dV       row sums of the consistent mass matrix
//! ```
//!
//! V_e is the integrated measure of the element, not the one of the control polygon, so both add up to the mass of the
//! body: the first shares it out, and for the second sum_i N_i = 1. The rational basis is not negative, so no mass is.
//! A tied node has none: its master carries it. Masses in kg.

use crate::geometry::dofs::DofMap;

/// Equal shares (3.12), one mass for each node, kg.
///
/// `elements` lists the nodes of all elements one after the other, equally many each; `measures` is one V_e for each
/// element, m^3 (in two dimensions area times thickness); `density` in kg/m^3.
///
/// # Panics
/// When the nodes cannot be shared out evenly among the elements.
pub fn equal_shares(dofs: &DofMap, elements: &[u32], measures: &[f64], density: f64) -> Vec<f64> {
    let mut masses = vec![0.0; dofs.nodes()];
    if measures.is_empty() {
        return masses;
    }
    let per_element = elements.len() / measures.len();
    assert_eq!(elements.len(), per_element * measures.len(), "every element has equally many nodes");
    for (nodes, &measure) in elements.chunks_exact(per_element).zip(measures) {
        for &node in nodes {
            masses[dofs.master(node as usize)] += density * measure / per_element as f64;
        }
    }
    masses
}

/// Row sums of the consistent mass matrix (3.11), one mass for each node, kg.
///
/// `elements` as in [`equal_shares`]; `integrals` holds int N_i dV over the element for each of its nodes, m^3, in the
/// same order; `density` in kg/m^3.
///
/// # Panics
/// When the two slices differ in length.
pub fn lumped(dofs: &DofMap, elements: &[u32], integrals: &[f64], density: f64) -> Vec<f64> {
    assert_eq!(elements.len(), integrals.len(), "one integral for each node of each element");
    let mut masses = vec![0.0; dofs.nodes()];
    for (&node, &integral) in elements.iter().zip(integrals) {
        masses[dofs.master(node as usize)] += density * integral;
    }
    masses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masses_of_two_elements_add_up_and_go_to_the_masters() {
        let dofs = DofMap::new(2, vec![0, 1, 2, 3, 0, 5], &[[false; 3]; 6]);
        let elements = [0, 1, 2, 3, 2, 3, 4, 5];
        let masses = equal_shares(&dofs, &elements, &[1.0, 3.0], 2.0);
        assert_eq!(masses, [2.0, 0.5, 2.0, 2.0, 0.0, 1.5]);
        let lumped = lumped(&dofs, &elements, &[0.25; 8], 2.0);
        assert_eq!(lumped.iter().sum::<f64>(), 4.0);
        assert_eq!(lumped[4], 0.0);
    }
}
