//! The table of domains: what every domain averages, and the averaged gradients.
//!
//! The mean shape functions of a domain are those over the part of each cell around its carrier: the simplices between
//! the k corners of the carrier and the centroids of the cell's faces that contain it. A cell in d dimensions gives
//!
//! ```text
//!     mean N_a = (1 + 1/(k+1) + ... + 1/(d+1)) / (d+1)      a on the carrier,     equal shares of the rest off it
//! ```
//!
//! so that the domains around a node hold int N_a dV together. Masses and forces are integrated over the cells all the same.

use crate::error::Result;
use crate::geometry::mesh::Mesh;
use crate::reference::methods::elements;
use crate::reference::methods::smoothed::Smoothing;
use crate::reference::methods::smoothed::carriers::{Incidence, incidences};
use crate::reference::methods::smoothed::cells::Cells;
use crate::reference::points::{ElementPoints, IntegrationPoints, Part};
use crate::reference::ragged::Ragged;

/// A cell in a domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Member {
    /// Which cell.
    pub cell: u32,
    /// Its weight w V_e / V_k in the averages of the domain; the weights of a domain add up to 1.
    pub weight: f64,
    /// The share w of the cell that the domain has.
    pub share: f64,
}

/// A node that acts in a domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Acting {
    /// Which node.
    pub node: u32,
    /// Mean of its shape function.
    pub value: f64,
    /// Mean gradient of its shape function in 1/m.
    pub gradient: [f64; 3],
}

/// Domains over the cells of a body.
#[derive(Debug, Clone)]
pub struct Domains {
    dimension: usize,
    nodes: usize,
    thickness: f64,
    cells: Cells,
    members: Ragged<Member>,
    acting: Ragged<Acting>,
    parts: Vec<Part>,
    volumes: Vec<f64>,
    positions: Vec<[f64; 3]>,
}

impl Domains {
    /// No domain yet over `cells` of a body with `nodes` nodes.
    pub(in crate::reference::methods) fn empty(dimension: usize, nodes: usize, thickness: f64, cells: Cells) -> Self {
        Self {
            dimension,
            nodes,
            thickness: if dimension == 2 { thickness } else { 1.0 },
            cells,
            members: Ragged::default(),
            acting: Ragged::default(),
            parts: Vec::new(),
            volumes: Vec::new(),
            positions: Vec::new(),
        }
    }

    /// One set of domains for each kind of smoothing, one set after the other.
    pub(super) fn averaged(mesh: &Mesh, thickness: f64, sets: &[(Smoothing, Part)]) -> Result<Self> {
        let cells = Cells::simplices(mesh, thickness)?;
        let mut table = Self::empty(mesh.dimension(), mesh.positions().len(), thickness, cells);
        for &(smoothing, part) in sets {
            let (found, share) = incidences(&table.cells, smoothing, table.dimension)?;
            for group in found.chunk_by(|a, b| a.carrier == b.carrier) {
                let carried = MeanValues::new(smoothing.corners(table.dimension), table.dimension);
                table.push_average(mesh.positions(), group, carried, share, part);
            }
        }
        Ok(table)
    }

    /// Appends the domain that averages the cells of `group`.
    fn push_average(&mut self, places: &[[f64; 3]], group: &[Incidence], mean: MeanValues, share: f64, part: Part) {
        let volume: f64 = group.iter().map(|at| share * self.cells.volume(at.cell as usize)).sum();
        for at in group {
            let cell = at.cell as usize;
            let weight = share * self.cells.volume(cell) / volume;
            self.members.push(Member { cell: at.cell, weight, share });
            for (&node, gradient) in self.cells.nodes(cell).iter().zip(self.cells.gradients(cell)) {
                let value = if at.carrier.contains(&node) { mean.on } else { mean.off };
                add(&mut self.acting, Acting { node, value: weight * value, gradient: gradient.map(|g| weight * g) });
            }
        }
        self.close(places, volume, part);
    }

    /// Appends a domain that is one cell, with the values of its shape functions.
    pub(in crate::reference::methods) fn push_cell(&mut self, places: &[[f64; 3]], cell: usize, values: &[f64]) {
        self.members.push(Member { cell: cell as u32, weight: 1.0, share: 1.0 });
        for (i, &node) in self.cells.nodes(cell).iter().enumerate() {
            self.acting.push(Acting { node, value: values[i], gradient: self.cells.gradients(cell)[i] });
        }
        self.close(places, self.cells.volume(cell), Part::Whole);
    }

