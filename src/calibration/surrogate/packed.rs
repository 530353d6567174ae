//! Symmetric matrices of a reduced basis: lower triangle, columns one after the other.
//!
//! Column j of an r x r matrix holds rows j..r and begins at j r - j (j - 1) / 2. A weighted sum of such matrices is one
//! pass over contiguous numbers, and the Cholesky factorisation below adds columns to columns. Nothing here allocates.
//! The functions are compiled into their callers, so that a caller compiled for wide registers (`lanes::dispatch`) uses them here
//! too; the order of every sum is the same.

/// Numbers of an r x r triangle.
#[inline(always)]
pub fn len(r: usize) -> usize {
    r * (r + 1) / 2
}

/// Where column j begins.
#[inline(always)]
pub fn start(r: usize, j: usize) -> usize {
    j * (2 * r + 1 - j) / 2
}

/// out += factor * x.
#[inline(always)]
pub fn add(factor: f64, x: &[f64], out: &mut [f64]) {
    for (out, x) in out.iter_mut().zip(x) {
        *out += factor * x;
    }
}

/// out += sum of factors[i] * x_i for four vectors at once: one pass over `out` instead of four.
#[inline(always)]
fn add_four(factors: [f64; 4], x: [&[f64]; 4], out: &mut [f64]) {
    let n = out.len();
    let [a, b, c, d] = x.map(|x| &x[..n]);
    for i in 0..n {
        out[i] += (factors[0] * a[i] + factors[1] * b[i]) + (factors[2] * c[i] + factors[3] * d[i]);
    }
}

/// out = sum over k of `factors[k] x[k]`, where the vectors x stand one after the other.
#[inline(always)]
pub fn combine(factors: &[f64], x: &[f64], out: &mut [f64]) {
    let n = out.len();
    out.fill(0.0);
    let fours = factors.len() / 4 * 4;
    for (factors, x) in factors[..fours].chunks_exact(4).zip(x.chunks_exact(4 * n)) {
        let factors = [factors[0], factors[1], factors[2], factors[3]];
        add_four(factors, [&x[..n], &x[n..2 * n], &x[2 * n..3 * n], &x[3 * n..]], out);
    }
    for (factor, x) in factors[fours..].iter().zip(x[fours * n..].chunks_exact(n)) {
        add(*factor, x, out);
    }
}

/// Sum of products in eight interleaved partial sums, which the processor adds side by side.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        (0..8).for_each(|i| sums[i] += a[i] * b[i]);
    }
    sums.iter().sum::<f64>() + rest
}

/// A = L L^T in place; the column of the first pivot that is not positive, if there is one.
#[inline(always)]
pub fn factor(a: &mut [f64], r: usize) -> Result<(), usize> {
    for j in 0..r {
        let (before, rest) = a.split_at_mut(start(r, j));
        let column = &mut rest[..r - j];
        let source = |k: usize| &before[start(r, k) + j - k..start(r, k + 1)];
        let fours = j / 4 * 4;
        for k in (0..fours).step_by(4) {
            let sources = [source(k), source(k + 1), source(k + 2), source(k + 3)];
            add_four(sources.map(|source| -source[0]), sources, column);
        }
        for k in fours..j {
            add(-source(k)[0], source(k), column);
        }
        if column[0].is_nan() || column[0] <= 0.0 {
            return Err(j);
        }
        let inverse = 1.0 / column[0].sqrt();
        column.iter_mut().for_each(|value| *value *= inverse);
    }
    Ok(())
}

/// L L^T x = b in place.
#[inline(always)]
pub fn solve(l: &[f64], r: usize, x: &mut [f64]) {
    for j in 0..r {
        let column = &l[start(r, j)..start(r, j + 1)];
        let (top, below) = x[j..].split_first_mut().expect("j < r");
        *top /= column[0];
        add(-*top, &column[1..], below);
    }
    for j in (0..r).rev() {
        let column = &l[start(r, j)..start(r, j + 1)];
        x[j] = (x[j] - dot(&column[1..], &x[j + 1..])) / column[0];
    }
}

/// out = A x.
#[inline(always)]
pub fn multiply(a: &[f64], r: usize, x: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for j in 0..r {
        let column = &a[start(r, j)..start(r, j + 1)];
        add(x[j], column, &mut out[j..]);
        out[j] += dot(&column[1..], &x[j + 1..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_matrix_is_factored_and_solved() {
        let r = 13;
        let mut a: Vec<f64> = (0..len(r)).map(|i| (i as f64).sin()).collect();
        (0..r).for_each(|j| a[start(r, j)] += 8.0);
        let x: Vec<f64> = (0..r).map(|i| 1.0 + i as f64).collect();
        let mut b = vec![0.0; r];
        multiply(&a, r, &x, &mut b);
        factor(&mut a, r).expect("dominant");
        solve(&a, r, &mut b);
        assert!(b.iter().zip(&x).all(|(b, x)| (b - x).abs() < 1e-13), "{b:?}");
        a[start(r, 3)] = -1e3;
        assert_eq!(factor(&mut a, r), Err(3));
    }
}
