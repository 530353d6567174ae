//! Eight numbers side by side, in the widest registers of the processor.
//!
//! Loops that do the same to every element, node or spring take eight of them at once, one in each lane, and every
//! operation is one on [`Lanes`]. A [`Kernel`] is compiled once for every kind of registers, and run with the widest that
//! the processor has ([`widest`]); there are always eight lanes, so what is stored does not depend on the machine.

/// Numbers side by side.
pub(crate) const LANES: usize = 8;

/// Eight numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Lanes(pub [f64; LANES]);

/// No wide registers that we know of.
pub(crate) const PLAIN: u8 = 0;
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

    /// a - b.
    #[inline(always)]
    pub fn minus<const REGISTERS: u8>(self, b: Self) -> Self {
        #[cfg(target_arch = "x86_64")]
        if REGISTERS != PLAIN {
            // SAFETY: as above
            return unsafe { registers::difference::<REGISTERS>(self, b) };
        }
        Self(std::array::from_fn(|l| self.0[l] - b.0[l]))
    }

    /// self - a b.
    #[inline(always)]
    pub fn less<const REGISTERS: u8>(self, a: Self, b: Self) -> Self {
        #[cfg(target_arch = "x86_64")]
        if REGISTERS != PLAIN {
            // SAFETY: as above
            return unsafe { registers::fused_less::<REGISTERS>(self, a, b) };
        }
        Self(std::array::from_fn(|l| self.0[l] - a.0[l] * b.0[l]))
    }

    /// 1 / sqrt(self) to 2 units in the last place, for numbers from zero on; those below 2.2e-308 are taken for that.
    ///
    /// A root and a quotient take 30 to 60 cycles for eight numbers, and nothing overlaps them. With the widest registers
    /// there is an estimate r of 14 bits in a few cycles. With the error e = 1 - a r^2 of its square, the root wanted is
    /// r (1 - e)^(-1/2) = r (1 + e/2 + 3/8 e^2 + 5/16 e^3 + ...), and what is left out is below 2^-53.
    #[inline(always)]
    pub fn inverse_root<const REGISTERS: u8>(self) -> Self {
        #[cfg(target_arch = "x86_64")]
        if REGISTERS != PLAIN {
            // SAFETY: as above
            return unsafe { registers::inverse_root::<REGISTERS>(self) };
        }
        Self(self.0.map(|a| 1.0 / a.max(f64::MIN_POSITIVE).sqrt()))
    }
}

/// The operations as instructions; the compiler does not find them by itself in loops over eight lanes.
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

    #[inline(always)]
    pub unsafe fn difference<const REGISTERS: u8>(a: Lanes, b: Lanes) -> Lanes {
        unsafe {
            if REGISTERS == AVX512 {
                return transmute::<__m512d, Lanes>(_mm512_sub_pd(transmute(a), transmute(b)));
            }
            let ([a, c], [b, d]): ([__m256d; 2], [__m256d; 2]) = (transmute(a), transmute(b));
            transmute([_mm256_sub_pd(a, b), _mm256_sub_pd(c, d)])
        }
    }

    #[inline(always)]
    pub unsafe fn fused_less<const REGISTERS: u8>(from: Lanes, a: Lanes, b: Lanes) -> Lanes {
        unsafe {
            if REGISTERS == AVX512 {
                return transmute::<__m512d, Lanes>(_mm512_fnmadd_pd(transmute(a), transmute(b), transmute(from)));
            }
            let ([a, c], [b, d], [s, t]): ([__m256d; 2], [__m256d; 2], [__m256d; 2]) =
                (transmute(a), transmute(b), transmute(from));
            transmute([_mm256_fnmadd_pd(a, b, s), _mm256_fnmadd_pd(c, d, t)])
        }
    }

    #[inline(always)]
    pub unsafe fn inverse_root<const REGISTERS: u8>(a: Lanes) -> Lanes {
        unsafe {
            if REGISTERS == AVX512 {
                let a = _mm512_max_pd(transmute(a), _mm512_set1_pd(f64::MIN_POSITIVE));
                let r = _mm512_rsqrt14_pd(a);
                let e = _mm512_fnmadd_pd(_mm512_mul_pd(a, r), r, _mm512_set1_pd(1.0));
                let cubic = _mm512_fmadd_pd(e, _mm512_set1_pd(0.3125), _mm512_set1_pd(0.375));
                let series = _mm512_fmadd_pd(cubic, e, _mm512_set1_pd(0.5));
                return transmute::<__m512d, Lanes>(_mm512_fmadd_pd(_mm512_mul_pd(r, e), series, r));
            }
            let (least, one) = (_mm256_set1_pd(f64::MIN_POSITIVE), _mm256_set1_pd(1.0));
            let [a, b]: [__m256d; 2] = transmute(a);
            let (a, b) = (_mm256_sqrt_pd(_mm256_max_pd(a, least)), _mm256_sqrt_pd(_mm256_max_pd(b, least)));
            transmute([_mm256_div_pd(one, a), _mm256_div_pd(one, b)])
        }
    }
}

/// Work that is compiled once for each kind of registers.
pub(crate) trait Kernel {
    /// Does the work; inlined into the functions below.
    fn run<const REGISTERS: u8>(self);
}

/// Runs a kernel with the widest registers of this processor.
pub(crate) fn widest(kernel: impl Kernel) {
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

/// Runs plain loops with the widest registers of this machine: whatever is inlined into `work` is compiled for each kind. The
/// closure has to be marked `#[inline(always)]`. It is taken as `FnOnce` here because one that is handed to
/// `pulp::Arch::dispatch` as it is may be called through a shim that is compiled for no wide registers at all (measured: half
/// the speed).
#[inline(always)]
pub(crate) fn dispatch<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Roots<'a>(&'a [f64], &'a mut Vec<f64>);

    impl Kernel for Roots<'_> {
        fn run<const REGISTERS: u8>(self) {
            for eight in self.0.chunks_exact(LANES) {
                let lanes = Lanes(eight.try_into().expect("eight"));
                self.1.extend(lanes.inverse_root::<REGISTERS>().0);
            }
        }
    }

    #[test]
    fn an_inverse_root_is_right_to_two_units_in_the_last_place() {
        // mantissas over two powers of two (the estimate is a table over them) at exponents from end to end
        let exponents = [-1022, -600, -1, 0, 1, 52, 600, 1021];
        let mantissas = (0..4096).map(|i| 1.0 + i as f64 / 2048.0 + 1e-7 * (i as f64).sin().abs());
        let of_all = |m: f64| exponents.map(|exponent: i32| m * 2.0_f64.powi(exponent));
        let numbers: Vec<f64> = mantissas.flat_map(of_all).collect();
        let (mut found, mut plain) = (Vec::new(), Vec::new());
        widest(Roots(&numbers, &mut found));
        Roots(&numbers, &mut plain).run::<PLAIN>();
        for ((a, r), plain) in numbers.iter().zip(&found).zip(&plain) {
            // the plain formula rounds twice, so it is within one unit itself
            assert!((r - plain).abs() <= 2.0 * f64::EPSILON * plain, "{a}: {r} {plain}");
        }
    }

    #[test]
    fn an_inverse_root_of_nothing_is_a_number() {
        let mut found = Vec::new();
        widest(Roots(&[0.0; LANES], &mut found));
        assert!(found.iter().all(|r| r.is_finite() && *r > 1e150), "{found:?}");
    }
}
