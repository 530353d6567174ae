//! The algebra of the reference room: the element against the textbook form, rigid motions, threads, loads, hard cases.

use springfit::error::Error;
use springfit::geometry::dofs::{DofMap, tie_coincident};
use springfit::geometry::knots::KnotVector;
use springfit::geometry::measure::measure;
use springfit::geometry::patch::Patch;
use springfit::geometry::shapes;
use springfit::reference::loads::{self, Face};
use springfit::reference::material::{Material, Plane};
use springfit::reference::methods::nurbs;
use springfit::reference::points::ElementPoints;
use springfit::reference::stiffness;

const MATERIAL: Material = Material { young: 15e3, poisson: 0.3 };

fn body(name: &str) -> Patch {
    let shape = shapes::find(name).expect("a shape");
    (shape.build)(&shape.default_request()).expect("a body")
}

fn free(body: &Patch) -> DofMap {
    DofMap::untied(body.dimension(), &vec![[false; 3]; body.points().len()])
}

fn matrix(body: &Patch, plane: Plane, dofs: &DofMap) -> nalgebra_sparse::CsrMatrix<f64> {
    let points = nurbs::integration_points(body, 0, 1.0);
    let lame = MATERIAL.lame(body.dimension(), plane).expect("a material");
    stiffness::stiffness(&points, lame, dofs, &stiffness::pattern(&points, dofs)).expect("a stiffness")
}

/// D in Voigt order xx yy (zz yz xz) xy, as the textbooks print it.
fn voigt(dimension: usize, plane: Plane) -> Vec<Vec<f64>> {
    let Material { young, poisson, .. } = MATERIAL;
    let shear = young / (2.0 * (1.0 + poisson));
    let normal = |count: usize, size: usize, diagonal: f64, other: f64| {
        let entry = |i: usize, j: usize| match (i == j, i < count && j < count) {
            (true, true) => diagonal,
            (false, true) => other,
            (true, false) => shear,
            (false, false) => 0.0,
        };
        (0..size).map(|i| (0..size).map(|j| entry(i, j)).collect()).collect()
    };
    let solid = young / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let sheet = young / (1.0 - poisson * poisson);
    match (dimension, plane) {
        (2, Plane::Stress) => normal(2, 3, sheet, sheet * poisson),
        (2, Plane::Strain) => normal(2, 3, solid * (1.0 - poisson), solid * poisson),
        _ => normal(3, 6, solid * (1.0 - poisson), solid * poisson),
    }
}

/// Column of B for component i of a node with gradient g, in the same order.
fn strain_column(dimension: usize, i: usize, g: [f64; 3]) -> Vec<f64> {
    let [x, y, z] = g;
    match (dimension, i) {
        (2, 0) => vec![x, 0.0, y],
        (2, _) => vec![0.0, y, x],
        (_, 0) => vec![x, 0.0, 0.0, 0.0, z, y],
        (_, 1) => vec![0.0, y, 0.0, z, 0.0, x],
        _ => vec![0.0, 0.0, z, y, x, 0.0],
    }
}

#[test]
fn thesis_2_29_blocks_are_b_transpose_d_b() {
    for (name, plane) in [("circle", Plane::Stress), ("circle", Plane::Strain), ("torus", Plane::Stress)] {
        let body = body(name);
        let (dimension, dofs) = (body.dimension(), free(&body));
        let mut dense = vec![vec![0.0; dofs.len()]; dofs.len()];
        let points = nurbs::integration_points(&body, 0, 1.0);
        let (law, mut filled) = (voigt(dimension, plane), ElementPoints::default());
        for e in 0..points.elements() {
            points.fill(e, &mut filled).expect("points");
            let acting = points.acting(e);
            for (q, gradients) in filled.gradients.chunks_exact(acting.len()).enumerate() {
                let columns: Vec<(usize, Vec<f64>)> = (0..acting.len() * dimension)
                    .map(|c| (c / dimension, c % dimension))
                    .map(|(a, i)| {
                        (dofs.free(acting[a] as usize)[i] as usize, strain_column(dimension, i, gradients[a]))
                    })
                    .collect();
                for (row, left) in &columns {
                    let stress: Vec<f64> = law.iter().map(|d| d.iter().zip(left).map(|(d, b)| d * b).sum()).collect();
                    for (column, right) in &columns {
                        dense[*row][*column] +=
                            filled.volumes[q] * stress.iter().zip(right).map(|(s, b)| s * b).sum::<f64>();
                    }
                }
            }
        }
        let largest = dense.iter().flatten().fold(0.0f64, |most, k| most.max(k.abs()));
        let assembled = matrix(&body, plane, &dofs);
        let mut difference = 0.0f64;
        for (i, j, &k) in assembled.triplet_iter() {
            difference = difference.max((k - dense[i][j]).abs());
            dense[i][j] = 0.0;
        }
        assert!(difference < 1e-13 * largest, "{name} {plane:?}: {difference:e} of {largest:e}");
        assert!(dense.iter().flatten().all(|&k| k == 0.0), "{name}: an entry outside the pattern");
    }
}

