//! The Jacobian of the equations of motion: the formulas of [`kernel`](super::kernel) evaluated on dual
//! numbers, four directions at once.
//!
//! ```text
//! a(t, q, w):      A_q = da/dq,  A_w = da/dw,  a_t = da/dt
//!     rows by multipliers included (index 1)
//! y = (q, w, W):   y' = (w, a, P)       dy'/dy = [0 1 0; A_q A_w 0; P_q P_w 0]
//! q = S u + s(t):  u'' = R a
//!     U_u = R A_q S,  U_v = R A_w S         R takes the rows of the independent coordinates
//! ```
//!
//! The last line holds because given angles keep their rows whatever the independent coordinates do.

use super::kernel::{Bias, Kernel};
use super::partition::CoordinatePartition;
use super::{Mechanism, Time};
use crate::arithmetic::{Dual, Scalar};

/// Directions taken at once.
pub const LANES: usize = 4;

/// A dual number of the Jacobian's width.
pub type Slopes = Dual<LANES>;

/// Evaluates the Jacobian of a mechanism; nothing is allocated after [`Jacobian::new`].
#[derive(Clone, Debug)]
pub struct Jacobian {
    kernel: Kernel<Slopes>,
    phi: Vec<Slopes>,
    omega: Vec<Slopes>,
    /// da/dq and, beside it, da/dw, row by row (n × 2n) \[1/s², 1/s\].
    pub acceleration: Vec<f64>,
    /// Derivatives of the powers of motors, dampers and applied forces, of the stabilizer and of dry
    /// friction, by q and by w (3 × 2n) \[W, W·s\].
    pub power: Vec<f64>,
}

