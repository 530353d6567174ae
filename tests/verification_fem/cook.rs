//! E5: Cook's membrane, a tapered panel (0, 0), (48, 44), (48, 60), (0, 44) in plane stress, clamped at x = 0 and sheared at
//! x = 48 by a force of 1. What is compared is u_y in the middle of that side.
//!
//! The pinned numbers belong to 3 x 3 Gauss points an element; with the usual 2 x 2 the coarsest mesh is .4 % softer (11.845,
//! 18.299, 22.079, 23.430 in the literature on this problem).

use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::reference::material::Plane;
use springfit::reference::methods::elements;
use springfit::reference::points::IntegrationPoints;

use crate::problem::{lame, mapped, node_at, points, solve, supports, traction};
use crate::table::{assert_close, expected};

fn panel(n: usize) -> Mesh {
    let place = |[x, y, _]: [f64; 3]| [48.0 * x, (1.0 - y) * 44.0 * x + y * (44.0 + 16.0 * x), 0.0];
    mapped(&[n, n], CellKind::Quadrilateral, &place)
}

fn middle(mesh: &Mesh, points: &IntegrationPoints) -> f64 {
    let dofs = supports(mesh, &|x| [x[0] == 0.0; 3]);
    let load = traction(mesh, &dofs, &|x| x[0] == 48.0, &|_, _| [0.0, 1.0 / 16.0, 0.0]);
    let still = vec![[0.0; 3]; mesh.positions().len()];
    let u = solve(points, lame(1.0, 1.0 / 3.0, 2, Plane::Stress), &dofs, &load.forces, &still);
    u[node_at(mesh, [48.0, 52.0, 0.0])][1]
}

#[test]
fn e5_cook_membrane_q4() {
    let pinned = expected("E5")["Q4 n=2,4,8,16"].clone();
    for (row, (n, usual)) in [(2, 11.845), (4, 18.299), (8, 22.079), (16, 23.430)].into_iter().enumerate() {
        let mesh = panel(n);
        let exactly = middle(&mesh, &elements::with_gauss_points(&mesh, 3, 1.0));
        assert_close(&format!("n = {n}"), exactly, pinned[row].as_f64().expect("a number"), 1e-10);
        let found = middle(&mesh, &points("q4", &mesh));
        assert!((found - usual).abs() < 1e-3, "n = {n}: {found} with 2 x 2 points");
    }
}
