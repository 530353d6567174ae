//! How far each method locks when the material hardly changes its volume, measured.
//!
//! As nu goes to 1/2 a body keeps its volume, tr(e) = 0, wherever its stiffness asks for it. Where that is more than the
//! shape functions can do, the method *locks*: its displacement u_h falls behind the true one, u. Kept with every method
//! is what it loses beyond what its mesh costs at nu = 0.3 already:
//!
//! ```text
//!     loss(nu) = 1 - [u_h(nu) / u(nu)] / [u_h(0.3) / u(0.3)]        in percent, at the nu of POISSON
//! ```
//!
//! The body is Cook's panel, 48 m long, 44 m high where it is held and 16 m where a shear traction pulls, in plane strain, and
//! in space 44 m deep; u is the mean displacement of the loaded side. Methods have 4 cells a direction; B-bar stands for the
//! truth, on 24 cells in the plane and 8 in space: its own loss between 4 and 48 cells, and 4 and 10, is below 2 and
//! 0.5 percent at every nu. `tests/verification_fem/locking.rs` measures all of it again.
//!
//! A method locks when it loses more than a quarter close to 1/2 ([`locks_from`]). Those that do not lose what a coarse mesh
//! costs, and less on every finer one: on 2, 4, 6 and 8 cells a direction at 0.4999 (in percent)
//!
//! | method | 2 | 4 | 6 | 8 |
//! |---|---|---|---|---|
//! | smoothed_selective | 25 | 21 | 14 | 10 |
//! | smoothed_node | 52 | 15 | 7 | 4 |
//! | t4 | 18 | 49 | 61 | 67 |
//! | smoothed_face | 27 | 57 | 66 | 70 |
//!
//! In the plane, from 4 to 8 cells, degree 2 goes from 45 to 17, degree 3 from 8 to 3, and q4 from 63 to 68.

/// Poisson's ratios at which losses were measured.
pub const POISSON: [f64; 8] = [0.4, 0.45, 0.48, 0.49, 0.495, 0.499, 0.4999, 0.49999];

/// Loss of displacement at each of [`POISSON`], percent; negative where a method is softer than at 0.3.
pub type Loss = [f64; POISSON.len()];

/// A method locks when it loses more than this at the last of [`POISSON`], percent.
pub const LOCKED: f64 = 25.0;

/// Locking is felt where more than this is lost, percent.
pub const FELT: f64 = 10.0;

/// The first of [`POISSON`], by its index, at which a method that locks is felt to; none for a method that does not lock.
pub fn locks_from(loss: &Loss) -> Option<usize> {
    let locks = loss[POISSON.len() - 1] > LOCKED;
    loss.iter().position(|&loss| loss > FELT).filter(|_| locks)
}

/// The losses of a method.
#[derive(Debug, Clone, Copy)]
pub enum Losses {
    /// One for each kind of cell that the method takes, in the order of its list.
    Cells(&'static [Loss]),
    /// Those of patches of degree 1, 2, ... in the plane and in space; the last holds for higher degrees as an upper limit.
    Degrees([&'static [Loss]; 2]),
}

/// Linear triangles.
pub const T3: Loss = [7.5, 17.1, 27.3, 32.3, 35.5, 38.5, 39.4, 39.5];
/// Bilinear quadrilaterals.
pub const Q4: Loss = [7.5, 18.7, 34.7, 44.8, 52.1, 60.2, 62.5, 62.8];
/// Bilinear quadrilaterals with the mean change of volume.
pub const Q4_BBAR: Loss = [-1.5, -1.8, -1.7, -1.6, -1.5, -1.4, -1.4, -1.4];
/// Triangles smoothed over edges.
pub const SMOOTHED_TRIANGLE: Loss = [8.7, 19.8, 34.3, 43.4, 50.4, 59.4, 62.9, 63.3];
/// Linear tetrahedra.
pub const T4: Loss = [11.1, 22.6, 34.5, 40.4, 44.1, 47.8, 48.9, 49.2];
/// Trilinear hexahedra.
pub const B8: Loss = [8.4, 19.5, 34.7, 44.1, 51.0, 59.9, 64.9, 66.3];
/// Trilinear hexahedra with the mean change of volume.
pub const B8_BBAR: Loss = [-0.2, 0.0, 0.3, 0.4, 0.5, 0.5, 0.5, 0.5];
/// Tetrahedra smoothed over faces.
pub const SMOOTHED_FACE: Loss = [11.8, 24.4, 38.2, 45.5, 50.4, 55.5, 57.1, 57.4];
/// Tetrahedra smoothed over edges.
pub const SMOOTHED_EDGE: Loss = [8.8, 19.5, 34.0, 43.8, 51.8, 63.5, 69.3, 70.4];
/// Tetrahedra smoothed over nodes.
pub const SMOOTHED_NODE: Loss = [2.3, 5.0, 8.5, 10.7, 12.4, 14.1, 14.6, 14.6];
/// Tetrahedra with shear over faces and change of volume over nodes.
pub const SMOOTHED_SELECTIVE: Loss = [1.2, 4.2, 8.8, 12.1, 14.9, 18.9, 20.7, 20.9];
/// Splines in the plane, degree 1 to 4.
pub const PLANE_SPLINES: [Loss; 4] = [
    Q4,
    [1.1, 2.5, 4.9, 7.2, 10.1, 21.2, 44.8, 56.3],
    [0.5, 1.1, 1.9, 2.4, 3.0, 4.5, 7.6, 11.9],
    [0.3, 0.7, 1.1, 1.3, 1.6, 2.2, 3.2, 4.8],
];
/// Splines in space, degree 1 to 3.
pub const SOLID_SPLINES: [Loss; 3] =
    [B8, [1.0, 2.3, 4.5, 6.8, 9.9, 21.5, 44.1, 54.2], [0.4, 0.8, 1.3, 1.8, 2.2, 3.6, 6.7, 10.8]];
