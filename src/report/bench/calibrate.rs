//! `bench calibrate`: the error that every way to calibrate reaches, against time.
//!
//! All variants work on the same body, loads, reference and groups, from the same seed; chain c of every annealing and
//! start s of every Gauss-Newton begin at the same phi. A scene with a sweep of gamma is measured at its smallest gamma, the problem
//! with the most groups. The curve of a variant is the history of the start or chain that found its best state, in
//! seconds since that start or chain began; its last point is the end of the whole fit, so work that other starts did is
//! in the last point and not in the curve.

use serde::Serialize;

use crate::calibration::objective::Counts;
use crate::clock::Progress;
use crate::error::Result;
use crate::scene::{Gamma, Scene};
use crate::study::checkpoint::Checkpoint;
use crate::study::fit::{self, Calibration, Given};
use crate::study::{self, Study};

/// A curve counts as arrived when its error is this close to the best of all.
const CLOSE: f64 = 1.01;

/// A way to calibrate: a change of the scene.
pub struct Variant {
    /// Name in table and chart.
    pub name: &'static str,
    change: fn(&mut Scene),
}

/// Annealing on a reduced basis; left out where the springs are solved by multigrid, for its bound needs factors.
const SURROGATE: &str = "annealing, surrogate";

/// All variants, in the order of the table.
pub const VARIANTS: &[Variant] = &[
    Variant {
        name: "annealing, one chain",
        change: |scene| {
            scene.calibration.optimiser = Some("annealing".into());
            scene.calibration.annealing.chains = 1;
        },
    },
    Variant {
        name: "annealing, many chains",
        change: |scene| {
            scene.calibration.optimiser = Some("annealing".into());
            scene.calibration.annealing.chains = scene.calibration.annealing.chains.max(4);
        },
    },
    Variant { name: "gauss_newton", change: |scene| scene.calibration.optimiser = Some("gauss_newton".into()) },
    Variant { name: "hybrid", change: |scene| scene.calibration.optimiser = Some("hybrid".into()) },
    Variant { name: SURROGATE, change: |scene| scene.calibration.optimiser = Some("surrogate".into()) },
];

/// What one variant did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Name of the variant.
    pub variant: &'static str,
    /// Number of groups.
    pub groups: usize,
    /// Error it found, percent.
    pub e_rms: f64,
    /// Seconds of the fit.
    pub seconds: f64,
    /// Seconds until its curve was within 1 % of the best error of all variants, if it came there.
    pub seconds_to_best: Option<f64>,
    /// Errors asked for.
    pub evaluations: u64,
    /// Factorisations of K(phi).
    pub refactorisations: u64,
    /// Right-hand sides solved for.
    pub solves: u64,
    /// Why it stopped.
    pub stop: &'static str,
    /// Seconds, factorisations and smallest error so far, percent.
    pub trace: Vec<(f64, u64, f64)>,
}

/// Calibrates a scene with every variant.
///
/// # Errors
/// Those of a study.
pub fn run(scene: &Scene, progress: &Progress) -> Result<Vec<Row>> {
    let mut scene = scene.clone();
    let smallest = scene.calibration.gamma.values()?.into_iter().fold(f64::INFINITY, f64::min);
    scene.calibration.gamma = Gamma::Fixed(smallest);
    let changed = |scene: &Scene, variant: &Variant| {
        let mut scene = scene.clone();
        (variant.change)(&mut scene);
        scene
    };
    let study = study::run(&changed(&scene, &VARIANTS[0]), progress)?;
    let mut rows = vec![row(&VARIANTS[0], &study.calibration)];
    let Study { body, loads, reference, lattice, .. } = &study;
    let possible = |variant: &&Variant| variant.name != SURROGATE || lattice.symbolic.is_some();
    // the first variant has changed what the scene says about chains
    let told = Scene { calibration: scene.calibration, ..study.scene.clone() };
    for variant in VARIANTS[1..].iter().filter(possible) {
        let scene = changed(&told, variant);
        let given = Given { scene: &scene, body, loads, reference, lattice };
        rows.push(row(variant, &fit::calibrate(given, progress, &Checkpoint::none())?));
    }
    let best = rows.iter().fold(f64::INFINITY, |best, row| best.min(row.e_rms));
    for row in &mut rows {
        row.seconds_to_best = row.trace.iter().find(|point| point.2 <= CLOSE * best).map(|point| point.0);
    }
    Ok(rows)
}

fn row(variant: &Variant, found: &Calibration) -> Row {
    let fit = &found.sweep[found.best];
    let Counts { evaluations, refactorisations, solves, .. } = fit.outcome.counts;
    let mut trace: Vec<_> =
        fit.outcome.trace.iter().map(|point| (point.seconds, point.refactorisations, point.error)).collect();
    trace.push((fit.seconds, refactorisations, fit.errors.e_rms));
    Row {
        variant: variant.name,
        groups: fit.groups,
        e_rms: fit.errors.e_rms,
        seconds: fit.seconds,
        seconds_to_best: None,
        evaluations,
        refactorisations,
        solves,
        stop: fit.outcome.stop.name(),
        trace,
    }
}
