//! Forces that are polynomials of the place: what a smooth load is made of, as far as the second order.
//!
//! With the centre c of the box around the nodes, its largest extent L and r = (x - c) / L, the force on a node at x is one of
//!
//! | field | force | in the plane | in space |
//! |---|---|---|---|
//! | pull along a | e_a | 2 | 3 |
//! | twist about a | e_a x r | 1 | 3 |
//! | stretch along a | r_a e_a | 2 | 3 |
//! | shear in ab | r_b e_a + r_a e_b | 1 | 3 |
//! | a-force growing with b*c | r_b r_c e_a | 6 | 18 |
//!
//! in N a node, as a force for every node is given in a scene: 12 fields in the plane and 30 in space, that span all force
//! fields of degree 2. Held components get no force, tied points one.

use crate::geometry::dofs::{DofMap, FIXED};
use crate::reference::load_fields::centre_and_extent;

const AXES: [char; 3] = ['x', 'y', 'z'];

/// The place of the factor 1 among those of a term.
const ONE: usize = 3;

/// A force of 1 N over the free degrees of freedom.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// What it is, in words.
    pub name: String,
    /// Degree of its polynomial, 0 to 2.
    pub degree: usize,
    /// Force on each free degree of freedom, N.
    pub forces: Vec<f64>,
}

/// sign r_i r_j in one component, (i, j) the factors and r_3 = 1.
struct Term {
    component: usize,
    factors: [usize; 2],
    sign: f64,
}

/// The fields on nodes at `positions` (m, n x 3), those of lower degree first.
///
/// # Panics
/// When there is not one position for each node.
pub fn polynomial_loads(positions: &[[f64; 3]], dofs: &DofMap) -> Vec<Field> {
    assert_eq!(positions.len(), dofs.nodes(), "one position for each node");
    let (centre, extent) = centre_and_extent(positions);
    let on_nodes = |(name, terms): (String, Vec<Term>)| {
        let mut forces = vec![0.0; dofs.len()];
        for node in dofs.masters() {
            let x = positions[node];
            let r = [0, 1, 2, ONE].map(|i| if i == ONE { 1.0 } else { (x[i] - centre[i]) / extent });
            for Term { component, factors: [i, j], sign } in &terms {
                match dofs.free(node)[*component] {
                    FIXED => {}
                    dof => forces[dof as usize] += sign * r[*i] * r[*j],
                }
            }
        }
        let degree = terms[0].factors.iter().filter(|&&factor| factor != ONE).count();
        Field { name, degree, forces }
    };
    polynomials(dofs.dimension()).into_iter().map(on_nodes).collect()
}

/// Names and terms of all fields.
fn polynomials(dimension: usize) -> Vec<(String, Vec<Term>)> {
    let term = |component, factors, sign| Term { component, factors, sign };
    let axes = || 0..dimension;
    let pairs: Vec<[usize; 2]> = axes().flat_map(|a| (a + 1..dimension).map(move |b| [a, b])).collect();
    let mut fields: Vec<(String, Vec<Term>)> =
        axes().map(|a| (format!("pull along {}", AXES[a]), vec![term(a, [ONE; 2], 1.0)])).collect();
    for about in if dimension == 3 { 0..3 } else { 2..3 } {
        let [a, b] = [(about + 1) % 3, (about + 2) % 3];
        let turns = vec![term(b, [a, ONE], 1.0), term(a, [b, ONE], -1.0)];
        fields.push((format!("twist about {}", AXES[about]), turns));
    }
    fields.extend(axes().map(|a| (format!("stretch along {}", AXES[a]), vec![term(a, [a, ONE], 1.0)])));
    fields.extend(pairs.iter().map(|&[a, b]| {
        let shears = vec![term(a, [b, ONE], 1.0), term(b, [a, ONE], 1.0)];
        (format!("shear in {}{}", AXES[a], AXES[b]), shears)
    }));
    let squares = axes().map(|b| [b, b]).chain(pairs.iter().copied()).collect::<Vec<_>>();
    for a in axes() {
        fields.extend(squares.iter().map(|&[b, c]| {
            let growing = if b == c { format!("{}^2", AXES[b]) } else { format!("{}*{}", AXES[b], AXES[c]) };
            (format!("{}-force growing with {growing}", AXES[a]), vec![term(a, [b, c], 1.0)])
        }));
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fields_are_as_many_as_polynomials_of_degree_2_and_follow_their_formulas() {
        let positions: Vec<[f64; 3]> = (0..27).map(|n| [n / 9, n / 3 % 3, n % 3].map(|i: usize| i as f64)).collect();
        let mut fixed = vec![[false; 3]; 27];
        fixed[26][0] = true;
        let dofs = DofMap::untied(3, &fixed);
        let fields = polynomial_loads(&positions, &dofs);
        assert_eq!(fields.len(), 3 * 10);
        // node 26 at r = (.5, .5, .5), held in x
        let at_corner = |name: &str| {
            let field = fields.iter().find(|field| field.name == name).expect(name);
            dofs.free(26)[1..].iter().map(|&dof| field.forces[dof as usize]).collect::<Vec<f64>>()
        };
        assert_eq!(at_corner("pull along y"), [1.0, 0.0]);
        assert_eq!(at_corner("twist about z"), [0.5, 0.0]);
        assert_eq!(at_corner("twist about x"), [-0.5, 0.5]);
        assert_eq!(at_corner("shear in yz"), [0.5, 0.5]);
        assert_eq!(at_corner("z-force growing with x*y"), [0.0, 0.25]);
        assert!(fields.iter().all(|field| field.forces.len() == 80));
        assert_eq!([0, 1, 2].map(|degree| fields.iter().filter(|field| field.degree == degree).count()), [3, 9, 18]);
        assert!(fields.is_sorted_by_key(|field| field.degree));
        assert_eq!(polynomials(2).len(), 2 * 6);
    }
}
