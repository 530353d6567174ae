//! Products and sums of long vectors, on all threads, with one result.
//!
//! A vector is cut in pieces of 32,768 numbers, whatever the number of threads. Every piece has its own sum, kept in
//! 16 partial sums that registers hold side by side, and the sums of the pieces are added in their order: the
//! bits depend on the numbers alone.

use rayon::prelude::*;

/// Lanes of a sum of products: enough for the widest registers, fixed so that the order of the sum is.
const LANES: usize = 16;

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

#[inline(always)]
fn sum_of_piece(a: &[f64], b: &[f64], of: &impl Fn(f64, f64) -> f64) -> f64 {
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
    let piece = |x: &mut [f64]| x.iter_mut().for_each(|x| *x *= factor);
    if x.len() <= PIECE { piece(x) } else { x.par_chunks_mut(PIECE).for_each(piece) }
}

/// Does the same with every pair of numbers.
fn for_each(x: &[f64], y: &mut [f64], update: impl Fn(&f64, &mut f64) + Sync) {
    assert_eq!(x.len(), y.len(), "vectors of one length");
    let piece = |x: &[f64], y: &mut [f64]| x.iter().zip(y).for_each(|(x, y)| update(x, y));
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
                add(0.7, &a, &mut y);
                turn(&b, -0.2, &mut y);
                scale(1.1, &mut y);
                (dot(&a, &b).to_bits(), norm(&y).to_bits(), y)
            })
        };
        let one = work(1);
        assert!([2, 3, 4].into_iter().all(|threads| work(threads) == one));
        assert_eq!(square_of_difference(&a, &a), 0.0);
        assert!((square_of_difference(&a, &b) - (dot(&a, &a) - 2.0 * dot(&a, &b) + dot(&b, &b))).abs() < 1e-8);
        let exact: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
        assert!((f64::from_bits(one.0) - exact).abs() < 1e-9);
        assert!((one.2[n - 1] - 1.1 * (b[n - 1] - 0.2 * (b[n - 1] + 0.7 * a[n - 1]))).abs() < 1e-15);
    }
}
