//! Whether a point can come to a wall in a step, lane by lane, by bounds alone.
//!
//! ```text
//! g(t) >= g + g' t - B t²/2,
//!     |g''| <= B = Σ |g_k| (a_k + w_k²) + Σ |h_jk| (a_j + (w_j + w_k)² + a_k) + |s''|
//! w = Σ |w_m| h^m,  a = Σ m |w_m| h^(m-1)
//!     bounds of rates and accelerations in a step h
//! ```
//!
//! Where a body floats its place x is an element as unit vectors are, of length |x| + w h, with |x'| <= w and
//! |x''| <= a by the norms of those of its coordinates:
//!
//! ```text
//! |(h z_j·z_k)''| <= |h| (|z_j''| |z_k| + 2 |z_j'| |z_k'| + |z_j| |z_k''|)
//! ```
//!
//! The right side is concave, so that its ends tell.  Where it says nothing halves of the step are asked,
//! each from the motion at its beginning.  Up to a part that may hold an impact the step is clear; where that
//! is next to nothing the trajectory is left to code that finds the moment of an impact and what it does.

use crate::arithmetic::Complex;
use crate::arithmetic::eight::LANES;
use crate::dynamics::constraint::RowMeasure;
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
    /// Bounds of the rate and the acceleration of every coordinate in the step \[rad/s, rad/s², m/s, m/s²\].
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

    /// Of a step of a mechanism as much as no point can come to a wall in, where that is worth a step \[s\].
    pub(super) fn of(
        &mut self,
        mechanism: &Mechanism,
        series: &dyn SeriesInLanes,
        step: StepFrom,
    ) -> Option<f64> {
        let angles = mechanism.bodies.len();
        self.bound([angles, mechanism.coordinates()], series, step);
        // Part by part, the larger first.
        let (mut from, mut part) = (0, PARTS);
        while from < PARTS {
            let length = |parts: usize| step.length * (parts as f64 / PARTS as f64);
            if self.is_clear(angles, series, step, [length(from), length(part)]) {
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
    fn bound(&mut self, [angles, coordinates]: [usize; 2], series: &dyn SeriesInLanes, step: StepFrom) {
        let StepFrom { lane, order, length, time } = step;
        self.most.clear();
        self.most.extend((0..coordinates).map(|coordinate| {
            (0..order + 1).rev().fold([0.0, 0.0], |[rate, slope], m| {
                [rate * length + series.rate_of(m, coordinate, lane).abs(), slope * length + rate]
            })
        }));
        let most = &self.most;
        // Bounds of an element and its first two derivatives, where it is the place of a body that floats.
        let moving = |x: usize| {
            let ([one, one_slope], [other, other_slope]) = (most[x], most[x + 1]);
            let rate = libm::hypot(one, other);
            let place = series.unit_of(x, lane).norm_squared().sqrt() + rate * length;
            [place, rate, libm::hypot(one_slope, other_slope)]
        };
        let element = |k: usize| match most[k] {
            [rate, slope] if k < angles => [1.0, rate, slope + rate * rate],
            _ => moving(k),
        };
        let norm = |g: Complex<f64>| g.norm_squared().sqrt();
        let bend = |contact: &Contact| {
            let RowMeasure::Place(place) = &contact.row.measure else { return f64::INFINITY };
            let law = contact.row.law.as_ref().map_or(0.0, |law| law.bounds(time.hi + length)[1]);
            let single = place.linear.iter().fold(law, |sum, &(k, g)| sum + norm(g) * element(k)[2]);
            let all = place.bilinear.iter().fold(single, |sum, &(j, k, h)| {
                if j.max(k) >= angles {
                    let ([one, one_rate, one_bend], [other, other_rate, other_bend]) =
                        (element(j), element(k));
                    return sum
                        + norm(h) * (one_bend * other + 2.0 * one_rate * other_rate + one * other_bend);
                }
                let ([one, one_slope], [other, other_slope]) = (most[j], most[k]);
                sum + norm(h) * (one_slope + (one + other) * (one + other) + other_slope)
            });
            all / contact.length
        };
        self.bends.clear();
        self.bends.extend(self.contacts[lane].iter().map(bend));
    }

    /// True where no point can come to a wall in a part of the step, so long from its beginning on \[s\].
    fn is_clear(
        &self,
        angles: usize,
        series: &dyn SeriesInLanes,
        step: StepFrom,
        [after, length]: [f64; 2],
    ) -> bool {
        let StepFrom { lane, order, .. } = step;
        // How far a coordinate has gone, and its rate.
        let moved = |coordinate: usize| {
            let (mut way, mut rate) = (0.0, 0.0);
            for m in (0..=order).rev() {
                let power = series.rate_of(m, coordinate, lane);
                (way, rate) = (way * after + power / (m + 1) as f64, rate * after + power);
            }
            (way * after, rate)
        };
        let element = |k: usize| {
            let start = series.unit_of(k, lane);
            if k >= angles {
                let ((x, x_rate), (y, y_rate)) = (moved(k), moved(k + 1));
                return [start + Complex::new(x, y), Complex::new(x_rate, y_rate)];
            }
            if after == 0.0 {
                return turning(start, series.rate_of(0, k, lane));
            }
            let (angle, rate) = moved(k);
            turning(start * Complex::unit(angle), rate)
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
