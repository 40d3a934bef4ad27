//! Rows that stay in the loop of the natural form: driven ones, and those that are not linear in the
//! elements.
//!
//! ```text
//! angle:  C = Im(conj(u) z_a conj(z_b)),  u = exp(i theta(t))
//!     gradients i u z_b and -i conj(u) z_a;  i u from the ground
//! place:  C = Q(z) - s(t)                                           gradients of Q
//! ```
//!
//! Both are at most quadratic, so that C(z + x) = C(z) + slip(x) + square(x) exactly.

use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar};
use crate::dynamics::Time;
use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
use crate::dynamics::law::Law;

/// A row in the loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// Its number in the mechanism.
    pub row: usize,
    /// Its name.
    pub name: String,
    /// What it measures.
    pub measure: RowMeasure,
    /// What that is to be; `None`: zero.
    pub law: Option<Law>,
    /// True where C is an angle.
    pub is_in_radians: bool,
}

/// What a guide asks for at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand<T> {
    /// exp(i theta) of an angle.
    pub unit: Complex<T>,
    /// s of a place \[m\].
    pub travel: T,
    /// theta' or s' \[rad/s, m/s\].
    pub rate: T,
}

impl Demand<DoubleDouble> {
    /// Leading parts.
    #[inline(always)]
    pub fn plain(self) -> Demand<f64> {
        Demand {
            unit: Complex::new(self.unit.re.hi, self.unit.im.hi),
            travel: self.travel.hi,
            rate: self.rate.hi,
        }
    }
}

impl Guide {
    /// The row `row` of a mechanism.
    pub fn new(number: usize, row: &ConstraintEquation) -> Self {
        Self {
            row: number,
            name: row.name.clone(),
            measure: row.measure.clone(),
            law: row.law.clone(),
            is_in_radians: row.is_in_radians(),
        }
    }

    /// What it asks for at time `t`.
    pub fn demand<T: Real>(&self, t: Time) -> Demand<T> {
        let still = Demand { unit: Complex::new(T::ONE, T::ZERO), ..Demand::default() };
        let Some(law) = &self.law else { return still };
        match &self.measure {
            RowMeasure::Angle { .. } => {
                let phase = law.at::<T>(t);
                Demand { unit: phase.unit, travel: T::ZERO, rate: phase.rate }
            }
            RowMeasure::Place(_) => Demand { travel: law.value(t), rate: law.rates::<T>(t).0, ..still },
        }
    }

    /// C at the elements `z` \[rad or m\].
    #[inline(always)]
    pub fn value<T: Scalar>(&self, demand: &Demand<T>, z: &[Complex<T>]) -> T {
        match &self.measure {
            RowMeasure::Angle { .. } => self.mismatch(demand, z).im,
            RowMeasure::Place(place) => place.value(z) - demand.travel,
        }
    }

    /// `conj(u) z_a conj(z_b)` of an angle: 1 where the row is kept; of a place always 1.
    #[inline(always)]
    pub fn mismatch<T: Scalar>(&self, demand: &Demand<T>, z: &[Complex<T>]) -> Complex<T> {
        match &self.measure {
            RowMeasure::Angle { body, base } => {
                let direct = demand.unit.conj() * z[*body];
                base.map_or(direct, |base| direct * z[base].conj())
            }
            RowMeasure::Place(_) => Complex::new(T::ONE, T::ZERO),
        }
    }

    /// Derivative of C along `x` at fixed time.
    #[inline(always)]
    pub fn slip<T: Scalar>(&self, demand: &Demand<T>, z: &[Complex<T>], x: &[Complex<T>]) -> T {
        match &self.measure {
            RowMeasure::Angle { .. } => self.turned(demand, z, x).im,
            RowMeasure::Place(place) => {
                let mut sum = T::ZERO;
                place.gradients(z, |k, gradient| sum += gradient.dot(x[k]));
                sum
            }
        }
    }

    /// Derivative of [`Guide::mismatch`] of an angle.
    #[inline(always)]
    fn turned<T: Scalar>(&self, demand: &Demand<T>, z: &[Complex<T>], x: &[Complex<T>]) -> Complex<T> {
        match &self.measure {
            RowMeasure::Angle { body, base: None } => demand.unit.conj() * x[*body],
            RowMeasure::Angle { body, base: Some(base) } => {
                demand.unit.conj() * (x[*body] * z[*base].conj() + z[*body] * x[*base].conj())
            }
            RowMeasure::Place(_) => Complex::ZERO,
        }
    }

    /// What C gains beyond its derivative along `x`.
    #[inline(always)]
    pub fn square<T: Scalar>(&self, demand: &Demand<T>, x: &[Complex<T>]) -> T {
        match &self.measure {
            RowMeasure::Angle { body, base: Some(base) } => {
                (demand.unit.conj() * x[*body] * x[*base].conj()).im
            }
            RowMeasure::Angle { base: None, .. } => T::ZERO,
            RowMeasure::Place(place) => {
                place.bilinear.iter().fold(T::ZERO, |sum, &(j, k, h)| sum + x[j].dot(x[k].turn(h)))
            }
        }
    }

    /// C_t \[rad/s or m/s\].
    #[inline(always)]
    pub fn drive<T: Scalar>(&self, demand: &Demand<T>, z: &[Complex<T>]) -> T {
        -(demand.rate * self.mismatch(demand, z).re)
    }

    /// Adds the gradients of C to `gradient`.
    #[inline(always)]
    pub fn gradient<T: Scalar>(&self, demand: &Demand<T>, z: &[Complex<T>], gradient: &mut [Complex<T>]) {
        match &self.measure {
            RowMeasure::Angle { body, base: None } => gradient[*body] += demand.unit.left(),
            RowMeasure::Angle { body, base: Some(base) } => {
                gradient[*body] += (demand.unit * z[*base]).left();
                gradient[*base] -= (demand.unit.conj() * z[*body]).left();
            }
            RowMeasure::Place(place) => place.gradients(z, |k, part| gradient[k] += part),
        }
    }
}
