//! Of which bodies whole turns matter, and between which.

use super::Mechanism;
use crate::dynamics::Time;
use crate::dynamics::constraint::aim::{Aim, AimInput};
use crate::dynamics::constraint::{RowMeasure, Site};
use crate::dynamics::force::formula::Formulas;
use crate::dynamics::force::user::{ForceInput, UserForce};
use crate::scene::Meaning;
use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

/// Most turns after which wheels are looked for as they were.
const MOST_TURNS: u32 = 64;

/// For every body the first of those with which it may make whole turns and all is as before; `None` where a
/// turn of it is felt: by a torsion spring on the ground, by a formula with its angle.
#[derive(Clone, Debug)]
pub(crate) struct WholeTurns {
    with: Vec<Option<usize>>,
    /// The same beside gears of constant ratios: two positions that keep them differ by turns that suit them.
    between_kept: Vec<Option<usize>>,
}

impl WholeTurns {
    /// Those of a mechanism: springs and laws of relative angles hold bodies to one another, those of angles
    /// to the ground.
    pub fn of(mechanism: &Mechanism) -> Self {
        Self::joined(mechanism, std::iter::empty())
    }

    /// Those of a mechanism in which pairs of bodies, or a body and the ground, turn together.
    fn joined(mechanism: &Mechanism, pairs: impl Iterator<Item = (usize, Option<usize>)>) -> Self {
        let ground = mechanism.bodies.len();
        let torsions = mechanism.torsions.iter().filter(|spring| spring.stiffness != 0.0);
        let forces = mechanism.forces.iter().flat_map(UserForce::angles_compared);
        let other = torsions.map(|spring| (spring.body, spring.base)).chain(forces).chain(pairs);
        let formulas = || mechanism.laws.iter().map(|laws| &*laws.formulas);
        let walls = mechanism.contacts.iter().filter_map(|contact| contact.row.aim.as_deref());
        let (gears, cams): (Vec<&Aim>, Vec<&Aim>) =
            mechanism.gears_and_cams().partition(|aim| !aim.ratios().is_empty());
        let other: Vec<Compared> = other
            .chain(cams.into_iter().chain(walls).flat_map(Aim::angles_compared))
            .chain(formulas().flat_map(Formulas::meanings_beside_gears).filter_map(angle_of))
            .collect();
        let of_gears = gears.into_iter().flat_map(Aim::angles_compared);
        let of_formulas = formulas().flat_map(Formulas::angles_compared);
        let other = || other.iter().copied();
        let with = groups(ground, other().chain(of_gears).chain(of_formulas));
        Self { with, between_kept: groups(ground, other()) }
    }

    /// The same beside motors, locks and welds as they stand at one time: they count turns, so that the
    /// bodies whose angles they measure turn together.
    pub fn beside_rows(mechanism: &Mechanism) -> Self {
        let pairs = mechanism.angles_given().map(|(body, base, _)| (body, base));
        Self::joined(mechanism, pairs)
    }

    /// Takes whole turns off a difference of two positions on the constraints: those that leave least of it.
    pub fn take_off(&self, apart: &mut [f64]) {
        let turns: Vec<f64> =
            self.between_kept.iter().map(|with| with.map_or(0.0, |k| (apart[k] / TAU).round())).collect();
        apart.iter_mut().zip(turns).for_each(|(apart, turns)| *apart -= TAU * turns);
    }

    /// A position with principal values, in (-π, π], of the angles that whole turns leave as they are: upside
    /// down is π, on whichever side rounding has it.
    pub fn principal(&self, phi: &[f64]) -> Vec<f64> {
        let mut principal = phi.to_vec();
        for (k, with) in self.with.iter().enumerate() {
            let Some(first) = *with else { continue };
            let turns = (phi[first] / TAU).round();
            principal[k] -= TAU * turns;
            if phi[first] - TAU * turns < 1e-9 - PI {
                principal[k] += TAU;
            }
        }
        principal
    }

    /// True where the angle a row measures may change by a whole turn.
    pub fn is_of_row(&self, measure: &RowMeasure) -> bool {
        let RowMeasure::Angle { body, base } = *measure else { return false };
        self.with[body] != base.and_then(|base| self.with[base])
    }
}

impl Mechanism {
    /// Laws of motors that depend on where the mechanism is.
    fn gears_and_cams(&self) -> impl Iterator<Item = &Aim> {
        self.constraints.iter().filter_map(|row| row.aim.as_deref())
    }

    /// Bodies whose whole turns gears or cams count.
    pub(crate) fn geared_bodies(&self) -> Vec<usize> {
        let all: BTreeSet<usize> = self.gears_and_cams().flat_map(Aim::counted_angles).collect();
        all.into_iter().collect()
    }

    /// The least number of turns after which every gear with a constant ratio may be where it was; 1 where
    /// there is none up to [`MOST_TURNS`].
    pub(crate) fn turns_of_gears(&self) -> f64 {
        let gears = self.gears_and_cams().filter(|aim| !aim.angles.is_empty());
        let ratios: Vec<f64> = gears.flat_map(Aim::ratios).collect();
        let is_whole = |x: f64| (x - x.round()).abs() < 1e-9;
        let suits = |turns: &f64| ratios.iter().all(|ratio| is_whole(turns * ratio));
        (1..=MOST_TURNS).map(f64::from).find(suits).unwrap_or(1.0)
    }

