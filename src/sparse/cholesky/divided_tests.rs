//! The tree in pieces: right numbers, the same bits for any number of threads, the same failing unknown.

use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::error::{Error, Result};
use crate::sparse::multifrontal::Division;
use crate::sparse::ordering;
use crate::sparse::pattern::Pattern;
use crate::sparse::single::SingleFactor;

/// Divides whatever can be divided.
const FINE: Division = Division { from: 0.0, share: 0.05, crumbs: 0.01 };

/// Never divides.
const WHOLE: Division = Division { from: f64::INFINITY, share: 1.0, crumbs: 0.0 };

/// Values of the permuted lower triangle of a matrix that is positive definite: `links` off the diagonal, by their unknowns,
/// and more than their sum on it.
fn values(symbolic: &Symbolic, link: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let (starts, rows, order) = (symbolic.lower_starts(), symbolic.lower_rows(), symbolic.order());
    let mut values = vec![0.0; rows.len()];
    let mut diagonal = vec![1.0; symbolic.len()];
    for j in 0..symbolic.len() {
        for entry in starts[j] as usize + 1..starts[j + 1] as usize {
            let i = rows[entry] as usize;
            let (a, b) = (order[i].min(order[j]) as usize, order[i].max(order[j]) as usize);
            values[entry] = -link(a, b);
            diagonal[i] += values[entry].abs();
            diagonal[j] += values[entry].abs();
        }
    }
    (0..symbolic.len()).for_each(|j| values[starts[j] as usize] = diagonal[j]);
    values
}

fn factored(symbolic: &Arc<Symbolic>, values: &[f64]) -> Result<Factor> {
    let mut factor = Factor::new(Arc::clone(symbolic));
    factor.values_mut().copy_from_slice(values);
    factor.refactor().map(|()| factor)
}

fn solution(factor: &mut Factor, columns: usize) -> Vec<f64> {
    let b: Vec<f64> = (0..factor.symbolic().len() * columns).map(|i| (0.37 * i as f64).cos()).collect();
    let mut x = vec![0.0; b.len()];
    let error = factor.solve(&b, &mut x).expect("a positive definite matrix");
    assert!(error <= REFINE_ABOVE, "{error}");
    x
}

/// Does `work` with 1, 2 and 4 threads.
fn with_threads<T: Send>(work: impl Fn() -> T + Sync) -> [T; 3] {
    [1, 2, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a few threads");
        pool.install(&work)
    })
}

