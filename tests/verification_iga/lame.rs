//! E1, E2, E9: a thick cylinder under inner pressure p (Lame).
//!
//! ```text
//!     sigma_r, sigma_t = c (1 -+ b^2/r^2),   c = p a^2 / (b^2 - a^2)
//!     u_r = (1 + nu)/E c ((1 - 2 nu) r + b^2/r)     plane strain
//!     u_r = c/E ((1 - nu) r + (1 + nu) b^2/r)       plane stress
//! ```
//!
//! A quarter is modelled; symmetry holds y on the x axis and x on the y axis. The pinned numbers were made with p + 2
//! Gauss points for K, p + 3 for the pressure and p + 4 for the error norms.

use springfit::geometry::patch::Patch;
use springfit::reference::loads::{self, Face};
use springfit::reference::material::Plane;
use springfit::reference::stress;

use crate::bodies::quarter_ring;
use crate::problem::{Errors, Exact, Solved, errors, held, lame, solve};
use crate::table::{assert_close, expected, rates, rows};

#[derive(Clone, Copy)]
struct Cylinder {
    inner: f64,
    outer: f64,
    young: f64,
    poisson: f64,
    plane: Plane,
}

impl Cylinder {
    /// p a^2 / (b^2 - a^2) at pressure 1.
    fn scale(&self) -> f64 {
        self.inner.powi(2) / (self.outer.powi(2) - self.inner.powi(2))
    }

    fn radial_displacement(&self, r: f64) -> f64 {
        let (nu, far) = (self.poisson, self.outer.powi(2) / r);
        let shape = match self.plane {
            Plane::Strain => (1.0 + nu) * ((1.0 - 2.0 * nu) * r + far),
            Plane::Stress => (1.0 - nu) * r + (1.0 + nu) * far,
        };
        self.scale() / self.young * shape
    }

    /// Radial and hoop stress.
    fn principal(&self, r: f64) -> [f64; 2] {
        let ratio = self.outer.powi(2) / r.powi(2);
        [self.scale() * (1.0 - ratio), self.scale() * (1.0 + ratio)]
    }

    fn displacement(&self, x: [f64; 3]) -> [f64; 3] {
        let r = x[0].hypot(x[1]);
        let u = self.radial_displacement(r) / r;
        [u * x[0], u * x[1], 0.0]
    }

    fn stress(&self, x: [f64; 3]) -> [[f64; 3]; 3] {
        let r = x[0].hypot(x[1]);
        let ([radial, hoop], [c, s]) = (self.principal(r), [x[0] / r, x[1] / r]);
        let shear = (radial - hoop) * c * s;
        [[radial * c * c + hoop * s * s, shear, 0.0], [shear, radial * s * s + hoop * c * c, 0.0], [0.0; 3]]
    }

    fn solve(&self, degree: usize, elements: [usize; 2]) -> (Patch, Solved) {
        let body = quarter_ring(self.inner, self.outer, degree, elements);
        let dofs = held(&body, &[("y-", &[1]), ("y+", &[0])]);
        // on the polygon of degree 1 the pressure acts along the normal of the polygon
        let face = Face { patch: &body, name: "x-", thickness: 1.0, extra_points: 2 };
        let load = loads::traction(face, &dofs, &|_, n| n.map(|n| -n)).expect("a pressure");
        let given = vec![[0.0; 3]; body.points().len()];
        let solved = solve(&body, 1, lame(self.young, self.poisson, self.plane), &dofs, &load.forces, &given);
        (body, solved)
    }

    fn errors(&self, body: &Patch, solved: &Solved) -> Errors {
        let exact = Exact { displacement: &|x| self.displacement(x), stress: &|x| self.stress(x) };
        errors(body, 3, lame(self.young, self.poisson, self.plane), &solved.displacement, &exact)
    }
}

const CYLINDER: Cylinder = Cylinder { inner: 1.0, outer: 2.0, young: 1000.0, poisson: 0.3, plane: Plane::Strain };

