//! Bodies: nodes on one place, poles, seams, left-handed and folded patches, flat cells, weights and knots, one element.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use springfit::error::Error;
use springfit::geometry::dofs::tie_coincident;
use springfit::geometry::knots::KnotVector;
use springfit::geometry::patch::Patch;
use springfit::geometry::shapes;
use springfit::reference::Path;
use springfit::reference::methods::nurbs;
use springfit::scene::Scene;
use springfit::study::{body, plan};

use super::common::{CUBE, SQUARE, parse, refused, run, runs, says, warned};
use super::zero_modes::{connect, dofs, of_continuum, of_network, patch};

/// A scene of a shape with its usual face.
fn shaped(name: &str, geometry: &str) -> String {
    let shape = shapes::find(name).expect("a shape");
    let force = &shape.default_force[..shape.dimension];
    format!(
        "[geometry]\nshape = \"{name}\"\n{geometry}\n[material]\nyoung = 15e3\npoisson = 0.3\n[support]\n\
         faces = [\"{}\"]\n[[load]]\nforce_per_node = {force:?}\n[calibration]\ngamma = 0.5\n",
        shape.fixed_face
    )
}

/// A scene of a patch in a file.
fn of_file(folder: &tempfile::TempDir, text: &str) -> String {
    let path = folder.path().join("patch.json");
    std::fs::write(&path, text).expect("a file");
    SQUARE.replace("shape = \"square\"\ncontrol_points = [4, 4]", &format!("file = {path:?}"))
}

/// A square of 4 x 4 control points with degree 2; `place(i, j)` puts them.
fn square(place: impl Fn(f64, f64) -> [f64; 2]) -> String {
    let points: Vec<[f64; 2]> = (0..16).map(|node| place((node / 4) as f64, (node % 4) as f64)).collect();
    format!("{{\"degree\": [2, 2], \"knots\": [[0,0,0,0.5,1,1,1], [0,0,0,0.5,1,1,1]], \"points\": {points:?}}}")
}

#[test]
fn coincident_control_points() {
    let body = patch(shapes::find("plate_with_hole").expect("a shape"));
    let tied = tie_coincident(body.points(), 1e-9);
    let twice = tied.iter().enumerate().filter(|(node, master)| *node != **master as usize).count();
    assert!(twice > 0, "a corner on which two points lie");
    for merged in [false, true] {
        let study = runs(&shaped("plate_with_hole", &format!("merge_seam = {merged}")));
        let network = &study.lattice.network;
        assert_eq!(network.zero_length > 0, !merged, "the spring between them is counted, unless they are one node");
        assert!(network.springs.iter().all(|spring| spring.length > 0.0 && spring.direction[0].is_finite()));
        match merged {
            true => {
                assert!(!study.warnings.iter().any(|warning| warning.contains("coincident")), "{:?}", study.warnings)
            }
            false => warned(
                &study.warnings,
                &[&format!("{} springs between coincident nodes", network.zero_length), "left out"],
            ),
        }
        let masters = study.body.dofs.masters().count();
        assert_eq!(masters, body.points().len() - if merged { twice } else { 0 });
    }
}

#[test]
fn degenerate_pole() {
    for (name, volume) in [("sphere_shell_octant", PI / 6.0 * 7.0), ("ball_octant", PI / 6.0)] {
        let shape = shapes::find(name).expect("a shape");
        let body = patch(shape);
        let ends = [0.0, 1.0].map(|z| {
            let mut shape = body.workspace();
            let corner = body.elements().into_iter().next_back().expect("an element");
            body.shape_functions(corner, [0.3, 1.0, z], &mut shape);
            shape.determinant
        });
        assert!(ends.iter().any(|det| det.abs() < 1e-12), "{name}: det J is 0 at the pole: {ends:?}");
        let coarse = nurbs::integration_points(&body, 0, 1.0).measure().expect("no fold inside");
        let fine = nurbs::integration_points(&body, 4, 1.0).measure().expect("no fold inside");
        assert!((fine / volume - 1.0).abs() < 1e-9 && (coarse / volume - 1.0).abs() < 1e-2, "{name}: {coarse} {fine}");
        let study = runs(&shaped(name, "merge_seam = true"));
        assert!(study.body.dofs.masters().count() < body.points().len(), "{name}: the nodes of the pole are tied");
        assert!(study.reference.accuracy.backward_error < 1e-12, "{name}");
        // the solution converges under refinement
        let energy = |points: usize| {
            let n = points;
            runs(&shaped(name, &format!("merge_seam = true\ncontrol_points = [{n}, {n}, {n}]"))).reference.cases[0]
                .compliance
                / (n as f64).powi(6)
        };
        let [a, b, c] = [4, 5, 6].map(energy);
        assert!(
            a.is_finite() && b.is_finite() && c.is_finite() && a > 0.0 && b > 0.0 && c > 0.0,
            "{name}: {a} {b} {c}"
        );
    }
}

