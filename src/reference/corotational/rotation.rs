//! The rotation in a deformation gradient.
//!
//! A gradient F = R S has the rotation R in SO(3) that is nearest to it; S = R^T F is symmetric. With the singular values
//! s_0 >= s_1 >= |s_2|, where s_2 carries the sign of det F,
//!
//! ```text
//!     F = U diag(s) V^T,    U, V in SO(3),    R = U V^T
//! ```
//!
//! so that R is a rotation for an inverted F too, which is then pushed back along its shortest axis. R maximises
//! tr(R^T F). It is unique while s_1 + s_2 > 0; where that falls below 1e-9 s_0 (everything flattened to a line, or
//! mirrored with a tie) the rotation of before is kept.
//!
//! Two ways. [`Signed::of`] is a one-sided Jacobi iteration (M. R. Hestenes, J. SIAM 6, 1958): the columns of F V are
//! turned against each other until they are orthogonal; no F^T F is formed, so small singular values keep their digits. The fast
//! way starts from the rotation of before and takes Newton steps on SO(3): with A = R^T F,
//!
//! ```text
//!     (tr(S) 1 - S) w = axial(A - A^T),   S = sym(A),   R <- R exp(w)
//! ```
//!
//! The matrix is minus the second derivative of tr(R^T F). Where it is positive definite at a stationary point, that point
//! is a maximum, and SO(3) has only one; a saddle (a start turned by 180 degrees) fails this test and goes the other way.
//! The error is squared in each step.

use nalgebra_sparse::na::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// (s_1 + s_2) / s_0 below which a rotation is not determined.
const DETERMINED: f64 = 1e-9;

/// Newton steps on SO(3) before the singular values are computed.
const STEPS: usize = 6;

/// Size of a step, in rad, after which the next would be below rounding.
const SMALL: f64 = 1e-9;

/// Smallest pivot of tr(S) 1 - S, relative to tr(S), that the fast way trusts.
const PIVOT: f64 = 1e-3;

/// Turns of all three pairs of columns; four or five are enough.
const SWEEPS: usize = 30;

/// Singular values with the sign of the determinant in the last, and proper rotations on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signed {
    /// Left vectors in columns, det U = 1.
    pub u: Matrix3<f64>,
    /// s_0 >= s_1 >= |s_2|.
    pub s: Vector3<f64>,
    /// Right vectors in columns, det V = 1.
    pub v: Matrix3<f64>,
}

impl Signed {
    /// Decomposes a finite F.
    pub fn of(f: &Matrix3<f64>) -> Self {
        let scale = f.amax();
        if scale == 0.0 {
            return Self { u: Matrix3::identity(), s: Vector3::zeros(), v: Matrix3::identity() };
        }
        let (mut b, mut v) = (f / scale, Matrix3::identity());
        for _ in 0..SWEEPS {
            // all three are turned, whether or not an earlier one had to be
            let turned = [(0, 1), (0, 2), (1, 2)].map(|(p, q)| turn(&mut b, &mut v, p, q));
            if turned == [false; 3] {
                break;
            }
        }
        for (p, q) in [(0, 1), (1, 2), (0, 1)] {
            if b.column(p).norm_squared() < b.column(q).norm_squared() {
                exchange(&mut b, p, q);
                exchange(&mut v, p, q);
            }
        }
        let first = b.column(0).normalize();
        let second = beside(first, b.column(1).into_owned());
        let u = Matrix3::from_columns(&[first, second, first.cross(&second)]);
        let s = Vector3::from_fn(|i, _| scale * u.column(i).dot(&b.column(i)));
        Self { u, s, v }
    }

    /// R = U V^T.
    pub fn rotation(&self) -> Matrix3<f64> {
        self.u * self.v.transpose()
    }

    /// True where no other rotation is as near.
    pub fn is_determined(&self) -> bool {
        self.s[1] + self.s[2] > DETERMINED * self.s[0]
    }
}

/// Makes columns p and q of B orthogonal by a rotation that V collects; false when they are.
fn turn(b: &mut Matrix3<f64>, v: &mut Matrix3<f64>, p: usize, q: usize) -> bool {
    let (alpha, beta) = (b.column(p).norm_squared(), b.column(q).norm_squared());
    let gamma = b.column(p).dot(&b.column(q));
    if gamma.abs() <= f64::EPSILON * (alpha.sqrt() * beta.sqrt()) {
        return false;
    }
    let zeta = (beta - alpha) / (2.0 * gamma);
    let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    for m in [b, v] {
        let (x, y) = (m.column(p).into_owned(), m.column(q).into_owned());
        m.set_column(p, &((x - y * t) * c));
        m.set_column(q, &((x * t + y) * c));
    }
    true
}

