//! Joint forces where constraints are redundant: equilibrium leaves some of them open.
//!
//! ```text
//! Gᵀ mu = 0   for d independent mu: forces among the joints that move nothing
//! F = F_0 + Σ c_i F(mu_i),   c such that |F| is least
//! ```
//!
//! F has the forces of all hinges and welds \[N\], of sliders, driven sliders and rods \[N\], and the torques
//! of motors, locks, welds and locked sliders over the size of the mechanism \[N\].  What every mu leaves
//! alone is determinate; of the rest the forces of least norm are one choice among many, those of joints that
//! give equally.

use super::assembly::svd::{RowMatrix, dot};
use super::constraint::ConstraintArguments;
use super::kernel::{Bias, Kernel};
use super::{Mechanism, Time};
use crate::arithmetic::Complex;

/// Rows up to which redundancy is taken apart.
const MOST: usize = 300;
/// Singular values of the rows' Jacobian below this share of the largest count as zero: rows that are
/// singular at the start alone are not so later.
const ZERO: f64 = 1e-9;
/// Share of a unit of mu below which it leaves a force alone.
const ALONE: f64 = 1e-7;

/// Forces in the joints at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointForces {
    /// Of the first body of each hinge or weld on the second \[N\].
    pub hinges: Vec<Complex<f64>>,
    /// Multipliers of all rows \[N·m or N\].
    pub multipliers: Vec<f64>,
    /// Which hinge forces follow from the equations; `None` where that was not examined.
    pub hinge_is_determinate: Vec<Option<bool>>,
    /// Which multipliers do.
    pub row_is_determinate: Vec<Option<bool>>,
}

/// Joint forces that move nothing: those that are listed, the multipliers, and the forces of the hinges.
type Unit = (Vec<f64>, Vec<f64>, Vec<Complex<f64>>);

impl Mechanism {
    /// How many independent joint forces move nothing.
    fn open_forces(&self) -> usize {
        (self.assembly.redundant.len() + self.assembly.singular.len()).min(self.constraints.len())
    }

    /// True where equilibrium leaves joint forces open.
    pub(super) fn leaves_forces_open(&self) -> bool {
        self.open_forces() > 0
    }

    /// Makes the multipliers of an evaluation those of its [joint forces](Self::joint_forces).
    pub(crate) fn share_multipliers(&self, t: Time, kernel: &mut Kernel<f64>, phi: &[f64], omega: &[f64]) {
        if self.leaves_forces_open() {
            kernel.multiplier = self.joint_forces(t, kernel, phi, omega).multipliers;
        }
    }

    /// The joint forces of an evaluation of the equations at these angles \[rad\] and rates \[rad/s\]: its
    /// `load` must hold the accelerations and its `multiplier` those of all rows.  Those that redundant or
    /// singular rows leave open are the ones of least norm.
    pub fn joint_forces(&self, t: Time, kernel: &Kernel<f64>, phi: &[f64], omega: &[f64]) -> JointForces {
        let (rows, joints) = (self.constraints.len(), self.joints.len());
        let hinges = self.hinge_forces(t, kernel, phi, omega);
        let open = self.open_forces();
        let is_known = if open == 0 { Some(true) } else { None };
        let mut found = JointForces {
            hinges,
            multipliers: kernel.multiplier.clone(),
            hinge_is_determinate: vec![is_known; joints],
            row_is_determinate: vec![is_known; rows],
        };
        if open == 0 || rows > MOST {
            return found;
        }
        let mut given = self.listed(&found.hinges, &found.multipliers);
        // Orthonormal lists of joint forces that move nothing, each with its mu and its hinge forces.
        let mut units: Vec<Unit> = Vec::new();
        for mu in self.idle(t, kernel, phi, omega, open) {
            let at = ConstraintArguments { phi, z: &kernel.z, omega };
            let hinges = self.transmitted(t, at, &mu, vec![Complex::ZERO; self.bodies.len()]);
            let mut unit = (self.listed(&hinges, &mu), mu, hinges);
            for _ in 0..2 {
                for other in &units {
                    let share = -dot(&unit.0, &other.0);
                    shift(&mut unit, other, share);
                }
            }
            let length = dot(&unit.0, &unit.0).sqrt();
            if length > 0.0 {
                let rest = 1.0 / length - 1.0;
                let same = unit.clone();
                shift(&mut unit, &same, rest);
                units.push(unit);
            }
        }
        for (list, mu, hinges) in &units {
            let share = -dot(&given, list);
            given.iter_mut().zip(list).for_each(|(given, list)| *given += share * list);
            found.multipliers.iter_mut().zip(mu).for_each(|(multiplier, mu)| *multiplier += share * mu);
            found.hinges.iter_mut().zip(hinges).for_each(|(force, idle)| *force += idle.times(share));
        }
        let is_left_alone = |size: &dyn Fn(&Unit) -> f64| units.iter().all(|unit| size(unit) < ALONE);
        found.hinge_is_determinate =
            (0..joints).map(|j| Some(is_left_alone(&|unit| unit.2[j].norm_squared().sqrt()))).collect();
        found.row_is_determinate =
            (0..rows).map(|r| Some(is_left_alone(&|unit| self.as_force(r, unit.1[r]).abs()))).collect();
        found
    }