#[test]
fn seam() {
    for points in [[9, 3, 3], [9, 5, 5]] {
        let shape = shapes::find("torus").expect("a shape");
        let mut request = shape.default_request();
        request.control_points = points.to_vec();
        let body = (shape.build)(&request).expect("a torus");
        let free = dofs(3, body.points(), &[]);
        assert_eq!(free.masters().count(), 8 * points[1] * points[2], "first and last column are one");
        let network = connect("grid", &body.grid(), body.points(), &free);
        let ends: BTreeSet<[u32; 2]> = network
            .springs
            .iter()
            .map(|spring| [spring.nodes[0].min(spring.nodes[1]), spring.nodes[0].max(spring.nodes[1])])
            .collect();
        assert_eq!(ends.len(), network.springs.len(), "no spring twice");
        assert_eq!(of_network(&network, &free), 6);
        assert_eq!(of_continuum(&nurbs::integration_points(&body, 0, 1.0), 0.3, &free), 6);
    }
}

#[test]
fn left_handed_patch() {
    let folder = tempfile::tempdir().expect("a folder");
    let right = runs(&of_file(&folder, &square(|i, j| [i, j])));
    let left_scene = of_file(&folder, &square(|i, j| [3.0 - i, j]));
    let left = runs(&left_scene);
    warned(&left.warnings, &["left-handed", "volumes are taken positive"]);
    warned(&plan::plan(&parse(&left_scene).expect("a scene")).expect("a plan").warnings, &["left-handed"]);
    assert!(!right.warnings.iter().any(|warning| warning.contains("left-handed")), "{:?}", right.warnings);
    assert!((left.reference.measure / right.reference.measure - 1.0).abs() < 1e-14 && left.reference.measure > 0.0);
    // a mirrored body under a mirrored load answers the same; the load here is not mirrored, the matrix is
    let norms = [&left, &right].map(|study| study.reference.stiffness_frobenius());
    assert!((norms[0] / norms[1] - 1.0).abs() < 1e-13, "{norms:?}");
    // mixed signs
    let mixed = of_file(&folder, &square(|i, j| [if j > 1.5 { 3.0 - i } else { i }, j]));
    assert!(matches!(run(&mixed), Err(Error::FoldedElement { .. })));
}

#[test]
fn folded_net() {
    let folder = tempfile::tempdir().expect("a folder");
    let folded = of_file(&folder, &square(|i, j| if (i, j) == (1.0, 1.0) { [3.8, 1.0] } else { [i, j] }));
    let error = run(&folded).err().expect("a fold");
    says(&error, 3, &["element [", "is folded", "Gauss point", "determinant is", "so that no element folds"]);
    let Error::FoldedElement { element, point, determinant } = error else { panic!("{error}") };
    assert!(element.len() == 2 && point.len() == 2 && determinant < 0.0);
}

