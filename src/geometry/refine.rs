//! Refinement: the same body with more control points.
//!
//! Knot insertion, degree elevation and the cut into Bezier pieces all rest on the *blossom* of a polynomial piece
//! (Ramshaw 1987). The blossom f[a_1, .., a_p] of a piece f of degree p is symmetric, affine in each argument, and
//! f[x, .., x] = f(x). Control point i of a spline with knots t is the blossom of any piece it acts on, at its knots:
//!
//!   P_i = f[t_{i+1}, .., t_{i+p}]
//!
//! - On a finer knot vector the same formula with the new knots gives the new points.
//! - The blossom of the same f, seen as a polynomial of degree p + 1, is the mean over the ways to leave one argument out:
//!   F[a_1, .., a_{p+1}] = 1/(p+1) sum_j f[a_1, .., a_j left out, .., a_{p+1}].
//!
//! f[a_1, .., a_p] is de Boor's triangle on the span of f with another argument in each level: at most p means of two
//! points, however many knots are inserted, so rounding does not build up. Rational patches are refined in homogeneous
//! coordinates (w x, w y, w z, w), one grid line after another; weights come out by the same means.

use super::knots::{KnotVector, MAX_DEGREE};
use super::patch::Patch;
use crate::error::{Error, Result};

/// A control point in homogeneous coordinates (w x, w y, w z, w).
type Homogeneous = [f64; 4];

/// One polynomial piece of a patch: its own control points and weights, in C order of (p + 1)^d.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierElement {
    /// Degree of each direction, 0 for the one that a plane patch does not have.
    pub degree: [usize; 3],
    /// Control points (m).
    pub points: Vec<[f64; 3]>,
    /// Weights.
    pub weights: Vec<f64>,
}

/// Inserts `knots` (any order, repeats allowed) along `direction`; the map stays the same.
///
/// # Errors
/// [`Error::Input`] (`geometry.knots[i]`) when a knot is not inside the range, or would stand more than p times.
pub fn insert_knots(patch: &Patch, direction: usize, knots: &[f64]) -> Result<Patch> {
    let old = patch.knots(direction);
    let mut all = old.knots().to_vec();
    all.extend_from_slice(knots);
    all.sort_by(f64::total_cmp);
    let new = KnotVector::new(old.degree(), all)?;
    let p = old.degree();
    respan(patch, direction, new, |line, i, new| {
        let span = old.find_span(new.greville(i));
        blossom(old, span, &line[span - p..=span], &new.knots()[i + 1..=i + p])
    })
}

/// Raises the degree along `direction` by `times`; the map and its continuity stay the same.
///
/// # Errors
/// [`Error::Input`] (`geometry.degree`) when the new degree is above [`MAX_DEGREE`].
pub fn elevate_degree(patch: &Patch, direction: usize, times: usize) -> Result<Patch> {
    let wanted = patch.knots(direction).degree().saturating_add(times);
    if wanted > MAX_DEGREE {
        let help = format!("degrees go up to {MAX_DEGREE}");
        return Err(Error::input("geometry.degree", format!("degree {wanted} is not possible"), help));
    }
    (0..times).try_fold(patch.clone(), |patch, _| elevate_once(&patch, direction))
}

/// The same body on a finer mesh: every degree raised by `elevations`, then every knot span halved `halvings` times.
///
/// A field over the patch is refined alike: give it as a patch with the same knots and weights, whose points are the
/// coefficients of the field.
///
/// # Errors
/// Those of [`elevate_degree`]; [`Error::Input`] when the control points become too many to be numbered.
pub fn refined(patch: &Patch, elevations: usize, halvings: usize) -> Result<Patch> {
    let mut fine = patch.clone();
    for direction in 0..patch.dimension() {
        fine = elevate_degree(&fine, direction, elevations)?;
        for _ in 0..halvings {
            let knots = fine.knots(direction);
            let middle = |span: usize| 0.5 * (knots.knots()[span] + knots.knots()[span + 1]);
            let middles: Vec<f64> = knots.spans().into_iter().map(middle).collect();
            fine = insert_knots(&fine, direction, &middles)?;
        }
    }
    Ok(fine)
}

