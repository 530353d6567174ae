//! Finite elements: every cell of a mesh carries its own linear shape functions.
//!
//! T3 and T4 are linear on triangles and tetrahedra, Q4 and B8 bilinear and trilinear on quadrilaterals and hexahedra. A
//! cell maps its reference cell by x = sum_a N_a x_a; at Gauss point q
//!
//! ```text
//!     J = dx/dxi = sum_a x_a (dN_a/dxi)^T,   dN_a/dx = J^-T dN_a/dxi,   v_q = w_q det J  (times the thickness in 2D)
//! ```
//!
//! (thesis section 2.4; shape functions and w_q in [`super::cell_rules`]). A determinant that is not positive at a Gauss
//! point is a folded cell and an error; corners are numbered as [`crate::geometry::mesh`] says.
//!
//! Near nu = 1/2 these elements lock. B-bar (Hughes 1980) lets only the mean change of volume of an element cost energy:
//! see [`crate::reference::points`] and [`crate::reference::stiffness`].

use crate::error::{Error, Result};
use crate::geometry::mesh::{CellKind, Mesh};
use crate::geometry::patch::invert;
use crate::reference::points::{ElementPoints, IntegrationPoints};

use super::cell_rules::CellRule;

/// The four kinds, in the order of their rules.
const KINDS: [CellKind; 4] = [CellKind::Triangle, CellKind::Quadrilateral, CellKind::Tetrahedron, CellKind::Hexahedron];

/// Fully integrated elements on every cell of a mesh; `thickness` in m multiplies volumes in two dimensions.
///
/// # Errors
/// None; smoothed methods on the same table have some.
pub fn integration_points(mesh: &Mesh, thickness: f64) -> Result<IntegrationPoints<'_>> {
    Ok(by_rules(mesh, KINDS.map(CellRule::of_stiffness), thickness))
}

/// The same elements with `count` Gauss points in each direction of quadrilaterals and hexahedra: distorted cells are then
/// integrated more exactly, and are a little stiffer.
pub fn with_gauss_points(mesh: &Mesh, count: usize, thickness: f64) -> IntegrationPoints<'_> {
    by_rules(mesh, KINDS.map(|kind| CellRule::gauss(kind, count)), thickness)
}

fn by_rules(mesh: &Mesh, rules: [CellRule; 4], thickness: f64) -> IntegrationPoints<'_> {
    let thickness = if mesh.dimension() == 2 { thickness } else { 1.0 };
    let acting = (0..mesh.cells()).map(|cell| mesh.corners(cell).to_vec()).collect();
    let filled_by = |rules: [CellRule; 4]| {
        move |cell: usize, out: &mut ElementPoints| fill(mesh, &rules[mesh.kind(cell) as usize], cell, thickness, out)
    };
    let mass = Box::new(filled_by(KINDS.map(CellRule::of_mass)));
    let stiffness = Box::new(filled_by(rules));
    IntegrationPoints::new(mesh.dimension(), mesh.positions().len(), thickness, acting, stiffness)
        .with_mass_points(mass)
}

/// The same elements with B-bar: the change of volume is taken from the mean gradients of the element.
///
/// # Errors
/// As [`integration_points`].
pub fn with_mean_dilatation(mesh: &Mesh, thickness: f64) -> Result<IntegrationPoints<'_>> {
    Ok(integration_points(mesh, thickness)?.with_mean_dilatation())
}

/// Fills the points of one cell.
fn fill(mesh: &Mesh, rule: &CellRule, cell: usize, thickness: f64, out: &mut ElementPoints) -> Result<()> {
    out.clear();
    let corners = mesh.corners(cell);
    let at_points = rule.points.iter().zip(&rule.weights);
    let shapes = rule.values.chunks_exact(corners.len()).zip(rule.slopes.chunks_exact(corners.len()));
    for ((point, weight), (values, slopes)) in at_points.zip(shapes) {
        let (position, jacobian) = map(mesh, corners, values, slopes);
        let (inverse, determinant) = invert(&jacobian);
        if determinant.is_nan() || determinant <= 0.0 {
            let point = point[..mesh.dimension()].to_vec();
            return Err(Error::FoldedElement { element: vec![cell], point, determinant });
        }
        out.volumes.push(weight * determinant * thickness);
        out.positions.push(position);
        out.values.extend_from_slice(values);
        out.gradients.extend(slopes.iter().map(|slope| {
            [0, 1, 2].map(|a| slope[0] * inverse[0][a] + slope[1] * inverse[1][a] + slope[2] * inverse[2][a])
        }));
    }
    Ok(())
}

/// The place and dx/dxi at one point; in two dimensions dx_3/dxi_3 = 1.
fn map(mesh: &Mesh, corners: &[u32], values: &[f64], slopes: &[[f64; 3]]) -> ([f64; 3], [[f64; 3]; 3]) {
    let (mut position, mut jacobian) = ([0.0; 3], [[0.0; 3]; 3]);
    for ((&node, value), slope) in corners.iter().zip(values).zip(slopes) {
        let x = mesh.positions()[node as usize];
        for a in 0..3 {
            position[a] += value * x[a];
            (0..3).for_each(|b| jacobian[a][b] += x[a] * slope[b]);
        }
    }
    if mesh.dimension() == 2 {
        jacobian[2] = [0.0, 0.0, 1.0];
    }
    (position, jacobian)
}
