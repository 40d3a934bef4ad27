//! Eight doubles at once, in one vector of AVX-512 or two of four lanes, with the same bits.

use super::{Arithmetic, Hardware, Lanes, Portable, Signed, hardware, is_disabled, sum};
use std::marker::PhantomData;

mod half;

pub use self::half::FirstHalf;
#[cfg(all(target_arch = "x86_64", not(driftless_portable)))]
pub use super::hardware::WideHardware;

/// Up to eight doubles.
pub trait Slots: Arithmetic + Send {
    /// Four lanes of the same processor.
    type Half: Lanes;

    /// How many.
    const COUNT: usize;
    /// True where long kernels are worth unrolling.
    const UNROLLED: bool;

    /// From an array, of which those beyond the last slot are left out.
    fn of(lanes: &[f64; 8]) -> Self;
    /// As an array, with zeros beyond the last slot.
    fn array(self) -> [f64; 8];

    /// Performs a task, compiled for these slots.
    fn perform<T: SlotTask>(task: T) -> T::Output;
}

/// Code over slots of a kind that it knows itself; its [`SlotTask::perform`], and every function below it, is
/// `#[inline(always)]`.
pub trait SlotTask {
    /// What comes of it.
    type Output;

    /// Does it.
    fn perform(self) -> Self::Output;
}

/// What two arrays of eight come to, lane by lane, in code of the place it stands in.
macro_rules! lane_by_lane {
    ($a:expr, $b:expr, $f:expr) => {{
        let (a, b, mut found, mut lane) = ($a.array(), $b.array(), [0.0; 8], 0);
        while lane < 8 {
            found[lane] = $f(a[lane], b[lane]);
            lane += 1;
        }
        Self::of(&found)
    }};
}

/// Eight doubles.
pub trait EightLanes: Slots + Signed {
    /// How many vectors they are in, 1 or 2.
    const VECTORS: usize;

    /// Magnitudes, or `other` where that is larger or the magnitude not a number.
    fn larger(self, other: Self) -> Self;
    /// The smaller ones; `other` where one is not a number.
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        lane_by_lane!(self, other, |a: f64, b: f64| if a < b { a } else { b })
    }

    /// How far the bits of numbers from zero on are above those of others, in units of the last place: about
    /// 2⁵² times the logarithm to base 2 of their ratio.
    #[inline(always)]
    fn bits_above(self, other: Self) -> Self {
        lane_by_lane!(self, other, |a: f64, b: f64| (a.to_bits() as i64 - b.to_bits() as i64) as f64)
    }

    /// The whole numbers below.
    #[inline(always)]
    fn floor(self) -> Self {
        lane_by_lane!(self, self, |a: f64, _| a.floor())
    }

    /// Numbers from 1 to 2, times 2 to the power of whole numbers from -1000 to 1000.
    #[inline(always)]
    fn times_power(self, exponent: Self) -> Self {
        lane_by_lane!(self, exponent, |a, b: f64| a * f64::from_bits(((1023 + b as i64) as u64) << 52))
    }
}

impl<L: Lanes> Arithmetic for [L; 2] {
    const ZERO: Self = [L::ZERO; 2];
    const ONE: Self = [L::ONE; 2];

    #[inline(always)]
    fn splat(value: f64) -> Self {
        [L::splat(value); 2]
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        [self[0].add(other[0]), self[1].add(other[1])]
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        [self[0].sub(other[0]), self[1].sub(other[1])]
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        [self[0].mul(other[0]), self[1].mul(other[1])]
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        [self[0].div(other[0]), self[1].div(other[1])]
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        [self[0].mul_add(factor[0], addend[0]), self[1].mul_add(factor[1], addend[1])]
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        [self[0].neg_mul_add(factor[0], addend[0]), self[1].neg_mul_add(factor[1], addend[1])]
    }
}

impl<L: Lanes> Signed for [L; 2] {
    #[inline(always)]
    fn sqrt(self) -> Self {
        [self[0].sqrt(), self[1].sqrt()]
    }

    #[inline(always)]
    fn abs(self) -> Self {
        [self[0].abs(), self[1].abs()]
    }

    #[inline(always)]
    fn neg(self) -> Self {
        [self[0].neg(), self[1].neg()]
    }

    #[inline(always)]
    fn are_within(self, bound: f64) -> bool {
        self[0].are_within(bound) && self[1].are_within(bound)
    }

    fn each<const N: usize>(lanes: [Self; N], f: fn([f64; N]) -> [f64; N]) -> [Self; N] {
        each_of_eight(lanes, f)
    }
}

/// [`Signed::each`] of eight lanes.
pub(super) fn each_of_eight<W: Slots, const N: usize>(lanes: [W; N], f: fn([f64; N]) -> [f64; N]) -> [W; N] {
    let lanes = lanes.map(W::array);
    let found: [_; 8] = std::array::from_fn(|lane| f(lanes.map(|lanes| lanes[lane])));
    std::array::from_fn(|i| W::of(&found.map(|found| found[i])))
}

impl<L: Lanes> Slots for [L; 2] {
    type Half = L;

    const COUNT: usize = 8;
    const UNROLLED: bool = L::UNROLLED;

    #[inline(always)]
    fn of(&[a, b, c, d, e, f, g, h]: &[f64; 8]) -> Self {
        [L::of([a, b, c, d]), L::of([e, f, g, h])]
    }

