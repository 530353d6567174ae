//! T10: quadratic tetrahedra, made from a mesh of linear ones.
//!
//! Every edge gets a node at its middle, numbered after the corners, edges in the order of their sorted corners. With the
//! barycentric coordinates L_a of the tetrahedron,
//!
//! ```text
//!     corner a     N = L_a (2 L_a - 1)      dN/dx = (4 L_a - 1) g_a
//!     edge a-b     N = 4 L_a L_b            dN/dx = 4 (L_a g_b + L_b g_a)
//! ```
//!
//! Faces stay flat, so the products of gradients are quadratic and four points at L = (.585, .138, .138, .138) and its
//! permutations, V/4 each, integrate the stiffness exactly (A. H. Stroud, Approximate Calculation of Multiple Integrals,
//! 1971). Every point is a domain of its own, so that everything that works on smoothing domains works here. Against the
//! smoothed methods on the same corners it is the accurate answer.
//!
//! The consistent mass of a tetrahedron of mass m has the same d x d block for all directions: m/420 times 6 between a corner
//! and itself and 1 to another; -4 between an edge and its corners and -6 to the others; 32 between an edge and itself, 16
//! to one that meets it and 8 to the opposite one. Its row sums are negative at the corners, so the lumped mass of linear
//! elements has no counterpart here.

use nalgebra_sparse::CsrMatrix;

use crate::error::{Error, Result};
use crate::geometry::dofs::DofMap;
use crate::geometry::mesh::{CellKind, Mesh};
use crate::reference::methods::smoothed::{Cells, Domains};
use crate::sparse::assemble::assemble;
use crate::sparse::pattern::Pattern;

/// Corners at the ends of the six edges of a tetrahedron.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Barycentric coordinates of a quadrature point at its own corner, (5 + 3 sqrt 5) / 20, and at the others.
const NEAR: f64 = 0.585_410_196_624_968_5;
const FAR: f64 = (1.0 - NEAR) / 3.0;

/// Quadratic tetrahedra.
#[derive(Debug, Clone)]
pub struct Quadratic {
    /// Places of corners and middles in m.
    pub positions: Vec<[f64; 3]>,
    /// Four corners and six middles of each tetrahedron.
    pub cells: Vec<[u32; 10]>,
}

impl Quadratic {
    /// Puts nodes on the middles of the edges of a mesh of tetrahedra.
    ///
    /// # Errors
    /// [`Error::Input`] at `geometry` for cells that are no tetrahedra.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        if let Some(cell) = (0..mesh.cells()).find(|&cell| mesh.kind(cell) != CellKind::Tetrahedron) {
            let message = format!("cell {cell} is a {:?}", mesh.kind(cell));
            return Err(Error::input("geometry", message, "tetrahedra only for quadratic tetrahedra"));
        }
        let ends = |cell: usize, edge: [usize; 2]| {
            let [a, b] = edge.map(|corner| mesh.corners(cell)[corner]);
            [a.min(b), a.max(b)]
        };
        let mut edges: Vec<[u32; 2]> = (0..mesh.cells()).flat_map(|cell| EDGES.map(|edge| ends(cell, edge))).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut positions = mesh.positions().to_vec();
        let place = |node: u32| mesh.positions()[node as usize];
        positions.extend(edges.iter().map(|&[a, b]| [0, 1, 2].map(|i| 0.5 * (place(a)[i] + place(b)[i]))));
        let first = mesh.positions().len();
        let cells = (0..mesh.cells())
            .map(|cell| {
                let middle = |edge| edges.binary_search(&ends(cell, edge)).expect("every edge was collected");
                let middles = EDGES.map(|edge| (first + middle(edge)) as u32);
                std::array::from_fn(|i| if i < 4 { mesh.corners(cell)[i] } else { middles[i - 4] })
            })
            .collect();
        Ok(Self { positions, cells })
    }
}

/// The quadrature points of the quadratic tetrahedra over a mesh, as domains; nodes as in [`Quadratic::new`].
///
/// # Errors
/// Those of [`Quadratic::new`], and [`Error::Input`] at `geometry` for cells without positive volume.
pub fn domains(mesh: &Mesh) -> Result<Domains> {
    let quadratic = Quadratic::new(mesh)?;
    let linear = Cells::simplices(mesh, 1.0)?;
    let mut points = Cells::empty(10);
    for (cell, nodes) in quadratic.cells.iter().enumerate() {
        for near in 0..4 {
            let gradients = gradients(coordinates(near), linear.gradients(cell));
            points.push(nodes, &gradients, 0.25 * linear.volume(cell));
        }
    }
    let mut table = Domains::empty(3, quadratic.positions.len(), 1.0, points);
    for point in 0..4 * quadratic.cells.len() {
        table.push_cell(&quadratic.positions, point, &values(coordinates(point % 4)));
    }
    Ok(table)
}

/// The consistent mass over the free degrees of freedom in kg, for a density in kg/m^3.
///
/// # Errors
/// Those of [`domains`].
pub fn mass(mesh: &Mesh, density: f64, dofs: &DofMap) -> Result<CsrMatrix<f64>> {
    let quadratic = Quadratic::new(mesh)?;
    let linear = Cells::simplices(mesh, 1.0)?;
    let dofs_of = |cell: usize| quadratic.cells[cell].iter().flat_map(|&node| dofs.free(node as usize)).copied();
    let cliques: Vec<Vec<u32>> = (0..quadratic.cells.len()).map(|cell| dofs_of(cell).collect()).collect();
    let pattern = Pattern::from_cliques(dofs.len(), cliques.iter().map(Vec::as_slice));
    assemble(
        &pattern,
        cliques.len(),
        || (),
        |cell, (), out| {
            out.dofs.clone_from(&cliques[cell]);
            out.values.clear();
            let scale = density * linear.volume(cell) / 420.0;
            out.values.extend((0..900).map(|entry| match (entry / 30, entry % 30) {
                (row, column) if row % 3 == column % 3 => scale * mass_weight(row / 3, column / 3),
                _ => 0.0,
            }));
            Ok(())
        },
    )
}

/// 420 times the integral of N_a N_b over a tetrahedron of volume 1.
fn mass_weight(a: usize, b: usize) -> f64 {
    let (low, high) = (a.min(b), a.max(b));
    let common = |edge: [usize; 2], other: [usize; 2]| edge.iter().filter(|corner| other.contains(corner)).count();
    match (low < 4, high < 4) {
        (true, true) => [1.0, 6.0][usize::from(low == high)],
        (true, false) => [-6.0, -4.0][usize::from(EDGES[high - 4].contains(&low))],
        _ => [8.0, 16.0, 32.0][common(EDGES[low - 4], EDGES[high - 4])],
    }
}

/// Barycentric coordinates of a quadrature point.
fn coordinates(near: usize) -> [f64; 4] {
    std::array::from_fn(|a| if a == near { NEAR } else { FAR })
}

fn values(l: [f64; 4]) -> [f64; 10] {
    std::array::from_fn(|i| match i {
        0..4 => l[i] * (2.0 * l[i] - 1.0),
        _ => 4.0 * l[EDGES[i - 4][0]] * l[EDGES[i - 4][1]],
    })
}

fn gradients(l: [f64; 4], g: &[[f64; 3]]) -> [[f64; 3]; 10] {
    std::array::from_fn(|i| match i {
        0..4 => g[i].map(|component| (4.0 * l[i] - 1.0) * component),
        _ => {
            let [a, b] = EDGES[i - 4];
            [0, 1, 2].map(|x| 4.0 * (l[a] * g[b][x] + l[b] * g[a][x]))
        }
    })
}
