//! The aim of a motor, or the travel of a wall, that depends on where the mechanism is: gears, cams,
//! followers.
//!
//! ```text
//! C = Q - f(t, q),   dC/dq = dQ/dq - f_q,   C_t = -f_t
//! C'' at zero acceleration = Q'' - (f' differentiated along q' = w, w' = 0),    f' = f_q w + f_t
//! ```
//!
//! Q is a travel, or zero where f has the angle as well.  The formula is recorded once with its derivatives,
//! by the reverse mode of the tape, so that the Jacobian and the quadratic terms are exact on every scalar.
//! As long as f does not depend on time the row does no work.

use super::{ConstraintArguments, Linearised, Site};
use crate::arithmetic::angle::GOLDEN_ANGLE;
use crate::arithmetic::tape::{Slot, Symbol, Tape, number_of};
use crate::arithmetic::{Complex, Over, Real, Scalar};
use crate::dynamics::Time;
use crate::dynamics::configuration::{Configuration, ConfigurationSource};
use crate::dynamics::force::UserForce;
use std::cell::RefCell;
use std::f64::consts::{PI, TAU};

/// What a formula of time and place asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::dynamics) enum AimInput {
    /// A number that is no double.
    Number(usize),
    Time,
    Angle(usize),
    Cosine(usize),
    Sine(usize),
    /// A coordinate of an origin that moves freely.
    Origin(usize),
    /// The rate of a coordinate.
    Rate(usize),
}

impl AimInput {
    /// The coordinate it belongs to.
    fn coordinate(&self) -> Option<usize> {
        match *self {
            Self::Number(_) | Self::Time => None,
            Self::Angle(k) | Self::Cosine(k) | Self::Sine(k) | Self::Origin(k) | Self::Rate(k) => Some(k),
        }
    }
}

/// Places at which slopes are looked at for their sizes.
const PLACES: usize = 8;

/// A formula of time and place with its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Aim<C = f64> {
    pub(in crate::dynamics) tape: Tape,
    pub(in crate::dynamics) inputs: Vec<AimInput>,
    /// Numbers that are no doubles.
    pub(in crate::dynamics) numbers: Vec<C>,
    /// f, f_t and f'' at zero acceleration.
    pub(crate) value: Slot,
    pub(crate) drive: Slot,
    pub(in crate::dynamics) convective: Slot,
    /// f_q by coordinate.
    pub(crate) slopes: Vec<(usize, Slot)>,
    /// The angles it is the aim of; none where that is a travel.
    pub angles: Vec<usize>,
    /// True where it depends on time.
    pub is_timed: bool,
    /// The forces at the points that it asks for, were it a potential energy: where a row acts with a
    /// multiplier of -1.  By the slopes the motion feels them; joints carry them.
    pub(in crate::dynamics) at_points: Option<Box<UserForce<C>>>,
}

impl<C: Real> Aim<C> {
    /// Records a formula, from which the angle of `angles[0]`, less that of `angles[1]`, is taken; `None`
    /// where it depends on rates.
    pub(in crate::dynamics) fn record(
        angles: &[usize],
        formula: impl Fn(&Configuration<Symbol, C>) -> Symbol,
    ) -> Option<Self> {
        let recorder = AimRecorder::<C>::default();
        let (mut coordinates, mut has_rates, mut is_timed) = (Vec::new(), false, false);
        let [(tape, slots)] = Symbol::record(|| {
            let signs = [1.0, -1.0];
            let value =
                angles.iter().zip(signs).fold(formula(&Configuration::new(&recorder)), |sum, (&k, sign)| {
                    sum - recorder.angle(k).scale(sign)
                });
            let first = recorder.derivatives(value);
            has_rates = !first.rates.is_empty();
            is_timed = !first.time.is_zero();
            let second = recorder.derivatives(recorder.along(&first));
            let results = [value, first.time, recorder.along(&second)];
            coordinates.extend(first.slopes.iter().map(|slope| slope.0));
            [results.into_iter().chain(first.slopes.iter().map(|slope| slope.1)).collect()]
        });
        let inputs = recorder.inputs.into_inner();
        (!has_rates).then(|| Self {
            numbers: recorder.numbers.into_inner(),
            value: slots[0],
            drive: slots[1],
            convective: slots[2],
            slopes: coordinates.into_iter().zip(slots[3..].iter().copied()).collect(),
            angles: angles.to_vec(),
            is_timed,
            at_points: UserForce::at_points(formula).map(Box::new),
            tape,
            inputs,
        })
    }

