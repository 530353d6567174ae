//! Nodes that no cell uses, and nodes on top of each other.

use super::Mesh;

/// Two nodes are one place when their coordinates differ by less than this share of the mesh's extent.
const SAME_PLACE: f64 = 1e-12;

impl Mesh {
    /// Drops the nodes that are the corner of no cell and numbers the others anew in the same order. Returns what was dropped,
    /// ascending; node i becomes i less the number of dropped ones before it ([`renumbered`]).
    pub fn drop_loose_nodes(&mut self) -> Vec<u32> {
        let mut used = vec![false; self.positions.len()];
        self.corners.iter().for_each(|&node| used[node as usize] = true);
        let loose: Vec<u32> = (0..used.len() as u32).filter(|&node| !used[node as usize]).collect();
        if !loose.is_empty() {
            let mut number = 0;
            self.positions.retain(|_| {
                number += 1;
                used[number - 1]
            });
            drop(used);
            for node in &mut self.corners {
                *node -= loose.partition_point(|dropped| dropped < node) as u32;
            }
        }
        loose
    }

    /// Pairs of nodes at one place (coordinates within 1e-12 of the extent): the first of the place and another, ascending.
    ///
    /// Along each axis the coordinates are sorted and cut into classes where two neighbours are further apart; nodes with
    /// three equal classes share a place.
    pub fn coincident_nodes(&self) -> Vec<(u32, u32)> {
        let tolerance = SAME_PLACE * self.extent();
        let mut order: Vec<u32> = (0..self.positions.len() as u32).collect();
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let at = |node: u32| self.positions[node as usize][axis];
            order.sort_unstable_by(|&a, &b| at(a).total_cmp(&at(b)));
            let mut classes = vec![0_u32; order.len()];
            for pair in order.windows(2) {
                let step = u32::from(at(pair[1]) - at(pair[0]) > tolerance);
                classes[pair[1] as usize] = classes[pair[0] as usize] + step;
            }
            classes
        });
        let place = |node: u32| [&x, &y, &z].map(|classes| classes[node as usize]);
        order.sort_unstable_by_key(|&node| (place(node), node));
        let mut pairs = Vec::new();
        for shared in order.chunk_by(|&a, &b| place(a) == place(b)) {
            pairs.extend(shared[1..].iter().map(|&other| (shared[0], other)));
        }
        pairs.sort_unstable();
        pairs
    }

    /// Largest extent along an axis (m).
    pub fn extent(&self) -> f64 {
        extent(self.positions.iter())
    }

    /// Largest extent of a cell along an axis (m).
    pub fn cell_extent(&self, cell: usize) -> f64 {
        extent(self.corners(cell).iter().map(|&node| &self.positions[node as usize]))
    }
}

/// Largest extent of some places along an axis; 0 without places.
fn extent<'a>(places: impl Iterator<Item = &'a [f64; 3]>) -> f64 {
    let mut range = [(f64::INFINITY, f64::NEG_INFINITY); 3];
    for place in places {
        for (range, &x) in range.iter_mut().zip(place) {
            *range = (range.0.min(x), range.1.max(x));
        }
    }
    range.iter().map(|(low, high)| high - low).fold(0.0, f64::max)
}

/// Numbers of `nodes` after [`Mesh::drop_loose_nodes`] dropped `loose`; those dropped are left out.
pub fn renumbered(nodes: &[u32], loose: &[u32]) -> Vec<u32> {
    let number = |&node: &u32| match loose.binary_search(&node) {
        Ok(_) => None,
        Err(before) => Some(node - before as u32),
    };
    nodes.iter().filter_map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::CellKind;

    fn mesh() -> Mesh {
        let places = [[9.0, 9.0, 0.0], [0.0; 3], [1.0, 0.0, 0.0], [5.0; 3], [0.0, 1.0, 0.0], [1.0, 1e-14, 0.0]];
        let mut mesh = Mesh::new(2, places.to_vec());
        mesh.push(CellKind::Triangle, &[1, 2, 4]);
        mesh.push(CellKind::Triangle, &[1, 5, 4]);
        mesh
    }

    #[test]
    fn loose_nodes_go_and_the_others_move_up() {
        let mut mesh = mesh();
        let loose = mesh.drop_loose_nodes();
        assert_eq!(loose, [0, 3]);
        assert_eq!((mesh.corners(0), mesh.corners(1)), ([0, 1, 2].as_slice(), [0, 3, 2].as_slice()));
        assert_eq!(mesh.positions()[2], [0.0, 1.0, 0.0]);
        assert_eq!(renumbered(&[0, 1, 4, 5], &loose), [0, 2, 3]);
        assert!(mesh.drop_loose_nodes().is_empty());
    }

    #[test]
    fn nodes_at_one_place_are_found_once() {
        assert_eq!(mesh().coincident_nodes(), [(2, 5)]);
    }
}
