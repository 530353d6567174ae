//! The measured systems as Matrix Market files, so that other solvers can be timed on the very same numbers.
//!
//! Three files for a cube of n^3 control points: `cube_n.mtx`, the lower triangle of K(phi) ("coordinate real
//! symmetric", in the order of the unknowns, structural zeros included, every digit that f64 has); `cube_n_rhs.mtx`, the forces
//! ("array"); `cube_n_order.txt`, our elimination order, one unknown (from 0) a line, the first eliminated first.

use std::fmt::Write;
use std::path::Path;

use crate::error::Result;
use crate::export::write;
use crate::sparse::cholesky::Factor;

use super::cube::Cube;

/// Writes the files of one cube into a folder.
///
/// # Errors
/// [`crate::error::Error::File`] with the file that cannot be written, or where the pattern is too large.
pub fn save(cube: &Cube, folder: &Path) -> Result<()> {
    let name = format!("cube_{}", cube.size);
    let (_, symbolic) = cube.assembled()?;
    write::whole(&folder.join(format!("{name}.mtx")), lower_triangle(cube)?.as_bytes())?;
    let n = cube.forces.len();
    let mut text = format!("%%MatrixMarket matrix array real general\n{n} 1\n");
    for force in &cube.forces {
        let _ = writeln!(text, "{force:e}");
    }
    write::whole(&folder.join(format!("{name}_rhs.mtx")), text.as_bytes())?;
    let order: String = symbolic.order().iter().map(|unknown| format!("{unknown}\n")).collect();
    write::whole(&folder.join(format!("{name}_order.txt")), order.as_bytes())
}

/// K(phi) as text.
fn lower_triangle(cube: &Cube) -> Result<String> {
    let (stiffness, symbolic) = cube.assembled()?;
    let mut factor = Factor::new(symbolic.clone());
    stiffness.assemble_into(&cube.phi, factor.values_mut());
    let (n, entries) = (symbolic.len(), symbolic.lower_rows().len());
    let mut text = format!("%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {entries}\n");
    let values = factor.values_mut();
    for (&column, ends) in symbolic.order().iter().zip(symbolic.lower_starts().windows(2)) {
        let entries = ends[0] as usize..ends[1] as usize;
        for (&row, value) in symbolic.lower_rows()[entries.clone()].iter().zip(&values[entries]) {
            let row = symbolic.order()[row as usize];
            let _ = writeln!(text, "{} {} {value:e}", row.max(column) + 1, row.min(column) + 1);
        }
    }
    Ok(text)
}
