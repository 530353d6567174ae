//! E4: a cantilever of length L and depth D with a parabolic shear load P at its end (Timoshenko and Goodier).
//!
//! ```text
//!     u_x =  P y / (6 E I) ((6 L - 3 x) x + (2 + nu)(y^2 - D^2/4)),      I = D^3 / 12
//!     u_y = -P / (6 E I) (3 nu y^2 (L - x) + (4 + 5 nu) D^2 x / 4 + (3 L - x) x^2)
//!     sigma_xx = P (L - x) y / I,   sigma_xy = -P / (2 I) (D^2/4 - y^2)
//! ```
//!
//! The end x = 0 follows the exact displacement, interpolated at the Greville points of the spline; the end x = L
//! carries the exact traction. Cubic splines contain the solution.

use springfit::geometry::basis;
use springfit::geometry::patch::Patch;
use springfit::reference::material::Plane;
use springfit::reference::stress;

use crate::bodies::rectangle;
use crate::problem::{Exact, errors, exact_traction, held, lame, solve};
use crate::table::{assert_close, expected, rows};

const LENGTH: f64 = 48.0;
const DEPTH: f64 = 12.0;
const LOAD: f64 = 1000.0;
const YOUNG: f64 = 3e7;
const POISSON: f64 = 0.3;
const INERTIA: f64 = DEPTH * DEPTH * DEPTH / 12.0;

fn displacement([x, y, _]: [f64; 3]) -> [f64; 3] {
    let scale = LOAD / (6.0 * YOUNG * INERTIA);
    let square = DEPTH * DEPTH / 4.0;
    [
        scale * y * ((6.0 * LENGTH - 3.0 * x) * x + (2.0 + POISSON) * (y * y - square)),
        -scale
            * (3.0 * POISSON * y * y * (LENGTH - x) + (4.0 + 5.0 * POISSON) * square * x + (3.0 * LENGTH - x) * x * x),
        0.0,
    ]
}

fn beam_stress([x, y, _]: [f64; 3]) -> [[f64; 3]; 3] {
    let shear = -LOAD / (2.0 * INERTIA) * (DEPTH * DEPTH / 4.0 - y * y);
    [[LOAD * (LENGTH - x) * y / INERTIA, shear, 0.0], [shear, 0.0, 0.0], [0.0; 3]]
}

/// Control displacements of the side x = 0 whose spline meets the exact displacement at the Greville points.
fn interpolated_root(body: &Patch) -> Vec<[f64; 3]> {
    let knots = body.knots(1);
    let (n, degree) = (knots.len(), knots.degree());
    let mut rows = vec![vec![0.0; n]; n];
    let mut values = Vec::with_capacity(n);
    for (j, row) in rows.iter_mut().enumerate() {
        let eta = knots.greville(j);
        let span = knots.find_span(eta);
        basis::derivatives(knots, span, eta, 0, &mut row[span - degree..=span]);
        values.push(displacement(body.evaluate([0.0, eta, 0.0])));
    }
    // Gauss elimination without pivots: a spline collocation matrix is totally positive
    for k in 0..n {
        for r in (0..n).filter(|&r| r != k) {
            let factor = rows[r][k] / rows[k][k];
            let pivot = rows[k].clone();
            rows[r].iter_mut().zip(&pivot).for_each(|(a, p)| *a -= factor * p);
            let pivot = values[k];
            values[r].iter_mut().zip(&pivot).for_each(|(a, p)| *a -= factor * p);
        }
    }
    let mut given = vec![[0.0; 3]; body.points().len()];
    for (j, value) in values.iter().enumerate() {
        given[j] = value.map(|u| u / rows[j][j]);
    }
    given
}

#[test]
fn e4_timoshenko_cantilever() {
    let pinned = expected("E4");
    let exact = Exact { displacement: &displacement, stress: &beam_stress };
    let law = lame(YOUNG, POISSON, Plane::Stress);
    let tip = pinned["tip_uy_exact"].as_f64().expect("a number");
    assert_close("exact tip", displacement([LENGTH, 0.0, 0.0])[1], tip, 1e-15);
    assert_close("sxx(0,top)", beam_stress([0.0, DEPTH / 2.0, 0.0])[0][0], 2000.0, 1e-15);
    for degree in 1..=3 {
        for row in rows(&pinned["runs nx,ny,dof,relL2,relEnergy,tip"][format!("p={degree}")]) {
            let body = rectangle(LENGTH, DEPTH, degree, [row[0] as usize, row[1] as usize]);
            let name = format!("p={degree} {} x {}", row[0], row[1]);
            assert_eq!(2 * body.points().len(), row[2] as usize, "{name}");
            let dofs = held(&body, &[("x-", &[0, 1])]);
            let forces = exact_traction(&body, "x+", 1, &dofs, &exact);
            let solved = solve(&body, 1, law, &dofs, &forces, &interpolated_root(&body));
            let found = errors(&body, 3, law, &solved.displacement, &exact);
            let end = stress::at(&body, law, &solved.displacement, [1.0, 0.5, 0.0]);
            assert_close(&format!("{name} tip"), end.displacement[1], row[5], 1e-11);
            if degree == 3 {
                assert_close(&format!("{name} tip"), end.displacement[1], tip, 1e-12);
                assert!(found.l2 < 1e-12 && found.energy_norm < 1e-12, "{name} is exact: {found:?}");
            } else {
                assert_close(&format!("{name} L2"), found.l2, row[3], 1e-7);
                assert_close(&format!("{name} energy norm"), found.energy_norm, row[4], 1e-11);
            }
        }
    }
}