#[test]
fn nearly_flat_cell() {
    let flat = |method: &str, height: &str| {
        let text = CUBE
            .replace("control_points = [4, 4, 4]", &format!("control_points = [4, 4, 3]\nsize = [1.0, 1.0, {height}]"));
        let text = text.replace("faces = [\"z-\"]", "faces = [\"x-\"]").replace("[2.0, -1.0, 1.0]", "[1e-6, 0.0, 0.0]");
        format!("{text}[reference]\nmethod = \"{method}\"\n")
    };
    for method in ["iga", "b8", "t4", "smoothed_face"] {
        for (height, solved) in [("1e-3", Some(true)), ("1e-6", None), ("1e-9", None), ("1e-12", Some(false))] {
            match run(&flat(method, height)) {
                Ok(study) => {
                    assert_ne!(solved, Some(false), "{method} {height} must not be answered without a word");
                    let sure = study.reference.accuracy;
                    assert!(sure.backward_error < 1e-10 && study.calibration.accuracy.unwrap().backward_error < 1e-10);
                    // a number whose error may be above the stated digits comes with a warning
                    let told = |word: &str| study.warnings.iter().any(|warning| warning.starts_with(word));
                    assert_eq!(told("reference:"), sure.forward_error > 1e-6, "{method} {height}: {sure:?}");
                    assert_eq!(
                        told("springs:"),
                        study.calibration.accuracy.unwrap().forward_error > 1e-6,
                        "{method} {height}"
                    );
                    println!("{method} {height}: {sure:?} {:?}", study.calibration.accuracy);
                }
                Err(error) => {
                    assert_ne!(solved, Some(true), "{method} {height}: {error}");
                    assert_eq!(error.exit_status(), 3, "{method} {height}: {error}");
                    println!("{method} {height}: {error}");
                }
            }
        }
    }
    // smoothing over faces makes flat tetrahedra softer, never stiffer than they are
    let [plain, smoothed] = ["t4", "smoothed_face"].map(|method| run(&flat(method, "1e-3")).expect("solved"));
    assert!(smoothed.reference.cases[0].compliance >= plain.reference.cases[0].compliance);
}

