//! Degrees of freedom: which components of which nodes can move.
//!
//! A node has d components (d = 2 or 3). Fixed components are never assembled: the free ones are numbered 0..n_free in
//! the order of the nodes. Nodes that lie on each other may be tied (a merged seam): all nodes of a tie share the
//! numbers of the first of them, its *master*.

use super::grid::Grid;

/// The value of [`DofMap::free`] for a component that cannot move.
pub const FIXED: u32 = u32::MAX;

/// Numbers of the free degrees of freedom of a set of nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DofMap {
    dimension: usize,
    master: Vec<u32>,
    free: Vec<u32>,
    owner: Vec<(u32, u8)>,
}

impl DofMap {
    /// Numbers the free components.
    ///
    /// `master[i]` is the node that node i is tied to (`i` itself if to none; masters come first: `master[i] <= i`);
    /// `fixed[i][a]` holds component a of node i. A tie is fixed where one of its nodes is.
    ///
    /// # Panics
    /// When the two slices differ in length.
    pub fn new(dimension: usize, master: Vec<u32>, fixed: &[[bool; 3]]) -> Self {
        assert_eq!(master.len(), fixed.len(), "one master and one support for every node");
        let mut held = vec![[false; 3]; master.len()];
        for (node, components) in fixed.iter().enumerate() {
            for a in 0..dimension {
                held[master[node] as usize][a] |= components[a];
            }
        }
        let mut free = vec![FIXED; master.len() * dimension];
        let mut owner = Vec::new();
        for node in 0..master.len() {
            let first = master[node] as usize;
            for a in 0..dimension {
                if first != node {
                    free[node * dimension + a] = free[first * dimension + a];
                } else if !held[node][a] {
                    free[node * dimension + a] = owner.len() as u32;
                    owner.push((node as u32, a as u8));
                }
            }
        }
        Self { dimension, master, free, owner }
    }

    /// A map without ties.
    pub fn untied(dimension: usize, fixed: &[[bool; 3]]) -> Self {
        Self::new(dimension, (0..fixed.len() as u32).collect(), fixed)
    }

    /// The same nodes with more components held: node and component of each.
    pub fn holding(&self, more: &[(usize, usize)]) -> Self {
        let held = |node: usize| std::array::from_fn(|a| a < self.dimension && self.free(node)[a] == FIXED);
        let mut fixed: Vec<[bool; 3]> = (0..self.nodes()).map(held).collect();
        more.iter().for_each(|&(node, component)| fixed[node][component] = true);
        Self::new(self.dimension, self.master.clone(), &fixed)
    }

    /// Components of a node, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of nodes, tied ones included.
    pub fn nodes(&self) -> usize {
        self.master.len()
    }

    /// Number of free degrees of freedom.
    pub fn len(&self) -> usize {
        self.owner.len()
    }

    /// True when nothing can move.
    pub fn is_empty(&self) -> bool {
        self.owner.is_empty()
    }

    /// The node that `node` is tied to, itself if to none.
    pub fn master(&self, node: usize) -> usize {
        self.master[node] as usize
    }

    /// The nodes that stand for themselves, in ascending order.
    pub fn masters(&self) -> impl Iterator<Item = usize> + '_ {
        self.master.iter().enumerate().filter(|&(node, &master)| node == master as usize).map(|(node, _)| node)
    }

    /// Numbers of the components of a node, [`FIXED`] where it is held; length d.
    pub fn free(&self, node: usize) -> &[u32] {
        &self.free[node * self.dimension..(node + 1) * self.dimension]
    }

    /// The node and the component of a free degree of freedom.
    pub fn owner(&self, dof: usize) -> (usize, usize) {
        let (node, component) = self.owner[dof];
        (node as usize, component as usize)
    }

    /// Grid directions whose last plane of nodes is tied to the first.
    pub fn closed(&self, grid: &Grid) -> [bool; 3] {
        [0, 1, 2].map(|a| {
            let last = grid.extents()[a] - 1;
            let tied = |node: usize| {
                let mut index = grid.index(node);
                let at_end = index[a] == last;
                index[a] = 0;
                !at_end || self.master(node) == self.master(grid.node(index))
            };
            last > 1 && (0..grid.len()).all(tied)
        })
    }

    /// The free degrees of freedom in the order of their nodes in `nodes` (an elimination order of all nodes).
    pub fn order(&self, nodes: &[u32]) -> Vec<u32> {
        let masters = nodes.iter().map(|&node| node as usize).filter(|&node| self.master(node) == node);
        masters.flat_map(|node| self.free(node)).copied().filter(|&dof| dof != FIXED).collect()
    }

    /// Spreads a vector over the free degrees of freedom to all nodes, zero where fixed; shape nodes x 3.
    pub fn expand(&self, u: &[f64]) -> Vec<[f64; 3]> {
        (0..self.nodes())
            .map(|node| {
                let mut value = [0.0; 3];
                for (a, &dof) in self.free(node).iter().enumerate() {
                    if dof != FIXED {
                        value[a] = u[dof as usize];
                    }
                }
                value
            })
            .collect()
    }
}

/// Ties the nodes at equal positions: the master of each node, the first node within `tolerance` of it in space.
///
/// `positions` in metres, n x 3; `tolerance` in metres.
pub fn tie_coincident(positions: &[[f64; 3]], tolerance: f64) -> Vec<u32> {
    let mut order: Vec<usize> = (0..positions.len()).collect();
    order.sort_by(|&i, &j| positions[i][0].total_cmp(&positions[j][0]).then(i.cmp(&j)));
    let mut master: Vec<u32> = (0..positions.len() as u32).collect();
    for (rank, &i) in order.iter().enumerate() {
        for &j in order[rank + 1..].iter().take_while(|&&j| positions[j][0] - positions[i][0] <= tolerance) {
            let near = (0..3).all(|a| (positions[i][a] - positions[j][a]).abs() <= tolerance);
            if near {
                let first = master[i].min(master[j]);
                master[i] = first;
                master[j] = first;
            }
        }
    }
    for node in 0..master.len() {
        master[node] = master[master[node] as usize];
    }
    master
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tied_nodes_share_their_numbers_and_their_supports() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1e-15, 0.0, 0.0], [1.0, 1.0, 0.0]];
        let master = tie_coincident(&positions, 1e-12);
        assert_eq!(master, [0, 1, 0, 3]);
        let mut fixed = [[false; 3]; 4];
        fixed[2][1] = true;
        let dofs = DofMap::new(2, master, &fixed);
        assert_eq!(dofs.free(0), [0, FIXED]);
        assert_eq!(dofs.free(2), dofs.free(0));
        assert_eq!(dofs.len(), 5);
        assert_eq!(dofs.owner(1), (1, 0));
        assert_eq!(dofs.expand(&[1.0, 2.0, 3.0, 4.0, 5.0])[2], [1.0, 0.0, 0.0]);
        assert_eq!(dofs.masters().collect::<Vec<_>>(), [0, 1, 3]);
    }
}