    /// What it comes to at a time [s] and a configuration: all results of its tape.
    pub fn at<T: Over<C>, R>(&self, time: T, at: ConstraintArguments<T>, then: impl FnOnce(&[T]) -> R) -> R {
        let input = |number: u32| match self.inputs[number as usize] {
            AimInput::Number(number) => T::constant(self.numbers[number]),
            AimInput::Time => time,
            AimInput::Angle(k) | AimInput::Origin(k) => at.phi[k],
            AimInput::Cosine(k) => at.z[k].re,
            AimInput::Sine(k) => at.z[k].im,
            // Values and slopes are asked for without rates.
            AimInput::Rate(k) => at.omega.get(k).copied().unwrap_or(T::ZERO),
        };
        self.tape.results(input, then)
    }
}

impl Aim {
    /// The same formula with other numbers in it, one by one.
    pub(in crate::dynamics) fn map<D>(&self, mut of: impl FnMut(f64) -> D) -> Aim<D> {
        let (mut inputs, mut numbers) = (self.inputs.clone(), Vec::new());
        let (tape, new) = self.tape.lifted(|value| {
            inputs.push(AimInput::Number(numbers.len()));
            numbers.push(of(value));
            inputs.len() as u32 - 1
        });
        let at = |slot: Slot| new[slot as usize];
        Aim {
            value: at(self.value),
            drive: at(self.drive),
            convective: at(self.convective),
            slopes: self.slopes.iter().map(|&(k, slope)| (k, at(slope))).collect(),
            angles: self.angles.clone(),
            is_timed: self.is_timed,
            // Series in lanes ask for no forces of joints.
            at_points: None,
            tape,
            inputs,
            numbers,
        }
    }

    fn results<T: Real, R>(&self, t: Time, at: ConstraintArguments<T>, then: impl FnOnce(&[T]) -> R) -> R {
        self.at(T::split(t).0, at, then)
    }

    /// f, at angles and translational coordinates `phi` and elements `z`.
    pub fn value(&self, t: Time, phi: &[f64], z: &[Complex<f64>]) -> f64 {
        self.results(t, ConstraintArguments { phi, z, omega: &[] }, |slots| slots[self.value as usize])
    }

    /// f' along the motion.
    pub fn rate(&self, t: Time, phi: &[f64], z: &[Complex<f64>], omega: &[f64]) -> f64 {
        self.results(t, ConstraintArguments { phi, z, omega }, |slots| {
            let drive = slots[self.drive as usize];
            self.slopes.iter().fold(drive, |sum, &(k, slope)| sum + slots[slope as usize] * omega[k])
        })
    }

    /// Σ |f_k q_k|: what its value is rounded by at large angles and far places, over the rounding of one.
    pub fn terms(&self, t: Time, at: ConstraintArguments<f64>) -> f64 {
        self.results(t, at, |slots| {
            self.slopes.iter().map(|&(k, slope)| (slots[slope as usize] * at.phi[k]).abs()).sum()
        })
    }

