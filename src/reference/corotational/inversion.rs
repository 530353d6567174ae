//! Which cells and which domains are turned inside out.
//!
//! A cell with det F_e <= 0 is flat or inverted. A domain averages cells, so its own gradient can be sound while a cell
//! in it is inverted: both are looked at. The force pushes an inverted domain back, an inverted cell in a sound domain it
//! does not see.

use nalgebra_sparse::na::{Matrix3, Vector3};

use crate::reference::corotational::body::cell_gradient;
use crate::reference::methods::smoothed::Domains;

/// What is inverted, and by how much.
#[derive(Debug, Clone, PartialEq)]
pub struct Inversion {
    /// Cells with det F <= 0, or with a determinant that is no number.
    pub cells: Vec<u32>,
    /// Smallest det F of a cell.
    pub least_cell: f64,
    /// Domains with det F <= 0, or with a determinant that is no number.
    pub domains: Vec<u32>,
    /// Smallest det F of a domain.
    pub least_domain: f64,
}

impl Inversion {
    /// Looks at a body whose nodes are at `places` (m).
    pub fn of(domains: &Domains, places: &[[f64; 3]]) -> Self {
        let table = domains.cells();
        // in the plane the third direction stays as it is
        let third = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, f64::from(u8::from(domains.dimension() == 2))));
        let gradients: Vec<Matrix3<f64>> = (0..table.len()).map(|e| cell_gradient(table, e, places) + third).collect();
        let mean = |k: usize| -> Matrix3<f64> {
            domains.members(k).iter().map(|member| gradients[member.cell as usize] * member.weight).sum()
        };
        let (cells, least_cell) = inverted(gradients.iter().map(Matrix3::determinant));
        let (inverted_domains, least_domain) = inverted((0..domains.len()).map(|k| mean(k).determinant()));
        Self { cells, least_cell, domains: inverted_domains, least_domain }
    }

    /// True when nothing is inverted.
    pub fn is_sound(&self) -> bool {
        self.cells.is_empty() && self.domains.is_empty()
    }
}

/// Numbers of what is not positive, and the smallest.
fn inverted(determinants: impl Iterator<Item = f64>) -> (Vec<u32>, f64) {
    let (mut found, mut least) = (Vec::new(), f64::INFINITY);
    for (i, determinant) in determinants.enumerate() {
        if determinant.is_nan() || determinant <= 0.0 {
            found.push(i as u32);
        }
        least = if determinant.is_nan() { f64::NAN } else { least.min(determinant) };
    }
    (found, least)
}
