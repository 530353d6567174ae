//! How far the calibrated network is from the continuum.
//!
//! ```text
//! e_rms = 100 sqrt(mean_i |u_ref,i - u_i|^2) / max_i |u_ref,i|     (4.20), (5.7)
//! e_max = 100 max_i |u_ref,i - u_i| / max_i |u_ref,i|               (4.21)
//! ```
//!
//! in percent, over all control points, held ones included; tied points count once. The *global strain* of a
//! displaced network compares the lengths of its springs with their rest lengths (4.16-4.17):
//!
//! ```text
//! strain = 100 mean_s |l_s - l0_s| / l0_s
//! ```

use crate::geometry::dofs::DofMap;
use crate::springs::network::Network;

/// The errors under one load case, in percent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Root mean square over the control points (4.20).
    pub e_rms: f64,
    /// Largest at a control point (4.21).
    pub e_max: f64,
}

/// Compares the displacements of a network with the reference; both over the free dofs, in m.
pub fn errors(dofs: &DofMap, reference: &[f64], displacement: &[f64]) -> Errors {
    // a power of two changes no digit, and keeps the squares of very large and very small bodies in range
    let most = reference.iter().chain(displacement).fold(0.0_f64, |most, u| most.max(u.abs()));
    let unit = if most.is_normal() { (-most.log2().floor()).clamp(-1000.0, 1000.0).exp2() } else { 1.0 };
    let scaled = |u: &[f64]| -> Vec<f64> { u.iter().map(|u| u * unit).collect() };
    let (reference, displacement) = (&scaled(reference)[..], &scaled(displacement)[..]);
    let difference: Vec<f64> = reference.iter().zip(displacement).map(|(r, u)| r - u).collect();
    let squares = |u: &[f64]| -> Vec<f64> {
        let nodes = dofs.expand(u);
        dofs.masters().map(|i| nodes[i].iter().map(|c| c * c).sum()).collect()
    };
    let largest = |squares: &[f64]| squares.iter().fold(0.0_f64, |a, b| a.max(*b)).sqrt();
    let wrong = squares(&difference);
    let scale = 100.0 / largest(&squares(reference));
    let mean = wrong.iter().sum::<f64>() / wrong.len() as f64;
    Errors { e_rms: scale * mean.sqrt(), e_max: scale * largest(&wrong) }
}

/// The errors of several load cases as one: the root of the mean square e_rms, and the largest e_max.
pub fn over_cases(cases: &[Errors]) -> Errors {
    let mean = cases.iter().map(|e| e.e_rms * e.e_rms).sum::<f64>() / cases.len() as f64;
    Errors { e_rms: mean.sqrt(), e_max: cases.iter().fold(0.0, |a, e| a.max(e.e_max)) }
}

/// The global strain (4.17) of the network displaced by `displacement` (nodes x 3, in m), in percent.
pub fn global_strain(network: &Network, displacement: &[[f64; 3]]) -> f64 {
    let place = |i: u32| {
        let (x, u) = (network.positions[i as usize], displacement[i as usize]);
        [x[0] + u[0], x[1] + u[1], x[2] + u[2]]
    };
    let changes = network.springs.iter().map(|spring| {
        let (a, b) = (place(spring.nodes[0]), place(spring.nodes[1]));
        let length = (0..3).map(|c| (b[c] - a[c]).powi(2)).sum::<f64>().sqrt();
        (length - spring.length).abs() / spring.length
    });
    100.0 * changes.sum::<f64>() / network.springs.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Found by fuzzing: the squares of displacements of 1e160 m are no numbers any more.
    #[test]
    fn errors_do_not_depend_on_the_unit_however_large() {
        let dofs = DofMap::untied(2, &[[false; 3]; 2]);
        let (reference, found) = ([3.0, -4.0, 1.0, 2.0], [3.5, -4.0, 0.5, 1.0]);
        let expected = errors(&dofs, &reference, &found);
        for power in [-300, -160, 160, 300] {
            let unit = 2.0_f64.powi(power * 3);
            let scaled = |u: [f64; 4]| u.map(|u| u * unit);
            assert_eq!(errors(&dofs, &scaled(reference), &scaled(found)), expected, "{unit:e}");
        }
    }
}
