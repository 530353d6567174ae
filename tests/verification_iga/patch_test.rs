//! P1, P2: a body whose boundary follows a linear displacement is under constant stress everywhere.
//!
//! Control points that move by u(P_i) = A P_i make every point move by A x (linear precision), so the exact answer is in
//! the space and only quadrature can spoil it. Polynomial patches: p + 1 points are exact in the plane; in space the
//! cofactors of the map reach degree 2 p, and degrees 3 and 4 need one point more. Rational patches: never exact.

use springfit::geometry::dofs::DofMap;
use springfit::geometry::patch::Patch;
use springfit::reference::material::{Material, Plane};
use springfit::reference::methods::nurbs;
use springfit::reference::{stiffness, stress};

use crate::bodies::{distorted, shape};
use crate::problem::solve;
use crate::table::{assert_close, expected};

/// The displacement of MacNeal and Harder's patch tests.
fn linear(dimension: usize, [x, y, z]: [f64; 3]) -> [f64; 3] {
    match dimension {
        2 => [1e-3 * (x + y / 2.0), 1e-3 * (y + x / 2.0), 0.0],
        _ => [1e-3 * (2.0 * x + y + z) / 2.0, 1e-3 * (x + 2.0 * y + z) / 2.0, 1e-3 * (x + y + 2.0 * z) / 2.0],
    }
}

/// Relative errors of a patch test, each a largest one over a largest value: displacement and stress at a few places
/// (single spline coefficients are worse conditioned, 4e-12 at degree 4 in space), forces at the inner control points.
struct Outcome {
    displacement: f64,
    stress: f64,
    imbalance: f64,
}

fn largest<'a>(vectors: impl IntoIterator<Item = &'a [f64; 3]>) -> f64 {
    vectors.into_iter().flatten().fold(0.0, |most: f64, value| most.max(value.abs()))
}

fn patch_test(body: &Patch, extra: usize) -> Outcome {
    let (dimension, grid) = (body.dimension(), body.grid());
    let material = Material { young: 1e6, poisson: 0.25 };
    let law = material.lame(dimension, Plane::Stress).expect("a material");
    let on_boundary = |node: usize| {
        let index = grid.index(node);
        (0..dimension).any(|a| index[a] == 0 || index[a] + 1 == grid.extents()[a])
    };
    let fixed: Vec<[bool; 3]> = (0..grid.len()).map(|node| [on_boundary(node); 3]).collect();
    let dofs = DofMap::untied(dimension, &fixed);
    let exact: Vec<[f64; 3]> = body.points().iter().map(|&x| linear(dimension, x)).collect();
    let given: Vec<_> = exact.iter().zip(&fixed).map(|(u, held)| if held[0] { *u } else { [0.0; 3] }).collect();
    let solved = solve(body, extra, law, &dofs, &vec![0.0; dofs.len()], &given);

    let points = nurbs::integration_points(body, extra, 1.0);
    let forces = stiffness::internal_forces(&points, law, &exact).expect("forces");
    let inner = forces.iter().zip(&fixed).filter(|(_, held)| !held[0]).map(|(force, _)| force);
    let gradient: [[f64; 3]; 3] = {
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| linear(dimension, e));
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| if j < dimension { columns[j][i] } else { 0.0 }))
    };
    let sigma = law.stress(&gradient);
    let (mut error, mut stress_error) = (0.0f64, 0.0f64);
    for place in [[0.11, 0.23, 0.57], [0.5, 0.5, 0.5], [0.87, 0.41, 0.05], [0.34, 0.96, 0.78]] {
        let found = stress::at(body, law, &solved.displacement, place);
        let exact = linear(dimension, found.position);
        error = found.displacement.iter().zip(&exact).fold(error, |most, (u, e)| most.max((u - e).abs()));
        for (row, exact) in found.stress.iter().zip(&sigma) {
            stress_error = row.iter().zip(exact).fold(stress_error, |most, (s, e)| most.max((s - e).abs()));
        }
    }
    Outcome {
        displacement: error / largest(&exact),
        stress: stress_error / largest(&sigma),
        imbalance: largest(inner) / largest(&forces),
    }
}

#[test]
fn p1_patch_test_polynomial() {
    for dimension in [2, 3] {
        for degree in 1..=4 {
            let extra = usize::from(dimension == 3 && degree > 2);
            let outcome = patch_test(&distorted(dimension, degree), extra);
            let Outcome { displacement, stress, imbalance } = outcome;
            println!("{dimension}D p={degree}: u {displacement:.1e}, stress {stress:.1e}, forces {imbalance:.1e}");
            assert!(displacement < 1e-12 && stress < 1e-12 && imbalance < 1e-12, "{dimension}D p={degree}");
        }
    }
}

/// The body of the pinned numbers is the disc of degree 2 with 3 x 3 elements; their linear displacement is not named.
/// The imbalance of the first two rows does not depend on it and is met to rounding; that of the third and the errors
/// in the displacement do, so their size is asserted. From p + 5 points on only rounding is left.
#[test]
fn p2_patch_test_rational() {
    let pinned = expected("P2");
    let disc = shape("circle", 2, &[5, 5]);
    for (extra, tolerance) in [(0, 1e-9), (1, 1e-7), (2, 0.1), (4, f64::INFINITY), (6, f64::INFINITY)] {
        let row = &pinned[format!("p+1+{extra} points")];
        let number = |key: &str| row[key].as_f64().expect("a number");
        let (name, outcome) = (format!("p+1+{extra} points"), patch_test(&disc, extra));
        println!("{name}: displacement {:.1e}, stress {:.1e}", outcome.displacement, outcome.stress);
        assert_close(&name, outcome.imbalance, number("interior_force_imbalance_rel"), tolerance);
        if extra <= 2 {
            let ratio = outcome.displacement / number("disp_relerr");
            assert!((0.2..2.0).contains(&ratio), "{name}: displacement {ratio} of the pinned");
        } else {
            assert!(outcome.imbalance < 1e-13 && outcome.displacement < 1e-13, "{name}");
        }
    }
}