    /// How large its slopes come to be by coordinate, with angles anywhere in a turn and origins up to `size`
    /// \[m\] away.
    pub fn slope_sizes(&self, size: f64) -> Vec<(usize, f64)> {
        let mut sizes: Vec<(usize, f64)> = self.coordinates().map(|k| (k, 0.0)).collect();
        let room = self.inputs.iter().filter_map(AimInput::coordinate).max().map_or(0, |most| most + 1);
        for place in 1..=PLACES {
            let turn = |k: usize| (GOLDEN_ANGLE * (place * (k + 1)) as f64) % TAU - PI;
            let z: Vec<Complex<f64>> = (0..room).map(|k| Complex::unit(turn(k))).collect();
            let mut phi: Vec<f64> = (0..room).map(turn).collect();
            for input in &self.inputs {
                if let AimInput::Origin(k) = *input {
                    phi[k] *= size / PI;
                }
            }
            let at = ConstraintArguments { phi: &phi, z: &z, omega: &[] };
            self.results(Time::default(), at, |slots| {
                for ((_, most), &(_, slope)) in sizes.iter_mut().zip(&self.slopes) {
                    let slope = slots[slope as usize].abs();
                    *most = if slope.is_finite() { most.max(slope) } else { *most };
                }
            });
        }
        sizes
    }

    /// The sizes of its slopes where they are the same everywhere, as of a gear; else none.
    pub(in crate::dynamics) fn ratios(&self) -> Vec<f64> {
        let slots: Vec<Slot> = self.slopes.iter().map(|slope| slope.1).collect();
        if self.tape.inputs_of(&slots).is_empty() {
            self.slope_sizes(1.0).into_iter().map(|slope| slope.1).collect()
        } else {
            Vec::new()
        }
    }

    /// Its explicit rate f_t.
    pub fn drive(&self, t: Time, at: ConstraintArguments<f64>) -> f64 {
        self.results(t, at, |slots| slots[self.drive as usize])
    }

    /// Takes it off a row.
    pub fn subtract<T: Real>(
        &self,
        t: Time,
        at: ConstraintArguments<T>,
        jacobian: &mut [T],
        here: &mut Linearised<T>,
    ) {
        self.results(t, at, |slots| {
            here.position -= slots[self.value as usize];
            here.drive -= slots[self.drive as usize];
            here.convective -= slots[self.convective as usize];
            for &(k, slope) in &self.slopes {
                jacobian[k] -= slots[slope as usize];
            }
        });
    }
}

impl<C> Aim<C> {
    /// The bodies whose whole turns matter to it.
    pub(crate) fn counted_angles(&self) -> impl Iterator<Item = usize> {
        self.inputs.iter().filter_map(|input| if let AimInput::Angle(k) = *input { Some(k) } else { None })
    }

    /// The coordinates it depends on.
    pub fn coordinates(&self) -> impl Iterator<Item = usize> {
        self.slopes.iter().map(|slope| slope.0)
    }
}

/// Hands out inputs while a formula is recorded.
#[derive(Default)]
struct AimRecorder<C> {
    inputs: RefCell<Vec<AimInput>>,
    numbers: RefCell<Vec<C>>,
}

/// Derivatives of a result.
struct Derivatives {
    time: Symbol,
    slopes: Vec<(usize, Symbol)>,
    /// Those by rates.
    rates: Vec<Symbol>,
}

impl<C: Real> AimRecorder<C> {
    fn input(&self, input: AimInput) -> Symbol {
        Symbol::input(number_of(&self.inputs, &input) as u32)
    }

    /// Derivatives by time and coordinates.
    fn derivatives(&self, of: Symbol) -> Derivatives {
        let mut found = Derivatives { time: Symbol::ZERO, slopes: Vec::new(), rates: Vec::new() };
        for (number, weight) in of.gradient() {
            let input = self.inputs.borrow()[number as usize];
            let (k, slope) = match input {
                AimInput::Number(_) => continue,
                AimInput::Time => {
                    found.time += weight;
                    continue;
                }
                AimInput::Rate(_) => {
                    found.rates.push(weight);
                    continue;
                }
                AimInput::Angle(k) | AimInput::Origin(k) => (k, weight),
                AimInput::Cosine(k) => (k, -(weight * self.input(AimInput::Sine(k)))),
                AimInput::Sine(k) => (k, weight * self.input(AimInput::Cosine(k))),
            };
            match found.slopes.iter_mut().find(|known| known.0 == k) {
                Some(known) => known.1 += slope,
                None => found.slopes.push((k, slope)),
            }
        }
        found
    }

