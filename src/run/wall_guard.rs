//! Watches that no wall is passed: gaps at the end of every step, and inside it where a cubic through its
//! ends has a minimum near a wall.
//!
//! Such a minimum is looked for on the motion itself, at even distances and then by golden section, to see
//! whether it is behind the wall.  Positions and rates are all that is looked at; nothing is shared with the
//! search for events, whose misses are to be found.

use super::contact::tighter;
use super::impact_monitor::{gap, gap_rate};
use crate::arithmetic::shown::about;
use crate::dynamics::{BodyAngles, Mechanism, Time};
use crate::stepping::search::golden_sections;
use crate::stepping::{Cause, StepError};

/// Parts of a step between which it is looked at, and golden sections after that.
const PARTS: usize = 16;
const SECTIONS: usize = 24;
/// A minimum of the cubic above this share of the largest gap or change of it in the step is far from the
/// wall, whatever the cubic leaves out.
const NEAR: f64 = 0.2;

/// Gaps over the lengths of their contacts, and their rates, at the end of the last step.
#[derive(Clone, Debug, Default)]
pub(super) struct WallGuard {
    /// A gap below minus this is behind the wall.
    closed: f64,
    t: Time,
    gaps: Vec<[f64; 2]>,
}

impl WallGuard {
    /// A guard with the gap that counts as zero, over the length of its contact.
    pub fn new(closed: f64) -> Self {
        Self { closed, ..Self::default() }
    }

    /// Begins at a moment.
    pub fn begin(&mut self, mechanism: &Mechanism, t: Time, body_angles: &BodyAngles) {
        self.t = t;
        self.gaps = gaps(mechanism, t, body_angles);
    }

    /// Takes the end of a step, and tells a contact for which its inside is to be looked at.
    ///
    /// # Errors
    /// A wall that has been passed.
    pub fn step(
        &mut self,
        mechanism: &Mechanism,
        t: Time,
        body_angles: &BodyAngles,
    ) -> Result<Option<usize>, Box<PassedWall>> {
        self.look(mechanism, t, body_angles)?;
        let (h, now) = ((t - self.t).hi, gaps(mechanism, t, body_angles));
        let candidate =
            (0..now.len()).find(|&c| !mechanism.held.contains(&c) && dips(&self.gaps[c], &now[c], h));
        (self.t, self.gaps) = (t, now);
        Ok(candidate)
    }

    /// Looks inside a step for the least gap of a contact; `at` tells time and motion at a share of the step.
    ///
    /// # Errors
    /// A wall that has been passed.
    pub fn search(
        &self,
        mechanism: &Mechanism,
        contact: usize,
        mut at: impl FnMut(f64) -> (Time, BodyAngles),
    ) -> Result<(), Box<PassedWall>> {
        let mut gap_at = |share: f64| -> Result<f64, Box<PassedWall>> {
            let (t, body_angles) = at(share);
            self.look(mechanism, t, &body_angles)?;
            Ok(gap(&mechanism.contacts[contact], mechanism.bodies.len(), t, &body_angles.phi).0)
        };
        let (mut least, mut place) = (f64::INFINITY, 1);
        for i in 1..PARTS {
            let gap = gap_at(i as f64 / PARTS as f64)?;
            if gap < least {
                (least, place) = (gap, i);
            }
        }
        golden_sections(gap_at, [place - 1, place + 1].map(|i| i as f64 / PARTS as f64), SECTIONS)
    }

    /// Looks at one moment.
    ///
    /// # Errors
    /// A wall that has been passed, or that a held point has left.
    pub fn look(
        &self,
        mechanism: &Mechanism,
        t: Time,
        body_angles: &BodyAngles,
    ) -> Result<(), Box<PassedWall>> {
        for (c, contact) in mechanism.contacts.iter().enumerate() {
            let (gap, rounding) = gap(contact, mechanism.bodies.len(), t, &body_angles.phi);
            let is_held = mechanism.held.contains(&c);
            let off = if is_held { gap.abs() } else { -gap };
            if off.is_nan() || off > self.closed + rounding {
                return Err(Box::new(PassedWall {
                    t: t.hi,
                    wall: contact.row.name.clone(),
                    gap: gap * contact.length,
                    is_held,
                }));
            }
        }
        Ok(())
    }
}

fn gaps(mechanism: &Mechanism, t: Time, body_angles: &BodyAngles) -> Vec<[f64; 2]> {
    let angles = mechanism.bodies.len();
    (mechanism.contacts.iter())
        .map(|contact| {
            [
                gap(contact, angles, t, &body_angles.phi).0,
                gap_rate(contact, angles, t, &body_angles.phi, &body_angles.omega),
            ]
        })
        .collect()
}

