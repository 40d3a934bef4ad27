//! Bars that turn over: the first time an angle passes an odd multiple of π.
//!
//! Every step in which an angle can come as far as that is looked through: the angles inside it are
//! interpolated until that is resolved, and the passage is found on the interpolant by the search
//! (`stepping/search.rs`) that finds all events.  Whole turns are counted for it where the mechanism itself
//! does not, since there they matter (torsion springs).  The passage itself is found by Newton's method on
//! the dense output of the step, so it is as accurate as the run.

use crate::arithmetic::angle;
use crate::dynamics::{BodyAngles, Form, State};
use crate::stepping::search::{Chebyshev, Crossing, crossing, interpolated};
use std::f64::consts::{PI, TAU};

/// The first passage of a bar.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Flip {
    /// Time \[s\].
    pub t: f64,
    /// Number of the bar.
    pub bar: usize,
}

/// Share of a step that is interpolated at once; of larger parts it is only asked whether a bar can pass.
const SMALLEST: f64 = 1.0 / 16.0;
/// Degrees of the interpolants, and what the last coefficients may be \[rad\].
const DEGREES: [usize; 3] = [8, 16, 32];
const RESOLVED: f64 = 1e-10;
/// Steps of Newton's method at most.
const ROUNDS: usize = 8;

/// Looks at every step until the first passage.
#[derive(Default)]
pub(super) struct FlipDetector {
    pub flip: Option<Flip>,
    before: BodyAngles,
    now: BodyAngles,
}

impl FlipDetector {
    /// Takes the state from which the next step is taken.
    pub fn begin<P: Form + ?Sized>(&mut self, problem: &mut P, state: &State) {
        look(problem, state, &mut self.before);
    }

    /// Takes the state after a step of `span` \[s\], and tells what there is to see at both ends of it where
    /// it holds a passage, or may.
    pub fn step<P: Form + ?Sized>(
        &mut self,
        problem: &mut P,
        state: &State,
        span: f64,
    ) -> Option<[BodyAngles; 2]> {
        if self.flip.is_some() {
            return None;
        }
        look(problem, state, &mut self.now);
        let is_candidate = can_pass(&self.before, &self.now, span);
        let ends = is_candidate.then(|| [self.before.clone(), self.now.clone()]);
        std::mem::swap(&mut self.before, &mut self.now);
        ends
    }

    /// Takes what was found in a step that ends at `t` \[s\], between these ends.
    pub fn conclude(&mut self, t: f64, [a, b]: &[BodyAngles; 2], found: Option<Flip>) {
        // A passage so near the end of the step that rounding decides is there.
        let turned = || (0..a.turns.len()).find(|&bar| a.turns[bar] != b.turns[bar]);
        self.flip = found.or_else(|| turned().map(|bar| Flip { t, bar }));
    }
}

/// Angles and rates of the bodies alone, whole turns taken off and counted whatever the mechanism does with
/// them.
pub(super) fn look<P: Form + ?Sized>(problem: &mut P, state: &State, body_angles: &mut BodyAngles) {
    problem.body_angles(state, body_angles);
    let bodies = problem.mechanism().own_bodies().len();
    body_angles.phi.truncate(bodies);
    body_angles.omega.truncate(bodies);
    body_angles.turns.resize(bodies, 0);
    for (phi, turns) in body_angles.phi.iter_mut().zip(&mut body_angles.turns) {
        *turns = turns.saturating_add(angle::wrap(phi, &mut 0.0));
    }
}

/// True where a bar may come to the boundary in a step, if it is at most twice as fast on the way as at the
/// ends.
pub(super) fn can_pass(a: &BodyAngles, b: &BodyAngles, span: f64) -> bool {
    (0..a.phi.len()).any(|bar| {
        let (from, to) = (a.omega[bar], b.omega[bar]);
        let reach = span * (from.abs().max(to.abs()) + (to - from).abs());
        let farthest = a.phi[bar].abs().max(b.phi[bar].abs()) + reach;
        a.turns[bar] != b.turns[bar] || farthest >= PI || farthest.is_nan()
    })
}

