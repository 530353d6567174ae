//! Networks: mechanisms, stiffness that is absent, negative or spread, groups, the check of a factorisation.

use std::sync::Arc;

use springfit::error::Error;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::report::bench::hard::{double, problems};
use springfit::sparse::backward_error::Lower;
use springfit::sparse::cholesky::Factor;
use springfit::springs::affine::AffineStiffness;
use springfit::springs::grouping::{self, Grouping, Request};
use springfit::springs::mechanism;
use springfit::springs::network::Network;
use springfit::springs::solver::{Path, Settings, SpringOperator, SpringSolver};

use super::common::{SQUARE, refused, runs, says};
use super::zero_modes::{analysis, connect, of_network};

/// The nodes of a grid at its indices.
fn nodes(grid: &Grid) -> Vec<[f64; 3]> {
    (0..grid.len()).map(|node| grid.index(node).map(|i| i as f64)).collect()
}

fn kinds(network: &Network) -> Grouping {
    (grouping::find("kind").expect("a rule").group)(network, &Request::default()).expect("groups")
}

/// A grid of 4 x 4 nodes whose first column is held, springs by kind.
fn held_square() -> (Network, DofMap, SpringOperator<'static>) {
    let grid = Grid::new(&[4, 4]);
    let held: Vec<[bool; 3]> = (0..16).map(|node| [grid.index(node)[1] == 0; 3]).collect();
    let dofs = DofMap::untied(2, &held);
    let network = connect("grid", &grid, &nodes(&grid), &dofs);
    let symbolic = analysis(&network, &dofs);
    let ones = vec![1.0; network.springs.len()];
    let stiffness = AffineStiffness::new(&network, &kinds(&network), &ones, &dofs, &symbolic);
    (network, dofs, SpringOperator::Assembled { stiffness, symbolic })
}

#[test]
fn mechanism() {
    let grid = Grid::new(&[5, 5]);
    let free = DofMap::untied(2, &[[false; 3]; 25]);
    let edges = |dofs: &DofMap| connect("edges", &grid, &nodes(&grid), dofs);
    assert_eq!(of_network(&edges(&free), &free), 10);
    let held: Vec<[bool; 3]> = (0..25).map(|node| [grid.index(node)[0] == 0; 3]).collect();
    let held = DofMap::untied(2, &held);
    assert_eq!(of_network(&edges(&held), &held), 4);
    // a single row: 5 nodes and 4 springs in a line
    let row = Grid::new(&[1, 5]);
    let dofs = DofMap::untied(2, &[[false; 3]; 5]);
    assert_eq!(of_network(&connect("grid", &row, &nodes(&row), &dofs), &dofs), 10 - 4);
    // a flat sheet in space: three motions in its plane, and every node across it
    let sheet = Grid::new(&[4, 4, 1]);
    let dofs = DofMap::untied(3, &[[false; 3]; 16]);
    assert_eq!(of_network(&connect("grid", &sheet, &nodes(&sheet), &dofs), &dofs), 3 + 16);
    // many more modes than are named
    let block = Grid::new(&[5, 5, 5]);
    let dofs = DofMap::untied(3, &[[false; 3]; 125]);
    let network = connect("edges", &block, &nodes(&block), &dofs);
    let springs = network.springs.len();
    let found = of_network(&network, &dofs);
    // every line of nodes slides along itself: 3 x 25 ways; all springs are independent, so nothing else
    assert_eq!((found, springs), (375 - 300, 300));
    let loose = refused(&format!("{SQUARE}[springs]\ntopology = \"edges\"\n"));
    // 12 free nodes, 21 springs between nodes that are not both held: three rows slide along x
    says(&loose, 3, &["spring network", "3 zero modes", "can move along x", "topology with diagonals"]);
    assert!(matches!(&loose, Error::Mechanism { modes: 3, motions, .. } if motions.len() == 3), "{loose:?}");
}

