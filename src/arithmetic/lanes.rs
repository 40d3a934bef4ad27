//! Four doubles at once, with the same bits on every machine.
//!
//! Plain arrays left to the compiler are not good enough for short dependent chains (1.5 to 3 times slower), so there is an explicit
//! vector type for AVX with FMA, and a portable one for everything else.  Each operation is exactly rounded and
//! [`Lanes::mul_add`] is *always* fused: where the processor has no such instruction it is computed in software, slowly but to the same bits.
//!
//! A kernel is written once over [`Lanes`], every function of it `#[inline(always)]`, and compiled twice: the outermost function of the fast
//! build carries `#[target_feature(enable = "avx,fma")]` and is entered only after [`available`] has said yes.

use std::fmt::Debug;

/// Four doubles; lanes 0-1 and 2-3 are pairs, which are halves of the vector.
pub trait Lanes: Copy + Debug + 'static {
    /// True where long kernels are worth unrolling; where each operation is a call, a loop is as fast and compiles in a tenth of the time.
    const UNROLLED: bool;

    /// 0 in every lane.
    const ZERO: Self;
    /// 1 in every lane.
    const ONE: Self;

    /// From an array.
    fn of(lanes: [f64; 4]) -> Self;
    /// As an array.
    fn array(self) -> [f64; 4];
    /// The same number in every lane.
    fn splat(value: f64) -> Self;
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Difference.
    fn sub(self, other: Self) -> Self;
    /// Product.
    fn mul(self, other: Self) -> Self;
    /// Quotient.
    fn div(self, other: Self) -> Self;
    /// Square roots.
    fn sqrt(self) -> Self;
    /// `self · factor + addend`, rounded once.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// `addend - self · factor`, rounded once.
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self;
    /// `[1, 0, 3, 2]`.
    fn swap_pairs(self) -> Self;
    /// `[2, 3, 0, 1]`.
    fn swap_halves(self) -> Self;
    /// Magnitudes.
    fn abs(self) -> Self;
    /// The larger ones; `other` where one is not a number.
    fn max(self, other: Self) -> Self;
    /// True where every lane is at most `bound` in magnitude; false where one is not a number.
    fn are_within(self, bound: f64) -> bool;
    /// The negatives, zeros included.
    fn neg(self) -> Self;
}

/// Plain code, with a software fused multiply-add where the processor lacks one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Portable([f64; 4]);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: fn(f64, f64) -> f64) -> Self {
        Self([f(self.0[0], other.0[0]), f(self.0[1], other.0[1]), f(self.0[2], other.0[2]), f(self.0[3], other.0[3])])
    }
}

/// `a b + c` lane by lane; its four calls kept in one place where the processor cannot be counted on to have the instruction.
#[cfg_attr(all(target_arch = "x86_64", not(target_feature = "fma")), inline(never))]
#[cfg_attr(not(all(target_arch = "x86_64", not(target_feature = "fma"))), inline(always))]
fn fused(a: [f64; 4], b: [f64; 4], c: [f64; 4]) -> [f64; 4] {
    [a[0].mul_add(b[0], c[0]), a[1].mul_add(b[1], c[1]), a[2].mul_add(b[2], c[2]), a[3].mul_add(b[3], c[3])]
}

impl Lanes for Portable {
    const UNROLLED: bool = false;

    const ZERO: Self = Self([0.0; 4]);
    const ONE: Self = Self([1.0; 4]);

