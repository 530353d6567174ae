//! Springs beside a body that turns: the derivatives of their displacement error by differences.

use springfit::calibration::objective::Objective;
use springfit::calibration::objectives::displacement::weights;
use springfit::calibration::objectives::large::{Cases, LargeDisplacement, Target};
use springfit::clock::Interrupt;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::sparse::cholesky::Symbolic;
use springfit::sparse::equilibrium::Search;
use springfit::sparse::ordering::minimum_degree;
use springfit::springs::grouping::{self, Request};
use springfit::springs::{affine, topology};

#[test]
fn the_jacobian_of_large_displacements_is_that_of_differences() {
    let grid = Grid::new(&[5, 3, 3]);
    let positions: Vec<[f64; 3]> = (0..grid.len()).map(|node| grid.index(node).map(|i| 0.2 * i as f64)).collect();
    let fixed: Vec<[bool; 3]> = positions.iter().map(|x| [x[0] == 0.0; 3]).collect();
    let dofs = DofMap::untied(3, &fixed);
    let network = (topology::find("grid").expect("in the table").connect)(&grid, &positions, &dofs);
    let grouping = (grouping::find("kind").expect("in the table").group)(&network, &Request::default()).expect("kinds");
    let coefficients = vec![1.0; network.springs.len()];
    let pattern = affine::pattern(&network, &dofs);
    let symbolic = Symbolic::analyse(&pattern, minimum_degree(&pattern).expect("small")).expect("small");
    let n = dofs.len();
    // two load cases: across, and a pull with a twist
    let load = |case: usize, dof: usize| match (case, dofs.owner(dof)) {
        (0, (_, 2)) => -8.0,
        (1, (_, 0)) => 10.0,
        (1, (node, 1)) => 30.0 * (positions[node][2] - 0.2),
        (1, (node, 2)) => -30.0 * (positions[node][1] - 0.2),
        _ => 0.0,
    };
    let forces: Vec<f64> =
        (0..2).flat_map(|case| (0..n).map(move |dof| (case, dof))).map(|(c, d)| load(c, d)).collect();
    let (reference, linear) = (vec![0.01; 2 * n], vec![0.0; 2 * n]);
    let weights = weights(&[0.4, 0.2], dofs.nodes());
    let search = Search { load_steps: 2, tolerance: 1e-13, ..Search::default() };
    let target = Target {
        network: &network,
        grouping: &grouping,
        coefficients: &coefficients,
        dofs: &dofs,
        symbolic: &symbolic,
        search,
        linear: &linear,
    };
    let cases = Cases { forces: &forces, reference: &reference, weights: &weights };
    let mut worker = LargeDisplacement::new(target, cases, &Interrupt::default());
    let phi = vec![2000.0, 1200.0, 700.0];
    assert_eq!(grouping.groups.len(), phi.len());
    let (mut residual, mut jacobian) = (vec![], vec![]);
    let error = worker.error(&phi).expect("it holds");
    worker.linearise(&mut residual, &mut jacobian).expect("it is stable");
    let norm = residual.iter().map(|r| r * r).sum::<f64>().sqrt();
    assert!((norm / error - 1.0).abs() < 1e-12);
    // it bends far, so that the linear answer would be another
    let bent =
        residual.iter().zip(reference.iter().map(|u| weights[0] * u)).fold(0.0_f64, |m, (r, u)| m.max((r + u).abs()));
    assert!(bent / weights[0] > 0.2, "{}", bent / weights[0]);
    for a in 0..phi.len() {
        let step = 1e-4 * phi[a];
        let mut at = |sign: f64| {
            let mut other = phi.clone();
            other[a] += sign * step;
            let (mut residual, mut unused) = (vec![], vec![]);
            worker.error(&other).expect("it holds");
            worker.linearise(&mut residual, &mut unused).expect("it is stable");
            residual
        };
        let (after, before) = (at(1.0), at(-1.0));
        let column = &jacobian[a * residual.len()..(a + 1) * residual.len()];
        let largest = column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for ((x, after), before) in column.iter().zip(&after).zip(&before) {
            assert!((x - (after - before) / (2.0 * step)).abs() < 1e-5 * largest, "group {a}");
        }
    }
}
