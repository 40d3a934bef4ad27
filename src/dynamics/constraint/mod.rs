//! Constraint equations, one file a kind.
//!
//! A row knows its violation C, its Jacobian G, its drive C_t and what is left of C'' at zero acceleration.
//! Sign rule everywhere: `M a + Gᵀ lambda = b`, `G a = -gamma`, `C' = G w + C_t`.
//!
//! Whatever its kind, a row measures either an angle or a [`Quadratic`] function of unit vectors and
//! translational coordinates, and keeps it at zero or at a law of time.  All that evaluates, projects or
//! expands rows does so for these two measures, so that a new kind is a new function that makes one.

pub mod aim;
pub mod angle;
pub mod line;
pub mod pin;
pub mod rod;
pub mod slot;

pub use aim::Aim;
pub use angle::angle_equation;
pub use line::line_equation;
pub use pin::pin_equations;
pub use rod::rod_equation;
pub use slot::slot_equation;

use super::Time;
use super::law::Law;
use super::point::Point;
use super::quadratic::Quadratic;
use crate::arithmetic::angle::difference;
use crate::arithmetic::{Complex, Over, Real};
use std::sync::Arc;

/// Coordinates, elements and rates at one moment.
#[derive(Clone, Copy, Debug)]
pub struct ConstraintArguments<'a, T> {
    /// Angles in [-π, π] \[rad\], then the coordinates of translational coordinates \[m\].
    pub phi: &'a [T],
    /// Unit vectors, then translational coordinates.
    pub z: &'a [Complex<T>],
    /// Rates \[rad/s, m/s\].
    pub omega: &'a [T],
}

/// A row at one moment; the Jacobian is written aside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearised<T> {
    /// C \[rad or m\].
    pub position: T,
    /// C_t \[rad/s or m/s\].
    pub drive: T,
    /// C'' at zero acceleration \[rad/s² or m/s²\].
    pub convective: T,
}

/// A point and the body it is on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Site<C = f64> {
    /// The body; `None` for the ground.
    pub body: Option<usize>,
    /// The point.
    pub point: Point<C>,
}

impl Site {
    /// A point of the ground.
    pub fn ground(at: [f64; 2]) -> Self {
        Self { body: None, point: Point::ground(at) }
    }
}

/// What a row measures.
#[derive(Clone, Debug, PartialEq)]
pub enum RowMeasure<C = f64> {
    /// The angle of a body, from +x where it has no base \[rad\].
    Angle {
        /// The body.
        body: usize,
        /// The body it is measured from.
        base: Option<usize>,
    },
    /// Where a point is \[m\].
    Place(Quadratic<C>),
}

impl<C: Real> RowMeasure<C> {
    /// Its value \[rad, m\] at coordinates and elements.
    pub fn value<T: Over<C>>(&self, phi: &[T], z: &[Complex<T>]) -> T {
        match self {
            Self::Angle { body, base } => base.map_or(phi[*body], |base| phi[*body] - phi[base]),
            Self::Place(place) => place.value(z),
        }
    }

    /// Its derivatives by coordinates at the elements `z`, one by one.
    pub fn slopes<T: Over<C>>(&self, z: &[Complex<T>], mut each: impl FnMut(usize, T)) {
        match self {
            Self::Angle { body, base } => {
                each(*body, T::ONE);
                base.iter().for_each(|&base| each(base, -T::ONE));
            }
            Self::Place(place) => place.slopes(z, each),
        }
    }
}

/// The force a row exerts: -lambda direction on one body, the opposite on another.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintForce<C = f64> {
    /// The body that takes -lambda direction.
    pub on: Option<usize>,
    /// The body that takes the opposite.
    pub from: Option<usize>,
    /// Where to.
    pub way: ForceDirection<C>,
}

/// The direction of a force, a unit vector.
#[derive(Clone, Debug, PartialEq)]
pub enum ForceDirection<C = f64> {
    /// Fixed in the ground.
    Ground(Complex<C>),
    /// Fixed in the frame of a body.
    Body(usize, Complex<C>),
    /// Along a span of this length \[m\].
    Span(Point<C>, C),
}

impl<C: Real> ConstraintForce<C> {
    /// Its direction at the elements `z`.
    pub fn direction<T: Over<C>>(&self, z: &[Complex<T>]) -> Complex<T> {
        match &self.way {
            ForceDirection::Ground(direction) => Complex::of(*direction),
            ForceDirection::Body(body, direction) => z[*body].turn(*direction),
            ForceDirection::Span(span, length) => span.position(z).times(T::constant(C::ONE / *length)),
        }
    }
}

