//! A torsion spring with a damper beside it, between the angles of two bodies or of a body and the ground.
//!
//! ```text
//! theta = q_a - q_b:   torque on a = -(k (theta - theta0) + c theta'),   the opposite on b,
//!     V = k (theta - theta0)² / 2
//! ```
//!
//! Whole turns count: a mechanism with a torsion spring is integrated in winding angles.

use crate::arithmetic::{Over, Real, Scalar};

/// A torsion spring of the compiled mechanism.
#[derive(Clone, Debug, PartialEq)]
pub struct Torsion<C = f64> {
    /// Name in the scene.
    pub name: String,
    /// Body a.
    pub body: usize,
    /// Body b; `None` for the ground.
    pub base: Option<usize>,
    /// k \[N·m/rad\].
    pub stiffness: C,
    /// theta0 \[rad\].
    pub free_angle: C,
    /// c \[N·m·s/rad\].
    pub damping: C,
}

impl<C: Real> Torsion<C> {
    /// What the body has more than its base.
    #[inline(always)]
    pub fn between<T: Scalar>(&self, values: &[T]) -> T {
        match self.base {
            Some(base) => values[self.body] - values[base],
            None => values[self.body],
        }
    }

    /// Torque \[N·m\] on body a at winding angles `phi` \[rad\] and rates `omega` \[rad/s\].
    #[inline(always)]
    pub fn torque<T: Over<C>>(&self, phi: &[T], omega: &[T]) -> T {
        let elastic = self.elastic(phi);
        if self.damping == C::ZERO { elastic } else { elastic + self.drag(omega) }
    }

    /// Torque \[N·m\] of the spring alone on body a.
    #[inline(always)]
    pub fn elastic<T: Over<C>>(&self, phi: &[T]) -> T {
        (T::constant(self.free_angle) - self.between(phi)).by(self.stiffness)
    }

    /// Torque \[N·m\] of the damper alone on body a.
    #[inline(always)]
    pub fn drag<T: Over<C>>(&self, omega: &[T]) -> T {
        -self.between(omega).by(self.damping)
    }

    /// Adds the generalized forces \[N·m\] of a torque on body a.
    #[inline(always)]
    pub fn pull<T: Scalar>(&self, torque: T, load: &mut [T]) {
        load[self.body] += torque;
        if let Some(base) = self.base {
            load[base] -= torque;
        }
    }

    /// Stored energy \[J\].
    #[inline(always)]
    pub fn energy<T: Over<C>>(&self, phi: &[T]) -> T {
        let twist = self.between(phi) - T::constant(self.free_angle);
        (twist * twist).by(C::of(0.5) * self.stiffness)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_torque_is_minus_the_gradient_of_the_energy_and_the_damper_takes_energy_out() {
        let torsion = Torsion {
            name: "t".into(),
            body: 1,
            base: Some(0),
            stiffness: 3.0,
            free_angle: 0.2,
            damping: 0.5,
        };
        let (phi, omega, h) = ([0.4, 9.0], [1.0, -2.0], 1e-4);
        let mut load = [0.0; 2];
        torsion.pull(torsion.elastic(&phi), &mut load);
        for k in 0..2 {
            let energy = |by: f64| {
                torsion.energy(&std::array::from_fn::<f64, 2, _>(|i| phi[i] + if i == k { by } else { 0.0 }))
            };
            assert!((load[k] + (energy(h) - energy(-h)) / (2.0 * h)).abs() < 1e-9);
        }
        assert!(torsion.drag(&omega) * torsion.between(&omega) < 0.0);
    }
}
