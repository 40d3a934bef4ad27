//! Friction in an evaluation of the equations: the forces of what slides, and the normal forces.

use super::super::constraint::ConstraintArguments;
use super::super::energy::moment;
use super::super::kernel::{Kernel, dot};
use super::super::{Mechanism, Time, tree};
use super::{CompiledFriction, FrictionMode, Normal, forces, size};
use crate::arithmetic::{Complex, Real};

/// What one unit of tau does.
struct Response<T> {
    acceleration: Vec<T>,
    multiplier: Vec<T>,
    normal: Vec<Complex<T>>,
}

impl<T: Real> Kernel<T> {
    /// Adds the friction of what slides to accelerations and multipliers without it.
    #[cold]
    pub(in crate::dynamics) fn slide(&mut self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) {
        let n = phi.len();
        let sliding: Vec<(&CompiledFriction, f64)> = mechanism.sliding().collect();
        self.friction.clear();
        self.friction.resize(sliding.len(), T::ZERO);
        self.friction_rows.clear();
        self.friction_rows.resize(sliding.len() * n, T::ZERO);
        self.regularity = T::ONE.value();
        if sliding.is_empty() {
            return;
        }
        let at = ConstraintArguments { phi, z: &self.z, omega };
        for ((friction, _), row) in sliding.iter().zip(self.friction_rows.chunks_exact_mut(n)) {
            friction.tangent.differentiate(t, at, row);
        }
        let needed = mechanism.needed_forces(t, at, &self.load);
        let carried = mechanism.transmitted(t, at, &self.multiplier, needed);
        let start: Vec<Complex<T>> = (sliding.iter())
            .map(|(friction, _)| mechanism.normal_force(friction, &self.multiplier, &carried))
            .collect();
        let responses: Vec<Response<T>> =
            (0..sliding.len()).map(|j| self.response(mechanism, t, at, &sliding, j)).collect();
        let places: Vec<(Normal, T)> =
            (sliding.iter()).map(|&(friction, coefficient)| (friction.normal, T::of(coefficient))).collect();
        self.regularity = forces(&places, &start, |j, k| responses[k].normal[j], &mut self.friction);
        for (response, &tau) in responses.iter().zip(&self.friction) {
            for (load, &change) in self.load.iter_mut().zip(&response.acceleration) {
                *load += change * tau;
            }
            for (multiplier, &change) in self.multiplier.iter_mut().zip(&response.multiplier) {
                *multiplier += change * tau;
            }
        }
    }

    /// What a unit of tau at the j-th place that slides does to accelerations, multipliers and normal forces.
    fn response(
        &self,
        mechanism: &Mechanism,
        t: Time,
        at: ConstraintArguments<T>,
        sliding: &[(&CompiledFriction, f64)],
        j: usize,
    ) -> Response<T> {
        let (n, rows) = (self.z.len(), mechanism.constraints.len());
        let mut acceleration: Vec<T> = self.friction_rows[j * n..(j + 1) * n].iter().map(|&d| -d).collect();
        tree::solve::<T, 0>(n, &self.mass, &self.pivot, &mut acceleration);
        let mut multiplier: Vec<T> =
            (0..rows).map(|r| dot(&self.jacobian[r * n..(r + 1) * n], &acceleration)).collect();
        tree::solve::<T, 0>(rows, &self.schur, &self.schur_pivot, &mut multiplier);
        for (r, &multiplier) in multiplier.iter().enumerate() {
            for k in 0..n {
                acceleration[k] -= self.minv_jt[r * n + k] * multiplier;
            }
        }
        let mut needed = mechanism.inertia_forces(&self.z, &acceleration);
        sliding[j].0.tangent.add_force(moment(t), at, T::ONE, &mut needed);
        let carried = mechanism.transmitted(t, at, &multiplier, needed);
        let normal = (sliding.iter())
            .map(|(friction, _)| mechanism.normal_force(friction, &multiplier, &carried))
            .collect();
        Response { acceleration, multiplier, normal }
    }

    /// The forces of friction \[N·m, N\], as multipliers of the relative displacements, and the sizes of the
    /// normal forces \[N\] of all places; zeros for those that are open.  After
    /// [`accelerate`](Kernel::accelerate).
    pub fn friction_forces(&self, mechanism: &Mechanism, t: Time, phi: &[T], omega: &[T]) -> Vec<[T; 2]> {
        let at = ConstraintArguments { phi, z: &self.z, omega };
        let mut needed = mechanism.needed_forces(t, at, &self.load);
        for ((friction, _), &tau) in mechanism.sliding().zip(&self.friction) {
            friction.tangent.add_force(moment(t), at, tau, &mut needed);
        }
        let carried = mechanism.transmitted(t, at, &self.multiplier, needed);
        let mut slid = self.friction.iter();
        let mut stuck = self.multiplier[mechanism.constraints.len() - mechanism.sticking()..].iter();
        (mechanism.frictions.iter().zip(&mechanism.modes))
            .map(|(friction, mode)| {
                let tau = match mode {
                    FrictionMode::Open => return [T::ZERO; 2],
                    FrictionMode::Stick(_) => stuck.next(),
                    FrictionMode::Slip(_) | FrictionMode::Strained(_) => slid.next(),
                };
                let force = mechanism.normal_force(friction, &self.multiplier, &carried);
                [tau.copied().unwrap_or(T::ZERO), size(friction.normal, force).0]
            })
            .collect()
    }

    /// Power that friction takes \[W\], after an evaluation.
    #[inline(always)]
    pub fn friction_power(&self, omega: &[T]) -> T {
        let n = omega.len();
        self.friction
            .iter()
            .enumerate()
            .fold(T::ZERO, |sum, (j, &tau)| sum + tau * dot(&self.friction_rows[j * n..(j + 1) * n], omega))
    }
}
