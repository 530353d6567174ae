//! The surrogate measured: what one of its evaluations costs on cubes of 9^3, 17^3 and 25^3, how long a search on it takes
//! beside 200 exact evaluations of annealing, and how often a search ends high.
//!
//! Policy: one thread; medians of 15 seeds for searches (12 where they are counted), fastest of 7 for evaluations; the error
//! is printed beside the time. Run with `cargo bench --bench surrogate`.

#[allow(dead_code, reason = "shared with the tests, which use another part")]
#[path = "../tests/surrogate/cases.rs"]
mod cases;

use cases::*;

use std::time::Instant;

use springfit::calibration::optimiser::Settings;
use springfit::springs::weighting::Weighting;

fn main() {
    the_online_cost_on_cubes_of_9_17_and_25();
    annealing_on_the_surrogate_beside_200_exact_evaluations();
    how_often_a_search_ends_high();
}

/// Errors against the lowest that 16 starts of Gauss-Newton, or any of the searches, found.
fn how_often_a_search_ends_high() {
    let bodies = [
        ("cube", [0.1, 0.01].as_slice()),
        ("torus", &[0.2, 0.1, 0.05]),
        ("spheroid", &[0.2, 0.1, 0.05]),
        ("ellipse", &[0.1]),
    ];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let (mut high, mut all) = (0, 0);
    for (shape, gamma) in bodies.into_iter().flat_map(|(shape, gammas)| gammas.iter().map(move |gamma| (shape, *gamma)))
    {
        for weighting in [Weighting::Springs, Weighting::Cells] {
            let case = weighted_case(shape, gamma, weighting);
            let starts = Settings { starts: Some(16), polish: 2000, ..Settings::default() };
            let reference = pool.install(|| case.run("gauss_newton", 1, &starts)).error;
            let search = |seed| pool.install(|| case.run("surrogate", seed, &Settings::default())).error;
            let mut errors: Vec<f64> = (1..13).map(search).collect();
            errors.sort_by(f64::total_cmp);
            let lowest = reference.min(errors[0]);
            let above = |error: f64| 100.0 * (error / lowest - 1.0);
            let count = errors.iter().filter(|error| above(**error) > 1.0).count();
            (high, all) = (high + count, all + errors.len());
            println!(
                "{shape} gamma {gamma}, {} groups {weighting:?}: lowest {lowest:.4} %; of 12 seeds {count} end more than 1 % above it, {:+.3} % median, {:+.3} % worst; Gauss-Newton from 16 starts {:+.3} %",
                case.upper.len(),
                above(errors[6]),
                above(errors[11]),
                above(reference)
            );
        }
    }
    println!("{high} of {all} searches end more than 1 % high");
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
