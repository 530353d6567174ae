//! The force of one spring, the plain formula.
//!
//! A spring of stiffness k, rest length l0 and damping c joins the points a and b with velocities v_a and v_b. With the
//! length l = |b - a| and the direction n = (b - a) / l of the displaced spring its tension, positive when it pulls, is
//!
//! ```text
//! T = k (l - l0)  +  c (v_b - v_a) . n            (3.2) and (3.3)
//! ```
//!
//! It pulls a by T n and b by -T n; its energy is E = k/2 (l - l0)^2 (3.1). Two points on one place have no direction: no force
//! acts. Linearised at rest, with the displacements u and the direction d at rest, T = k d . (u_b - u_a) along d.
//!
//! How the force changes: with B = k n n^T + k (1 - l0 / l) (1 - n n^T), the displacements du change the force on a by
//! B (du_b - du_a). Stretched springs hold sideways, compressed ones give way; without that negative part B has no negative
//! eigenvalue.
//!
//! k in N/m, c in N s/m, lengths in m, T in N, E in J. Whoever moves many springs fast stores them otherwise; this is
//! the one place where the formula stands alone, and what others are measured against.

/// b - a.
fn between(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Force on the point a of a spring between `a` and `b` (m), in N; b feels the opposite (3.2).
pub fn elastic(stiffness: f64, rest_length: f64, a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let step = between(a, b);
    let length = dot(step, step).sqrt();
    if length == 0.0 {
        return [0.0; 3];
    }
    step.map(|x| stiffness * (length - rest_length) / length * x)
}

/// B of a spring between `a` and `b` (m), row by row in N/m; zero where it has no length. `positive` leaves out the part that
/// gives way.
pub fn tangent(stiffness: f64, rest_length: f64, a: [f64; 3], b: [f64; 3], positive: bool) -> [[f64; 3]; 3] {
    let step = between(a, b);
    let length = dot(step, step).sqrt();
    if length == 0.0 {
        return [[0.0; 3]; 3];
    }
    let n = step.map(|x| x / length);
    let across = stiffness * (1.0 - rest_length / length);
    let across = if positive { across.max(0.0) } else { across };
    [0, 1, 2].map(|i| {
        [0, 1, 2].map(|j| {
            let along = n[i] * n[j];
            stiffness * along + across * (f64::from(u8::from(i == j)) - along)
        })
    })
}

/// Force of the damper on the point a in N, `va` and `vb` in m/s; b feels the opposite (3.3).
pub fn damping(damping: f64, a: [f64; 3], b: [f64; 3], va: [f64; 3], vb: [f64; 3]) -> [f64; 3] {
    let step = between(a, b);
    let square = dot(step, step);
    if square == 0.0 {
        return [0.0; 3];
    }
    step.map(|x| damping * dot(between(va, vb), step) / square * x)
}

/// Force on the point a, linearised at rest: `direction` from a to b at rest, displacements in m.
pub fn linearised(stiffness: f64, direction: [f64; 3], ua: [f64; 3], ub: [f64; 3]) -> [f64; 3] {
    let tension = stiffness * dot(direction, between(ua, ub));
    direction.map(|x| tension * x)
}

/// Energy of a spring in J (3.1).
pub fn energy(stiffness: f64, rest_length: f64, a: [f64; 3], b: [f64; 3]) -> f64 {
    let step = between(a, b);
    0.5 * stiffness * (dot(step, step).sqrt() - rest_length).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [f64; 3] = [0.1, -0.2, 0.4];
    const B: [f64; 3] = [0.9, 0.3, -0.5];

    #[test]
    fn the_force_is_the_slope_of_the_energy_and_the_linear_one_its_tangent() {
        let (k, rest, h) = (120.0, 1.1, 1e-6);
        let force = elastic(k, rest, A, B);
        for axis in 0..3 {
            let (mut forward, mut backward) = (A, A);
            forward[axis] += h;
            backward[axis] -= h;
            let slope = (energy(k, rest, forward, B) - energy(k, rest, backward, B)) / (2.0 * h);
            assert!((force[axis] + slope).abs() < 1e-7, "{axis}: {} {slope}", force[axis]);
        }
        let length = energy(2.0, 0.0, A, B).sqrt();
        let direction = between(A, B).map(|x| x / length);
        let small = |u: [f64; 3]| u.map(|x| x * 1e-7);
        let (ua, ub) = (small([1.0, 2.0, -1.0]), small([-2.0, 0.5, 3.0]));
        let moved = elastic(k, length, [0, 1, 2].map(|c| A[c] + ua[c]), [0, 1, 2].map(|c| B[c] + ub[c]));
        let linear = linearised(k, direction, ua, ub);
        assert!((0..3).all(|c| (moved[c] - linear[c]).abs() < 1e-9), "{moved:?} {linear:?}");
    }

    #[test]
    fn the_tangent_is_the_slope_of_the_force() {
        let h = 1e-6;
        for rest in [1.1, 2.0] {
            let slopes = tangent(120.0, rest, A, B, false);
            for axis in 0..3 {
                let (mut forward, mut backward) = (B, B);
                forward[axis] += h;
                backward[axis] -= h;
                let (f, g) = (elastic(120.0, rest, A, forward), elastic(120.0, rest, A, backward));
                (0..3).for_each(|i| assert!(((f[i] - g[i]) / (2.0 * h) - slopes[i][axis]).abs() < 1e-6));
            }
        }
        // pushed together, nothing but the pull along the spring is left
        let positive = tangent(120.0, 2.0, A, B, true);
        let along = between(A, B);
        let square = dot(along, along);
        (0..3).for_each(|i| assert!((positive[i][i] - 120.0 * along[i] * along[i] / square).abs() < 1e-12));
    }

    #[test]
    fn a_damper_resists_along_the_spring_only_and_a_point_has_no_direction() {
        let across = damping(3.0, [0.0; 3], [2.0, 0.0, 0.0], [0.0; 3], [0.0, 5.0, 0.0]);
        assert_eq!(across, [0.0; 3]);
        assert_eq!(damping(3.0, [0.0; 3], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 5.0, 0.0]), [-6.0, 0.0, 0.0]);
        assert_eq!(elastic(5.0, 1.0, A, A), [0.0; 3]);
        assert_eq!(damping(5.0, A, A, [1.0; 3], [2.0; 3]), [0.0; 3]);
    }
}
