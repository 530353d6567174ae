//! What must hold on every mesh: patch test, zero modes, the order of the methods, the surface form of the gradients.

use crate::bodies::*;
use nalgebra_sparse::CsrMatrix;
use nalgebra_sparse::na::{DMatrix, SymmetricEigen};
use springfit::geometry::dofs::DofMap;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::reference::material::Lame;
use springfit::reference::methods::smoothed::{self, Smoothing};
use springfit::reference::methods::{self, MethodBody};
use springfit::reference::points::Part;
use springfit::reference::{mass, statics, stiffness};
use springfit::sparse::cholesky::Symbolic;
use springfit::sparse::ordering::minimum_degree;

/// u = G x with the surface held: the inside follows.
#[test]
fn acceptance_patch_test_1e_10() {
    let strain = [[1e-3, 4e-4, -2e-4], [-3e-4, 2e-3, 5e-4], [1e-4, -6e-4, -1e-3]];
    let mesh = beam([4, 4, 4], 0.4, 3);
    for (name, domains, positions) in every_method(&mesh) {
        let exact: Vec<[f64; 3]> =
            positions.iter().map(|x| strain.map(|row| (0..3).map(|j| row[j] * x[j]).sum())).collect();
        let surface = |x: &[f64; 3]| (0..3).any(|i| x[i].abs() < 1e-12 || (x[i] - SIZE[i]).abs() < 1e-12);
        let fixed: Vec<[bool; 3]> = positions.iter().map(|x| [surface(x); 3]).collect();
        let dofs = DofMap::untied(3, &fixed);
        assert!(dofs.len() >= 81, "{name}: there is an inside");
        let given: Vec<[f64; 3]> =
            exact.iter().zip(&fixed).map(|(u, held)| if held[0] { *u } else { [0.0; 3] }).collect();
        let points = domains.into_points(&mesh).expect("its mesh");
        let pattern = stiffness::pattern(&points, &dofs);
        let matrix = stiffness::stiffness(&points, lame(0.3), &dofs, &pattern).expect("no folds");
        let mut forces = vec![0.0; dofs.len()];
        statics::prescribe(&points, lame(0.3), &dofs, &given, &mut forces).expect("no folds");
        let symbolic = Symbolic::analyse(&pattern, minimum_degree(&pattern).expect("small")).expect("small");
        let solved = statics::solve(&matrix, &symbolic, &[&forces]).expect("held");
        let u = dofs.expand(&solved.displacements[0]);
        for (node, held) in fixed.iter().enumerate().filter(|(_, held)| !held[0]) {
            assert!(!held[0]);
            (0..3).for_each(|i| {
                assert!((u[node][i] - exact[node][i]).abs() < 1e-10 * 2e-3, "{name} node {node}: {u:?}");
            });
        }
    }
}

#[test]
fn acceptance_six_zero_modes_and_none_more() {
    for mesh in [beam([3, 2, 2], 0.4, 5), beam([1, 1, 1], 0.0, 1)] {
        for (name, domains, positions) in every_method(&mesh) {
            let matrix = dense(&linear_stiffness(&mesh, domains, lame(0.3), &free(positions.len())));
            let mut modes: Vec<f64> = SymmetricEigen::new(matrix).eigenvalues.iter().copied().collect();
            modes.sort_by(f64::total_cmp);
            let largest = modes[modes.len() - 1];
            assert!(modes[5].abs() < 1e-12 * largest, "{name}: {modes:?}");
            assert!(modes[6] > 1e-6 * largest, "{name}: {modes:?}");
        }
    }
}

fn smallest_eigenvalue(matrix: DMatrix<f64>) -> f64 {
    SymmetricEigen::new(matrix).eigenvalues.min()
}

