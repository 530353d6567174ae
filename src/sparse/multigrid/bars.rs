//! The product of a network of springs on a grid, without a matrix.
//!
//! A spring between the nodes a and b = a + o pulls along D = x_b - x_a with
//!
//! ```text
//! f_a = -c D (D . (u_b - u_a)),    f_b = -f_a of the other sign,      c = k / |D|^2
//! ```
//!
//! so (K u)_a is the sum over the 26 neighbours of a. Positions and one number c for each of the 13 forward offsets are
//! all that is stored: 16 numbers a node instead of the 243 of a matrix, for in three dimensions the product is bound by
//! memory. A node reads the springs that it owns and those of its backward neighbours, so it alone writes its sum; the
//! order of that sum is fixed and the bits do not depend on threads.
//!
//! In f64 it is the operator of the conjugate gradients, in f32 that of the smoother on the finest level.

use super::padded::{Padded, SPARE, components};

/// Springs on a padded grid; positions (3 components) and coefficients (one component for each forward offset).
#[derive(Debug, Clone)]
pub struct Bars<T> {
    /// Positions, three components.
    pub positions: Vec<T>,
    /// c of the spring from a place along each forward offset, 0 where there is none.
    pub coefficients: Vec<T>,
}

macro_rules! product {
    ($real:ty, $lanes:literal) => {
        impl Bars<$real> {
            /// out = K u on the places from `start`; `u` is a whole vector, `out` a piece of one. Held components are
            /// not looked at.
            pub fn product(&self, padded: &Padded, u: &[$real], start: usize, out: &mut [&mut [$real]; 3]) {
                pulp::Arch::new().dispatch(
                    #[inline(always)]
                    || self.product_in_place(padded, u, start, out),
                );
            }

            #[inline(always)]
            fn product_in_place(&self, padded: &Padded, u: &[$real], start: usize, out: &mut [&mut [$real]; 3]) {
                const { assert!($lanes <= SPARE) };
                let (x, u) = (components(&self.positions), components(u));
                let (len, count) = (padded.len(), out[0].len());
                for first in (0..count).step_by($lanes) {
                    let p = start + first;
                    let (xp, up) = (x.map(|x| take(x, p)), u.map(|u| take(u, p)));
                    let mut sum = [[0.0; $lanes]; 3];
                    for (o, &offset) in padded.forward().iter().enumerate() {
                        let (step, c) = (padded.step(offset), &self.coefficients[o * len..(o + 1) * len]);
                        for (q, c) in [(p + step, take(c, p)), (p - step, take(c, p - step))] {
                            let (xq, uq) = (x.map(|x| take(x, q)), u.map(|u| take(u, q)));
                            for l in 0..$lanes {
                                let d = [xp[0][l] - xq[0][l], xp[1][l] - xq[1][l], xp[2][l] - xq[2][l]];
                                let e = [up[0][l] - uq[0][l], up[1][l] - uq[1][l], up[2][l] - uq[2][l]];
                                let pull = c[l] * (d[0] * e[0] + d[1] * e[1] + d[2] * e[2]);
                                sum[0][l] += pull * d[0];
                                sum[1][l] += pull * d[1];
                                sum[2][l] += pull * d[2];
                            }
                        }
                    }
                    let last = $lanes.min(count - first);
                    for (out, sum) in out.iter_mut().zip(&sum) {
                        out[first..first + last].copy_from_slice(&sum[..last]);
                    }
                }
                /// A register full of numbers.
                #[inline(always)]
                fn take(v: &[$real], p: usize) -> &[$real; $lanes] {
                    v[p..p + $lanes].first_chunk().expect("as long as a register")
                }
            }
        }
    };
}

product!(f64, 8);
product!(f32, 16);

impl Bars<f32> {
    /// The diagonal blocks sum_s c D D^T on the places from `start`: `straight` takes xx, yy, zz, `mixed` xy, xz, yz.
    pub fn diagonal(&self, padded: &Padded, start: usize, straight: &mut [&mut [f32]; 3], mixed: &mut [&mut [f32]; 3]) {
        let (len, count) = (padded.len(), straight[0].len());
        let x = components(&self.positions);
        straight.iter_mut().for_each(|block| block.fill(0.0));
        mixed.iter_mut().for_each(|block| block.fill(0.0));
        for (o, &offset) in padded.forward().iter().enumerate() {
            let step = padded.step(offset);
            // the springs that the places own, then those of their backward neighbours
            for tail in [start, start - step] {
                let (c, head) = (&self.coefficients[o * len + tail..][..count], tail + step);
                let (tail, head) = (x.map(|x| &x[tail..][..count]), x.map(|x| &x[head..][..count]));
                for p in 0..count {
                    let d: [f32; 3] = std::array::from_fn(|a| head[a][p] - tail[a][p]);
                    for (a, b) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                        straight[a][p] += c[p] * d[a] * d[a];
                        mixed[a][p] += c[p] * d[b.0] * d[b.1];
                    }
                }
            }
        }
    }
}