impl Jacobian {
    /// Scratch space for a mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let n = mechanism.coordinates();
        Self {
            kernel: Kernel::new(mechanism),
            phi: vec![Slopes::ZERO; n],
            omega: vec![Slopes::ZERO; n],
            acceleration: vec![0.0; 2 * n * n],
            power: vec![0.0; 6 * n],
        }
    }

    /// Evaluates it at coordinates `phi` \[rad, m\] and rates `omega` \[rad/s, m/s\]; what cannot be computed
    /// comes out non-finite.
    pub fn evaluate(&mut self, mechanism: &Mechanism, t: Time, phi: &[f64], omega: &[f64], bias: Bias) {
        let n = phi.len();
        for first in (0..2 * n).step_by(LANES) {
            let lane = |direction: usize| direction.wrapping_sub(first);
            for k in 0..n {
                self.phi[k] = Slopes::unknown(phi[k], lane(k));
                self.omega[k] = Slopes::unknown(omega[k], lane(n + k));
            }
            self.kernel.accelerate::<0>(mechanism, t, &self.phi, &self.omega, bias);
            let (work, stabilizer) = self.kernel.powers(mechanism, t, &self.phi, &self.omega);
            for lane in 0..LANES.min(2 * n - first) {
                for k in 0..n {
                    self.acceleration[2 * n * k + first + lane] = self.kernel.load[k].slope[lane];
                }
                self.power[first + lane] = work.slope[lane];
                self.power[2 * n + first + lane] = stabilizer.slope[lane];
                if !mechanism.frictions.is_empty() {
                    self.power[4 * n + first + lane] = self.kernel.friction_power(&self.omega).slope[lane];
                }
            }
        }
    }

    /// Writes dy'/dy of y = (q, w) and as many accounts of work as `y_by_y` has room for, row by row (d × d).
    pub fn fill(&self, dimension: usize, y_by_y: &mut [f64]) {
        let n = self.phi.len();
        y_by_y.fill(0.0);
        for (i, row) in y_by_y.chunks_exact_mut(dimension).enumerate() {
            match i {
                i if i < n => row[n + i] = 1.0,
                i if i < 2 * n => {
                    row[..2 * n].copy_from_slice(&self.acceleration[2 * n * (i - n)..2 * n * (i - n + 1)])
                }
                _ => row[..2 * n].copy_from_slice(&self.power[2 * n * (i - 2 * n)..2 * n * (i - 2 * n + 1)]),
            }
        }
    }

    /// Writes dy'/dy of y = (u, u', work) in the independent coordinates u of `partition`, row by row.
    pub fn fill_independent(&self, partition: &CoordinatePartition, y_by_y: &mut [f64]) {
        let (n, f) = (self.phi.len(), partition.count());
        y_by_y.fill(0.0);
        for (i, row) in y_by_y.chunks_exact_mut(2 * f + 1).enumerate() {
            let derivatives = match i {
                i if i < f => {
                    row[f + i] = 1.0;
                    continue;
                }
                i if i < 2 * f => {
                    &self.acceleration
                        [2 * n * partition.independent[i - f]..2 * n * (partition.independent[i - f] + 1)]
                }
                _ => &self.power[..2 * n],
            };
            for (k, dependent_angle) in partition.bodies.iter().enumerate() {
                if let Some(base) = dependent_angle.base {
                    row[base] += derivatives[k];
                    row[f + base] += derivatives[n + k];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::DoubleDouble;
    use crate::scene::read_scene;

    const H: f64 = 1e-8;

    /// Accelerations and powers in double-double, at unknowns (q, w) a little off.
    fn exact(
        mechanism: &Mechanism,
        t: Time,
        y: &[f64],
        bias: Bias,
        off: impl Fn(usize) -> f64,
    ) -> Vec<DoubleDouble> {
        let n = y.len() / 2;
        let y: Vec<_> = y.iter().enumerate().map(|(k, &y)| DoubleDouble::sum(y, off(k))).collect();
        let mut kernel = Kernel::<DoubleDouble>::new(mechanism);
        kernel.accelerate::<0>(mechanism, t, &y[..n], &y[n..], bias);
        let (work, stabilizer) = kernel.powers(mechanism, t, &y[..n], &y[n..]);
        kernel.load.iter().copied().chain([work, stabilizer]).collect()
    }

    fn assert_derivatives(mechanism: &Mechanism, t: f64, y: &[f64], bias: Bias, name: &str) {
        let (n, t) = (y.len() / 2, Time::of(t));
        let mut jacobian = Jacobian::new(mechanism);
        jacobian.evaluate(mechanism, t, &y[..n], &y[n..], bias);
        let difference = |plus: Vec<DoubleDouble>, minus: Vec<DoubleDouble>| -> Vec<f64> {
            plus.into_iter().zip(minus).map(|(plus, minus)| (plus - minus).scale(0.5 / H).hi).collect()
        };
        let off = |direction: usize, sign: f64| move |k: usize| if k == direction { sign * H } else { 0.0 };
        let by_unknowns = (0..2 * n).map(|direction| {
            let [plus, minus] = [1.0, -1.0].map(|sign| exact(mechanism, t, y, bias, off(direction, sign)));
            difference(plus, minus)
        });
        let by_unknowns: Vec<Vec<f64>> = by_unknowns.collect();
        // Entries are sums of terms as large as the largest of them.
        let size = by_unknowns.iter().flatten().fold(1.0, |size: f64, entry| size.max(entry.abs()));
        let assert_near = |found: f64, expected: f64, what: String| {
            assert!(
                (found - expected).abs() < 1e-12 * size,
                "{name}, {what}: {found} {expected} of {size:e}"
            );
        };
        for (direction, expected) in by_unknowns.iter().enumerate() {
            for (i, &expected) in expected.iter().enumerate() {
                let found = if i < n {
                    jacobian.acceleration[2 * n * i + direction]
                } else {
                    jacobian.power[2 * n * (i - n) + direction]
                };
                assert_near(found, expected, format!("{i} by {direction}"));
            }
        }
    }

    #[test]
    fn derivatives_of_every_kind_of_scene_agree_with_differences_in_double_double() {
        for name in [
            "spring",
            "motor_sine",
            "four_bar_motor",
            "andrews",
            "cart_pole",
            "guided",
            "quick_return",
            "branch",
            "slider_crank_torque",
        ] {
            let scene =
                read_scene(format!("examples/scenes/{name}.json").as_ref(), &[]).expect("a valid scene");
            let mechanism = Mechanism::new(&scene).expect("equations");
            let start = mechanism.start(&scene);
            // A little off the start: where bars are parallel derivatives vanish by accident.
            let y: Vec<f64> = start
                .phi
                .iter()
                .chain(&start.omega)
                .enumerate()
                .map(|(k, y)| y.hi + 0.01 * (k as f64 + 1.0).sin())
                .collect();
            for bias in [Bias::default(), Bias { rate: 3.0, position: 7.0 }] {
                assert_derivatives(&mechanism, 0.3, &y, bias, name);
                assert_derivatives(&mechanism.body_by_body(), 0.3, &y, bias, name);
            }
        }
    }
}