#[test]
fn a_free_body_resists_no_rigid_motion() {
    for name in ["square", "circle", "cube", "torus"] {
        let body = body(name);
        let points = nurbs::integration_points(&body, 4, 1.0);
        let lame = MATERIAL.lame(body.dimension(), Plane::Strain).expect("a material");
        let turned: Vec<_> = body.points().iter().map(|x| [0.3 - x[1], 0.2 + x[0], 0.0]).collect();
        let forces = stiffness::internal_forces(&points, lame, &turned).expect("forces");
        let largest = forces.iter().flatten().fold(0.0f64, |most, f| most.max(f.abs()));
        assert!(largest < 1e-15 * MATERIAL.young * 10.0, "{name}: {largest:e}");
    }
}

#[test]
fn hard_case_threads_give_the_same_bits() {
    let body = body("torus");
    let (dofs, run) = (free(&body), |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build());
    let values = |threads: usize| {
        run(threads).expect("threads").install(|| {
            let points = nurbs::integration_points(&body, 0, 1.0);
            let measure = points.measure().expect("a measure");
            (matrix(&body, Plane::Stress, &dofs).values().to_vec(), measure)
        })
    };
    let one = values(1);
    assert!([2, 3, 4].into_iter().all(|threads| values(threads) == one));
}

/// The circle with its first direction reversed, or with one control point pulled through the opposite side.
fn changed_circle(reverse: bool) -> Patch {
    let circle = body("circle");
    let grid = circle.grid();
    let mut order: Vec<usize> = (0..grid.len()).collect();
    let mut points = circle.points().to_vec();
    if reverse {
        order = order.iter().map(|&node| grid.index(node)).map(|[i, j, k]| grid.node([5 - i, j, k])).collect();
    } else {
        points[grid.node([2, 2, 0])] = [3.0, 0.0, 0.0];
    }
    let pick = |node: &usize| points[*node];
    let weights = order.iter().map(|&node| circle.weights()[node]).collect();
    let knots: Vec<KnotVector> = vec![circle.knots(0).clone(), circle.knots(1).clone()];
    Patch::new(knots, order.iter().map(pick).collect(), weights).expect("a patch")
}

