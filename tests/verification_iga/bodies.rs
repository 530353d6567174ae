//! The bodies of the verification problems at any degree and number of elements.

use springfit::geometry::grid::Grid;
use springfit::geometry::knots::KnotVector;
use springfit::geometry::patch::Patch;
use springfit::geometry::refine::{elevate_degree, insert_knots};
use springfit::geometry::shapes::{self, ShapeRequest};

/// A shape of the library in its nominal size.
pub fn shape(name: &str, degree: usize, control_points: &[usize]) -> Patch {
    let shape = shapes::find(name).expect("a shape");
    let request = ShapeRequest {
        control_points: control_points.to_vec(),
        degree: vec![degree; shape.dimension],
        ..shape.default_request()
    };
    (shape.build)(&request).expect("a body")
}

/// The quarter plate with a hole (E3): 2 m x 2 m elements. Raising the degree of the hole's two spans keeps their C1
/// knot, so that direction has p - 2 control points more than the other.
pub fn plate_with_hole(degree: usize, m: usize) -> Patch {
    shape("plate_with_hole", degree, &[2 * m + 2 * degree - 2, 2 * m + degree])
}

/// A quarter of a ring in the first quadrant: first direction radial, second from the x axis to the y axis.
///
/// Degree 1 cannot be round: its control points lie on the circles at equal angles.
pub fn quarter_ring(inner: f64, outer: f64, degree: usize, elements: [usize; 2]) -> Patch {
    if degree == 1 {
        let [radial, angular] = elements;
        let at = |i: usize, j: usize| {
            let r = inner + (outer - inner) * i as f64 / radial as f64;
            let angle = std::f64::consts::FRAC_PI_2 * j as f64 / angular as f64;
            [r * angle.cos(), r * angle.sin(), 0.0]
        };
        let knots = elements.map(|n| KnotVector::open_uniform(1, n + 1).expect("knots"));
        let points: Vec<_> = (0..=radial).flat_map(|i| (0..=angular).map(move |j| at(i, j))).collect();
        let weights = vec![1.0; points.len()];
        return Patch::new(knots.to_vec(), points, weights).expect("a patch");
    }
    let s = 0.5f64.sqrt();
    let arc = |r: f64| [[r, 0.0, 0.0], [r, r, 0.0], [0.0, r, 0.0]];
    let coarse = one_span([1, 2], [arc(inner), arc(outer)].concat(), vec![1.0, s, 1.0, 1.0, s, 1.0]);
    refine(&coarse, degree, elements)
}

/// The rectangle [0, length] x [-depth/2, depth/2].
pub fn rectangle(length: f64, depth: f64, degree: usize, elements: [usize; 2]) -> Patch {
    let y = 0.5 * depth;
    let points = vec![[0.0, -y, 0.0], [0.0, y, 0.0], [length, -y, 0.0], [length, y, 0.0]];
    refine(&one_span([1, 1], points, vec![1.0; 4]), degree, elements)
}

fn one_span(degree: [usize; 2], points: Vec<[f64; 3]>, weights: Vec<f64>) -> Patch {
    let knots = degree.map(|p| KnotVector::open_uniform(p, p + 1).expect("knots"));
    Patch::new(knots.to_vec(), points, weights).expect("a patch")
}

/// Raises both directions to `degree` and cuts their one span into equal elements.
fn refine(coarse: &Patch, degree: usize, elements: [usize; 2]) -> Patch {
    (0..2).fold(coarse.clone(), |body, a| {
        let body = elevate_degree(&body, a, degree - body.degree()[a]).expect("a higher degree");
        let cuts: Vec<f64> = (1..elements[a]).map(|k| k as f64 / elements[a] as f64).collect();
        insert_knots(&body, a, &cuts).expect("more knots")
    })
}

/// A unit square or cube of 3 elements a direction whose inner control points are moved away from their Greville
/// points, where the map would be the identity, by up to a tenth of an element: distorted, not folded. The moves are a
/// fixed quasi-random sequence.
pub fn distorted(dimension: usize, degree: usize) -> Patch {
    let n = degree + 3;
    let knots = KnotVector::open_uniform(degree, n).expect("knots");
    let grid = Grid::new(&vec![n; dimension]);
    let moved = |node: usize| {
        let index = &grid.index(node)[..dimension];
        let on_boundary = index.iter().any(|&i| i == 0 || i == n - 1);
        let mut point = [0.0; 3];
        for (a, &i) in index.iter().enumerate() {
            let turn = 2.0 * ((node * dimension + a + 1) as f64 * 0.618_033_988_75).fract() - 1.0;
            point[a] = knots.greville(i) + if on_boundary { 0.0 } else { 0.1 / 3.0 * turn };
        }
        point
    };
    let points: Vec<_> = (0..grid.len()).map(moved).collect();
    let weights = vec![1.0; points.len()];
    Patch::new(vec![knots.clone(); dimension], points, weights).expect("a patch")
}
