//! Geometry against numbers from elsewhere: checks N1 to N5 of reference/verification.json, the bodies of
//! reference/objects.json, and the exact surfaces of the curved bodies at several resolutions and degrees.

use proptest::prelude::*;
use serde_json::Value;
use springfit::geometry::basis::derivatives;
use springfit::geometry::knots::KnotVector;
use springfit::geometry::measure::{element_measures, measure};
use springfit::geometry::patch::Patch;
use springfit::geometry::refine::{bezier_elements, elevate_degree, insert_knots};
use springfit::geometry::shapes::{self, ShapeRequest};

const VERIFICATION: &str = include_str!("reference/verification.json");
const OBJECTS: &str = include_str!("reference/objects.json");

/// The "expected" entry of a check.
fn expected(id: &str) -> Value {
    let checks: Value = serde_json::from_str(VERIFICATION).unwrap();
    let check = checks.as_array().unwrap().iter().find(|check| check["id"] == id);
    check.unwrap()["expected"].clone()
}

/// A number, or a fraction such as "-5/2" or a decimal with many digits in a string.
fn number(value: &Value) -> f64 {
    match value.as_str() {
        None => value.as_f64().unwrap(),
        Some(text) => match text.split_once('/') {
            Some((top, bottom)) => top.parse::<f64>().unwrap() / bottom.parse::<f64>().unwrap(),
            None => text.parse().unwrap(),
        },
    }
}

fn thesis_knots() -> [KnotVector; 2] {
    [
        KnotVector::new(2, vec![0.0, 0.0, 0.0, 0.2, 0.4, 0.4, 0.8, 1.0, 1.0, 1.0]).unwrap(),
        KnotVector::new(2, vec![0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0]).unwrap(),
    ]
}

/// The named shape in its default size.
fn body(name: &str, control_points: &[usize], degree: &[usize]) -> Patch {
    let shape = shapes::find(name).unwrap();
    let request =
        ShapeRequest { control_points: control_points.to_vec(), degree: degree.to_vec(), ..shape.default_request() };
    (shape.build)(&request).unwrap()
}

/// Parameters on an even grid over a patch, the ends included.
fn samples(patch: &Patch, steps: usize) -> Vec<[f64; 3]> {
    let along = |a: usize, i: usize| {
        if a == patch.dimension() {
            return 0.0;
        }
        let (start, end) = patch.knots(a).range();
        start + (end - start) * (i as f64 / steps as f64)
    };
    let last = if patch.dimension() == 3 { steps } else { 0 };
    let mut all = Vec::new();
    for i in 0..=steps {
        for j in 0..=steps {
            all.extend((0..=last).map(|k| [along(0, i), along(1, j), along(2, k)]));
        }
    }
    all
}

