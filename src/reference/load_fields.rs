//! Load fields: forces on all control points that try a body from every side.
//!
//! With the centre c of the box around the control points and r = x - c, the force on a control point at x is
//!
//! | field | force |
//! |---|---|
//! | torsion about e | F e x r |
//! | bending along e, direction d | F (e . r) d |
//! | radial | F r |
//! | random smooth | F sqrt(2 / M) sum over m of (cos(2 pi w_mi . r / L + p_mi)) in each component i |
//!
//! F in N for a point 1 m from the axis or the centre (torsion, bending, radial: N/m times r), L the largest extent of the
//! body, M = 6 waves with vectors w uniform in [-1, 1]^d (at most one wave over the body) and phases p uniform, drawn from
//! the seed: smooth on the scale of the body whatever its mesh, with root mean square F over all seeds. Held components get no force,
//! tied points one.

use std::f64::consts::TAU;

use crate::error::Result;
use crate::geometry::dofs::{DofMap, FIXED};
use crate::reference::loads::{Load, nodal};
use crate::rng::Stream;

/// Waves of a random smooth field, for each component.
const WAVES: usize = 6;

/// A field of forces over space.
#[derive(Debug, Clone, PartialEq)]
pub enum Field {
    /// Turns about an axis (a unit vector) through the centre.
    Torsion {
        /// The axis.
        axis: [f64; 3],
    },
    /// Grows along one unit vector and points along another.
    Bending {
        /// Where it grows.
        along: [f64; 3],
        /// Where it points.
        direction: [f64; 3],
    },
    /// Away from the centre.
    Radial,
    /// Random waves.
    RandomSmooth {
        /// Seed of the waves.
        seed: u64,
    },
}

/// The load of a field of strength F on control points at `positions` (m, n x 3).
///
/// # Errors
/// Those of [`nodal`].
///
/// # Panics
/// When there is not one position for each node.
pub fn load(field: &Field, strength: f64, positions: &[[f64; 3]], dofs: &DofMap) -> Result<Load> {
    assert_eq!(positions.len(), dofs.nodes(), "one position for each node");
    let (centre, extent) = centre_and_extent(positions);
    let waves = match field {
        Field::RandomSmooth { seed } => Wave::draw(*seed, dofs.dimension()),
        _ => Vec::new(),
    };
    let mut forces = vec![[0.0; 3]; positions.len()];
    for node in dofs.masters() {
        let r: [f64; 3] = std::array::from_fn(|i| positions[node][i] - centre[i]);
        let force = match field {
            Field::Torsion { axis } => cross(axis, &r),
            Field::Bending { along, direction } => direction.map(|d| d * inner(along, &r)),
            Field::Radial => r,
            Field::RandomSmooth { .. } => waves_at(&waves, &r.map(|x| x / extent)),
        };
        for (i, &dof) in dofs.free(node).iter().enumerate() {
            if dof != FIXED {
                forces[node][i] = strength * force[i];
            }
        }
    }
    nodal(dofs, &forces)
}

/// Centre of the box around some points, and its largest extent (1 for a single point).
pub(super) fn centre_and_extent(positions: &[[f64; 3]]) -> ([f64; 3], f64) {
    let end = |a: usize, pick: fn(f64, f64) -> f64, from: f64| positions.iter().fold(from, |end, x| pick(end, x[a]));
    let low: [f64; 3] = std::array::from_fn(|a| end(a, f64::min, f64::INFINITY));
    let high: [f64; 3] = std::array::from_fn(|a| end(a, f64::max, f64::NEG_INFINITY));
    let extent = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
    (std::array::from_fn(|a| 0.5 * (low[a] + high[a])), if extent > 0.0 { extent } else { 1.0 })
}

/// One wave of one component.
struct Wave {
    component: usize,
    vector: [f64; 3],
    phase: f64,
}

impl Wave {
    /// The waves of a seed, component by component.
    fn draw(seed: u64, dimension: usize) -> Vec<Self> {
        let mut stream = Stream::new(seed, 0, 0);
        let mut waves = Vec::with_capacity(WAVES * dimension);
        for component in 0..dimension {
            for _ in 0..WAVES {
                let mut vector = [0.0; 3];
                vector[..dimension].iter_mut().for_each(|w| *w = 2.0 * stream.uniform() - 1.0);
                waves.push(Self { component, vector, phase: TAU * stream.uniform() });
            }
        }
        waves
    }
}

/// The waves at r / L.
fn waves_at(waves: &[Wave], r: &[f64; 3]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for wave in waves {
        sums[wave.component] += (TAU * inner(&wave.vector, r) + wave.phase).cos();
    }
    sums.map(|sum| sum * (2.0 / WAVES as f64).sqrt())
}

fn inner(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of 3^3 nodes around (1, 1, 1), its first node held in x.
    fn nodes() -> (Vec<[f64; 3]>, DofMap) {
        let positions: Vec<[f64; 3]> = (0..27).map(|n| [n / 9, n / 3 % 3, n % 3].map(|i: usize| i as f64)).collect();
        let mut fixed = vec![[false; 3]; 27];
        fixed[0][0] = true;
        let dofs = DofMap::untied(3, &fixed);
        (positions, dofs)
    }

    #[test]
    fn a_torsion_of_free_nodes_has_no_sum_and_turns_about_its_axis() {
        let (positions, _) = nodes();
        let free = DofMap::untied(3, &[[false; 3]; 27]);
        let found = load(&Field::Torsion { axis: [0.0, 0.0, 1.0] }, 2.0, &positions, &free).unwrap();
        assert!(found.total.iter().all(|f| f.abs() < 1e-14), "{:?}", found.total);
        let moment: f64 = (0..27)
            .map(|n| {
                let (x, f) = (positions[n], &found.forces[3 * n..3 * n + 3]);
                (x[0] - 1.0) * f[1] - (x[1] - 1.0) * f[0]
            })
            .sum();
        let polar: f64 = positions.iter().map(|x| (x[0] - 1.0).powi(2) + (x[1] - 1.0).powi(2)).sum();
        assert!((moment - 2.0 * polar).abs() < 1e-12, "{moment}");
    }

    #[test]
    fn held_components_get_no_force_and_fields_follow_their_formulas() {
        let (positions, dofs) = nodes();
        let radial = load(&Field::Radial, 1.0, &positions, &dofs).unwrap();
        assert_eq!(radial.held, [0.0; 3]);
        assert_eq!(radial.total, [1.0, 0.0, 0.0]);
        let bending =
            load(&Field::Bending { along: [1.0, 0.0, 0.0], direction: [0.0, 0.0, 1.0] }, 3.0, &positions, &dofs);
        let last = bending.unwrap().forces[dofs.len() - 1];
        assert_eq!(last, 3.0);
    }

    #[test]
    fn random_fields_repeat_with_their_seed_and_have_the_stated_size() {
        let (positions, dofs) = nodes();
        let forces = |seed| load(&Field::RandomSmooth { seed }, 1.0, &positions, &dofs).unwrap().forces;
        assert_eq!(forces(3), forces(3));
        assert_ne!(forces(3), forces(4));
        let squares: f64 = (0..400).map(|seed| forces(seed).iter().map(|f| f * f).sum::<f64>()).sum();
        let rms = (squares / (400 * dofs.len()) as f64).sqrt();
        assert!((rms - 1.0).abs() < 0.05, "{rms}");
    }
}