/// The pieces of the patch, one an element, in C order.
pub fn bezier_elements(patch: &Patch) -> Vec<BezierElement> {
    patch.elements().into_iter().map(|span| bezier_element(patch, span)).collect()
}

/// One piece: along each direction, point i of it is f[a, .., a, b, .., b] with i times b, on the span [a, b].
fn bezier_element(patch: &Patch, span: [usize; 3]) -> BezierElement {
    let degree = patch.degree();
    let mut nodes = Vec::new();
    patch.element_nodes(span, &mut nodes);
    let mut net: Vec<Homogeneous> = nodes.iter().map(|&node| homogeneous(patch, node as usize)).collect();
    let (start, end) = patch.element_bounds(span);
    for a in 0..patch.dimension() {
        let (p, stride) = (degree[a], degree[a + 1..].iter().map(|p| p + 1).product::<usize>());
        let mut line = [[0.0; 4]; MAX_DEGREE + 1];
        for first in (0..net.len()).filter(|node| node / stride % (p + 1) == 0) {
            (0..=p).for_each(|i| line[i] = net[first + i * stride]);
            for i in 0..=p {
                let mut arguments = [start[a]; MAX_DEGREE];
                arguments[p - i..p].fill(end[a]);
                net[first + i * stride] = blossom(patch.knots(a), span[a], &line[..=p], &arguments[..p]);
            }
        }
    }
    let points = net.iter().map(|&[x, y, z, w]| [x / w, y / w, z / w]).collect();
    BezierElement { degree, points, weights: net.iter().map(|point| point[3]).collect() }
}

/// Degree p to p + 1: every distinct knot stands once more.
fn elevate_once(patch: &Patch, direction: usize) -> Result<Patch> {
    let old = patch.knots(direction);
    let p = old.degree();
    let mut all: Vec<f64> = old.knots().to_vec();
    all.dedup();
    all.extend_from_slice(old.knots());
    all.sort_by(f64::total_cmp);
    let new = KnotVector::new(p + 1, all)?;
    respan(patch, direction, new, |line, i, new| {
        let span = old.find_span(new.greville(i));
        let arguments = &new.knots()[i + 1..=i + p + 1];
        let mut mean = [0.0; 4];
        for left_out in 0..=p {
            let mut rest = [0.0; MAX_DEGREE];
            rest[..left_out].copy_from_slice(&arguments[..left_out]);
            rest[left_out..p].copy_from_slice(&arguments[left_out + 1..]);
            let value = blossom(old, span, &line[span - p..=span], &rest[..p]);
            mean = std::array::from_fn(|c| mean[c] + value[c]);
        }
        mean.map(|sum| sum / (p + 1) as f64)
    })
}

/// Replaces the knots of `direction`; `point_of(line, i, new knots)` gives new control point i of an old grid line.
fn respan(
    patch: &Patch,
    direction: usize,
    new: KnotVector,
    point_of: impl Fn(&[Homogeneous], usize, &KnotVector) -> Homogeneous,
) -> Result<Patch> {
    let extents = patch.grid().extents();
    let (old_len, new_len) = (extents[direction], new.len());
    let after: usize = extents[direction + 1..].iter().product();
    let before: usize = extents[..direction].iter().product();
    let mut points = vec![[0.0; 3]; before * new_len * after];
    let mut weights = vec![0.0; before * new_len * after];
    let mut line = vec![[0.0; 4]; old_len];
    for outer in 0..before {
        for inner in 0..after {
            for (i, entry) in line.iter_mut().enumerate() {
                let node = (outer * old_len + i) * after + inner;
                *entry = homogeneous(patch, node);
            }
            for i in 0..new_len {
                let [x, y, z, w] = point_of(&line, i, &new);
                let node = (outer * new_len + i) * after + inner;
                points[node] = [x / w, y / w, z / w];
                weights[node] = w;
            }
        }
    }
    let mut knots: Vec<KnotVector> = (0..patch.dimension()).map(|a| patch.knots(a).clone()).collect();
    knots[direction] = new;
    Patch::new(knots, points, weights)
}

