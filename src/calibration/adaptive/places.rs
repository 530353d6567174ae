//! Random numbers that belong to places: the probes of a ladder do not depend on a seed or on how nodes are numbered.
//!
//! A probe is a vector of independent normal numbers, one for every displacement. Drawn in the order of the unknowns it would be
//! another one after every renumbering of the nodes, and with it the splits that look alike. Here each number is drawn from where its node
//! lies, in units of the body: x = (position - lowest corner) / diagonal of the box, in steps of 2^-16. So a body in
//! millimetres has the probes of the same body in metres. Nodes at one place share their numbers.

use crate::geometry::dofs::{DofMap, FIXED};
use crate::rng::Stream;

/// Steps of a coordinate along the diagonal of the body.
const STEPS: f64 = 65_536.0;

/// Where a step begins: off the round fractions at which nodes lie, so that the last bit of a position decides nothing.
const OFFSET: f64 = 0.381_966;

/// The diagonal of the box around some positions, m.
pub fn extent(positions: &[[f64; 3]]) -> f64 {
    let [low, high] = corners(positions);
    (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt()
}

fn corners(positions: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let of =
        |pick: fn(f64, f64) -> f64| std::array::from_fn(|c| positions.iter().map(|x| x[c]).reduce(pick).unwrap_or(0.0));
    [of(f64::min), of(f64::max)]
}

/// A number for every free degree of freedom, named by the place of its node and its component.
pub fn places(positions: &[[f64; 3]], dofs: &DofMap) -> Vec<u64> {
    let ([low, _], size) = (corners(positions), extent(positions));
    let mut places = vec![0; dofs.len()];
    for (node, x) in positions.iter().enumerate() {
        let step = |c: usize| ((x[c] - low[c]) / size * STEPS + OFFSET).floor() as u64;
        let of_node = (0..3).fold(0, |hash, c| mixed(hash ^ step(c)));
        for (component, &unknown) in dofs.free(node).iter().enumerate().filter(|(_, unknown)| **unknown != FIXED) {
            places[unknown as usize] = mixed(of_node ^ component as u64);
        }
    }
    places
}

/// The finaliser of splitmix64 (S. Vigna), which spreads every bit over all.
fn mixed(number: u64) -> u64 {
    let number = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ (number >> 31)
}

/// `count` vectors over `cases` x places of independent normal numbers, one after the other; `level` names them.
pub fn probes(places: &[u64], cases: usize, count: usize, level: usize) -> Vec<f64> {
    let (n, rows) = (places.len(), places.len() * cases);
    let mut vectors = vec![0.0; count * rows];
    for (i, place) in places.iter().enumerate() {
        let mut stream = Stream::new(mixed(place ^ level as u64), 0, 0);
        for vector in vectors.chunks_exact_mut(rows) {
            (0..cases).for_each(|case| vector[case * n + i] = stream.normal());
        }
    }
    vectors
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In millimetres, moved and in another order: the same numbers at the same nodes.
    #[test]
    fn probes_belong_to_places() {
        let positions: Vec<[f64; 3]> =
            (0..27).map(|i| [i / 9, i / 3 % 3, i % 3].map(|index| f64::from(index) / 3.0)).collect();
        let order: Vec<usize> = (0..27).map(|i| 7 * i % 27).collect();
        let moved: Vec<[f64; 3]> = order.iter().map(|&i| positions[i].map(|x| 1e3 * x - 41.7)).collect();
        let free = |count: usize| DofMap::untied(3, &vec![[false; 3]; count]);
        let (one, other) = (places(&positions, &free(27)), places(&moved, &free(27)));
        let (first, second) = (probes(&one, 2, 3, 5), probes(&other, 2, 3, 5));
        for (new, &old) in order.iter().enumerate() {
            for c in 0..3 {
                assert_eq!(other[3 * new + c], one[3 * old + c]);
                for block in 0..6 {
                    assert_eq!(second[81 * block + 3 * new + c], first[81 * block + 3 * old + c]);
                }
            }
        }
        assert_ne!(first, probes(&one, 2, 3, 6));
        let mean = first.iter().sum::<f64>() / first.len() as f64;
        let variance = first.iter().map(|x| x * x).sum::<f64>() / first.len() as f64;
        assert!(mean.abs() < 0.15 && (variance - 1.0).abs() < 0.25, "{mean} {variance}");
    }
}
