//! E4: the rows of degree 1 of the cantilever of Timoshenko and Goodier are bilinear elements: length 48, depth 12, a parabolic
//! shear of 1000 N at its end, the exact displacement at the other.
//!
//! ```text
//!     u_x =  P y / (6 E I) ((6 L - 3 x) x + (2 + nu)(y^2 - D^2/4)),      I = D^3 / 12
//!     u_y = -P / (6 E I) (3 nu y^2 (L - x) + (4 + 5 nu) D^2 x / 4 + (3 L - x) x^2)
//!     sigma_xy = -P / (2 I) (D^2/4 - y^2)
//! ```

use springfit::geometry::mesh::CellKind;
use springfit::reference::material::Plane;
use springfit::reference::stiffness::internal_forces;

use crate::problem::{lame, mapped, points, solve, supports, traction};
use crate::table::{assert_close, expected, rates, rows};

const LENGTH: f64 = 48.0;
const DEPTH: f64 = 12.0;
const LOAD: f64 = 1000.0;
const YOUNG: f64 = 3e7;
const POISSON: f64 = 0.3;
const INERTIA: f64 = DEPTH * DEPTH * DEPTH / 12.0;

fn exact([x, y, _]: [f64; 3]) -> [f64; 3] {
    let scale = LOAD / (6.0 * YOUNG * INERTIA);
    let square = DEPTH * DEPTH / 4.0;
    let bent = 3.0 * POISSON * y * y * (LENGTH - x) + (4.0 + 5.0 * POISSON) * square * x;
    [
        scale * y * ((6.0 * LENGTH - 3.0 * x) * x + (2.0 + POISSON) * (y * y - square)),
        -scale * (bent + (3.0 * LENGTH - x) * x * x),
        0.0,
    ]
}

#[test]
fn e4_timoshenko_cantilever_q4() {
    let law = lame(YOUNG, POISSON, 2, Plane::Stress);
    let mut errors = Vec::new();
    for row in rows(&expected("E4")["runs nx,ny,dof,relL2,relEnergy,tip"]["p=1"]) {
        let cells = [row[0] as usize, row[1] as usize];
        let place = |[x, y, _]: [f64; 3]| [LENGTH * x, DEPTH * (y - 0.5), 0.0];
        let mesh = mapped(&cells, CellKind::Quadrilateral, &place);
        assert_eq!(2 * mesh.positions().len(), row[2] as usize);
        let dofs = supports(&mesh, &|x| [x[0] == 0.0; 3]);
        let shear = |x: [f64; 3], _| [0.0, -LOAD / (2.0 * INERTIA) * (DEPTH * DEPTH / 4.0 - x[1] * x[1]), 0.0];
        let load = traction(&mesh, &dofs, &|x| x[0] == LENGTH, &shear);
        let root = |x: &[f64; 3]| if x[0] == 0.0 { exact(*x) } else { [0.0; 3] };
        let given: Vec<_> = mesh.positions().iter().map(root).collect();
        let elements = points("q4", &mesh);
        let u = solve(&elements, law, &dofs, &load.forces, &given);
        // the tip is the middle of the end: a node, or between the two of one element
        let end: Vec<usize> = (0..u.len()).filter(|&node| mesh.positions()[node][0] == LENGTH).collect();
        let tip = 0.5 * (u[end[cells[1] / 2]][1] + u[end[cells[1].div_ceil(2)]][1]);
        assert_close(&format!("{cells:?} tip"), tip, row[5], 1e-11);
        errors.push((tip - exact([LENGTH, 0.0, 0.0])[1]).abs());
        let total = internal_forces(&elements, law, &u).expect("forces").iter().fold(0.0, |sum, f| sum + f[1]);
        assert!(total.abs() < 1e-9 * LOAD, "the root carries the load: {total} is left");
    }
    let rates = rates(&errors);
    assert!(rates[rates.len() - 1] > 1.9, "the tip converges with the square of the cell: {rates:?}");
}
