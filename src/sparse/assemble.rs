//! Assembly: the sum of element matrices in one CSR matrix.
//!
//! K = sum_e P_e^T K_e P_e. Element matrices are computed in parallel, a batch at a time, each worker with its own
//! workspace; the batch is then added in the order of the elements. Every entry of K is therefore one fixed sum, and
//! its bits do not depend on the number of threads. Positions in K are looked up by the workers, so that the serial
//! part is additions only.

use nalgebra_sparse::CsrMatrix;
use rayon::prelude::*;

use crate::error::Result;
use crate::sparse::pattern::Pattern;

/// Elements computed between two serial additions: enough to keep the workers busy, little enough to stay in cache.
const BATCH: usize = 64;

/// A dense element matrix and the unknowns it belongs to.
#[derive(Debug, Default, Clone)]
pub struct ElementMatrix {
    /// Unknown of each row and column; `u32::MAX` where it is held.
    pub dofs: Vec<u32>,
    /// Entries, row-major, `dofs.len()` squared.
    pub values: Vec<f64>,
}

/// An element matrix with the place of every entry in the value array of K.
#[derive(Default)]
struct Placed {
    element: ElementMatrix,
    positions: Vec<usize>,
}

/// Position of an entry that is not assembled (a held row or column).
const NOWHERE: usize = usize::MAX;

/// Assembles `elements` element matrices on `pattern`.
///
/// `workspace` makes what one worker needs; `fill(e, workspace, matrix)` writes the matrix of element e and its dofs.
///
/// # Errors
/// The first error of `fill`, in the order of the elements.
///
/// # Panics
/// When an element couples unknowns that the pattern does not couple.
pub fn assemble<W>(
    pattern: &Pattern,
    elements: usize,
    workspace: impl Fn() -> W + Sync,
    fill: impl Fn(usize, &mut W, &mut ElementMatrix) -> Result<()> + Sync,
) -> Result<CsrMatrix<f64>>
where
    W: Send,
{
    let mut values = vec![0.0; pattern.entries()];
    let mut batch: Vec<Placed> = (0..BATCH.min(elements)).map(|_| Placed::default()).collect();
    let mut workers: Vec<W> = Vec::new();
    let chunk = BATCH.div_ceil(rayon::current_num_threads().max(1)).max(1);
    workers.resize_with(BATCH.div_ceil(chunk), &workspace);
    for first in (0..elements).step_by(BATCH) {
        let count = BATCH.min(elements - first);
        let outcomes: Vec<Result<()>> = batch[..count]
            .par_chunks_mut(chunk)
            .zip(workers.par_iter_mut())
            .enumerate()
            .map(|(c, (part, worker))| {
                part.iter_mut().enumerate().try_for_each(|(i, placed)| {
                    fill(first + c * chunk + i, worker, &mut placed.element)?;
                    place(pattern, placed);
                    Ok(())
                })
            })
            .collect();
        outcomes.into_iter().collect::<Result<()>>()?;
        for placed in &batch[..count] {
            for (&position, &value) in placed.positions.iter().zip(&placed.element.values) {
                if position != NOWHERE {
                    values[position] += value;
                }
            }
        }
    }
    let matrix = CsrMatrix::try_from_pattern_and_values(pattern.as_csr().clone(), values);
    Ok(matrix.expect("one value for each entry of the pattern"))
}

/// Looks up where each entry of an element matrix goes.
fn place(pattern: &Pattern, placed: &mut Placed) {
    let dofs = &placed.element.dofs;
    placed.positions.clear();
    for (i, &row) in dofs.iter().enumerate() {
        if row == u32::MAX {
            placed.positions.extend(std::iter::repeat_n(NOWHERE, dofs.len()));
            continue;
        }
        let start = pattern.offsets()[row as usize];
        // the components of one node have equal rows: their columns were found a row before
        let same = i > 0 && dofs[i - 1] != u32::MAX && pattern.row(dofs[i - 1] as usize) == pattern.row(row as usize);
        if same {
            let previous_start = pattern.offsets()[dofs[i - 1] as usize];
            for j in 0..dofs.len() {
                let before = placed.positions[(i - 1) * dofs.len() + j];
                placed.positions.push(if before == NOWHERE { NOWHERE } else { before - previous_start + start });
            }
            continue;
        }
        for &column in dofs {
            let position = match column {
                u32::MAX => NOWHERE,
                column => pattern
                    .position(row as usize, column as usize)
                    .expect("the pattern couples all unknowns of an element"),
            };
            placed.positions.push(position);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of n unit springs as 2x2 elements, every fourth node held.
    fn chain(n: usize) -> (Pattern, Vec<[u32; 2]>) {
        let mut next = 0;
        let dofs: Vec<u32> = (0..=n)
            .map(|node| {
                if node % 4 == 0 {
                    return u32::MAX;
                }
                next += 1;
                next - 1
            })
            .collect();
        let elements: Vec<[u32; 2]> = dofs.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        (Pattern::from_cliques(next as usize, elements.iter().map(|e| e.as_slice())), elements)
    }

    fn assemble_chain(n: usize) -> CsrMatrix<f64> {
        let (pattern, elements) = chain(n);
        assemble(
            &pattern,
            n,
            || (),
            |e, (), matrix| {
                matrix.dofs = elements[e].to_vec();
                let k = 1.0 / (1.0 + e as f64);
                matrix.values = vec![k, -k, -k, k];
                Ok(())
            },
        )
        .expect("a chain assembles")
    }

    #[test]
    fn a_chain_assembles_with_held_nodes_left_out() {
        let matrix = assemble_chain(4);
        assert_eq!(matrix.nrows(), 3);
        assert_eq!(matrix.values(), [1.5, -0.5, -0.5, 0.5 + 1.0 / 3.0, -1.0 / 3.0, -1.0 / 3.0, 1.0 / 3.0 + 0.25]);
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_threads() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| assemble_chain(1001))
        };
        assert_eq!(run(1).values(), run(3).values());
    }
}
