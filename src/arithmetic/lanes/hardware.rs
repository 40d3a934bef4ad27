//! The one place of the crate with `unsafe` in it: instructions special to the processor, and the door to
//! code compiled for them.
//!
//! [`Hardware`] is the proof that the processor has them: it is made only after it was asked.  What is
//! `unsafe` here rests on this alone:
//!
//! - [`Hardware::run`] enters a function compiled for AVX and FMA, [`WideHardware::run`] one compiled for
//!   AVX-512;
//! - the operations of [`Avx`] and [`Avx512`] are such instructions.  Values of them are made and used below
//!   `run`, or by somebody who holds a `Hardware`.

#![allow(unsafe_code)]

use super::wide::{EightLanes, SlotTask, Slots, WideCode, each_of_eight};
use super::{Arithmetic, Code, Lanes, Signed, each_of_four};
use std::arch::x86_64::*;

/// The proof that the processor has AVX and FMA.
#[derive(Clone, Copy, Debug)]
pub struct Hardware(());

/// Four doubles in one register of AVX.
#[derive(Clone, Copy, Debug)]
pub struct Avx(__m256d);

/// The widest vectors there is code for.
pub type Vector = Avx;

impl Hardware {
    /// Asks the processor.
    #[inline]
    pub fn ask() -> Option<Self> {
        (is_x86_feature_detected!("avx") && is_x86_feature_detected!("fma")).then_some(Self(()))
    }

    /// Runs code in the processor's vectors.
    #[inline(always)]
    pub fn run<C: Code>(self, code: C) -> C::Output {
        // SAFETY: the processor was asked for AVX and FMA before this proof of them was made.
        unsafe { compiled(code) }
    }

    /// Runs code over eight lanes in pairs of vectors.
    #[inline(always)]
    pub fn run_in_pairs<C: WideCode>(self, code: C) -> C::Output {
        // SAFETY: as above.
        unsafe { compiled_in_pairs(code) }
    }
}

/// The proof that the processor has AVX-512 (the foundation).
#[derive(Clone, Copy, Debug)]
pub struct WideHardware(());

/// Eight doubles in one register of AVX-512.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(__m512d);

impl WideHardware {
    /// Asks the processor.
    #[inline]
    pub fn ask() -> Option<Self> {
        let has_four = Hardware::ask().is_some();
        (has_four && is_x86_feature_detected!("avx512f")).then_some(Self(()))
    }

    /// Runs code in vectors of eight.
    #[inline(always)]
    pub fn run<C: WideCode>(self, code: C) -> C::Output {
        // SAFETY: the processor was asked for AVX, FMA and AVX-512 before this proof of them was made.
        unsafe { compiled_wide(code) }
    }
}

/// Code compiled for AVX-512.
#[target_feature(enable = "avx,fma,avx512f")]
#[inline]
fn compiled_wide<C: WideCode>(code: C) -> C::Output {
    code.run::<Avx512>()
}

/// Code over eight lanes compiled for AVX and FMA.
#[target_feature(enable = "avx,fma")]
#[inline]
fn compiled_in_pairs<C: WideCode>(code: C) -> C::Output {
    code.run::<[Avx; 2]>()
}

/// Code compiled for AVX and FMA.
#[target_feature(enable = "avx,fma")]
fn compiled<C: Code>(code: C) -> C::Output {
    code.run::<Avx>()
}

/// The same, never made a part of what calls it.
#[target_feature(enable = "avx,fma")]
#[inline(never)]
fn compiled_apart<C: Code>(code: C) -> C::Output {
    code.run::<Avx>()
}

/// A task compiled for AVX and FMA.
#[target_feature(enable = "avx,fma")]
#[inline]
fn performed<T: SlotTask>(task: T) -> T::Output {
    task.perform()
}

/// A task compiled for AVX-512.
#[target_feature(enable = "avx,fma,avx512f")]
#[inline]
fn performed_wide<T: SlotTask>(task: T) -> T::Output {
    task.perform()
}

/// The instruction itself.
///
/// A trait's methods cannot carry `#[target_feature]`, so each is entered here.
macro_rules! instruction {
    ($call:expr) => {{
        // SAFETY: values of `Avx` are made and used by code that runs below `Hardware::run`, or whose owner
        // holds a `Hardware`.
        unsafe { $call }
    }};
}

/// The same double in every lane, as a constant.
const fn constant(value: f64) -> Avx {
    // SAFETY: both types are four doubles without padding, and every pattern of bits is valid in each.
    unsafe { std::mem::transmute::<[f64; 4], Avx>([value; 4]) }
}

/// The same double in every one of eight lanes.
const fn constant_of_eight(value: f64) -> Avx512 {
    // SAFETY: both types are eight doubles without padding, and every pattern of bits is valid in each.
    unsafe { std::mem::transmute::<[f64; 8], Avx512>([value; 8]) }
}