#[test]
fn e1_lame_cylinder() {
    for (name, plane) in [("pstrain", Plane::Strain), ("pstress", Plane::Stress)] {
        let cylinder = Cylinder { plane, ..CYLINDER };
        let pinned = &expected("E1")[name];
        let number = |key: &str| pinned[key].as_f64().expect("a number");
        let (body, solved) = cylinder.solve(4, [16, 16]);
        let law = lame(cylinder.young, cylinder.poisson, plane);
        let at = |radial: f64| stress::at(&body, law, &solved.displacement, [radial, 0.0, 0.0]);
        let (inside, outside) = (at(0.0), at(1.0));
        assert_close("u_r(a)", inside.displacement[0], number("u_r(a)"), 1e-8);
        assert_close("u_r(b)", outside.displacement[0], number("u_r(b)"), 1e-8);
        assert_close("sigma_r(a)", inside.stress[0][0], number("sigma_r(a)"), 1e-5);
        assert_close("sigma_t(a)", inside.stress[1][1], number("sigma_t(a)"), 1e-5);
        assert_close("sigma_t(b)", outside.stress[1][1], number("sigma_t(b)"), 1e-5);
        assert_close("strain energy", solved.energy, number("strain_energy_quarter"), 1e-12);
        assert_close("exact", cylinder.radial_displacement(1.0), number("u_r(a)"), 1e-15);
    }
}

#[test]
fn e2_lame_convergence() {
    for degree in 1..=4 {
        let pinned = expected("E2")[format!("p={degree}")].clone();
        let (mut l2, mut energy_norm) = (Vec::new(), Vec::new());
        for row in rows(&pinned["mesh,dof,relL2,relEnergy,energy"]) {
            let m = row[0] as usize;
            let (body, solved) = CYLINDER.solve(degree, [m, m]);
            let found = CYLINDER.errors(&body, &solved);
            let name = format!("p={degree} {m} x {m}");
            assert_eq!(2 * body.points().len(), row[1] as usize, "{name}");
            // an error of 5e-9 of u is known to rounding of u only
            assert_close(&format!("{name} L2"), found.l2, row[2], 1e-11 + 1e-15 / found.l2);
            assert_close(&format!("{name} energy norm"), found.energy_norm, row[3], 1e-11 + 1e-15 / found.energy_norm);
            assert_close(&format!("{name} energy"), solved.energy, row[4], 1e-12);
            l2.push(found.l2);
            energy_norm.push(found.energy_norm);
        }
        let (l2, energy) = (rates(&l2), rates(&energy_norm));
        println!("p={degree} rates {l2:?} {energy:?}");
        // p = 4 is still rising on these meshes: 4.72 and 3.73 are what the pinned table has
        let slack = if degree == 4 { 0.3 } else { 0.2 };
        assert!(l2[l2.len() - 1] >= degree as f64 + 1.0 - slack, "p={degree} L2 rates {l2:?}");
        assert!(energy[energy.len() - 1] >= degree as f64 - slack, "p={degree} energy rates {energy:?}");
    }
}

#[test]
fn e9_cylinder_near_incompressibility() {
    for poisson in [0.3, 0.49, 0.499, 0.4999, 0.49999] {
        let cylinder = Cylinder { inner: 3.0, outer: 9.0, poisson, ..CYLINDER };
        let pinned = expected("E9")[format!("nu={poisson}")].clone();
        let exact = cylinder.radial_displacement(3.0);
        assert_close("exact", exact, pinned["exact u_r(3)"].as_f64().expect("a number"), 1e-14);
        for degree in 2..=4 {
            let (_, solved) = cylinder.solve(degree, [5, 2]);
            let ratio = pinned[format!("IGA p={degree} 5x2 ratio")].as_f64().expect("a number");
            let name = format!("nu={poisson} p={degree}");
            assert_close(&name, solved.displacement[0][0] / exact, ratio, 4e-14 / (1.0 - 2.0 * poisson));
        }
    }
}
