//! Products and sums of long vectors, on all threads, with one result.
//!
//! A vector is cut in pieces of 32,768 numbers, whatever the number of threads. Every piece has its own sum, kept in
//! 16 partial sums that registers hold side by side, and the sums of the pieces are added in their order: the
//! bits depend on the numbers alone. Loops are compiled for every kind of registers and run with the widest there are;
//! the order of a sum is the same in all.

use rayon::prelude::*;

use crate::lanes::dispatch;

/// Lanes of a sum of products: enough for the widest registers, fixed so that the order of the sum is.
const LANES: usize = 16;

/// Lanes of each of four sums at once.
const FEWER_LANES: usize = 8;

/// Numbers of a piece: a quarter of a megabyte, some microseconds of work.
const PIECE: usize = 32_768;

/// a . b
///
/// # Panics
/// When the lengths differ.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    sum(a, b, |a, b| a * b)
}

/// |a - b|^2
///
/// # Panics
/// When the lengths differ.
pub fn square_of_difference(a: &[f64], b: &[f64]) -> f64 {
    sum(a, b, |a, b| (a - b) * (a - b))
}

/// The sum of something of all pairs of numbers.
#[inline(always)]
fn sum(a: &[f64], b: &[f64], of: impl Fn(f64, f64) -> f64 + Sync) -> f64 {
    assert_eq!(a.len(), b.len(), "vectors of one length");
    if a.len() <= PIECE {
        return sum_of_piece(a, b, &of);
    }
    let sums: Vec<f64> = a.par_chunks(PIECE).zip(b.par_chunks(PIECE)).map(|(a, b)| sum_of_piece(a, b, &of)).collect();
    sums.iter().sum()
}

fn sum_of_piece(a: &[f64], b: &[f64], of: &impl Fn(f64, f64) -> f64) -> f64 {
    dispatch(
        #[inline(always)]
        || sum_in_lanes(a, b, of),
    )
}