/// Exchanges two columns by a quarter turn, which keeps the determinant.
fn exchange(m: &mut Matrix3<f64>, p: usize, q: usize) {
    let (x, y) = (m.column(p).into_owned(), m.column(q).into_owned());
    m.set_column(p, &y);
    m.set_column(q, &-x);
}

/// The direction of `b` across the unit vector `first`; any direction across it when `b` is zero beside rounding.
fn beside(first: Vector3<f64>, b: Vector3<f64>) -> Vector3<f64> {
    let across = |b: Vector3<f64>| b - first * first.dot(&b);
    let rest = across(b);
    match rest.norm() > f64::EPSILON {
        // once more, because a short vector keeps little of its direction
        true => across(rest.normalize()).normalize(),
        false => across(Vector3::ith(first.iamin(), 1.0)).normalize(),
    }
}

/// The rotation in F; `memory` is the one of before, and takes the new one.
///
/// A gradient that is not finite, or that determines no rotation, gives the rotation of before.
pub fn extract(f: &Matrix3<f64>, memory: &mut UnitQuaternion<f64>) -> Matrix3<f64> {
    if let Some(found) = follow(f, *memory) {
        *memory = found;
    } else if f.iter().all(|x| x.is_finite()) {
        let signed = Signed::of(f);
        if signed.is_determined() {
            let rotation = signed.rotation();
            *memory = quaternion(&rotation);
            // not by way of the quaternion, which rounds once more
            return rotation;
        }
    }
    memory.to_rotation_matrix().into_inner()
}

/// Newton steps from a rotation nearby; `None` when they do not lead to the maximum safely.
fn follow(f: &Matrix3<f64>, mut q: UnitQuaternion<f64>) -> Option<UnitQuaternion<f64>> {
    for _ in 0..STEPS {
        let a = q.to_rotation_matrix().into_inner().transpose() * f;
        let axial = Vector3::new(a.m32 - a.m23, a.m13 - a.m31, a.m21 - a.m12);
        let w = solve(&((a + a.transpose()) * 0.5), axial)?;
        // the half-angle tangent, exact enough at any angle because only its direction counts
        let half = Quaternion::from_parts(1.0, w * 0.5);
        q = UnitQuaternion::from_quaternion(q.into_inner() * half);
        if w.norm_squared() < SMALL * SMALL {
            return Some(q);
        }
    }
    None
}

/// (tr(S) 1 - S)^-1 b by Cholesky's factors; `None` where the matrix is not safely positive definite.
fn solve(s: &Matrix3<f64>, b: Vector3<f64>) -> Option<Vector3<f64>> {
    let trace = s.trace();
    let least = PIVOT * trace;
    let d0 = trace - s.m11;
    let (l10, l20) = (-s.m21 / d0, -s.m31 / d0);
    let d1 = trace - s.m22 - l10 * l10 * d0;
    let l21 = (-s.m32 - l20 * l10 * d0) / d1;
    let d2 = trace - s.m33 - l20 * l20 * d0 - l21 * l21 * d1;
    // also false for what is not a number
    if !(trace > 0.0 && d0 > least && d1 > least && d2 > least) {
        return None;
    }
    let y1 = b.y - l10 * b.x;
    let y2 = (b.z - l20 * b.x - l21 * y1) / d2;
    let y1 = y1 / d1 - l21 * y2;
    Some(Vector3::new(b.x / d0 - l10 * y1 - l20 * y2, y1, y2))
}