impl Arithmetic for Avx {
    const ZERO: Self = constant(0.0);
    const ONE: Self = constant(1.0);

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
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        instruction!(Self(_mm256_fmadd_pd(self.0, factor.0, addend.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        instruction!(Self(_mm256_fnmadd_pd(self.0, factor.0, addend.0)))
    }
}

impl Signed for Avx {
    #[inline(always)]
    fn sqrt(self) -> Self {
        instruction!(Self(_mm256_sqrt_pd(self.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        instruction!(Self(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
    }

    #[inline(always)]
    fn neg(self) -> Self {
        instruction!(Self(_mm256_xor_pd(_mm256_set1_pd(-0.0), self.0)))
    }

    #[inline(always)]
    fn are_within(self, bound: f64) -> bool {
        instruction!(
            _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.abs().0, _mm256_set1_pd(bound))) == 0b1111
        )
    }

    fn each<const N: usize>(lanes: [Self; N], f: fn([f64; N]) -> [f64; N]) -> [Self; N] {
        each_of_four(lanes, f)
    }
}

impl Lanes for Avx {
    const UNROLLED: bool = true;

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
    fn swap_pairs(self) -> Self {
        instruction!(Self(_mm256_permute_pd::<0b0101>(self.0)))
    }

    #[inline(always)]
    fn swap_halves(self) -> Self {
        instruction!(Self(_mm256_permute2f128_pd::<0x01>(self.0, self.0)))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        instruction!(Self(_mm256_max_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn apart<C: Code>(code: C) -> C::Output {
        instruction!(compiled_apart(code))
    }

    #[inline(always)]
    fn perform<T: SlotTask>(task: T) -> T::Output {
        instruction!(performed(task))
    }
}

impl Arithmetic for Avx512 {
    const ZERO: Self = constant_of_eight(0.0);
    const ONE: Self = constant_of_eight(1.0);

    #[inline(always)]
    fn splat(value: f64) -> Self {
        instruction!(Self(_mm512_set1_pd(value)))
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        instruction!(Self(_mm512_add_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        instruction!(Self(_mm512_sub_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        instruction!(Self(_mm512_mul_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        instruction!(Self(_mm512_div_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        instruction!(Self(_mm512_fmadd_pd(self.0, factor.0, addend.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        instruction!(Self(_mm512_fnmadd_pd(self.0, factor.0, addend.0)))
    }
}

impl Signed for Avx512 {
    #[inline(always)]
    fn sqrt(self) -> Self {
        instruction!(Self(_mm512_sqrt_pd(self.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        instruction!(Self(_mm512_abs_pd(self.0)))
    }

    #[inline(always)]
    fn neg(self) -> Self {
        instruction!(Self(_mm512_castsi512_pd(_mm512_xor_si512(
            _mm512_castpd_si512(_mm512_set1_pd(-0.0)),
            _mm512_castpd_si512(self.0)
        ))))
    }

    #[inline(always)]
    fn are_within(self, bound: f64) -> bool {
        instruction!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.abs().0, _mm512_set1_pd(bound)) == 0xff)
    }

    fn each<const N: usize>(lanes: [Self; N], f: fn([f64; N]) -> [f64; N]) -> [Self; N] {
        each_of_eight(lanes, f)
    }
}

impl Slots for Avx512 {
    type Half = Avx;

    const COUNT: usize = 8;
    const UNROLLED: bool = true;

    #[inline(always)]
    fn of(lanes: &[f64; 8]) -> Self {
        instruction!(Self(_mm512_loadu_pd(lanes.as_ptr())))
    }

    #[inline(always)]
    fn array(self) -> [f64; 8] {
        let mut lanes = [0.0; 8];
        instruction!(_mm512_storeu_pd(lanes.as_mut_ptr(), self.0));
        lanes
    }

    #[inline(always)]
    fn perform<T: SlotTask>(task: T) -> T::Output {
        instruction!(performed_wide(task))
    }
}

impl EightLanes for Avx512 {
    const VECTORS: usize = 1;

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        instruction!(Self(_mm512_max_pd(_mm512_abs_pd(self.0), other.0)))
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        instruction!(Self(_mm512_min_pd(self.0, other.0)))
    }

    /// From its halves: the leading one counts 2³² times, and the sum of both is rounded once.
    #[inline(always)]
    fn bits_above(self, other: Self) -> Self {
        instruction!({
            let bits = _mm512_sub_epi64(_mm512_castpd_si512(self.0), _mm512_castpd_si512(other.0));
            let high = _mm512_cvtepi32_pd(_mm512_cvtepi64_epi32(_mm512_srai_epi64::<32>(bits)));
            let low = _mm512_cvtepu32_pd(_mm512_cvtepi64_epi32(bits));
            Self(_mm512_fmadd_pd(high, _mm512_set1_pd(4_294_967_296.0), low))
        })
    }

    #[inline(always)]
    fn floor(self) -> Self {
        instruction!(Self(_mm512_roundscale_pd::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)))
    }

    #[inline(always)]
    fn times_power(self, exponent: Self) -> Self {
        instruction!(Self(_mm512_scalef_pd(self.0, exponent.0)))
    }
}
