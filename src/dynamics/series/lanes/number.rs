//! A number of each of eight motions.

use super::super::factors::Factored;
use super::super::{Constants, Series, SeriesNumber, Terms, bodywise, drive};
use super::factor::FactorInLanes;
use super::{Times, constants};
use crate::arithmetic::eight::LANES;
use crate::arithmetic::lanes::wide::{EightLanes, SlotTask};
use crate::arithmetic::{Complex, DoubleDouble, Over, Real, Scalar, sincos};
use crate::dynamics::Time;
use crate::dynamics::law::{Law, Phase, Sine};
use crate::scene::Profile;
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of each motion.
#[derive(Clone, Copy, Debug)]
pub struct InLanes<W>(pub W);

impl<W: EightLanes> InLanes<W> {
    /// A function of every lane by itself, that is seldom asked for.
    #[inline(never)]
    fn seldom(self, f: impl Fn(usize, f64) -> f64) -> Self {
        let lanes = self.0.array();
        Self(W::of(&std::array::from_fn(|lane| f(lane, lanes[lane]))))
    }

    /// What a function makes of every lane's time.
    #[inline]
    fn of_times(times: &Times, f: impl Fn(Time) -> f64) -> Self {
        Self(W::of(&std::array::from_fn(|lane| f(times[lane]))))
    }

    /// Sines and cosines where an angle is far off or not a number: that lane by itself.
    #[cold]
    #[inline(never)]
    fn far_sin_cos(self) -> (Self, Self) {
        let angles = self.0.array();
        let is_near = |angle: f64| angle.abs() <= sincos::RANGE;
        let near = angles.map(|angle| if is_near(angle) { angle } else { 0.0 });
        let (sin, cos) = Self(W::of(&near)).near_sin_cos();
        let (mut sin, mut cos) = (sin.0.array(), cos.0.array());
        for (lane, &angle) in angles.iter().enumerate().filter(|(_, angle)| !is_near(**angle)) {
            (sin[lane], cos[lane]) = libm::sincos(angle);
        }
        (Self(W::of(&sin)), Self(W::of(&cos)))
    }

    #[inline(always)]
    fn near_sin_cos(self) -> (Self, Self) {
        let (sin, cos) = sincos::sin_cos(self.0, W::ZERO);
        (Self(sin), Self(cos))
    }
}

impl<W: EightLanes> Default for InLanes<W> {
    #[inline(always)]
    fn default() -> Self {
        Self::ZERO
    }
}

impl<W: EightLanes> Scalar for InLanes<W> {
    const ZERO: Self = Self(W::ZERO);
    const ONE: Self = Self(W::ONE);

    #[inline(always)]
    fn of(value: f64) -> Self {
        Self(W::splat(value))
    }

    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        Self(self.0.mul(W::splat(factor)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        if self.0.are_within(sincos::RANGE) { self.near_sin_cos() } else { self.far_sin_cos() }
    }

    fn exp(self) -> Self {
        self.seldom(|_, x| Scalar::exp(x))
    }

    fn ln(self) -> Self {
        self.seldom(|_, x| Scalar::ln(x))
    }

    fn tanh(self) -> Self {
        self.seldom(|_, x| Scalar::tanh(x))
    }

    fn atan2(self, x: Self) -> Self {
        let x = x.0.array();
        self.seldom(|lane, y| Scalar::atan2(y, x[lane]))
    }

    fn power_above_zero(self, exponent: Self) -> Self {
        let exponent = exponent.0.array();
        self.seldom(|lane, base| base.power_above_zero(exponent[lane]))
    }
}

impl<W: EightLanes> Real for InLanes<W> {
    const IS_PLAIN: bool = false;
    const HAS_CONSTANTS: bool = true;

    /// Of the first lane: nothing of what lanes are expanded for asks for it.
    #[inline(always)]
    fn value(self) -> f64 {
        self.0.array()[0]
    }

    /// The product with the rounded reciprocal, corrected by what is left of the division.
    #[inline(always)]
    fn divided(self, k: usize, fraction: Self) -> Self {
        let quotient = self.0.mul(fraction.0);
        let left = quotient.neg_mul_add(W::splat(k as f64), self.0);
        Self(left.mul_add(fraction.0, quotient))
    }

    #[inline(always)]
    fn split(value: DoubleDouble) -> (Self, Self) {
        (Self::of(value.hi), Self::of(value.lo))
    }

    #[inline(always)]
    fn double_double(self) -> DoubleDouble {
        DoubleDouble::of(self.value())
    }
}

impl<W: EightLanes> PartialEq for InLanes<W> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.0.array() == other.0.array()
    }
}

/// Where all lanes are ordered alike.
impl<W: EightLanes> PartialOrd for InLanes<W> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let (own, other) = (self.0.array(), other.0.array());
        let order = own[0].partial_cmp(&other[0]);
        (1..LANES).all(|lane| own[lane].partial_cmp(&other[lane]) == order).then_some(order).flatten()
    }
}

