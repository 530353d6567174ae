//! Symmetric matrices of a reduced basis: lower triangle, columns one after the other.
//!
//! Column j of an r x r matrix holds rows j..r and begins at j r - j (j - 1) / 2. A weighted sum of such matrices is one
//! pass over contiguous numbers, and the Cholesky factorisation below adds columns to columns. Nothing here allocates.

/// Numbers of an r x r triangle.
pub fn len(r: usize) -> usize {
    r * (r + 1) / 2
}

/// Where column j begins.
pub fn start(r: usize, j: usize) -> usize {
    j * (2 * r + 1 - j) / 2
}

/// out += factor * x.
pub fn add(factor: f64, x: &[f64], out: &mut [f64]) {
    for (out, x) in out.iter_mut().zip(x) {
        *out += factor * x;
    }
}

/// A = L L^T in place; the column of the first pivot that is not positive, if there is one.
pub fn factor(a: &mut [f64], r: usize) -> Result<(), usize> {
    for j in 0..r {
        let (before, rest) = a.split_at_mut(start(r, j));
        let column = &mut rest[..r - j];
        for k in 0..j {
            let source = &before[start(r, k) + j - k..start(r, k + 1)];
            add(-source[0], source, column);
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
pub fn solve(l: &[f64], r: usize, x: &mut [f64]) {
    for j in 0..r {
        let column = &l[start(r, j)..start(r, j + 1)];
        let (top, below) = x[j..].split_first_mut().expect("j < r");
        *top /= column[0];
        add(-*top, &column[1..], below);
    }
    for j in (0..r).rev() {
        let column = &l[start(r, j)..start(r, j + 1)];
        let sum: f64 = column[1..].iter().zip(&x[j + 1..]).map(|(l, x)| l * x).sum();
        x[j] = (x[j] - sum) / column[0];
    }
}

/// out = A x.
pub fn multiply(a: &[f64], r: usize, x: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for j in 0..r {
        let column = &a[start(r, j)..start(r, j + 1)];
        add(x[j], column, &mut out[j..]);
        out[j] += column[1..].iter().zip(&x[j + 1..]).map(|(a, x)| a * x).sum::<f64>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_matrix_is_factored_and_solved() {
        let r = 7;
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