/// Whether the cubic of a step of `h` has a minimum inside that is near the wall or behind it.
fn dips(before: &[f64; 2], after: &[f64; 2], h: f64) -> bool {
    let size = [before[0].abs(), after[0].abs(), (h * before[1]).abs(), (h * after[1]).abs()]
        .into_iter()
        .fold(0.0, f64::max);
    let value = |i: usize| cubic(before, after, h, i as f64 / PARTS as f64);
    (1..PARTS).any(|i| value(i) < NEAR * size && value(i) <= value(i - 1) && value(i) <= value(i + 1))
}

/// Hermite's cubic through values and rates at both ends of `h`, at a share of it.
fn cubic([a, a_rate]: &[f64; 2], [b, b_rate]: &[f64; 2], h: f64, share: f64) -> f64 {
    let (s, r) = (share, 1.0 - share);
    r * r * (1.0 + 2.0 * s) * a + s * s * (1.0 + 2.0 * r) * b + h * s * r * (r * a_rate - s * b_rate)
}

/// A wall that has been passed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PassedWall {
    t: f64,
    wall: String,
    gap: f64,
    is_held: bool,
}

impl PassedWall {
    /// The stop of a method.
    pub fn stop(self, method: &str) -> StepError {
        let Self { t, wall, gap, is_held } = self;
        let what = match is_held {
            true => format!("a point that is held at wall {wall} is {} m from it", about(gap)),
            false => format!("a point is {} m behind wall {wall} and no impact was found", about(-gap)),
        };
        let hint = tighter(method).into();
        StepError { cause: Cause::WallPassed, method: method.into(), t, step: 0.0, what, hint }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::Scalar;

    #[test]
    fn the_cubic_has_the_values_and_rates_of_both_ends() {
        // t³ - t on [1, 3].
        let (at, rate) = (|t: f64| t * t * t - t, |t: f64| 3.0 * t * t - 1.0);
        for share in [0.0, 0.25, 0.5, 1.0] {
            let found = cubic(&[at(1.0), rate(1.0)], &[at(3.0), rate(3.0)], 2.0, share);
            assert!((found - at(1.0 + 2.0 * share)).abs() < 1e-13);
        }
    }

    /// A ball over a floor, and where it is.
    fn ball() -> (Mechanism, BodyAngles) {
        let scene = r#"{"name": "ball", "gravity": [0, -9.81], "bars": [{"name": "ball", "mass": 1,
         "centre": [0, 0], "inertia": 0.1}],
            "walls": [{"name": "floor", "body": "ball", "point": [0, 0], "line": {"through": [0, 0],
             "normal": [0, 1]}, "restitution": 0.5}],
            "start": {"ball": {"phi": 0, "omega": 0, "origin": [3, 1], "velocity": [0, 0]}}, "until": 1,
             "every": 1}"#;
        let scene = crate::scene::parse_scene(scene, "test", &[]).expect("a scene");
        let body_angles =
            BodyAngles { phi: vec![0.0, 3.0, 1.0], turns: vec![0; 3], omega: vec![0.0, 0.0, -2.0] };
        (Mechanism::new(&scene).expect("a mechanism"), body_angles)
    }

    #[test]
    fn what_is_behind_a_wall_or_left_it_is_told() {
        let (mechanism, mut body_angles) = ball();
        let (guard, held) = (WallGuard::new(1e-9), mechanism.holding(&[0]));
        assert!(guard.look(&mechanism, Time::ZERO, &body_angles).is_ok());
        let stop = guard.look(&held, Time::of(0.5), &body_angles).expect_err("it is above").stop("dp8");
        assert!(
            stop.what.contains("held at wall floor") && stop.t == 0.5 && stop.cause == Cause::WallPassed,
            "{stop}"
        );
        body_angles.phi[2] = -1e-6;
        let stop = guard.look(&mechanism, Time::of(0.5), &body_angles).expect_err("it is below").stop("dp8");
        assert!(stop.what.contains("is 1e-6 m behind wall floor"), "{stop}");
    }

    #[test]
    fn a_dip_inside_a_step_is_found_where_both_ends_are_in_front() {
        let (mechanism, body_angles) = ball();
        // y = (t - 0.3)² - depth on [0, 1], met at no end of it.
        for (depth, is_behind) in [(1e-4, true), (1e-8, true), (-1e-4, false)] {
            let at = |t: f64| BodyAngles {
                phi: vec![0.0, 3.0, (t - 0.3) * (t - 0.3) - depth],
                omega: vec![0.0, 0.0, 2.0 * (t - 0.3)],
                ..body_angles.clone()
            };
            let mut guard = WallGuard::new(1e-9);
            guard.begin(&mechanism, Time::ZERO, &at(0.0));
            assert_eq!(guard.step(&mechanism, Time::of(1.0), &at(1.0)), Ok(Some(0)));
            let found = guard.search(&mechanism, 0, |share| (Time::of(share), at(share)));
            assert_eq!(found.is_err(), is_behind, "{depth:e}");
        }
    }
}