#[test]
fn hard_case_left_handed_patch() {
    let (circle, mirrored) = (body("circle"), changed_circle(true));
    let points = nurbs::integration_points(&mirrored, 0, 1.0);
    assert!(points.warnings()[0].contains("left-handed"), "{:?}", points.warnings());
    assert!(nurbs::integration_points(&circle, 0, 1.0).warnings().is_empty());
    let area = points.measure().expect("an area");
    assert!((area / measure(&circle, 0) - 1.0).abs() < 1e-14);
    let norm = |body: &Patch| matrix(body, Plane::Stress, &free(body)).values().iter().map(|k| k * k).sum::<f64>();
    assert!((norm(&mirrored) / norm(&circle) - 1.0).abs() < 1e-12);
    let dofs = free(&mirrored);
    let face = Face { patch: &mirrored, name: "x-", thickness: 1.0, extra_points: 8 };
    let load = loads::traction(face, &dofs, &|x, n| [x[0] * n[0] + x[1] * n[1], 0.0, 0.0]).expect("a traction");
    assert!((load.total[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "a quarter circle, normals outward");
}

#[test]
fn hard_case_folded_net() {
    let folded = changed_circle(false);
    match nurbs::integration_points(&folded, 0, 1.0).measure() {
        Err(Error::FoldedElement { element, point, determinant }) => {
            assert!(determinant < 0.0 && element.len() == 2 && point.len() == 2);
        }
        other => panic!("a fold must be named, got {other:?}"),
    }
}

#[test]
fn units_stiffness_is_linear_in_young_and_thickness() {
    let body = body("circle");
    let dofs = free(&body);
    let points = |thickness| nurbs::integration_points(&body, 0, thickness);
    let lame = |young| Material { young, ..MATERIAL }.lame(2, Plane::Stress).expect("a material");
    let pattern = stiffness::pattern(&points(1.0), &dofs);
    let make = |young, thickness| stiffness::stiffness(&points(thickness), lame(young), &dofs, &pattern).expect("K");
    let (one, other) = (make(15e3, 1.0), make(15.0, 0.25));
    assert!(one.values().iter().zip(other.values()).all(|(k, l)| (k - 4000.0 * l).abs() <= 1e-14 * 15e3));
    assert!((points(0.25).measure().expect("an area") - points(1.0).measure().expect("an area")).abs() < 1e-14);
}

#[test]
fn consistent_loads_have_their_resultants() {
    let cube = body("cube");
    let dofs = free(&cube);
    let face = |name| Face { patch: &cube, name, thickness: 1.0, extra_points: 0 };
    for (name, axis, sign) in
        [("x-", 0, -1.0), ("x+", 0, 1.0), ("y-", 1, -1.0), ("y+", 1, 1.0), ("z-", 2, -1.0), ("z+", 2, 1.0)]
    {
        let load = loads::traction(face(name), &dofs, &|_, n| n.map(|n| 5.0 * n)).expect("a pressure");
        let mut expected = [0.0; 3];
        expected[axis] = sign * 20.0;
        assert!((0..3).all(|i| (load.total[i] - expected[i]).abs() < 1e-12), "{name}: {:?}", load.total);
        assert_eq!(load.held, [0.0; 3]);
    }
    assert!(matches!(loads::traction(face("w+"), &dofs, &|_, n| n), Err(Error::Input { key, .. }) if key == "load"));
    let torus = body("torus");
    let points = nurbs::integration_points(&torus, 0, 1.0);
    let weight = loads::body_force(&points, &free(&torus), &|_| [0.0, 0.0, -2.0]).expect("a weight");
    assert!((weight.total[2] + 2.0 * points.measure().expect("a volume")).abs() < 1e-13);
}

#[test]
fn forces_on_nodes_reach_the_free_ones() {
    let torus = body("torus");
    let mut fixed = vec![[false; 3]; torus.points().len()];
    fixed[1] = [true; 3];
    fixed[2] = [false, true, false];
    let tied = DofMap::new(3, tie_coincident(torus.points(), 1e-9), &fixed);
    let load = loads::per_node(&tied, [1.0, 2.0, 4.0]).expect("a load");
    // 25 of 225 points lie on others; one node is held, of another one component
    assert_eq!(load.total, [199.0, 2.0 * 198.0, 4.0 * 199.0]);
    assert_eq!(load.forces.len(), 200 * 3 - 4);
    let point = loads::point(&tied, 2, [1.0, 7.0, 0.0]).expect("a load");
    assert_eq!((point.total, point.held), ([1.0, 0.0, 0.0], [0.0, 7.0, 0.0]));
    let key = |result: springfit::error::Result<loads::Load>| match result {
        Err(Error::Input { key, message, .. }) => (key, message),
        other => panic!("expected an input error, got {other:?}"),
    };
    for bad in [
        loads::point(&tied, 1, [1.0, 0.0, 0.0]),
        loads::point(&tied, 225, [1.0, 0.0, 0.0]),
        loads::per_node(&tied, [0.0; 3]),
        loads::per_node(&tied, [f64::NAN, 0.0, 0.0]),
    ] {
        assert_eq!(key(bad).0, "load");
    }
}
