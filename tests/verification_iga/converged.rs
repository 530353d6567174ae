//! The error of a mesh where it is known: a bar under its own weight.
//!
//! A square that does not contract (nu = 0), held at one side and pulled along it by a body force b, stretches by
//! u = b/E (L x - x^2/2). Degree 1 is exact at its nodes and off by the parabola b h^2 / (8 E) between them, whose mean
//! square is b^2 h^4 / (120 E^2). Pulled at its end it stretches evenly, which every mesh represents.

use springfit::clock::Progress;
use springfit::scene::{self, Source};
use springfit::study::{self, converged::Split};

const WEIGHT: &str = "body_force = [700.0, 0.0]";
const PULL: &str = "traction = { face = \"x+\", value = [700.0, 0.0] }";

fn split(load: &str, degree: usize, spans: usize, [halvings, elevations]: [usize; 2]) -> Split {
    let text = format!(
        "[geometry]\nshape = \"square\"\nsize = [2.0, 2.0]\ndegree = [{degree}, {degree}]\n\
         control_points = [{0}, {0}]\n\
         [material]\nyoung = 15e3\npoisson = 0.0\n[support]\nfaces = [\"x-\"]\n\
         [[load]]\n{load}\nmax_displacement = 0.1\n[calibration]\ngamma = 0.3\n\
         [converged]\nhalvings = {halvings}\nelevations = {elevations}\n",
        spans + degree
    );
    let scene = scene::parse(&Source { name: "bar".into(), text }).unwrap();
    study::run(&scene, &Progress::default()).unwrap().converged.unwrap().cases[0]
}

#[test]
fn a_mesh_that_represents_the_answer_has_no_error_of_its_own() {
    let found = split(PULL, 2, 4, [1, 1]);
    assert!(found.mesh < 1e-11 && found.remaining < 1e-11, "{found:?}");
    assert!((found.total - found.springs).abs() < 1e-11 && found.springs > 0.1, "{found:?}");
}

#[test]
fn the_error_of_a_linear_mesh_is_that_of_the_parabola_between_its_nodes() {
    for spans in [4, 8] {
        let found = split(WEIGHT, 1, spans, [0, 1]);
        // 100 (h^2 / sqrt(120)) / (L^2 / 2); the largest displacement is seen at a Gauss point, not at the end itself
        let expected = 200.0 / (120.0_f64.sqrt() * (spans * spans) as f64);
        assert!((found.mesh / expected - 1.0).abs() < 2e-3, "{spans}: {found:?}, {expected}");
    }
}

#[test]
fn halving_finds_three_quarters_of_the_square_of_a_linear_mesh() {
    // nodal exactness: fine and coarse agree at the coarse nodes; their difference is the hat of height b h^2 / (8 E) at
    // the middles, whose mean square is b^2 h^4 / (192 E^2)
    let found = split(WEIGHT, 1, 4, [1, 0]);
    let expected = 200.0 / (192.0_f64.sqrt() * 16.0);
    assert!((found.mesh / expected - 1.0).abs() < 5e-2, "{found:?}, {expected}");
}