#[test]
fn acceptance_loewner_order_fem_face_edge_node() {
    for (alpha, seed) in [(0.0, 1), (0.45, 1), (0.45, 2), (0.3, 9)] {
        let mesh = beam([3, 2, 2], alpha, seed);
        let dofs = free(mesh.positions().len());
        let matrices = METHODS.map(|(_, smoothing)| {
            dense(&linear_stiffness(&mesh, smoothed_domains(&mesh, smoothing), lame(0.3), &dofs))
        });
        for pair in matrices.windows(2) {
            let least = smallest_eigenvalue(&pair[0] - &pair[1]);
            assert!(least > -1e-13 * pair[0].amax(), "alpha {alpha}: {least:e}");
            assert!((&pair[0] - &pair[1]).amax() > 1e-3 * pair[0].amax(), "the methods differ");
        }
    }
}

#[test]
fn a_single_tetrahedron_is_the_same_element_and_face_by_face() {
    let mut mesh = Mesh::new(3, vec![[0.0; 3], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.1, 0.3, 1.2]]);
    mesh.push(CellKind::Tetrahedron, &[0, 1, 2, 3]);
    let of = |smoothing| dense(&linear_stiffness(&mesh, smoothed_domains(&mesh, smoothing), lame(0.3), &free(4)));
    assert!((of(Smoothing::Element) - of(Smoothing::Face)).amax() < 1e-15 * of(Smoothing::Element).amax());
}

/// One table with two parts is the sum of two tables with one part each, on a common pattern.
#[test]
fn selective_smoothing_is_the_sum_of_its_parts() {
    let mesh = beam([3, 2, 2], 0.3, 4);
    let (dofs, full) = (clamped(mesh.positions()), lame(0.4));
    let sum = |shear, volume| -> DMatrix<f64> {
        let part = |smoothing, lame| dense(&linear_stiffness(&mesh, smoothed_domains(&mesh, smoothing), lame, &dofs));
        part(shear, Lame { lambda: 0.0, ..full }) + part(volume, Lame { mu: 0.0, ..full })
    };
    let table = smoothed::selective(&mesh, Smoothing::Face, Smoothing::Node, 1.0).expect("tetrahedra");
    assert!((0..table.len()).all(|k| table.part(k) != Part::Whole));
    let both = dense(&linear_stiffness(&mesh, table.clone(), full, &dofs));
    let expected = sum(Smoothing::Face, Smoothing::Node);
    assert!((&both - &expected).amax() < 1e-14 * both.amax());
    let points = table.into_points(&mesh).expect("its mesh");
    let volume = points.measure().expect("no folds");
    assert!((volume / 0.04 - 1.0).abs() < 1e-14, "the body is counted once: {volume}");
}

/// The paths vertex, edge, face, cell through the corners of a tetrahedron cut it into 24 pieces. A domain is a set of
/// pieces; the mean gradient is the integral of N_a n over the surface of its pieces, by its volume.
#[test]
fn acceptance_surface_integral_form_1e_13() {
    let mesh = beam([2, 2, 2], 0.45, 6);
    for (smoothing, corners) in
        [(Smoothing::Node, 1), (Smoothing::Edge, 2), (Smoothing::Face, 3), (Smoothing::Element, 4)]
    {
        let domains = smoothed_domains(&mesh, smoothing);
        let mut carriers = std::collections::BTreeMap::<Vec<u32>, Vec<(u32, [[f64; 4]; 4])>>::new();
        for cell in 0..mesh.cells() {
            for path in paths() {
                let mut carrier: Vec<u32> = path[..corners].iter().map(|&a| mesh.corners(cell)[a]).collect();
                carrier.sort_unstable();
                carriers.entry(carrier).or_default().push((cell as u32, piece(path)));
            }
        }
        assert_eq!(carriers.len(), domains.len());
        // domains and carriers are both in the order of the sorted corners
        for (k, pieces) in carriers.values().enumerate() {
            for acting in domains.acting(k) {
                let mut sum = [0.0; 3];
                for (cell, piece) in pieces {
                    let flux = flux(&mesh, *cell as usize, piece, acting.node);
                    (0..3).for_each(|i| sum[i] += flux[i] / domains.volume(k));
                }
                let size = acting.gradient.iter().fold(1.0 / SIZE[1], |m: f64, g| m.max(g.abs()));
                (0..3).for_each(|i| {
                    let difference = (sum[i] - acting.gradient[i]).abs();
                    assert!(difference < 1e-13 * size, "{smoothing:?} {k}: {difference:e}");
                });
            }
        }
    }
}

