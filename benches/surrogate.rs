//! The surrogate measured: what one of its evaluations costs on cubes of 9^3, 17^3 and 25^3, and how long a search on it
//! takes beside 200 exact evaluations of annealing.
//!
//! Policy: one thread; medians of 15 seeds for searches, fastest of 7 for evaluations; the error is printed beside the
//! time. Run with `cargo bench --bench surrogate`.

#[allow(dead_code, reason = "shared with the tests, which use another part")]
#[path = "../tests/surrogate/cases.rs"]
mod cases;

use cases::*;

use std::time::Instant;

use springfit::calibration::optimiser::Settings;

fn main() {
    the_online_cost_on_cubes_of_9_17_and_25();
    annealing_on_the_surrogate_beside_200_exact_evaluations();
}

fn annealing_on_the_surrogate_beside_200_exact_evaluations() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for (shape, gamma, groups, table, weighting) in rows() {
        let case = weighted_case(shape, gamma, weighting);
        let known = best_known(shape, gamma, table);
        let timed = |optimiser: &str, settings: &Settings, seed: u64| {
            let start = Instant::now();
            let found = pool.install(|| case.run(optimiser, seed, settings));
            (start.elapsed().as_secs_f64(), found)
        };
        let annealing = Settings { chains: 1, evaluations: 200, ..Settings::default() };
        for settings in [Settings { chains: 1, evaluations: 1250, ..Settings::default() }, Settings::default()] {
            let (mut ratios, mut reached, mut totals, mut errors) = (vec![], vec![], vec![], vec![]);
            for seed in 1..16 {
                let exact = timed("annealing", &annealing, seed).0;
                let (total, found) = timed("surrogate", &settings, seed);
                let near = found.trace.iter().find(|point| point.error <= 1.01 * known);
                reached.push(near.map_or(f64::INFINITY, |point| point.seconds));
                ratios.push(total / exact);
                totals.push(total);
                errors.push(100.0 * (found.error / known - 1.0));
            }
            for column in [&mut ratios, &mut reached, &mut totals, &mut errors] {
                column.sort_by(f64::total_cmp);
            }
            println!(
                "{shape} {groups} groups {weighting:?}, {} chains: median of 15 seeds {:.4} s to the end, its chain to 1 % {:.4} s, {:.2} of 200 exact evaluations; error {:+.3} % median, {:+.3} % worst",
                settings.chains, totals[7], reached[7], ratios[7], errors[7], errors[14]
            );
        }
    }
}

fn the_online_cost_on_cubes_of_9_17_and_25() {
    for (parts, r) in [(1, 20), (2, 20), (2, 30)] {
        for n in [9, 17, 25] {
            let (evaluation, bound, exact) = online_cost(n, parts, r);
            println!(
                "{n}^3, {} groups, r = {r}: {:.2} us an evaluation, {:.2} us its bound, {:.4} s refactor + solve, {:.0} to 1",
                3 * parts,
                1e6 * evaluation,
                1e6 * bound,
                exact,
                exact / evaluation
            );
        }
    }
}