#[test]
fn near_zero_stiffness() {
    let (network, dofs, operator) = held_square();
    let mut solver = SpringSolver::new(&operator, &Settings::DIRECT);
    let forces: Vec<f64> = (0..dofs.len()).map(|i| 1.0 + i as f64 % 3.0).collect();
    let mut solve = |phi: [f64; 2]| {
        let mut u = vec![0.0; forces.len()];
        solver.set(&phi).and_then(|()| solver.solve(&forces, &mut u, 1e-10)).map(|()| u)
    };
    for bad in [-1.0, -1e-300, f64::NAN, f64::INFINITY] {
        says(&solve([1.0, bad]).expect_err("no stiffness"), 2, &["the stiffness of group 1 is", "from 0"]);
    }
    // zero is absence: the edges that are left are a mechanism, and its modes are counted as those of edges alone
    let (stiffness, symbolic) = operator.assembled().expect("a matrix");
    assert!(matches!(solve([1.0, 0.0]), Err(Error::NotPositiveDefinite { .. })));
    let absent = mechanism::of_groups("network", stiffness, &[1.0, 0.0], &dofs, symbolic);
    let edges: Vec<bool> = network.springs.iter().map(|spring| spring.kind.name() == "edge").collect();
    let alone = mechanism::count(&network, &edges, &dofs, symbolic);
    assert!(matches!(absent, Err(Error::Mechanism { modes, .. }) if modes == alone.count && modes > 0), "{absent:?}");
    assert_eq!(mechanism::of_groups("network", stiffness, &[1.0, 1e-300], &dofs, symbolic), Ok(()));
    // nothing is clamped: a tiny stiffness gives the displacements that belong to it
    let one = solve([1.0, 1.0]).expect("stiff");
    let tiny = solve([1e-300, 1e-300]).expect("soft");
    assert!(one.iter().zip(&tiny).all(|(a, b)| (a * 1e300 - b).abs() <= 1e-12 * b.abs()), "{one:?} {tiny:?}");
    // and where they are beyond all numbers there is an error
    assert!(solve([5e-324, 5e-324]).is_err());
    // a group that the fit sets to zero is reported, not hidden
    let each = runs(&format!("{SQUARE}[springs]\ngrouping = \"kind\"\n"));
    assert!(each.calibration.phi.iter().all(|phi| *phi >= 0.0));
}

#[test]
fn stiffness_spread() {
    for hard in problems::all().into_iter().filter(|hard| hard.name.starts_with("spread")) {
        let problem = hard.problem().expect("a problem");
        let (stiffness, symbolic) = problem.assembled();
        let mut factor = Factor::new(Arc::clone(symbolic));
        stiffness.assemble_into(&problem.phi, factor.values_mut());
        let values = factor.values_mut().to_vec();
        factor.refactor().expect("positive definite");
        let mut u = vec![0.0; problem.forces.len()];
        let backward_error = factor.solve(&problem.forces, &mut u).expect("accurate");
        assert!(backward_error <= 1e-15, "{}: {backward_error:e}", hard.name);
        let sure = factor.accuracy(&problem.forces, &u);
        let lower = Lower { starts: symbolic.lower_starts(), rows: symbolic.lower_rows(), values: &values };
        let right: Vec<f64> = symbolic.order().iter().map(|&i| problem.forces[i as usize]).collect();
        let exact = double::solve(lower, &right).expect("positive definite with twice the digits");
        let largest = exact.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let pairs = exact.iter().zip(symbolic.order());
        let error = pairs.map(|(x, &i)| (x - u[i as usize]).abs()).fold(0.0, f64::max) / largest;
        println!("{}: {backward_error:.1e}, off by {error:.1e}, estimated {sure:?}", hard.name);
        assert!(error <= 3.0 * sure.forward_error, "{}: off by {error:e}, {sure:?}", hard.name);
        assert_eq!(sure.warning("springs").is_some(), sure.forward_error > 1e-6);
        // the same from the springs themselves
        let mut solver = SpringSolver::new(&problem.operator, &Settings::DIRECT);
        solver.set(&problem.phi).expect("stiff");
        let again = solver.accuracy(&problem.operator.members(), &problem.phi, &problem.forces, &u).expect("estimates");
        let ratio = again.condition / sure.condition;
        assert!((0.1..10.0).contains(&ratio), "{again:?} {sure:?}");
    }
}

