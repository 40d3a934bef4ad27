//! All coordinates of a motion in many digits, from those that are independent.

use super::motion::{DigitsMotion, LongState};
use crate::arithmetic::Scalar;
use crate::arithmetic::digits::Digits;
use crate::dynamics::Coordinates;
use crate::dynamics::series::Constants;

/// All coordinates at a moment.
#[derive(Clone, Debug)]
pub struct DigitsCoordinates<const W: usize> {
    /// Angles, then positions of origins \[rad, m\].
    pub phi: Vec<Digits<W>>,
    /// Their rates \[rad/s, m/s\].
    pub omega: Vec<Digits<W>>,
    /// Work, and energy of impacts, corners and events \[J\].
    pub work: [Digits<W>; 2],
    /// Energy lost in dry friction \[J\].
    pub lost: Digits<W>,
}

impl<const W: usize> DigitsMotion<W> {
    /// Independent coordinates and rates of a motion at t = 0, from the first of the bodies they move
    /// whose value is given.
    pub(super) fn independent(
        &self,
        phi: &[Digits<W>],
        omega: &[Digits<W>],
        given: &[Vec<bool>; 2],
    ) -> (Vec<Digits<W>>, Vec<Digits<W>>) {
        if self.coordinates == Coordinates::All {
            return (phi.to_vec(), omega.to_vec());
        }
        let partition = &self.mechanism.partition;
        let from = |coordinate: usize, given: &[bool], values: &[Digits<W>], is_rate: bool| {
            let own = partition.independent[coordinate];
            let moved = (0..values.len()).filter(|&i| partition.bodies[i].base == Some(coordinate));
            let best = Some(own).filter(|&own| given[own]).or_else(|| moved.clone().find(|&i| given[i]));
            let body = best.unwrap_or(own);
            let t = self.state.t;
            partition.bodies[body].laws.iter().fold(values[body], |sum, (sign, law)| {
                let part = if is_rate { Digits::phase(law, t).rate } else { Digits::law_value(law, t) };
                sum - part.scale(*sign)
            })
        };
        let count = 0..partition.count();
        (
            count.clone().map(|c| from(c, &given[0], phi, false)).collect(),
            count.map(|c| from(c, &given[1], omega, true)).collect(),
        )
    }

    /// All coordinates at the last step's end.
    pub(super) fn state_coordinates(&self) -> DigitsCoordinates<W> {
        let LongState { t, u, rate, work, jump_energy, lost, .. } = &self.state;
        let (phi, omega) = self.bodies(*t, u, rate);
        DigitsCoordinates { phi, omega, work: [*work, *jump_energy], lost: *lost }
    }

    /// All coordinates at a time inside the step that is next.
    pub fn at(&self, t: Digits<W>) -> DigitsCoordinates<W> {
        let (u, rate, [work, lost]) = self.evaluate(t - self.state.t);
        let (phi, omega) = self.bodies(t, &u, &rate);
        DigitsCoordinates {
            phi,
            omega,
            work: [self.state.work + work, self.state.jump_energy],
            lost: self.state.lost + lost,
        }
    }

    /// Angles and rates of all bodies.
    pub(super) fn bodies(
        &self,
        t: Digits<W>,
        u: &[Digits<W>],
        rate: &[Digits<W>],
    ) -> (Vec<Digits<W>>, Vec<Digits<W>>) {
        if self.coordinates == Coordinates::All {
            return (u.to_vec(), rate.to_vec());
        }
        let body = |dependent: &crate::dynamics::partition::DependentAngle<Digits<W>>| {
            let of = |values: &[Digits<W>]| dependent.base.map_or(Digits::ZERO, |base| values[base]);
            dependent.laws.iter().fold((of(u), of(rate)), |(angle, speed), (sign, law)| {
                let turned = Digits::law_value(law, t).scale(*sign);
                (angle + turned, speed + Digits::phase(law, t).rate.scale(*sign))
            })
        };
        self.mechanism.partition.bodies.iter().map(body).unzip()
    }
}
