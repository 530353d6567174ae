//! One grid of the hierarchy and what is done on it: products, the diagonal, Chebyshev smoothing.
//!
//! The smoother is the polynomial of the fourth kind of degree 2 on the inverse 3 x 3 diagonal blocks D (J. Lottes,
//! Numer. Linear Algebra Appl. 30, 2023). With lambda >= the largest eigenvalue of D^-1 A and r = b - A x,
//!
//! ```text
//! z_1 = 4/3 D^-1 r_0 / lambda,                 x += z_1,   r_1 = r_0 - A z_1
//! z_2 = 1/5 z_1 + 12/5 D^-1 r_1 / lambda,      x += z_2,   r_2 = r_1 - A z_2
//! ```
//!
//! It needs no lower end of the spectrum and is the same polynomial before and after the coarse grid, so the V-cycle is
//! symmetric. For springs lambda = 2 is exact: every spring joins two nodes, A_s <= 2 diag(A_s).

use rayon::prelude::*;

use super::bars::Bars;
use super::blocks::Blocks;
use super::padded::{Held, Padded, Piece, columns, components, for_each_strip, pieces};

/// Places that one task of the diagonal of springs serves; fixed, though no bit depends on it.
const PIECE: usize = 2048;

/// Places of a strip of springs: what a strip of all columns reads of them stays in the cache, 13 coefficients a place.
pub const STRIP_OF_BARS: usize = 512;

/// Places of a strip of blocks, 126 numbers a place.
const STRIP_OF_BLOCKS: usize = 256;

/// Steps of the power iteration for lambda, and the factor on what it finds, since it finds too little.
const POWER_STEPS: usize = 8;
const POWER_SAFETY: f32 = 1.05;

/// First step: weight of D^-1 r.
pub const FIRST: f32 = 4.0 / 3.0;

/// Second step: weights of z_1 and of D^-1 r.
pub const SECOND: (f32, f32) = (0.2, 2.4);

/// A as it is stored on a grid.
#[derive(Debug, Clone)]
pub enum Operator {
    /// The finest grid: springs.
    Bars(Bars<f32>),
    /// Coarser grids.
    Blocks(Blocks),
}

/// One grid with its vectors.
#[derive(Debug, Clone)]
pub struct Level {
    /// Layout of the vectors.
    pub padded: Padded,
    /// A.
    pub operator: Operator,
    /// Bits of the free components of every place.
    pub free: Vec<u8>,
    /// The held components.
    pub held: Held,
    /// Inverse diagonal blocks: xx, yy, zz, then xy, xz, yz; zero where held.
    pub inverse: [Vec<f32>; 2],
    /// An upper bound of the eigenvalues of D^-1 A.
    pub lambda: f32,
    /// The solution; this and the vectors below have as many columns as were asked for at once.
    pub x: Vec<f32>,
    /// The residual; the right-hand side at the start.
    pub r: Vec<f32>,
    /// Corrections of two steps.
    pub z: [Vec<f32>; 2],
}

impl Level {
    /// A grid with an operator whose numbers come later.
    pub fn new(padded: Padded, operator: Operator, free: Vec<u8>) -> Self {
        let vector = || vec![0.0; 3 * padded.len()];
        Self {
            held: Held::new(&padded, &free),
            inverse: [vector(), vector()],
            lambda: 2.0,
            x: vector(),
            r: vector(),
            z: [vector(), vector()],
            padded,
            operator,
            free,
        }
    }

    /// Makes room for more columns.
    pub fn make_room(&mut self, columns: usize) {
        let length = 3 * self.padded.len() * columns;
        let [first, second] = &mut self.z;
        for vectors in [&mut self.x, &mut self.r, first, second] {
            if vectors.len() < length {
                vectors.resize(length, 0.0);
            }
        }
    }

    /// Places that one task of the diagonal serves.
    fn piece(&self) -> usize {
        match self.operator {
            Operator::Bars(_) => PIECE,
            Operator::Blocks(_) => self.padded.plane(),
        }
    }

    /// Places of a strip.
    fn strip(&self) -> usize {
        match self.operator {
            Operator::Bars(_) => STRIP_OF_BARS,
            Operator::Blocks(_) => STRIP_OF_BLOCKS,
        }
    }

    /// Inverts the diagonal blocks and bounds the eigenvalues, after new numbers of A.
    pub fn prepare(&mut self) {
        self.invert_diagonal();
        self.lambda = match self.operator {
            Operator::Bars(_) => 2.0,
            Operator::Blocks(_) => self.largest_eigenvalue(),
        };
    }

