//! How far an accuracy holds: groups that adapt beside groups by length, on loads of the fit and on loads outside it.
//!
//! Eight load cases act on each of the six bodies of the thesis, each scaled to the same largest displacement of the
//! continuum. c0 is the load of the thesis, F = {c0, uniform_z (radial in 2D), torsion, random_smooth} the fitted set, H =
//! {uniform_x, uniform_y, bending, point} the set that no fit sees. Errors are e_rms in percent, the root mean square over the
//! cases. The thesis reports the error of the one load that it fits. Two rows go further: twelve more random smooth loads in F, and
//! the second ring of springs.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use crate::calibration::adaptive::Rung;
use crate::calibration::errors;
use crate::clock::{Progress, Stopwatch};
use crate::error::Result;
use crate::reference::Reference;
use crate::reference::load_fields::{self, Field};
use crate::reference::load_file::{self, Wanted};
use crate::reference::loads;
use crate::report::thesis::{Experiment, TABLES};
use crate::scene::{self, Gamma, Scene, Source};
use crate::study::body::{self, Body};
use crate::study::checkpoint::Checkpoint;
use crate::study::fit::{self, Calibration, Given};
use crate::study::loads::LoadCase;
use crate::study::{self, network};

/// The word that asks for this table.
pub const NAME: &str = "frontier";

/// Forces of the eight load cases on every control point of the six bodies.
const FORCES: &str = include_str!("../../../data/loads/six_bodies.json");

/// c0, and the cases of H.
const SOURCE: &str = "source";
const HELD_OUT: [&str; 4] = ["uniform_x", "uniform_y", "bending", "point"];

/// Groups of the columns.
pub const GROUPS: [usize; 2] = [16, 32];

/// A row of the table.
pub(super) struct Asked {
    /// The body.
    pub(super) body: &'static str,
    topology: &'static str,
    /// Random smooth loads in F beyond the four.
    more_loads: usize,
    /// What a prototype of the method reached with 16 and 32 groups, fitted on c0 alone, percent.
    alone: Option<[f64; 2]>,
    /// Fitted on F, its error on H.
    on_held_out: Option<[f64; 2]>,
}

const fn row(body: &'static str, alone: [f64; 2], on_held_out: [f64; 2]) -> Asked {
    Asked { body, topology: "grid", more_loads: 0, alone: Some(alone), on_held_out: Some(on_held_out) }
}

const fn beyond(body: &'static str, topology: &'static str, more_loads: usize) -> Asked {
    Asked { body, topology, more_loads, alone: None, on_held_out: None }
}

/// The rows, in their order.
pub(super) const ROWS: &[Asked] = &[
    row("square", [0.24, 0.12], [2.43, 2.30]),
    row("circle", [1.40, 1.27], [6.5, 7.5]),
    row("ellipse", [5.46, 4.81], [14.0, 15.6]),
    row("cube", [0.98, 0.69], [1.93, 1.79]),
    row("torus", [7.26, 6.10], [13.2, 12.0]),
    row("spheroid", [7.07, 5.87], [8.3, 7.8]),
    beyond("circle", "grid", 12),
    beyond("ellipse", "grid", 12),
    beyond("torus", "second_ring", 0),
];

/// One fit, measured on the loads it saw and on H.
#[derive(Debug, Clone, Serialize)]
pub struct Fit {
    /// Groups.
    pub groups: usize,
    /// Error over the fitted cases, percent.
    pub fitted: f64,
    /// Error over H, percent.
    pub held_out: f64,
    /// Factorisations so far.
    pub refactorisations: u64,
    /// Seconds so far.
    pub seconds: f64,
}

/// A row of the table.
#[derive(Debug, Clone, Serialize)]
pub struct Compared {
    /// "frontier".
    pub table: &'static str,
    /// The body.
    pub body: &'static str,
    /// Its springs.
    pub topology: &'static str,
    /// Random smooth loads in F beyond the four.
    pub more_loads: usize,
    /// Groups that adapt, fitted on c0 alone: one entry for each of [`GROUPS`].
    pub alone: Vec<Fit>,
    /// Groups that adapt, fitted on F.
    pub on_all: Vec<Fit>,
    /// Gamma of the groups by length.
    pub gamma: f64,
    /// Groups by length, fitted on c0 alone.
    pub length_alone: Fit,
    /// Groups by length, fitted on F.
    pub length_on_all: Fit,
    /// A prototype's error on c0, fitted on c0 alone.
    pub prototype_alone: Option<[f64; 2]>,
    /// A prototype's error on H, fitted on F.
    pub prototype_held_out: Option<[f64; 2]>,
    /// Groups and e_rms that the thesis prints (table 5.3), fitted on c0 alone.
    pub source: (Option<usize>, f64),
}

/// The table, or the rows of some bodies.
///
/// # Errors
/// Whatever a study can fail with.
pub fn run(bodies: Option<&[&str]>, progress: &Progress) -> Result<Vec<Compared>> {
    let wanted = |asked: &&Asked| bodies.is_none_or(|bodies| bodies.contains(&asked.body));
    ROWS.iter().filter(wanted).map(|asked| compare(asked, progress)).collect()
}