/// The element that holds a parameter.
fn element_at(patch: &Patch, xi: [f64; 3]) -> [usize; 3] {
    std::array::from_fn(|a| if a < patch.dimension() { patch.knots(a).find_span(xi[a]) } else { 0 })
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// Largest distance between two patches over sampled parameters, relative to the largest coordinate.
fn difference(a: &Patch, b: &Patch) -> f64 {
    let size = a.points().iter().flatten().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    samples(a, 13).iter().map(|&xi| distance(a.evaluate(xi), b.evaluate(xi))).fold(0.0, f64::max) / size
}

#[test]
fn n1_thesis_2_5_1_mesh_counts() {
    let expected = expected("N1");
    let knots = thesis_knots();
    let shape: Vec<usize> = knots.iter().map(KnotVector::len).collect();
    let boxes: usize = knots.iter().map(|knots| knots.knots().len() - 1).product();
    let nodes = shape.iter().product();
    let patch = Patch::new(knots.to_vec(), vec![[0.0; 3]; nodes], vec![1.0; nodes]).unwrap();
    assert_eq!(serde_json::json!(shape), expected["n"]);
    assert_eq!(patch.grid().len(), expected["control_points"]);
    assert_eq!(boxes, expected["all_span_boxes"]);
    assert_eq!(patch.elements().len(), expected["nonempty_elements"]);
    assert_eq!(boxes - patch.elements().len(), expected["empty_boxes"]);
}

#[test]
fn n2_thesis_2_5_1_basis_values() {
    let knots = thesis_knots();
    for (place, values) in expected("N2").as_object().unwrap() {
        let (direction, xi) = place.split_once('=').unwrap();
        let (knots, xi) = (&knots[usize::from(direction == "xi2")], number(&Value::from(xi)));
        let mut all = [vec![0.0; knots.len()], vec![0.0; knots.len()]];
        let (span, mut out) = (knots.find_span(xi), [0.0; 6]);
        derivatives(knots, span, xi, 1, &mut out);
        for j in 0..3 {
            all[0][span - 2 + j] = out[j];
            all[1][span - 2 + j] = out[3 + j];
        }
        for (order, (key, tolerance)) in [("N", 1e-15), ("dN", 2e-14)].into_iter().enumerate() {
            for (ours, theirs) in all[order].iter().zip(values[key].as_array().unwrap()) {
                let error = (ours - number(theirs)).abs();
                assert!(error <= tolerance, "{place} {key}: {ours} instead of {theirs}");
            }
        }
    }
}

/// Point, first and second derivative of the quarter circle with one span.
fn quarter_circle(t: f64) -> [[f64; 2]; 3] {
    let knots = KnotVector::open_uniform(2, 3).unwrap();
    let weights = [1.0, std::f64::consts::FRAC_1_SQRT_2, 1.0];
    let points = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut out = [0.0; 9];
    derivatives(&knots, 2, t, 2, &mut out);
    let weight: [f64; 3] = std::array::from_fn(|k| (0..3).map(|j| out[3 * k + j] * weights[j]).sum());
    let mut curve = [[0.0; 2]; 3];
    for c in 0..2 {
        let a: [f64; 3] = std::array::from_fn(|k| (0..3).map(|j| out[3 * k + j] * weights[j] * points[j][c]).sum());
        // Quotient rule on A = W C.
        curve[0][c] = a[0] / weight[0];
        curve[1][c] = (a[1] - weight[1] * curve[0][c]) / weight[0];
        curve[2][c] = (a[2] - 2.0 * weight[1] * curve[1][c] - weight[2] * curve[0][c]) / weight[0];
    }
    curve
}

#[test]
fn n3_quarter_circle_points_and_derivatives() {
    for (t, values) in expected("N3").as_object().unwrap() {
        let ours = quarter_circle(t.parse().unwrap());
        for (order, (key, tolerance)) in [("C", 2e-16), ("C'", 1e-14), ("C''", 1e-14)].into_iter().enumerate() {
            let theirs: Vec<f64> = values[key].as_array().unwrap().iter().map(number).collect();
            let error = (ours[order][0] - theirs[0]).hypot(ours[order][1] - theirs[1]) / theirs[0].hypot(theirs[1]);
            assert!(error <= tolerance, "{key}({t}): {:?} instead of {theirs:?}, error {error:e}", ours[order]);
        }
    }
}

#[test]
fn n4_areas_and_volumes() {
    let bodies: [(&str, &str, &[usize], &[usize]); 5] = [
        ("disc R=1 (one biquadratic patch)", "circle", &[3, 3], &[2, 2]),
        ("quarter ring 1<r<2", "quarter_ring", &[2, 3], &[1, 2]),
        ("torus R=0.875 r=0.375 (thesis size)", "torus", &[9, 3, 3], &[2, 2, 2]),
        ("sphere shell octant 1<r<2", "sphere_shell_octant", &[3, 3, 2], &[2, 2, 1]),
        ("ball octant (a=0)", "ball_octant", &[3, 3, 2], &[2, 2, 1]),
    ];
    let expected = expected("N4");
    assert_eq!(expected.as_object().unwrap().len(), bodies.len());
    for (key, name, control_points, degree) in bodies {
        let patch = body(name, control_points, degree);
        let exact = expected[key].as_f64().unwrap();
        let error = |patch: &Patch, extra: usize| (measure(patch, extra) / exact - 1.0).abs();
        // On the coarsest patch, one span a quarter or a half of a circle, each point more gains a factor of 20:
        // 1e-3 .. 1e-4 with p + 1 points, 5e-9 with p + 5, 1e-12 from p + 8 on.
        assert!((5e-5..2e-3).contains(&error(&patch, 0)), "{name}: {:e}", error(&patch, 0));
        assert!(error(&patch, 4) <= 1e-8, "{name}: {:e}", error(&patch, 4));
        assert!(error(&patch, 7) <= 1e-12, "{name}: {:e}", error(&patch, 7));
        // With four spans along each arc (seven times four around the torus) p + 5 points are enough.
        let finer: Vec<usize> =
            control_points.iter().zip(degree).map(|(n, p)| if *p == 1 { *n } else { 4 * (n - p) + p }).collect();
        let fine = body(name, &finer, degree);
        assert!(error(&fine, 4) <= 1e-12, "{name} {finer:?}: {:e}", error(&fine, 4));
    }
}

#[test]
fn n5_partition_of_unity_and_derivative_sums() {
    for shape in shapes::SHAPES {
        let patch = (shape.build)(&shape.default_request()).unwrap();
        let (mut out, mut nodes) = (patch.workspace(), Vec::new());
        for xi in samples(&patch, 7) {
            let span = element_at(&patch, xi);
            patch.shape_functions(span, xi, &mut out);
            assert!((out.values.iter().sum::<f64>() - 1.0).abs() <= 1e-15, "{} {xi:?}", shape.name);
            assert!(distance(out.point, patch.evaluate(xi)) <= 1e-15, "{} {xi:?}", shape.name);
            // Near a collapsed face or corner the gradients grow without bound.
            if out.determinant.abs() < 1e-3 {
                continue;
            }
            patch.element_nodes(span, &mut nodes);
            for a in 0..shape.dimension {
                let size: f64 = out.gradients.iter().map(|gradient| gradient[a].abs()).sum();
                let sum: f64 = out.gradients.iter().map(|gradient| gradient[a]).sum();
                assert!(sum.abs() <= 1e-15 * size, "{} {xi:?}: {sum:e} of {size:e}", shape.name);
                // The map reproduces its own coordinates: sum_i dR_i/dx_a x_i,b = 1 when a = b, else 0.
                for b in 0..shape.dimension {
                    let pairs = out.gradients.iter().zip(&nodes);
                    let sum: f64 = pairs.map(|(g, &node)| g[a] * patch.points()[node as usize][b]).sum();
                    let exact = if a == b { 1.0 } else { 0.0 };
                    assert!((sum - exact).abs() <= 2e-14, "{} {xi:?}: {sum:e}", shape.name);
                }
            }
        }
    }
}

#[test]
fn n5_derivatives_are_central_differences() {
    let patch = body("torus", &[11, 5, 6], &[2, 3, 2]);
    let mut out = patch.workspace();
    let h = 1e-6;
    for xi in [[0.3, 0.2, 0.1], [2.55, 0.81, 0.4], [3.9, 0.5, 0.97]] {
        patch.shape_functions(element_at(&patch, xi), xi, &mut out);
        for b in 0..3 {
            let (mut before, mut after) = (xi, xi);
            before[b] -= h;
            after[b] += h;
            let (before, after) = (patch.evaluate(before), patch.evaluate(after));
            for a in 0..3 {
                let slope = (after[a] - before[a]) / (2.0 * h);
                assert!((out.jacobian[a][b] - slope).abs() < 1e-9, "{} against {slope}", out.jacobian[a][b]);
            }
        }
    }
}

#[test]
fn n5_knot_insertion_and_degree_elevation() {
    for shape in shapes::SHAPES {
        let patch = (shape.build)(&shape.default_request()).unwrap();
        for a in 0..shape.dimension {
            let (start, end) = patch.knots(a).range();
            let knots: Vec<f64> = (1..40).map(|i| start + (end - start) * (i as f64 / 40.0 + 0.001)).collect();
            let finer = insert_knots(&patch, a, &knots).unwrap();
            let higher = elevate_degree(&patch, a, 3).unwrap();
            for other in [finer, higher] {
                assert!(difference(&patch, &other) <= 2e-15, "{} {a}", shape.name);
            }
        }
    }
}

#[test]
fn weights_of_refined_patches_are_exact() {
    for (control_points, degree) in [([6, 6], [2, 2]), ([7, 9], [3, 4]), ([12, 8], [5, 7])] {
        let (coarse, fine) = (body("circle", &[3, 3], &[2, 2]), body("circle", &control_points, &degree));
        // The weight function is the map of a patch whose points are its weights, without weights.
        let height = |patch: &Patch| {
            let points = patch.weights().iter().map(|&w| [w, 0.0, 0.0]).collect();
            let knots = vec![patch.knots(0).clone(), patch.knots(1).clone()];
            Patch::new(knots, points, vec![1.0; patch.weights().len()]).unwrap()
        };
        assert!(difference(&height(&coarse), &height(&fine)) <= 1e-15);
        for corner in [0, control_points[1] - 1, fine.weights().len() - 1] {
            assert_eq!(fine.weights()[corner], 1.0);
        }
    }
    let cube = insert_knots(&body("cube", &[6, 6, 6], &[2, 2, 2]), 0, &[0.1, 0.37, 0.77]).unwrap();
    assert!(elevate_degree(&cube, 1, 3).unwrap().weights().iter().all(|&weight| weight == 1.0));
}

#[test]
fn objects_json_measures_and_rest_lengths() {
    let objects: Value = serde_json::from_str(OBJECTS).unwrap();
    for name in ["square", "circle", "cube", "torus"] {
        let shape = shapes::find(name).unwrap();
        let patch = (shape.build)(&shape.default_request()).unwrap();
        let reference = &objects["objects"][name]["reference"];
        let lengths = neighbour_lengths(&patch);
        let close = |key: &str, ours: f64| {
            let theirs = reference[key].as_f64().unwrap();
            assert!((ours / theirs - 1.0).abs() < 1e-13, "{name} {key}: {ours} instead of {theirs}");
        };
        assert_eq!(patch.grid().len(), reference["nodes"]);
        assert_eq!(lengths.len(), reference["springs"]);
        close("volume_or_area", measure(&patch, 0));
        close("min_length", lengths[0]);
        close("max_length", lengths[lengths.len() - 1]);
        close("sum_rest_lengths", lengths.iter().sum());
        assert_eq!(element_measures(&patch, 0).len(), patch.elements().len());
    }
}

/// Distances between all nodes whose index offset lies in {-1, 0, 1}^d, ascending.
fn neighbour_lengths(patch: &Patch) -> Vec<f64> {
    let grid = patch.grid();
    let near = |i: usize, j: usize| {
        let (a, b) = (grid.index(i), grid.index(j));
        (0..3).all(|c| a[c].abs_diff(b[c]) <= 1)
    };
    let mut lengths = Vec::new();
    for j in 0..grid.len() {
        lengths.extend((0..j).filter(|&i| near(i, j)).map(|i| distance(patch.points()[i], patch.points()[j])));
    }
    lengths.sort_by(f64::total_cmp);
    lengths
}

#[test]
fn circles_and_ellipses_have_their_exact_boundary() {
    for (n, p) in [(3, 2), (6, 2), (17, 2), (9, 3), (12, 5), (10, 9)] {
        for (name, half_axes) in [("circle", [1.0, 1.0]), ("ellipse", [1.0, 0.5])] {
            let patch = body(name, &[n, n + 1], &[p, p]);
            for t in (0..=40).map(|i| i as f64 / 40.0) {
                for xi in [[t, 0.0, 0.0], [t, 1.0, 0.0], [0.0, t, 0.0], [1.0, t, 0.0]] {
                    let [x, y, _] = patch.evaluate(xi);
                    let level = (x / half_axes[0]).powi(2) + (y / half_axes[1]).powi(2);
                    assert!((level - 1.0).abs() <= 3e-15, "{name} n {n} p {p} at {xi:?}: {:e}", level - 1.0);
                }
            }
        }
    }
}

#[test]
fn the_torus_has_its_exact_surface_and_a_closed_seam() {
    for (control_points, p) in [([9, 3, 3], 2), ([9, 5, 5], 2), ([24, 6, 7], 2), ([15, 7, 5], 3), ([17, 5, 5], 4)] {
        let patch = body("torus", &control_points, &[p, p, p]);
        let seam = control_points[1] * control_points[2];
        let (first, last) = (&patch.points()[..seam], &patch.points()[patch.points().len() - seam..]);
        assert_eq!(first, last, "the ends of the sweep lie on each other to the last bit");
        for t in (0..=20).map(|i| i as f64 / 20.0) {
            for around in (0..=20).map(|i| i as f64 / 5.0) {
                for [u, v] in [[t, 0.0], [t, 1.0], [0.0, t], [1.0, t]] {
                    let [x, y, z] = patch.evaluate([around, u, v]);
                    let error = (x.hypot(y) - 0.875).hypot(z) - 0.375;
                    assert!(error.abs() <= 3e-15, "{control_points:?} p {p}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn the_spheroid_is_a_body_of_revolution_about_x() {
    let knots = KnotVector::open_uniform(2, 10).unwrap();
    let radii = [0.2, 0.4, 0.5, 0.4, 0.3, 0.3, 0.4, 0.5, 0.4, 0.2];
    for (control_points, degree) in
        [([9, 10, 3], [2, 2, 1]), ([17, 18, 5], [2, 2, 1]), ([13, 20, 6], [3, 3, 2]), ([17, 26, 9], [4, 4, 3])]
    {
        let patch = body("spheroid", &control_points, &degree);
        for [around, along, layer] in samples(&patch, 15) {
            let (span, mut basis) = (knots.find_span(along), [0.0; 3]);
            derivatives(&knots, span, along, 0, &mut basis);
            let radius: f64 = (0..3).map(|j| basis[j] * radii[span - 2 + j]).sum();
            let [_, y, z] = patch.evaluate([around, along, layer]);
            let error = y.hypot(z) - radius * (0.5 + 0.5 * layer);
            assert!(error.abs() <= 2e-15, "{control_points:?}: {error:e}");
        }
    }
}

#[test]
fn size_scales_the_body() {
    for shape in shapes::SHAPES {
        let default = (shape.build)(&shape.default_request()).unwrap();
        let mut request = shape.default_request();
        let factors = [2.0, 0.5, 3.0];
        request.size.iter_mut().zip(factors).for_each(|(size, factor)| *size *= factor);
        let scaled = (shape.build)(&request).unwrap();
        let factor: f64 = factors[..shape.dimension].iter().product();
        let error = measure(&scaled, 1) / (factor * measure(&default, 1)) - 1.0;
        assert!(error.abs() < 1e-13, "{}: {error:e}", shape.name);
    }
}

/// An open knot vector with up to four inner knots of any multiplicity that is allowed, some spans far shorter.
fn any_knots() -> impl Strategy<Value = KnotVector> {
    (1usize..=4).prop_flat_map(|p| {
        (Just(p), prop::collection::vec((1usize..=p, -3.0..0.0f64), 0..5), -3.0..0.0f64).prop_map(|(p, inner, last)| {
            let mut at = -1.0;
            let mut knots = vec![at; p + 1];
            for (times, gap) in inner {
                at += 10f64.powf(gap);
                knots.extend(std::iter::repeat_n(at, times));
            }
            knots.extend(std::iter::repeat_n(at + 10f64.powf(last), p + 1));
            KnotVector::new(p, knots).unwrap()
        })
    })
}

/// A plane or solid patch over random knots, points off the even grid by up to 0.4, weights from 0.2 to 5.
fn any_patch() -> impl Strategy<Value = Patch> {
    prop::collection::vec(any_knots(), 2..=3).prop_flat_map(|knots| {
        let shape: Vec<usize> = knots.iter().map(KnotVector::len).collect();
        let grid = springfit::geometry::grid::Grid::new(&shape);
        let entry = ([-0.4..0.4f64, -0.4..0.4f64, -0.4..0.4f64], 0.2..5.0f64);
        prop::collection::vec(entry, grid.len()).prop_map(move |entries| {
            let place = |node: usize, off: [f64; 3]| {
                let index = grid.index(node);
                std::array::from_fn(|a| if a < grid.dimension() { index[a] as f64 + off[a] } else { 0.0 })
            };
            let points = entries.iter().enumerate().map(|(node, entry)| place(node, entry.0)).collect();
            Patch::new(knots.clone(), points, entries.iter().map(|entry| entry.1).collect()).unwrap()
        })
    })
}

/// A parameter inside a patch from three numbers in [0, 1].
fn parameter(patch: &Patch, at: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|a| {
        if a >= patch.dimension() {
            return 0.0;
        }
        let (start, end) = patch.knots(a).range();
        start + (end - start) * at[a]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn n5_random_bases_sum_to_one(knots in any_knots(), at in 0.0..=1.0f64) {
        let (p, (start, end)) = (knots.degree(), knots.range());
        let xi = start + (end - start) * at;
        let mut out = [0.0; 30];
        derivatives(&knots, knots.find_span(xi), xi, p + 1, &mut out);
        let row = |k: usize| &out[k * (p + 1)..(k + 1) * (p + 1)];
        prop_assert!((row(0).iter().sum::<f64>() - 1.0).abs() <= 1e-15);
        prop_assert!(row(0).iter().all(|&value| value >= 0.0));
        for k in 1..=p {
            let size: f64 = row(k).iter().map(|value| value.abs()).sum();
            prop_assert!(row(k).iter().sum::<f64>().abs() <= 1e-14 * size);
        }
        prop_assert!(row(p + 1).iter().all(|&value| value == 0.0));
    }

    #[test]
    fn n5_random_patches_keep_their_map(
        patch in any_patch(), direction in 0usize..3, at in prop::collection::vec(0.01..0.99f64, 1..8), times in 1usize..3,
    ) {
        let a = direction % patch.dimension();
        let (start, end) = patch.knots(a).range();
        let knots: Vec<f64> = at.iter().map(|at| start + (end - start) * at).collect();
        for other in [insert_knots(&patch, a, &knots).unwrap(), elevate_degree(&patch, a, times).unwrap()] {
            let error = difference(&patch, &other);
            prop_assert!(error <= 5e-15, "{error:e}");
        }
    }

    #[test]
    fn random_patches_are_their_bezier_pieces(patch in any_patch(), at in [0.0..=1.0f64, 0.0..=1.0f64, 0.0..=1.0f64]) {
        let xi = parameter(&patch, at);
        let span = element_at(&patch, xi);
        let element = patch.elements().iter().position(|&other| other == span).unwrap();
        let piece = bezier_elements(&patch).swap_remove(element);
        let (from, to) = patch.element_bounds(span);
        let knots = (0..patch.dimension()).map(|a| {
            let ends = [vec![from[a]; piece.degree[a] + 1], vec![to[a]; piece.degree[a] + 1]];
            KnotVector::new(piece.degree[a], ends.concat()).unwrap()
        });
        let alone = Patch::new(knots.collect(), piece.points.clone(), piece.weights.clone()).unwrap();
        let size = patch.points().iter().flatten().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let error = distance(alone.evaluate(xi), patch.evaluate(xi)) / size;
        prop_assert!(error <= 5e-15, "{error:e}");
    }
}