/// The quaternion of a rotation matrix.
fn quaternion(r: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let trace = r.trace();
    let parts = match (0..3).max_by(|&i, &j| r[(i, i)].total_cmp(&r[(j, j)])) {
        Some(i) if r[(i, i)] > trace => {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let mut vector = Vector3::zeros();
            vector[i] = 1.0 + r[(i, i)] - r[(j, j)] - r[(k, k)];
            vector[j] = r[(j, i)] + r[(i, j)];
            vector[k] = r[(k, i)] + r[(i, k)];
            Quaternion::from_parts(r[(k, j)] - r[(j, k)], vector)
        }
        _ => Quaternion::new(1.0 + trace, r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12),
    };
    UnitQuaternion::from_quaternion(parts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    fn random_rotation(stream: &mut Stream) -> UnitQuaternion<f64> {
        let mut draw = || stream.normal();
        UnitQuaternion::from_quaternion(Quaternion::new(draw(), draw(), draw(), draw()))
    }

    fn random(stream: &mut Stream) -> Matrix3<f64> {
        Matrix3::from_fn(|_, _| stream.normal())
    }

    #[test]
    fn singular_values_put_f_together_again_and_carry_the_sign_of_its_determinant() {
        let mut stream = Stream::new(3, 0, 0);
        for i in 0..3000 {
            let spread = 10f64.powi(-(i % 12));
            let middle = Matrix3::from_diagonal(&Vector3::new(1.0, spread, spread * stream.normal()));
            let f = match i % 3 {
                0 => random(&mut stream),
                1 => random(&mut stream) * middle,
                _ => middle * random(&mut stream) * 1e150,
            };
            let Signed { u, s, v } = Signed::of(&f);
            let size = f.amax();
            assert!((u * Matrix3::from_diagonal(&s) * v.transpose() - f).amax() < 4e-15 * size, "{f}");
            for q in [u, v] {
                assert!((q.transpose() * q - Matrix3::identity()).amax() < 2e-15 && q.determinant() > 0.0);
            }
            assert!(s[0] >= s[1] && s[1] >= s[2].abs() - 1e-15 * s[0]);
            assert!((f / size).determinant() * s[2] >= 0.0 || s[2].abs() < 1e-14 * size);
        }
    }

    /// A graded matrix: the smallest singular value keeps its digits.
    #[test]
    fn small_singular_values_keep_their_digits() {
        let f = Matrix3::new(1.0, 1e-9, 0.0, 1.0, -1e-9, 0.0, 0.0, 0.0, 1e-14);
        let s = Signed::of(&f).s;
        let expected = [2f64.sqrt(), 2f64.sqrt() * 1e-9, -1e-14];
        (0..3).for_each(|i| assert!((s[i] / expected[i] - 1.0).abs() < 1e-14, "{s}"));
    }

    #[test]
    fn the_fast_way_gives_the_rotation_of_the_singular_vectors() {
        let mut stream = Stream::new(7, 0, 0);
        let mut fast = 0;
        for i in 0..3000 {
            let turned = random_rotation(&mut stream);
            let f = turned.to_rotation_matrix().into_inner() * (Matrix3::identity() + random(&mut stream) * 0.2);
            // from near, as in a time step, and from anywhere
            let start = match i % 2 {
                0 => turned * UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| 0.1 * stream.normal())),
                _ => random_rotation(&mut stream),
            };
            let signed = Signed::of(&f);
            if !signed.is_determined() {
                continue;
            }
            let gap = (signed.s[1] + signed.s[2]) / signed.s[0];
            if let Some(found) = follow(&f, start) {
                fast += 1;
                let difference = (found.to_rotation_matrix().into_inner() - signed.rotation()).amax();
                assert!(difference < 1e-14 / gap, "{difference:e} {gap:e}");
            }
            let mut memory = start;
            let rotation = extract(&f, &mut memory);
            assert!((rotation - signed.rotation()).amax() < 1e-14 / gap);
            assert!((memory.to_rotation_matrix().into_inner() - rotation).amax() < 3e-15);
        }
        assert!(fast > 1300, "the fast way is taken from near: {fast}");
    }

    #[test]
    fn a_start_turned_by_half_a_turn_is_a_saddle_and_is_left() {
        for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
            let turned = UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI);
            let f = turned.to_rotation_matrix().into_inner();
            let mut memory = UnitQuaternion::identity();
            assert!((extract(&f, &mut memory) - f).amax() < 1e-14, "the rotation of a half turn is itself");
            let mut memory = turned;
            assert!((extract(&Matrix3::identity(), &mut memory) - Matrix3::identity()).amax() < 1e-14);
        }
    }

    #[test]
    fn what_determines_no_rotation_keeps_the_one_of_before() {
        let before = random_rotation(&mut Stream::new(1, 0, 0));
        let line = Vector3::new(1.0, 2.0, 3.0) * Vector3::new(0.5, -1.0, 0.25).transpose();
        let mirrored = Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, -1.0));
        let broken = Matrix3::new(f64::NAN, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        let far = Matrix3::identity() * f64::INFINITY;
        for f in [Matrix3::zeros(), line, mirrored, broken, far] {
            let mut memory = before;
            let rotation = extract(&f, &mut memory);
            assert_eq!((rotation, memory), (before.to_rotation_matrix().into_inner(), before), "{f}");
        }
    }

    #[test]
    fn a_mirrored_gradient_gives_a_rotation_that_keeps_the_longer_axes() {
        let f = Matrix3::from_diagonal(&Vector3::new(1.0, 0.8, -0.5));
        let rotation = extract(&f, &mut UnitQuaternion::identity());
        assert!((rotation - Matrix3::identity()).amax() < 1e-15);
        assert!((Signed::of(&f).s - Vector3::new(1.0, 0.8, -0.5)).amax() < 1e-15);
    }
}
