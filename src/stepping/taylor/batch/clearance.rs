//! Whether a point can come to a wall in a step, lane by lane, by bounds alone.
//!
//! ```text
//! g(t) >= g + g' t - B t²/2,    |g''| <= B = Σ |g_k| (a_k + w_k²) + Σ |h_jk| (a_j + (w_j + w_k)² + a_k) + |s''|
//! w = Σ |w_m| h^m,  a = Σ m |w_m| h^(m-1)                                 bounds of rates and accelerations in a step h
//! ```
//!
//! The right side is concave, so that its ends tell.  Where it says nothing halves of the step are asked, each
//! from the motion at its beginning.  Up to a part that may hold an impact the step is clear; where that is
//! next to nothing the trajectory is left to code that finds the moment of an impact and what it does.

use crate::arithmetic::Complex;
use crate::arithmetic::eight::LANES;
use crate::dynamics::constraint::Measure;
use crate::dynamics::gap::turning;
use crate::dynamics::impact::Contact;
use crate::dynamics::series::lanes::SeriesInLanes;
use crate::dynamics::{Along, Mechanism, Time};

/// A gap over what it is summed from that is zero to rounding: a point that leaves its wall.
const TOUCHING: f64 = 1e-13;
/// Parts of a step that are told apart, a power of two.
const PARTS: usize = 16;
/// Share of a step that is worth a step in a lane.
const LEAST: f64 = 0.2;

/// The walls of the mechanisms in the lanes, about a step of one of them.
#[derive(Debug, Default)]
pub(super) struct Clearance {
    contacts: [Vec<Contact>; LANES],
    /// Bounds of the rate and the acceleration of every body in the step \[rad/s, rad/s²\].
    most: Vec<[f64; 2]>,
    /// Bounds of the second derivatives of the gaps over their lengths \[1/s²\].
    bends: Vec<f64>,
}

/// Where a step of a lane begins, and how long it is \[s\].
#[derive(Clone, Copy, Debug)]
pub(super) struct StepFrom {
    pub lane: usize,
    pub time: Time,
    pub order: usize,
    pub length: f64,
}

/// True for walls this looks at: those that stay, or move by a law without formulas.
pub(super) fn takes(contact: &Contact) -> bool {
    contact.row.aim.is_none() && contact.row.law.as_ref().is_none_or(|law| law.profile.is_none())
}

impl Clearance {
    /// Takes the walls of the trajectory in a lane.
    pub(super) fn take_in(&mut self, lane: usize, mechanism: &Mechanism) {
        self.contacts[lane].clone_from(&mechanism.contacts);
    }

    /// Of a step of so many bodies as much as no point can come to a wall in, where that is worth a step
    /// \[s\].
    pub(super) fn of(&mut self, bodies: usize, series: &dyn SeriesInLanes, step: StepFrom) -> Option<f64> {
        self.bound(bodies, series, step);
        // Part by part, the larger first.
        let (mut from, mut part) = (0, PARTS);
        while from < PARTS {
            let length = |parts: usize| step.length * (parts as f64 / PARTS as f64);
            if self.is_clear(series, step, [length(from), length(part)]) {
                from += part;
                // The largest part that begins here.
                part = 1 << from.trailing_zeros();
            } else if part > 1 {
                part /= 2;
            } else {
                break;
            }
        }
        let clear = from as f64 / PARTS as f64;
        (clear >= LEAST).then_some(step.length * clear)
    }

    /// Bounds of rates and accelerations in a step, and of what gaps make of them.
    fn bound(&mut self, bodies: usize, series: &dyn SeriesInLanes, step: StepFrom) {
        let StepFrom { lane, order, length, time } = step;
        self.most.clear();
        self.most.extend((0..bodies).map(|body| {
            (0..=order).rev().fold([0.0, 0.0], |[rate, slope], m| {
                [rate * length + series.rate_of(m, body, lane).abs(), slope * length + rate]
            })
        }));
        let most = &self.most;
        let norm = |g: Complex<f64>| g.norm_squared().sqrt();
        let bend = |contact: &Contact| {
            let Measure::Place(place) = &contact.row.measure else { return f64::INFINITY };
            let law = contact.row.law.as_ref().map_or(0.0, |law| law.bounds(time.hi + length)[1]);
            let single = place.linear.iter().fold(law, |sum, &(k, g)| {
                let [rate, acceleration] = most[k];
                sum + norm(g) * (acceleration + rate * rate)
            });
            let all = place.bilinear.iter().fold(single, |sum, &(j, k, h)| {
                let ([one, one_slope], [other, other_slope]) = (most[j], most[k]);
                sum + norm(h) * (one_slope + (one + other) * (one + other) + other_slope)
            });
            all / contact.length
        };
        self.bends.clear();
        self.bends.extend(self.contacts[lane].iter().map(bend));
    }

    /// True where no point can come to a wall in a part of the step, so long from its beginning on \[s\].
    fn is_clear(&self, series: &dyn SeriesInLanes, step: StepFrom, [after, length]: [f64; 2]) -> bool {
        let StepFrom { lane, order, .. } = step;
        let element = |body: usize| {
            if after == 0.0 {
                return turning(series.unit_of(body, lane), series.rate_of(0, body, lane));
            }
            let (mut angle, mut rate) = (0.0, 0.0);
            for m in (0..=order).rev() {
                let power = series.rate_of(m, body, lane);
                (angle, rate) = (angle * after + power / (m + 1) as f64, rate * after + power);
            }
            turning(series.unit_of(body, lane) * Complex::unit(angle * after), rate)
        };
        let at = Along { time: step.time + after, step_size: 1.0, y: &[], slope: &[] };
        self.contacts[lane].iter().zip(&self.bends).all(|(contact, bend)| {
            if contact.is_off {
                return true;
            }
            let Some([gap, slope, size]) = contact.gap_along(&at, element) else { return false };
            let is_away = gap > 0.0 || after == 0.0 && gap > -TOUCHING * size && slope > 0.0;
            is_away && gap + length * (slope - 0.5 * length * bend) > 0.0
        })
    }
}