fn compare(asked: &Asked, progress: &Progress) -> Result<Compared> {
    let Experiment { gamma, groups, errors, .. } = *of_thesis(asked.body);
    let alone = Bench::new(asked, false, progress)?;
    let on_all = Bench::new(asked, true, progress)?;
    Ok(Compared {
        table: NAME,
        body: asked.body,
        topology: asked.topology,
        more_loads: asked.more_loads,
        alone: alone.adaptive(progress)?,
        on_all: on_all.adaptive(progress)?,
        gamma,
        length_alone: alone.by_length(gamma, progress)?,
        length_on_all: on_all.by_length(gamma, progress)?,
        prototype_alone: asked.alone,
        prototype_held_out: asked.on_held_out,
        source: (groups, errors[0]),
    })
}

/// The row of a body in table 5.3.
fn of_thesis(body: &str) -> &'static Experiment {
    let rows = TABLES.iter().filter(|table| table.id == "5.3").flat_map(|table| table.rows);
    rows.into_iter().find(|row| row.body == body).expect("one of the six bodies")
}

/// A body under its loads, solved.
pub(super) struct Bench {
    scene: Scene,
    body: Body,
    loads: Vec<LoadCase>,
    reference: Reference,
}

impl Bench {
    /// The loads of c0 or of F, and those of H.
    fn new(asked: &Asked, all: bool, progress: &Progress) -> Result<Self> {
        Self::of(&plain_scene(asked)?, asked, all, progress)
    }

    /// The same on another scene of the body of a row.
    pub(super) fn of(scene: &Scene, asked: &Asked, all: bool, progress: &Progress) -> Result<Self> {
        let body = body::build(scene)?;
        let second = if body.dofs.dimension() == 3 { "uniform_z" } else { "radial" };
        let fitted = if all { vec![SOURCE, second, "torsion", "random_smooth"] } else { vec![SOURCE] };
        let named = fitted.iter().map(|name| (*name, true)).chain(HELD_OUT.map(|name| (name, false)));
        let mut loads = named.map(|(name, fit)| case(asked.body, name, fit, &body)).collect::<Result<Vec<_>>>()?;
        for seed in 1..=(if all { asked.more_loads as u64 } else { 0 }) {
            let load = load_fields::load(&Field::RandomSmooth { seed }, 1.0, body.positions(), &body.dofs)?;
            loads.push(LoadCase { name: format!("random_{seed}"), fit: true, load });
        }
        Self::solved(body, loads, progress)
    }

    /// Fields in the place of forces from the file: a random smooth one or three are fitted, torsion and a radial one held out.
    pub(super) fn of_fields(scene: &Scene, all: bool, progress: &Progress) -> Result<Self> {
        let body = body::build(scene)?;
        let axis = if body.dofs.dimension() == 3 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let random = (1..=if all { 3 } else { 1 }).map(|seed| (Field::RandomSmooth { seed }, true));
        let held_out = [Field::Torsion { axis }, Field::Radial].map(|field| (field, false));
        let case = |(field, fit): (Field, bool)| {
            let load = load_fields::load(&field, 1.0, body.positions(), &body.dofs)?;
            Ok(LoadCase { name: String::new(), fit, load })
        };
        let loads = random.chain(held_out).map(case).collect::<Result<Vec<_>>>()?;
        Self::solved(body, loads, progress)
    }

    /// Solves the continuum, and scales every load to the same displacement.
    fn solved(body: Body, mut loads: Vec<LoadCase>, progress: &Progress) -> Result<Self> {
        progress.check()?;
        let scene = body.resolved.clone();
        let mut reference = study::solve_reference(&body, &loads, progress)?;
        for (case, answer) in loads.iter_mut().zip(&mut reference.cases) {
            let factor = 1.0 / answer.u_max;
            case.load.scale(factor);
            answer.scale(factor);
        }
        Ok(Self { scene, body, loads, reference })
    }

    fn calibrate(&self, scene: &Scene, progress: &Progress) -> Result<Calibration> {
        let lattice = network::build(scene, &self.body)?;
        let Self { body, loads, reference, .. } = self;
        fit::calibrate(Given { scene, body, loads, reference, lattice: &lattice }, progress, &Checkpoint::none())
    }

    /// A ladder to so many groups.
    pub(super) fn ladder(&self, groups: usize, progress: &Progress) -> Result<Calibration> {
        let mut scene = self.scene.clone();
        scene.springs.grouping = scene::ADAPTIVE.into();
        scene.springs.profile = Some("inverse_square".into());
        scene.springs.groups = groups;
        self.calibrate(&scene, progress)
    }

    /// The ends of every spring, ascending.
    pub(super) fn ends(&self) -> Result<Vec<[u32; 2]>> {
        let ends = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        Ok(network::build(&self.scene, &self.body)?.network.springs.iter().map(|spring| ends(spring.nodes)).collect())
    }

