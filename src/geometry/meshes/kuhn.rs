//! A box of tetrahedra, and the same box with its nodes moved at random.
//!
//! Every cell of an nx x ny x nz grid is cut into six tetrahedra around its main diagonal (H. W. Kuhn, IBM J. Res. Dev. 4,
//! 1960): for each order of the three axes, the path from the first corner to the last that goes one unit along each axis
//! in that order. Neighbouring cells cut their common face alike, so the mesh is conforming. Node (i, j, k) has the number
//! i + (nx + 1) (j + (ny + 1) k); cells go with i fastest, the orders of the axes are lexicographic, and the odd ones have
//! their last two corners swapped so that every volume is positive, h_x h_y h_z / 6.
//!
//! The distorted box moves coordinate c of a node by alpha h_c (2 u - 1), u uniform in [0, 1), where the node is not on a face
//! across c: nodes slide in faces and along edges, the box stays what it is. u is a hash of (seed, node, coordinate),
//! splitmix64 (G. L. Steele, D. Lea and C. H. Flood, OOPSLA 2014), so a mesh can be made again anywhere. While a
//! tetrahedron has less than 5 % of the volume it had, its nodes' displacements are halved.

use crate::geometry::mesh::measure::tetrahedron_volume;
use crate::geometry::mesh::{CellKind, Mesh};

/// The orders of the axes, lexicographic, and whether they are odd.
const PATHS: [([usize; 3], bool); 6] = [
    ([0, 1, 2], false),
    ([0, 2, 1], true),
    ([1, 0, 2], true),
    ([1, 2, 0], false),
    ([2, 0, 1], false),
    ([2, 1, 0], true),
];

/// Share of its regular volume that a tetrahedron keeps at least.
const LEAST_SHARE: f64 = 0.05;

/// The box [0, size] (m) in `cells` cells along each axis, each of six tetrahedra.
///
/// # Panics
/// When a direction has no cell, or there are more nodes than u32 can number.
pub fn kuhn_box(size: [f64; 3], cells: [usize; 3]) -> Mesh {
    let mut mesh = Mesh::new(3, grid_points(size, cells));
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                for tetrahedron in tetrahedra(cells, [i, j, k]) {
                    mesh.push(CellKind::Tetrahedron, &tetrahedron);
                }
            }
        }
    }
    mesh
}

/// The nodes of the grid, i fastest.
fn grid_points(size: [f64; 3], cells: [usize; 3]) -> Vec<[f64; 3]> {
    assert!(cells.iter().all(|&n| n > 0), "a box has at least one cell along each axis");
    let count = cells.iter().try_fold(1_usize, |count, &n| count.checked_mul(n + 1));
    let count = count.filter(|&count| u32::try_from(count).is_ok()).expect("the nodes can be numbered");
    let at = |node| {
        let index = indices(cells, node);
        std::array::from_fn(|axis| size[axis] * index[axis] as f64 / cells[axis] as f64)
    };
    (0..count).map(at).collect()
}

/// Indices i, j, k of a node.
fn indices(cells: [usize; 3], node: usize) -> [usize; 3] {
    let row = node / (cells[0] + 1);
    [node % (cells[0] + 1), row % (cells[1] + 1), row / (cells[1] + 1)]
}

/// The six tetrahedra of a cell, as nodes.
fn tetrahedra(cells: [usize; 3], cell: [usize; 3]) -> [[u32; 4]; 6] {
    PATHS.map(|(path, odd)| {
        let mut at = cell;
        let mut corners = [0; 4];
        for step in 0..4 {
            corners[step] = (at[0] + (cells[0] + 1) * (at[1] + (cells[1] + 1) * at[2])) as u32;
            if step < 3 {
                at[path[step]] += 1;
            }
        }
        if odd {
            corners.swap(2, 3);
        }
        corners
    })
}

/// Moves the nodes of a [`kuhn_box`] of the same size and cells by up to `alpha` cell widths along each axis.
///
/// # Panics
/// When the mesh has another number of nodes.
pub fn distort(mesh: &mut Mesh, size: [f64; 3], cells: [usize; 3], alpha: f64, seed: u64) {
    let regular = grid_points(size, cells);
    assert_eq!(mesh.positions().len(), regular.len(), "the box has the nodes of its grid");
    let mut offsets: Vec<[f64; 3]> = (0..regular.len()).map(|node| offset(size, cells, alpha, seed, node)).collect();
    let least = LEAST_SHARE * (0..3).map(|axis| size[axis] / cells[axis] as f64).product::<f64>() / 6.0;
    loop {
        for (place, (start, offset)) in mesh.positions_mut().iter_mut().zip(regular.iter().zip(&offsets)) {
            *place = std::array::from_fn(|axis| start[axis] + offset[axis]);
        }
        let mut flat = vec![false; regular.len()];
        for cell in (0..mesh.cells()).filter(|&cell| tetrahedron_volume(mesh.places(cell)) < least) {
            mesh.corners(cell).iter().for_each(|&node| flat[node as usize] = true);
        }
        if !flat.contains(&true) {
            return;
        }
        for (offset, _) in offsets.iter_mut().zip(&flat).filter(|&(_, &flat)| flat) {
            *offset = offset.map(|component| component / 2.0);
        }
    }
}

