//! Loads that the scene does not have: they try a network from all sides, and no fit sees them.
//!
//! | loads | what for |
//! |---|---|
//! | all forces of degree 2 in the place | where the network is too soft and too stiff ([`crate::calibration::compliance_ratios`]) |
//! | `uniform_x`, `uniform_y`, `uniform_z` | errors under loads outside the fit, where the scene holds none out |
//! | `torsion` about the longest axis of the box around the nodes (in the plane about z) | the same |
//! | `bending`: growing along that axis, in the direction of the next | the same |
//! | `radial`, `random_smooth` (seed 1) | the same ([`load_fields`]) |
//!
//! All have 1 N as their strength, for small displacements: neither ratios nor errors in percent depend on it. They hold as
//! the scene's own do, with the same supports. The continuum answers them with the factor of its load cases, the
//! network with one more factorisation; where either is solved by iterations, or its factor is large, they would take longer
//! than the fit (cube of 17^3: 11 s for the continuum beside a fit of 2 s), and are tried only when the scene asks for them
//! (`calibration.generalisation = true`).

use crate::calibration::compliance_ratios::Basis;
use crate::error::Result;
use crate::reference::load_fields::{self, Field};
use crate::reference::loads;
use crate::reference::polynomial_loads::polynomial_loads;
use crate::reference::reason_to_factor;
use crate::scene::Scene;

use super::body::Body;
use super::large;
use super::loads::LoadCase;
use super::network::Lattice;

/// Most free degrees of freedom for which other loads are tried unasked.
const LARGEST: usize = 20_000;

/// Seed of the random load: the same load in every run.
const SEED: u64 = 1;

/// Extents as near as this, relative, are equal: of equal ones the last is the longest.
const SAME: f64 = 1e-9;

/// The loads.
pub struct OtherLoads {
    /// Names of the force fields of degree 2.
    pub fields: Vec<String>,
    /// Those of them that are independent.
    pub basis: Basis,
    /// How many of the basis are of degree 1 or 0: they come first.
    pub linear: usize,
    /// Generated load cases; none where the scene holds a case out itself.
    pub cases: Vec<LoadCase>,
    /// All forces over the free degrees of freedom, one after the other, N: those of the basis, then those of the cases.
    pub forces: Vec<f64>,
}

/// The other loads of a scene; the inner error says why there are none.
///
/// # Errors
/// What the integration of the reference can fail with.
pub fn build(scene: &Scene, body: &Body, lattice: &Lattice) -> Result<std::result::Result<OtherLoads, &'static str>> {
    if let Some(why) = left_out(scene, body, lattice)? {
        return Ok(Err(why));
    }
    let fields = polynomial_loads(body.positions(), &body.dofs);
    let basis = Basis::new(body.dofs.len(), fields.iter().map(|field| field.forces.as_slice()));
    let cases = if scene.load.iter().all(|load| load.fit) { generated(body) } else { vec![] };
    let linear = basis.kept.iter().filter(|&&i| fields[i].degree < 2).count();
    let forces = basis.forces.iter().chain(cases.iter().flat_map(|case| &case.load.forces)).copied().collect();
    Ok(Ok(OtherLoads { fields: fields.into_iter().map(|field| field.name).collect(), basis, linear, cases, forces }))
}

fn left_out(scene: &Scene, body: &Body, lattice: &Lattice) -> Result<Option<&'static str>> {
    let costly = "it would take longer than the fit: springs or continuum are solved by iterations, or their factors are \
                  large; calibration.generalisation = true asks for it";
    Ok(match scene.calibration.generalisation {
        Some(false) => Some("calibration.generalisation is false"),
        _ if large::is_asked(scene) => Some("under large displacements the network is another at every load"),
        Some(true) => None,
        None if body.dofs.len() > LARGEST || lattice.symbolic.is_none() => Some(costly),
        None => reason_to_factor(&body.integration_points()?, &body.dofs).is_none().then_some(costly),
    })
}

/// Load cases of 1 N on a body; without those that its supports take at once.
fn generated(body: &Body) -> Vec<LoadCase> {
    let (dofs, positions) = (&body.dofs, body.positions());
    let dimension = dofs.dimension();
    let unit = |a: usize| -> [f64; 3] { std::array::from_fn(|i| f64::from(i == a)) };
    let along = longest(positions, dimension);
    let about = if dimension == 3 { along } else { 2 };
    let (along, direction) = (unit(along), unit((along + 1) % dimension));
    let uniform = (0..dimension).map(|a| (format!("uniform_{}", ['x', 'y', 'z'][a]), loads::per_node(dofs, unit(a))));
    let fields = [
        ("torsion", Field::Torsion { axis: unit(about) }),
        ("bending", Field::Bending { along, direction }),
        ("radial", Field::Radial),
        ("random_smooth", Field::RandomSmooth { seed: SEED }),
    ];
    let fields = fields.map(|(name, field)| (name.to_owned(), load_fields::load(&field, 1.0, positions, dofs)));
    // a load on held components only moves nothing, and is none
    let moving = uniform.chain(fields).filter_map(|(name, load)| Some((name, load.ok()?)));
    moving.map(|(name, load)| LoadCase { name, fit: false, load }).collect()
}

/// The axis along which the box around the nodes is longest.
fn longest(positions: &[[f64; 3]], dimension: usize) -> usize {
    let extent = |a: usize| {
        let along = || positions.iter().map(|x| x[a]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    (0..dimension).fold(0, |best, a| if extent(a) >= extent(best) * (1.0 - SAME) { a } else { best })
}
