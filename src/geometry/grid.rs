//! A structured grid of nodes in two or three directions.
//!
//! Node (i, j, k) has the number (i n_1 + j) n_2 + k: C order, the last index runs fastest. Cell (i, j, k) has the
//! corners (i..=i+1, j..=j+1, k..=k+1). A two-dimensional grid is stored with a third extent of one.

/// Extents of a grid of nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    extents: [usize; 3],
    dimension: usize,
}

impl Grid {
    /// A grid with `shape.len()` directions (2 or 3), `shape[a]` nodes along direction a.
    ///
    /// # Panics
    /// When the number of directions is not 2 or 3: a caller's mistake, scenes are checked before.
    pub fn new(shape: &[usize]) -> Self {
        assert!(shape.len() == 2 || shape.len() == 3, "a grid has 2 or 3 directions, not {}", shape.len());
        let mut extents = [1; 3];
        extents[..shape.len()].copy_from_slice(shape);
        Self { extents, dimension: shape.len() }
    }

    /// Number of directions, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Nodes along each direction; length [`Grid::dimension`].
    pub fn shape(&self) -> &[usize] {
        &self.extents[..self.dimension]
    }

    /// Nodes along each of three directions, 1 where there is none.
    pub fn extents(&self) -> [usize; 3] {
        self.extents
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.extents.iter().product()
    }

    /// True for a grid without nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of the node with this index.
    pub fn node(&self, index: [usize; 3]) -> usize {
        (index[0] * self.extents[1] + index[1]) * self.extents[2] + index[2]
    }

    /// Index of a node; zero in the directions the grid does not have.
    pub fn index(&self, node: usize) -> [usize; 3] {
        let [_, n1, n2] = self.extents;
        [node / (n1 * n2), node / n2 % n1, node % n2]
    }

    /// The corner nodes of every cell, 2^d each, last index fastest; cells in C order.
    pub fn cells(&self) -> Vec<Vec<u32>> {
        let steps: Vec<usize> = self
            .extents
            .iter()
            .enumerate()
            .map(|(a, &n)| if a < self.dimension { n.saturating_sub(1) } else { 1 })
            .collect();
        let last = usize::from(self.dimension == 3);
        let mut cells = Vec::with_capacity(steps.iter().product());
        for i in 0..steps[0] {
            for j in 0..steps[1] {
                for k in 0..steps[2] {
                    let mut corners = Vec::with_capacity(4 << last);
                    for (di, dj) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        for dk in 0..=last {
                            corners.push(self.node([i + di, j + dj, k + dk]) as u32);
                        }
                    }
                    cells.push(corners);
                }
            }
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_and_indices_are_inverse_in_c_order() {
        let grid = Grid::new(&[3, 4, 5]);
        assert_eq!(grid.node([1, 2, 3]), 33);
        assert!((0..grid.len()).all(|node| grid.node(grid.index(node)) == node));
        assert_eq!(Grid::new(&[2, 3]).cells(), vec![vec![0, 1, 3, 4], vec![1, 2, 4, 5]]);
    }
}
