//! Watches that no wall is passed: gaps at the end of every step, and, where a cubic through the ends of a step dips behind a wall, inside it.
//!
//! It looks at positions and rates alone and shares nothing with the search for events, whose misses it is to find.

use super::impact_monitor::{gap, gap_rate};
use crate::dynamics::{Glance, Mechanism};
use crate::stepping::{Cause, StepError};

/// Points at which the inside of a step is looked at, cubic or dense output.
pub(super) const POINTS: usize = 32;

/// Gaps over the lengths of their contacts, and their rates, at the end of the last step.
#[derive(Clone, Debug, Default)]
pub(super) struct WallGuard {
    /// A gap below minus this is behind the wall.
    closed: f64,
    t: f64,
    gaps: Vec<[f64; 2]>,
}

impl WallGuard {
    /// A guard with the gap that counts as zero, over the length of its contact.
    pub fn new(closed: f64) -> Self {
        Self { closed, ..Self::default() }
    }

    /// Begins at a moment.
    pub fn begin(&mut self, mechanism: &Mechanism, t: f64, glance: &Glance) {
        self.t = t;
        self.gaps = gaps(mechanism, glance);
    }

    /// Takes the end of a step; true where its inside is to be looked at.
    ///
    /// # Errors
    /// A wall that has been passed.
    pub fn step(&mut self, mechanism: &Mechanism, t: f64, glance: &Glance) -> Result<bool, Box<Passed>> {
        self.look(mechanism, t, glance)?;
        let (h, now) = (t - self.t, gaps(mechanism, glance));
        let dips =
            |before: &[f64; 2], after: &[f64; 2]| (1..POINTS).any(|i| cubic(before, after, h, i as f64 / POINTS as f64) < -self.closed);
        let is_suspect = (0..now.len()).any(|c| !mechanism.held.contains(&c) && dips(&self.gaps[c], &now[c]));
        (self.t, self.gaps) = (t, now);
        Ok(is_suspect)
    }

    /// Looks at one moment.
    ///
    /// # Errors
    /// A wall that has been passed, or that a held point has left.
    pub fn look(&self, mechanism: &Mechanism, t: f64, glance: &Glance) -> Result<(), Box<Passed>> {
        for (c, contact) in mechanism.contacts.iter().enumerate() {
            let (gap, rounding) = gap(contact, mechanism.bodies.len(), &glance.phi);
            let is_held = mechanism.held.contains(&c);
            let off = if is_held { gap.abs() } else { -gap };
            if off.is_nan() || off > self.closed + rounding {
                return Err(Box::new(Passed { t, wall: contact.row.name.clone(), gap: gap * contact.length, is_held }));
            }
        }
        Ok(())
    }

    /// The wall of an event that a part of a step has, and the step has not.
    ///
    /// # Errors
    /// A wall that has been passed, where the event is no release.
    pub fn met(&self, mechanism: &Mechanism, t: f64, event: usize) -> Result<(), Box<Passed>> {
        let is_held = mechanism.held.contains(&event);
        let wall = &mechanism.contacts[event].row.name;
        if is_held { Ok(()) } else { Err(Box::new(Passed { t, wall: wall.clone(), gap: 0.0, is_held })) }
    }
}

fn gaps(mechanism: &Mechanism, glance: &Glance) -> Vec<[f64; 2]> {
    let angles = mechanism.bodies.len();
    (mechanism.contacts.iter())
        .map(|contact| [gap(contact, angles, &glance.phi).0, gap_rate(contact, angles, &glance.phi, &glance.omega)])
        .collect()
}

/// Hermite's cubic through values and rates at both ends of `h`, at a share of it.
fn cubic([a, a_rate]: &[f64; 2], [b, b_rate]: &[f64; 2], h: f64, share: f64) -> f64 {
    let (s, r) = (share, 1.0 - share);
    r * r * (1.0 + 2.0 * s) * a + s * s * (1.0 + 2.0 * r) * b + h * s * r * (r * a_rate - s * b_rate)
}

/// A wall that has been passed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Passed {
    t: f64,
    wall: String,
    gap: f64,
    is_held: bool,
}

impl Passed {
    /// The stop of a method.
    pub fn stop(self, method: &str) -> StepError {
        let Self { t, wall, gap, is_held } = self;
        let what = match is_held {
            true => format!("a point that is held at wall {wall} is {gap:.3e} m from it"),
            false => format!("a point is {:.3e} m behind wall {wall} and no impact was found", -gap),
        };
        let hint = "tighten the tolerance, or use --method taylor".into();
        StepError { cause: Cause::WallPassed, method: method.into(), t, step: 0.0, what, hint }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cubic_has_the_values_and_rates_of_both_ends() {
        // t³ - t on [1, 3].
        let (at, rate) = (|t: f64| t * t * t - t, |t: f64| 3.0 * t * t - 1.0);
        for share in [0.0, 0.25, 0.5, 1.0] {
            let found = cubic(&[at(1.0), rate(1.0)], &[at(3.0), rate(3.0)], 2.0, share);
            assert!((found - at(1.0 + 2.0 * share)).abs() < 1e-13);
        }
    }
}