fn weighted(weights: &[f64]) -> Result<Patch, Error> {
    let knots = vec![KnotVector::open_uniform(1, 2).expect("knots"); 2];
    Patch::new(knots, vec![[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], weights.to_vec())
}

#[test]
fn bad_weights() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, -0.0] {
        let error = weighted(&[1.0, 1.0, bad, 1.0]).expect_err("no weight");
        says(&error, 2, &["geometry.weights[2]", "weights are positive and finite"]);
    }
    // the smallest weights are weights: one beside others draws nothing, and all of them are as good as ones
    for weights in [[1.0, 1.0, 1e-300, 1.0], [1e-300; 4], [1e300; 4]] {
        let body = weighted(&weights).expect("positive weights");
        let mut shape = body.workspace();
        body.shape_functions(body.elements()[0], [0.25, 0.5, 0.0], &mut shape);
        assert!(shape.values.iter().all(|value| (0.0..=1.0).contains(value)), "{weights:?}: {:?}", shape.values);
        assert!((shape.values.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{weights:?}: {:?}", shape.values);
        assert!(shape.determinant > 0.0 && shape.gradients.as_flattened().iter().all(|g| g.is_finite()), "{weights:?}");
    }
}

#[test]
fn bad_knots() {
    for (degree, knots, key) in [
        (2, vec![0.0, 0.0, 0.0, 0.6, 0.4, 1.0, 1.0, 1.0], "geometry.knots[4]"),
        (2, vec![0.0, 0.0, 1.0, 1.0, 1.0], "geometry.knots"),
        (2, vec![0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0], "geometry.knots"),
        (1, vec![0.0, 0.5, 1.0, 1.0], "geometry.knots[0]"),
        (1, vec![0.0, 0.0, 0.5, 1.0], "geometry.knots"),
        (1, vec![2.0, 2.0, 2.0, 2.0], "geometry.knots"),
        (1, vec![0.0, 0.0, f64::NAN, 1.0, 1.0], "geometry.knots[2]"),
        (1, vec![0.0, 0.0, f64::INFINITY, f64::INFINITY], "geometry.knots"),
    ] {
        let error = KnotVector::new(degree, knots.clone()).expect_err("no knots");
        says(&error, 2, &[key]);
    }
    for knots in [vec![0.0, 0.0, 1.0, 4.0, 4.0], vec![-3.0, -3.0, -1.0, 0.5, 0.5], vec![0.0, 0.0, 1e-300, 1.0, 1.0]] {
        assert!(KnotVector::new(1, knots.clone()).is_ok(), "{knots:?}");
    }
}

#[test]
fn knot_multiplicity_inside() {
    // the example of section 2.5.1 of the thesis: 7 x 4 control points, a line of C0 at 0.4, 8 elements
    let knots = vec![
        KnotVector::new(2, vec![0.0, 0.0, 0.0, 0.2, 0.4, 0.4, 0.8, 1.0, 1.0, 1.0]).expect("knots"),
        KnotVector::new(2, vec![0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0]).expect("knots"),
    ];
    let points: Vec<[f64; 3]> =
        (0..28).map(|node| [knots[0].greville(node / 4), knots[1].greville(node % 4), 0.0]).collect();
    let body = Patch::new(knots, points, vec![1.0; 28]).expect("a patch");
    assert_eq!(body.elements().len(), 8);
    let free = dofs(2, body.points(), &[]);
    assert_eq!(of_continuum(&nurbs::integration_points(&body, 0, 1.0), 0.3, &free), 3, "the line of C0 is no hinge");
}

#[test]
fn one_element_or_single_row() {
    let with = |counts: &str, more: &str| format!("{}{more}", SQUARE.replace("[4, 4]", counts));
    for text in [
        with("[3, 3]", ""),
        with("[2, 2]", "[reference]\nmethod = \"q4\"\n"),
        with("[2, 2]", "[reference]\nmethod = \"t3\"\n"),
        with("[2, 9]", "[reference]\nmethod = \"q4\"\n"),
        with("[9, 2]", "[reference]\nmethod = \"q4\"\n"),
        with("[2, 2]", "").replace("control_points = [2, 2]", "control_points = [2, 2]\ndegree = [1, 1]"),
        CUBE.replace("[4, 4, 4]", "[3, 3, 3]"),
        CUBE.replace("[4, 4, 4]", "[2, 2, 2]") + "[reference]\nmethod = \"b8\"\n",
        CUBE.replace("[4, 4, 4]", "[2, 2, 7]") + "[reference]\nmethod = \"b8\"\n",
    ] {
        let study = runs(&text);
        assert!(matches!(study.reference.path, Path::Direct { .. }));
    }
    for (counts, words) in [
        ("[1, 5]", "control_points[0]: 1 is out of range"),
        ("[5, 1]", "control_points[1]: 1 is out of range"),
        ("[1, 1]", "control_points[0]: 1 is out of range"),
    ] {
        says(&refused(&with(counts, "")), 2, &[words, "from 2"]);
    }
    let scene: Scene = parse(&with("[2, 2]", "")).expect("two points are enough for some degree");
    says(&plan::plan(&scene).expect_err("too few for degree 2"), 2, &["too few", "at least [3, 3]"]);
}

/// Two squares side by side, each with its own two nodes on the common side.
#[test]
fn nodes_of_a_mesh_that_lie_on_others_are_told_unless_they_are_tied() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("cut.vtk");
    let text = "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n\
                0 0 0 1 0 0 1 1 0 0 1 0 1 0 0 2 0 0 2 1 0 1 1 0\nCELLS 2 10\n4 0 1 2 3\n4 4 5 6 7\nCELL_TYPES 2\n9\n9\n";
    std::fs::write(&path, text).expect("a file");
    for merged in [false, true] {
        let geometry = format!("file = {:?}\nmerge_seam = {merged}", path.to_str().expect("UTF-8"));
        let scene = SQUARE
            .replace("shape = \"square\"\ncontrol_points = [4, 4]", &geometry)
            .replace("faces = [\"y-\"]", "box = { min = [-1.0, -0.1], max = [3.0, 0.1] }");
        let built = body::build(&parse(&scene).expect("a scene")).expect("a body");
        assert_eq!(built.dofs.masters().count(), if merged { 6 } else { 8 });
        match merged {
            true => assert_eq!(built.warnings, Vec::<String>::new()),
            false => {
                warned(&built.warnings, &["2 nodes lie on another one", "first nodes 1 and 4", "merge_seam = true"])
            }
        }
    }
}
