//! E5: Cook's membrane, a tapered panel (0, 0), (48, 44), (48, 60), (0, 44) in plane stress, clamped at x = 0 and sheared at
//! x = 48 by a force of 1. What is compared is u_y in the middle of that side.

use springfit::geometry::mesh::CellKind;
use springfit::reference::material::Plane;

use crate::problem::{lame, mapped, node_at, points, solve, supports, traction};
use crate::table::{assert_close, expected};

#[test]
fn e5_cook_membrane_q4() {
    let pinned = expected("E5")["Q4 n=2,4,8,16"].clone();
    for (row, n) in [2, 4, 8, 16].into_iter().enumerate() {
        let panel = |[x, y, _]: [f64; 3]| [48.0 * x, (1.0 - y) * 44.0 * x + y * (44.0 + 16.0 * x), 0.0];
        let mesh = mapped(&[n, n], CellKind::Quadrilateral, &panel);
        let dofs = supports(&mesh, &|x| [x[0] == 0.0; 3]);
        let load = traction(&mesh, &dofs, &|x| x[0] == 48.0, &|_, _| [0.0, 1.0 / 16.0, 0.0]);
        let still = vec![[0.0; 3]; mesh.positions().len()];
        let u = solve(&points("q4", &mesh), lame(1.0, 1.0 / 3.0, 2, Plane::Stress), &dofs, &load.forces, &still);
        let middle = u[node_at(&mesh, [48.0, 52.0, 0.0])];
        assert_close(&format!("n = {n}"), middle[1], pinned[row].as_f64().expect("a number"), 1e-10);
    }
}
