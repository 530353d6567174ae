//! Elimination orders: in which order a sparse Cholesky factorisation takes the unknowns.
//!
//! *Nested dissection* cuts a grid by a plane of nodes, orders the two halves first and the plane last, and does the
//! same in each half; the factor of an n x n x n grid then has O(n^4) entries instead of the O(n^5) of a band. The cut
//! needs as many planes as the coupling reaches: one for springs between neighbours, p for splines of degree p.
//!
//! Where there is no grid, *approximate minimum degree* ([`minimum_degree`]) orders from the pattern alone; on grids of
//! springs its factorisations cost two to three times as much.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use crate::error::{Error, Result};
use crate::sparse::pattern::Pattern;

/// Nodes of a grid in elimination order: `order[k]` is the node (C order) that is eliminated k-th.
///
/// `extents`: nodes along the three directions (1 where there is none). `reach`: largest index offset of two coupled
/// nodes. `closed`: directions whose last plane is tied to their first (a merged seam); the shared plane comes last.
pub fn nested_dissection(extents: [usize; 3], reach: usize, closed: [bool; 3]) -> Vec<u32> {
    let mut dissection =
        Dissection { extents, reach: reach.max(1), order: Vec::with_capacity(extents.iter().product()) };
    dissection.open([0; 3], extents, closed);
    dissection.order
}

struct Dissection {
    extents: [usize; 3],
    reach: usize,
    order: Vec<u32>,
}

impl Dissection {
    /// Takes the seam planes of closed directions out of the box `low..high`, then dissects.
    fn open(&mut self, low: [usize; 3], high: [usize; 3], closed: [bool; 3]) {
        let Some(a) = (0..3).find(|&a| closed[a] && high[a] - low[a] > 2) else {
            return self.dissect(low, high);
        };
        let mut rest = closed;
        rest[a] = false;
        let (mut inner_low, mut inner_high) = (low, high);
        inner_low[a] += 1;
        inner_high[a] -= 1;
        self.open(inner_low, inner_high, rest);
        for plane in [low[a], high[a] - 1] {
            let (mut plane_low, mut plane_high) = (low, high);
            plane_low[a] = plane;
            plane_high[a] = plane + 1;
            self.open(plane_low, plane_high, rest);
        }
    }

    /// Halves, then the plane between them; boxes too thin to cut are taken node by node.
    fn dissect(&mut self, low: [usize; 3], high: [usize; 3]) {
        let lengths = [0, 1, 2].map(|a| high[a] - low[a]);
        let a = (0..3).fold(0, |longest, a| if lengths[a] > lengths[longest] { a } else { longest });
        if lengths[a] < 2 * self.reach + 1 {
            return self.take(low, high);
        }
        let cut = low[a] + (lengths[a] - self.reach) / 2;
        let (mut left_high, mut right_low) = (high, low);
        left_high[a] = cut;
        right_low[a] = cut + self.reach;
        self.dissect(low, left_high);
        self.dissect(right_low, high);
        let (mut plane_low, mut plane_high) = (low, high);
        plane_low[a] = cut;
        plane_high[a] = cut + self.reach;
        self.take(plane_low, plane_high);
    }

    fn take(&mut self, low: [usize; 3], high: [usize; 3]) {
        let [_, n1, n2] = self.extents;
        for i in low[0]..high[0] {
            for j in low[1]..high[1] {
                for k in low[2]..high[2] {
                    self.order.push(((i * n1 + j) * n2 + k) as u32);
                }
            }
        }
    }
}

/// Unknowns in the order of approximate minimum degree.
///
/// # Errors
/// When the pattern is too large for 32-bit indices.
pub fn minimum_degree(pattern: &Pattern) -> Result<Vec<u32>> {
    let n = pattern.len();
    let too_large =
        |_| Error::input("geometry.control_points", "the pattern has too many entries", "use fewer control points");
    let starts: Vec<u32> = pattern.offsets().iter().map(|&o| o as u32).collect();
    let columns: Vec<u32> = pattern.as_csr().minor_indices().iter().map(|&c| c as u32).collect();
    if u32::try_from(pattern.entries()).is_err() {
        return Err(too_large(()));
    }
    let matrix = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &columns);
    let mut buffer = MemBuffer::new(amd::order_maybe_unsorted_scratch::<u32>(n, pattern.entries()));
    let (mut order, mut inverse) = (vec![0u32; n], vec![0u32; n]);
    amd::order_maybe_unsorted(&mut order, &mut inverse, matrix, Default::default(), MemStack::new(&mut buffer))
        .map_err(|_| too_large(()))?;
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dissection_takes_every_node_once_and_the_middle_plane_last() {
        for (extents, reach, closed) in
            [([5, 4, 3], 1, [false; 3]), ([9, 5, 5], 2, [true, false, false]), ([7, 7, 1], 1, [false, true, false])]
        {
            let mut order = nested_dissection(extents, reach, closed);
            if !closed.contains(&true) && extents[0] == 5 {
                assert!(order[48..].iter().all(|&node| node / 12 == 2), "{order:?}");
            }
            order.sort_unstable();
            assert!(order.iter().enumerate().all(|(k, &node)| k == node as usize));
            assert_eq!(order.len(), extents.iter().product::<usize>());
        }
    }

    #[test]
    fn minimum_degree_is_a_permutation_that_takes_the_hub_of_a_star_last() {
        let arms: Vec<[u32; 2]> = (1..9).map(|arm| [0, arm]).collect();
        let pattern = Pattern::from_cliques(9, arms.iter().map(|a| a.as_slice()));
        let mut order = minimum_degree(&pattern).expect("a small pattern");
        assert!(order[7..].contains(&0), "{order:?}");
        order.sort_unstable();
        assert_eq!(order, (0..9).collect::<Vec<u32>>());
    }
}
