//! The bodies that can be asked for by name, at any resolution and degree.
//!
//! A box is built directly: equally spaced control points, open uniform knots, weights 1; n >= p + 1 control points along
//! each direction. A curved body starts from its coarsest exact patch. Along each direction its degree is raised, then
//! knots are inserted, so that finer versions are exactly the same body:
//!
//! - raising the degree by one adds one control point a span;
//! - the control points still missing are inserted as knots: the same number into every span, one more into the first
//!   spans when it does not divide, equally spaced inside the span.
//!
//! Example: the circle is one 3 x 3 patch of degree 2. With 6 x 6 control points the knots 1/4, 1/2, 3/4 are inserted,
//! with 5 x 5 the knots 1/3, 2/3; at degree 3 it has 4 x 4 control points before any knot is inserted.
//!
//! At last the body is scaled along each axis by the wanted size over the default size. Faces are named by the direction
//! of the control grid, "x-" being the first index of the first direction (`selection`).

mod boxes;
mod plane;
mod space;

use super::grid::Grid;
use super::knots::MAX_DEGREE;
use super::patch::{MAX_NODES, Patch};
use super::refine::{elevate_degree, insert_knots};
use crate::error::{Error, Result};

/// A body in the table.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Name in a scene.
    pub name: &'static str,
    /// What it is, in a line.
    pub doc: &'static str,
    /// Directions, 2 or 3.
    pub dimension: usize,
    /// Control points along each direction when a scene does not say.
    pub default_control_points: &'static [usize],
    /// Degree of each direction when a scene does not say.
    pub default_degree: &'static [usize],
    /// Nominal extent along x, y and z (m); the third is 0 in the plane.
    pub default_size: [f64; 3],
    /// Face that is usually held.
    pub fixed_face: &'static str,
    /// Force on every free control point (N) in the source, Table 5.2; ours where the source has none.
    pub default_force: [f64; 3],
    /// True when it has straight edges and flat faces, so that degree 1 describes it.
    pub straight: bool,
    /// Builds the patch. Its errors name `geometry.control_points`, `geometry.degree` or `geometry.size`.
    pub build: fn(&ShapeRequest) -> Result<Patch>,
}

/// What a scene asks of a shape: one number for every direction.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeRequest {
    /// Control points along each direction.
    pub control_points: Vec<usize>,
    /// Degree of each direction.
    pub degree: Vec<usize>,
    /// Extent along each axis (m).
    pub size: Vec<f64>,
}

impl Shape {
    /// The request that a scene without numbers makes.
    pub fn default_request(&self) -> ShapeRequest {
        ShapeRequest {
            control_points: self.default_control_points.to_vec(),
            degree: self.default_degree.to_vec(),
            size: self.default_size[..self.dimension].to_vec(),
        }
    }

    /// A grid of nodes on the body (m), `request.control_points` of them along each direction: at equally spaced parameters
    /// of the exact patch. The degree of the request is not looked at.
    ///
    /// # Errors
    /// Those of [`Shape::build`]; a curved body needs no more than two nodes a direction.
    pub fn nodes(&self, request: &ShapeRequest) -> Result<Vec<[f64; 3]>> {
        let counts = &request.control_points;
        if self.straight {
            let linear = ShapeRequest { degree: vec![1; self.dimension], ..request.clone() };
            return Ok((self.build)(&linear)?.points().to_vec());
        }
        check_request(self.dimension, &ShapeRequest { degree: self.default_degree.to_vec(), ..request.clone() })?;
        check_control_points(request, &vec![2; self.dimension])?;
        let patch = (self.build)(&ShapeRequest { size: request.size.clone(), ..self.default_request() })?;
        let (grid, parameters) = (Grid::new(counts), |a: usize| patch.knots(a).knots());
        let place = |node: usize| {
            let index = grid.index(node);
            let mut xi = [0.0; 3];
            for a in 0..self.dimension {
                let (first, last) = (parameters(a)[0], parameters(a)[parameters(a).len() - 1]);
                let share = index[a] as f64 / (counts[a] - 1) as f64;
                xi[a] = (1.0 - share) * first + share * last;
            }
            patch.evaluate(xi)
        };
        Ok((0..grid.len()).map(place).collect())
    }
}

/// All shapes; the scene check, the lists and the tests loop over this table.
pub const SHAPES: &[Shape] = &[
    boxes::SQUARE,
    plane::CIRCLE,
    plane::ELLIPSE,
    boxes::CUBE,
    space::TORUS,
    space::SPHEROID,
    boxes::PLATE,
    boxes::BEAM,
    plane::QUARTER_RING,
    plane::PLATE_WITH_HOLE,
    space::SPHERE_SHELL_OCTANT,
    space::BALL_OCTANT,
];

