//! A linear spring with a damper beside it, between any two points.
//!
//! ```text
//! D = P_a - P_b, L = |D|:   F on a = -(k (L - L0) + c L') D / L,   V = k (L - L0)² / 2
//! ```
//!
//! A spring of free length zero without damper needs no length: F = -k D.  A length of zero with L0 > 0 has
//! no direction; its force comes out as not a number and the method stops with the time.

use crate::arithmetic::{Complex, Over, Real};
use crate::dynamics::point::Point;

/// A spring of the compiled mechanism.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledSpring<C = f64> {
    /// Name in the scene.
    pub name: String,
    /// The bodies its ends are on; `None` for the ground.
    pub bodies: [Option<usize>; 2],
    /// The span D = P_a - P_b.
    pub span: Point<C>,
    /// k \[N/m\].
    pub stiffness: C,
    /// L0 \[m\].
    pub free_length: C,
    /// c \[N·s/m\].
    pub damping: C,
}

impl<C: Real> CompiledSpring<C> {
    /// True where the force depends on the length, and not on the span alone.
    pub fn needs_length(&self) -> bool {
        self.free_length != C::ZERO || self.damping != C::ZERO
    }

    /// Force \[N\] on the first end.
    #[inline(always)]
    pub fn force<T: Over<C>>(&self, z: &[Complex<T>], omega: &[T]) -> Complex<T> {
        let elastic = self.elastic(z);
        if self.damping == C::ZERO { elastic } else { elastic + self.drag(z, omega) }
    }

    /// Force \[N\] of the spring alone on the first end.
    #[inline(always)]
    pub fn elastic<T: Over<C>>(&self, z: &[Complex<T>]) -> Complex<T> {
        let span = self.span.position(z);
        if self.free_length == C::ZERO {
            return -span.times(T::constant(self.stiffness));
        }
        let length = span.norm_squared().sqrt();
        span.times(((T::constant(self.free_length) - length) / length).by(self.stiffness))
    }

    /// Force \[N\] on the first end of a spring whose stretch \[m\] is known better than its length.
    #[inline(always)]
    pub fn stretched<T: Over<C>>(&self, stretch: T, z: &[Complex<T>], omega: &[T]) -> Complex<T> {
        let span = self.span.position(z);
        let elastic = -span.times((stretch / span.norm_squared().sqrt()).by(self.stiffness));
        if self.damping == C::ZERO { elastic } else { elastic + self.drag(z, omega) }
    }

    /// L - L0 \[m\] of a span D, without a square root in the difference.
    pub fn stretch<T: Over<C>>(&self, span: Complex<T>) -> T {
        let square = span.norm_squared();
        let free = T::constant(self.free_length);
        (square - free * free) / (square.sqrt() + free)
    }

    /// Force \[N\] of the damper alone on the first end.
    #[inline(always)]
    pub fn drag<T: Over<C>>(&self, z: &[Complex<T>], omega: &[T]) -> Complex<T> {
        let span = self.span.position(z);
        let rate = span.dot(self.span.velocity(z, omega));
        -span.times((rate / span.norm_squared()).by(self.damping))
    }

    /// Stored energy \[J\].
    #[inline(always)]
    pub fn energy<T: Over<C>>(&self, z: &[Complex<T>]) -> T {
        let square = self.span.position(z).norm_squared();
        let stretch = if self.free_length == C::ZERO {
            square.sqrt()
        } else {
            square.sqrt() - T::constant(self.free_length)
        };
        (stretch * stretch).by(C::of(0.5) * self.stiffness)
    }

    /// Power \[W\] of the damper on the bodies, never positive.
    #[inline(always)]
    pub fn drag_power<T: Over<C>>(&self, z: &[Complex<T>], omega: &[T]) -> T {
        self.drag(z, omega).dot(self.span.velocity(z, omega))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spring(free_length: f64, damping: f64) -> CompiledSpring {
        let span = Point::ground([0.3, 0.0]).along(0, Complex::new(0.4, 0.0));
        CompiledSpring {
            name: "s".into(),
            bodies: [None, Some(0)],
            span,
            stiffness: 7.0,
            free_length,
            damping,
        }
    }

    #[test]
    fn the_force_is_minus_the_gradient_of_the_energy() {
        for spring in [spring(0.4, 0.0), spring(0.0, 0.0)] {
            let (phi, h) = (0.9, 1e-5);
            let energy = |phi: f64| spring.energy(&[Complex::unit(phi)]);
            let mut load = [0.0];
            spring.span.pull(spring.force(&[Complex::unit(phi)], &[0.0]), &[Complex::unit(phi)], &mut load);
            assert!((load[0] + (energy(phi + h) - energy(phi - h)) / (2.0 * h)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_damper_takes_energy_out() {
        let (spring, z, omega) = (spring(0.4, 2.0), [Complex::unit(0.9)], [1.3]);
        let mut load = [0.0];
        spring.span.pull(spring.force(&z, &omega) - spring.elastic(&z), &z, &mut load);
        assert!(spring.drag_power(&z, &omega) < 0.0);
        assert!((load[0] * omega[0] - spring.drag_power(&z, &omega)).abs() < 1e-15);
    }
}
