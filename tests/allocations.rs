//! Steps allocate nothing after the first: allocations are counted on the thread that steps, for the harness of the tests
//! allocates on its own.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use springfit::dynamics::corotational::CorotationalModel;
use springfit::dynamics::external::External;
use springfit::dynamics::integrator::INTEGRATORS;
use springfit::dynamics::model::Model;
use springfit::dynamics::springs::{Coefficients, SpringModel};
use springfit::dynamics::stepper::{Settings, Stepper};
use springfit::dynamics::system::LinearSolver;
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::geometry::meshes::kuhn::{distort, kuhn_box};
use springfit::reference::corotational::Tangent;
use springfit::reference::corotational::held::Held;
use springfit::reference::mass;
use springfit::reference::material::{Material, Plane};
use springfit::reference::methods::smoothed::{self, Smoothing};
use springfit::springs::multigrid_solver::MultigridSolver;
use springfit::springs::{grouping, topology};

/// The allocator of the system, counted.
struct Counted;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call goes to the allocator of the system as it is.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // a thread that ends has no counter any more, and nothing is counted on it
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counted = Counted;

/// Allocations in 20 steps after the first two.
fn allocations(model: &mut dyn Model, integrator: usize, linear: LinearSolver) -> u64 {
    let n = model.unknowns();
    let (u, v) = (vec![0.0; n], (0..n).map(|i| 0.01 * (i as f64).sin()).collect::<Vec<f64>>());
    let (external, settings) = (External::default(), Settings { linear, ..Settings::with_step(1e-3) });
    let mut stepper = Stepper::new(model, &external, &INTEGRATORS[integrator], settings, [&u, &v]).expect("masses");
    (0..2).for_each(|_| stepper.advance().expect("a step"));
    let before = ALLOCATIONS.get();
    (0..20).for_each(|_| stepper.advance().expect("a step"));
    ALLOCATIONS.get() - before
}

#[test]
fn steps_allocate_nothing_after_the_first() {
    let grid = Grid::new(&[5, 4, 3]);
    let positions: Vec<[f64; 3]> = (0..grid.len()).map(|node| grid.index(node).map(|i| i as f64)).collect();
    let mut fixed = vec![[false; 3]; grid.len()];
    fixed[..12].fill([true; 3]);
    let dofs = DofMap::untied(3, &fixed);
    let network = (topology::find("grid").expect("the table has it").connect)(&grid, &positions, &dofs);
    let (stiffness, damping) = (vec![100.0; network.springs.len()], vec![0.1; network.springs.len()]);
    let of = Coefficients { stiffness: &stiffness, damping: Some(&damping) };
    let mut springs = SpringModel::new(&network, &dofs, of, &vec![1.0; grid.len()]);
    let mut linear = springs.linear();
    for (number, integrator) in INTEGRATORS.iter().enumerate() {
        assert_eq!(allocations(&mut linear, number, LinearSolver::Cholesky), 0, "{} on a linear body", integrator.name);
        if integrator.name == "leapfrog" {
            let found = allocations(&mut springs, number, LinearSolver::Cholesky);
            assert_eq!(found, 0, "{} on springs", integrator.name);
        }
    }
}

/// A beam of 240 tetrahedra, face-smoothed.
fn corotational(tangent: Tangent) -> CorotationalModel {
    let (size, cells) = ([1.0, 0.2, 0.2], [10, 2, 2]);
    let mut mesh = kuhn_box(size, cells);
    distort(&mut mesh, size, cells, 0.3, 1);
    let fixed: Vec<[bool; 3]> = mesh.positions().iter().map(|x| [x[0] == 0.0; 3]).collect();
    let dofs = DofMap::untied(3, &fixed);
    let domains = || smoothed::domains(&mesh, Smoothing::Face, 1.0).expect("tetrahedra");
    let masses = mass::lumped(&domains().into_points(&mesh).expect("its mesh"), 1000.0, &dofs).expect("volumes");
    let lame = Material { young: 1e6, poisson: 0.3 }.lame(3, Plane::Strain).expect("a material");
    let held = Held::new(domains(), mesh.positions(), lame, dofs).expect("in space");
    CorotationalModel::new(held, &masses, tangent).with_damping(0.1, 1e-3)
}

/// In a pool of one thread that thread does all the work, so that all of it is counted.
#[test]
fn corotational_steps_allocate_nothing_after_the_first() {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let solvers = [LinearSolver::Cholesky, LinearSolver::Gradients { tolerance: 1e-8 }];
    for (name, tangent) in [
        ("semi_implicit_euler", Tangent::Warped),
        ("implicit_euler", Tangent::Positive),
        ("midpoint", Tangent::Exact),
        ("newmark", Tangent::Positive),
    ] {
        let number = INTEGRATORS.iter().position(|integrator| integrator.name == name).expect("in the table");
        for solver in solvers {
            let found = alone.install(|| allocations(&mut corotational(tangent), number, solver));
            assert_eq!(found, 0, "{name} with {solver:?}");
        }
    }
}

/// Short vectors, as sums of long ones keep one number for each piece of them.
#[test]
fn solves_on_a_grid_allocate_nothing_after_the_first() {
    let grid = Grid::new(&[9, 9, 9]);
    let positions: Vec<[f64; 3]> = (0..grid.len()).map(|node| grid.index(node).map(|i| i as f64)).collect();
    let held: Vec<[bool; 3]> = positions.iter().map(|x| [x[0] == 0.0; 3]).collect();
    let dofs = DofMap::untied(3, &held);
    let network = (topology::find("grid").expect("the table has it").connect)(&grid, &positions, &dofs);
    let group = grouping::find("kind").expect("the table has it").group;
    let groups = group(&network, &grouping::Request::default()).expect("no gamma needed");
    let weights = vec![1.0; network.springs.len()];
    let mut solver = MultigridSolver::new(&network, &grid, &dofs, &groups, &weights).expect("a grid to be halved");
    let forces: Vec<f64> = (0..5 * dofs.len()).map(|i| (i as f64).sin()).collect();
    let mut answers = vec![0.0; forces.len()];
    solver.set(&[3.0, 2.0, 1.0]);
    let mut solve = || {
        answers.fill(0.0);
        solver.solve_columns(&forces, &mut answers, 1e-10).expect("solvable");
    };
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    alone.install(|| {
        solve();
        let before = ALLOCATIONS.get();
        solve();
        assert_eq!(ALLOCATIONS.get() - before, 0);
    });
}