/// The shape with this name.
pub fn find(name: &str) -> Option<&'static Shape> {
    SHAPES.iter().find(|shape| shape.name == name)
}

/// Brings the coarsest patch of a body, of nominal extent `default_size`, to what was asked for.
fn refine_to(coarsest: Patch, default_size: [f64; 3], request: &ShapeRequest) -> Result<Patch> {
    let d = coarsest.dimension();
    check_request(d, request)?;
    let degree: Vec<usize> = (0..d).map(|a| coarsest.knots(a).degree()).collect();
    if request.degree.iter().zip(&degree).any(|(wanted, least)| wanted < least) {
        let message = format!("degree {:?} is too low for this body", request.degree);
        return Err(Error::input("geometry.degree", message, format!("at least {degree:?}")));
    }
    let raise: Vec<usize> = request.degree.iter().zip(&degree).map(|(wanted, least)| wanted - least).collect();
    let least = |a: usize| coarsest.knots(a).len() + raise[a] * coarsest.knots(a).spans().len();
    check_control_points(request, &(0..d).map(least).collect::<Vec<_>>())?;
    let mut patch = coarsest;
    for (a, &times) in raise.iter().enumerate() {
        patch = elevate_degree(&patch, a, times)?;
        let knots = spread_knots(&patch, a, request.control_points[a] - patch.knots(a).len());
        patch = insert_knots(&patch, a, &knots)?;
    }
    scale(&patch, default_size, &request.size)
}

/// `extra` new knots along direction `a`: spread over the spans, the first ones take the remainder.
fn spread_knots(patch: &Patch, a: usize, extra: usize) -> Vec<f64> {
    let spans = patch.knots(a).spans();
    let mut knots = Vec::with_capacity(extra);
    for (rank, &span) in spans.iter().enumerate() {
        let (start, end) = (patch.knots(a).knots()[span], patch.knots(a).knots()[span + 1]);
        let here = extra / spans.len() + usize::from(rank < extra % spans.len());
        knots.extend((1..=here).map(|i| start + (end - start) * (i as f64 / (here + 1) as f64)));
    }
    knots
}

/// Scales a patch along each axis by `size` / `default_size`.
fn scale(patch: &Patch, default_size: [f64; 3], size: &[f64]) -> Result<Patch> {
    let factor: [f64; 3] = std::array::from_fn(|a| size.get(a).map_or(1.0, |size| size / default_size[a]));
    let points = patch.points().iter().map(|x| std::array::from_fn(|a| x[a] * factor[a])).collect();
    let knots = (0..patch.dimension()).map(|a| patch.knots(a).clone()).collect();
    Patch::new(knots, points, patch.weights().to_vec())
}

/// One entry a direction, degrees within the limits, sizes positive.
fn check_request(dimension: usize, request: &ShapeRequest) -> Result<()> {
    let counts = [
        ("geometry.control_points", request.control_points.len()),
        ("geometry.degree", request.degree.len()),
        ("geometry.size", request.size.len()),
    ];
    for (key, given) in counts {
        if given != dimension {
            let message = format!("{given} numbers for a body with {dimension} directions");
            return Err(Error::input(key, message, format!("give {dimension} numbers, one a direction")));
        }
    }
    if request.degree.iter().any(|degree| !(1..=MAX_DEGREE).contains(degree)) {
        let message = format!("degree {:?} is not possible", request.degree);
        return Err(Error::input("geometry.degree", message, format!("degrees go from 1 to {MAX_DEGREE}")));
    }
    if request.size.iter().any(|&size| !(size > 0.0 && size.is_finite())) {
        let message = format!("size {:?} is not possible", request.size);
        return Err(Error::input("geometry.size", message, "sizes are positive and finite, in metres"));
    }
    Ok(())
}

