//! Stiffnesses from the literature, without a fit.
//!
//! Each cell of a mesh gives every spring between two of its corners a share, and the shares of all cells add up.
//!
//! *Lloyd* (3.13; B. Lloyd, G. Szekely, M. Harders, IEEE Trans. Vis. Comput. Graph. 13, 2007) fits the springs of one regular linear
//! element to its stiffness matrix. The fit is good where lambda = mu, that is nu = 1/3 in plane stress and 1/4 in space:
//!
//! | cell, side l | edge | diagonal | needs |
//! |---|---|---|---|
//! | equilateral triangle | sqrt(3)/4 E t | | nu = 1/3, plane stress; exact |
//! | square | 5/16 E t | 7/16 E t | nu = 1/3, plane stress; blocks off the diagonal |
//! | regular tetrahedron | 2 sqrt(2)/25 E l | | nu = 1/4; all blocks |
//!
//! The square compares blocks between different nodes, the tetrahedron all blocks; the other reading of either would
//! give 17/56 and 23/56, or sqrt(2)/12 (see `calibration::objectives::matrix`). There is none for hexahedra.
//!
//! *Van Gelder* (A. Van Gelder, J. Graph. Tools 3(2), 1998) for triangles of any form: around an edge of length c, in triangles whose other
//! two edges have the lengths a and b,
//!
//! ```text
//! van_gelder            k = E t sum_e A_e / c^2                                                            (3.14)
//! van_gelder_poisson    k = E t / (1 + nu) sum_e A_e / c^2 + E t nu / (1 - nu^2) sum_e (a^2 + b^2 - c^2) / (8 A_e)
//! ```
//!
//! The first is the second at nu = 0, and asks only that the springs be as stiff as the body in size: it knows neither nu nor
//! directions. The second needs plane stress (in plane strain E and nu become E / (1 - nu^2) and nu / (1 - nu)), is exact like Lloyd's
//! for equilateral triangles at nu = 1/3, and is negative at an edge that looks at obtuse angles where nu is large: such a
//! network is refused.
//!
//! *The same in space* has its own name, for (3.14) and the paper derive membranes only (the paper touches three dimensions in its
//! outlook): `van_gelder_volume` puts volumes in the place of areas, k = E sum_e V_e / c^2 around an edge of tetrahedra. A regular
//! tetrahedron gets sqrt(2)/12 E l, 4 % more than by Lloyd.
//!
//! Quadrilaterals and hexahedra overlap with their diagonals, so that their areas would count more than once: they are refused.
//! E in Pa, t and lengths in m, A in m^2, V in m^3, k in N/m.

use std::collections::HashMap;

use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::geometry::mesh::{CellKind, Mesh};

use super::network::Network;

/// A nu this near to the one a formula was derived for will do.
const POISSON: f64 = 1e-3;

/// Sides this near to each other, relative, are equal.
const SIDES: f64 = 1e-6;

/// What a formula reads.
#[derive(Clone, Copy)]
pub struct Given<'a> {
    /// The cells.
    pub mesh: &'a Mesh,
    /// The springs between their corners.
    pub network: &'a Network,
    /// Ties of the nodes.
    pub dofs: &'a DofMap,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Thickness, m; 1 in space.
    pub thickness: f64,
    /// True for plane strain.
    pub plane_strain: bool,
}

/// The shares of a cell, from its kind, the distances of its corners in the order of [`pairs`] (m) and its measure:
/// stiffness of the spring between each two corners, N/m.
type Share = fn(&Given, CellKind, &[f64], f64) -> Result<Vec<f64>>;

/// A formula, chosen by its name.
pub struct Formula {
    /// The word in the scene.
    pub name: &'static str,
    /// What it is, in a line.
    pub doc: &'static str,
    share: Share,
}

/// All formulas.
pub const FORMULAS: &[Formula] = &[
    Formula {
        name: "lloyd",
        doc: "(3.13), for squares and equilateral triangles at nu = 1/3, regular tetrahedra at 1/4",
        share: lloyd,
    },
    Formula {
        name: "van_gelder",
        doc: "(3.14), for any triangles: E t area / length^2, whatever nu",
        share: van_gelder,
    },
    Formula {
        name: "van_gelder_poisson",
        doc: "Van Gelder's formula before nu = 0 makes it (3.14), for any triangles without stiffness below 0",
        share: van_gelder_poisson,
    },
    Formula {
        name: "van_gelder_volume",
        doc: "(3.14) with volumes in the place of areas, for any tetrahedra: E volume / length^2, whatever nu",
        share: van_gelder_volume,
    },
];

