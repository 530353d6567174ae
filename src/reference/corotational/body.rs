//! Energy, force and products with the tangent of a body, without a matrix.
//!
//! A smoothed gradient is an average over cells, so everything goes by way of the cells and costs little more than
//! ordinary finite elements:
//!
//! ```text
//!     F_e = sum_a x_a g_ea^T,     F_k = sum_e w V_e/V_k F_e          places to cells to domains
//!     P_e = sum_k w P_k,          f_a = - sum_e V_e P_e g_ea         domains to cells to nodes
//! ```
//!
//! The second line is the sum over domains of the module page with the two sums exchanged. Every loop runs in parallel over what it
//! writes and adds in a fixed order, so the bits do not depend on the number of threads; nothing is allocated.

use nalgebra_sparse::na::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::reference::corotational::Tangent;
use crate::reference::corotational::plane;
use crate::reference::corotational::rotation;
use crate::reference::corotational::twist::Twist;
use crate::reference::material::Lame;
use crate::reference::methods::smoothed::{Cells, Domains};
use crate::reference::ragged::Ragged;

/// Items of a parallel loop that one task takes at least.
const AT_LEAST: usize = 256;

/// What a domain knows of the present state.
#[derive(Debug, Clone, Copy)]
struct State {
    /// F_k.
    gradient: Matrix3<f64>,
    /// R_k.
    rotation: Matrix3<f64>,
    /// e_k.
    strain: Matrix3<f64>,
    /// The rotation for the next time.
    memory: UnitQuaternion<f64>,
}

/// A corotational body and its present state.
#[derive(Debug, Clone)]
pub struct Corotational {
    domains: Domains,
    /// The constants of each domain.
    constants: Vec<Lame>,
    /// For each cell its domains and its share w in each.
    domains_of_cells: Ragged<(u32, f64)>,
    /// For each node its cells and its place among their nodes.
    cells_of_nodes: Ragged<(u32, u32)>,
    states: Vec<State>,
    twists: Vec<Twist>,
    tangent: Tangent,
    /// In two dimensions gradients are F = [F_2 0; 0 1].
    planar: bool,
    stresses: Vec<Matrix3<f64>>,
    cells: Vec<Matrix3<f64>>,
}

impl Corotational {
    /// A body at rest.
    ///
    /// # Errors
    /// [`Error::Input`] at `geometry` for a body without cells.
    pub fn new(domains: Domains, lame: Lame) -> Result<Self> {
        if domains.is_empty() {
            return Err(Error::input("geometry", "the body has no cells", "give a mesh of triangles or tetrahedra"));
        }
        let cells = domains.cells();
        let members = (0..domains.len()).flat_map(|k| domains.members(k).iter().map(move |m| (k as u32, m)));
        let domains_of_cells = Ragged::gather(cells.len(), members.map(|(k, m)| (m.cell, (k, m.share))));
        let corners = (0..cells.len()).flat_map(|e| {
            cells.nodes(e).iter().enumerate().map(move |(local, &node)| (node, (e as u32, local as u32)))
        });
        let cells_of_nodes = Ragged::gather(domains.nodes(), corners);
        let at_rest = State {
            gradient: Matrix3::identity(),
            rotation: Matrix3::identity(),
            strain: Matrix3::zeros(),
            memory: UnitQuaternion::identity(),
        };
        Ok(Self {
            constants: (0..domains.len()).map(|k| domains.part(k).of(lame)).collect(),
            states: vec![at_rest; domains.len()],
            twists: vec![Twist::none(); domains.len()],
            tangent: Tangent::Warped,
            planar: domains.dimension() == 2,
            stresses: vec![Matrix3::zeros(); domains.len()],
            cells: vec![Matrix3::zeros(); cells.len()],
            domains_of_cells,
            cells_of_nodes,
            domains,
        })
    }

    /// The domains of the body.
    pub fn domains(&self) -> &Domains {
        &self.domains
    }

