use std::sync::Arc;

use nalgebra_sparse::CsrMatrix;

use super::*;
use crate::error::Error;
use crate::sparse::ordering;
use crate::sparse::pattern::Pattern;

/// A grid of unit springs between neighbours (5-point matrix) plus a random positive diagonal.
fn grid_matrix(nx: usize, ny: usize, seed: f64) -> (Pattern, CsrMatrix<f64>) {
    let node = |i: usize, j: usize| (i * ny + j) as u32;
    let mut edges = Vec::new();
    for i in 0..nx {
        for j in 0..ny {
            if i + 1 < nx {
                edges.push([node(i, j), node(i + 1, j)]);
            }
            if j + 1 < ny {
                edges.push([node(i, j), node(i, j + 1)]);
            }
        }
    }
    let pattern = Pattern::from_cliques(nx * ny, edges.iter().map(|e| e.as_slice()));
    let mut values = vec![0.0; pattern.entries()];
    for (s, &[a, b]) in edges.iter().enumerate() {
        let k = 1.0 + (seed * (s as f64 + 1.0)).sin().abs();
        let (a, b) = (a as usize, b as usize);
        for (i, j, k) in [(a, a, k), (b, b, k), (a, b, -k), (b, a, -k)] {
            values[pattern.position(i, j).expect("in the pattern")] += k;
        }
    }
    values[0] += 1.0;
    let matrix = CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), values).expect("one value an entry");
    (pattern, matrix)
}

fn factored(symbolic: &Arc<Symbolic>, matrix: &CsrMatrix<f64>) -> Factor {
    let mut factor = Factor::new(Arc::clone(symbolic));
    factor.load(matrix);
    factor.refactor().expect("a positive definite matrix");
    factor
}

/// Right-hand sides of two whole sweeps and a part, so that checks of eight and of one column happen too.
fn many_right_hand_sides(n: usize, count: usize) -> Vec<f64> {
    (0..n * count).map(|i| (i as f64 * 0.37).cos() * (i as f64 * 0.011).exp()).collect()
}

#[test]
fn a_column_has_the_same_bits_alone_and_among_others_loosely_and_exactly() {
    let (pattern, matrix) = grid_matrix(17, 11, 0.7);
    let n = pattern.len();
    let order = ordering::minimum_degree(&pattern).expect("a small pattern");
    let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
    let mut factor = factored(&symbolic, &matrix);
    for count in [2, 8, 9, 17] {
        let b = many_right_hand_sides(n, count);
        let [mut together, mut again, mut loose, mut strict] = std::array::from_fn(|_| vec![0.0; n * count]);
        let worst = factor.solve(&b, &mut together).expect("solvable");
        assert_eq!(factor.solve(&b, &mut again).expect("solvable").to_bits(), worst.to_bits());
        assert_eq!(again, together);
        assert!(worst <= REFINE_ABOVE, "{worst:e}");
        factor.solve_within(&b, &mut loose, 1e-6).expect("solvable");
        // a residual of zero is not to be had: all columns go the exact way
        factor.solve_within(&b, &mut strict, 0.0).expect("solvable");
        assert_eq!(strict, together);
        let size = together.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        assert!(loose.iter().zip(&together).all(|(a, b)| (a - b).abs() <= 1e-12 * size));
    }
}

#[test]
fn both_orders_solve_many_columns_with_a_backward_error_of_rounding() {
    let (pattern, matrix) = grid_matrix(17, 11, 0.7);
    let n = pattern.len();
    for order in [
        ordering::nested_dissection([17, 11, 1], 1, [false; 3]),
        ordering::minimum_degree(&pattern).expect("a small pattern"),
    ] {
        let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
        let b: Vec<f64> = (0..n * 19).map(|i| (i as f64 * 0.37).cos()).collect();
        let mut x = vec![0.0; b.len()];
        let error = factored(&symbolic, &matrix).solve(&b, &mut x).expect("solvable");
        assert!(error <= REFINE_ABOVE, "{error}");
        let product = &matrix * &nalgebra_sparse::na::DMatrix::from_column_slice(n, 19, &x);
        assert!(product.iter().zip(&b).all(|(p, b)| (p - b).abs() < 1e-12));
    }
}

#[test]
fn an_updated_factor_has_the_bits_of_a_fresh_one() {
    let (pattern, first) = grid_matrix(13, 13, 0.3);
    let (_, second) = grid_matrix(13, 13, 1.9);
    let order = ordering::nested_dissection([13, 13, 1], 1, [false; 3]);
    let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
    let b: Vec<f64> = (0..pattern.len()).map(|i| i as f64).collect();
    let solve = |factor: &mut Factor| {
        let mut x = vec![0.0; b.len()];
        factor.solve(&b, &mut x).expect("solvable");
        x
    };
    let mut updated = factored(&symbolic, &first);
    let before = solve(&mut updated);
    updated.load(&second);
    updated.refactor().expect("a positive definite matrix");
    assert_eq!(solve(&mut updated), solve(&mut factored(&symbolic, &second)));
    updated.load(&first);
    updated.refactor().expect("a positive definite matrix");
    assert_eq!(solve(&mut updated), before);
}

#[test]
fn the_weakest_pivot_tells_a_loose_matrix_from_a_stiff_one() {
    let (pattern, mut matrix) = grid_matrix(6, 5, 0.3);
    let order = ordering::nested_dissection([6, 5, 1], 1, [false; 3]);
    let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
    assert!(factored(&symbolic, &matrix).weakest_pivot().1 > 1e-3);
    matrix.values_mut()[0] -= 1.0 - 1e-14;
    let mut factor = Factor::new(Arc::clone(&symbolic));
    factor.load(&matrix);
    assert!(factor.refactor().is_err() || factor.weakest_pivot().1 < 1e-13);
}

#[test]
fn an_indefinite_matrix_is_an_error_that_names_an_unknown_and_leaves_the_factor_usable() {
    let (pattern, mut matrix) = grid_matrix(4, 4, 0.3);
    let order = ordering::nested_dissection([4, 4, 1], 1, [false; 3]);
    let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
    let good = matrix.clone();
    let diagonal = pattern.position(9, 9).expect("the diagonal is stored");
    matrix.values_mut()[diagonal] = -1.0;
    let mut factor = factored(&symbolic, &good);
    factor.load(&matrix);
    assert!(matches!(factor.refactor(), Err(Error::NotPositiveDefinite { dof }) if dof < 16));
    matrix.values_mut()[diagonal] = f64::NAN;
    factor.load(&matrix);
    let mut x = vec![0.0; 16];
    let outcome = factor.refactor().and_then(|()| factor.solve(&[1.0; 16], &mut x));
    assert!(outcome.is_err(), "a matrix with a NaN has no solution: {outcome:?}");
    factor.load(&good);
    factor.refactor().expect("usable again");
    assert!(factor.solve(&[1.0; 16], &mut x).is_ok());
}
