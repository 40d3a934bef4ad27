//! The series of a motor's aim, or a wall's travel, that depends on where the mechanism is.
//!
//! The tape of an [`Aim`] f has its derivatives; with their series a row `C = Q - f` is bordered like any
//! other:
//!
//! ```text
//! f''_m = Σ_k f_k,0 a_k,m + Σ_k Σ_{l=1..m} f_k,l a_k,m-l + (f'' at zero acceleration)_m        f_k = df/dq_k
//! generalized force of power m on q_k:  f_k,0 lambda_m + Σ_{l=1..m} f_k,l lambda_m-l
//! ```

use super::coefficient::SeriesNumber;
use super::factors::Scale;
use super::tape::TapePowers;
use super::user::PowersAt;
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::Aim;
use crate::dynamics::constraint::aim::AimInput;
use std::sync::Arc;

/// Series of one aim, powers 0 to P.
#[derive(Clone, Debug)]
pub struct AimSeries<T: SeriesNumber> {
    aim: Arc<Aim<T::Constant>>,
    powers: TapePowers<T>,
    /// Elements from this one on are translational coordinates.
    angles: usize,
    /// What f'' has at the present power without the accelerations of that power.
    pub known: T,
}

impl<T: SeriesNumber> AimSeries<T> {
    /// Room for powers up to `order`, of a motion whose first so many elements are angles.
    pub fn new(aim: &Arc<Aim<T::Constant>>, angles: usize, order: usize) -> Self {
        let is_number = |input: u32| matches!(aim.inputs[input as usize], AimInput::Number(_));
        let powers = TapePowers::new(&aim.tape, order, is_number);
        Self { aim: Arc::clone(aim), powers, angles, known: T::ZERO }
    }

    /// Takes the constants of another aim of the same structure.
    pub fn renew(&mut self, aim: &Arc<Aim<T::Constant>>) {
        self.aim.clone_from(aim);
    }

    /// Finds power m of the aim and its derivatives, from the powers up to m of the motion's elements and
    /// rates.
    #[inline(always)]
    pub fn advance(&mut self, m: usize, at: PowersAt<T>, scale: &Scale<T>) {
        self.advance_tape(m, at, scale);
        let n = at.n;
        let mut accelerations = T::ZERO;
        for &(k, slope) in &self.aim.slopes {
            let slope = self.powers.of(slope);
            for l in 1..slope.len().min(m + 1) {
                accelerations += slope[l] * at.omega[(m - l + 1) * n + k].scale((m - l + 1) as f64);
            }
        }
        self.known = accelerations + self.powers.power(self.aim.convective, m);
    }

    /// All powers of the aim of a motion that is expanded, as many as there is room for.
    pub fn values(&mut self, order: usize, at: PowersAt<T>) -> &[T] {
        for m in 0..=order {
            self.advance_tape(m, at, &Scale::<T>::default());
        }
        self.powers.of(self.aim.value)
    }

    #[inline(always)]
    fn advance_tape(&mut self, m: usize, at: PowersAt<T>, scale: &Scale<T>) {
        let (n, aim, angles) = (at.n, &*self.aim, self.angles);
        let input = |number: u32| match (aim.inputs[number as usize], m) {
            (AimInput::Number(number), 0) => T::constant(aim.numbers[number]),
            (AimInput::Number(_), _) => T::ZERO,
            (AimInput::Time, 0) => at.time,
            (AimInput::Time, m) => T::of(if m == 1 { 1.0 } else { 0.0 }),
            (AimInput::Angle(k), 0) => at.phi[k],
            (AimInput::Angle(k), m) => at.omega[(m - 1) * n + k] / T::of(m as f64),
            (AimInput::Cosine(k), m) => at.z[m * n + k].re,
            (AimInput::Sine(k), m) => at.z[m * n + k].im,
            // A coordinate of an origin is part of the element at the place of its x.
            (AimInput::Origin(k), m) if (k - angles).is_multiple_of(2) => at.z[m * n + k].re,
            (AimInput::Origin(k), m) => at.z[m * n + k - 1].im,
            // Elements are known to one power more, and the aim with them.
            (AimInput::Rate(k), m) => at.omega.get(m * n + k).copied().unwrap_or(T::ZERO),
        };
        self.powers.advance(&aim.tape, m, scale, input);
    }

    /// f at the start.
    #[inline(always)]
    pub fn value(&self) -> T {
        self.powers.power(self.aim.value, 0)
    }

    /// df/dq at the start, coordinate by coordinate.
    #[inline(always)]
    pub fn slopes(&self, mut each: impl FnMut(usize, T)) {
        self.aim.slopes.iter().for_each(|&(k, slope)| each(k, self.powers.power(slope, 0)));
    }

    /// The same off a row of a Jacobian.
    #[inline(always)]
    pub fn take_slopes_off(&self, row: &mut [T]) {
        for &(k, slope) in &self.aim.slopes {
            row[k] -= self.powers.power(slope, 0);
        }
    }

    /// Adds power m of the generalized forces that multipliers below that power exert.
    #[inline(always)]
    pub fn turning_terms(&self, m: usize, multiplier: impl Fn(usize) -> T, load: &mut [T]) {
        for &(k, slope) in &self.aim.slopes {
            let slope = self.powers.of(slope);
            let mut sum = T::ZERO;
            for l in 1..slope.len().min(m + 1) {
                sum += slope[l] * multiplier(m - l);
            }
            load[k] += sum;
        }
    }

    /// Powers of its explicit rate, where it depends on time; one alone may stand for a constant.
    pub fn drive(&self) -> Option<&[T]> {
        self.aim.is_timed.then(|| self.powers.of(self.aim.drive))
    }

    /// The first powers from a series in more digits.
    pub fn take(&mut self, other: &AimSeries<DoubleDouble>) {
        self.powers.take(&other.powers);
    }
}