    fn invert_diagonal(&mut self) {
        let (padded, operator, free, size) = (&self.padded, &self.operator, &self.free, self.piece());
        let [straight, mixed] = &mut self.inverse;
        pieces(padded, straight, size).zip(pieces(padded, mixed, size)).enumerate().for_each(
            |(i, (mut straight, mut mixed))| {
                let start = padded.base() + i * size;
                match operator {
                    Operator::Bars(bars) => bars.diagonal(padded, start, &mut straight, &mut mixed),
                    Operator::Blocks(blocks) => blocks.diagonal(i, &mut straight, &mut mixed),
                }
                for p in 0..straight[0].len() {
                    let block = [&straight[0], &straight[1], &straight[2], &mixed[0], &mixed[1], &mixed[2]];
                    let inverse = inverse_of_free(block.map(|block| f64::from(block[p])), free[start + p]);
                    for a in 0..3 {
                        (straight[a][p], mixed[a][p]) = (inverse[a] as f32, inverse[3 + a] as f32);
                    }
                }
            },
        );
    }

    /// The largest eigenvalue of D^-1 A by the power method, enlarged.
    fn largest_eigenvalue(&mut self) -> f32 {
        let n = 3 * self.padded.len();
        for (i, x) in self.z[0][..n].iter_mut().enumerate() {
            // any vector with all wave lengths in it, the same for ever
            *x = ((i.wrapping_mul(2_654_435_761) >> 7 & 1023) as f32 / 1023.0) - 0.5;
        }
        let (padded, held, free) = (&self.padded, &self.held, &self.free);
        clear_outside(padded, free, &mut self.z[0][..n]);
        pieces(padded, &mut self.z[0][..n], padded.len()).for_each(|mut piece| held.clear(padded.base(), &mut piece));
        let mut largest = 1.0;
        for _ in 0..POWER_STEPS {
            let before = norm(&self.z[0][..n]);
            self.r[..n].fill(0.0);
            self.descend::<1>(0, 0.0, -1.0);
            largest = norm(&self.z[1][..n]) / before;
            let scale = 1.0 / norm(&self.z[1][..n]).max(f32::MIN_POSITIVE);
            self.z[1][..n].iter_mut().for_each(|z| *z *= scale);
            self.z.swap(0, 1);
        }
        // eight nodes meet in a cell, so eight bounds it whatever happens
        if largest.is_finite() { (POWER_SAFETY * largest).clamp(1.0, 8.0) } else { 8.0 }
    }

    /// x = z_0 = weight D^-1 r.
    pub fn start<const COLUMNS: usize>(&mut self, weight: f32) {
        let (padded, inverse, size) = (&self.padded, &self.inverse, self.strip());
        let r = columns(&self.r, 3 * padded.len()).map(components);
        let [z, _] = &mut self.z;
        for_each_strip(padded, [z, &mut self.x], size, |start, [mut z, mut x]: [Piece<f32, COLUMNS>; 2]| {
            let count = z[0][0].len();
            z.iter_mut().flatten().for_each(|z| z.fill(0.0));
            let r = r.map(|r| r.map(|r| &r[start..start + count]));
            combine(inverse, start, 0.0, weight, r, r, &mut z);
            x.iter_mut().flatten().zip(z.iter().flatten()).for_each(|(x, z)| x.copy_from_slice(z));
        });
    }

    /// r -= A z_from and z_to = keep z_from + weight D^-1 r.
    pub fn descend<const COLUMNS: usize>(&mut self, from: usize, keep: f32, weight: f32) {
        let (padded, inverse, held, size) = (&self.padded, &self.inverse, &self.held, self.strip());
        let [first, second] = &mut self.z;
        let (old, new) = if from == 0 { (&*first, second) } else { (&*second, first) };
        let (operator, old) = (&self.operator, columns(old, 3 * padded.len()));
        for_each_strip(padded, [new, &mut self.r], size, |start, [mut z, mut r]: [Piece<f32, COLUMNS>; 2]| {
            let count = z[0][0].len();
            match operator {
                Operator::Bars(bars) => {
                    z.iter_mut().zip(old).for_each(|(z, old)| bars.product(padded, old, start, z));
                }
                Operator::Blocks(blocks) => blocks.product(old, start, &mut z),
            }
            for (r, z) in r.iter_mut().flatten().zip(z.iter().flatten()) {
                r.iter_mut().zip(z.iter()).for_each(|(r, z)| *r -= z);
            }
            r.iter_mut().for_each(|r| held.clear(start, r));
            if keep != 0.0 || weight != 0.0 {
                let old = old.map(|old| components(old).map(|old| &old[start..start + count]));
                let r = r.each_ref().map(|r| r.each_ref().map(|r| &**r));
                combine(inverse, start, keep, weight, r, old, &mut z);
            }
        });
    }