#[test]
fn factorisation_check() {
    // a factor of another matrix: one refinement does not make up for it, and no number comes out
    let (_, dofs, operator) = held_square();
    let (stiffness, symbolic) = operator.assembled().expect("a matrix");
    let mut factor = Factor::new(Arc::clone(symbolic));
    stiffness.assemble_into(&[1.0, 1.0], factor.values_mut());
    factor.refactor().expect("stiff");
    stiffness.assemble_into(&[1.0, 1.001], factor.values_mut());
    let forces = vec![1.0; dofs.len()];
    let mut u = vec![0.0; forces.len()];
    let outcome = factor.solve(&forces, &mut u);
    assert!(matches!(outcome, Err(Error::Inaccurate { backward_error, .. }) if backward_error > 1e-10), "{outcome:?}");
    // a pivot that is no number is found
    factor.values_mut()[0] = f64::NAN;
    assert!(factor.refactor().is_err() || factor.solve(&forces, &mut u).is_err());
    // f32 has no digit left at a spread of 1e12: double precision takes over, and the count says so
    let hard = problems::all().into_iter().find(|hard| hard.name == "weak diagonals 1e-12").expect("a problem");
    let problem = hard.problem().expect("a problem");
    let mut solver = SpringSolver::new(&problem.operator, &Settings { path: Path::Single, tolerance: 1e-10 });
    let mut u = vec![0.0; problem.forces.len()];
    solver.set(&problem.phi).expect("numbers");
    match solver.solve(&problem.forces, &mut u, 1e-10) {
        Ok(()) => assert!(solver.work().fallbacks > 0, "{:?}", solver.work()),
        Err(error) => says(&error, 3, &[]),
    }
}

#[test]
fn overlapping_or_empty_groups() {
    // lengths 1, sqrt 2, 2, sqrt 5, ...: at gamma = 0.8 the intervals around the means overlap
    let grid = Grid::new(&[4, 4]);
    let stretched: Vec<[f64; 3]> = nodes(&grid).iter().map(|[x, y, _]| [x * x, y + 0.3 * x, 0.0]).collect();
    let dofs = DofMap::untied(2, &[[false; 3]; 16]);
    let network = connect("grid", &grid, &stretched, &dofs);
    let rule = grouping::find("length").expect("a rule");
    for gamma in [0.8, 0.5, 0.2, 0.05, 1e-6] {
        let found = (rule.group)(&network, &Request::with_gamma(gamma)).expect("groups");
        assert_eq!(found.group_of.len(), network.springs.len(), "one group for every spring");
        for (a, group) in found.groups.iter().enumerate() {
            let members: Vec<f64> = (0..network.springs.len())
                .filter(|&s| found.group_of[s] as usize == a)
                .map(|s| network.springs[s].length)
                .collect();
            assert!(members.len() == group.springs && group.springs > 0, "gamma {gamma}: {group:?}");
            let inside = |l: &f64| (l / group.length - 1.0).abs() <= gamma + 1e-9;
            assert!(members.iter().all(inside), "gamma {gamma}: {members:?} about {}", group.length);
        }
        // the tie rule: from the longest on, so lengths of groups do not interleave
        let lengths = |a: usize| -> Vec<f64> {
            let members = (0..network.springs.len()).filter(|&s| found.group_of[s] as usize == a);
            members.map(|s| network.springs[s].length).collect()
        };
        for a in 1..found.groups.len() {
            let longest = lengths(a - 1).into_iter().fold(0.0, f64::max);
            let shortest = lengths(a).into_iter().fold(f64::INFINITY, f64::min);
            assert!(longest < shortest, "gamma {gamma}: {longest} {shortest}");
        }
    }
    // no body diagonals in the plane: that group does not exist, and a result lists the groups there are with their springs
    let names: Vec<String> = kinds(&network).groups.iter().map(|group| group.name.clone()).collect();
    assert_eq!(names, ["edge", "face_diagonal"]);
}
