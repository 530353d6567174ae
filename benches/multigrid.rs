//! The multigrid path of the springs from 9^3 to 97^3: iterations, seconds, memory, and the growth of time.
//!
//! Policy: cubes with springs grouped by kind, one load, residual 1e-10. Best of five (one for the largest), wall clock;
//! run with RAYON_NUM_THREADS=1 or 2 on a quiet machine. `--largest N` stops at N^3. The last columns are four loads, one
//! after the other and together: processor seconds of a load, the worst residual, and whether all bits are the same.

use springfit::clock::{Stopwatch, processor_seconds};
use springfit::geometry::dofs::DofMap;
use springfit::geometry::grid::Grid;
use springfit::springs::grouping::{self, Request};
use springfit::springs::multigrid_solver::MultigridSolver;
use springfit::springs::topology;
use springfit::springs::weighting::{self, Weighting};

/// Seconds of the stages.
struct Row {
    dofs: usize,
    iterations: usize,
    residual: f64,
    made: f64,
    set: f64,
    solve: f64,
    bytes: usize,
    alone: f64,
    together: f64,
    worst: f64,
    same: bool,
}

/// Loads that travel together.
const LOADS: usize = 4;

/// Processor seconds of what is done.
fn processor(work: impl FnOnce()) -> f64 {
    let before = processor_seconds();
    work();
    processor_seconds().zip(before).map_or(f64::NAN, |(after, before)| after - before)
}

fn measure(n: usize, runs: usize) -> Row {
    let grid = Grid::new(&[n, n, n]);
    let part = |i: usize| 2.0 * i as f64 / (n - 1) as f64;
    let points: Vec<[f64; 3]> = (0..grid.len()).map(|node| grid.index(node).map(part)).collect();
    let held: Vec<[bool; 3]> = (0..grid.len()).map(|node| [grid.index(node)[2] == 0; 3]).collect();
    let dofs = DofMap::untied(3, &held);
    let network = (topology::find("grid").expect("in the table").connect)(&grid, &points, &dofs);
    let grouping =
        (grouping::find("kind").expect("in the table").group)(&network, &Request::default()).expect("no gamma needed");
    let coefficients = weighting::coefficients(&network, Weighting::Cells, &vec![1.0; network.springs.len()]);
    let b: Vec<f64> = (0..dofs.len()).map(|i| [80.0, -40.0, 40.0][dofs.owner(i).1]).collect();
    let watch = Stopwatch::start();
    let mut solver =
        MultigridSolver::new(&network, &grid, &dofs, &grouping, &coefficients).expect("a grid that can be halved");
    let made = watch.seconds();
    let (mut set, mut solve) = (f64::INFINITY, f64::INFINITY);
    let mut report = None;
    for _ in 0..runs {
        let watch = Stopwatch::start();
        solver.set(&[1000.0, 1400.0, 700.0]);
        set = set.min(watch.seconds());
        let mut u = vec![0.0; b.len()];
        let watch = Stopwatch::start();
        report = Some(solver.solve(&b, &mut u, 1e-10).expect("solvable"));
        solve = solve.min(watch.seconds());
    }
    let bytes = solver.memory_bytes();
    let loads: Vec<f64> = (0..LOADS * b.len()).map(|i| b[i % b.len()] * (1.0 + (i as f64).sin())).collect();
    let (mut alone, mut together, mut worst, mut same) = (f64::INFINITY, f64::INFINITY, 0.0, true);
    for _ in 0..runs {
        let (mut u, mut v) = (vec![0.0; loads.len()], vec![0.0; loads.len()]);
        let each = loads.chunks_exact(b.len()).zip(u.chunks_exact_mut(b.len()));
        let one_by_one = || {
            each.for_each(|(f, u)| {
                solver.solve(f, u, 1e-10).expect("solvable");
            })
        };
        alone = alone.min(processor(one_by_one) / LOADS as f64);
        let in_step = || worst = solver.solve_columns(&loads, &mut v, 1e-10).expect("solvable").residual;
        together = together.min(processor(in_step) / LOADS as f64);
        same &= u == v;
    }
    let report = report.expect("one run at least");
    let (iterations, residual) = (report.iterations, report.residual);
    Row { dofs: dofs.len(), iterations, residual, made, set, solve, bytes, alone, together, worst, same }
}

fn main() {
    let mut arguments = std::env::args().skip_while(|argument| argument != "--largest").skip(1);
    let largest: usize = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(65);
    println!("threads {}", rayon::current_num_threads());
    println!(
        " n      dofs  iterations  residual   new s    set s  solve s  MB   growth   alone s  in step s  residual  same"
    );
    let mut before: Option<Row> = None;
    for n in [9, 17, 25, 33, 49, 65, 97].into_iter().filter(|n| *n <= largest) {
        let row = measure(n, if n > 65 { 1 } else { 5 });
        let total = |row: &Row| row.set + row.solve;
        let growth = before.map_or(String::new(), |before| {
            format!("{:.2}", (total(&row) / total(&before)).ln() / (row.dofs as f64 / before.dofs as f64).ln())
        });
        println!(
            "{n:2} {:9} {:11} {:9.1e} {:7.3} {:8.4} {:8.4} {:4.0} {growth:>7}  {:8.4}   {:8.4} {:9.1e}  {}",
            row.dofs,
            row.iterations,
            row.residual,
            row.made,
            row.set,
            row.solve,
            row.bytes as f64 / 1e6,
            row.alone,
            row.together,
            row.worst,
            if row.same { "yes" } else { "no" }
        );
        before = Some(row);
    }
}
