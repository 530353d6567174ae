//! Loads: forces on the nodes.
//!
//! The thesis puts a given force on every free control point ([`per_node`]). A traction t on a face or a body force b
//! acts through the shape functions, so that the work is right for every displacement the method can represent
//! (consistent nodal forces):
//!
//! ```text
//!     f_a = integral over the face of N_a t dA        f_a = integral over the body of N_a b dV
//! ```
//!
//! Forces in N, tractions in Pa, body forces in N/m^3; in two dimensions areas and volumes contain the thickness.
//! Forces on held components go straight into the support: they are left out of the vector and reported.

use crate::error::{Error, Result};
use crate::geometry::dofs::{DofMap, FIXED};
use crate::geometry::patch::Patch;
use crate::geometry::selection::{face_elements, parse_face};
use crate::reference::methods::nurbs;
use crate::reference::points::{ElementPoints, IntegrationPoints};
use crate::reference::quadrature::TensorRule;

/// One load case as the solver sees it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Load {
    /// Force on each free degree of freedom in N.
    pub forces: Vec<f64>,
    /// Sum of the forces that act on the free degrees of freedom, in N.
    pub total: [f64; 3],
    /// Sum of the forces that a support takes at once, in N.
    pub held: [f64; 3],
    /// The nodes at which it takes them, ascending; what is rounding beside the largest force is none.
    pub held_nodes: Vec<u32>,
    /// The largest of its components that a support takes at once at one node, in N.
    pub held_most: f64,
}

/// Forces below this fraction of the largest are rounding.
const ROUNDING: f64 = 1e-14;

/// A load from one force for each node (N, n x 3). Forces on tied nodes add up.
///
/// # Errors
/// [`Error::Input`] at `load` when a force is not finite, or when nothing acts on a free degree of freedom.
///
/// # Panics
/// When there is not one force for each node.
pub fn nodal(dofs: &DofMap, forces: &[[f64; 3]]) -> Result<Load> {
    assert_eq!(forces.len(), dofs.nodes(), "one force for each node");
    let mut load = Load { forces: vec![0.0; dofs.len()], ..Load::default() };
    let least = ROUNDING * forces.iter().flatten().fold(0.0, |most: f64, f| most.max(f.abs()));
    for (node, force) in forces.iter().enumerate() {
        if !force.iter().all(|f| f.is_finite()) {
            let message = format!("the force {force:?} on node {node} is not finite");
            return Err(Error::input("load", message, "finite numbers in newton"));
        }
        for (i, &dof) in dofs.free(node).iter().enumerate() {
            if dof == FIXED {
                load.held[i] += force[i];
                load.held_most = load.held_most.max(force[i].abs());
                if force[i].abs() > least && load.held_nodes.last() != Some(&(node as u32)) {
                    load.held_nodes.push(node as u32);
                }
            } else {
                load.forces[dof as usize] += force[i];
                load.total[i] += force[i];
            }
        }
    }
    match load.forces.iter().any(|&f| f != 0.0) {
        true => Ok(load),
        false => Err(Error::input(
            "load",
            format!("acts on no free node (the supports take {:?} N)", load.held),
            "a force other than zero on at least one node that is not held",
        )),
    }
}

impl Load {
    /// The force in N by which the supports hold the body: what balances all forces, those they take at once included.
    pub fn reaction(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| -(self.total[i] + self.held[i]))
    }

    /// The same load times `factor`.
    pub fn scale(&mut self, factor: f64) {
        self.forces.iter_mut().for_each(|f| *f *= factor);
        self.total = self.total.map(|f| f * factor);
        self.held = self.held.map(|f| f * factor);
        self.held_most *= factor.abs();
    }
}

/// A force (N) shared equally by the nodes of a set that can move; tied points count once.
///
/// # Errors
/// Those of [`nodal`]: when no node of the set can move.
pub fn shared(dofs: &DofMap, nodes: &[u32], force: [f64; 3]) -> Result<Load> {
    let mut masters: Vec<usize> = nodes.iter().map(|&node| dofs.master(node as usize)).collect();
    masters.sort_unstable();
    masters.dedup();
    masters.retain(|&node| dofs.free(node).iter().any(|&dof| dof != FIXED));
    let mut forces = vec![[0.0; 3]; dofs.nodes()];
    for &node in &masters {
        forces[node] = force.map(|f| f / masters.len() as f64);
    }
    nodal(dofs, &forces)
}

/// The load of the thesis: the same force (N) on every control point that can move, tied points once.
///
/// # Errors
/// Those of [`nodal`].
pub fn per_node(dofs: &DofMap, force: [f64; 3]) -> Result<Load> {
    let mut forces = vec![[0.0; 3]; dofs.nodes()];
    for node in dofs.masters() {
        for (i, &dof) in dofs.free(node).iter().enumerate() {
            // what a support would take at once is left out: the thesis loads free control points only
            if dof != FIXED {
                forces[node][i] = force[i];
            }
        }
    }
    nodal(dofs, &forces)
}

