//! E9: a thick cylinder near incompressibility (MacNeal and Harder): radii 3 and 9, plane strain, inner pressure 1. A quarter
//! of nine sectors of 10 degrees, each five elements through the wall that grow outwards; the pressure acts along the normals
//! of the polygon. Full integration locks, B-bar does not.
//!
//! ```text
//!     u_r(a) = (1 + nu)/E  p a^2/(b^2 - a^2)  ((1 - 2 nu) a + b^2/a)
//! ```

use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::reference::material::Plane;

use crate::problem::{lame, mapped, node_at, points, solve, supports, traction};
use crate::table::{assert_close, expected};

const RADII: [f64; 6] = [3.0, 3.5, 4.2, 5.2, 6.75, 9.0];
const YOUNG: f64 = 1000.0;

fn quarter(kind: CellKind) -> Mesh {
    let place = |[x, y, _]: [f64; 3]| {
        let (radius, angle) = (RADII[(5.0 * x).round() as usize], (90.0 * y).to_radians());
        // exactly on the axes, where the supports look for it
        let [c, s] = [if y == 1.0 { 0.0 } else { angle.cos() }, angle.sin()];
        [radius * c, radius * s, 0.0]
    };
    mapped(&[5, 9], kind, &place)
}

fn exact(poisson: f64) -> f64 {
    let [inner, outer] = [RADII[0], RADII[5]];
    let shape = (1.0 - 2.0 * poisson) * inner + outer * outer / inner;
    (1.0 + poisson) / YOUNG * inner * inner / (outer * outer - inner * inner) * shape
}

/// u_r at the inner radius on the x axis.
fn inner_displacement(method: &str, kind: CellKind, poisson: f64) -> f64 {
    let mesh = quarter(kind);
    let dofs = supports(&mesh, &|x| [x[0] == 0.0, x[1] == 0.0, false]);
    let inside = |x: [f64; 3]| x[0].hypot(x[1]) < RADII[0] + 1e-9;
    let load = traction(&mesh, &dofs, &inside, &|_, n| n.map(|n| -n));
    let still = vec![[0.0; 3]; mesh.positions().len()];
    let u = solve(&points(method, &mesh), lame(YOUNG, poisson, 2, Plane::Strain), &dofs, &load.forces, &still);
    u[node_at(&mesh, [RADII[0], 0.0, 0.0])][0]
}

#[test]
fn e9_locking_of_q4_and_t3_and_b_bar() {
    for poisson in [0.3, 0.49, 0.499, 0.4999, 0.49999] {
        let pinned = expected("E9")[format!("nu={poisson}")].clone();
        let number = |key: &str| pinned[key].as_f64().expect("a number");
        assert_close("exact", exact(poisson), number("exact u_r(3)"), 1e-14);
        for (key, method, kind) in [
            ("Q4 full ratio", "q4", CellKind::Quadrilateral),
            ("Q4 bbar ratio", "q4_bbar", CellKind::Quadrilateral),
            ("T3 ratio", "t3", CellKind::Triangle),
        ] {
            let ratio = inner_displacement(method, kind, poisson) / exact(poisson);
            assert_close(&format!("nu={poisson} {method}"), ratio, number(key), 1e-8);
        }
    }
}
