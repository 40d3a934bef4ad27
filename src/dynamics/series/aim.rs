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
use super::user::At;
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::tape::TapeSeries;
use crate::dynamics::constraint::Aim;
use crate::dynamics::constraint::aim::Input;
use std::sync::Arc;

/// Series of one aim, powers 0 to P.
#[derive(Clone, Debug)]
pub struct AimSeries<T> {
    aim: Arc<Aim>,
    tape: TapeSeries<T>,
    /// Elements from this one on are translational coordinates.
    angles: usize,
    /// What f'' has at the present power without the accelerations of that power.
    pub known: T,
}

impl<T: SeriesNumber> AimSeries<T> {
    /// Room for powers up to `order`, of a motion whose first so many elements are angles.
    pub fn new(aim: &Arc<Aim>, angles: usize, order: usize) -> Self {
        Self { aim: Arc::clone(aim), tape: TapeSeries::new(&aim.tape, order), angles, known: T::ZERO }
    }

    /// Finds power m of the aim and its derivatives, from the powers up to m of the motion's elements and
    /// rates.
    #[inline(always)]
    pub fn advance(&mut self, m: usize, at: At<T>) {
        self.advance_tape(m, at);
        let n = at.n;
        let slopes = self.aim.slopes.iter();
        let accelerations = slopes.fold(T::ZERO, |sum, &(k, slope)| {
            let slope = self.tape.of(slope);
            (1..=m)
                .fold(sum, |sum, l| sum + slope[l] * at.omega[(m - l + 1) * n + k].scale((m - l + 1) as f64))
        });
        self.known = accelerations + self.tape.of(self.aim.convective)[m];
    }

    /// All powers of the aim of a motion that is expanded, as many as there is room for.
    pub fn values(&mut self, order: usize, at: At<T>) -> &[T] {
        for m in 0..=order {
            self.advance_tape(m, at);
        }
        self.tape.of(self.aim.value)
    }

    fn advance_tape(&mut self, m: usize, at: At<T>) {
        let n = at.n;
        let input = |number: u32| match (self.aim.inputs[number as usize], m) {
            (Input::Time, 0) => at.time,
            (Input::Time, m) => T::of(if m == 1 { 1.0 } else { 0.0 }),
            (Input::Angle(k), 0) => at.phi[k],
            (Input::Angle(k), m) => at.omega[(m - 1) * n + k] / T::of(m as f64),
            (Input::Cosine(k), m) => at.z[m * n + k].re,
            (Input::Sine(k), m) => at.z[m * n + k].im,
            // A coordinate of an origin is part of the element at the place of its x.
            (Input::Origin(k), m) if (k - self.angles).is_multiple_of(2) => at.z[m * n + k].re,
            (Input::Origin(k), m) => at.z[m * n + k - 1].im,
            // Elements are known to one power more, and the aim with them.
            (Input::Rate(k), m) => at.omega.get(m * n + k).copied().unwrap_or(T::ZERO),
        };
        self.tape.advance(&self.aim.tape, m, input);
    }

    /// df/dq at the start, coordinate by coordinate.
    #[inline(always)]
    pub fn slopes(&self, mut each: impl FnMut(usize, T)) {
        self.aim.slopes.iter().for_each(|&(k, slope)| each(k, self.tape.of(slope)[0]));
    }

    /// Adds power m of the generalized forces that multipliers below that power exert.
    #[inline(always)]
    pub fn turning_terms(&self, m: usize, multiplier: impl Fn(usize) -> T, load: &mut [T]) {
        for &(k, slope) in &self.aim.slopes {
            let slope = self.tape.of(slope);
            load[k] += (1..=m).fold(T::ZERO, |sum, l| sum + slope[l] * multiplier(m - l));
        }
    }

    /// Powers of its explicit rate, where it depends on time.
    pub fn drive(&self) -> Option<&[T]> {
        self.aim.is_timed.then(|| self.tape.of(self.aim.drive))
    }

    /// The first powers from a series in more digits.
    pub fn take(&mut self, other: &AimSeries<DoubleDouble>) {
        self.tape.take(&other.tape);
    }
}