impl<W: EightLanes> Add for InLanes<W> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.add(other.0))
    }
}

impl<W: EightLanes> Sub for InLanes<W> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.sub(other.0))
    }
}

impl<W: EightLanes> Mul for InLanes<W> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0.mul(other.0))
    }
}

impl<W: EightLanes> Div for InLanes<W> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0.div(other.0))
    }
}

impl<W: EightLanes> Neg for InLanes<W> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(W::ZERO.sub(self.0))
    }
}

crate::arithmetic::assign_by_operators!([W: EightLanes] InLanes<W>);

impl<W: EightLanes> Constants for InLanes<W> {
    type Constant = Self;
    type Time = Times;

    fn moment(times: Times) -> Self {
        Self::of_times(&times, |t| t.hi)
    }

    fn phase(law: &Law<Self>, times: Times) -> Phase<Self> {
        let laws = constants::laws(law);
        if laws.iter().all(|law| law.start == 0.0 && law.is_constant()) {
            return Phase { unit: Complex::new(Self::ONE, Self::ZERO), ..Phase::default() };
        }
        let phases: [Phase<f64>; LANES] = std::array::from_fn(|lane| laws[lane].at::<f64>(times[lane]));
        let join =
            |part: fn(&Phase<f64>) -> f64| Self(W::of(&std::array::from_fn(|lane| part(&phases[lane]))));
        Phase {
            angle: join(|phase| phase.angle),
            unit: Complex::new(join(|phase| phase.unit.re), join(|phase| phase.unit.im)),
            rate: join(|phase| phase.rate),
            acceleration: join(|phase| phase.acceleration),
        }
    }

    fn law_value(law: &Law<Self>, times: Times) -> Self {
        let laws = constants::laws(law);
        Self(W::of(&std::array::from_fn(|lane| laws[lane].value(times[lane]))))
    }

    fn add_law(law: &Law<Self>, sign: f64, times: Times, series: &mut [Self], first: usize, stride: usize) {
        let laws = constants::laws(law);
        if laws.iter().all(Law::is_constant) {
            return;
        }
        let of_lanes = |of: &dyn Fn(usize) -> f64| Self(W::of(&std::array::from_fn(of)));
        let rate = of_lanes(&|lane| laws[lane].at::<f64>(times[lane]).rate);
        let unit = |sine: &Sine<Self>| {
            let units: [(f64, f64); LANES] = std::array::from_fn(|lane| {
                let argument = constants::sine_of(sine, lane).argument(times[lane]);
                Scalar::sin_cos(argument.reduced().0.hi)
            });
            (of_lanes(&|lane| units[lane].0), of_lanes(&|lane| units[lane].1))
        };
        let profile = |_: &Profile<Self>, order: usize| {
            let of = |lane: usize| {
                laws[lane].profile.as_ref().map(|profile| profile.series::<f64>(times[lane], order))
            };
            let powers: [Vec<f64>; LANES] = std::array::from_fn(|lane| of(lane).unwrap_or_default());
            (0..powers[0].len()).map(|m| of_lanes(&|lane| powers[lane][m])).collect()
        };
        drive::add_from(law, sign, rate, (unit, profile), (series, first, stride));
    }
}

/// A constant for each motion, as any number of theirs.
impl<W: EightLanes> Over<Self> for InLanes<W> {
    #[inline(always)]
    fn constant(value: Self) -> Self {
        value
    }

    #[inline(always)]
    fn by(self, factor: Self) -> Self {
        self * factor
    }
}

impl<W: EightLanes> Factored for InLanes<W> {
    type Factor = FactorInLanes<W>;
}

impl<W: EightLanes> SeriesNumber for InLanes<W> {
    const HAS_INVERSE: bool = true;
    const HAS_ROWS: bool = true;
    const HAS_BORDER: bool = true;

    #[inline(never)]
    fn perform<K: SlotTask>(task: K) -> K::Output {
        W::perform(task)
    }

    #[inline(always)]
    fn with_product(self, factor: Self, constant: Self, _is_varied: bool) -> Self {
        Self(factor.0.mul_add(constant.0, self.0))
    }

    #[inline(always)]
    fn less_constant(self, factor: Self, constant: Self) -> Self {
        Self(factor.0.neg_mul_add(constant.0, self.0))
    }

    #[inline(always)]
    fn with_constant(self, factor: Self, constant: Self) -> Self {
        Self(factor.0.mul_add(constant.0, self.0))
    }

    #[inline(always)]
    fn begin(series: &mut Series<Self>, times: Times, u: &[Self], u_rest: &[Self], u_rate: &[Self]) {
        series.begin(times, u, u_rest, u_rate);
    }

    #[inline(always)]
    fn orders(series: &mut Series<Self>, terms: &Terms<Self>, first: usize) {
        series.orders_here::<0>(terms, first);
    }

    fn products(n: usize, a: &[Complex<Self>], b: &[Complex<Self>], sums: &mut [Complex<Self>]) {
        bodywise::products(n, a, b, sums);
    }
}