/// Refuses fewer control points than `smallest` along a direction, and more than can be numbered.
fn check_control_points(request: &ShapeRequest, smallest: &[usize]) -> Result<()> {
    let wanted = &request.control_points;
    let refuse = |what: &str, help: String| {
        Err(Error::input("geometry.control_points", format!("{wanted:?} control points are {what}"), help))
    };
    if wanted.iter().zip(smallest).any(|(wanted, smallest)| wanted < smallest) {
        let what = format!("too few for this body at degree {:?}", request.degree);
        return refuse(&what, format!("at least {smallest:?}"));
    }
    match wanted.iter().try_fold(1usize, |product, &n| product.checked_mul(n)) {
        Some(nodes) if nodes <= MAX_NODES => Ok(()),
        _ => refuse("too many to be numbered", format!("at most {MAX_NODES} in all")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_builds_as_it_stands_in_the_table() {
        for shape in SHAPES {
            let request = shape.default_request();
            let patch = (shape.build)(&request).unwrap();
            assert_eq!(patch.dimension(), shape.dimension, "{}", shape.name);
            assert_eq!(patch.grid().shape(), shape.default_control_points, "{}", shape.name);
            assert_eq!(patch.degree()[..shape.dimension], *shape.default_degree, "{}", shape.name);
            assert!(find(shape.name).is_some_and(|found| found.doc == shape.doc));
        }
        assert!(find("pretzel").is_none());
    }

    #[test]
    fn nodes_lie_on_the_body() {
        for shape in SHAPES {
            let counts = vec![3; shape.dimension];
            let request = ShapeRequest { control_points: counts.clone(), ..shape.default_request() };
            let nodes = shape.nodes(&request).unwrap();
            let patch = (shape.build)(&shape.default_request()).unwrap();
            let end = |a: usize| *patch.knots(a).knots().last().unwrap();
            let middle = patch.evaluate(std::array::from_fn(|a| if a < shape.dimension { 0.5 * end(a) } else { 0.0 }));
            let found = nodes[nodes.len() / 2];
            assert!((0..3).all(|a| (found[a] - middle[a]).abs() < 1e-14), "{}: {found:?} {middle:?}", shape.name);
            let linear = ShapeRequest { degree: vec![1; shape.dimension], ..request };
            assert_eq!(shape.straight, (shape.build)(&linear).is_ok(), "{}", shape.name);
        }
    }

    #[test]
    fn no_shape_is_folded_and_only_the_torus_is_left_handed() {
        for shape in SHAPES {
            let patch = (shape.build)(&shape.default_request()).unwrap();
            let mut out = patch.workspace();
            for span in patch.elements() {
                let (start, end) = patch.element_bounds(span);
                patch.shape_functions(span, std::array::from_fn(|a| 0.5 * (start[a] + end[a])), &mut out);
                assert_eq!(out.determinant < 0.0, shape.name == "torus", "{} {span:?}", shape.name);
                assert_ne!(out.determinant, 0.0);
            }
        }
    }

    #[test]
    fn knots_are_spread_over_the_spans() {
        let torus = find("torus").unwrap();
        let mut request = torus.default_request();
        request.control_points = vec![14, 5, 6];
        let patch = (torus.build)(&request).unwrap();
        let inner = |a: usize| patch.knots(a).knots()[3..patch.knots(a).len()].to_vec();
        // Five knots into four spans: two into the first, one into each of the others.
        assert_eq!(inner(0), [1.0 / 3.0, 2.0 / 3.0, 1.0, 1.0, 1.5, 2.0, 2.0, 2.5, 3.0, 3.0, 3.5]);
        assert_eq!(inner(1), [1.0 / 3.0, 2.0 / 3.0]);
        assert_eq!(inner(2), [0.25, 0.5, 0.75]);
    }

    #[test]
    fn impossible_requests_say_what_is_possible() {
        let huge = usize::MAX / 2;
        refused("circle", &[2, 3], &[2, 2], &[2.0; 2], "geometry.control_points", "at least [3, 3]");
        refused("torus", &[12, 4, 4], &[3; 3], &[1.0; 3], "geometry.control_points", "at least [13, 4, 4]");
        refused("spheroid", &[9, 17, 3], &[2, 3, 1], &[1.0; 3], "geometry.control_points", "at least [9, 18, 3]");
        refused("square", &[2, 2], &[2, 1], &[2.0; 2], "geometry.control_points", "at least [3, 2]");
        refused("square", &[huge, 2], &[1, 1], &[2.0; 2], "geometry.control_points", "at most 1431655764 in all");
        refused("circle", &[6, 6], &[1, 2], &[2.0; 2], "geometry.degree", "at least [2, 2]");
        refused("cube", &[6, 6, 6], &[2, 0, 2], &[2.0; 3], "geometry.degree", "degrees go from 1 to 9");
        refused("cube", &[6, 6], &[2; 3], &[2.0; 3], "geometry.control_points", "give 3 numbers, one a direction");
        let sizes = "sizes are positive and finite, in metres";
        refused("cube", &[6; 3], &[2; 3], &[2.0, -1.0, 2.0], "geometry.size", sizes);
        refused("circle", &[6; 2], &[2; 2], &[f64::NAN, 1.0], "geometry.size", sizes);
    }

    fn refused(name: &str, control_points: &[usize], degree: &[usize], size: &[f64], place: &str, allowed: &str) {
        let request =
            ShapeRequest { control_points: control_points.to_vec(), degree: degree.to_vec(), size: size.to_vec() };
        match (find(name).unwrap().build)(&request) {
            Err(Error::Input { key, help, .. }) => assert_eq!((key.as_str(), help.as_str()), (place, allowed)),
            other => panic!("{name} {request:?} gave {other:?}"),
        }
    }
}
