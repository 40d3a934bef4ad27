//! Impacts at several walls at one moment in many digits: their impulses are found together, by Poisson's
//! law.
//!
//! ```text
//! v⁺ = v⁻ + A n,   A = G M⁻¹ Gᵀ with the constraints kept
//! least_i <= n_i,  0 <= v⁺_i,  (n_i - least_i) v⁺_i = 0      compression  least = 0;   expansion  least_i = e_i n_i of the compression
//! ```
//!
//! The complementarity problem of both phases as in doubles (`dynamics::friction::simultaneous`), without
//! friction: every set of walls that press is looked at, in the same order; equations and signs are in all
//! digits.  Walls whose point does not approach have no restitution.

use super::friction_impact;
use super::motion::Motion;
use super::resting::Unheld;
use super::wall::{Jump, distance, gap_rate};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::kernel::dot;
use crate::stepping::{Cause, StepError};

/// Walls that are taken at once.
pub(super) const MOST: usize = 12;
/// Part of the digits that a gap has to be zero in, of what touches; and velocities and impulses, of
/// what does not move or press.
const SURE: f64 = 0.75;

/// What the walls that touch do to each other.
pub(super) struct Meeting<const W: usize> {
    /// Their numbers.
    pub walls: Vec<usize>,
    /// G, wall by wall.
    gradients: Vec<Vec<Digits<W>>>,
    /// How fast the walls move along their normals \[m/s\].
    rates: Vec<Digits<W>>,
    /// v⁻, as seen from the walls \[m/s\].
    velocity: Vec<Digits<W>>,
    /// log2 of the part of a number that is rounding.
    rounding: f64,
}

impl<const W: usize> Meeting<W> {
    /// The walls that touch at the impact of one of them; `None` where that is the only one that is
    /// approached.
    pub fn at(motion: &Motion<W>, wall: usize) -> Option<Self> {
        if motion.mechanism.walls.len() < 2 {
            return None;
        }
        let rounding = motion.precision.rounding(SURE);
        let touches = |&other: &usize| {
            let row = &motion.mechanism.walls[other].0;
            let gap = distance(motion, row).abs();
            let length = motion.mechanism.structure.contacts[other].length;
            other == wall || !motion.is_off(row) && gap.log2() - libm::log2(length) < rounding
        };
        let walls: Vec<usize> = (0..motion.mechanism.walls.len()).filter(touches).collect();
        let (mut gradients, mut rates, mut velocity) = (Vec::new(), Vec::new(), Vec::new());
        for gap in walls.iter().map(|&wall| gap_rate(motion, wall)) {
            gradients.push(gap.gradient);
            rates.push(gap.travel);
            velocity.push(gap.rate);
        }
        let still = largest(&velocity) + rounding;
        let approached = velocity.iter().filter(|v| **v < Digits::ZERO && v.log2() > still).count();
        (approached > 1).then_some(Self { walls, gradients, rates, velocity, rounding })
    }

    /// What the impulses do.
    ///
    /// # Errors
    /// No impulses fit.
    pub fn jump(&self, motion: &mut Motion<W>) -> Result<Jump<W>, StepError> {
        let names: Vec<&str> =
            self.walls.iter().map(|&wall| motion.mechanism.structure.contacts[wall].row.name()).collect();
        let names = names.join(", ");
        if self.walls.len() > MOST {
            let what = format!("more than {MOST} walls are met at one moment: {names}");
            return Err(motion.stop(Cause::Unsuited, 0.0, &what, "leave out walls that others imply"));
        }
        if self.walls.iter().any(|&wall| motion.mechanism.structure.friction_at(wall).is_some()) {
            return Err(friction_impact::beside_friction(motion, &names));
        }
        let (t, posture) = (motion.state().t, motion.state_posture());
        // Points that stay on walls take part as all others that touch.
        let Unheld { mechanism, mut keeper } = Unheld::of(motion)?;
        let responses: Vec<Vec<Digits<W>>> = (self.gradients.iter())
            .map(|gradient| {
                let at = [&posture.phi[..], &posture.omega[..]];
                keeper.response(&mechanism, t, at, gradient).0
            })
            .collect();
        let still = largest(&self.velocity) + self.rounding;
        let restitution = |(i, &wall): (usize, &usize)| {
            let is_met = self.velocity[i] < Digits::ZERO && self.velocity[i].log2() > still;
            if is_met { motion.mechanism.walls[wall].1 } else { Digits::ZERO }
        };
        let restitution: Vec<_> = self.walls.iter().enumerate().map(restitution).collect();
        let problem = Problem::new(&self.gradients, &responses, still, self.rounding);
        let Some(impulses) = problem.impulses(&self.velocity, &restitution) else {
            let what = format!("no impulses fit the law of impact at walls {names}");
            return Err(motion.stop(Cause::Unsuited, 0.0, &what, "move one of the walls"));
        };
        let mut change = vec![Digits::ZERO; posture.omega.len()];
        for (response, &impulse) in responses.iter().zip(&impulses) {
            change.iter_mut().zip(response).for_each(|(change, &a)| *change += a * impulse);
        }
        let least = largest(&impulses) + self.rounding;
        let pressing = impulses.iter().filter(|impulse| impulse.log2() > least).count();
        Ok(Jump { change, work: dot(&impulses, &self.rates), walls: pressing as u64 })
    }
}

