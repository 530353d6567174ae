//! The largest eigenvalue of a symmetric operator, by Lanczos's method with thick restarts.
//!
//! The basis V grows by the residual of its best pair (theta, V s), the direction of Lanczos's next vector:
//!
//! ```text
//! T = V^T A V,    T s = theta s,    r = A V s - theta V s,    v_next = r made orthogonal to V
//! ```
//!
//! When the basis is full, its best few pairs become the new basis. theta never exceeds the largest eigenvalue, and errs by
//! the square of the residual: |r| <= 1e-8 theta leaves about 1e-16 over the relative gap to the next eigenvalue.
//! (A vector that is orthogonal to the one sought would not find it: whoever needs a bound certifies it, see
//! [`super::stability`].)

use nalgebra_sparse::na::{DMatrix, SymmetricEigen};

use crate::dense::dot;
use crate::rng::Stream;

/// Vectors of a full basis, and those that a restart keeps.
const BASIS: usize = 32;
const KEPT: usize = 8;

/// |r| / theta at which a pair is found.
const TOLERANCE: f64 = 1e-8;

/// Products with A after which the pair is taken as it is.
const PRODUCTS: usize = 2000;

/// An eigenvalue and its vector of length 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// theta.
    pub value: f64,
    /// V s.
    pub vector: Vec<f64>,
}

/// A vector without a structure, for the start: the same for every run.
pub fn seed_vector(n: usize) -> Vec<f64> {
    let mut stream = Stream::new(0x5eed, 0, 0);
    (0..n).map(|_| stream.normal()).collect()
}

/// The basis and its image under A.
struct Basis {
    vectors: Vec<Vec<f64>>,
    images: Vec<Vec<f64>>,
    /// V^T A V.
    projected: DMatrix<f64>,
}

impl Basis {
    /// Adds a vector of length 1 that is orthogonal to the basis.
    fn add(&mut self, vector: Vec<f64>, image: Vec<f64>) {
        let size = self.vectors.len();
        self.vectors.push(vector);
        self.images.push(image);
        for (i, v) in self.vectors.iter().enumerate() {
            let entry = dot(v, &self.images[size]);
            (self.projected[(i, size)], self.projected[(size, i)]) = (entry, entry);
        }
    }

    /// The pairs of the projected operator, the largest first: values, and one column of s each.
    fn pairs(&self) -> (Vec<f64>, DMatrix<f64>) {
        let size = self.vectors.len();
        let found = SymmetricEigen::new(self.projected.view((0, 0), (size, size)).into_owned());
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&i, &j| found.eigenvalues[j].total_cmp(&found.eigenvalues[i]));
        let values = order.iter().map(|&i| found.eigenvalues[i]).collect();
        (values, found.eigenvectors.select_columns(&order))
    }

    /// Column `pair` of X s for X = V or A V.
    fn combine(of: &[Vec<f64>], s: &DMatrix<f64>, pair: usize) -> Vec<f64> {
        let mut sum = vec![0.0; of[0].len()];
        for (i, vector) in of.iter().enumerate() {
            let factor = s[(i, pair)];
            sum.iter_mut().zip(vector).for_each(|(sum, x)| *sum += factor * x);
        }
        sum
    }

    /// Keeps the best pairs only.
    fn restart(&mut self, s: &DMatrix<f64>) {
        let keep = |of: &[Vec<f64>]| (0..KEPT).map(|pair| Self::combine(of, s, pair)).collect();
        let (vectors, images): (Vec<_>, Vec<_>) = (keep(&self.vectors), keep(&self.images));
        (self.vectors, self.images) = (Vec::new(), Vec::new());
        vectors.into_iter().zip(images).for_each(|(vector, image)| self.add(vector, image));
    }

    /// Makes a vector orthogonal to the basis and of length 1; false when nothing is left of it.
    fn orthogonalise(&self, vector: &mut [f64]) -> bool {
        for _ in 0..2 {
            let before = dot(vector, vector).sqrt();
            for v in &self.vectors {
                let overlap = dot(v, vector);
                vector.iter_mut().zip(v).for_each(|(x, v)| *x -= overlap * v);
            }
            let length = dot(vector, vector).sqrt();
            if length.is_nan() || length <= 1e-14 * before || length == 0.0 {
                return false;
            }
            vector.iter_mut().for_each(|x| *x /= length);
        }
        true
    }
}

/// The largest eigenpair of the symmetric operator `apply(x, out)`, searched from `start`.
pub fn largest(apply: &mut dyn FnMut(&[f64], &mut [f64]), start: &[f64]) -> Pair {
    let mut basis = Basis { vectors: vec![], images: vec![], projected: DMatrix::zeros(BASIS, BASIS) };
    let mut next = start.to_vec();
    let mut products = 0;
    while basis.orthogonalise(&mut next) {
        let mut image = vec![0.0; next.len()];
        apply(&next, &mut image);
        products += 1;
        basis.add(next, image);
        let (values, s) = basis.pairs();
        let vector = Basis::combine(&basis.vectors, &s, 0);
        next = Basis::combine(&basis.images, &s, 0);
        next.iter_mut().zip(&vector).for_each(|(r, x)| *r -= values[0] * x);
        let residual = dot(&next, &next).sqrt();
        if residual <= TOLERANCE * values[0].abs() || products >= PRODUCTS || basis.vectors.len() == start.len() {
            return Pair { value: values[0], vector };
        }
        if basis.vectors.len() == BASIS {
            basis.restart(&s);
        }
    }
    // the start spans a space that the operator does not leave
    match basis.vectors.is_empty() {
        true => Pair { value: 0.0, vector: start.to_vec() },
        false => {
            let (values, s) = basis.pairs();
            Pair { value: values[0], vector: Basis::combine(&basis.vectors, &s, 0) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_eigenvalue_of_a_chain_is_found_to_rounding() {
        // 2 - 2 cos(pi j / (n + 1)): neighbours at the top are as near as eigenvalues of a fine mesh get
        for n in [1, 2, 7, 40, 400] {
            let mut chain = |x: &[f64], y: &mut [f64]| {
                for i in 0..n {
                    let side = |j: Option<&f64>| j.copied().unwrap_or(0.0);
                    y[i] = 2.0 * x[i] - side(i.checked_sub(1).map(|j| &x[j])) - side(x.get(i + 1));
                }
            };
            let exact = 2.0 - 2.0 * (std::f64::consts::PI * n as f64 / (n as f64 + 1.0)).cos();
            let found = largest(&mut chain, &seed_vector(n)).value;
            assert!((found - exact).abs() < 1e-12 * exact, "{n}: {found} {exact}");
        }
    }
}