    /// x += z.
    pub fn advance<const COLUMNS: usize>(&mut self, which: usize) {
        let (padded, size) = (&self.padded, self.strip());
        let z = columns::<_, COLUMNS>(&self.z[which], 3 * padded.len()).map(components);
        for_each_strip(padded, [&mut self.x], size, |start, [x]: [Piece<f32, COLUMNS>; 1]| {
            for (x, z) in x.into_iter().flatten().zip(z.iter().flatten()) {
                x.iter_mut().zip(&z[start..]).for_each(|(x, z)| *x += z);
            }
        });
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let operator = match &self.operator {
            Operator::Bars(bars) => 4 * (bars.positions.len() + bars.coefficients.len()),
            Operator::Blocks(blocks) => blocks.bytes(),
        };
        operator + 4 * (2 * self.inverse[0].len() + 4 * self.x.len()) + self.free.len() + self.held.bytes()
    }
}

/// z = keep old + weight D^-1 r on a piece of some columns.
fn combine<const COLUMNS: usize>(
    inverse: &[Vec<f32>; 2],
    start: usize,
    keep: f32,
    weight: f32,
    r: [[&[f32]; 3]; COLUMNS],
    old: [[&[f32]; 3]; COLUMNS],
    z: &mut Piece<f32, COLUMNS>,
) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            let count = z[0][0].len();
            let d: [&[f32]; 6] = std::array::from_fn(|e| &components(&inverse[e / 3])[e % 3][start..start + count]);
            for ((z, r), old) in z.iter_mut().zip(r).zip(old) {
                let r = r.map(|r| &r[..count]);
                for ((out, old), [a, b, c]) in z.iter_mut().zip(old).zip([[0, 3, 4], [3, 1, 5], [4, 5, 2]]) {
                    let out = &mut out[..count];
                    for p in 0..count {
                        out[p] = weight * (d[a][p] * r[0][p] + d[b][p] * r[1][p] + d[c][p] * r[2][p]);
                    }
                    if keep != 0.0 {
                        out.iter_mut().zip(old).for_each(|(out, old)| *out += keep * old);
                    }
                }
            }
        },
    );
}

/// Zeros at the places that are no node.
fn clear_outside(padded: &Padded, free: &[u8], v: &mut [f32]) {
    for component in v.chunks_exact_mut(padded.len()) {
        component.iter_mut().zip(free).filter(|(_, free)| **free == 0).for_each(|(v, _)| *v = 0.0);
    }
}

fn norm(v: &[f32]) -> f32 {
    v.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt() as f32
}

/// The inverse of the free part of a symmetric 3 x 3 block (xx, yy, zz, xy, xz, yz), zero elsewhere. A part that is not
/// positive definite gives the inverse of its positive diagonal.
fn inverse_of_free(block: [f64; 6], free: u8) -> [f64; 6] {
    let on = [0, 1, 2].map(|c| free & (1 << c) != 0);
    let both = |a: usize, b: usize, value: f64| if on[a] && on[b] { value } else { 0.0 };
    let diagonal = [0, 1, 2].map(|c| if on[c] { block[c] } else { 1.0 });
    let (xy, xz, yz) = (both(0, 1, block[3]), both(0, 2, block[4]), both(1, 2, block[5]));
    let [xx, yy, zz] = diagonal;
    let minors = [yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy];
    let cofactor = [xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz];
    let determinant = xx * minors[0] + xy * cofactor[0] + xz * cofactor[1];
    let definite = diagonal.iter().all(|d| *d > 0.0) && minors[2] > 1e-6 * xx * yy && determinant > 1e-6 * xx * yy * zz;
    let inverse = match definite {
        true => [minors[0], minors[1], minors[2], cofactor[0], cofactor[1], cofactor[2]].map(|m| m / determinant),
        false => {
            let [x, y, z] = diagonal.map(|d| if d > 0.0 { 1.0 / d } else { 0.0 });
            [x, y, z, 0.0, 0.0, 0.0]
        }
    };
    let [x, y, z, a, b, c] = inverse;
    [both(0, 0, x), both(1, 1, y), both(2, 2, z), both(0, 1, a), both(0, 2, b), both(1, 2, c)]
}
