//! How far apart two motions are by the torques of their motors.

use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::{Mechanism, Motion};

/// Torques and forces of motors, gears and cams among them, from positions and rates.
pub(super) struct Torques {
    kernel: Kernel<f64>,
    of: [Vec<f64>; 2],
}

impl Torques {
    /// `None` where there are no motors, or torques depend on what holds a point or switches at the moment.
    pub(super) fn new(mechanism: &Mechanism) -> Option<Self> {
        let is_smooth = mechanism.contacts.is_empty() && !mechanism.is_switched();
        let has_motors = (0..mechanism.constraints.len()).any(|row| mechanism.is_motor(row));
        (is_smooth && has_motors)
            .then(|| Self { kernel: Kernel::new(mechanism), of: [Vec::new(), Vec::new()] })
    }

    /// The largest difference between two motions, and the largest torque of the second.
    pub(super) fn apart(&mut self, mechanism: &Mechanism, motions: [&Motion; 2]) -> [f64; 2] {
        let Self { kernel, of } = self;
        for (torques, motion) in of.iter_mut().zip(motions) {
            let [phi, omega] = motion.rounded();
            kernel.accelerations(mechanism, motion.time, &phi, &omega, Bias::default());
            mechanism.share_multipliers(motion.time, kernel, &phi, &omega);
            torques.clear();
            let multipliers = kernel.multiplier.iter().enumerate();
            torques
                .extend(multipliers.filter(|&(row, _)| mechanism.is_motor(row)).map(|(_, &torque)| torque));
        }
        let [one, other] = of;
        one.iter()
            .zip(other)
            .fold([0.0; 2], |[apart, most], (a, b)| [apart.max((*a - *b).abs()), most.max(b.abs())])
    }
}