/// Three unknowns a node on a grid of n^3 nodes, coupled with all neighbours.
fn cube(n: usize) -> (Pattern, Vec<u32>) {
    let node = |i: usize, j: usize, k: usize| ((i * n + j) * n + k) as u32;
    let mut cells = Vec::new();
    for (i, j, k) in (0..n - 1).flat_map(|i| (0..n - 1).flat_map(move |j| (0..n - 1).map(move |k| (i, j, k)))) {
        let corners = (0..8).map(|c| node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
        cells.push(corners.flat_map(|node| (0..3).map(move |a| 3 * node + a)).collect::<Vec<u32>>());
    }
    let pattern = Pattern::from_cliques(3 * n * n * n, cells.iter().map(|cell| cell.as_slice()));
    let nodes = ordering::nested_dissection([n; 3], 1, [false; 3]);
    (pattern, nodes.into_iter().flat_map(|node| (0..3).map(move |a| 3 * node + a)).collect())
}

/// Links without a pattern in them, from 0.1 to 1.1.
fn rough(a: usize, b: usize) -> f64 {
    0.1 + (0.73 * a as f64 + 1.31 * b as f64).sin().abs()
}

#[test]
fn a_cube_of_13_has_the_same_bits_for_any_number_of_threads() {
    let (pattern, order) = cube(13);
    let symbolic = Symbolic::analyse(&pattern, order).expect("a small pattern");
    let plan = symbolic.plan();
    assert!(plan.tasks.len() >= 3 && plan.tasks.iter().any(|task| task.children.len() > 1), "{}", plan.tasks.len());
    let values = values(&symbolic, rough);
    let runs = with_threads(|| {
        let mut factor = factored(&symbolic, &values).expect("positive definite");
        let (one, many) = (solution(&mut factor, 1), solution(&mut factor, 5));
        let mut half = vec![0.0; symbolic.len()];
        factor.half_solve(&one, &mut half);
        let mut single = SingleFactor::new(Arc::clone(&symbolic));
        single.refactor(&values).expect("well conditioned");
        let mut z = vec![0.0; symbolic.len()];
        single.precondition(&one, &mut z);
        (factor.weakest_pivot(), one, many, half, z)
    });
    assert!(runs[0] == runs[1] && runs[0] == runs[2]);
    // and what one thread finds without tiles of the tree is the same to rounding
    let whole = Symbolic::divided(&pattern, symbolic.order().to_vec(), WHOLE).expect("a small pattern");
    assert_eq!(whole.plan().tasks.len(), 1);
    let plain = solution(&mut factored(&whole, &values).expect("positive definite"), 1);
    assert!(plain.iter().zip(&runs[0].1).all(|(a, b)| (a - b).abs() < 1e-13), "one solution");
}

#[test]
fn an_updated_factor_of_a_divided_tree_has_the_bits_of_a_fresh_one() {
    let (pattern, order) = cube(7);
    let symbolic = Symbolic::divided(&pattern, order, FINE).expect("a small pattern");
    assert!(symbolic.plan().tasks.len() > 8);
    let (first, second) = (values(&symbolic, rough), values(&symbolic, |a, b| rough(b, a + 1)));
    let [updated, ..] = with_threads(|| {
        let mut factor = factored(&symbolic, &first).expect("positive definite");
        let before = solution(&mut factor, 1);
        factor.values_mut().copy_from_slice(&second);
        factor.refactor().expect("positive definite");
        let between = solution(&mut factor, 1);
        factor.values_mut().copy_from_slice(&first);
        factor.refactor().expect("positive definite");
        assert_eq!(solution(&mut factor, 1), before);
        between
    });
    assert_eq!(updated, solution(&mut factored(&symbolic, &second).expect("positive definite"), 1));
}

#[test]
fn the_first_unknown_that_fails_is_named_whatever_the_threads() {
    let (pattern, order) = cube(9);
    for division in [Division::default(), FINE] {
        let symbolic = Symbolic::divided(&pattern, order.clone(), division).expect("a small pattern");
        let good = values(&symbolic, rough);
        let n = symbolic.len();
        // two unknowns fail, in branches that do not know of each other, or near the root
        for (early, late) in [(n / 5, n / 2), (n / 3, n - 1), (n - 40, n - 2)] {
            let mut bad = good.clone();
            for column in [early, late] {
                bad[symbolic.lower_starts()[column] as usize] = -1.0;
            }
            let first = symbolic.order()[early] as usize;
            for outcome in with_threads(|| factored(&symbolic, &bad).map(|_| ())) {
                assert!(matches!(outcome, Err(Error::NotPositiveDefinite { dof }) if dof == first), "{outcome:?}");
            }
            let mut factor = factored(&symbolic, &good).expect("positive definite");
            factor.values_mut().copy_from_slice(&bad);
            assert!(factor.refactor().is_err());
            factor.values_mut().copy_from_slice(&good);
            factor.refactor().expect("usable again");
            solution(&mut factor, 1);
        }
    }
}

#[test]
fn chains_stars_and_separate_pieces_are_divided_without_depth() {
    let n = 4000_u32;
    let chain: Vec<[u32; 2]> = (1..n).map(|i| [i - 1, i]).collect();
    let star: Vec<[u32; 2]> = (1..n).map(|i| [0, i]).collect();
    let pairs: Vec<[u32; 2]> = (0..n / 2).map(|i| [2 * i, 2 * i + 1]).collect();
    for links in [chain, star, pairs, Vec::new()] {
        let pattern = Pattern::from_cliques(n as usize, links.iter().map(|link| link.as_slice()));
        let orders = [(0..n).collect(), (0..n).rev().collect(), ordering::minimum_degree(&pattern).expect("small")];
        for order in orders {
            let symbolic = Symbolic::divided(&pattern, order, FINE).expect("a small pattern");
            assert!(symbolic.plan().tasks.len() < 100);
            solution(&mut factored(&symbolic, &values(&symbolic, rough)).expect("positive definite"), 1);
        }
    }
    let empty = Symbolic::divided(&Pattern::from_cliques(0, [].into_iter()), Vec::new(), FINE).expect("nothing");
    assert!(factored(&empty, &[]).is_ok() && empty.factor_bytes() < 10_000);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn random_patterns_in_random_orders_give_the_numbers_of_the_whole_tree(
        (n, cliques, seed) in (2_usize..120).prop_flat_map(|n| {
            let clique = proptest::collection::vec(0..n as u32, 1..6);
            (Just(n), proptest::collection::vec(clique, 0..80), 0.0..10.0_f64)
        }),
        fill in any::<bool>(),
    ) {
        let cliques: Vec<Vec<u32>> = cliques.into_iter().map(|mut c| { c.sort_unstable(); c.dedup(); c }).collect();
        let pattern = Pattern::from_cliques(n, cliques.iter().map(|c| c.as_slice()));
        let order = match fill {
            true => (0..n as u32).rev().collect(),
            false => ordering::minimum_degree(&pattern).expect("small"),
        };
        let symbolic = Symbolic::divided(&pattern, order, FINE).expect("small");
        let values = values(&symbolic, |a, b| rough(a, b) * (seed + (a + b) as f64).sin());
        let whole = Symbolic::divided(&pattern, symbolic.order().to_vec(), WHOLE).expect("small");
        prop_assert_eq!(whole.order(), symbolic.order());
        let plain = solution(&mut factored(&whole, &values).expect("positive definite"), 1);
        for x in with_threads(|| solution(&mut factored(&symbolic, &values).expect("positive definite"), 1)) {
            prop_assert!(x.iter().zip(&plain).all(|(a, b)| (a - b).abs() < 1e-13));
        }
    }
}