    /// The constants that act in a domain.
    pub fn constants(&self, domain: usize) -> Lame {
        self.constants[domain]
    }

    /// F_k at the present places.
    pub fn gradient(&self, domain: usize) -> &Matrix3<f64> {
        &self.states[domain].gradient
    }

    /// R_k at the present places.
    pub fn rotation(&self, domain: usize) -> &Matrix3<f64> {
        &self.states[domain].rotation
    }

    /// Brings the nodes to `places` (m, one for each node): gradients, rotations and strains.
    ///
    /// # Panics
    /// When there is not one place for each node.
    pub fn place(&mut self, places: &[[f64; 3]]) {
        assert_eq!(places.len(), self.domains.nodes(), "one place for each node");
        spread(self.domains.cells(), places, &mut self.cells);
        let (domains, cells, planar) = (&self.domains, &self.cells, self.planar);
        self.states.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(k, state)| {
            state.gradient = average(domains, cells, k);
            state.rotation = if planar {
                state.gradient[(2, 2)] = 1.0;
                plane::extract(&state.gradient, &mut state.memory)
            } else {
                rotation::extract(&state.gradient, &mut state.memory)
            };
            let stretch = state.rotation.tr_mul(&state.gradient);
            state.strain = (stretch + stretch.transpose()) * 0.5 - Matrix3::identity();
        });
    }

    /// Elastic energy in J at the present places.
    pub fn energy(&self) -> f64 {
        let energy = |k: usize| {
            let (Lame { lambda, mu }, strain) = (self.constants[k], &self.states[k].strain);
            let trace = strain.trace();
            self.domains.volume(k) * (mu * strain.norm_squared() + 0.5 * lambda * trace * trace)
        };
        (0..self.states.len()).map(energy).sum()
    }

    /// Writes the elastic force on every node in N, that is minus the gradient of the energy.
    ///
    /// # Panics
    /// When there is not one force for each node.
    pub fn forces(&mut self, forces: &mut [[f64; 3]]) {
        let (states, constants) = (&self.states, &self.constants);
        self.stresses.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(k, stress)| {
            *stress = states[k].rotation * hooke(constants[k], &states[k].strain);
        });
        self.collect(forces, -1.0);
    }

    /// Force in N that rounding may leave on a node of a body whose coordinates (m) are up to `extent`: an error of eps
    /// in every coordinate gives one of eps extent |g| in a gradient, whose stress acts on the node through all its cells.
    pub fn rounding(&self, extent: f64) -> f64 {
        let cells = self.domains.cells();
        let length = |g: [f64; 3]| Vector3::from(g).norm();
        let steepest = self.domains.all_acting().iter().map(|acting| length(acting.gradient)).fold(0.0, f64::max);
        let hardest = self.constants.iter().map(|lame| 3.0 * lame.lambda.abs() + 2.0 * lame.mu).fold(0.0, f64::max);
        let reach = |node: usize| -> f64 {
            let around = self.cells_of_nodes.row(node).iter().map(|&(cell, local)| (cell as usize, local as usize));
            around.map(|(cell, local)| cells.volume(cell) * length(cells.gradients(cell)[local])).sum()
        };
        let widest = (0..self.domains.nodes()).map(reach).fold(0.0, f64::max);
        8.0 * f64::EPSILON * (1.0 + extent * steepest) * hardest * widest
    }

    /// P_k in Pa, as the last call of [`Corotational::forces`] found it.
    pub fn stress(&self, domain: usize) -> &Matrix3<f64> {
        &self.stresses[domain]
    }

    /// Chooses the tangent at the present places for [`Corotational::apply`] and for the matrix.
    pub fn linearise(&mut self, tangent: Tangent) {
        self.tangent = tangent;
        if tangent == Tangent::Warped {
            return;
        }
        let (states, constants) = (&self.states, &self.constants);
        let of = if self.planar { plane::twist } else { Twist::of };
        self.twists.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(k, twist)| {
            *twist = of(&states[k].gradient, constants[k], tangent);
        });
    }

    /// The twists of a domain in the tangent that was chosen last; `None` in the warped one.
    pub fn twist(&self, domain: usize) -> Option<&Twist> {
        (self.tangent != Tangent::Warped).then(|| &self.twists[domain])
    }

    /// Writes the product of the tangent that was chosen last with one vector for each node: N for displacements in m.
    ///
    /// # Panics
    /// When there is not one vector for each node.
    pub fn apply(&mut self, directions: &[[f64; 3]], products: &mut [[f64; 3]]) {
        assert_eq!(directions.len(), self.domains.nodes(), "one direction for each node");
        spread(self.domains.cells(), directions, &mut self.cells);
        let (domains, cells, states, constants) = (&self.domains, &self.cells, &self.states, &self.constants);
        let twists = (self.tangent != Tangent::Warped).then_some(&self.twists);
        self.stresses.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(k, stress)| {
            let change = average(domains, cells, k);
            let rotation = &states[k].rotation;
            let turned = rotation.tr_mul(&change);
            *stress = rotation * hooke(constants[k], &((turned + turned.transpose()) * 0.5));
            if let Some(twists) = twists {
                *stress += twists[k].apply(&change);
            }
        });
        self.collect(products, 1.0);
    }

    /// Adds up the stresses over cells and nodes.
    fn collect(&mut self, sums: &mut [[f64; 3]], sign: f64) {
        assert_eq!(sums.len(), self.domains.nodes(), "one vector for each node");
        let (stresses, domains_of_cells, table) = (&self.stresses, &self.domains_of_cells, self.domains.cells());
        self.cells.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(e, sum)| {
            *sum = Matrix3::zeros();
            for &(domain, share) in domains_of_cells.row(e) {
                *sum += stresses[domain as usize] * share;
            }
            *sum *= sign * table.volume(e);
        });
        let (cells, cells_of_nodes) = (&self.cells, &self.cells_of_nodes);
        sums.par_iter_mut().with_min_len(AT_LEAST).enumerate().for_each(|(node, sum)| {
            let mut total = Vector3::zeros();
            for &(cell, local) in cells_of_nodes.row(node) {
                total += cells[cell as usize] * Vector3::from(table.gradients(cell as usize)[local as usize]);
            }
            *sum = total.into();
        });
    }
}

