//! Springs that fold up in a motion: their ends meet, or pass through each other.
//!
//! A spring of no length has no direction and pulls nowhere, so forces stay finite ([`super::forces`]); when its ends have
//! passed through each other its direction is turned round and it pushes them further apart, which no real body does.
//! A spring has collapsed between two recorded states when its vector d in the second points against that of the first
//! (d . d' < 0) and the straight way between the two comes nearer to zero than a tenth of its rest length; a fast turn
//! passes at a distance. What happens between two records in full is not seen.

use crate::geometry::dofs::DofMap;
use crate::springs::network::Network;

/// Nearer to zero than this part of the rest length is a collapse, not a turn.
const NEAR: f64 = 0.1;

/// The springs that collapsed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collapses {
    /// How many springs did.
    pub springs: usize,
    /// The first of them.
    pub nodes: [u32; 2],
    /// The recorded time at which it was seen first, s.
    pub time: f64,
}

/// Looks at every spring in the recorded displacements (m, over the free degrees of freedom); none when none collapsed.
///
/// # Panics
/// When there is not one time for every frame.
pub fn find(network: &Network, dofs: &DofMap, times: &[f64], frames: &[Vec<f64>]) -> Option<Collapses> {
    assert_eq!(times.len(), frames.len(), "one time for every frame");
    let mut seen = vec![false; network.springs.len()];
    let mut first = None;
    let mut before = vectors(network, dofs, frames.first()?);
    for (time, frame) in times.iter().zip(frames).skip(1) {
        let now = vectors(network, dofs, frame);
        for (s, spring) in network.springs.iter().enumerate() {
            if !seen[s] && collapsed(before[s], now[s], spring.length) {
                seen[s] = true;
                first.get_or_insert((spring.nodes, *time));
            }
        }
        before = now;
    }
    let (nodes, time) = first?;
    Some(Collapses { springs: seen.into_iter().filter(|&seen| seen).count(), nodes, time })
}

/// d of every spring.
fn vectors(network: &Network, dofs: &DofMap, u: &[f64]) -> Vec<[f64; 3]> {
    let moved = dofs.expand(u);
    let place = |node: u32, a: usize| network.positions[node as usize][a] + moved[node as usize][a];
    let vector = |nodes: [u32; 2]| std::array::from_fn(|a| place(nodes[1], a) - place(nodes[0], a));
    network.springs.iter().map(|spring| vector(spring.nodes)).collect()
}

fn collapsed(before: [f64; 3], now: [f64; 3], length: f64) -> bool {
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f64>();
    let near = (NEAR * length).powi(2);
    if dot(now, now) < 1e-12 * length * length {
        return true;
    }
    let step: [f64; 3] = std::array::from_fn(|i| now[i] - before[i]);
    let square = dot(step, step);
    if dot(before, now) >= 0.0 || square == 0.0 {
        return false;
    }
    // the point of the way that is nearest to zero
    let t = (-dot(before, step) / square).clamp(0.0, 1.0);
    let nearest: [f64; 3] = std::array::from_fn(|i| before[i] + t * step[i]);
    dot(nearest, nearest) < near
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passing_through_or_ending_at_zero_is_a_collapse_and_turning_is_none() {
        assert!(collapsed([0.4, 0.0, 0.0], [-0.3, 0.01, 0.0], 1.0));
        assert!(collapsed([0.4, 0.0, 0.0], [0.0; 3], 1.0));
        assert!(!collapsed([1.0, 0.0, 0.0], [-0.9, 0.6, 0.0], 1.0));
        assert!(!collapsed([0.4, 0.0, 0.0], [0.2, 0.0, 0.0], 1.0));
        assert!(!collapsed([0.4, 0.0, 0.0], [0.4, 0.0, 0.0], 1.0));
    }
}
