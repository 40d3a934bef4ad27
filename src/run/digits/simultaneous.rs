//! Impacts at several walls at one moment in many digits, with dry friction and without: their impulses are
//! found together.
//!
//! ```text
//! v⁺ = v⁻ + A p,   A = G M⁻¹ Gᵀ with the constraints kept,   p = (n_1 … n_k, s_1 … s_k)
//! ```
//!
//! The complementarity problem is that of doubles (`dynamics::friction::simultaneous`), and every combination
//! is looked at in the same order; equations and signs are in all digits, of which what is rounding in three
//! quarters is zero.  Walls whose point does not approach have no restitution.

use super::evidence::gradient;
use super::motion::DigitsMotion;
use super::projection::largest;
use super::resting::Unheld;
use super::wall::{GapRate, ImpulseJump, distance, gap_rate, work_of_rows};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::friction::paradox::HINT;
use crate::dynamics::friction::simultaneous::Shocks;
use crate::dynamics::friction::{CompiledFriction, Normal};
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
    walls: Vec<usize>,
    /// Their gaps.
    gaps: Vec<GapRate<W>>,
    /// log2 of the part of a number that is rounding.
    rounding: f64,
}

impl<const W: usize> Meeting<W> {
    /// The walls that touch at the impact of one of them, or hold a point then.
    pub fn touching(motion: &DigitsMotion<W>, wall: usize) -> Self {
        let rounding = motion.precision.rounding(SURE);
        let touches = |&other: &usize| {
            let row = &motion.mechanism.walls[other].0;
            let gap = distance(motion, row).abs();
            let length = motion.mechanism.structure.contacts[other].length;
            other == wall
                || motion.state().acting.held.contains(&other)
                || !motion.is_off(row) && gap.log2() - libm::log2(length) < rounding
        };
        let walls: Vec<usize> = (0..motion.mechanism.walls.len()).filter(touches).collect();
        let gaps = walls.iter().map(|&wall| gap_rate(motion, wall)).collect();
        Self { walls, gaps, rounding }
    }

    /// The same where several walls are approached.
    pub fn at(motion: &DigitsMotion<W>, wall: usize) -> Option<Self> {
        if motion.mechanism.walls.len() < 2 {
            return None;
        }
        let meeting = Self::touching(motion, wall);
        (0..meeting.walls.len()).filter(|&i| meeting.is_met(i)).nth(1)?;
        Some(meeting)
    }

    /// True where the point of a wall approaches it.
    fn is_met(&self, i: usize) -> bool {
        let rates: Vec<_> = self.gaps.iter().map(|gap| gap.rate).collect();
        rates[i] < Digits::ZERO && rates[i].log2() > largest(&rates) + self.rounding
    }

    /// True where the impulse at one wall presses a point that touches another one at rest and is not held,
    /// and there is dry friction at one of them.
    pub fn is_pressed_by(&self, motion: &DigitsMotion<W>, wall: usize, alone: &ImpulseJump<W>) -> bool {
        let rubs = |wall| motion.mechanism.structure.friction_at(wall).is_some();
        let before: Vec<_> = self.gaps.iter().map(|gap| gap.rate).collect();
        let after: Vec<_> =
            self.gaps.iter().map(|gap| gap.rate + dot(&gap.gradient, &alone.change)).collect();
        let least = largest(&before) + self.rounding;
        self.walls.iter().enumerate().any(|(i, &other)| {
            other != wall
                && (rubs(wall) || rubs(other))
                && !motion.state().acting.held.contains(&other)
                && (before[i] <= Digits::ZERO || before[i].log2() <= least)
                && after[i] < Digits::ZERO
                && after[i].log2() > least
        })
    }