fn homogeneous(patch: &Patch, node: usize) -> Homogeneous {
    let ([x, y, z], w) = (patch.points()[node], patch.weights()[node]);
    [w * x, w * y, w * z, w]
}

/// f[arguments] of the piece f of a spline on `span`; `local`: the p + 1 control points that act on it, `arguments`: p
/// values, ascending.
///
/// Arguments left of the piece are used in ascending order, those right of it in descending order: then the triangle
/// only takes means of points (weights between 0 and 1), and a point whose knots are old knots comes out bit for bit.
fn blossom(knots: &KnotVector, span: usize, local: &[Homogeneous], arguments: &[f64]) -> Homogeneous {
    let (p, t) = (knots.degree(), knots.knots());
    let right_of = arguments.partition_point(|&argument| argument <= t[span]);
    let mut points = [[0.0; 4]; MAX_DEGREE + 1];
    points[..=p].copy_from_slice(local);
    let ordered = arguments[..right_of].iter().chain(arguments[right_of..].iter().rev());
    for (level, &argument) in ordered.enumerate() {
        for j in (level + 1..=p).rev() {
            let (left, right) = (t[span - p + j], t[span + j - level]);
            let share = (argument - left) / (right - left);
            points[j] = std::array::from_fn(|c| (1.0 - share) * points[j - 1][c] + share * points[j][c]);
        }
    }
    points[p]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy() -> Patch {
        let u = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 2.5, 4.0, 4.0, 4.0]).unwrap();
        let v = KnotVector::open_uniform(1, 3).unwrap();
        let points = (0..15).map(|i| [(i / 3) as f64, (i % 3) as f64 + 0.1 * (i as f64).sin(), 0.0]).collect();
        Patch::new(vec![u, v], points, (0..15).map(|i| 1.0 + 0.3 * (i as f64).cos()).collect()).unwrap()
    }

    #[test]
    fn inserting_nothing_changes_no_point() {
        let patch = wavy();
        let same = insert_knots(&patch, 0, &[]).unwrap();
        assert_eq!(patch.weights(), same.weights());
        for (a, b) in patch.points().iter().zip(same.points()) {
            assert!((0..3).all(|c| (a[c] - b[c]).abs() <= f64::EPSILON * a[c].abs()));
        }
    }

    #[test]
    fn pieces_are_the_patch_at_their_corners() {
        let patch = wavy();
        let pieces = bezier_elements(&patch);
        assert_eq!(pieces.len(), patch.elements().len());
        for (piece, span) in pieces.iter().zip(patch.elements()) {
            let (start, end) = patch.element_bounds(span);
            let (first, last) = (patch.evaluate(start), patch.evaluate(end));
            assert_eq!(piece.degree, [2, 1, 0]);
            for c in 0..3 {
                assert!((piece.points[0][c] - first[c]).abs() < 1e-15);
                assert!((piece.points[5][c] - last[c]).abs() < 2e-15);
            }
        }
    }

    #[test]
    fn a_refined_patch_is_the_same_map() {
        let patch = wavy();
        let fine = refined(&patch, 1, 2).unwrap();
        assert_eq!((fine.degree(), fine.elements().len()), ([3, 2, 0], 16 * patch.elements().len()));
        for i in 0..=40 {
            let xi = [f64::from(i) / 10.0, f64::from(i * 7 % 41) / 40.0, 0.0];
            let (a, b) = (patch.evaluate(xi), fine.evaluate(xi));
            assert!((0..2).all(|c| (a[c] - b[c]).abs() < 1e-14), "{xi:?}: {a:?} {b:?}");
        }
    }

    #[test]
    fn knots_outside_and_degrees_above_the_limit_are_refused() {
        let patch = wavy();
        for knots in [vec![-1.0], vec![4.5], vec![f64::NAN], vec![1.0, 1.0], vec![0.0]] {
            assert!(insert_knots(&patch, 0, &knots).is_err(), "{knots:?}");
        }
        assert!(elevate_degree(&patch, 0, MAX_DEGREE).is_err());
        assert!(elevate_degree(&patch, 0, usize::MAX).is_err());
    }
}