    #[inline(always)]
    fn of(lanes: [f64; 4]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    fn array(self) -> [f64; 4] {
        self.0
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(fused(self.0, factor.0, addend.0))
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        self.neg().mul_add(factor, addend)
    }

    #[inline(always)]
    fn swap_pairs(self) -> Self {
        Self([self.0[1], self.0[0], self.0[3], self.0[2]])
    }

    #[inline(always)]
    fn swap_halves(self) -> Self {
        Self([self.0[2], self.0[3], self.0[0], self.0[1]])
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn are_within(self, bound: f64) -> bool {
        self.0.iter().all(|x| x.abs() <= bound)
    }

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

#[cfg(target_arch = "x86_64")]
pub use hardware::{Avx, available};

/// True where [`Avx`] may be used; never, on this architecture.
#[cfg(not(target_arch = "x86_64"))]
pub fn available() -> bool {
    false
}

#[cfg(target_arch = "x86_64")]
mod hardware {
    use super::Lanes;
    use std::arch::x86_64::*;

    /// Four doubles in one register of AVX; values exist only below functions entered after [`available`] has said yes.
    #[derive(Clone, Copy, Debug)]
    pub struct Avx(__m256d);

    /// True where the processor has AVX and FMA.
    pub fn available() -> bool {
        is_x86_feature_detected!("avx") && is_x86_feature_detected!("fma")
    }

    /// The instruction itself.
    ///
    /// A trait's methods cannot carry `#[target_feature]`, so each is entered here.
    macro_rules! instruction {
        ($call:expr) => {{
            // SAFETY: kernels over `Avx` are entered only through functions with `#[target_feature(enable = "avx,fma")]`, after `available`.
            #[allow(unsafe_code)]
            unsafe {
                $call
            }
        }};
    }

    /// The same double in every lane, as a constant.
    const fn constant(value: f64) -> Avx {
        // SAFETY: both types are four doubles without padding, and every pattern of bits is valid in each.
        #[allow(unsafe_code)]
        unsafe {
            std::mem::transmute::<[f64; 4], Avx>([value; 4])
        }
    }

    impl Lanes for Avx {
        const UNROLLED: bool = true;

        const ZERO: Self = constant(0.0);
        const ONE: Self = constant(1.0);

        #[inline(always)]
        fn of(lanes: [f64; 4]) -> Self {
            instruction!(Self(_mm256_loadu_pd(lanes.as_ptr())))
        }

        #[inline(always)]
        fn array(self) -> [f64; 4] {
            let mut lanes = [0.0; 4];
            instruction!(_mm256_storeu_pd(lanes.as_mut_ptr(), self.0));
            lanes
        }

        #[inline(always)]
        fn splat(value: f64) -> Self {
            instruction!(Self(_mm256_set1_pd(value)))
        }

        #[inline(always)]
        fn add(self, other: Self) -> Self {
            instruction!(Self(_mm256_add_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            instruction!(Self(_mm256_sub_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            instruction!(Self(_mm256_mul_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn div(self, other: Self) -> Self {
            instruction!(Self(_mm256_div_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn sqrt(self) -> Self {
            instruction!(Self(_mm256_sqrt_pd(self.0)))
        }

        #[inline(always)]
        fn mul_add(self, factor: Self, addend: Self) -> Self {
            instruction!(Self(_mm256_fmadd_pd(self.0, factor.0, addend.0)))
        }

        #[inline(always)]
        fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
            instruction!(Self(_mm256_fnmadd_pd(self.0, factor.0, addend.0)))
        }

        #[inline(always)]
        fn swap_pairs(self) -> Self {
            instruction!(Self(_mm256_permute_pd::<0b0101>(self.0)))
        }

        #[inline(always)]
        fn swap_halves(self) -> Self {
            instruction!(Self(_mm256_permute2f128_pd::<0x01>(self.0, self.0)))
        }

        #[inline(always)]
        fn abs(self) -> Self {
            instruction!(Self(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            instruction!(Self(_mm256_max_pd(self.0, other.0)))
        }

        #[inline(always)]
        fn are_within(self, bound: f64) -> bool {
            instruction!(_mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.abs().0, _mm256_set1_pd(bound))) == 0b1111)
        }

        #[inline(always)]
        fn neg(self) -> Self {
            instruction!(Self(_mm256_xor_pd(_mm256_set1_pd(-0.0), self.0)))
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every operation on the same operands, as bits.
    #[inline(always)]
    fn everything<L: Lanes>(a: [f64; 4], b: [f64; 4], c: [f64; 4]) -> Vec<[u64; 4]> {
        let (x, y, z) = (L::of(a), L::of(b), L::of(c));
        [
            x.add(y),
            x.sub(y),
            x.mul(y),
            x.div(y),
            x.abs().sqrt(),
            x.neg(),
            x.mul_add(y, z),
            x.neg_mul_add(y, z),
            x.swap_pairs(),
            x.swap_halves(),
            x.abs(),
            x.max(y),
            L::splat(a[0]),
            L::splat(f64::from(u8::from(x.are_within(500.0)))),
            L::ZERO,
            L::ONE,
        ]
        .iter()
        .map(|lanes| lanes.array().map(f64::to_bits))
        .collect()
    }

    #[target_feature(enable = "avx,fma")]
    fn in_hardware(a: [f64; 4], b: [f64; 4], c: [f64; 4]) -> Vec<[u64; 4]> {
        everything::<Avx>(a, b, c)
    }

    proptest! {
        #[test]
        fn hardware_and_portable_lanes_have_the_same_bits(
            a in prop::array::uniform4(-1e3..1e3f64),
            b in prop::array::uniform4(-1e3..1e3f64),
            c in prop::array::uniform4(-1e6..1e6f64),
        ) {
            if available() {
                // SAFETY: the processor has been asked.
                #[allow(unsafe_code)]
                let fast = unsafe { in_hardware(a, b, c) };
                prop_assert_eq!(fast, everything::<Portable>(a, b, c));
            }
        }
    }

    #[test]
    fn operations_do_what_they_say() {
        let x = Portable::of([1.0, -2.0, 3.0, 4.0]);
        assert_eq!(x.swap_pairs().array(), [-2.0, 1.0, 4.0, 3.0]);
        assert_eq!(x.swap_halves().array(), [3.0, 4.0, 1.0, -2.0]);
        assert_eq!(x.abs().array(), [1.0, 2.0, 3.0, 4.0]);
        assert!(x.are_within(4.0) && !x.are_within(3.0) && !Portable::splat(f64::NAN).are_within(1.0));
        assert_eq!(x.neg_mul_add(x, x).array(), [0.0, -6.0, -6.0, -12.0]);
        let nearly = 1.0 + f64::EPSILON;
        assert_eq!(
            Portable::splat(nearly).mul_add(Portable::splat(nearly), Portable::splat(-1.0 - 2.0 * f64::EPSILON)).array()[0],
            f64::EPSILON.powi(2)
        );
    }
}
