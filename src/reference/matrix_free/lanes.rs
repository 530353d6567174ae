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
//!
//! A [`Kernel`] is compiled once for every kind of registers, and run with the widest that the processor has
//! ([`widest`]).

/// Elements side by side.
pub(super) const LANES: usize = 8;

/// One number for each of the elements.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Lanes(pub [f64; LANES]);

/// No wide registers that we know of.
const PLAIN: u8 = 0;
/// Four numbers in a register, fused multiplication and addition.
const AVX2: u8 = 1;
/// Eight numbers in a register, fused multiplication and addition.
const AVX512: u8 = 2;

impl Lanes {
    /// Zero in all lanes.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// The same number in all lanes.
    #[inline(always)]
    pub fn all(value: f64) -> Self {
        Self([value; LANES])
    }

    /// self + a b.
    #[inline(always)]
    pub fn plus<const REGISTERS: u8>(self, a: Self, b: Self) -> Self {
        #[cfg(target_arch = "x86_64")]
        if REGISTERS != PLAIN {
            // SAFETY: kernels run with these registers only on processors that have them, see `widest`
            return unsafe { registers::fused::<REGISTERS>(self, a, b) };
        }
        Self(std::array::from_fn(|l| self.0[l] + a.0[l] * b.0[l]))
    }

    /// a b.
    #[inline(always)]
    pub fn times<const REGISTERS: u8>(self, b: Self) -> Self {
        #[cfg(target_arch = "x86_64")]
        if REGISTERS != PLAIN {
            // SAFETY: as above
            return unsafe { registers::product::<REGISTERS>(self, b) };
        }
        Self(std::array::from_fn(|l| self.0[l] * b.0[l]))
    }

    /// a + b.
    #[inline(always)]
    pub fn add<const REGISTERS: u8>(self, b: Self) -> Self {
        #[cfg(target_arch = "x86_64")]
        if REGISTERS != PLAIN {
            // SAFETY: as above
            return unsafe { registers::sum::<REGISTERS>(self, b) };
        }
        Self(std::array::from_fn(|l| self.0[l] + b.0[l]))
    }
}

/// The three operations as instructions; the compiler does not find them by itself in loops over eight lanes.
#[cfg(target_arch = "x86_64")]
#[expect(clippy::missing_transmute_annotations, reason = "every transmutation is between Lanes and its registers")]
mod registers {
    use std::arch::x86_64::*;
    use std::mem::transmute;

    use super::{AVX512, Lanes};

    #[inline(always)]
    pub unsafe fn fused<const REGISTERS: u8>(sum: Lanes, a: Lanes, b: Lanes) -> Lanes {
        unsafe {
            if REGISTERS == AVX512 {
                return transmute::<__m512d, Lanes>(_mm512_fmadd_pd(transmute(a), transmute(b), transmute(sum)));
            }
            let ([a, c], [b, d], [s, t]): ([__m256d; 2], [__m256d; 2], [__m256d; 2]) =
                (transmute(a), transmute(b), transmute(sum));
            transmute([_mm256_fmadd_pd(a, b, s), _mm256_fmadd_pd(c, d, t)])
        }
    }

    #[inline(always)]
    pub unsafe fn product<const REGISTERS: u8>(a: Lanes, b: Lanes) -> Lanes {
        unsafe {
            if REGISTERS == AVX512 {
                return transmute::<__m512d, Lanes>(_mm512_mul_pd(transmute(a), transmute(b)));
            }
            let ([a, c], [b, d]): ([__m256d; 2], [__m256d; 2]) = (transmute(a), transmute(b));
            transmute([_mm256_mul_pd(a, b), _mm256_mul_pd(c, d)])
        }
    }

    #[inline(always)]
    pub unsafe fn sum<const REGISTERS: u8>(a: Lanes, b: Lanes) -> Lanes {
        unsafe {
            if REGISTERS == AVX512 {
                return transmute::<__m512d, Lanes>(_mm512_add_pd(transmute(a), transmute(b)));
            }
            let ([a, c], [b, d]): ([__m256d; 2], [__m256d; 2]) = (transmute(a), transmute(b));
            transmute([_mm256_add_pd(a, b), _mm256_add_pd(c, d)])
        }
    }
}

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

/// Work that is compiled once for each kind of registers.
pub(super) trait Kernel {
    /// Does the work; inlined into the functions below.
    fn run<const REGISTERS: u8>(self);
}

/// Runs a kernel with the widest registers of this processor.
pub(super) fn widest(kernel: impl Kernel) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the processor has what the function is compiled for
            return unsafe { with_avx512(kernel) };
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: as above
            return unsafe { with_avx2(kernel) };
        }
    }
    kernel.run::<PLAIN>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn with_avx512(kernel: impl Kernel) {
    kernel.run::<AVX512>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2(kernel: impl Kernel) {
    kernel.run::<AVX2>();
}

#[cfg(test)]
mod tests {
    use super::*;

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
