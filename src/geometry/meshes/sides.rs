//! The sides of the bodies made by name, as named sets of nodes.
//!
//! "x-" and "x+" are the ends of a flat body across x, and so on. A round body grows out of the sides of its core, and its
//! surface keeps their names: "x-" are the nodes of the surface whose direction from the middle is nearest to -x, the edges
//! between two parts belonging to both. So a disk has four quarters of its rim, a ball six parts of its surface, a cylinder
//! four quarters of its mantle and two ends; "rim", "surface" and "side" are all of it.
//!
//! Every place is looked at in the body's default size, x / size * default size, where round bodies have radius 1 around the
//! origin (the cylinder around z, from 0 to 2). A distorted box keeps its sides: their nodes move within them.

/// A named set of nodes, ascending.
pub type Set = (String, Vec<u32>);

/// How far a node may lie from where it should, as a part of the radius.
const SLACK: f64 = 1e-9;

/// The ends across each of `axes`, least and largest coordinate.
pub fn ends(places: &[[f64; 3]], axes: std::ops::Range<usize>) -> Vec<Set> {
    let mut sets = Vec::new();
    for axis in axes {
        let along = || places.iter().map(|x| x[axis]);
        let (low, high) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        let slack = SLACK * (high - low);
        sets.push(set(name(axis, false), places, |x| x[axis] <= low + slack));
        sets.push(set(name(axis, true), places, |x| x[axis] >= high - slack));
    }
    sets
}

/// The nodes at distance 1 from the origin, counting the first `dimension` coordinates, by the nearest axis, and all of
/// them under the name `whole`.
pub fn round(places: &[[f64; 3]], dimension: usize, whole: &str) -> Vec<Set> {
    let outside = |x: &[f64; 3]| x[..dimension].iter().map(|c| c * c).sum::<f64>().sqrt() >= 1.0 - SLACK;
    let mut sets = Vec::new();
    for axis in 0..dimension {
        for positive in [false, true] {
            let toward = |x: &[f64; 3]| if positive { x[axis] } else { -x[axis] };
            let nearest = |x: &[f64; 3]| x[..dimension].iter().all(|c| toward(x) >= c.abs() - SLACK);
            sets.push(set(name(axis, positive), places, |x| outside(x) && nearest(x)));
        }
    }
    sets.push(set(whole.to_owned(), places, outside));
    sets
}

fn name(axis: usize, positive: bool) -> String {
    format!("{}{}", ['x', 'y', 'z'][axis], if positive { '+' } else { '-' })
}

fn set(name: String, places: &[[f64; 3]], is_in: impl Fn(&[f64; 3]) -> bool) -> Set {
    let nodes = places.iter().enumerate().filter(|(_, x)| is_in(x)).map(|(node, _)| node as u32);
    (name, nodes.collect())
}