fn paths() -> Vec<[usize; 4]> {
    let mut paths = Vec::new();
    for code in 0..256_usize {
        let path = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6 & 3];
        if (0..4).all(|corner| path.contains(&corner)) {
            paths.push(path);
        }
    }
    paths
}

/// Barycentric coordinates of the four corners of a piece: means of the first 1, 2, 3 and 4 corners of the path.
fn piece(path: [usize; 4]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| {
        let mut mean = [0.0; 4];
        path[..=i].iter().for_each(|&corner| mean[corner] = 1.0 / (i as f64 + 1.0));
        mean
    })
}

/// The integral of N_a n over the surface of a piece.
fn flux(mesh: &Mesh, cell: usize, piece: &[[f64; 4]; 4], node: u32) -> [f64; 3] {
    let Some(local) = mesh.corners(cell).iter().position(|&corner| corner == node) else { return [0.0; 3] };
    let place = |l: [f64; 4]| -> [f64; 3] {
        std::array::from_fn(|i| (0..4).map(|a| l[a] * mesh.positions()[mesh.corners(cell)[a] as usize][i]).sum())
    };
    let mut sum = [0.0; 3];
    for opposite in 0..4 {
        let facet: Vec<usize> = (0..4).filter(|&i| i != opposite).collect();
        let [p, q, r, o] = [facet[0], facet[1], facet[2], opposite].map(|i| place(piece[i]));
        let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let (a, b, out) = (minus(q, p), minus(r, p), minus(p, o));
        let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let outward = (0..3).map(|i| normal[i] * out[i]).sum::<f64>().signum();
        let mean = facet.iter().map(|&i| piece[i][local]).sum::<f64>() / 3.0;
        (0..3).for_each(|i| sum[i] += 0.5 * outward * normal[i] * mean);
    }
    sum
}

#[test]
fn edge_smoothing_of_triangles_passes_the_patch_test_and_is_softer() {
    let n = 4;
    let mut places = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            let inside = i > 0 && i < n && j > 0 && j < n;
            let shift = if inside { 0.08 * ((3 * i + 5 * j) as f64).sin() } else { 0.0 };
            places.push([i as f64 / n as f64 + shift, j as f64 / n as f64 - shift, 0.0]);
        }
    }
    let mut mesh = Mesh::new(2, places);
    for j in 0..n {
        for i in 0..n {
            let node = |di: usize, dj: usize| (i + di + (n + 1) * (j + dj)) as u32;
            mesh.push(CellKind::Triangle, &[node(0, 0), node(1, 0), node(1, 1)]);
            mesh.push(CellKind::Triangle, &[node(0, 0), node(1, 1), node(0, 1)]);
        }
    }
    let dofs = DofMap::untied(2, &vec![[false; 3]; mesh.positions().len()]);
    let matrices = [Smoothing::Element, Smoothing::Edge, Smoothing::Node].map(|smoothing| {
        let domains = smoothed::domains(&mesh, smoothing, 0.5).expect("triangles");
        let volume: f64 = (0..domains.len()).map(|k| domains.volume(k)).sum();
        assert!((volume - 0.5).abs() < 1e-14);
        linear_stiffness(&mesh, domains, lame(0.3), &dofs)
    });
    for matrix in &matrices {
        let mut modes: Vec<f64> = SymmetricEigen::new(dense(matrix)).eigenvalues.iter().copied().collect();
        modes.sort_by(f64::total_cmp);
        assert!(modes[2].abs() < 1e-12 * modes[modes.len() - 1] && modes[3] > 1e-6 * modes[modes.len() - 1]);
        assert!(inner_imbalance(matrix, &mesh, &dofs) < 1e-13 * dense(matrix).amax());
    }
    for pair in matrices.windows(2) {
        assert!(smallest_eigenvalue(dense(&pair[0]) - dense(&pair[1])) > -1e-13 * dense(&pair[0]).amax());
    }
    // faces of triangles are their edges
    let faces = smoothed::domains(&mesh, Smoothing::Face, 0.5).expect("triangles");
    assert_eq!(dense(&linear_stiffness(&mesh, faces, lame(0.3), &dofs)), dense(&matrices[1]));
}

