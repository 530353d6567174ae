//! States that no body should be in: it recovers, or the search ends with a named reason; nothing is ever NaN.

use crate::bodies::*;
use springfit::error::{Error, Result};
use springfit::geometry::dofs::DofMap;
use springfit::geometry::mesh::{CellKind, Mesh};
use springfit::reference::corotational::held::Held;
use springfit::reference::corotational::inversion::Inversion;
use springfit::reference::corotational::statics::{self, Equilibrium, Search};
use springfit::reference::methods::smoothed::{Domains, Smoothing};
use springfit::rng::Stream;

const SEARCH: Search = Search { load_steps: 1, tolerance: 1e-10, iterations: 300 };

fn held(domains: Domains, positions: &[[f64; 3]], dofs: DofMap) -> Held {
    Held::new(domains, positions, lame(0.3), dofs).expect("in space")
}

/// Equilibrium without load from a displacement; every number is finite, and a failure says why.
fn relax(held: &mut Held, start: &[f64]) -> Result<Equilibrium> {
    let found = statics::solve(held, &vec![0.0; start.len()], start, SEARCH);
    match &found {
        Ok(equilibrium) => {
            assert!(equilibrium.displacement.iter().all(|u| u.is_finite()));
            assert!(equilibrium.energy.is_finite() && equilibrium.residual.is_finite());
        }
        Err(Error::NoEquilibrium { reason, residual, .. }) => assert!(!reason.is_empty() && residual.is_finite()),
        Err(other) => panic!("an error of another kind: {other}"),
    }
    found
}

#[test]
fn a_single_inverted_tetrahedron_recovers() {
    let mut mesh = Mesh::new(3, vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.2, 1.0]]);
    mesh.push(CellKind::Tetrahedron, &[0, 1, 2, 3]);
    let dofs = DofMap::untied(3, &[[true; 3], [true; 3], [true; 3], [false; 3]]);
    for start in [[0.0, 0.0, -1.3], [0.0, 0.0, -1.0], [0.4, -0.3, -2.5], [-0.2, -0.2, -1.0]] {
        let domains = smoothed_domains(&mesh, Smoothing::Face);
        let mut body = held(domains, mesh.positions(), dofs.clone());
        assert!(!body.inversion(&start).is_sound());
        let found = relax(&mut body, &start).expect("it goes back");
        assert!(found.displacement.iter().all(|u| u.abs() < 1e-9), "{start:?}: {:?}", found.displacement);
        assert!(body.inversion(&found.displacement).is_sound());
    }
}

#[test]
fn a_flattened_bar_recovers_or_says_why_not() {
    let mesh = beam([5, 1, 1], 0.2, 1);
    for axis in 0..3 {
        for (name, domains, positions) in every_method(&mesh) {
            let dofs = clamped(&positions);
            let start: Vec<f64> = (0..dofs.len())
                .map(|dof| match dofs.owner(dof) {
                    (node, i) if i == axis => -positions[node][i],
                    _ => 0.0,
                })
                .collect();
            let mut body = held(domains, &positions, dofs);
            let found = relax(&mut body, &start);
            if name == "fem" {
                let found = found.expect("elements see every inversion");
                assert!(found.energy < 1e-12, "axis {axis}: {}", found.energy);
            }
        }
    }
}

#[test]
fn a_box_pushed_through_itself_stays_finite_and_comes_back() {
    let mesh = beam([5, 2, 2], 0.0, 1);
    let ends: Vec<[bool; 3]> = mesh.positions().iter().map(|x| [x[0] == 0.0 || x[0] == SIZE[0]; 3]).collect();
    for (_, smoothing) in [METHODS[0], METHODS[1]] {
        let dofs = DofMap::untied(3, &ends);
        let mut body = held(smoothed_domains(&mesh, smoothing), mesh.positions(), dofs);
        let mut u = vec![0.0; body.dofs().len()];
        let pushes = [0.5, 0.0, -0.5, -1.0, -0.5, 0.0, 0.5, 1.0];
        for length in pushes {
            let places: Vec<[f64; 3]> =
                mesh.positions().iter().map(|x| [if x[0] == SIZE[0] { length } else { x[0] }, x[1], x[2]]).collect();
            body.hold(&places);
            if let Ok(found) = relax(&mut body, &u) {
                u = found.displacement;
            }
        }
        let found = relax(&mut body, &u).expect("the ends are where they were");
        assert!(found.energy < 1e-9 || !body.inversion(&found.displacement).is_sound(), "{}", found.energy);
    }
}

#[test]
fn a_body_in_a_heap_recovers_or_says_why_not() {
    for seed in 0..6 {
        let mesh = beam([4, 1, 1], 0.3, seed);
        for smoothing in [Smoothing::Element, Smoothing::Face, Smoothing::Edge] {
            let dofs = clamped(mesh.positions());
            let mut stream = Stream::new(seed, 0, 0);
            let start: Vec<f64> = (0..dofs.len()).map(|_| 0.3 * stream.normal()).collect();
            let mut body = held(smoothed_domains(&mesh, smoothing), mesh.positions(), dofs);
            assert!(!body.inversion(&start).is_sound());
            let found = relax(&mut body, &start);
            assert!(smoothing != Smoothing::Element || found.is_ok(), "{found:?}");
        }
    }
}

#[test]
fn places_that_are_no_numbers_end_with_a_reason() {
    let mesh = beam([2, 1, 1], 0.0, 1);
    let mut body = held(smoothed_domains(&mesh, Smoothing::Face), mesh.positions(), clamped(mesh.positions()));
    for bad in [f64::NAN, f64::INFINITY] {
        let mut start = vec![0.0; body.dofs().len()];
        start[4] = bad;
        let found = statics::solve(&mut body, &vec![0.0; start.len()], &start, SEARCH);
        assert!(matches!(found, Err(Error::NoEquilibrium { .. })), "{bad}: {found:?}");
        assert!(!body.inversion(&start).is_sound());
    }
    // what is finite is brought back to a size that a body has, if not always to rest
    let mut start = vec![0.0; body.dofs().len()];
    start[4] = 1e100;
    let found = relax(&mut body, &start).expect("finite");
    assert!(found.displacement.iter().all(|u| u.abs() < 1.0) && body.inversion(&found.displacement).is_sound());
    let zeros = vec![0.0; body.dofs().len()];
    let sound = statics::solve(&mut body, &zeros, &zeros, SEARCH);
    assert_eq!(sound.expect("at rest").iterations, 0);
}

/// A mean over a face can be sound while a cell in it is not.
#[test]
fn inversion_is_told_of_cells_and_of_domains() {
    let mut mesh = Mesh::new(3, vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 1.0], [0.3, 0.3, -1.0]]);
    mesh.push(CellKind::Tetrahedron, &[0, 1, 2, 3]);
    mesh.push(CellKind::Tetrahedron, &[0, 2, 1, 4]);
    let domains = smoothed_domains(&mesh, Smoothing::Face);
    let mut places = mesh.positions().to_vec();
    places[3][2] = -0.2;
    let told = Inversion::of(&domains, &places);
    assert_eq!(told.cells, [0]);
    assert!((told.least_cell + 0.2).abs() < 1e-14);
    // the inner face averages -0.2 and 1, the three outer faces of cell 0 see it alone
    assert_eq!(told.domains.len(), 3);
    assert!((told.least_domain + 0.2).abs() < 1e-14);
    assert!(Inversion::of(&domains, mesh.positions()).is_sound());
}
