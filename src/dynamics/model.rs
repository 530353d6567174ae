//! What an integrator sees of a body that moves.
//!
//! The equation of motion over the n free degrees of freedom (thesis 3.1 to 3.6) is
//!
//! ```text
//! M a + f_int(u, v) = f_ext(t),     f_int = elastic force + damping force
//! ```
//!
//! u in m, v in m/s, forces in N, masses in kg. A linear body has f_int = K u + C v; springs and corotational elements
//! have an elastic force that turns with the body, whose derivatives are the tangents K = df_int/du, C = df_int/dv.

use crate::sparse::pattern::Pattern;

/// A body that can move. One worker's: it may keep a workspace, or the rotations of the last step.
pub trait Model {
    /// Number n of free degrees of freedom.
    fn unknowns(&self) -> usize;

    /// Lumped mass of every unknown in kg, length n.
    fn masses(&self) -> &[f64];

    /// Elastic energy in J at the displacement u (length n).
    fn elastic_energy(&mut self, u: &[f64]) -> f64;

    /// out = f_int(u, v) in N; all of length n.
    fn internal_force(&mut self, u: &[f64], v: &[f64], out: &mut [f64]);

    /// Power in W that the damping takes at (u, v): v . (f_int(u, v) - f_int(u, 0)).
    ///
    /// As written here it costs two force evaluations and allocates; a model that is stepped often has its own.
    fn dissipated_power(&mut self, u: &[f64], v: &[f64]) -> f64 {
        let still = vec![0.0; v.len()];
        let (mut moving, mut resting) = (still.clone(), still.clone());
        self.internal_force(u, v, &mut moving);
        self.internal_force(u, &still, &mut resting);
        v.iter().zip(moving.iter().zip(&resting)).map(|(v, (f, g))| v * (f - g)).sum()
    }

    /// The node that an unknown belongs to, in any numbering: unknowns of one node stand together. As written here every
    /// unknown is a node of its own.
    fn node(&self, unknown: usize) -> usize {
        unknown
    }

    /// The entries that the tangents can have, both triangles.
    fn pattern(&self) -> &Pattern;

    /// Writes K = df_int/du in N/m and C = df_int/dv in N s/m at (u, v), on the pattern. Both symmetric: what is not
    /// symmetric in df_int/du (a damping force that turns with the body) is left out, and Newton's method corrects it.
    fn tangent(&mut self, u: &[f64], v: &[f64], stiffness: &mut [f64], damping: &mut [f64]);

    /// Force in N that rounding leaves on a body at rest: what Newton's method cannot balance.
    fn rounding(&self) -> f64 {
        0.0
    }

    /// True when f_int is linear: one factorisation then serves a whole run.
    fn is_linear(&self) -> bool;
}