/// The formula of this name.
pub fn find(name: &str) -> Option<&'static Formula> {
    FORMULAS.iter().find(|formula| formula.name == name)
}

impl Formula {
    /// Stiffness of every spring, N/m.
    ///
    /// # Errors
    /// [`Error::Input`] where the formula does not apply, with what would; for a network that lacks a spring between
    /// two corners of a cell, or has one that is in no cell.
    pub fn stiffness(&self, given: &Given) -> Result<Vec<f64>> {
        let springs = given.network.springs.iter().enumerate();
        let number: HashMap<[u32; 2], usize> = springs.map(|(s, spring)| (ordered(spring.nodes), s)).collect();
        let mut stiffness = vec![0.0; number.len()];
        for cell in 0..given.mesh.cells() {
            let corners = given.mesh.corners(cell);
            let lengths: Vec<f64> = pairs(corners).map(|[a, b]| distance(given.mesh, a, b)).collect();
            let shares = (self.share)(given, given.mesh.kind(cell), &lengths, measure(given.mesh, cell))
                .map_err(|error| in_cell(error, cell))?;
            for ([a, b], share) in pairs(corners).zip(shares) {
                let ends = ordered([a, b].map(|node| given.dofs.master(node as usize) as u32));
                let Some(&s) = number.get(&ends) else {
                    let message = format!("there is no spring between nodes {a} and {b} of cell {cell}");
                    return Err(Error::input("calibration.formula", message, "use a topology with all diagonals"));
                };
                stiffness[s] += share;
            }
        }
        match stiffness.iter().position(|&k| k <= 0.0) {
            Some(s) => Err(no_spring(s, given.network.springs[s].nodes, stiffness[s])),
            None => Ok(stiffness),
        }
    }
}

/// All pairs of corners: 01, 02, ..., 12, ...
fn pairs(corners: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..corners.len()).flat_map(move |i| (i + 1..corners.len()).map(move |j| [corners[i], corners[j]]))
}

fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn step(mesh: &Mesh, a: u32, b: u32) -> [f64; 3] {
    let (a, b) = (mesh.positions()[a as usize], mesh.positions()[b as usize]);
    [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
}

fn distance(mesh: &Mesh, a: u32, b: u32) -> f64 {
    step(mesh, a, b).iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Area of a triangle or volume of a tetrahedron, m^2 or m^3; 0 for other cells, where no formula asks.
fn measure(mesh: &Mesh, cell: usize) -> f64 {
    let corners = mesh.corners(cell);
    let from_first = |i: usize| step(mesh, corners[0], corners[i]);
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let normal = || cross(from_first(1), from_first(2));
    match mesh.kind(cell) {
        CellKind::Triangle => normal().iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0,
        CellKind::Tetrahedron => normal().iter().zip(from_first(3)).map(|(n, x)| n * x).sum::<f64>().abs() / 6.0,
        CellKind::Quadrilateral | CellKind::Hexahedron => 0.0,
    }
}

/// The error of a spring without a positive stiffness `k`, N/m.
fn no_spring(s: usize, nodes: [u32; 2], k: f64) -> Error {
    let (message, help) = match k == 0.0 {
        true => (
            format!("spring {s} joins nodes {nodes:?} that no cell has"),
            "use a topology along edges and diagonals of cells",
        ),
        false => (
            format!("spring {s} between nodes {nodes:?} would have {k:.3e} N/m: it looks at obtuse angles"),
            "\"van_gelder\" is positive on every mesh; calibration.objective = \"matrix\" fits any body in one step",
        ),
    };
    Error::input("calibration.formula", message, help)
}

/// The error of one cell with its number.
fn in_cell(error: Error, cell: usize) -> Error {
    match error {
        Error::Input { key, message, help } if key == "calibration.formula" => {
            Error::input(key, format!("{message} (cell {cell})"), help)
        }
        other => other,
    }
}

fn lloyd(given: &Given, kind: CellKind, lengths: &[f64], _measure: f64) -> Result<Vec<f64>> {
    let (needed, words) = if given.mesh.dimension() == 2 { (1.0 / 3.0, "1/3") } else { (0.25, "1/4") };
    if kind == CellKind::Hexahedron {
        return Err(not_for("lloyd has no formula for hexahedra", "it is for squares, triangles and tetrahedra"));
    }
    if (given.poisson - needed).abs() > POISSON {
        let message = format!("lloyd holds for nu = {words}, not for {}", given.poisson);
        let help = "change the material, or use calibration.objective = \"matrix\"";
        return Err(Error::input("material.poisson", message, help));
    }
    if given.plane_strain {
        let help = "use plane stress, or calibration.objective = \"matrix\"";
        return Err(Error::input("reference.plane", "lloyd holds for plane stress", help));
    }
    let shortest = lengths.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let is = |length: f64, ratio: f64| (length / (ratio * shortest) - 1.0).abs() <= SIDES;
    let plate = given.young * given.thickness;
    let side = |length: &f64| is(*length, 1.0);
    match kind {
        CellKind::Triangle if lengths.iter().all(side) => Ok(vec![3_f64.sqrt() / 4.0 * plate; 3]),
        CellKind::Tetrahedron if lengths.iter().all(side) => {
            Ok(vec![2.0 * 2_f64.sqrt() / 25.0 * given.young * shortest; 6])
        }
        CellKind::Quadrilateral if square(lengths, &is) => Ok(lengths
            .iter()
            .map(|length| if side(length) { 5.0 / 16.0 * plate } else { 7.0 / 16.0 * plate })
            .collect()),
        _ => {
            Err(not_for("lloyd holds for regular cells, and this one is not", "it needs equal sides and right angles"))
        }
    }
}

/// True for four sides and two diagonals of a square.
fn square(lengths: &[f64], is: &dyn Fn(f64, f64) -> bool) -> bool {
    let sides = lengths.iter().filter(|length| is(**length, 1.0)).count();
    let diagonals = lengths.iter().filter(|length| is(**length, 2_f64.sqrt())).count();
    sides == 4 && diagonals == 2
}

fn van_gelder(given: &Given, kind: CellKind, lengths: &[f64], area: f64) -> Result<Vec<f64>> {
    only_triangles("van_gelder", kind)?;
    Ok(lengths.iter().map(|length| given.young * given.thickness * area / (length * length)).collect())
}

fn van_gelder_poisson(given: &Given, kind: CellKind, lengths: &[f64], area: f64) -> Result<Vec<f64>> {
    only_triangles("van_gelder_poisson", kind)?;
    let nu = given.poisson;
    let (young, nu) =
        if given.plane_strain { (given.young / (1.0 - nu * nu), nu / (1.0 - nu)) } else { (given.young, nu) };
    let plate = young * given.thickness;
    let all: f64 = lengths.iter().map(|length| length * length).sum();
    let share = |length: &f64| {
        let c = length * length;
        plate / (1.0 + nu) * area / c + plate * nu / (1.0 - nu * nu) * (all - 2.0 * c) / (8.0 * area)
    };
    Ok(lengths.iter().map(share).collect())
}

fn van_gelder_volume(given: &Given, kind: CellKind, lengths: &[f64], volume: f64) -> Result<Vec<f64>> {
    match kind {
        CellKind::Tetrahedron => Ok(lengths.iter().map(|length| given.young * volume / (length * length)).collect()),
        CellKind::Hexahedron => {
            Err(not_for("van_gelder_volume is for tetrahedra, and this is a hexahedron", "hexahedra have no formula"))
        }
        CellKind::Triangle | CellKind::Quadrilateral => Err(not_for(
            "van_gelder_volume is for tetrahedra, and this cell is flat",
            "triangles have \"van_gelder\" and \"van_gelder_poisson\"",
        )),
    }
}

/// An error for every other cell, with the formula that it has.
fn only_triangles(name: &str, kind: CellKind) -> Result<()> {
    let (other, applies) = match kind {
        CellKind::Triangle => return Ok(()),
        CellKind::Quadrilateral => ("quadrilateral", "squares at nu = 1/3 have \"lloyd\""),
        CellKind::Tetrahedron => ("tetrahedron", "tetrahedra have \"van_gelder_volume\""),
        CellKind::Hexahedron => ("hexahedron", "hexahedra have no formula"),
    };
    Err(not_for(&format!("{name} is for triangles, and this is a {other}"), applies))
}

fn not_for(message: &str, applies: &str) -> Error {
    let help = format!("{applies}; calibration.objective = \"matrix\" fits any body in one step");
    Error::input("calibration.formula", message, help)
}
