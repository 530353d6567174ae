//! Rotations in the plane, where they are one angle.
//!
//! A gradient in the plane is taken as F = [F_2 0; 0 1], so that nothing else has to know about directions. The rotation
//! nearest to F_2 has the angle
//!
//! ```text
//!     a = atan2(F_yx - F_xy, F_xx + F_yy),     s_0 + s_1 = sqrt((F_yx - F_xy)^2 + (F_xx + F_yy)^2)
//! ```
//!
//! with the signed singular values s of F_2, also where F_2 is turned inside out; it is not determined where the root is
//! zero beside F_2. Of the three twists only that in the plane is there, q = J R / sqrt 2 with the quarter turn J.

use nalgebra_sparse::na::{Matrix3, UnitQuaternion, Vector3};

use crate::reference::corotational::Tangent;
use crate::reference::corotational::twist::{LEAST_SUM, Twist};
use crate::reference::material::Lame;

/// (s_0 + s_1) beside the largest entry below which a rotation is not determined.
const DETERMINED: f64 = 1e-9;

/// cos a (s_0 + s_1) and sin a (s_0 + s_1); none where they determine no angle.
fn parts(f: &Matrix3<f64>) -> Option<[f64; 2]> {
    let (along, across) = (f.m11 + f.m22, f.m21 - f.m12);
    let size = f.fixed_view::<2, 2>(0, 0).amax();
    // also false for what is not a number
    (along.hypot(across) > DETERMINED * size && size.is_finite()).then_some([along, across])
}

/// The rotation in F; `memory` is the one of before, and takes the new one. A gradient that determines no rotation gives the
/// one of before.
pub fn extract(f: &Matrix3<f64>, memory: &mut UnitQuaternion<f64>) -> Matrix3<f64> {
    let Some([along, across]) = parts(f) else { return memory.to_rotation_matrix().into_inner() };
    let length = along.hypot(across);
    let (cosine, sine) = (along / length, across / length);
    *memory = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), across.atan2(along));
    Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0)
}

/// The twist of F in the plane; none in the warped tangent, and where F determines no rotation.
pub fn twist(f: &Matrix3<f64>, lame: Lame, tangent: Tangent) -> Twist {
    let (Some([along, across]), false) = (parts(f), tangent == Tangent::Warped) else { return Twist::none() };
    let sum = along.hypot(across);
    let c = 2.0 * lame.mu + 2.0 * (lame.lambda * (sum - 2.0) - 2.0 * lame.mu) / sum.max(LEAST_SUM);
    let (cosine, sine) = (along / sum, across / sum);
    let quarter = Matrix3::new(sine, cosine, 0.0, -cosine, sine, 0.0, 0.0, 0.0, 0.0) * std::f64::consts::FRAC_1_SQRT_2;
    let none = Matrix3::zeros();
    let c = if tangent == Tangent::Positive { c.max(0.0) } else { c };
    Twist { directions: [quarter, none, none], coefficients: [c, 0.0, 0.0] }
}