/// sum_a x_a g_ea^T of every cell.
fn spread(table: &Cells, places: &[[f64; 3]], cells: &mut [Matrix3<f64>]) {
    let cells = cells.par_iter_mut().with_min_len(AT_LEAST).enumerate();
    cells.for_each(|(e, sum)| *sum = cell_gradient(table, e, places));
}

/// sum_a x_a g_ea^T of one cell. The gradients of a cell add up to zero, so places count from its first node.
pub(super) fn cell_gradient(table: &Cells, cell: usize, places: &[[f64; 3]]) -> Matrix3<f64> {
    let nodes = table.nodes(cell);
    let first = places[nodes[0] as usize];
    let mut sum = Matrix3::zeros();
    for (&node, gradient) in nodes.iter().zip(table.gradients(cell)).skip(1) {
        let place = places[node as usize];
        for (j, g) in gradient.iter().enumerate() {
            (0..3).for_each(|i| sum[(i, j)] += (place[i] - first[i]) * g);
        }
    }
    sum
}

/// The mean over the cells of a domain.
fn average(domains: &Domains, cells: &[Matrix3<f64>], domain: usize) -> Matrix3<f64> {
    domains.members(domain).iter().map(|member| cells[member.cell as usize] * member.weight).sum()
}

/// 2 mu e + lambda tr(e) 1
fn hooke(Lame { lambda, mu }: Lame, strain: &Matrix3<f64>) -> Matrix3<f64> {
    strain * (2.0 * mu) + Matrix3::from_diagonal_element(lambda * strain.trace())
}
