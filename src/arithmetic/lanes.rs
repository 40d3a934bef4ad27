//! Four doubles at once, with the same bits on every machine.
//!
//! Plain arrays left to the compiler are not good enough for short dependent chains (1.5 to 3 times slower),
//! so there is an explicit vector type for AVX with FMA, and a portable one for everything else.  Each
//! operation is exactly rounded and [`Arithmetic::mul_add`] is *always* fused: where the processor has no
//! such instruction it is computed in software, slowly but to the same bits.  Eight doubles at once, in
//! vectors of AVX-512 where there are, are in module [`wide`].
//!
//! A kernel is written once over [`Lanes`] and compiled twice: it is a piece of [`Code`], which [`run`]
//! enters as compiled for the processor, where that has AVX and FMA, or as portable code.  `unsafe` is
//! nowhere in the crate but in the file that does so, `lanes/hardware.rs`.

use super::sum;
use std::fmt::Debug;
use std::sync::atomic::{AtomicBool, Ordering};

/// Doubles side by side: the same operation in every lane, exactly rounded.
pub trait Arithmetic: Copy + Debug + 'static {
    /// 0 in every lane.
    const ZERO: Self;
    /// 1 in every lane.
    const ONE: Self;

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
    /// `self · factor + addend`, rounded once.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// `addend - self · factor`, rounded once.
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self;

    /// `self + other` exactly: the sum and its error, as [`sum::two_sum`].
    #[inline(always)]
    fn two_sum(self, other: Self) -> (Self, Self) {
        let sum = self.add(other);
        let part = sum.sub(self);
        (sum, self.sub(sum.sub(part)).add(other.sub(part)))
    }

    /// The same where `|self| >= |other|`, as [`sum::fast_two_sum`].
    #[inline(always)]
    fn fast_two_sum(self, other: Self) -> (Self, Self) {
        let sum = self.add(other);
        (sum, other.sub(sum.sub(self)))
    }
}

/// What else sines and cosines take.
pub trait Signed: Arithmetic {
    /// Square roots.
    fn sqrt(self) -> Self;
    /// Magnitudes.
    fn abs(self) -> Self;
    /// The negatives, zeros included.
    fn neg(self) -> Self;
    /// True where every lane is at most `bound` in magnitude; false where one is not a number.
    fn are_within(self, bound: f64) -> bool;
    /// A function of several numbers with as many results, lane by lane.
    fn each<const N: usize>(lanes: [Self; N], f: fn([f64; N]) -> [f64; N]) -> [Self; N];
}

/// Four doubles; lanes 0-1 and 2-3 are pairs, which are halves of the vector.
pub trait Lanes: Signed + Send {
    /// True where long kernels are worth unrolling; where each operation is a call, a loop is as fast and
    /// compiles in a tenth of the time.
    const UNROLLED: bool;

    /// From an array.
    fn of(lanes: [f64; 4]) -> Self;
    /// As an array.
    fn array(self) -> [f64; 4];
    /// `[1, 0, 3, 2]`.
    fn swap_pairs(self) -> Self;
    /// `[2, 3, 0, 1]`.
    fn swap_halves(self) -> Self;
    /// The larger ones; `other` where one is not a number.
    fn max(self, other: Self) -> Self;

    /// Runs code on these lanes, compiled by itself and not as a part of what calls it.
    fn apart<C: Code>(code: C) -> C::Output;

    /// Performs a task, compiled for these lanes.
    fn perform<T: wide::SlotTask>(task: T) -> T::Output;
}

/// Plain code, with a software fused multiply-add where the processor lacks one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Portable([f64; 4]);

// Operations of two numbers and more are calls where there are other vectors for nearly every processor: 4 %
// less code in all, before optimizing.

impl Portable {
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let [a, b] = [self.0, other.0];
        Self([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }
}

impl Arithmetic for Portable {
    const ZERO: Self = Self([0.0; 4]);
    const ONE: Self = Self([1.0; 4]);

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

    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        let [a, b, c] = [self.0, factor.0, addend.0];
        Self([
            sum::fused(a[0], b[0], c[0]),
            sum::fused(a[1], b[1], c[1]),
            sum::fused(a[2], b[2], c[2]),
            sum::fused(a[3], b[3], c[3]),
        ])
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        self.neg().mul_add(factor, addend)
    }

    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn two_sum(self, other: Self) -> (Self, Self) {
        let both: [_; 4] = std::array::from_fn(|lane| sum::two_sum(self.0[lane], other.0[lane]));
        (Self(both.map(|(sum, _)| sum)), Self(both.map(|(_, error)| error)))
    }

    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn fast_two_sum(self, other: Self) -> (Self, Self) {
        let both: [_; 4] = std::array::from_fn(|lane| sum::fast_two_sum(self.0[lane], other.0[lane]));
        (Self(both.map(|(sum, _)| sum)), Self(both.map(|(_, error)| error)))
    }
}