    /// What the impulses do.
    ///
    /// # Errors
    /// No impulses fit.
    pub fn jump(&self, motion: &DigitsMotion<W>) -> Result<ImpulseJump<W>, StepError> {
        let contacts = &motion.mechanism.structure.contacts;
        let names: Vec<&str> = self.walls.iter().map(|&wall| contacts[wall].row.name()).collect();
        let names = names.join(", ");
        if self.walls.len() > MOST {
            let what = format!("more than {MOST} walls are met at one moment: {names}");
            return Err(motion.stop(Cause::Unsuited, 0.0, &what, "leave out walls that others imply"));
        }
        let (t, coordinates) = (motion.state().t, motion.state_coordinates());
        // Points that stay on walls take part as all others that touch; friction elsewhere does not.
        let Unheld { mechanism, mut projection } = Unheld::of(motion)?;
        let frictions: Vec<Option<&CompiledFriction<Digits<W>>>> = (self.walls.iter())
            .map(|&wall| mechanism.frictions.iter().find(|friction| friction.normal == Normal::Contact(wall)))
            .collect();
        let z = mechanism.elements(&coordinates.phi);
        let nothing = vec![Digits::ZERO; coordinates.omega.len()];
        let along = frictions.iter().map(|friction| {
            friction.map_or_else(|| nothing.clone(), |friction| gradient(&friction.tangent, &z))
        });
        // Along the normals and the walls.
        let gradients: Vec<Vec<_>> = self.gaps.iter().map(|gap| gap.gradient.clone()).chain(along).collect();
        let mut respond = |gradient: &Vec<Digits<W>>| match gradient.iter().all(Digits::is_zero) {
            true => (nothing.clone(), vec![Digits::ZERO; mechanism.constraints.len()]),
            false => projection.response(&mechanism, t, [&coordinates.phi, &coordinates.omega], gradient),
        };
        let (responses, pulls): (Vec<Vec<_>>, Vec<Vec<_>>) = gradients.iter().map(&mut respond).unzip();
        let known = frictions.iter().flatten();
        let shocks = Shocks {
            response: gradients
                .iter()
                .flat_map(|row| responses.iter().map(|other| dot(row, other)))
                .collect(),
            velocity: (self.gaps.iter().map(|gap| gap.rate))
                .chain(gradients[self.walls.len()..].iter().map(|along| dot(along, &coordinates.omega)))
                .collect(),
            restitution: (self.walls.iter().enumerate())
                .map(|(i, &wall)| if self.is_met(i) { mechanism.walls[wall].1 } else { Digits::ZERO })
                .collect(),
            coefficients: (frictions.iter())
                .map(|friction| {
                    friction.map_or([Digits::ZERO; 2], |friction| [friction.kinetic, friction.stiction])
                })
                .collect(),
            is_newton: known.clone().count() > 0 && known.clone().all(|friction| friction.is_newton),
            rounding: Digits::ONE.ldexp(self.rounding as i32),
        };
        let Some(impulses) = shocks.impulses() else {
            let what = format!("no impulses fit the laws of impact and friction at walls {names}");
            return Err(match known.count() {
                0 => motion.stop(Cause::Unsuited, 0.0, &what, "move one of the walls"),
                _ => motion.stop(Cause::Friction, 0.0, &what, HINT),
            });
        };
        let all: Vec<Digits<W>> =
            impulses.iter().map(|both| both[0]).chain(impulses.iter().map(|both| both[1])).collect();
        let sum = |of: &[Vec<Digits<W>>]| {
            let mut sum = vec![Digits::ZERO; of[0].len()];
            for (of, &impulse) in of.iter().zip(&all) {
                sum.iter_mut().zip(of).for_each(|(sum, &part)| *sum += part * impulse);
            }
            sum
        };
        let normal = &all[..self.walls.len()];
        let travels = self.gaps.iter().zip(normal);
        let work = travels.fold(Digits::ZERO, |work, (gap, &impulse)| work + gap.travel * impulse);
        let least = largest(normal) + self.rounding;
        let pressing = normal.iter().filter(|impulse| impulse.log2() > least).count();
        let work = work + work_of_rows(&mechanism, t, &coordinates, &sum(&pulls));
        Ok(ImpulseJump { change: sum(&responses), work, walls: pressing as u64 })
    }
}

/// The forces of points that rest on smooth walls with these gradients of their gaps, whose responses to a
/// force of one along each are these, and whose gaps have these accelerations without forces; of these
/// 2^`rounding` are rounding.
pub(super) fn forces<const W: usize>(
    [gradients, responses]: [&[Vec<Digits<W>>]; 2],
    accelerations: &[Digits<W>],
    rounding: f64,
) -> Shocks<Digits<W>> {
    let count = accelerations.len();
    let none = vec![Digits::ZERO; count];
    let row = |gradient: &Vec<_>| {
        let normal = responses.iter().map(|response| dot(gradient, response));
        normal.chain(none.iter().copied()).collect::<Vec<_>>()
    };
    let across = vec![Digits::ZERO; 2 * count * count];
    Shocks {
        response: gradients.iter().flat_map(row).chain(across).collect(),
        velocity: accelerations.iter().chain(&none).copied().collect(),
        restitution: none.clone(),
        coefficients: vec![[Digits::ZERO; 2]; count],
        is_newton: false,
        rounding: Digits::ONE.ldexp(rounding as i32),
    }
}