    /// Groups that adapt: one entry for each of [`GROUPS`].
    fn adaptive(&self, progress: &Progress) -> Result<Vec<Fit>> {
        let found = self.ladder(GROUPS[GROUPS.len() - 1], progress)?;
        let last = found.ladder.last();
        // a ladder that ended early keeps what it found
        let rung = |groups: usize| found.ladder.iter().find(|rung| rung.groups >= groups).or(last);
        Ok(GROUPS.iter().filter_map(|&groups| rung(groups)).map(of_rung).collect())
    }

    /// Groups by length.
    fn by_length(&self, gamma: f64, progress: &Progress) -> Result<Fit> {
        let mut scene = self.scene.clone();
        scene.calibration.gamma = Gamma::Fixed(gamma);
        let watch = Stopwatch::start();
        let found = self.calibrate(&scene, progress)?;
        let held_out: Vec<_> =
            self.loads.iter().zip(&found.errors).filter(|(case, _)| !case.fit).map(|(_, errors)| *errors).collect();
        Ok(Fit {
            groups: found.grouping.groups.len(),
            fitted: found.fitted.e_rms,
            held_out: errors::over_cases(&held_out).e_rms,
            refactorisations: found.counts.refactorisations,
            seconds: watch.seconds(),
        })
    }
}

fn of_rung(rung: &Rung) -> Fit {
    Fit {
        groups: rung.groups,
        fitted: rung.error,
        held_out: rung.held_out.unwrap_or(f64::NAN),
        refactorisations: rung.counts.refactorisations,
        seconds: rung.seconds,
    }
}

/// The body of a row as a scene; its load only makes it one, the loads of the table take its place.
pub(super) fn plain_scene(asked: &Asked) -> Result<Scene> {
    let experiment = of_thesis(asked.body);
    let source = Source { name: asked.body.into(), text: experiment.scene("cells", "gauss_newton", 1) };
    let mut scene = scene::parse(&source).map_err(|located| located.error)?;
    scene.springs.topology = asked.topology.into();
    Ok(scene)
}

/// A case of the file of forces.
fn case(body_name: &str, name: &str, fit: bool, body: &Body) -> Result<LoadCase> {
    let (dimension, nodes) = (body.dofs.dimension(), body.dofs.nodes());
    let wanted = Wanted { body: Some(body_name), case: Some(name), dimension, nodes };
    let forces = load_file::parse(FORCES, Path::new("six_bodies.json"), wanted)?;
    Ok(LoadCase { name: name.into(), fit, load: loads::nodal(&body.dofs, &forces)? })
}

/// The table for people.
pub fn table(rows: &[Compared]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut text = format!(
        "\nFrontier: e_rms in percent with {} / {} groups that adapt, beside groups by length\n\
         {:<24} | {:>13} {:>13} {:>15} | {:>15} {:>13} {:>13} | {:>6} {:>6} {:>8} {:>8} {:>8} | {:>14} | {:>11} {:>11} | {:>11}\n",
        GROUPS[0],
        GROUPS[1],
        "body",
        "fit c0",
        "prototype",
        "c0, on H",
        "fit F",
        "F, on H",
        "prototype",
        "length",
        "groups",
        "fit c0",
        "c0 on H",
        "F on H",
        "source, groups",
        "fact. c0",
        "fact. F",
        "seconds"
    );
    for row in rows {
        let name = match (row.topology, row.more_loads) {
            ("grid", 0) => row.body.to_owned(),
            ("grid", more) => format!("{}, {more} loads more", row.body),
            (topology, _) => format!("{}, {topology}", row.body),
        };
        let given = |pair: Option<[f64; 2]>| pair.map_or("-".to_owned(), |[a, b]| format!("{a} / {b}"));
        let (groups, error) = row.source;
        let source = format!("{error}, {}", groups.map_or("-".to_owned(), |groups| groups.to_string()));
        let _ = writeln!(
            text,
            "{name:<24} | {:>13} {:>13} {:>15} | {:>15} {:>13} {:>13} | {:>6} {:>6} {:>8.3} {:>8.2} {:>8.2} | {source:>14} | {:>11} {:>11} | {:>11}",
            pair(&row.alone, |fit| format!("{:.3}", fit.fitted)),
            given(row.prototype_alone),
            pair(&row.alone, |fit| format!("{:.2}", fit.held_out)),
            pair(&row.on_all, |fit| format!("{:.2}", fit.fitted)),
            pair(&row.on_all, |fit| format!("{:.2}", fit.held_out)),
            given(row.prototype_held_out),
            row.gamma,
            row.length_alone.groups,
            row.length_alone.fitted,
            row.length_alone.held_out,
            row.length_on_all.held_out,
            pair(&row.alone, |fit| fit.refactorisations.to_string()),
            pair(&row.on_all, |fit| fit.refactorisations.to_string()),
            pair(&row.on_all, |fit| format!("{:.2}", fit.seconds)),
        );
    }
    text
}

/// Both columns of a cell.
fn pair(fits: &[Fit], show: impl Fn(&Fit) -> String) -> String {
    fits.iter().map(show).collect::<Vec<_>>().join(" / ")
}
