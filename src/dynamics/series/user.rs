//! The series of forces from outside the crate: their tape, order by order.

use super::coefficient::SeriesNumber;
use super::factors::Scale;
use super::tape::TapePowers;
use crate::arithmetic::tape::TapeSeries;
use crate::arithmetic::{Complex, DoubleDouble};
use crate::dynamics::force::UserForce;
use crate::dynamics::force::user::ForceInput;

/// Series of one force, powers 0 to P.
#[derive(Clone, Debug)]
pub struct UserSeries<T: SeriesNumber>([TapePowers<T>; 2]);

/// The series of a formula that is recorded as a torque, powers 0 to P.
#[derive(Clone, Debug)]
pub struct FormulaSeries<T>(TapeSeries<T>);

impl<T: SeriesNumber> FormulaSeries<T> {
    /// Room for powers up to `order`.
    pub fn new(formula: &UserForce<T::Constant>, order: usize) -> Self {
        Self(TapeSeries::new(&formula.parts[1].tape, order))
    }

    /// Its powers in a motion that is expanded, as many as there is room for; none where it is 0.
    pub fn values(&mut self, formula: &UserForce<T::Constant>, order: usize, at: PowersAt<T>) -> &[T] {
        let part = &formula.parts[1];
        for m in 0..=order {
            let input = |number: u32| at.power(formula, formula.inputs[number as usize], m);
            self.0.advance(&part.tape, m, &input);
        }
        part.torques.first().map_or(&[], |&(_, slot)| self.0.of(slot))
    }
}

/// What the powers of a motion of `n` elements are, as far as they are known.
#[derive(Clone, Copy)]
pub struct PowersAt<'a, T> {
    /// The time at the start \[s\].
    pub time: T,
    /// Angles at the start \[rad\].
    pub phi: &'a [T],
    /// Powers of the elements, one more than are asked for.
    pub z: &'a [Complex<T>],
    /// Powers of the rates.
    pub omega: &'a [T],
    /// Elements.
    pub n: usize,
}

impl<T: SeriesNumber> PowersAt<'_, T> {
    /// Power `m` of an input.
    #[inline(always)]
    fn power(&self, force: &UserForce<T::Constant>, input: ForceInput, m: usize) -> T {
        let z = |m: usize| &self.z[m * self.n..(m + 1) * self.n];
        let omega = |m: usize| &self.omega[m * self.n..(m + 1) * self.n];
        let place = |site: usize| {
            let point = &force.sites[site].point;
            if m == 0 { point.position(z(0)) } else { point.turned(z(m)) }
        };
        let velocity = |site: usize| force.sites[site].point.turned(z(m + 1)).times(T::of((m + 1) as f64));
        match (input, m) {
            (ForceInput::Number(number), 0) => T::constant(force.numbers[number]),
            (ForceInput::Number(_), _) => T::ZERO,
            (ForceInput::Time, 0) => self.time,
            (ForceInput::Time, m) => T::of(if m == 1 { 1.0 } else { 0.0 }),
            (ForceInput::Angle(body), 0) => self.phi[body],
            (ForceInput::Angle(body), m) => omega(m - 1)[body] / T::of(m as f64),
            (ForceInput::Rate(body), m) => omega(m)[body],
            (ForceInput::Cosine(body), m) => z(m)[body].re,
            (ForceInput::Sine(body), m) => z(m)[body].im,
            (ForceInput::X(site), _) => place(site).re,
            (ForceInput::Y(site), _) => place(site).im,
            (ForceInput::XRate(site), _) => velocity(site).re,
            (ForceInput::YRate(site), _) => velocity(site).im,
        }
    }
}

impl<T: SeriesNumber> UserSeries<T> {
    /// Room for powers up to `order`.
    pub fn new(force: &UserForce<T::Constant>, order: usize) -> Self {
        let is_number = |input: u32| matches!(force.inputs[input as usize], ForceInput::Number(_));
        Self(force.parts.each_ref().map(|part| TapePowers::new(&part.tape, order, is_number)))
    }

    /// False where powers grow by more than products are made for.
    pub fn is_sound(&self) -> bool {
        self.0.iter().all(TapePowers::is_sound)
    }

    /// Finds power m of its forces and torques.
    #[inline(always)]
    pub fn advance(&mut self, force: &UserForce<T::Constant>, m: usize, at: PowersAt<T>, scale: &Scale<T>) {
        for (part, series) in force.parts.iter().zip(&mut self.0) {
            let input = |number: u32| at.power(force, force.inputs[number as usize], m);
            series.advance(&part.tape, m, scale, input);
        }
    }

    /// Takes power m of the forces off the elements' balance, and adds that of torques to `load`.
    #[inline(always)]
    pub fn act(
        &mut self,
        force: &UserForce<T::Constant>,
        m: usize,
        at: PowersAt<T>,
        (rest, load): (&mut [Complex<T>], &mut [T]),
        scale: &Scale<T>,
    ) {
        self.advance(force, m, at, scale);
        for (part, series) in force.parts.iter().zip(&self.0) {
            for &(site, [x, y]) in &part.forces {
                force.sites[site]
                    .point
                    .spread(Complex::new(series.power(x, m), series.power(y, m)), |k, force| {
                        rest[k] -= force
                    });
            }
            for &(body, torque) in &part.torques {
                load[body] += series.power(torque, m);
            }
        }
    }

    /// Calls `each` with the body and power m of the force \[N/s^m\] at every point it acts at.
    pub fn forces(&self, force: &UserForce<T::Constant>, m: usize, mut each: impl FnMut(usize, Complex<T>)) {
        for (part, series) in force.parts.iter().zip(&self.0) {
            for &(site, [x, y]) in &part.forces {
                let pull = Complex::new(series.power(x, m), series.power(y, m));
                force.sites[site].body.iter().for_each(|&body| each(body, pull));
            }
        }
    }

    /// Power m of the power accounted as work \[W/s^m\].
    #[inline(always)]
    pub fn power(&self, force: &UserForce<T::Constant>, m: usize) -> T {
        force.parts[1].power.map_or(T::ZERO, |slot| self.0[1].power(slot, m))
    }

    /// The first powers from a series in more digits.
    pub fn take(&mut self, other: &UserSeries<DoubleDouble>) {
        self.0.iter_mut().zip(&other.0).for_each(|(series, other)| series.take(other));
    }
}
