//! Applied forces and torques: constant, or times a law.
//!
//! ```text
//! force f at P, fixed in the ground:   F = f s(t)          torque m on a, the opposite on b:   m s(t)
//! force f at P, turning with body a:   F = f z_a s(t)
//! ```
//!
//! They are accounted for as work, constant ones as well.

use crate::arithmetic::{Complex, Over, Real};
use crate::dynamics::Time;
use crate::dynamics::law::Law;
use crate::dynamics::point::Point;

/// An applied force or torque of the compiled mechanism.
#[derive(Clone, Debug, PartialEq)]
pub struct AppliedAction<C = f64> {
    /// Name in the scene.
    pub name: String,
    /// The body it acts on.
    pub body: usize,
    /// Force or torque.
    pub kind: Applied<C>,
    /// What it is multiplied by; `None`: one.
    pub law: Option<Law<C>>,
}

/// What acts.
#[derive(Clone, Debug, PartialEq)]
pub enum Applied<C = f64> {
    /// A force \[N\] at a point, in the frame of the body where it `follows`.
    Force {
        /// Where it acts.
        point: Point<C>,
        /// The force \[N\].
        force: Complex<C>,
        /// True where it turns with the body.
        follows: bool,
    },
    /// A torque \[N·m\], the opposite of which acts on the base.
    Torque {
        /// The torque \[N·m\].
        torque: C,
        /// The body that takes the opposite; `None` for the ground.
        base: Option<usize>,
    },
}

impl AppliedAction {
    /// What it is multiplied by at a time.
    #[inline(always)]
    pub fn factor<T: Real>(&self, t: Time) -> T {
        self.law.as_ref().map_or(T::ONE, |law| law.value(t))
    }
}

impl<C: Real> AppliedAction<C> {
    /// The force \[N\]; zero for a torque.
    #[inline(always)]
    pub fn force<T: Over<C>>(&self, factor: T, z: &[Complex<T>]) -> Complex<T> {
        match &self.kind {
            Applied::Force { force, follows: true, .. } => z[self.body].turn(*force).times(factor),
            Applied::Force { force, .. } => Complex::of(*force).times(factor),
            Applied::Torque { .. } => Complex::ZERO,
        }
    }

    /// Adds its generalized forces \[N·m, N\].
    #[inline(always)]
    pub fn pull<T: Over<C>>(&self, factor: T, z: &[Complex<T>], load: &mut [T]) {
        match &self.kind {
            Applied::Force { point, .. } => point.pull(self.force(factor, z), z, load),
            Applied::Torque { torque, base } => {
                load[self.body] += factor.by(*torque);
                if let Some(base) = base {
                    load[*base] -= factor.by(*torque);
                }
            }
        }
    }

    /// Its power \[W\].
    #[inline(always)]
    pub fn power<T: Over<C>>(&self, factor: T, z: &[Complex<T>], omega: &[T]) -> T {
        match &self.kind {
            Applied::Force { point, .. } => self.force(factor, z).dot(point.velocity(z, omega)),
            Applied::Torque { torque, base } => {
                let rate = base.map_or(omega[self.body], |base| omega[self.body] - omega[base]);
                (rate * factor).by(*torque)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_is_that_of_the_generalized_forces() {
        let point =
            Point::ground([0.1, 0.2]).along(0, Complex::new(0.6, 0.0)).along(1, Complex::new(0.2, -0.4));
        let (z, omega) = ([Complex::unit(0.4), Complex::unit(-1.0)], [1.5, -0.7]);
        let force = Complex::new(2.0, -3.0);
        for kind in [
            Applied::Force { point: point.clone(), force, follows: false },
            Applied::Force { point, force, follows: true },
            Applied::Torque { torque: 0.7, base: Some(0) },
        ] {
            let action = AppliedAction { name: "a".into(), body: 1, kind, law: None };
            let mut load = [0.0; 2];
            action.pull(1.3, &z, &mut load);
            let power = load[0] * omega[0] + load[1] * omega[1];
            assert!((power - action.power(1.3, &z, &omega)).abs() < 1e-14 && power != 0.0);
        }
    }
}