/// False only where [`can_pass`] is, of a bar with these angles and rates at both ends of a step, the angle
/// at its end continued; angles may be off by their rounding.
pub(super) fn may_pass([[phi, omega], [end, rate]]: [[f64; 2]; 2], span: f64) -> bool {
    let reach = span * (omega.abs().max(rate.abs()) + (rate - omega).abs());
    let is_far_off = phi.abs().max(end.abs()) + reach < PI - 1e-6;
    !is_far_off
}

/// The angle at `b`, less the turns of `a` \[rad\].
fn winding(bar: usize, a: &BodyAngles, b: &BodyAngles) -> f64 {
    b.phi[bar] + TAU * (b.turns[bar] - a.turns[bar]) as f64
}

/// The first passage in a step that begins at `start` \[s\] and takes `span` \[s\]; `at` looks so many
/// seconds after its beginning.
pub(super) fn search(
    start: f64,
    span: f64,
    [first, last]: &[BodyAngles; 2],
    at: &mut dyn FnMut(f64) -> BodyAngles,
) -> Option<Flip> {
    // Later halves wait.
    let mut parts = vec![(0.0, span, first.clone(), last.clone())];
    while let Some((begin, end, a, b)) = parts.pop() {
        if !can_pass(&a, &b, end - begin) {
            continue;
        }
        if end - begin > span * SMALLEST {
            let middle = 0.5 * (begin + end);
            let there = at(middle);
            parts.push((middle, end, there.clone(), b));
            parts.push((begin, middle, a, there));
        } else if let Some(flip) = first_passage(start, [begin, end], &a, at) {
            return Some(flip);
        }
    }
    None
}

/// The first passage in a part of a step, which begins with `first`.
fn first_passage(
    start: f64,
    [begin, end]: [f64; 2],
    first: &BodyAngles,
    at: &mut dyn FnMut(f64) -> BodyAngles,
) -> Option<Flip> {
    let span = end - begin;
    let angles_at = |share: f64, row: &mut Vec<f64>| {
        let there = at(begin + share * span);
        row.extend((0..first.phi.len()).map(|bar| winding(bar, first, &there)));
    };
    let angles = interpolated(&DEGREES, angles_at, |_, angle, _| angle.tail() < RESOLVED).values;
    let mut found: Option<(f64, usize, f64)> = None;
    for (bar, angles) in angles.iter().enumerate() {
        for side in [1.0, -1.0] {
            let room: Vec<f64> = angles.iter().map(|angle| PI - side * angle).collect();
            let share = match crossing(&Chebyshev::through(&room), 1.0) {
                Crossing::At(share) => share,
                // It stood on the boundary.
                Crossing::Inside(_) => 0.0,
                Crossing::Nothing => continue,
            };
            if found.is_none_or(|(earliest, ..)| share < earliest) {
                found = Some((share, bar, side));
            }
        }
    }
    found.map(|(share, bar, side)| Flip {
        t: start + passage(bar, side, first, begin + share * span, [begin, end], at),
        bar,
    })
}

