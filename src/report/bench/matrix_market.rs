//! The measured systems as Matrix Market files, so that other solvers can be timed on the very same numbers.
//!
//! Three files for a cube of n^3 control points: `cube_n.mtx`, the lower triangle of K(phi) ("coordinate real
//! symmetric", in the order of the unknowns, structural zeros included, every digit that f64 has); `cube_n_rhs.mtx`, the forces
//! ("array"); `cube_n_order.txt`, our elimination order, one unknown (from 0) a line, the first eliminated first.

use std::path::Path;

use crate::error::Result;
use crate::export::formats;
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
    let forces = formats::columns(std::slice::from_ref(&cube.forces));
    write::whole(&folder.join(format!("{name}_rhs.mtx")), forces.as_bytes())?;
    let order: String = symbolic.order().iter().map(|unknown| format!("{unknown}\n")).collect();
    write::whole(&folder.join(format!("{name}_order.txt")), order.as_bytes())
}

/// K(phi) as text.
fn lower_triangle(cube: &Cube) -> Result<String> {
    let (stiffness, symbolic) = cube.assembled()?;
    let mut factor = Factor::new(symbolic.clone());
    stiffness.assemble_into(&cube.phi, factor.values_mut());
    let values = factor.values_mut();
    let column_of = |(&column, ends): (&u32, &[u32])| {
        let entries = ends[0] as usize..ends[1] as usize;
        let rows = symbolic.lower_rows()[entries.clone()].iter().map(|&row| symbolic.order()[row as usize]);
        let of_row = move |(row, &value): (u32, &f64)| (row.max(column) as usize, row.min(column) as usize, value);
        rows.zip(&values[entries]).map(of_row).collect::<Vec<_>>()
    };
    let entries = symbolic.order().iter().zip(symbolic.lower_starts().windows(2)).flat_map(column_of);
    Ok(formats::lower_triangle(symbolic.len(), symbolic.lower_rows().len(), entries))
}
