//! Steps allocate nothing after the first: allocations are counted on the thread that steps, for the harness of the tests
//! allocates on its own.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use springfit::dynamics::external::External;
use springfit::dynamics::integrator::INTEGRATORS;
use springfit::dynamics::model::Model;
use springfit::dynamics::springs::{Coefficients, SpringModel};
use springfit::dynamics::stepper::{Settings, Stepper};
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::springs::topology;

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
fn allocations(model: &mut dyn Model, integrator: usize) -> u64 {
    let n = model.unknowns();
    let (u, v) = (vec![0.0; n], (0..n).map(|i| 0.01 * (i as f64).sin()).collect::<Vec<f64>>());
    let (external, settings) = (External::default(), Settings::with_step(1e-3));
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
        assert_eq!(allocations(&mut linear, number), 0, "{} on a linear body", integrator.name);
        if integrator.name == "leapfrog" {
            assert_eq!(allocations(&mut springs, number), 0, "{} on springs", integrator.name);
        }
    }
}