/// The time after the step's beginning at which a bar is on the boundary, near `t` \[s\].
fn passage(
    bar: usize,
    side: f64,
    first: &BodyAngles,
    near: f64,
    [begin, end]: [f64; 2],
    at: &mut dyn FnMut(f64) -> BodyAngles,
) -> f64 {
    let mut t = near;
    for _ in 0..ROUNDS {
        let there = at(t);
        let moved = t - (side * winding(bar, first, &there) - PI) / (side * there.omega[bar]);
        // Where it hardly passes at all the interpolant knows better.
        if near == begin || !(begin..=end).contains(&moved) || (moved - near).abs() > 1e-3 * (end - begin) {
            break;
        }
        let change = (moved - t).abs();
        t = moved;
        if change <= 1e-15 * end {
            break;
        }
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body_angles(phi: f64, omega: f64) -> BodyAngles {
        let (mut hi, mut lo) = (phi, 0.0);
        let turns = angle::wrap(&mut hi, &mut lo);
        BodyAngles { phi: vec![hi], turns: vec![turns], omega: vec![omega] }
    }

    /// The first passage of a given motion in one step.
    fn search(motion: impl Fn(f64) -> [f64; 2], span: f64) -> Option<Flip> {
        let ends = [0.0, span].map(|t| body_angles(motion(t)[0], motion(t)[1]));
        let suspicious = can_pass(&ends[0], &ends[1], span);
        suspicious
            .then(|| super::search(2.0, span, &ends, &mut |t| body_angles(motion(t)[0], motion(t)[1])))?
    }

    #[test]
    fn a_passage_is_found_to_rounding() {
        for (rate, time) in [(1.0, PI - 3.0), (-2.0, 0.5 * (PI + 3.0))] {
            let found = search(|t| [3.0 + rate * t, rate], 4.0).expect("it passes");
            assert!((found.t - 2.0 - time).abs() < 1e-14, "{found:?}");
        }
        // Two boundaries in one step: the first counts.
        let far = search(|t| [3.0 * t * t, 6.0 * t], 2.0).expect("it passes");
        assert!((far.t - 2.0 - (PI / 3.0).sqrt()).abs() < 1e-14, "{far:?}");
    }

    /// A step that ends just before the passage leaves it to the first moments of the next one.
    #[test]
    fn a_passage_just_behind_the_beginning_is_found_to_rounding() {
        for before in [1e-3, 4e-6, 1e-8, 1e-11] {
            let found =
                search(|t| [before - PI - 0.75 * t + 0.2 * t * t, 0.4 * t - 0.75], 0.1).expect("it passes");
            let root = 2.0 * before / (0.75 + (0.75_f64 * 0.75 - 0.8 * before).sqrt());
            assert!((found.t - 2.0 - root).abs() < 1e-14, "{before}: {found:?} {root}");
        }
    }

    #[test]
    fn there_and_back_within_one_step_is_seen() {
        let top = |height: f64| move |t: f64| [height - (t - 0.4) * (t - 0.4), -2.0 * (t - 0.4)];
        for height in [1e-4_f64, 1e-8, 1e-10] {
            let found = search(top(PI + height), 1.0).expect("it passes twice");
            assert!((found.t - 2.4 + height.sqrt()).abs() < 1e-9, "{height}: {found:?}");
            assert_eq!(search(top(PI - height), 1.0), None);
        }
        assert_eq!(search(top(2.0), 1.0), None);
        let below = search(|t| [-PI - 0.01 + (t - 0.5) * (t - 0.5), 2.0 * (t - 0.5)], 1.0)
            .expect("on the other side");
        assert!((below.t - 2.0 - 0.4).abs() < 1e-9, "{below:?}");
        // Twice out and back, and the ends of the step head inwards.
        let wave = |t: f64| [3.0 + 0.2 * (12.0 * t - 1.0).cos(), -2.4 * (12.0 * t - 1.0).sin()];
        let twice = search(wave, 1.0).expect("it passes");
        assert!((twice.t - 2.0).abs() < 0.3 && (wave(twice.t - 2.0)[0] - PI).abs() < 1e-12, "{twice:?}");
    }

    #[test]
    fn a_bar_that_stands_on_the_boundary_passes_it_where_it_falls_outwards() {
        assert_eq!(search(|t| [PI + t * t, 2.0 * t], 1.0), Some(Flip { t: 2.0, bar: 0 }));
        assert_eq!(search(|t| [PI - t * t, -2.0 * t], 1.0), None);
        assert_eq!(search(|t| [-PI - t * t, -2.0 * t], 1.0), Some(Flip { t: 2.0, bar: 0 }));
    }
}
