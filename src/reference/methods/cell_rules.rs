//! Shape functions and Gauss points of the linear cells.
//!
//! Quadrilaterals and hexahedra live on [-1, 1]^d, with the corner a at (s_a1, .., s_ad), s = +-1:
//!
//! ```text
//!     N_a = prod_i (1 + s_ai xi_i) / 2,      dN_a/dxi_i = s_ai / 2  prod_(j != i) (1 + s_aj xi_j) / 2
//! ```
//!
//! Triangles and tetrahedra live on xi_i >= 0, sum xi_i <= 1, with N_0 = 1 - sum xi_i and N_i = xi_i.
//!
//! For the stiffness 2 points a direction are the least that leave no free mode beyond the rigid ones; simplices have
//! constant gradients and need one point. The mass asks for N_a N_b: simplices get the rules of degree 2 with 3 and 4
//! points (any book on finite elements; Strang and Fix, section 4.3), the others keep theirs.

use crate::geometry::gauss::gauss_legendre;
use crate::geometry::mesh::CellKind;

/// Points of a reference cell with all that does not depend on where its corners are.
#[derive(Debug, Clone)]
pub struct CellRule {
    /// Places in the reference cell.
    pub points: Vec<[f64; 3]>,
    /// Weights; they add up to the measure of the reference cell.
    pub weights: Vec<f64>,
    /// Shape functions: point q, corner a at `q * corners + a`.
    pub values: Vec<f64>,
    /// dN_a/dxi, stored like the values; zero in missing directions.
    pub slopes: Vec<[f64; 3]>,
}

/// Gauss points a direction that leave no free mode beyond the rigid ones.
const LEAST: usize = 2;

/// Signs of the corners of a hexahedron; the first four, without the third, are those of a quadrilateral.
const SIGNS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

impl CellRule {
    /// The rule of the stiffness.
    pub fn of_stiffness(kind: CellKind) -> Self {
        Self::gauss(kind, LEAST)
    }

    /// Gauss points for the stiffness, `count` in each direction of a quadrilateral or hexahedron; one in a simplex.
    pub fn gauss(kind: CellKind, count: usize) -> Self {
        match kind {
            CellKind::Triangle => Self::new(kind, vec![[1.0 / 3.0, 1.0 / 3.0, 0.0]], vec![0.5]),
            CellKind::Tetrahedron => Self::new(kind, vec![[0.25; 3]], vec![1.0 / 6.0]),
            CellKind::Quadrilateral | CellKind::Hexahedron => Self::product(kind, count),
        }
    }

    /// The rule of the mass: N_a N_b is integrated exactly on simplices, parallelograms and parallelepipeds.
    pub fn of_mass(kind: CellKind) -> Self {
        let [near, far] = [(5.0 - 5.0_f64.sqrt()) / 20.0, (5.0 + 3.0 * 5.0_f64.sqrt()) / 20.0];
        match kind {
            CellKind::Triangle => {
                let (near, far) = (1.0 / 6.0, 2.0 / 3.0);
                Self::new(kind, vec![[near, near, 0.0], [far, near, 0.0], [near, far, 0.0]], vec![1.0 / 6.0; 3])
            }
            CellKind::Tetrahedron => {
                let one_far = |axis: usize| [0, 1, 2].map(|a| if a == axis { far } else { near });
                Self::new(kind, [3, 0, 1, 2].map(one_far).to_vec(), vec![1.0 / 24.0; 4])
            }
            CellKind::Quadrilateral | CellKind::Hexahedron => Self::product(kind, LEAST),
        }
    }

    /// The product of one-dimensional rules of `count` points, the last direction fastest.
    fn product(kind: CellKind, count: usize) -> Self {
        let d = kind.dimension();
        let (places, shares) = gauss_legendre(count);
        let index = |q: usize, a: usize| q / count.pow((d - 1 - a) as u32) % count;
        let all = 0..count.pow(d as u32);
        let place = |q: usize| [0, 1, 2].map(|a| if a < d { places[index(q, a)] } else { 0.0 });
        let weights = all.clone().map(|q| (0..d).map(|a| shares[index(q, a)]).product()).collect();
        Self::new(kind, all.map(place).collect(), weights)
    }

    /// Points and weights with the shape functions there.
    fn new(kind: CellKind, points: Vec<[f64; 3]>, weights: Vec<f64>) -> Self {
        let (mut values, mut slopes) = (Vec::new(), Vec::new());
        for &xi in &points {
            for corner in 0..kind.corners() {
                let (value, slope) = shape_function(kind, corner, xi);
                values.push(value);
                slopes.push(slope);
            }
        }
        Self { points, weights, values, slopes }
    }
}

/// N_a and dN_a/dxi of one corner at a place of the reference cell.
pub fn shape_function(kind: CellKind, corner: usize, xi: [f64; 3]) -> (f64, [f64; 3]) {
    let d = kind.dimension();
    match kind {
        CellKind::Triangle | CellKind::Tetrahedron => match corner.checked_sub(1) {
            None => (1.0 - xi[..d].iter().sum::<f64>(), [0, 1, 2].map(|a| if a < d { -1.0 } else { 0.0 })),
            Some(axis) => (xi[axis], [0, 1, 2].map(|a| if a == axis { 1.0 } else { 0.0 })),
        },
        CellKind::Quadrilateral | CellKind::Hexahedron => {
            let factor = |a: usize| if a < d { 0.5 * (1.0 + SIGNS[corner][a] * xi[a]) } else { 1.0 };
            let slope = |a: usize| {
                if a < d { 0.5 * SIGNS[corner][a] * factor((a + 1) % 3) * factor((a + 2) % 3) } else { 0.0 }
            };
            (factor(0) * factor(1) * factor(2), [0, 1, 2].map(slope))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [CellKind; 4] =
        [CellKind::Triangle, CellKind::Quadrilateral, CellKind::Tetrahedron, CellKind::Hexahedron];

    #[test]
    fn shape_functions_add_up_to_one_and_slopes_to_zero() {
        for (kind, rule) in
            KINDS.into_iter().flat_map(|k| [CellRule::of_stiffness(k), CellRule::of_mass(k)].map(|r| (k, r)))
        {
            for (values, slopes) in rule.values.chunks(kind.corners()).zip(rule.slopes.chunks(kind.corners())) {
                assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-15);
                assert!((0..3).all(|a| slopes.iter().map(|slope| slope[a]).sum::<f64>().abs() < 1e-15));
            }
        }
    }

    /// int N_a N_b over the reference cell: m/12 (1 + delta) and m/20 (1 + delta) on simplices (times d! measure m),
    /// (2/3, 1/3)^d on the others.
    #[test]
    fn mass_rules_are_exact() {
        for kind in KINDS {
            let (rule, n) = (CellRule::of_mass(kind), kind.corners());
            for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
                let sum: f64 =
                    rule.weights.iter().zip(rule.values.chunks(n)).map(|(w, values)| w * values[a] * values[b]).sum();
                let equal = if a == b { 2.0 } else { 1.0 };
                let exact = match kind {
                    CellKind::Triangle => equal / 24.0,
                    CellKind::Tetrahedron => equal / 120.0,
                    _ => (0..kind.dimension())
                        .map(|i| if SIGNS[a][i] == SIGNS[b][i] { 2.0 / 3.0 } else { 1.0 / 3.0 })
                        .product(),
                };
                assert!((sum - exact).abs() < 1e-15, "{kind:?} {a} {b}: {sum} instead of {exact}");
            }
        }
    }
}