/// log2 of the largest of numbers.
pub(super) fn largest<const W: usize>(numbers: &[Digits<W>]) -> f64 {
    numbers.iter().fold(f64::NEG_INFINITY, |most, number| most.max(number.log2()))
}

/// The complementarity problem, of impulses and velocities, or of forces and accelerations.
pub(super) struct Problem<const W: usize> {
    /// A \[1/kg\].
    matrix: Vec<Vec<Digits<W>>>,
    /// log2 of a velocity that is rounding.
    still: f64,
    /// log2 of the part of a number that is rounding.
    pub rounding: f64,
}

impl<const W: usize> Problem<W> {
    /// Of walls with these gradients of their gaps, and these responses to an impulse of one along each.
    pub fn new(
        gradients: &[Vec<Digits<W>>],
        responses: &[Vec<Digits<W>>],
        still: f64,
        rounding: f64,
    ) -> Self {
        let row = |gradient: &Vec<_>| responses.iter().map(|response| dot(gradient, response)).collect();
        Self { matrix: gradients.iter().map(row).collect(), still, rounding }
    }

    /// The impulses \[N·s\] of both phases.
    fn impulses(&self, velocity: &[Digits<W>], restitution: &[Digits<W>]) -> Option<Vec<Digits<W>>> {
        let mut all = self.phase(velocity, &vec![Digits::ZERO; velocity.len()])?;
        if restitution.iter().any(|e| !e.is_zero()) {
            let least: Vec<_> = restitution.iter().zip(&all).map(|(&e, &n)| e * n).collect();
            let second = self.phase(&self.after(velocity, &all), &least)?;
            all.iter_mut().zip(second).for_each(|(all, more)| *all += more);
        }
        Some(all)
    }

    /// Velocities after impulses.
    pub fn after(&self, velocity: &[Digits<W>], impulse: &[Digits<W>]) -> Vec<Digits<W>> {
        self.matrix.iter().zip(velocity).map(|(row, &v)| v + dot(row, impulse)).collect()
    }

    /// The impulses of a phase from these velocities on, none below the least.
    pub fn phase(&self, from: &[Digits<W>], least: &[Digits<W>]) -> Option<Vec<Digits<W>>> {
        (0..1_usize << from.len()).find_map(|free| {
            let pressed: Vec<usize> = (0..from.len()).filter(|i| free >> i & 1 == 0).collect();
            let impulse = self.pressed(from, least, &pressed)?;
            let after = self.after(from, &impulse);
            let push = largest(&impulse) + self.rounding;
            let is_at_least =
                |x: Digits<W>, least: Digits<W>, open: f64| x >= least || (least - x).log2() < open;
            let fits = (0..from.len()).all(|i| {
                is_at_least(impulse[i], least[i], push) && is_at_least(after[i], Digits::ZERO, self.still)
            });
            fits.then_some(impulse)
        })
    }

    /// The impulses after which the points of these walls stand still, the others with the least; `None`
    /// where there are none.
    pub fn pressed(
        &self,
        from: &[Digits<W>],
        least: &[Digits<W>],
        pressed: &[usize],
    ) -> Option<Vec<Digits<W>>> {
        let mut impulse = least.to_vec();
        pressed.iter().for_each(|&i| impulse[i] = Digits::ZERO);
        let known = self.after(from, &impulse);
        let mut left: Vec<_> = pressed.iter().map(|&i| -known[i]).collect();
        let mut matrix: Vec<Vec<_>> =
            pressed.iter().map(|&i| pressed.iter().map(|&j| self.matrix[i][j]).collect()).collect();
        let size = matrix.iter().map(|row| largest(row)).fold(f64::NEG_INFINITY, f64::max);
        let mut columns: Vec<usize> = (0..pressed.len()).collect();
        let mut rank = 0;
        // Elimination with exchange of rows and columns; what is left open is zero.
        while rank < pressed.len() {
            let entries = (rank..pressed.len()).flat_map(|i| (rank..pressed.len()).map(move |j| (i, j)));
            let weight = |&(i, j): &(usize, usize)| matrix[i][j].log2();
            let (i, j) = entries.max_by(|a, b| weight(a).total_cmp(&weight(b)))?;
            if weight(&(i, j)) <= size + self.rounding {
                break;
            }
            matrix.swap(rank, i);
            left.swap(rank, i);
            matrix.iter_mut().for_each(|row| row.swap(rank, j));
            columns.swap(rank, j);
            for other in rank + 1..pressed.len() {
                let share = matrix[other][rank] / matrix[rank][rank];
                for k in rank..pressed.len() {
                    let part = share * matrix[rank][k];
                    matrix[other][k] -= part;
                }
                let part = share * left[rank];
                left[other] -= part;
            }
            rank += 1;
        }
        if left[rank..].iter().any(|left| left.log2() > self.still) {
            return None;
        }
        for k in (0..rank).rev() {
            let sum = (k + 1..rank).fold(left[k], |sum, j| sum - matrix[k][j] * impulse[pressed[columns[j]]]);
            impulse[pressed[columns[k]]] = sum / matrix[k][k];
        }
        impulse.iter().all(|impulse| impulse.is_finite()).then_some(impulse)
    }
}
