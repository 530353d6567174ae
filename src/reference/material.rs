//! Isotropic linear elasticity.
//!
//! With strain e = (grad u + grad u^T) / 2 the stress is
//!
//! ```text
//!     sigma = lambda tr(e) 1 + 2 mu e
//!     mu     = E / (2 (1 + nu))
//!     lambda = E nu / ((1 + nu)(1 - 2 nu))      in three dimensions and in plane strain
//!     lambda = E nu / (1 - nu^2)                in plane stress, trace over the plane
//! ```
//!
//! Plane strain: nothing moves along z. Plane stress: nothing pulls along z; eliminating e_zz gives the second lambda,
//! so that one law with two numbers serves all three cases (thesis section 2.2; any book on elasticity). Plane stress
//! stays finite at nu = 1/2; the other two do not, and close to 1/2 many elements lock ([`super::locking`]).
//!
//! Units: E, lambda, mu in Pa; nu without unit.

use crate::error::{Error, Result};

/// What the body is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus E in Pa, positive.
    pub young: f64,
    /// Poisson's ratio nu, between -1 and 1/2.
    pub poisson: f64,
}

/// How a two-dimensional body behaves across its plane. Three-dimensional bodies do not look at it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// A thin sheet: sigma_zz = 0.
    Stress,
    /// A slice of a long body: e_zz = 0.
    Strain,
}

/// The two elastic constants in Pa, already those of the plane problem where the body is two-dimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lame {
    /// First constant, on the trace of the strain over the directions the body has.
    pub lambda: f64,
    /// Second constant, the shear modulus.
    pub mu: f64,
}

impl Material {
    /// The elastic constants of a body with `dimension` directions (2 or 3).
    ///
    /// # Errors
    /// [`Error::Input`] at `material.young` or `material.poisson` for a value outside its range.
    pub fn lame(&self, dimension: usize, plane: Plane) -> Result<Lame> {
        let Self { young, poisson, .. } = *self;
        self.check()?;
        let mu = young / (2.0 * (1.0 + poisson));
        if dimension == 2 && plane == Plane::Stress {
            return Ok(Lame { lambda: young * poisson / (1.0 - poisson * poisson), mu });
        }
        if poisson >= 0.5 {
            return Err(Error::input(
                "material.poisson",
                format!("{poisson} makes the material incompressible"),
                "below 0.5 in three dimensions and in plane strain; 0.5 itself only in plane stress",
            ));
        }
        Ok(Lame { lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), mu })
    }

    fn check(&self) -> Result<()> {
        if !(self.young.is_finite() && self.young > 0.0) {
            let message = format!("{} is not a positive number", self.young);
            return Err(Error::input("material.young", message, "a finite number above 0"));
        }
        match self.poisson > -1.0 && self.poisson <= 0.5 {
            true => Ok(()),
            false => Err(Error::input(
                "material.poisson",
                format!("{} is outside the range of a stable material", self.poisson),
                "above -1 and below 0.5 (0.5 itself in plane stress)",
            )),
        }
    }
}

impl Lame {
    /// kappa = lambda + 2 mu / 3 in Pa: what a change of volume costs; in three dimensions and in plane strain the bulk
    /// modulus.
    pub fn volumetric(&self) -> f64 {
        self.lambda + 2.0 / 3.0 * self.mu
    }

    /// Stress in Pa of a displacement gradient `gradient[a][b]` = du_a/dx_b (3x3, zero in missing directions).
    ///
    /// In two dimensions the in-plane components are those of the plane problem; the zz component is left as
    /// lambda tr(e), which is right in plane strain and not used in plane stress, where it is zero.
    pub fn stress(&self, gradient: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let trace = gradient[0][0] + gradient[1][1] + gradient[2][2];
        let mut stress = [[0.0; 3]; 3];
        for a in 0..3 {
            for b in 0..3 {
                stress[a][b] = self.mu * (gradient[a][b] + gradient[b][a]);
            }
            stress[a][a] += self.lambda * trace;
        }
        stress
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEEL: Material = Material { young: 210e9, poisson: 0.3 };

    /// Pulls along x so that the other free directions contract by nu: the answer is E e in every setting.
    #[test]
    fn uniaxial_stress_gives_young_modulus() {
        let (e, nu) = (1e-3, STEEL.poisson);
        let solid = STEEL.lame(3, Plane::Stress).unwrap();
        let sigma = solid.stress(&[[e, 0.0, 0.0], [0.0, -nu * e, 0.0], [0.0, 0.0, -nu * e]]);
        assert!((sigma[0][0] / (STEEL.young * e) - 1.0).abs() < 1e-14 && sigma[1][1].abs() < 1e-6);
        let sheet = STEEL.lame(2, Plane::Stress).unwrap();
        let sigma = sheet.stress(&[[e, 0.0, 0.0], [0.0, -nu * e, 0.0], [0.0; 3]]);
        assert!((sigma[0][0] / (STEEL.young * e) - 1.0).abs() < 1e-14 && sigma[1][1].abs() < 1e-6);
        let slice = STEEL.lame(2, Plane::Strain).unwrap();
        let sigma = slice.stress(&[[e, 0.0, 0.0], [0.0, -nu / (1.0 - nu) * e, 0.0], [0.0; 3]]);
        assert!((sigma[0][0] / (STEEL.young / (1.0 - nu * nu) * e) - 1.0).abs() < 1e-14 && sigma[1][1].abs() < 1e-6);
    }

    #[test]
    fn hard_case_poisson_ratio() {
        let with = |poisson| Material { poisson, ..STEEL };
        let key = |result: Result<Lame>| match result {
            Err(Error::Input { key, .. }) => key,
            other => panic!("expected an input error, got {other:?}"),
        };
        for (dimension, plane) in [(3, Plane::Stress), (2, Plane::Strain)] {
            assert_eq!(key(with(0.5).lame(dimension, plane)), "material.poisson");
            assert!(with(0.4999).lame(dimension, plane).is_ok());
        }
        assert!(with(0.5).lame(2, Plane::Stress).is_ok());
        for bad in [-1.0, 0.51, f64::NAN, f64::INFINITY] {
            assert_eq!(key(with(bad).lame(2, Plane::Stress)), "material.poisson");
        }
        assert_eq!(key(Material { young: 0.0, ..STEEL }.lame(3, Plane::Stress)), "material.young");
    }
}