/// A row of the mechanism: its measure less a law of time, or a formula of time and place, is to be zero.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintEquation<C = f64> {
    /// Name in reports: that of the joint or motor, with an axis where there are two.
    pub name: String,
    /// What it measures.
    pub measure: RowMeasure<C>,
    /// What it is to be; `None`: zero.
    pub law: Option<Law<C>>,
    /// The force it exerts, where it is one.
    pub push: Option<ConstraintForce<C>>,
    /// The formula of time and place that is taken off.
    pub aim: Option<Arc<Aim<C>>>,
}

impl<C: Real> ConstraintEquation<C> {
    /// Name in the scene.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Unit of C: `rad` or `m`.
    pub fn unit(&self) -> &'static str {
        if self.is_in_radians() { "rad" } else { "m" }
    }

    /// Unit of its multiplier and of the torque or force it exerts: `N m` or `N`.
    pub fn unit_of_force(&self) -> &'static str {
        if self.is_in_radians() { "N m" } else { "N" }
    }

    /// True for rows that give an angle.
    pub fn is_angle(&self) -> bool {
        matches!(self.measure, RowMeasure::Angle { .. })
    }

    /// True where C is an angle: also of a gear or a cam, which gives it by others.
    pub fn is_in_radians(&self) -> bool {
        self.is_angle() || self.aim.as_ref().is_some_and(|aim| !aim.angles.is_empty())
    }

    /// The coordinates it depends on; some may come up more than once.
    pub fn coordinates(&self) -> Vec<usize> {
        let mut found: Vec<usize> = match &self.measure {
            RowMeasure::Angle { body, base } => std::iter::once(*body).chain(*base).collect(),
            RowMeasure::Place(place) => place.coordinates(),
        };
        found.extend(self.aim.iter().flat_map(|aim| aim.coordinates()));
        found
    }

    /// Lets it constrain nothing any more, of a mechanism of so many angles.
    pub(super) fn release(&mut self, angles: usize) {
        self.measure = RowMeasure::Place(Quadratic { angles, ..Quadratic::default() });
        (self.law, self.push, self.aim) = (None, None, None);
    }

    /// True where it constrains nothing, and as it is in another mechanism it would.
    pub(super) fn is_released(&self, elsewhere: &Self) -> bool {
        self.coordinates().is_empty() && !elsewhere.coordinates().is_empty()
    }

    /// C, for a row without a law \[m\]: the gap of a wall.
    pub fn gap<T: Over<C>>(&self, z: &[Complex<T>]) -> T {
        match &self.measure {
            RowMeasure::Angle { .. } => T::ZERO,
            RowMeasure::Place(place) => place.value(z),
        }
    }
}

impl ConstraintEquation {
    /// True where it has a law or an aim.
    pub fn moves(&self) -> bool {
        self.law.is_some() || self.aim.is_some()
    }

    /// True where it has a law of time, or an aim that depends on time.
    pub fn moves_by_time(&self) -> bool {
        self.law.is_some() || self.aim.as_ref().is_some_and(|aim| aim.is_timed)
    }

    /// True for rows that do work: motors, not locks, nor gears.
    pub fn is_motor(&self) -> bool {
        self.law.as_ref().is_some_and(|law| !law.is_constant())
            || self.aim.as_ref().is_some_and(|aim| aim.is_timed)
    }

    /// Adds the row's Jacobian to `jacobian` (n, zero on entry) and returns the rest.
    #[inline]
    pub fn linearise<T: Real>(
        &self,
        t: Time,
        at: ConstraintArguments<T>,
        jacobian: &mut [T],
    ) -> Linearised<T> {
        match &self.measure {
            RowMeasure::Angle { body, base } => {
                let given = base.map_or(at.phi[*body], |base| difference(at.phi[*body], at.phi[base]));
                turn(*body, *base, jacobian);
                let [theta, rate, acceleration] =
                    self.law.as_ref().map_or([T::ZERO; 3], |law| law.angles::<T>(t));
                Linearised { position: difference(given, theta), drive: -rate, convective: -acceleration }
            }
            RowMeasure::Place(place) => {
                let mut here = place.linearise(at, jacobian);
                if let Some(law) = &self.law {
                    here.position -= law.value(t);
                    drive(law, t, &mut here);
                }
                if let Some(aim) = &self.aim {
                    aim.subtract(t, at, jacobian, &mut here);
                }
                here
            }
        }
    }

    /// The same without C, which is written as zero: accelerations do not ask for it.
    #[inline]
    pub fn differentiate<T: Real>(
        &self,
        t: Time,
        at: ConstraintArguments<T>,
        jacobian: &mut [T],
    ) -> Linearised<T> {
        match &self.measure {
            RowMeasure::Angle { body, base } => {
                turn(*body, *base, jacobian);
                let mut here = Linearised { position: T::ZERO, drive: T::ZERO, convective: T::ZERO };
                if let Some(law) = &self.law {
                    drive(law, t, &mut here);
                }
                here
            }
            RowMeasure::Place(place) => {
                let mut here = place.differentiate(at, jacobian);
                if let Some(law) = &self.law {
                    drive(law, t, &mut here);
                }
                if let Some(aim) = &self.aim {
                    aim.subtract(t, at, jacobian, &mut here);
                    here.position = T::ZERO;
                }
                here
            }
        }
    }
}

