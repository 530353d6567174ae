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

use pulp::{Simd, WithSimd};

use super::padded::{Padded, SPARE, components};

/// Springs on a padded grid; positions (3 components) and coefficients (one component for each forward offset).
#[derive(Debug, Clone)]
pub struct Bars<T> {
    /// Positions, three components.
    pub positions: Vec<T>,
    /// c of the spring from a place along each forward offset, 0 where there is none.
    pub coefficients: Vec<T>,
}

/// A product to be computed on a piece.
struct Product<'a, 'b, T> {
    bars: &'a Bars<T>,
    padded: &'a Padded,
    u: &'a [T],
    start: usize,
    out: &'a mut [&'b mut [T]; 3],
}

macro_rules! product {
    ($real:ident, $reals:ident, $lanes:ident, $view:ident, $store:ident, $minus:ident, $times:ident, $plus:ident, $all:ident) => {
        impl Bars<$real> {
            /// out = K u on the places from `start`; `u` is a whole vector, `out` a piece of one. Held components are
            /// not looked at.
            pub fn product(&self, padded: &Padded, u: &[$real], start: usize, out: &mut [&mut [$real]; 3]) {
                pulp::Arch::new().dispatch(Product { bars: self, padded, u, start, out });
            }
        }

        impl WithSimd for Product<'_, '_, $real> {
            type Output = ();

            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) {
                const { assert!(S::$lanes <= SPARE) };
                let Self { bars, padded, u, start, out } = self;
                let (x, u) = (components(&bars.positions), components(u));
                let (len, count) = (padded.len(), out[0].len());
                for first in (0..count).step_by(S::$lanes) {
                    let p = start + first;
                    let (xp, up) = (three::<S>(&x, p), three::<S>(&u, p));
                    let mut sum = [simd.$all(0.0); 3];
                    for (o, &offset) in padded.forward().iter().enumerate() {
                        let (step, c) = (padded.step(offset), &bars.coefficients[o * len..(o + 1) * len]);
                        for (q, c) in [(p + step, take::<S>(c, p)), (p - step, take::<S>(c, p - step))] {
                            let d = difference(simd, xp, three::<S>(&x, q));
                            let e = difference(simd, up, three::<S>(&u, q));
                            let along = simd.$plus(d[2], e[2], simd.$plus(d[1], e[1], simd.$times(d[0], e[0])));
                            let pull = simd.$times(c, along);
                            for a in 0..3 {
                                sum[a] = simd.$plus(pull, d[a], sum[a]);
                            }
                        }
                    }
                    let last = S::$lanes.min(count - first);
                    for a in 0..3 {
                        simd.$store(&mut out[a][first..first + last], sum[a]);
                    }
                }
                // what computes is inlined always: outside of the dispatched function it would not have the wide registers
                /// A register full of numbers.
                #[inline(always)]
                fn take<S: Simd>(v: &[$real], p: usize) -> S::$reals {
                    S::$view(&v[p..p + S::$lanes]).0[0]
                }
                /// The same of three components.
                #[inline(always)]
                fn three<S: Simd>(v: &[&[$real]; 3], p: usize) -> [S::$reals; 3] {
                    [take::<S>(v[0], p), take::<S>(v[1], p), take::<S>(v[2], p)]
                }
                #[inline(always)]
                fn difference<S: Simd>(simd: S, a: [S::$reals; 3], b: [S::$reals; 3]) -> [S::$reals; 3] {
                    [simd.$minus(a[0], b[0]), simd.$minus(a[1], b[1]), simd.$minus(a[2], b[2])]
                }
            }
        }
    };
}

product!(f64, f64s, F64_LANES, as_simd_f64s, partial_store_f64s, sub_f64s, mul_f64s, mul_add_e_f64s, splat_f64s);
product!(f32, f32s, F32_LANES, as_simd_f32s, partial_store_f32s, sub_f32s, mul_f32s, mul_add_e_f32s, splat_f32s);

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
