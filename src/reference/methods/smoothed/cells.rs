//! Cells with one set of gradients each: linear simplices, or the quadrature points of higher elements.
//!
//! For a tetrahedron with edges e_i = X_i - X_0 and det = e_1 . (e_2 x e_3),
//!
//! ```text
//!     g_1 = e_2 x e_3 / det,  g_2 = e_3 x e_1 / det,  g_3 = e_1 x e_2 / det,  g_0 = -(g_1 + g_2 + g_3),  V = det / 6
//! ```
//!
//! in 1/m and m^3. A triangle is the same with e_3 the unit vector across the plane and V = det / 2 times the thickness.
//! Then sum_a g_a = 0 and sum_a X_a g_a^T = 1.

use crate::error::{Error, Result};
use crate::geometry::mesh::{CellKind, Mesh};

/// Gradients and volumes.
#[derive(Debug, Clone)]
pub struct Cells {
    per_cell: usize,
    nodes: Vec<u32>,
    gradients: Vec<[f64; 3]>,
    volumes: Vec<f64>,
}

impl Cells {
    /// The simplices of a mesh.
    ///
    /// # Errors
    /// [`Error::Input`] at `geometry` for a cell that is no simplex, or one whose measure is not positive.
    pub fn simplices(mesh: &Mesh, thickness: f64) -> Result<Self> {
        let kind = if mesh.dimension() == 2 { CellKind::Triangle } else { CellKind::Tetrahedron };
        let scale = if mesh.dimension() == 2 { thickness / 2.0 } else { 1.0 / 6.0 };
        let mut cells = Self::empty(kind.corners());
        for cell in 0..mesh.cells() {
            if mesh.kind(cell) != kind {
                let message = format!("cell {cell} is a {:?}", mesh.kind(cell));
                return Err(Error::input("geometry", message, "triangles or tetrahedra only for smoothed methods"));
            }
            let (gradients, determinant) = simplex(mesh, cell)?;
            cells.push(mesh.corners(cell), &gradients[..kind.corners()], scale * determinant);
        }
        Ok(cells)
    }

    /// No cell yet; each will have `per_cell` nodes.
    pub(in crate::reference::methods) fn empty(per_cell: usize) -> Self {
        Self { per_cell, nodes: Vec::new(), gradients: Vec::new(), volumes: Vec::new() }
    }

    /// Appends a cell.
    pub(in crate::reference::methods) fn push(&mut self, nodes: &[u32], gradients: &[[f64; 3]], volume: f64) {
        debug_assert!(nodes.len() == self.per_cell && gradients.len() == self.per_cell);
        self.nodes.extend_from_slice(nodes);
        self.gradients.extend_from_slice(gradients);
        self.volumes.push(volume);
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.volumes.len()
    }

    /// True when there is no cell.
    pub fn is_empty(&self) -> bool {
        self.volumes.is_empty()
    }

    /// Nodes of every cell.
    pub fn per_cell(&self) -> usize {
        self.per_cell
    }

    /// The nodes of a cell.
    pub fn nodes(&self, cell: usize) -> &[u32] {
        &self.nodes[cell * self.per_cell..][..self.per_cell]
    }

    /// Gradients of their shape functions in 1/m.
    pub fn gradients(&self, cell: usize) -> &[[f64; 3]] {
        &self.gradients[cell * self.per_cell..][..self.per_cell]
    }

    /// Volume in m^3, with the thickness in two dimensions.
    pub fn volume(&self, cell: usize) -> f64 {
        self.volumes[cell]
    }
}

/// Gradients of a simplex and its determinant, 6 (space) or 2 (plane) times its measure.
///
/// # Errors
/// [`Error::FoldedElement`] when the determinant is not positive.
pub(in crate::reference::methods) fn simplex(mesh: &Mesh, cell: usize) -> Result<([[f64; 3]; 4], f64)> {
    let place = |a: usize| mesh.positions()[mesh.corners(cell)[a] as usize];
    let edge = |a: usize| [0, 1, 2].map(|i| place(a)[i] - place(0)[i]);
    let edges = [edge(1), edge(2), if mesh.dimension() == 2 { [0.0, 0.0, 1.0] } else { edge(3) }];
    let normals = [cross(edges[1], edges[2]), cross(edges[2], edges[0]), cross(edges[0], edges[1])];
    let determinant: f64 = (0..3).map(|i| edges[0][i] * normals[0][i]).sum();
    if determinant.is_nan() || determinant <= 0.0 {
        let centre = vec![1.0 / (mesh.dimension() + 1) as f64; mesh.dimension()];
        return Err(Error::FoldedElement { element: vec![cell], point: centre, determinant });
    }
    let [g1, g2, mut g3] = normals.map(|normal| normal.map(|n| n / determinant));
    if mesh.dimension() == 2 {
        g3 = [0.0; 3];
    }
    Ok(([[0, 1, 2].map(|i| -(g1[i] + g2[i] + g3[i])), g1, g2, g3], determinant))
}

/// a x b
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