    fn vector(&self, Complex { re, im }: Complex<C>) -> Complex<Symbol> {
        Complex::new(self.constant(re), self.constant(im))
    }

    /// A vector of a body's frame.
    fn turned(&self, body: usize, gamma: Complex<C>) -> Complex<Symbol> {
        if C::HAS_CONSTANTS {
            return self.direction(body) * self.vector(gamma);
        }
        self.direction(body).turn(Complex::new(gamma.re.value(), gamma.im.value()))
    }

    /// The derivative along the motion, at zero acceleration.
    fn along(&self, of: &Derivatives) -> Symbol {
        of.slopes.iter().fold(of.time, |sum, &(k, slope)| sum + slope * self.input(AimInput::Rate(k)))
    }
}

impl<C: Real> ConfigurationSource<Symbol, C> for AimRecorder<C> {
    fn time(&self) -> Symbol {
        self.input(AimInput::Time)
    }

    fn angle(&self, body: usize) -> Symbol {
        self.input(AimInput::Angle(body))
    }

    fn rate(&self, body: usize) -> Symbol {
        self.input(AimInput::Rate(body))
    }

    fn direction(&self, body: usize) -> Complex<Symbol> {
        Complex::new(self.input(AimInput::Cosine(body)), self.input(AimInput::Sine(body)))
    }

    fn position(&self, site: &Site<C>) -> Complex<Symbol> {
        let turned = site
            .point
            .terms
            .iter()
            .fold(self.vector(site.point.root), |sum, &(k, gamma)| sum + self.turned(k, gamma));
        site.point.shifts.iter().fold(turned, |sum, &(x, share)| {
            let origin = Complex::new(self.input(AimInput::Origin(x)), self.input(AimInput::Origin(x + 1)));
            sum + origin.times(Symbol::of(share))
        })
    }

    fn velocity(&self, site: &Site<C>) -> Complex<Symbol> {
        // Whatever it comes to, it depends on rates.
        let rates =
            site.point.terms.iter().map(|term| term.0).chain(site.point.shifts.iter().map(|shift| shift.0));
        rates.fold(Complex::ZERO, |sum, k| sum + Complex::new(self.rate(k), self.rate(k)))
    }

    /// What is no double is an input: the tape folds constants in doubles.
    fn constant(&self, value: C) -> Symbol {
        if C::HAS_CONSTANTS {
            self.input(AimInput::Number(number_of(&self.numbers, &value)))
        } else {
            Symbol::of(value.value())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::constraint::tests::{assert_derivatives, configuration, free, rod};
    use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
    use crate::dynamics::quadratic::Quadratic;
    use std::sync::Arc;

    #[test]
    fn its_derivatives_are_those_of_its_position() {
        // An angle that follows another, a point, an origin and time.
        let aim = Aim::<f64>::record(&[0], |at| {
            let ([x, y], [u, w]) = (at.position(&rod()), at.position(&free()));
            (at.angle(1).scale(2.0) + at.time() * x).sin_cos().0
                + (x * y + u * w).scale(0.3)
                + at.direction(1)[0]
        });
        let row = ConstraintEquation {
            name: "cam".into(),
            measure: RowMeasure::Place(Quadratic { angles: 2, ..Quadratic::default() }),
            law: None,
            push: None,
            aim: Some(Arc::new(aim.expect("a formula of place"))),
        };
        assert_derivatives(&row);
        let (phi, z, omega) = configuration(0.0);
        let mut jacobian = vec![Default::default(); 4];
        row.linearise(
            Default::default(),
            ConstraintArguments { phi: &phi, z: &z, omega: &omega },
            &mut jacobian,
        );
        assert!(
            jacobian.iter().all(|entry: &crate::arithmetic::DoubleDouble| entry.hi != 0.0),
            "{jacobian:?}"
        );
    }

    #[test]
    fn a_formula_of_rates_is_none() {
        assert!(Aim::<f64>::record(&[0], |at| at.angle(1) + at.rate(1)).is_none());
        assert!(Aim::<f64>::record(&[0], |at| at.velocity(&rod())[0]).is_none());
    }
}
