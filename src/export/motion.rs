//! A motion as files: for ParaView, for a spreadsheet, and for the eye.
//!
//! | file | what |
//! |---|---|
//! | `motion.pvd` | the times and the files of the frames: what ParaView opens |
//! | `motion/frame_N.vtu` | the network where it is at record N, with `displacement` (m) and `strain` of each spring (percent); where a body of finite elements itself moves, its cells |
//! | `motion.csv` | a row for each record: time (s), global strain (4.17) (percent), energies (J) |
//! | `motion_energy.svg` | the energies over time |
//! | `strain.svg` | the global strain over time, one curve for each alpha |
//!
//! With several alpha, `motion` becomes `motion_alpha_A` in the names, A in s. Frames are written before the list that
//! names them, so a list never names a file that is not there.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::dynamics::energy::Energies;
use crate::dynamics::motion::Motion;
use crate::error::Result;
use crate::geometry::dofs::DofMap;

use super::plot::{self, Curve, Labels};
use super::vtu::{self, Cells, Field, UnstructuredGrid};
use super::{Body, Calibrated, mesh, write};

/// A motion and the damping that it was made with.
#[derive(Debug, Clone, Copy)]
pub struct Recorded<'a> {
    /// alpha of (4.18) in s; none without damping by it.
    pub alpha: Option<f64>,
    /// What was recorded.
    pub motion: &'a Motion,
    /// The degrees of freedom of its frames; those of the results when absent.
    pub dofs: Option<&'a DofMap>,
    /// Whether it is the body that moved, and not the network.
    pub of_body: bool,
}

/// The columns of `motion.csv`.
const COLUMNS: &str = "time_s,global_strain_percent,kinetic_J,elastic_J,dissipated_J,work_J";

/// What a curve shows of the energies.
type Shown = fn(&Energies) -> f64;

/// The curves of `motion_energy.svg`.
const ENERGIES: [(&str, Shown); 5] = [
    ("kinetic", |e| e.kinetic),
    ("elastic", |e| e.elastic),
    ("dissipated", |e| e.dissipated),
    ("kinetic + elastic + dissipated", |e| e.mechanical() + e.dissipated),
    ("work of the loads", |e| e.work),
];

impl Recorded<'_> {
    /// What stands in the names of its files; alone it needs no number.
    fn stem(&self, alone: bool) -> String {
        match self.alpha {
            Some(alpha) if !alone => format!("motion_alpha_{alpha}"),
            _ => "motion".into(),
        }
    }

    /// Its name in a legend.
    fn legend(&self) -> String {
        self.alpha.map_or("no damping (4.18)".into(), |alpha| format!("alpha = {alpha} s"))
    }
}

/// Writes all motions of the results into a folder; nothing where nothing moved. The same alpha twice is the same motion
/// and written once.
///
/// # Errors
/// [`crate::error::Error::File`] with the file that cannot be written.
pub fn write(results: &Calibrated, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut motions: Vec<Recorded> = Vec::new();
    for one in results.motions {
        if motions.iter().all(|kept| kept.alpha != one.alpha) {
            motions.push(*one);
        }
    }
    let mut files = Vec::new();
    let mut put = |name: String, contents: &[u8]| -> Result<()> {
        let path = folder.join(name);
        write::whole(&path, contents)?;
        files.push(path);
        Ok(())
    };
    for one in &motions {
        let stem = one.stem(motions.len() == 1);
        let mut frames = Vec::new();
        for (number, u) in one.motion.frames.iter().enumerate() {
            let name = format!("{stem}/frame_{number:05}.vtu");
            put(name.clone(), &frame(results, one, u))?;
            frames.push(name);
        }
        put(format!("{stem}.pvd"), list(&one.motion.times, &frames).as_bytes())?;
        put(format!("{stem}.csv"), table(one.motion).as_bytes())?;
        put(format!("{stem}_energy.svg"), energies(results.name, one).as_bytes())?;
    }
    if !motions.is_empty() {
        put("strain.svg".into(), strains(results.name, &motions).as_bytes())?;
    }
    Ok(files)
}

/// What moved, displaced by u over the free degrees of freedom, as a .vtu file.
fn frame(results: &Calibrated, one: &Recorded, u: &[f64]) -> Vec<u8> {
    let network = results.network;
    let displacement = one.dofs.unwrap_or(results.dofs).expand(u);
    let moved = network.positions.iter().zip(&displacement).map(|(x, u)| [x[0] + u[0], x[1] + u[1], x[2] + u[2]]);
    let points: Vec<[f64; 3]> = moved.collect();
    let point_fields = vec![Field::vector("displacement", &displacement)];
    if let (true, Body::Mesh(mesh)) = (one.of_body, results.body) {
        let cells = mesh::cells(mesh);
        return vtu::document(&UnstructuredGrid { points, cells, point_fields, cell_fields: vec![] });
    }
    let strain = network.springs.iter().map(|spring| {
        let [a, b] = spring.nodes.map(|node| points[node as usize]);
        let length = (0..3).map(|c| (b[c] - a[c]).powi(2)).sum::<f64>().sqrt();
        100.0 * (length - spring.length) / spring.length
    });
    let strain = Field::scalar("strain", strain.collect());
    vtu::document(&UnstructuredGrid {
        points,
        cells: Cells::equal(vtu::LINE, 2, network.springs.iter().flat_map(|spring| spring.nodes).collect()),
        point_fields,
        cell_fields: vec![strain],
    })
}

/// The text of motion.pvd: files relative to its folder.
fn list(times: &[f64], frames: &[String]) -> String {
    let mut text =
        String::from("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n");
    for (time, file) in times.iter().zip(frames) {
        let _ = writeln!(text, "<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{file}\"/>");
    }
    text + "</Collection>\n</VTKFile>\n"
}

/// The text of motion.csv; every digit that the numbers have.
fn table(motion: &Motion) -> String {
    let mut text = format!("{COLUMNS}\n");
    for ((time, strain), e) in motion.times.iter().zip(&motion.strain).zip(&motion.energies) {
        let Energies { kinetic, elastic, dissipated, work } = e;
        let _ = writeln!(text, "{time:?},{strain:?},{kinetic:?},{elastic:?},{dissipated:?},{work:?}");
    }
    text
}

fn energies(name: &str, one: &Recorded) -> String {
    let curve = |(name, of): (&str, Shown)| {
        let values = one.motion.energies.iter().map(of);
        Curve { name: name.into(), points: one.motion.times.iter().copied().zip(values).collect() }
    };
    let title = format!("{name}: energies, {}", one.legend());
    plot::svg(&Labels { title: &title, time: "time, s", value: "energy, J" }, &ENERGIES.map(curve))
}

/// The global strain of some motions over time, as the text of an SVG file.
pub fn strains(name: &str, motions: &[Recorded]) -> String {
    let curve = |one: &Recorded| Curve {
        name: one.legend(),
        points: one.motion.times.iter().copied().zip(one.motion.strain.iter().copied()).collect(),
    };
    let title = format!("{name}: global strain (4.17)");
    let curves: Vec<Curve> = motions.iter().map(curve).collect();
    plot::svg(
        &Labels { title: &title, time: "time, s", value: "mean change of length of the springs, percent" },
        &curves,
    )
}