/// The Jacobian of an angle.
#[inline]
fn turn<T: Real>(body: usize, base: Option<usize>, jacobian: &mut [T]) {
    jacobian[body] += T::ONE;
    if let Some(base) = base {
        jacobian[base] -= T::ONE;
    }
}

/// Takes the law's rate and acceleration off.
#[inline]
fn drive<T: Real>(law: &Law, t: Time, here: &mut Linearised<T>) {
    let (rate, acceleration) = law.rates::<T>(t);
    here.drive -= rate;
    here.convective -= acceleration;
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::arithmetic::{DoubleDouble, Scalar};
    use crate::scene::Sine;

    /// A law with everything in it.
    pub fn law() -> Law {
        Law {
            start: 0.1,
            rate: 2.0,
            acceleration: 0.3,
            sines: vec![Sine { amplitude: 0.2, frequency: 3.0, phase: 0.5 }],
            profile: None,
        }
    }

    /// A point of body 0, one of body 1 which hangs on it, and an origin that moves freely, carried with body
    /// 1.
    pub fn crank() -> Site {
        Site { body: Some(0), point: Point::ground([0.1, 0.0]).along(0, Complex::new(0.6, 0.0)) }
    }

    /// See [`crank`].
    pub fn rod() -> Site {
        Site { body: Some(1), point: crank().point.along(1, Complex::new(0.5, 0.2)) }
    }

    /// See [`crank`].
    pub fn free() -> Site {
        Site { body: Some(1), point: Point::floating(2).along(1, Complex::new(-0.3, 0.7)) }
    }

    const START: [f64; 4] = [0.4, -0.9, 0.7, -0.2];
    const RATE: [f64; 4] = [1.5, -0.7, 0.4, 0.9];
    const ACCELERATION: [f64; 4] = [0.3, 2.0, -0.6, 1.1];

    /// Coordinates, elements and rates of two bodies and an origin in uniformly accelerated motion.
    pub fn configuration(t: f64) -> (Vec<DoubleDouble>, Vec<Complex<DoubleDouble>>, Vec<DoubleDouble>) {
        let (of, t) = (DoubleDouble::of, DoubleDouble::of(t));
        let phi: Vec<_> =
            (0..4).map(|k| of(START[k]) + t.scale(RATE[k]) + (t * t).scale(0.5 * ACCELERATION[k])).collect();
        let omega = (0..4).map(|k| of(RATE[k]) + t.scale(ACCELERATION[k])).collect();
        let z =
            vec![Complex::unit(phi[0]), Complex::unit(phi[1]), Complex::new(phi[2], phi[3]), Complex::ZERO];
        (phi, z, omega)
    }

    /// Jacobian, drive and convective term against differences of the row's own C along a motion.
    pub fn assert_derivatives(row: &ConstraintEquation) {
        let at = |t: f64| {
            let (phi, z, omega) = configuration(t);
            let mut jacobian = [DoubleDouble::ZERO; 4];
            let here = row.linearise(
                DoubleDouble::of(t),
                ConstraintArguments { phi: &phi, z: &z, omega: &omega },
                &mut jacobian,
            );
            let mut again = [DoubleDouble::ZERO; 4];
            let rest = row.differentiate(
                DoubleDouble::of(t),
                ConstraintArguments { phi: &phi, z: &z, omega: &omega },
                &mut again,
            );
            assert_eq!((jacobian, here.drive, here.convective), (again, rest.drive, rest.convective));
            (here, jacobian, omega)
        };
        // A power of two, so that the times are exact.
        let h = libm::exp2(-27.0);
        let (before, (now, g, omega), after) = (at(0.25 - h).0, at(0.25), at(0.25 + h).0);
        let first = (after.position - before.position).scale(0.5 / h);
        let second = (after.position + before.position - now.position - now.position).scale(1.0 / (h * h));
        let (mut c_rate, mut c_rate_rate) = (now.drive, now.convective);
        for k in 0..4 {
            c_rate += g[k] * omega[k];
            c_rate_rate += g[k].scale(ACCELERATION[k]);
        }
        assert!((first - c_rate).hi.abs() < 1e-12, "{} rate {first:?} {c_rate:?}", row.name);
        assert!((second - c_rate_rate).hi.abs() < 1e-12, "{} second {second:?} {c_rate_rate:?}", row.name);
    }
}
