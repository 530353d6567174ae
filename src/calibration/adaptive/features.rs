//! What tells springs apart in space: the numbers that a split looks at.
//!
//! A split of a group is "feature < threshold". Each feature is one number a spring, of the spring itself or of its middle
//! x_m = (x_a + x_b) / 2; on a grid the middle also has an index, i_m = i_a + offset / 2, which counts in layers. A feature that
//! a body does not have (layers of a mesh without a grid) is the same number for all springs, so it splits nothing.

use crate::geometry::grid::Grid;
use crate::springs::network::{Network, Spring};

use super::places::extent;

/// Part of the size of a feature below which two values are one.
const SAME: f64 = 1e-7;

/// Where a network stands.
pub struct Site<'a> {
    /// The springs at rest.
    pub network: &'a Network,
    /// The grid of the nodes, if they lie on one.
    pub grid: Option<Grid>,
    /// Nodes on the boundary of the body, ascending.
    pub boundary: &'a [u32],
    /// Nodes with a held component, ascending.
    pub held: &'a [u32],
}

/// A number of a spring.
pub struct Feature {
    /// Its name in the names of groups.
    pub name: &'static str,
    /// What it is, with its unit.
    pub doc: &'static str,
    /// True for a length or a coordinate, m; otherwise a number near 1.
    pub is_length: bool,
    /// The number.
    pub value: fn(&Site, &Spring) -> f64,
}

/// All features; of two splits of a group that gain the same the one with the earlier feature is taken ([`super::ties`]).
pub const FEATURES: &[Feature] = &[
    Feature {
        name: "layer_1",
        doc: "middle along the first grid direction, in layers from its start",
        is_length: false,
        value: |site, s| layer(site, s, 0),
    },
    Feature {
        name: "layer_2",
        doc: "middle along the second grid direction",
        is_length: false,
        value: |site, s| layer(site, s, 1),
    },
    Feature {
        name: "layer_3",
        doc: "middle along the third grid direction",
        is_length: false,
        value: |site, s| layer(site, s, 2),
    },
    Feature {
        name: "depth",
        doc: "layers between the middle and the nearest end of the grid",
        is_length: false,
        value: depth,
    },
    Feature { name: "x", doc: "middle, m", is_length: true, value: |site, s| middle(site, s)[0] },
    Feature { name: "y", doc: "middle, m", is_length: true, value: |site, s| middle(site, s)[1] },
    Feature { name: "z", doc: "middle, m", is_length: true, value: |site, s| middle(site, s)[2] },
    Feature {
        name: "d_x",
        doc: "direction, first component",
        is_length: false,
        value: |site, s| direction(site, s)[0],
    },
    Feature {
        name: "d_y",
        doc: "direction, second component",
        is_length: false,
        value: |site, s| direction(site, s)[1],
    },
    Feature {
        name: "d_z",
        doc: "direction, third component",
        is_length: false,
        value: |site, s| direction(site, s)[2],
    },
    Feature { name: "length", doc: "rest length, m", is_length: true, value: |_, s| s.length },
    Feature {
        name: "multiplicity",
        doc: "cells that contain the spring",
        is_length: false,
        value: |_, s| f64::from(s.cells),
    },
    Feature {
        name: "to_boundary",
        doc: "distance of the middle from the nearest node of the boundary, m",
        is_length: true,
        value: |site, s| nearest(site, s, site.boundary),
    },
    Feature {
        name: "to_support",
        doc: "distance of the middle from the nearest held node, m",
        is_length: true,
        value: |site, s| nearest(site, s, site.held),
    },
];

fn middle(site: &Site, spring: &Spring) -> [f64; 3] {
    let [a, b] = spring.nodes.map(|node| site.network.positions[node as usize]);
    std::array::from_fn(|c| 0.5 * (a[c] + b[c]))
}

/// The direction of a spring. On a grid it points the way that the grid does; elsewhere which end comes first is a matter of how
/// nodes are numbered, so it points to where the first component that is not zero grows.
fn direction(site: &Site, spring: &Spring) -> [f64; 3] {
    let backwards = site.grid.is_none() && spring.direction.iter().find(|d| d.abs() > SAME).is_some_and(|d| *d < 0.0);
    if backwards { spring.direction.map(|d| -d) } else { spring.direction }
}

fn layer(site: &Site, spring: &Spring, direction: usize) -> f64 {
    let index = |grid: &Grid| grid.index(spring.nodes[0] as usize)[direction] as f64;
    site.grid.as_ref().map_or(0.0, |grid| index(grid) + 0.5 * f64::from(spring.offset[direction]))
}

fn depth(site: &Site, spring: &Spring) -> f64 {
    let Some(grid) = &site.grid else { return 0.0 };
    let one = |a: usize| {
        let at = layer(site, spring, a);
        at.min((grid.shape()[a] - 1) as f64 - at)
    };
    (0..grid.dimension()).map(one).fold(f64::INFINITY, f64::min)
}

fn nearest(site: &Site, spring: &Spring, nodes: &[u32]) -> f64 {
    let here = middle(site, spring);
    let square = |node: &u32| -> f64 {
        site.network.positions[*node as usize].iter().zip(here).map(|(x, m)| (x - m).powi(2)).sum()
    };
    nodes.iter().map(square).reduce(f64::min).unwrap_or(0.0).sqrt()
}

/// The features of all springs, one vector each in the order of [`FEATURES`].
pub fn table(site: &Site) -> Vec<Vec<f64>> {
    FEATURES
        .iter()
        .map(|feature| site.network.springs.iter().map(|spring| (feature.value)(site, spring)).collect())
        .collect()
}

/// For each feature how far two values are one: rounding of coordinates is no place to split at.
pub fn resolutions(site: &Site) -> Vec<f64> {
    let extent = extent(&site.network.positions);
    FEATURES.iter().map(|feature| SAME * if feature.is_length { extent } else { 1.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::dofs::DofMap;
    use crate::springs::topology;

    #[test]
    fn features_of_one_cell() {
        let grid = Grid::new(&[2, 2]);
        let positions = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
        let dofs = DofMap::untied(2, &[[false; 3]; 4]);
        let network = (topology::find("grid").unwrap().connect)(&grid, &positions, &dofs);
        let site = Site { network: &network, grid: Some(grid), boundary: &[0, 1, 2, 3], held: &[0, 2] };
        let table = table(&site);
        let edge = network.springs.iter().position(|spring| spring.nodes == [1, 3]).unwrap();
        let of = |name: &str| table[FEATURES.iter().position(|feature| feature.name == name).unwrap()][edge];
        assert_eq!(
            ["layer_1", "layer_2", "depth", "x", "y", "d_x", "length"].map(of),
            [0.5, 1.0, 0.0, 1.0, 1.0, 1.0, 2.0]
        );
        assert_eq!(["multiplicity", "to_boundary"].map(of), [1.0, 1.0]);
        assert_eq!(of("to_support"), 2.0_f64.sqrt());
    }
}
