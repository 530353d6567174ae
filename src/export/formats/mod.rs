//! A finished run in the formats of other programs: `springfit export DIR --to NAME`.
//!
//! Nothing is computed anew but the matrices, which are the springs' own at rest; so a folder can be brought to another
//! machine and exported there. A format is a line of [`FORMATS`] and a file.

mod csv;
mod matrix_market;
mod network_vtu;
mod sofa;

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::finished::{self, Finished};

pub use matrix_market::{columns, lower_triangle};

/// A format, chosen by its name.
pub struct Format {
    /// The word on the command line.
    pub name: &'static str,
    /// What it writes, in a line.
    pub doc: &'static str,
    write: fn(&Finished, &Path) -> Result<Vec<PathBuf>>,
}

/// All formats.
pub const FORMATS: &[Format] = &[
    Format {
        name: "vtu",
        doc: "network.vtu for ParaView: springs with group, k, c and length; nodes with supports, masses and forces",
        write: network_vtu::write,
    },
    Format { name: "csv", doc: "nodes.csv, springs.csv and groups.csv for tables", write: csv::write },
    Format {
        name: "sofa",
        doc: "springs.scn: a scene of SOFA (from 24.06) with the springs, supports, masses and the first load",
        write: sofa::write,
    },
    Format {
        name: "matrix-market",
        doc: "stiffness.mtx, forces.mtx (a column a load case), mass.mtx and damping.mtx, unknowns.csv which says whose",
        write: matrix_market::write,
    },
];

/// Writes the run in the folder `run` in the format `name` into the folder `out`, and says which files.
///
/// # Errors
/// [`Error::Input`] (`--to`) for a format that is not there; those of [`finished::read`]; a file that cannot be written.
pub fn export(run: &Path, name: &str, out: &Path) -> Result<Vec<PathBuf>> {
    let Some(format) = FORMATS.iter().find(|format| format.name == name) else {
        let names: Vec<&str> = FORMATS.iter().map(|format| format.name).collect();
        let message = format!("there is no format \"{name}\"");
        return Err(Error::input("--to", message, format!("one of {}", names.join(", "))));
    };
    (format.write)(&finished::read(run)?, out)
}