/// Largest force on inner nodes of the unit square under a linear displacement.
fn inner_imbalance(matrix: &CsrMatrix<f64>, mesh: &Mesh, dofs: &DofMap) -> f64 {
    let u: Vec<f64> = (0..dofs.len())
        .map(|dof| {
            let (node, i) = dofs.owner(dof);
            let x = mesh.positions()[node];
            [0.3 * x[0] - 0.7 * x[1], 0.2 * x[0] + 0.5 * x[1]][i]
        })
        .collect();
    let inside = |x: [f64; 3]| x[..2].iter().all(|&c| c > 1e-9 && c < 1.0 - 1e-9);
    (0..dofs.len())
        .filter(|&dof| inside(mesh.positions()[dofs.owner(dof).0]))
        .map(|dof| {
            let row = matrix.row(dof);
            row.col_indices().iter().zip(row.values()).map(|(&j, k)| k * u[j]).sum::<f64>().abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn meshes_that_cannot_be_smoothed_are_refused_with_their_cells() {
    let places = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 3.0]];
    let mut branching = Mesh::new(3, places.clone());
    (3..6).for_each(|top| branching.push(CellKind::Tetrahedron, &[0, 1, 2, top]));
    let error = smoothed::domains(&branching, Smoothing::Face, 1.0).expect_err("three cells at a face").to_string();
    assert!(error.contains("[0, 1, 2]") && error.contains("3 cells"), "{error}");
    let mut turned = Mesh::new(3, places.clone());
    turned.push(CellKind::Tetrahedron, &[0, 2, 1, 3]);
    let error = smoothed::domains(&turned, Smoothing::Node, 1.0).expect_err("negative volume").to_string();
    assert!(error.contains("element [0] is folded") && error.contains("-1.000e0"), "{error}");
    let mut hexahedron = Mesh::new(3, vec![[0.0; 3]; 8]);
    hexahedron.push(CellKind::Hexahedron, &[0, 1, 2, 3, 4, 5, 6, 7]);
    assert!(smoothed::domains(&hexahedron, Smoothing::Element, 1.0).is_err());
}

/// Averaging the strain does not touch the mass: consistent and lumped masses are those of the plain elements.
#[test]
fn smoothed_methods_have_the_mass_of_their_cells() {
    let mesh = beam([3, 2, 2], 0.4, 8);
    let dofs = free(mesh.positions().len());
    let of = |name: &str| {
        let MethodBody::Mesh { points, .. } = methods::find(name).expect("in the table").body else { panic!("a mesh") };
        let points = points(&mesh, 1.0).expect("tetrahedra");
        let pattern = stiffness::pattern(&points, &dofs);
        let consistent = mass::consistent(&points, DENSITY, &dofs, &pattern).expect("no folds");
        (dense(&consistent), mass::lumped(&points, DENSITY, &dofs).expect("no folds"))
    };
    let (consistent, lumped) = of("t4");
    for name in ["smoothed_face", "smoothed_edge", "smoothed_node", "smoothed_selective"] {
        let (matrix, masses) = of(name);
        assert!((&matrix - &consistent).amax() < 1e-14 * consistent.amax(), "{name}");
        masses.iter().zip(&lumped).for_each(|(ours, theirs)| assert!((ours / theirs - 1.0).abs() < 1e-13, "{name}"));
    }
}
