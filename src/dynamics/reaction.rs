//! Hinge forces by Newton–Euler: what a hinge carries is what everything beyond it needs.
//!
//! ```text
//! F = Σ over the subtree  m (a_c - g) - applied forces - forces of rows
//! ```
//!
//! No unknowns are added for it; it equals the multipliers of the pinned form.  A hinge that closes a loop
//! carries the force of its own rows.
//!
//! Signs: the force of a hinge or weld is the one its first body, in the scene's order, exerts on its second,
//! whichever of the two is the ground.

use super::compile::Joint;
use super::constraint::{ConstraintArguments, ConstraintEquation};
use super::energy::moment;
use super::forest::turning_acceleration;
use super::kernel::Kernel;
use super::{Mechanism, Time};
use crate::arithmetic::{Complex, Over, Real, Scalar};

impl<C: Real> ConstraintEquation<C> {
    /// Adds what bodies need against the forces of this row with this multiplier, at a time \[s\].
    pub(super) fn add_force<T: Over<C>>(
        &self,
        time: T,
        at: ConstraintArguments<T>,
        multiplier: T,
        needed: &mut [Complex<T>],
    ) {
        if let Some(push) = &self.push {
            let force = push.direction(at.z).times(multiplier);
            if let Some(body) = push.on {
                needed[body] += force;
            }
            if let Some(body) = push.from {
                needed[body] -= force;
            }
        }
        if let Some(points) = self.aim.as_ref().and_then(|aim| aim.at_points.as_ref()) {
            points.forces(time, at, |body, force| needed[body] += force.times(multiplier));
        }
    }
}

impl Mechanism {
    /// Accelerations \[m/s²\] of the centres of mass.
    pub fn centre_accelerations<T: Scalar>(
        &self,
        z: &[Complex<T>],
        omega: &[T],
        alpha: &[T],
    ) -> Vec<Complex<T>> {
        let mut found = Vec::new();
        self.write_centre_accelerations(z, omega, alpha, &mut found);
        found
    }

    /// Writes them.
    pub(super) fn write_centre_accelerations<T: Scalar>(
        &self,
        z: &[Complex<T>],
        omega: &[T],
        alpha: &[T],
        found: &mut Vec<Complex<T>>,
    ) {
        found.clear();
        found.resize(self.bodies.len(), Complex::ZERO);
        self.forest.origin_accelerations(z, omega, alpha, found);
        for (k, (found, body)) in found.iter_mut().zip(&self.bodies).enumerate() {
            *found += turning_acceleration(z[k].turn(body.centre), omega[k], alpha[k]);
        }
    }

    /// Force \[N\] of the first body of each hinge on the second (in the scene's order), from an evaluation
    /// of the equations at these angles \[rad\] and rates \[rad/s\]: its `load` must hold the accelerations,
    /// its `multiplier` those of all rows.
    pub fn hinge_forces(
        &self,
        t: Time,
        kernel: &Kernel<f64>,
        phi: &[f64],
        omega: &[f64],
    ) -> Vec<Complex<f64>> {
        let mut needed = self.centre_accelerations(&kernel.z, omega, &kernel.load);
        let mut forces = Vec::new();
        self.write_hinge_forces(t, kernel, phi, omega, &mut needed, &mut forces);
        forces
    }

    /// Writes them, of accelerations of the centres in `needed`.
    pub(super) fn write_hinge_forces(
        &self,
        t: Time,
        kernel: &Kernel<f64>,
        phi: &[f64],
        omega: &[f64],
        needed: &mut [Complex<f64>],
        forces: &mut Vec<Complex<f64>>,
    ) {
        let at = ConstraintArguments { phi, z: &kernel.z, omega };
        self.turn_into_needed(t, at, needed);
        for ((friction, _), &tau) in self.sliding().zip(&kernel.friction) {
            friction.tangent.add_force(moment(t), at, tau, needed);
        }
        forces.clear();
        self.transmit(t, at, &kernel.multiplier, needed, forces);
    }

    /// The force \[N\] that every body needs from its joints and constraints at these accelerations.
    pub(super) fn needed_forces<T: Real>(
        &self,
        t: Time,
        at: ConstraintArguments<T>,
        alpha: &[T],
    ) -> Vec<Complex<T>> {
        let mut needed = self.centre_accelerations(at.z, at.omega, alpha);
        self.turn_into_needed(t, at, &mut needed);
        needed
    }

    /// Replaces the acceleration of the centre of every body by the force that it needs.
    fn turn_into_needed<T: Real>(&self, t: Time, at: ConstraintArguments<T>, needed: &mut [Complex<T>]) {
        let ConstraintArguments { z, omega, .. } = at;
        for (needed, body) in needed.iter_mut().zip(&self.bodies) {
            *needed = (*needed - Complex::of(self.gravity)).times(T::of(body.mass));
        }
        for spring in &self.springs {
            let force = spring.force(z, omega);
            for (end, force) in spring.bodies.iter().zip([force, -force]) {
                if let Some(body) = *end {
                    needed[body] -= force;
                }
            }
        }
        for action in &self.actions {
            needed[action.body] -= action.force(action.factor(t), z);
        }
        for user in &self.forces {
            user.forces(moment(t), at, |body, force| needed[body] -= force);
        }
    }

    /// The share of accelerations in [`Mechanism::needed_forces`].
    pub(super) fn inertia_forces<T: Real>(&self, z: &[Complex<T>], alpha: &[T]) -> Vec<Complex<T>> {
        let mut needed = self.centre_accelerations(z, &vec![T::ZERO; alpha.len()], alpha);
        for (needed, body) in needed.iter_mut().zip(&self.bodies) {
            *needed = needed.times(T::of(body.mass));
        }
        needed
    }

    /// The forces of the hinges and welds under which each body gets the force \[N\] it needs, less what rows
    /// with these multipliers push it with.
    pub(super) fn transmitted<T: Real>(
        &self,
        t: Time,
        at: ConstraintArguments<T>,
        multipliers: &[T],
        mut needed: Vec<Complex<T>>,
    ) -> Vec<Complex<T>> {
        let mut forces = Vec::with_capacity(self.joints.len());
        self.transmit(t, at, multipliers, &mut needed, &mut forces);
        forces
    }

    /// Appends them; what each body passes on takes the place of what it needs.
    fn transmit<T: Real>(
        &self,
        t: Time,
        at: ConstraintArguments<T>,
        multipliers: &[T],
        carried: &mut [Complex<T>],
        forces: &mut Vec<Complex<T>>,
    ) {
        for (row, &multiplier) in self.constraints.iter().zip(multipliers) {
            row.add_force(moment(t), at, multiplier, carried);
        }
        self.pass_on(multipliers, carried, forces);
    }

    /// The same where what rows push the bodies with is in what these need.
    pub(super) fn pass_on<T: Scalar>(
        &self,
        multipliers: &[T],
        carried: &mut [Complex<T>],
        forces: &mut Vec<Complex<T>>,
    ) {
        for &body in self.forest.order.iter().rev() {
            if let Some(parent) = self.forest.hangs[body].origin_point.parent() {
                let force = carried[body];
                carried[parent] += force;
            }
        }
        let force = |joint: &Joint| match (joint.outer, joint.row) {
            (Some(outer), _) if joint.between[1] == Some(outer) => carried[outer],
            (Some(outer), _) => -carried[outer],
            // The rows push the first body by -lambda, and the second by lambda.
            (None, Some(row)) => Complex::new(multipliers[row], multipliers[row + 1]),
            (None, None) => Complex::ZERO,
        };
        forces.extend(self.joints.iter().map(force));
    }
}
