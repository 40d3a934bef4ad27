//! Gears and cams in natural coordinates: rows of which a formula of time and place is taken off.
//!
//! ```text
//! C = Q(z) - f(t, phi, z, zeta),   phi_k = arg z_k with its whole turns,   C' = Q' - f_q q' - f_t
//! gradient on z_k: -i z_k df/dphi_k;  on an origin: -(df/dx, df/dy)                        at |z| = 1
//! ```
//!
//! All derivatives are those of [`Aim`], in angles.  Of the rows |z| = 1, which are kept beside it, this one
//! has the freedom to take any part along z: with none the multiplier is that of the form in angles.

use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar};
use crate::dynamics::constraint::{Aim, ConstraintArguments, Linearised};
use crate::dynamics::{Mechanism, Time};
use std::sync::Arc;

/// A guide and the formula that is taken off it.
#[derive(Clone, Debug, PartialEq)]
pub struct GuideCoupling {
    /// The number of the guide.
    pub guide: usize,
    aim: Arc<Aim>,
}

/// Angles with their whole turns at a position from which others are less than half a turn away.
#[derive(Clone, Debug, Default)]
pub struct NearestTurns {
    z: Vec<Complex<DoubleDouble>>,
    /// One a body \[rad\].
    angles: Vec<DoubleDouble>,
}

/// What the formulas of all couplings come to at one position.
#[derive(Clone, Debug, Default)]
pub struct CouplingTerms<T> {
    /// Gradients (couplings × n).
    pub gradients: Vec<Complex<T>>,
    /// C, C_t and C'' at zero acceleration of -f, coupling by coupling.
    pub rows: Vec<Linearised<T>>,
    phi: Vec<T>,
    omega: Vec<T>,
    slopes: Vec<T>,
}

/// The couplings among guides with these rows of a mechanism.
pub(super) fn couplings(mechanism: &Mechanism, rows: impl Iterator<Item = usize>) -> Vec<GuideCoupling> {
    let of = |(guide, row): (usize, usize)| {
        Some(GuideCoupling { guide, aim: Arc::clone(mechanism.constraints[row].aim.as_ref()?) })
    };
    rows.enumerate().filter_map(of).collect()
}

impl GuideCoupling {
    /// The bodies whose angle it gives; none where it gives a travel.
    pub fn angles(&self) -> &[usize] {
        &self.aim.angles
    }
}

impl NearestTurns {
    /// Takes over elements and the whole turns of bodies.
    pub fn set(&mut self, z: &[Complex<DoubleDouble>], turns: &[i64]) {
        self.z.clear();
        self.z.extend_from_slice(&z[..turns.len()]);
        self.angles.clear();
        let whole = |(z, &turns): (&Complex<DoubleDouble>, &i64)| {
            super::angle(*z) + DoubleDouble::TAU.scale(turns as f64)
        };
        self.angles.extend(z.iter().zip(turns).map(whole));
    }

    /// Angles of elements, then the coordinates of origins.
    fn write<T: Real>(&self, z: &[Complex<T>], phi: &mut [T]) {
        let bodies = self.z.len();
        for k in 0..bodies {
            let z0 = Complex::new(T::split(self.z[k].re).0, T::split(self.z[k].im).0);
            phi[k] = T::split(self.angles[k]).0 + z0.cross(z[k]).atan2(z0.dot(z[k]));
        }
        for x in (bodies..z.len()).step_by(2) {
            (phi[x], phi[x + 1]) = (z[x].re, z[x].im);
        }
    }
}

impl<T: Real> CouplingTerms<T> {
    /// Finds all of it at elements `z` with rates `rate`, which count for C'' only and may be left out.
    pub fn evaluate(
        &mut self,
        couplings: &[GuideCoupling],
        (t, whole): (Time, &NearestTurns),
        z: &[Complex<T>],
        rate: &[Complex<T>],
    ) {
        let (n, bodies) = (z.len(), whole.z.len());
        self.gradients.clear();
        self.gradients.resize(couplings.len() * n, Complex::ZERO);
        self.rows.clear();
        for part in [&mut self.phi, &mut self.omega, &mut self.slopes] {
            part.resize(n, T::ZERO);
        }
        whole.write(z, &mut self.phi);
        for (k, &rate) in rate.iter().enumerate() {
            match k < bodies {
                true => self.omega[k] = z[k].cross(rate),
                false if (k - bodies) % 2 == 0 => {
                    (self.omega[k], self.omega[k + 1]) = (rate.re, rate.im);
                }
                false => {}
            }
        }
        for (coupling, gradient) in couplings.iter().zip(self.gradients.chunks_mut(n)) {
            self.slopes.fill(T::ZERO);
            let at = ConstraintArguments { phi: &self.phi, z, omega: &self.omega };
            let mut row = Linearised { position: T::ZERO, drive: T::ZERO, convective: T::ZERO };
            coupling.aim.subtract(t, at, &mut self.slopes, &mut row);
            for k in coupling.aim.coordinates() {
                let slope = self.slopes[k];
                match k < bodies {
                    true => gradient[k] = z[k].left().times(slope),
                    false if (k - bodies) % 2 == 0 => gradient[k].re = slope,
                    false => gradient[k - 1].im = slope,
                }
            }
            self.rows.push(row);
        }
    }

    /// The derivative of -f along `x` at fixed time, of the coupling with this number.
    pub fn slip(&self, coupling: usize, x: &[Complex<T>]) -> T {
        let gradient = &self.gradients[coupling * x.len()..(coupling + 1) * x.len()];
        gradient.iter().zip(x).fold(T::ZERO, |sum, (gradient, &x)| sum + gradient.dot(x))
    }
}