/// A force (N) on one node.
///
/// # Errors
/// [`Error::Input`] at `load` when there is no such node; those of [`nodal`].
pub fn point(dofs: &DofMap, node: usize, force: [f64; 3]) -> Result<Load> {
    if node >= dofs.nodes() {
        let message = format!("there is no node {node}");
        return Err(Error::input("load", message, format!("a node from 0 to {}", dofs.nodes().saturating_sub(1))));
    }
    let mut forces = vec![[0.0; 3]; dofs.nodes()];
    forces[node] = force;
    nodal(dofs, &forces)
}

/// A force per volume `density(x)` in N/m^3 at place x; weight is `density * g` in the direction of gravity.
///
/// # Errors
/// Those of [`nodal`] and of [`IntegrationPoints::fill`].
pub fn body_force(points: &IntegrationPoints, dofs: &DofMap, density: &dyn Fn([f64; 3]) -> [f64; 3]) -> Result<Load> {
    let points = points.of_body();
    let mut filled = ElementPoints::default();
    let mut sums = vec![[0.0; 3]; points.nodes()];
    for e in 0..points.elements() {
        points.fill(e, &mut filled)?;
        let acting = points.acting(e);
        for (q, values) in filled.values.chunks_exact(acting.len().max(1)).enumerate() {
            let force = density(filled.positions[q]).map(|b| b * filled.volumes[q]);
            spread(&mut sums, acting, values, force);
        }
    }
    nodal(dofs, &sums)
}

/// Where a traction acts, and how finely it is integrated.
#[derive(Debug, Clone, Copy)]
pub struct Face<'a> {
    /// The body.
    pub patch: &'a Patch,
    /// "x-", "x+", ..., "z+": first or last plane of a grid direction.
    pub name: &'a str,
    /// Thickness in m in two dimensions; 1 otherwise.
    pub thickness: f64,
    /// Gauss points beyond degree + 1 in each direction of the face.
    pub extra_points: usize,
}

/// A traction `value(x, n)` in Pa at place x with outward unit normal n; a pressure p is `-p n`.
///
/// # Errors
/// Those of [`nodal`]; [`Error::Input`] for a face that the patch does not have.
pub fn traction(face: Face, dofs: &DofMap, value: &dyn Fn([f64; 3], [f64; 3]) -> [f64; 3]) -> Result<Load> {
    let patch = face.patch;
    let (direction, at_end) = parse_face(patch.dimension(), face.name).map_err(at_load)?;
    let outward = nurbs::orientation(patch) * if at_end { 1.0 } else { -1.0 };
    let rule = TensorRule::of_face(patch, face.extra_points, direction, at_end);
    let mut shape = patch.workspace();
    let (mut acting, mut sums) = (Vec::new(), vec![[0.0; 3]; dofs.nodes()]);
    for span in face_elements(patch, face.name)? {
        patch.element_nodes(span, &mut acting);
        let (start, end) = patch.element_bounds(span);
        for (xi, weight) in rule.points(start, end) {
            patch.shape_functions(span, xi, &mut shape);
            let area = area_vector(&shape.jacobian, patch.dimension(), direction);
            let size = area.iter().map(|a| a * a).sum::<f64>().sqrt();
            if size == 0.0 {
                continue; // a collapsed edge has no area and no normal
            }
            let traction = value(shape.point, area.map(|a| outward * a / size));
            let force = traction.map(|t| t * size * weight * face.thickness);
            spread(&mut sums, &acting, &shape.values, force);
        }
    }
    nodal(dofs, &sums)
}

/// The same error at the key of the load.
fn at_load(error: Error) -> Error {
    match error {
        Error::Input { message, help, .. } => Error::input("load", message, help),
        other => other,
    }
}

/// The area that a unit of parameter area of the face xi_a = constant covers, as a vector along its normal:
/// dx/dxi_b x dx/dxi_c with (a, b, c) cyclic. In two dimensions the missing tangent is the unit vector along z.
fn area_vector(jacobian: &[[f64; 3]; 3], dimension: usize, direction: usize) -> [f64; 3] {
    let tangent = |a: usize| match a == 2 && dimension == 2 {
        true => [0.0, 0.0, 1.0],
        false => [jacobian[0][a], jacobian[1][a], jacobian[2][a]],
    };
    let (t, s) = (tangent((direction + 1) % 3), tangent((direction + 2) % 3));
    [t[1] * s[2] - t[2] * s[1], t[2] * s[0] - t[0] * s[2], t[0] * s[1] - t[1] * s[0]]
}

/// Gives each acting node its share N_a of a force.
pub(super) fn spread(forces: &mut [[f64; 3]], acting: &[u32], values: &[f64], force: [f64; 3]) {
    for (&node, value) in acting.iter().zip(values) {
        (0..3).for_each(|i| forces[node as usize][i] += value * force[i]);
    }
}
