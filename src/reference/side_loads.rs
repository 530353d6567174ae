//! Tractions on the sides of a mesh: the edges of plane cells, the triangles and quadrilaterals of solid ones.
//!
//! A side carries the shape functions of its corners, so that the consistent nodal forces of a traction t are
//!
//! ```text
//!     f_a = sum_q w_q |a_q| N_a t(x_q, n_q),      a = dx/dxi_1 x dx/dxi_2,   n = a / |a|
//! ```
//!
//! in two dimensions with the edge's tangent for the first factor and the thickness along z for the second. Two Gauss
//! points a direction on edges and quadrilaterals and three on triangles are exact for a constant traction, and for a linear
//! one on flat sides. Corners stand counter-clockwise as seen from outside ([`crate::geometry::mesh`]), so n looks outward.

use crate::error::Result;
use crate::geometry::dofs::DofMap;
use crate::geometry::mesh::{CellKind, Mesh};
use crate::reference::loads::{Load, nodal, spread};
use crate::reference::methods::cell_rules::CellRule;

/// A traction `value(x, n)` in Pa at place x with outward unit normal n on `sides`, each given by its corners; a pressure p
/// is `-p n`. `thickness` in m is looked at in two dimensions only.
///
/// # Errors
/// Those of [`nodal`].
///
/// # Panics
/// When a side has not 2 corners in two dimensions, 3 or 4 in three.
pub fn traction<'a>(
    mesh: &Mesh,
    sides: impl IntoIterator<Item = &'a [u32]>,
    thickness: f64,
    dofs: &DofMap,
    value: &dyn Fn([f64; 3], [f64; 3]) -> [f64; 3],
) -> Result<Load> {
    let [triangle, quadrilateral] = [CellKind::Triangle, CellKind::Quadrilateral].map(CellRule::of_mass);
    let mut sums = vec![[0.0; 3]; mesh.positions().len()];
    for corners in sides {
        let points: Vec<SidePoint> = match (mesh.dimension(), corners.len()) {
            (2, 2) => edge(mesh, corners, thickness),
            (3, 3) => surface(mesh, corners, &triangle),
            (3, 4) => surface(mesh, corners, &quadrilateral),
            (dimension, count) => panic!("a side with {count} corners in {dimension} dimensions"),
        };
        for SidePoint { position, area, values } in points {
            let size = area.iter().map(|a| a * a).sum::<f64>().sqrt();
            if size > 0.0 {
                let force = value(position, area.map(|a| a / size)).map(|t| t * size);
                spread(&mut sums, corners, &values, force);
            }
        }
    }
    nodal(dofs, &sums)
}

/// A Gauss point of a side: its place, outward area vector (m^2) and shape functions.
struct SidePoint {
    position: [f64; 3],
    area: [f64; 3],
    values: Vec<f64>,
}

/// Two Gauss points of an edge in the plane, body to its left.
fn edge(mesh: &Mesh, corners: &[u32], thickness: f64) -> Vec<SidePoint> {
    let [a, b] = [0, 1].map(|corner| mesh.positions()[corners[corner] as usize]);
    let half = 0.5 * thickness;
    let area = [half * (b[1] - a[1]), -half * (b[0] - a[0]), 0.0];
    let near = 0.5 - 0.5 / 3.0_f64.sqrt();
    let point = |share: f64| {
        let position = [0, 1, 2].map(|i| (1.0 - share) * a[i] + share * b[i]);
        SidePoint { position, area, values: vec![1.0 - share, share] }
    };
    vec![point(near), point(1.0 - near)]
}

/// The points of a triangle or quadrilateral in space.
fn surface(mesh: &Mesh, corners: &[u32], rule: &CellRule) -> Vec<SidePoint> {
    let shapes = rule.values.chunks_exact(corners.len()).zip(rule.slopes.chunks_exact(corners.len()));
    let at = |(weight, (values, slopes)): (&f64, (&[f64], &[[f64; 3]]))| {
        let (mut position, mut tangents) = ([0.0; 3], [[0.0; 3]; 2]);
        for ((&node, value), slope) in corners.iter().zip(values).zip(slopes) {
            let x = mesh.positions()[node as usize];
            for i in 0..3 {
                position[i] += value * x[i];
                tangents[0][i] += slope[0] * x[i];
                tangents[1][i] += slope[1] * x[i];
            }
        }
        let [t, s] = tangents;
        let area = [t[1] * s[2] - t[2] * s[1], t[2] * s[0] - t[0] * s[2], t[0] * s[1] - t[1] * s[0]];
        SidePoint { position, area: area.map(|a| weight * a), values: values.to_vec() }
    };
    rule.weights.iter().zip(shapes).map(at).collect()
}
