//! y = A x for a matrix on a [`Pattern`], rows in parallel.
//!
//! Every row is one sum in the order of its columns, so the bits do not depend on the number of threads.

use rayon::prelude::*;

use crate::sparse::pattern::Pattern;

/// Rows that one worker takes at a time; smaller matrices are multiplied without workers.
const ROWS: usize = 4096;

/// y = A x; `values` in the order of the pattern.
///
/// # Panics
/// When a slice has not the length that the pattern asks for.
pub fn multiply(pattern: &Pattern, values: &[f64], x: &[f64], y: &mut [f64]) {
    assert_eq!([x.len(), y.len()], [pattern.len(); 2], "one entry for every unknown");
    let rows = |first: usize, y: &mut [f64]| {
        for (row, y) in (first..).zip(y) {
            *y = row_product(pattern, values, x, row);
        }
    };
    if y.len() <= ROWS {
        rows(0, y);
    } else {
        y.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, y)| rows(chunk * ROWS, y));
    }
}

/// Entry `row` of A x.
fn row_product(pattern: &Pattern, values: &[f64], x: &[f64], row: usize) -> f64 {
    let entries = pattern.offsets()[row]..pattern.offsets()[row + 1];
    let pairs = pattern.row(row).iter().zip(&values[entries]);
    pairs.fold(0.0, |sum, (&column, value)| sum + value * x[column])
}
