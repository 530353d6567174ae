//! E3: an infinite plate with a hole of radius 1 under tension T along x (Kirsch), a quarter of it cut out as a square.
//!
//! The body is one patch whose outer corner is two coincident control points, so that det dx/dxi = 0 there. Symmetry
//! holds y on the x axis and x on the y axis; the outer edges carry the exact traction. Plane stress. The pinned numbers
//! were made with p + 4 Gauss points for K, p + 7 for the traction and p + 6 for the error norms.

use springfit::reference::material::Plane;
use springfit::reference::stress;

use crate::bodies::plate_with_hole;
use crate::problem::{Exact, errors, exact_traction, held, lame, solve};
use crate::table::{assert_close, expected, rates, rows};

const TENSION: f64 = 10.0;
const YOUNG: f64 = 1e5;
const POISSON: f64 = 0.3;

/// Displacement with kappa = (3 - nu)/(1 + nu), in polar coordinates about the centre of the hole.
fn displacement(x: [f64; 3]) -> [f64; 3] {
    let (r, angle) = (x[0].hypot(x[1]), x[1].atan2(x[0]));
    let kappa = (3.0 - POISSON) / (1.0 + POISSON);
    let scale = TENSION * (1.0 + POISSON) / (4.0 * YOUNG);
    let ([c, s], [c3, s3]) = ([angle.cos(), angle.sin()], [(3.0 * angle).cos(), (3.0 * angle).sin()]);
    let (near, nearer) = (2.0 / r, 2.0 / r.powi(3));
    [
        scale * (r * (kappa + 1.0) * c + near * ((1.0 + kappa) * c + c3) - nearer * c3),
        scale * (r * (kappa - 3.0) * s + near * ((1.0 - kappa) * s + s3) - nearer * s3),
        0.0,
    ]
}

fn kirsch_stress(x: [f64; 3]) -> [[f64; 3]; 3] {
    let (r, angle) = (x[0].hypot(x[1]), x[1].atan2(x[0]));
    let (near, nearer) = (1.0 / r.powi(2), 1.5 / r.powi(4));
    let ([c2, s2], [c4, s4]) = ([(2.0 * angle).cos(), (2.0 * angle).sin()], [(4.0 * angle).cos(), (4.0 * angle).sin()]);
    let shear = TENSION * (-near * (0.5 * s2 + s4) + nearer * s4);
    [
        [TENSION * (1.0 - near * (1.5 * c2 + c4) + nearer * c4), shear, 0.0],
        [shear, TENSION * (-near * (0.5 * c2 - c4) - nearer * c4), 0.0],
        [0.0; 3],
    ]
}

#[test]
fn e3_kirsch_plate() {
    let pinned = expected("E3");
    let exact = Exact { displacement: &displacement, stress: &kirsch_stress };
    let law = lame(YOUNG, POISSON, Plane::Stress);
    for (degree, least_rate) in [(2, 1.99), (3, 2.8)] {
        let mut energy_norms = Vec::new();
        for row in rows(&pinned["conv"][format!("p={degree}")]["m,dof,relL2,relEnergy,energy,sxx(0,1),exactEnergyQuad"])
        {
            let body = plate_with_hole(degree, row[0] as usize);
            let name = format!("p={degree} m={}", row[0]);
            assert_eq!(2 * body.points().len(), row[1] as usize, "{name}");
            let dofs = held(&body, &[("x-", &[1]), ("x+", &[0])]);
            let forces = exact_traction(&body, "y+", 6, &dofs, &exact);
            let solved = solve(&body, 3, law, &dofs, &forces, &vec![[0.0; 3]; body.points().len()]);
            let found = errors(&body, 5, law, &solved.displacement, &exact);
            let top = stress::at(&body, law, &solved.displacement, [1.0, 0.0, 0.0]);
            assert_close(&format!("{name} L2"), found.l2, row[2], 1e-9);
            assert_close(&format!("{name} energy norm"), found.energy_norm, row[3], 1e-9);
            assert_close(&format!("{name} energy"), solved.energy, row[4], 1e-12);
            assert_close(&format!("{name} sxx(0,1)"), top.stress[0][0], row[5], 1e-9);
            assert_close(&format!("{name} exact energy"), found.exact_energy, row[6], 1e-12);
            energy_norms.push(found.energy_norm);
        }
        let rates = rates(&energy_norms);
        println!("p={degree} energy rates {rates:?}");
        assert!(rates[rates.len() - 1] >= least_rate, "p={degree} energy rates {rates:?}");
    }
}

#[test]
fn e3_kirsch_closed_form() {
    let pinned = expected("E3");
    let number = |key: &str| pinned[key].as_f64().expect("a number");
    assert_close("sxx(0,1)", kirsch_stress([0.0, 1.0, 0.0])[0][0], number("exact sxx(0,1)"), 1e-15);
    assert_close("syy(-1,0)", kirsch_stress([-1.0, 0.0, 0.0])[1][1], number("exact syy(-1,0)"), 1e-15);
    assert_close("ux(-1,0)", displacement([-1.0, 0.0, 0.0])[0], number("exact ux(-1,0)"), 1e-15);
    assert_close("uy(0,1)", displacement([0.0, 1.0, 0.0])[1], number("exact uy(0,1)"), 1e-15);
}
