//! The direct solve on the coarsest grid: dense Cholesky in f64 of at most a few hundred unknowns.

use super::blocks::Blocks;
use super::padded::Padded;

/// A pivot below this part of its diagonal entry is zero up to the rounding of the f32 blocks: its unknown is held.
const LOOSE: f64 = 1e-6;

/// L of A = L L^T, row-major, and where the unknowns lie in a vector.
#[derive(Debug, Clone)]
pub struct Coarsest {
    factor: Vec<f64>,
    places: Vec<u32>,
    solution: Vec<f64>,
}

impl Coarsest {
    /// Allocates for the free components of a grid; bits in `free`.
    pub fn new(padded: &Padded, free: &[u8]) -> Self {
        let [n0, n1, n2] = padded.extents();
        let mut places = Vec::new();
        for node in 0..padded.nodes() {
            let p = padded.at([node / (n1 * n2) % n0, node / n2 % n1, node % n2]);
            places.extend((0..3).filter(|c| free[p] & (1 << c) != 0).map(|c| (c * padded.len() + p) as u32));
        }
        Self { factor: vec![0.0; places.len().pow(2)], solution: vec![0.0; places.len()], places }
    }

    /// Factors the operator.
    pub fn factor(&mut self, padded: &Padded, blocks: &Blocks) {
        let n = self.places.len();
        self.load(padded, blocks);
        for i in 0..n {
            let (above, row) = self.factor.split_at_mut(i * n);
            for j in 0..i {
                let other = &above[j * n..j * n + n];
                let product: f64 = row[..j].iter().zip(other).map(|(a, b)| a * b).sum();
                // a held unknown has an infinite pivot, and so no part in any other
                row[j] = (row[j] - product) / other[j];
            }
            let square: f64 = row[..i].iter().map(|a| a * a).sum();
            let pivot = row[i] - square;
            row[i] = if pivot > LOOSE * row[i] { pivot.sqrt() } else { f64::INFINITY };
        }
    }

    /// Writes the lower triangle.
    fn load(&mut self, padded: &Padded, blocks: &Blocks) {
        let (n, len) = (self.places.len(), padded.len());
        self.factor.fill(0.0);
        let mut number = vec![usize::MAX; 3 * len];
        self.places.iter().enumerate().for_each(|(i, &place)| number[place as usize] = i);
        let [n0, n1, n2] = padded.extents();
        for node in 0..padded.nodes() {
            let index = [node / (n1 * n2) % n0, node / n2 % n1, node % n2];
            let p = padded.at(index);
            for o in 0..=padded.forward().len() {
                let q = if o == 0 { p } else { p + padded.step(padded.forward()[o - 1]) };
                for (entry, value) in blocks.block(index, o).into_iter().enumerate() {
                    let (i, j) = (number[entry / 3 * len + p], number[entry % 3 * len + q]);
                    if i != usize::MAX && j != usize::MAX {
                        self.factor[i.max(j) * n + i.min(j)] = f64::from(value);
                    }
                }
            }
        }
    }

    /// x = A^-1 r, both whole vectors.
    pub fn solve(&mut self, r: &[f32], x: &mut [f32]) {
        let n = self.places.len();
        for (i, &place) in self.places.iter().enumerate() {
            let row = &self.factor[i * n..i * n + n];
            let known: f64 = row[..i].iter().zip(&self.solution).map(|(l, y)| l * y).sum();
            self.solution[i] = (f64::from(r[place as usize]) - known) / row[i];
        }
        for i in (0..n).rev() {
            let (before, rest) = self.solution.split_at_mut(i);
            rest[0] /= self.factor[i * n + i];
            for (y, l) in before.iter_mut().zip(&self.factor[i * n..]) {
                *y -= l * rest[0];
            }
        }
        for (&place, y) in self.places.iter().zip(&self.solution) {
            x[place as usize] = *y as f32;
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        8 * (self.factor.len() + self.solution.len()) + 4 * self.places.len()
    }
}