impl Signed for Portable {
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }

    #[inline(always)]
    fn are_within(self, bound: f64) -> bool {
        self.0.iter().all(|x| x.abs() <= bound)
    }

    fn each<const N: usize>(lanes: [Self; N], f: fn([f64; N]) -> [f64; N]) -> [Self; N] {
        each_of_four(lanes, f)
    }
}

/// [`Signed::each`] of four lanes.
fn each_of_four<L: Lanes, const N: usize>(lanes: [L; N], f: fn([f64; N]) -> [f64; N]) -> [L; N] {
    let lanes = lanes.map(L::array);
    let found: [_; 4] = std::array::from_fn(|lane| f(lanes.map(|lanes| lanes[lane])));
    std::array::from_fn(|i| L::of(found.map(|found| found[i])))
}

impl Lanes for Portable {
    const UNROLLED: bool = false;

    #[inline(always)]
    fn of(lanes: [f64; 4]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    fn array(self) -> [f64; 4] {
        self.0
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
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(never)]
    fn apart<C: Code>(code: C) -> C::Output {
        code.run::<Self>()
    }

    #[inline(never)]
    fn perform<T: wide::SlotTask>(task: T) -> T::Output {
        task.perform()
    }
}

#[cfg(all(target_arch = "x86_64", not(driftless_portable)))]
mod hardware;
pub mod row;
pub mod wide;
#[cfg(all(target_arch = "x86_64", not(driftless_portable)))]
pub use hardware::Hardware;
#[cfg(all(target_arch = "x86_64", not(driftless_portable)))]
pub(crate) use hardware::Vector;

/// The widest vectors there is code for.
#[cfg(any(not(target_arch = "x86_64"), driftless_portable))]
pub(crate) type Vector = Portable;

/// The proof that the processor has instructions there is code for; never, on this architecture.
#[cfg(any(not(target_arch = "x86_64"), driftless_portable))]
#[derive(Clone, Copy, Debug)]
pub enum Hardware {}

#[cfg(any(not(target_arch = "x86_64"), driftless_portable))]
impl Hardware {
    /// None.
    pub fn ask() -> Option<Self> {
        None
    }

    /// Nobody holds such a proof.
    pub fn run<C: Code>(self, _: C) -> C::Output {
        match self {}
    }

    /// Nobody holds such a proof.
    pub fn run_in_pairs<C: wide::WideCode>(self, _: C) -> C::Output {
        match self {}
    }
}

/// Code written once over lanes: its [`Code::run`], and every function below it, is `#[inline(always)]`, so
/// that it is compiled as the place is it is called from.
pub trait Code {
    /// What comes of it.
    type Output;

    /// Runs it on one kind of lanes.
    fn run<L: Lanes>(self) -> Self::Output;
}

static IS_DISABLED: AtomicBool = AtomicBool::new(false);

/// Takes the processor for one without vectors from here on, or for what it is again, in the whole process:
/// for tests that the bits are the same.
pub fn disable(is_disabled: bool) {
    IS_DISABLED.store(is_disabled, Ordering::Relaxed);
}

/// True where the processor is taken for one without vectors.
#[inline]
fn is_disabled() -> bool {
    IS_DISABLED.load(Ordering::Relaxed)
}

/// The proof that the processor has vectors, where it has and nobody disabled them.
#[inline]
pub fn hardware() -> Option<Hardware> {
    if is_disabled() { None } else { Hardware::ask() }
}

/// Runs code in the processor's vectors where it has them and `is_portable` does not forbid it, else in
/// portable ones: slowly to the same bits.
#[inline(always)]
pub fn run<C: Code>(code: C, is_portable: bool) -> C::Output {
    match hardware().filter(|_| !is_portable) {
        Some(hardware) => hardware.run(code),
        None => code.run::<Portable>(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every operation on the same operands, as bits.
    struct Everything([f64; 4], [f64; 4], [f64; 4]);

    impl Code for Everything {
        type Output = Vec<[u64; 4]>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<[u64; 4]> {
            let Self(a, b, c) = self;
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
    }

    proptest! {
        #[test]
        fn hardware_and_portable_lanes_have_the_same_bits(
            a in prop::array::uniform4(-1e3..1e3f64),
            b in prop::array::uniform4(-1e3..1e3f64),
            c in prop::array::uniform4(-1e6..1e6f64),
        ) {
            if let Some(hardware) = Hardware::ask() {
                prop_assert_eq!(hardware.run(Everything(a, b, c)), Everything(a, b, c).run::<Portable>());
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
            Portable::splat(nearly)
                .mul_add(Portable::splat(nearly), Portable::splat(-1.0 - 2.0 * f64::EPSILON))
                .array()[0],
            f64::EPSILON.powi(2)
        );
    }
}