#[inline(always)]
fn sum_in_lanes(a: &[f64], b: &[f64], of: &impl Fn(f64, f64) -> f64) -> f64 {
    let mut lanes = [0.0; LANES];
    let (a_blocks, b_blocks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a_blocks.remainder().iter().zip(b_blocks.remainder()).map(|(a, b)| of(*a, *b)).sum();
    for (a, b) in a_blocks.zip(b_blocks) {
        for i in 0..LANES {
            lanes[i] += of(a[i], b[i]);
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// |a|
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// out_j = M_j . x for the columns M_j of a matrix, which stand one after the other.
///
/// # Panics
/// When `matrix` is not one column of the length of x for every number of `out`.
pub fn dots(matrix: &[f64], x: &[f64], out: &mut [f64]) {
    assert_eq!(matrix.len(), x.len() * out.len(), "a column for every product");
    for (columns, out) in matrix.chunks(4 * x.len().max(1)).zip(out.chunks_mut(4)) {
        match out {
            [a, b, c, d] => [*a, *b, *c, *d] = four_dots(columns, x),
            few => columns.chunks_exact(x.len()).zip(few).for_each(|(column, out)| *out = dot(column, x)),
        }
    }
}

/// Four products with one pass over x.
fn four_dots(columns: &[f64], x: &[f64]) -> [f64; 4] {
    let n = x.len();
    let of_piece = |(piece, x): (usize, &[f64])| {
        let columns: [&[f64]; 4] = std::array::from_fn(|j| &columns[j * n + piece * PIECE..][..x.len()]);
        dispatch(
            #[inline(always)]
            || four_dots_of_piece(columns, x),
        )
    };
    if n <= PIECE {
        return of_piece((0, x));
    }
    let sums: Vec<[f64; 4]> = x.par_chunks(PIECE).enumerate().map(of_piece).collect();
    std::array::from_fn(|j| sums.iter().map(|sums| sums[j]).sum())
}

#[inline(always)]
fn four_dots_of_piece(columns: [&[f64]; 4], x: &[f64]) -> [f64; 4] {
    let mut lanes = [[0.0; FEWER_LANES]; 4];
    let (blocks, rest) = x.as_chunks::<FEWER_LANES>();
    let columns = columns.map(|column| column.as_chunks::<FEWER_LANES>());
    for (k, x) in blocks.iter().enumerate() {
        for j in 0..4 {
            let column = &columns[j].0[k];
            for i in 0..FEWER_LANES {
                lanes[j][i] += column[i] * x[i];
            }
        }
    }
    let mut sums = lanes.map(|lanes| lanes.iter().sum::<f64>());
    for (sum, (_, column)) in sums.iter_mut().zip(columns) {
        *sum += column.iter().zip(rest).map(|(a, b)| a * b).sum::<f64>();
    }
    sums
}

/// y += sum_j factors_j M_j.
///
/// # Panics
/// When `matrix` is not one column of the length of y for every factor.
pub fn add_all(factors: &[f64], matrix: &[f64], y: &mut [f64]) {
    assert_eq!(matrix.len(), y.len() * factors.len(), "a column for every factor");
    for (factors, columns) in factors.chunks(4).zip(matrix.chunks(4 * y.len().max(1))) {
        match *factors {
            [a, b, c, d] => add_four([a, b, c, d], columns, y),
            ref few => few.iter().zip(columns.chunks_exact(y.len())).for_each(|(factor, x)| add(*factor, x, y)),
        }
    }
}

/// Four columns with one pass over y.
fn add_four(factors: [f64; 4], columns: &[f64], y: &mut [f64]) {
    let n = y.len();
    let of_piece = |(piece, y): (usize, &mut [f64])| {
        let [a, b, c, d]: [&[f64]; 4] = std::array::from_fn(|j| &columns[j * n + piece * PIECE..][..y.len()]);
        dispatch(
            #[inline(always)]
            || {
                for (i, y) in y.iter_mut().enumerate() {
                    *y += (factors[0] * a[i] + factors[1] * b[i]) + (factors[2] * c[i] + factors[3] * d[i]);
                }
            },
        );
    };
    if n <= PIECE { of_piece((0, y)) } else { y.par_chunks_mut(PIECE).enumerate().for_each(of_piece) }
}

/// y += factor x.
///
/// # Panics
/// When the lengths differ.
pub fn add(factor: f64, x: &[f64], y: &mut [f64]) {
    for_each(x, y, |x, y| *y += factor * x);
}

/// y = x + factor y.
///
/// # Panics
/// When the lengths differ.
pub fn turn(x: &[f64], factor: f64, y: &mut [f64]) {
    for_each(x, y, |x, y| *y = x + factor * *y);
}

/// x *= factor.
pub fn scale(factor: f64, x: &mut [f64]) {
    let piece = |x: &mut [f64]| {
        dispatch(
            #[inline(always)]
            || {
                for x in x.iter_mut() {
                    *x *= factor;
                }
            },
        );
    };
    if x.len() <= PIECE { piece(x) } else { x.par_chunks_mut(PIECE).for_each(piece) }
}

/// Does the same with every pair of numbers.
fn for_each(x: &[f64], y: &mut [f64], update: impl Fn(&f64, &mut f64) + Sync) {
    assert_eq!(x.len(), y.len(), "vectors of one length");
    let piece = |x: &[f64], y: &mut [f64]| {
        dispatch(
            #[inline(always)]
            || {
                for (x, y) in x.iter().zip(y) {
                    update(x, y);
                }
            },
        );
    };
    if x.len() <= PIECE {
        return piece(x, y);
    }
    x.par_chunks(PIECE).zip(y.par_chunks_mut(PIECE)).for_each(|(x, y)| piece(x, y));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bits_do_not_depend_on_the_threads() {
        let n = 3 * PIECE + 5;
        let a: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let b: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).cos()).collect();
        let work = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                let mut y = b.clone();
                let matrix: Vec<f64> = (0..6).flat_map(|j| a.iter().map(move |a| a * (1.0 + j as f64))).collect();
                let mut products = [0.0; 6];
                dots(&matrix, &b, &mut products);
                assert!(products.iter().zip(1..).all(|(p, j)| (p - j as f64 * dot(&a, &b)).abs() < 1e-8));
                add_all(&[0.5, -0.25, 0.5, 0.25, -0.25, -0.25], &matrix, &mut y);
                // 0.5 - 0.5 + 1.5 + 1 - 1.25 - 1.5 of a
                assert!(y.iter().zip(&a).zip(&b).all(|((y, a), b)| (y - b + 0.25 * a).abs() < 1e-14));
                add(0.25, &a, &mut y);
                add(0.7, &a, &mut y);
                turn(&b, -0.2, &mut y);
                scale(1.1, &mut y);
                (dot(&a, &b).to_bits(), norm(&y).to_bits(), products.map(f64::to_bits), y)
            })
        };
        let one = work(1);
        assert!([2, 3, 4].into_iter().all(|threads| work(threads) == one));
        assert_eq!(square_of_difference(&a, &a), 0.0);
        assert!((square_of_difference(&a, &b) - (dot(&a, &a) - 2.0 * dot(&a, &b) + dot(&b, &b))).abs() < 1e-8);
        let exact: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
        assert!((f64::from_bits(one.0) - exact).abs() < 1e-9);
        assert!((one.3[n - 1] - 1.1 * (b[n - 1] - 0.2 * (b[n - 1] + 0.7 * a[n - 1]))).abs() < 1e-15);
    }
}
