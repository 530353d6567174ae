//! Displacement and stress at a place of the body.

use crate::geometry::patch::Patch;
use crate::reference::material::Lame;
use crate::reference::points::{ElementPoints, displacement_gradient};

/// Displacement (m) and stress (Pa) at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// The place in m.
    pub position: [f64; 3],
    /// u = sum_a N_a u_a.
    pub displacement: [f64; 3],
    /// du_i/dx_j.
    pub gradient: [[f64; 3]; 3],
    /// sigma = lambda tr(e) 1 + 2 mu e; in two dimensions its in-plane components.
    pub stress: [[f64; 3]; 3],
}

/// The state at parametric coordinates `xi` of a patch whose control points move by `displacement` (n x 3, in m).
///
/// Where the map degenerates (det dx/dxi = 0, a collapsed edge) gradient and stress are zero: look beside it.
pub fn at(patch: &Patch, lame: Lame, displacement: &[[f64; 3]], xi: [f64; 3]) -> State {
    let mut span = [0; 3];
    for (a, span) in span.iter_mut().enumerate().take(patch.dimension()) {
        *span = patch.knots(a).find_span(xi[a]);
    }
    let (mut shape, mut acting) = (patch.workspace(), Vec::new());
    patch.shape_functions(span, xi, &mut shape);
    patch.element_nodes(span, &mut acting);
    let mut moved = [0.0; 3];
    for (&node, value) in acting.iter().zip(&shape.values) {
        (0..3).for_each(|i| moved[i] += value * displacement[node as usize][i]);
    }
    let gradient = displacement_gradient(&acting, &shape.gradients, displacement);
    State { position: shape.point, displacement: moved, gradient, stress: lame.stress(&gradient) }
}

/// Stress (Pa) at every integration point of an element whose acting nodes move by `displacement` (n x 3, in m).
///
/// Where the change of volume comes from mean gradients, so does the pressure.
pub fn in_element(filled: &ElementPoints, acting: &[u32], lame: Lame, displacement: &[[f64; 3]]) -> Vec<[[f64; 3]; 3]> {
    let mean = filled.mean_trace(acting, displacement);
    let at = |gradients: &[[f64; 3]]| {
        let gradient = displacement_gradient(acting, gradients, displacement);
        let mut stress = lame.stress(&gradient);
        if let Some(mean) = mean {
            let trace = gradient[0][0] + gradient[1][1] + gradient[2][2];
            (0..3).for_each(|i| stress[i][i] += lame.volumetric() * (mean - trace));
        }
        stress
    };
    filled.gradients.chunks_exact(acting.len().max(1)).map(at).collect()
}
