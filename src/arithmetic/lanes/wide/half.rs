//! Four lanes in code that is written over eight.

use super::super::{Arithmetic, Lanes, Signed};
use super::{EightLanes, SlotTask, Slots, each_of_eight};

/// Four lanes for a single trajectory in code over eight: those beyond are left out.
#[derive(Clone, Copy, Debug)]
pub struct FirstHalf<L>(L);

impl<L: Lanes> Arithmetic for FirstHalf<L> {
    const ZERO: Self = Self(L::ZERO);
    const ONE: Self = Self(L::ONE);

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(L::splat(value))
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.add(other.0))
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.sub(other.0))
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0.mul(other.0))
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0.div(other.0))
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(self.0.mul_add(factor.0, addend.0))
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        Self(self.0.neg_mul_add(factor.0, addend.0))
    }
}

impl<L: Lanes> Signed for FirstHalf<L> {
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.neg())
    }

    #[inline(always)]
    fn are_within(self, bound: f64) -> bool {
        self.0.are_within(bound)
    }

    fn each<const N: usize>(lanes: [Self; N], f: fn([f64; N]) -> [f64; N]) -> [Self; N] {
        each_of_eight(lanes, f)
    }
}

impl<L: Lanes> Slots for FirstHalf<L> {
    type Half = L;

    const COUNT: usize = 4;
    const UNROLLED: bool = L::UNROLLED;

    #[inline(always)]
    fn of(&[a, b, c, d, ..]: &[f64; 8]) -> Self {
        Self(L::of([a, b, c, d]))
    }

    #[inline(always)]
    fn array(self) -> [f64; 8] {
        let [a, b, c, d] = self.0.array();
        [a, b, c, d, 0.0, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn perform<T: SlotTask>(task: T) -> T::Output {
        L::perform(task)
    }
}

impl<L: Lanes> EightLanes for FirstHalf<L> {
    const VECTORS: usize = 1;

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self(self.0.abs().max(other.0))
    }
}
