//! Series of numbers with derivatives by the numbers of a scene: all that is constant has derivatives too.
//!
//! Constants are [`Number`]s in memory, coefficients `InSlots`: their derivatives are in the processor's
//! registers, eight in vectors or a single one, so that an order is a chain of instructions and not of loads.

use super::factors::Factored;
use super::products::VariedFactor;
use super::slots::InSlots;
use super::{Constants, Series, SeriesNumber, Terms, bodywise, own};
use crate::arithmetic::eight::LANES;
use crate::arithmetic::lanes::wide::{SlotTask, Slots};
use crate::arithmetic::{Complex, DoubleDouble, Scalar, Varied};
use crate::dynamics::Time;
use crate::dynamics::law::{Law, Phase};

/// Eight directions.
pub type Number = Varied<LANES>;

impl Factored for Number {
    type Factor = Vec<Self>;
}

/// rate·t + start, of which the value is less whole turns where `is_turned`.
#[inline]
fn grown(t: Time, is_turned: bool) -> impl Fn(Number, Number) -> Number {
    move |rate: Number, start: Number| {
        let exact = DoubleDouble::of(start.value) + t.scale(rate.value);
        let value = if is_turned { exact.reduced().0 } else { exact };
        let slope = std::array::from_fn(|lane| start.slope[lane] + rate.slope[lane] * t.hi);
        Number::new(value.hi, slope)
    }
}

impl Constants for Number {
    type Constant = Self;
    type Time = Time;

    fn moment(t: Time) -> Self {
        Self::constant(t.hi)
    }

    fn phase(law: &Law<Self>, t: Time) -> Phase<Self> {
        own::phase(law, Self::moment(t), grown(t, true))
    }

    fn law_value(law: &Law<Self>, t: Time) -> Self {
        own::value(law, Self::moment(t), grown(t, false))
    }

    fn add_law(law: &Law<Self>, sign: f64, t: Time, series: &mut [Self], first: usize, stride: usize) {
        own::add(law, sign, Self::moment(t), grown(t, true), (series, first, stride));
    }
}

impl<S: Slots> Constants for InSlots<S> {
    type Constant = Number;
    type Time = Time;

    fn moment(t: Time) -> Self {
        Self::of(t.hi)
    }

    fn phase(law: &Law<Number>, t: Time) -> Phase<Self> {
        let Phase { angle, unit, rate, acceleration } = Number::phase(law, t);
        let [angle, re, im, rate, acceleration] =
            [angle, unit.re, unit.im, rate, acceleration].map(|number| Self::load(&number));
        Phase { angle, unit: Complex::new(re, im), rate, acceleration }
    }

    fn law_value(law: &Law<Number>, t: Time) -> Self {
        Self::load(&Number::law_value(law, t))
    }

    fn add_law(law: &Law<Number>, sign: f64, t: Time, series: &mut [Self], first: usize, stride: usize) {
        let mut powers = vec![Number::ZERO; (series.len() - first).div_ceil(stride)];
        Number::add_law(law, sign, t, &mut powers, 0, 1);
        for (sum, power) in series[first..].iter_mut().step_by(stride).zip(&powers) {
            *sum += Self::load(power);
        }
    }
}

impl<S: Slots> Factored for InSlots<S> {
    type Factor = VariedFactor<S>;
}

impl<S: Slots> SeriesNumber for InSlots<S> {
    const HAS_WORK: bool = false;
    const HAS_COUPLINGS: bool = true;

    #[inline(never)]
    fn perform<K: SlotTask>(task: K) -> K::Output {
        S::perform(task)
    }

    #[inline(always)]
    fn with_product(self, factor: Self, constant: Self, is_varied: bool) -> Self {
        let value = self.value + factor.value * constant.value;
        let slope = factor.slope.mul_add(S::splat(constant.value), self.slope);
        if is_varied {
            return Self::new(value, constant.slope.mul_add(S::splat(factor.value), slope));
        }
        Self::new(value, slope)
    }

    #[inline(always)]
    fn begin(series: &mut Series<Self>, t: Time, u: &[Self], u_rest: &[Self], u_rate: &[Self]) {
        series.begin(t, u, u_rest, u_rate);
    }

    #[inline(always)]
    fn orders(series: &mut Series<Self>, terms: &Terms<Number>, first: usize) {
        if S::UNROLLED && [series.angles, series.elements] == [2; 2] {
            series.orders_here::<2>(terms, first);
        } else {
            series.orders_here::<0>(terms, first);
        }
    }

    fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]) {
        bodywise::products(n, a, b, sums);
    }
}
