//! The start of a mechanism whose rigid spring vibrates: the vibration goes along M⁻¹ Gᵀ, and what is left of
//! the start without it moves along the rod.
//!
//! ```text
//! q = q0 - M⁻¹ Gᵀ s⁻¹ g(q0),      w = w0 - M⁻¹ Gᵀ s⁻¹ (G w0),      s = G M⁻¹ Gᵀ
//! ```
//!
//! The shortest way in the metric of the mass matrix, not in angles: energy and momentum of the vibration are
//! those of the motion taken out, and the motion left has all the rest of both.

use super::newton::AssemblyProblem;
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::scene::{Given, Scene};

/// Steps onto the rod; each squares what is left.
const STEPS: usize = 6;

fn given(scene: &Scene, bar: usize) -> Given {
    scene.given.get(bar).copied().unwrap_or(Given::ANGLE_AND_RATE)
}

impl Mechanism {
    /// The start with all that the scene gives, where springs need not have their free lengths; what it does
    /// not give is as the rows have it.
    pub(in crate::dynamics) fn start_with_vibration(&self, scene: &Scene) -> Motion {
        let (mut motion, written) = (self.start(scene), self.start_as_given(scene));
        for bar in 0..self.bodies.len() {
            if given(scene, bar).phi {
                (motion.phi[bar], motion.turns[bar]) = (written.phi[bar], written.turns[bar]);
            }
            if given(scene, bar).omega {
                motion.omega[bar] = written.omega[bar];
            }
        }
        self.put_translations(scene, &mut motion);
        motion
    }

    /// Makes the start that without the vibration of its only row, a rod.
    pub(in crate::dynamics) fn settle_vibration(&mut self, scene: &Scene, mut motion: Motion) {
        let mut kernel = Kernel::<DoubleDouble>::dense(self);
        for _ in 0..STEPS {
            kernel.linearise_at::<0>(self, Time::default(), &motion.phi, &motion.omega);
            kernel.multiplier[0] = kernel.rows[0].position;
            kernel.solve_rows();
            kernel.multiplier_accelerations();
            motion.phi.iter_mut().zip(&kernel.load).for_each(|(q, &change)| *q -= change);
        }
        kernel.linearise_at::<0>(self, Time::default(), &motion.phi, &motion.omega);
        kernel.multiplier[0] = kernel.row_rate(0, &motion.omega);
        kernel.solve_rows();
        kernel.multiplier_accelerations();
        motion.omega.iter_mut().zip(&kernel.load).for_each(|(rate, &change)| *rate -= change);
        let of = |bar: usize| given(scene, bar);
        let problem = AssemblyProblem::new(self, scene, &[], &of);
        let tau = DoubleDouble::TAU;
        let unwound = |(q, &turns): (&DoubleDouble, &i64)| *q + tau.scale(turns as f64);
        let full: Vec<DoubleDouble> = motion.phi.iter().zip(&motion.turns).map(unwound).collect();
        let mut changes = problem.changes(&full, &problem.aims);
        changes.extend(problem.rate_changes(&problem.rate_aims(scene, &of), &full, &motion.omega));
        self.assembly.changes = changes;
        self.assembly.start = Some(motion);
    }
}