    /// The angles that motors, locks and welds give at t = 0: a body, what it is measured from, and the angle
    /// \[rad\].
    fn angles_given(&self) -> impl Iterator<Item = (usize, Option<usize>, f64)> {
        self.constraints.iter().filter_map(|row| match (&row.measure, &row.law, &row.aim) {
            (&RowMeasure::Angle { body, base }, Some(law), None) => {
                Some((body, base, law.angle(Time::default()).hi))
            }
            _ => None,
        })
    }

    /// Turns bodies by whole turns until motors, locks and welds, which count them, are where they are given
    /// at t = 0: from the ground on, and from the first body of those that nothing ties to it.
    pub(crate) fn wind(&self, phi: &mut [f64]) {
        let ground = self.bodies.len();
        let mut is_placed = vec![false; ground + 1];
        for first in std::iter::once(ground).chain(0..ground) {
            is_placed[first] = true;
            let next = |is_placed: &[bool]| {
                let mut given = self.angles_given();
                given.find(|&(body, base, _)| is_placed[body] != is_placed[base.unwrap_or(ground)])
            };
            while let Some((body, base, angle)) = next(&is_placed) {
                let off = phi[body] - base.map_or(0.0, |base| phi[base]) - angle;
                let turns = TAU * (off / TAU).round();
                match base {
                    Some(base) if is_placed[body] => phi[base] += turns,
                    _ => phi[body] -= turns,
                }
                is_placed[body] = true;
                is_placed[base.unwrap_or(ground)] = true;
            }
        }
    }
}

/// A body, and the one its angle is compared with; `None` for the ground.
type Compared = (usize, Option<usize>);

/// For every body the first of those that turn with it; `None` for those that turn with the ground.
fn groups(ground: usize, pairs: impl Iterator<Item = Compared>) -> Vec<Option<usize>> {
    let mut group: Vec<usize> = (0..=ground).collect();
    for (body, base) in pairs {
        let [from, to] = [group[body], group[base.unwrap_or(ground)]];
        group.iter_mut().filter(|one| **one == from).for_each(|one| *one = to);
    }
    let first = |k: usize| group.iter().position(|one| *one == group[k]);
    (0..ground).map(|k| if group[k] == group[ground] { None } else { first(k) }).collect()
}

/// The angles of these bodies, compared with one another where only their differences matter.
fn compared(bodies: Vec<usize>, only_differences: bool) -> impl Iterator<Item = Compared> {
    let base = bodies.first().copied().filter(|_| only_differences);
    bodies.into_iter().map(move |body| (body, base))
}

impl UserForce {
    /// The bodies whose whole turns matter to it, and beside which.
    fn angles_compared(&self) -> impl Iterator<Item = Compared> {
        let only_differences = self.parts.iter().all(|part| {
            let angle = |input: u32| matches!(self.inputs[input as usize], ForceInput::Angle(_));
            let forces = part.forces.iter().flat_map(|force| force.1);
            let acting = forces.chain(part.torques.iter().map(|torque| torque.1)).chain(part.power);
            part.tape.is_unchanged_by_shifts(angle, acting)
        });
        compared(self.counted_angles().collect(), only_differences)
    }
}

impl Aim {
    /// The bodies whose whole turns matter to it, and beside which.
    fn angles_compared(&self) -> impl Iterator<Item = Compared> {
        let angle = |input: u32| matches!(self.inputs[input as usize], AimInput::Angle(_));
        let slopes = self.slopes.iter().map(|slope| slope.1);
        let results = [self.value, self.drive, self.convective].into_iter().chain(slopes);
        let only_differences = self.tape.is_unchanged_by_shifts(angle, results);
        compared(self.counted_angles().collect(), only_differences)
    }
}

impl Formulas {
    /// The bodies whose whole turns matter to them, on whichever branches, and beside which.
    fn angles_compared(&self) -> impl Iterator<Item = Compared> {
        self.meanings().filter_map(angle_of)
    }

    /// True where whole turns may matter to them: on other branches, to events that change what acts, and to
    /// what acts with other parameters than those that hold, beside which derivatives are taken.
    pub fn may_count_turns(&self) -> bool {
        self.switches() && self.angles_compared().next().is_some()
            || self.acting_meanings().filter_map(angle_of).next().is_some()
    }
}

/// The angle that a number of a formula is.
fn angle_of(meaning: &Meaning<Site>) -> Option<Compared> {
    match *meaning {
        Meaning::Angle(body) => Some((body, None)),
        Meaning::RelativeAngle(body, base) => Some((body, base)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of four: a spring to the ground, one between the next two, and a last one that is free.
    #[test]
    fn bodies_turn_with_those_that_feel_it() {
        let with = vec![None, Some(1), Some(1), Some(3)];
        let turns = WholeTurns { between_kept: with.clone(), with };
        let mut apart = [9.0, 1.0 + TAU, -9.0, 4.0 * TAU, 8.0];
        turns.take_off(&mut apart);
        assert_eq!(apart, [9.0, 1.0, -9.0 - TAU, 0.0, 8.0]);
        let upside_down = turns.principal(&[9.0, 0.5, 9.0, -PI]);
        assert_eq!(upside_down, [9.0, 0.5, 9.0, PI]);
        let measures = |body, base| turns.is_of_row(&RowMeasure::Angle { body, base });
        assert!(!measures(0, None) && !measures(2, Some(1)));
        assert!(measures(1, None) && measures(3, Some(2)) && measures(2, Some(0)));
    }
}
