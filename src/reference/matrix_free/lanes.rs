//! Eight elements side by side.
//!
//! The small tensors of an element (p + 1 numbers along each direction) are too short for wide registers. So eight
//! neighbours along the last direction are taken together, one in each lane, and every operation on an element tensor
//! is done on [`Lanes`]. The only operation that costs time is the contraction of one index with a small matrix T,
//!
//! ```text
//! out[b][o][a] (+)= sum_i T[o][i] in[b][i][a],   b < before, o < rows, i < columns, a < after.
//! ```
//!
//! T is a number ([`contract`]), or differs from lane to lane in the last direction ([`contract_last`]).

use crate::lanes::Lanes;

/// Which tensor a contraction runs over: `before` x (the contracted index) x `after`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Around {
    /// Product of the extents before the contracted index.
    pub before: usize,
    /// Product of the extents after it.
    pub after: usize,
}

/// Contracts one index with a matrix of `rows` x (`table.len() / rows`) numbers; adds to `out` when `ADD`.
#[inline(always)]
pub(super) fn contract<const REGISTERS: u8, const ADD: bool>(
    table: &[f64],
    rows: usize,
    around: Around,
    input: &[Lanes],
    out: &mut [Lanes],
) {
    let columns = table.len() / rows;
    match (rows, columns) {
        (3, 3) => contract_sized::<REGISTERS, ADD>(table, 3, 3, around, input, out),
        (2, 2) => contract_sized::<REGISTERS, ADD>(table, 2, 2, around, input, out),
        (4, 4) => contract_sized::<REGISTERS, ADD>(table, 4, 4, around, input, out),
        _ => contract_sized::<REGISTERS, ADD>(table, rows, columns, around, input, out),
    }
}

/// [`contract`] for sizes that the compiler may know.
#[inline(always)]
fn contract_sized<const REGISTERS: u8, const ADD: bool>(
    table: &[f64],
    rows: usize,
    columns: usize,
    Around { before, after }: Around,
    input: &[Lanes],
    out: &mut [Lanes],
) {
    let table = &table[..rows * columns];
    let blocks = input[..before * columns * after].chunks_exact(columns * after);
    for (from, to) in blocks.zip(out[..before * rows * after].chunks_exact_mut(rows * after)) {
        for (o, row) in to.chunks_exact_mut(after).enumerate() {
            for (a, value) in row.iter_mut().enumerate() {
                let mut sum = if ADD { *value } else { Lanes::ZERO };
                for i in 0..columns {
                    sum = sum.plus::<REGISTERS>(Lanes::all(table[o * columns + i]), from[i * after + a]);
                }
                *value = sum;
            }
        }
    }
}

/// Contracts the last index with a matrix of `rows` x (`table.len() / rows`) that differs from lane to lane.
#[inline(always)]
pub(super) fn contract_last<const REGISTERS: u8>(
    table: &[Lanes],
    rows: usize,
    before: usize,
    input: &[Lanes],
    out: &mut [Lanes],
) {
    let columns = table.len() / rows;
    match (rows, columns) {
        (3, 3) => contract_last_sized::<REGISTERS>(table, 3, 3, before, input, out),
        _ => contract_last_sized::<REGISTERS>(table, rows, columns, before, input, out),
    }
}

#[inline(always)]
fn contract_last_sized<const REGISTERS: u8>(
    table: &[Lanes],
    rows: usize,
    columns: usize,
    before: usize,
    input: &[Lanes],
    out: &mut [Lanes],
) {
    let table = &table[..rows * columns];
    let blocks = input[..before * columns].chunks_exact(columns);
    for (from, to) in blocks.zip(out[..before * rows].chunks_exact_mut(rows)) {
        for (o, value) in to.iter_mut().enumerate() {
            let mut sum = Lanes::ZERO;
            for i in 0..columns {
                sum = sum.plus::<REGISTERS>(table[o * columns + i], from[i]);
            }
            *value = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LANES, PLAIN};

    #[test]
    fn a_contraction_is_a_matrix_product_along_one_index() {
        let lanes = |i: usize| Lanes(std::array::from_fn(|l| (1 + i * LANES + l) as f64));
        let input: Vec<Lanes> = (0..2 * 3 * 2).map(lanes).collect();
        let table: Vec<f64> = (0..4 * 3).map(|i| (i as f64).sin()).collect();
        let mut out = vec![Lanes::all(1.0); 2 * 4 * 2];
        contract::<PLAIN, true>(&table, 4, Around { before: 2, after: 2 }, &input, &mut out);
        let wide: Vec<Lanes> = table.iter().map(|&t| Lanes::all(t)).collect();
        let mut last = vec![Lanes::ZERO; 4 * 4];
        contract_last::<PLAIN>(&wide, 4, 4, &input, &mut last);
        for b in 0..2 {
            for o in 0..4 {
                for a in 0..2 {
                    let sum: f64 = (0..3).map(|i| table[o * 3 + i] * input[(b * 3 + i) * 2 + a].0[5]).sum();
                    assert!((out[(b * 4 + o) * 2 + a].0[5] - 1.0 - sum).abs() < 1e-12);
                }
            }
        }
        let sum: f64 = (0..3).map(|i| table[3 + i] * input[6 + i].0[7]).sum();
        assert!((last[2 * 4 + 1].0[7] - sum).abs() < 1e-12);
    }
}