    #[inline(always)]
    fn array(self) -> [f64; 8] {
        let ([a, b, c, d], [e, f, g, h]) = (self[0].array(), self[1].array());
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    fn perform<T: SlotTask>(task: T) -> T::Output {
        L::perform(task)
    }
}

impl<L: Lanes> EightLanes for [L; 2] {
    const VECTORS: usize = 2;

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        [self[0].abs().max(other[0]), self[1].abs().max(other[1])]
    }
}

/// One double, in code compiled for lanes `L`.
#[derive(Clone, Copy, Debug)]
pub struct Single<L>(f64, PhantomData<L>);

impl<L: Lanes> Arithmetic for Single<L> {
    const ZERO: Self = Self(0.0, PhantomData);
    const ONE: Self = Self(1.0, PhantomData);

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(value, PhantomData)
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::splat(self.0 + other.0)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::splat(self.0 - other.0)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::splat(self.0 * other.0)
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self::splat(self.0 / other.0)
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self::splat(sum::fused(self.0, factor.0, addend.0))
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        Self::splat(sum::fused(-self.0, factor.0, addend.0))
    }
}

impl<L: Lanes> Slots for Single<L> {
    type Half = L;

    const COUNT: usize = 1;
    const UNROLLED: bool = L::UNROLLED;

    #[inline(always)]
    fn of(lanes: &[f64; 8]) -> Self {
        Self::splat(lanes[0])
    }

    #[inline(always)]
    fn array(self) -> [f64; 8] {
        [self.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn perform<T: SlotTask>(task: T) -> T::Output {
        L::perform(task)
    }
}

/// Code written once over eight lanes, as [`Code`](super::Code) is over four.
pub trait WideCode {
    /// What comes of it.
    type Output;

    /// Runs it on one kind of lanes.
    fn run<W: EightLanes>(self) -> Self::Output;
}

/// The proof that the processor has AVX-512; never, on this architecture.
#[cfg(any(not(target_arch = "x86_64"), driftless_portable))]
#[derive(Clone, Copy, Debug)]
pub enum WideHardware {}

#[cfg(any(not(target_arch = "x86_64"), driftless_portable))]
impl WideHardware {
    /// None.
    pub fn ask() -> Option<Self> {
        None
    }

    /// Nobody holds such a proof.
    pub fn run<C: WideCode>(self, _: C) -> C::Output {
        match self {}
    }
}

/// The vectors that eight lanes are in.
#[derive(Clone, Copy, Debug)]
pub enum Vectors {
    /// Plain code.
    Portable,
    /// Two of four lanes.
    Two(Hardware),
    /// One of eight.
    One(WideHardware),
}

impl Default for Vectors {
    #[inline]
    fn default() -> Self {
        match (WideHardware::ask(), hardware()) {
            (Some(wide), Some(_)) if !is_disabled() => Self::One(wide),
            (_, Some(four)) => Self::Two(four),
            _ => Self::Portable,
        }
    }
}

impl Vectors {
    /// Runs code in them.
    #[inline(always)]
    pub fn run<C: WideCode>(self, code: C) -> C::Output {
        match self {
            Self::One(wide) => wide.run(code),
            Self::Two(four) => four.run_in_pairs(code),
            Self::Portable => code.run::<[Portable; 2]>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct EverythingWide([[f64; 8]; 3]);

    impl WideCode for EverythingWide {
        type Output = Vec<[u64; 8]>;

        #[inline(always)]
        fn run<W: EightLanes>(self) -> Vec<[u64; 8]> {
            let [x, y, z] = [W::of(&self.0[0]), W::of(&self.0[1]), W::of(&self.0[2])];
            let all = [
                x.add(y),
                x.sub(y),
                x.mul(y),
                x.div(y),
                x.neg_mul_add(y, z),
                x.mul_add(y, z),
                x.larger(y),
                x.smaller(y),
                x.sqrt(),
                x.abs(),
                x.neg(),
                x.abs().bits_above(y.abs()),
                y.floor(),
                W::splat(1.5).times_power(z.floor()),
                W::each([x, y], |[x, y]| [x - y, y])[0],
                W::splat(f64::from(u8::from(x.are_within(20.0)))),
                W::splat(self.0[0][0]),
                W::ZERO,
                W::ONE,
            ];
            all.iter().map(|lanes| lanes.array().map(f64::to_bits)).collect()
        }
    }

    #[test]
    fn all_vectors_have_the_same_bits() {
        let number = |k: usize| libm::sin(1.0 + 2.3 * k as f64) * libm::exp2((k % 7) as f64);
        for case in 0..100 {
            let operands: [[f64; 8]; 3] =
                std::array::from_fn(|row| std::array::from_fn(|lane| number(24 * case + 8 * row + lane)));
            let expected = Vectors::Portable.run(EverythingWide(operands));
            let [x, y, z] = operands.map(|row| row[5]);
            assert_eq!(expected[5][5], crate::arithmetic::sum::fused(x, y, z).to_bits());
            if let Some(four) = Hardware::ask() {
                assert_eq!(Vectors::Two(four).run(EverythingWide(operands)), expected);
            }
            if let Some(wide) = WideHardware::ask() {
                assert_eq!(Vectors::One(wide).run(EverythingWide(operands)), expected);
            }
        }
    }
}