    /// Which outputs have forces in them that redundant constraints leave open at these angles \[rad\] and
    /// rates \[rad/s\].
    pub fn open_outputs(&self, t: Time, phi: &[f64], omega: &[f64]) -> Vec<bool> {
        let Some(outputs) = &self.outputs else { return Vec::new() };
        if self.redundant().is_empty() {
            return vec![false; outputs.heads().count()];
        }
        let mut kernel = Kernel::new(self);
        kernel.accelerations(self, t, phi, omega, Bias::default());
        outputs.left_open(self, &self.joint_forces(t, &kernel, phi, omega))
    }

    /// The forces whose squares are added.
    fn listed(&self, hinges: &[Complex<f64>], multipliers: &[f64]) -> Vec<f64> {
        let mut is_hinge = vec![false; self.constraints.len()];
        for row in self.joints.iter().filter_map(|joint| joint.row) {
            is_hinge[row..row + 2].fill(true);
        }
        let others =
            (0..self.constraints.len()).filter(|&r| !is_hinge[r]).map(|r| self.as_force(r, multipliers[r]));
        hinges.iter().flat_map(|force| [force.re, force.im]).chain(others).collect()
    }

    /// A multiplier as a force \[N\].
    fn as_force(&self, row: usize, multiplier: f64) -> f64 {
        if self.constraints[row].is_angle() { multiplier / self.size_of_parts() } else { multiplier }
    }

    /// Up to so many independent mu with Gᵀ mu = 0.
    fn idle(&self, t: Time, kernel: &Kernel<f64>, phi: &[f64], omega: &[f64], count: usize) -> Vec<Vec<f64>> {
        let (rows, n, size, angles) =
            (self.constraints.len(), self.coordinates(), self.size_of_parts(), self.bodies.len());
        let unit = |row: usize| if self.constraints[row].is_angle() { 1.0 } else { 1.0 / size };
        let mut jacobian = RowMatrix::zero(rows, n);
        for (r, row) in self.constraints.iter().enumerate() {
            let entries = jacobian.row_mut(r);
            row.differentiate(t, ConstraintArguments { phi, z: &kernel.z, omega }, entries);
            entries
                .iter_mut()
                .enumerate()
                .for_each(|(k, entry)| *entry *= unit(r) * if k < angles { 1.0 } else { size });
        }
        let range = jacobian.svd().left(rows - count, ZERO);
        let mut found: Vec<Vec<f64>> = Vec::new();
        // What the range leaves of each unit vector, the longest first.
        let mut rests: Vec<Vec<f64>> = (0..rows)
            .map(|r| {
                let mut rest = vec![0.0; rows];
                rest[r] = 1.0;
                rest
            })
            .collect();
        for rest in &mut rests {
            (0..2).for_each(|_| range.iter().for_each(|unit| take_off(rest, unit)));
        }
        while found.len() + range.len() < rows {
            let Some(mut longest) = rests.iter().max_by(|a, b| dot(a, a).total_cmp(&dot(b, b))).cloned()
            else {
                break;
            };
            let length = dot(&longest, &longest).sqrt();
            if length <= ALONE {
                break;
            }
            longest.iter_mut().for_each(|x| *x /= length);
            for rest in &mut rests {
                (0..2).for_each(|_| take_off(rest, &longest));
            }
            found.push(longest);
        }
        for mu in &mut found {
            mu.iter_mut().enumerate().for_each(|(r, mu)| *mu *= unit(r));
        }
        found
    }
}

fn take_off(rest: &mut [f64], unit: &[f64]) {
    let share = dot(rest, unit);
    rest.iter_mut().zip(unit).for_each(|(rest, unit)| *rest -= share * unit);
}

/// Adds a share of another.
fn shift(unit: &mut Unit, other: &Unit, share: f64) {
    unit.0.iter_mut().zip(&other.0).for_each(|(x, y)| *x += share * y);
    unit.1.iter_mut().zip(&other.1).for_each(|(x, y)| *x += share * y);
    unit.2.iter_mut().zip(&other.2).for_each(|(x, y)| *x += y.times(share));
}