    /// Ends the domain that was being written.
    fn close(&mut self, places: &[[f64; 3]], volume: f64, part: Part) {
        let mut position = [0.0; 3];
        for acting in self.acting.open_row() {
            (0..3).for_each(|i| position[i] += acting.value * places[acting.node as usize][i]);
        }
        self.members.close();
        self.acting.close();
        self.volumes.push(volume);
        self.positions.push(position);
        self.parts.push(part);
    }

    /// Directions of the body, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Nodes of the body.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// The cells that are averaged.
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Number of domains.
    pub fn len(&self) -> usize {
        self.volumes.len()
    }

    /// True when there is no domain.
    pub fn is_empty(&self) -> bool {
        self.volumes.is_empty()
    }

    /// The cells of a domain.
    pub fn members(&self, domain: usize) -> &[Member] {
        self.members.row(domain)
    }

    /// The nodes that act in a domain.
    pub fn acting(&self, domain: usize) -> &[Acting] {
        self.acting.row(domain)
    }

    /// The acting nodes of all domains, one domain after the other.
    pub fn all_acting(&self) -> &[Acting] {
        self.acting.items()
    }

    /// Where the acting nodes of a domain stand among all.
    pub fn acting_range(&self, domain: usize) -> std::ops::Range<usize> {
        self.acting.range(domain)
    }

    /// Volume of a domain in m^3, with the thickness in two dimensions.
    pub fn volume(&self, domain: usize) -> f64 {
        self.volumes[domain]
    }

    /// What of the material acts in a domain.
    pub fn part(&self, domain: usize) -> Part {
        self.parts[domain]
    }

    /// The domains as integration points: every domain is an element with one point. Smoothed ones overlap, and the cells of
    /// `mesh`, the mesh that they were made of, stand for the body.
    ///
    /// # Errors
    /// Those of [`elements::integration_points`].
    pub fn into_points(self, mesh: &Mesh) -> Result<IntegrationPoints<'_>> {
        let acting = (0..self.len()).map(|k| self.acting(k).iter().map(|acting| acting.node).collect()).collect();
        let (dimension, nodes, thickness) = (self.dimension, self.nodes, self.thickness);
        let (parts, smoothed) = (self.parts.clone(), self.cells.per_cell() == dimension + 1);
        let fill = move |domain: usize, out: &mut ElementPoints| {
            self.fill(domain, out);
            Ok(())
        };
        let points = IntegrationPoints::new(dimension, nodes, thickness, acting, Box::new(fill)).with_parts(parts);
        match smoothed {
            true => Ok(points.over_body(elements::integration_points(mesh, thickness)?)),
            false => Ok(points),
        }
    }

    /// The one point of a domain.
    fn fill(&self, domain: usize, out: &mut ElementPoints) {
        out.clear();
        out.volumes.push(self.volumes[domain]);
        out.positions.push(self.positions[domain]);
        out.values.extend(self.acting(domain).iter().map(|acting| acting.value));
        out.gradients.extend(self.acting(domain).iter().map(|acting| acting.gradient));
    }
}

/// Adds to the entry of a node in the open row, or makes it.
fn add(row: &mut Ragged<Acting>, new: Acting) {
    match row.open_row().iter_mut().find(|acting| acting.node == new.node) {
        Some(acting) => {
            acting.value += new.value;
            (0..3).for_each(|i| acting.gradient[i] += new.gradient[i]);
        }
        None => row.push(new),
    }
}

/// Mean shape functions over the part of a cell around a carrier (module page).
#[derive(Debug, Clone, Copy)]
struct MeanValues {
    on: f64,
    off: f64,
}

impl MeanValues {
    fn new(corners: usize, dimension: usize) -> Self {
        let all = dimension + 1;
        let on = (1.0 + (corners + 1..=all).map(|size| 1.0 / size as f64).sum::<f64>()) / all as f64;
        let others = (all - corners).max(1) as f64;
        Self { on, off: (1.0 - corners as f64 * on) / others }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_shape_functions_add_up_to_a_share_of_the_cell_for_every_node() {
        for dimension in [2, 3] {
            for corners in 1..=dimension + 1 {
                let mean = MeanValues::new(corners, dimension);
                let subsets: Vec<usize> =
                    (0..2_usize << dimension).filter(|s| s.count_ones() as usize == corners).collect();
                let of_first: f64 = subsets.iter().map(|s| if s & 1 == 1 { mean.on } else { mean.off }).sum();
                let expected = subsets.len() as f64 / (dimension + 1) as f64;
                assert!((of_first - expected).abs() < 1e-14, "{dimension} {corners}: {of_first} {expected}");
            }
        }
        assert!((MeanValues::new(3, 3).on - 5.0 / 16.0).abs() < 1e-15);
        assert!((MeanValues::new(2, 3).off - 5.0 / 48.0).abs() < 1e-15);
    }
}