/// How far a node is moved (m): 0 across the faces of the box that it lies on.
fn offset(size: [f64; 3], cells: [usize; 3], alpha: f64, seed: u64, node: usize) -> [f64; 3] {
    let index = indices(cells, node);
    std::array::from_fn(|axis| {
        if index[axis] == 0 || index[axis] == cells[axis] {
            return 0.0;
        }
        let draw = 1_000_003_u64.wrapping_mul(seed).wrapping_add(3 * node as u64 + axis as u64);
        let uniform = (splitmix64(draw) >> 11) as f64 * 2f64.powi(-53);
        alpha * size[axis] / cells[axis] as f64 * (2.0 * uniform - 1.0)
    })
}

/// Draw n of the generator splitmix64 started at 0.
fn splitmix64(n: u64) -> u64 {
    const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;
    let mut z = n.wrapping_mul(GOLDEN).wrapping_add(GOLDEN);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volumes(mesh: &Mesh) -> Vec<f64> {
        (0..mesh.cells()).map(|cell| tetrahedron_volume(mesh.places(cell))).collect()
    }

    #[test]
    fn smoothed_fem_section_2_counts_and_smallest_volumes() {
        let cases = [
            ([5, 1, 1], 0.0, 1, 30, 24, 0.9999999999999996),
            ([5, 1, 1], 0.45, 1, 30, 24, 0.3225782660300329),
            ([10, 2, 2], 0.0, 1, 240, 99, 1.0000000000000002),
            ([10, 2, 2], 0.45, 1, 240, 99, 0.10123211156789666),
            ([10, 2, 2], 0.45, 2, 240, 99, 0.052250987665113297),
            ([20, 4, 4], 0.0, 1, 1920, 525, 0.9999999999999982),
            ([20, 4, 4], 0.45, 1, 1920, 525, 0.05370805199627424),
        ];
        let size = [1.0, 0.2, 0.2];
        for (cells, alpha, seed, tetrahedra, nodes, smallest) in cases {
            let mut mesh = kuhn_box(size, cells);
            distort(&mut mesh, size, cells, alpha, seed);
            assert_eq!((mesh.cells(), mesh.positions().len()), (tetrahedra, nodes));
            let volumes = volumes(&mesh);
            let mean = volumes.iter().sum::<f64>() / volumes.len() as f64;
            let least = volumes.iter().copied().fold(f64::INFINITY, f64::min);
            assert!((least / mean - smallest).abs() < 1e-12, "{cells:?} {alpha} {seed}: {}", least / mean);
            assert!((mean * tetrahedra as f64 - 0.04).abs() < 1e-15);
        }
    }

    #[test]
    fn the_first_cell_is_cut_around_its_main_diagonal() {
        let mesh = kuhn_box([1.0; 3], [1; 3]);
        let cells: Vec<&[u32]> = (0..6).map(|cell| mesh.corners(cell)).collect();
        let expected: [&[u32]; 6] =
            [&[0, 1, 3, 7], &[0, 1, 7, 5], &[0, 2, 7, 3], &[0, 2, 6, 7], &[0, 4, 5, 7], &[0, 4, 7, 6]];
        assert_eq!(cells, expected);
    }

    #[test]
    fn splitmix64_gives_the_published_first_draws_of_seed_0() {
        assert_eq!(splitmix64(0), 0xE220_A839_7B1D_CDAF);
        assert_eq!(splitmix64(1), 0x6E78_9E6A_A1B9_65F4);
    }

    #[test]
    fn a_distorted_box_keeps_its_faces_and_its_corners() {
        let (size, cells) = ([2.0, 1.0, 1.0], [4, 3, 2]);
        let regular = kuhn_box(size, cells);
        let mut mesh = regular.clone();
        distort(&mut mesh, size, cells, 0.4, 7);
        let mut moved = 0;
        for (place, start) in mesh.positions().iter().zip(regular.positions()) {
            for axis in 0..3 {
                if start[axis] == 0.0 || start[axis] == size[axis] {
                    assert_eq!(place[axis], start[axis]);
                } else {
                    moved += usize::from(place[axis] != start[axis]);
                }
            }
        }
        assert!(moved > 0);
    }
}
