//! Isogeometric analysis: the splines that describe the body also carry its displacement.
//!
//! Elements are the non-empty knot spans (thesis 2.26-2.27). A span has degree + 1 + extra Gauss points in each
//! direction; point q stands for the volume v_q = w_q |det dx/dxi| (times the thickness in two dimensions). On rational
//! patches no such rule is exact: with extra = 0, the rule of the thesis, forces inside a body under constant stress
//! are out of balance by about 1e-5, with extra = 4 by less than 1e-13.
//!
//! A patch whose axes are left-handed has det dx/dxi < 0 everywhere: that is only a matter of naming, the volume is
//! taken positive and a warning says so. A determinant that vanishes at a Gauss point or changes sign between them is
//! a fold and an error.

use crate::error::{Error, Result};
use crate::geometry::patch::Patch;
use crate::reference::points::{ElementPoints, IntegrationPoints};
use crate::reference::quadrature::TensorRule;

/// The integration points of a patch with `extra` Gauss points beyond degree + 1 in each direction.
///
/// `thickness` in m multiplies volumes in two dimensions and is not looked at in three. Folds are found when the points
/// are filled.
pub fn integration_points(patch: &Patch, extra: usize, thickness: f64) -> IntegrationPoints<'_> {
    let spans = patch.elements();
    let acting = spans
        .iter()
        .map(|&span| {
            let mut nodes = Vec::new();
            patch.element_nodes(span, &mut nodes);
            nodes
        })
        .collect();
    let orientation = orientation(patch);
    let thickness = if patch.dimension() == 2 { thickness } else { 1.0 };
    let rule = TensorRule::of_spans(patch, extra);
    let fill = move |e: usize, out: &mut ElementPoints| fill(patch, &rule, spans[e], orientation * thickness, out);
    let points = IntegrationPoints::new(patch.dimension(), patch.points().len(), thickness, acting, Box::new(fill))
        .of_patch(patch, extra);
    match orientation < 0.0 {
        true => points.with_warning(
            "the patch is left-handed (det dx/dxi < 0 everywhere): volumes are taken positive".to_owned(),
        ),
        false => points,
    }
}

/// Fills the points of one span; `scale` is the orientation times the thickness.
fn fill(patch: &Patch, rule: &TensorRule, span: [usize; 3], scale: f64, out: &mut ElementPoints) -> Result<()> {
    out.clear();
    let shape = out.shape.get_or_insert_with(|| patch.workspace());
    let (start, end) = patch.element_bounds(span);
    for (xi, weight) in rule.points(start, end) {
        patch.shape_functions(span, xi, shape);
        let volume = weight * scale * shape.determinant;
        if volume.is_nan() || volume <= 0.0 {
            return Err(Error::FoldedElement {
                element: span[..patch.dimension()].to_vec(),
                point: xi[..patch.dimension()].to_vec(),
                determinant: shape.determinant,
            });
        }
        out.volumes.push(volume);
        out.positions.push(shape.point);
        out.values.extend_from_slice(&shape.values);
        out.gradients.extend_from_slice(&shape.gradients);
    }
    Ok(())
}

/// Span centres that are looked at to find the orientation, about.
const CENTRES: usize = 4096;

/// 1 for a right-handed patch, -1 for a left-handed one: the sign of the sum of det dx/dxi over span centres, every k-th
/// of a fine mesh.
pub fn orientation(patch: &Patch) -> f64 {
    let mut shape = patch.workspace();
    let elements = patch.elements();
    let sum: f64 = elements
        .iter()
        .copied()
        .step_by(elements.len() / CENTRES + 1)
        .map(|span| {
            let (start, end) = patch.element_bounds(span);
            patch.shape_functions(span, [0, 1, 2].map(|a| 0.5 * (start[a] + end[a])), &mut shape);
            let size: f64 = (0..patch.dimension()).map(|a| end[a] - start[a]).product();
            shape.determinant * size
        })
        .sum();
    if sum < 0.0 { -1.0 } else { 1.0 }
}
