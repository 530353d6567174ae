//! The figures of `bench` as tables for a person.

use std::fmt::Write;

use crate::readable::significant;

use super::calibrate;
use super::growth;
use super::machine::Machine;
use super::solve::Row;
use super::step;

/// One line about the machine.
pub fn machine(machine: &Machine) -> String {
    let Machine { processor, cores, threads, load, dense_gflops } = machine;
    format!(
        "{}, {cores} cores, {threads} threads, load {}, dense product {dense_gflops:.1} Gflop/s on one thread",
        processor.as_deref().unwrap_or("unknown processor"),
        load.map_or("unknown".into(), |load| format!("{load:.1}"))
    )
}

/// Rows of `bench solve`: median seconds of the stages, their sum (median, minimum, processor time), error, memory, rate.
pub fn solve(rows: &[Row]) -> String {
    let mut text = format!(
        "{:>5} {:>9} {:<10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>5} {:>8} {:>8} {:>9} {:>9} {:>8} {:>6}\n",
        "n",
        "dofs",
        "method",
        "analyse",
        "update",
        "refactor",
        "solve",
        "together",
        "(least)",
        "processor",
        "iter",
        "residual",
        "backward",
        "factor MB",
        "peak MB",
        "Gflop/s",
        "share"
    );
    for row in rows {
        let _ = writeln!(
            text,
            "{:>5} {:>9} {:<10} {:>9.3e} {:>9.3e} {:>9.3e} {:>9.3e} {:>9.3e} {:>9.3e} {:>9} {:>5} {:>8.1e} {:>8} {:>9.1} {:>9} {:>8.2} {:>4.0} %",
            row.size,
            row.unknowns,
            row.method,
            row.analyse.median,
            row.update.median,
            row.refactor.median,
            row.solve.median,
            row.evaluation.median,
            row.evaluation.least,
            row.evaluation.processor.map_or("-".into(), |seconds| format!("{seconds:.3e}")),
            row.iterations.map_or("-".into(), |count| count.to_string()),
            row.residual,
            row.backward_error.map_or("-".into(), |error| format!("{error:.1e}")),
            row.factor_bytes as f64 / 1e6,
            row.peak_bytes.map_or("-".into(), |bytes| format!("{:.1}", bytes as f64 / 1e6)),
            row.gflops,
            100.0 * row.share
        );
    }
    text
}

/// Rows of `bench step`: millions of springs a second, GB/s, and shares of the rates measured beside them.
pub fn step(rows: &[step::Row]) -> String {
    let mut text = format!(
        "{:>5} {:>9} {:>7} {:>10} {:>10} {:>10} {:>7} {:>7} {:>7} {:>6} {:>9} {:>6} {:>9} {:>9} {:>8}\n",
        "n",
        "springs",
        "threads",
        "forces M/s",
        "(least)",
        "steps M/s",
        "bytes",
        "GB/s",
        "memory",
        "share",
        "same size",
        "share",
        "step s",
        "real time",
        "error"
    );
    for row in rows {
        let _ = writeln!(
            text,
            "{:>5} {:>9} {:>7} {:>10.1} {:>10.1} {:>10.1} {:>7.1} {:>7.2} {:>7.2} {:>4.0} % {:>9.2} {:>4.0} % {:>9.3e} {:>9.2} {:>8.1e}",
            row.size,
            row.springs,
            row.threads,
            row.springs_per_second / 1e6,
            row.springs as f64 / row.forces.least / 1e6,
            row.stepped_per_second / 1e6,
            row.bytes_per_spring,
            row.rate / 1e9,
            row.memory_rate / 1e9,
            100.0 * row.share_of_memory,
            row.same_size_rate / 1e9,
            100.0 * row.share_at_its_size,
            row.step,
            row.real_time,
            row.errors[0]
        );
    }
    text
}

/// Rows of `bench calibrate`.
pub fn calibrate(rows: &[calibrate::Row]) -> String {
    let mut text = format!(
        "{:<24} {:>6} {:>10} {:>10} {:>14} {:>12} {:>16} {:>8}  stop\n",
        "variant", "groups", "e_rms %", "seconds", "to within 1 %", "evaluations", "refactorisations", "solves"
    );
    for row in rows {
        let _ = writeln!(
            text,
            "{:<24} {:>6} {:>10} {:>10} {:>14} {:>12} {:>16} {:>8}  {}",
            row.variant,
            row.groups,
            significant(row.e_rms, 6),
            significant(row.seconds, 3),
            row.seconds_to_best.map_or("-".into(), |seconds| significant(seconds, 3)),
            row.evaluations,
            row.refactorisations,
            row.solves,
            row.stop
        );
    }
    text
}

/// Rows of `bench growth`, and the exponent of each path.
pub fn growth(rows: &[growth::Row], direct_up_to: usize) -> String {
    let mut text = format!(
        "{:>5} {:>9} {:<8} {:<10} {:>10} {:>10} {:>9} {:>10} {:>8} {:>11} {:>12}\n",
        "n", "dofs", "asked", "taken", "seconds", "processor", "peak MB", "e_rms %", "solves", "iterations", "to exact"
    );
    for row in rows {
        let _ = writeln!(
            text,
            "{:>5} {:>9} {:<8} {:<10} {:>10.3} {:>10} {:>9} {:>10.6} {:>8} {:>11} {:>12}",
            row.size,
            row.unknowns,
            row.path,
            row.taken,
            row.seconds,
            row.processor.map_or("-".into(), |seconds| format!("{seconds:.3}")),
            row.peak_bytes.map_or("-".into(), |bytes| format!("{:.0}", bytes as f64 / 1e6)),
            row.e_rms,
            row.solves,
            row.iterations,
            row.exact_difference.map_or("-".into(), |difference| format!("{difference:.1e}"))
        );
    }
    for path in ["auto", "direct"] {
        if let Some(exponent) = growth::exponent(rows, path) {
            let _ = writeln!(text, "{path}: seconds grow like dofs^{exponent:.2} from {}^3 on", growth::FIT_FROM);
        }
    }
    let _ = writeln!(text, "direct path up to {direct_up_to}^3: its factorisations grow like dofs^2");
    text
}
