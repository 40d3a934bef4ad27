//! What an output comes to beside a singular position, by polynomials through what is remembered of it.

use super::Found;
use crate::arithmetic::DoubleDouble;
use crate::stepping::search::{golden_sections, value};
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

/// Shares of the way to the farther end on which a limit is looked for, and halvings of the rest.
const SHARES: [f64; 6] = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125];
const HALVINGS: u32 = 3;
/// Degrees of polynomials over both sides and over one, and how much lower that of the other one is.
const BOTH: usize = 8;
const ONE: usize = 6;
const LOWER: usize = 2;
/// Two polynomials tell what differs by no more over the largest value, or over magnitudes of rounding.
const ALIKE: f64 = 1e-5;
const ROUNDING: f64 = 1e5;
/// p(0) over the largest |p| above which an output is without bound.
const POLE: f64 = 1e-3;
/// The length of one side over that of both below which the other one's polynomial serves for it.
const SHORT: f64 = 0.1;
/// Intervals in which a polynomial is looked at; an even number; and golden sections beside its extremes.
const INTERVALS: u32 = 256;
const ROUNDS: usize = 32;

/// Time from the singular position over the longest one, value, and weight.
pub(in crate::run) type Point = [f64; 3];

/// Such a point, where the weakest constraint has this share.
pub(in crate::run) fn weighted([at, value]: [f64; 2], share: f64) -> Point {
    [at, value, share.powf(1.5)]
}

/// An output beside a singular position.
pub(in crate::run) struct OutputNear {
    /// The singular position and the time from it to the farther end \[s\].
    pub centre: f64,
    pub reach: f64,
    /// The ends of what is remembered, times over that one.
    pub ends: [f64; 2],
    /// Magnitude that is rounding.
    pub rounding: f64,
    /// What is remembered of it, and of that the nearest time and value on either side, however inaccurate.
    pub points: Vec<Point>,
    pub nearest: [Option<[f64; 2]>; 2],
}

/// What an output comes to on one side.
#[derive(Clone)]
pub(in crate::run) enum SideLimit {
    /// Coefficients of a polynomial, and up to which share of the way to the farther end it is that.
    Curve(Vec<f64>, f64),
    /// The same over the time from the singular position, times the sense it is without bound in.
    Unbounded(Vec<f64>, f64),
    Unknown,
}

impl OutputNear {
    /// Adds what it comes to between these times over the longest one, before and after the singular
    /// position; nothing is known of it where `is_passed` is false.
    pub(super) fn count(&self, found: &mut Found, core: [f64; 2], is_passed: bool) {
        let sides = self.sides();
        let limits = if is_passed { self.limits(&sides) } else { [SideLimit::Unknown, SideLimit::Unknown] };
        for ((end, side), limit) in core.into_iter().zip(&sides).zip(limits) {
            self.count_side(found, end, side, limit);
        }
    }

    /// What is remembered before and after the singular position.
    fn sides(&self) -> [Vec<Point>; 2] {
        [-1.0, 1.0].map(|sign| within(&self.points, |at| sign * at > 0.0))
    }

    /// What it comes to on both sides.
    pub fn both_sides(&self) -> [SideLimit; 2] {
        self.limits(&self.sides())
    }

    /// The same, by the points on them.
    fn limits(&self, sides: &[Vec<Point>; 2]) -> [SideLimit; 2] {
        let is_zero = true;
        for share in SHARES {
            let is_in = |at: f64| at.abs() <= share;
            if sides.iter().all(|side| within(side, is_in).len() > ONE)
                && let Some(curve) = alike(&within(&self.points, is_in), BOTH, self.rounding, is_zero)
            {
                return [SideLimit::Curve(curve.clone(), share), SideLimit::Curve(curve, share)];
            }
        }
        let limit = |side: &Vec<Point>| {
            let told = |share: f64| {
                let near = within(side, |at| at.abs() <= share);
                if let Some(curve) = alike(&near, ONE, self.rounding, is_zero) {
                    return Some(SideLimit::Curve(curve, share));
                }
                let times: Vec<Point> =
                    near.iter().map(|[at, y, weight]| [*at, y * at.abs(), *weight]).collect();
                let most = most(&times);
                let curve = alike(&times, ONE, self.rounding, is_zero)?;
                (curve[0].abs() > POLE * most).then_some(SideLimit::Unbounded(curve, share))
            };
            SHARES.into_iter().find_map(told).unwrap_or(SideLimit::Unknown)
        };
        let mut found = sides.each_ref().map(limit);
        for (side, end) in self.ends.into_iter().enumerate() {
            if end.abs() < SHORT && matches!(found[side], SideLimit::Unknown) {
                found[side] = found[1 - side].carried_on(self.nearest[side]);
            }
        }
        found
    }

    /// Adds what it comes to between the singular position and one end.
    fn count_side(&self, found: &mut Found, end: f64, side: &[Point], limit: SideLimit) {
        match limit {
            SideLimit::Curve(curve, share) => {
                let to = end.clamp(-share, share);
                self.count_curve(found, &curve, [0.0, to]);
                if to != end {
                    self.count_rest(found, side, [to, end], HALVINGS);
                }
            }
            SideLimit::Unbounded(curve, share) => {
                let [inner, outer] = [share.min(end.abs()), end.abs()];
                let seen = side.iter().filter(|point| (inner..=outer).contains(&point[0].abs()));
                seen.for_each(|[at, y, _]| found.see(*y, self.centre + at * self.reach));
                let to = inner.copysign(end);
                self.see(found, |at| value(&curve, at)[0] / at.abs(), [to / f64::from(INTERVALS), to]);
                found.see(f64::INFINITY.copysign(curve[0]), self.centre);
            }
            SideLimit::Unknown if end != 0.0 => found.forget(),
            SideLimit::Unknown => {}
        }
    }

    /// Adds what it comes to in a part of a side, by polynomials.
    fn count_rest(&self, found: &mut Found, side: &[Point], [from, to]: [f64; 2], halvings: u32) {
        let (low, high) = (from.min(to), from.max(to));
        let part = within(side, |at| (low..=high).contains(&at));
        let middle = 0.5 * (from + to);
        match alike(&part, ONE, self.rounding, false) {
            Some(curve) => self.count_curve(found, &curve, [from, to]),
            None if halvings == 0 => found.forget(),
            None => {
                self.count_rest(found, side, [from, middle], halvings - 1);
                self.count_rest(found, side, [middle, to], halvings - 1);
            }
        }
    }

    /// Adds what a polynomial comes to in a part of a side.
    fn count_curve(&self, found: &mut Found, curve: &[f64], [from, to]: [f64; 2]) {
        // What has no other sign anywhere is no further beyond zero than the polynomial may be off.
        let off = ALIKE * most(&self.points);
        let has_sign = |sign: f64| self.points.iter().all(|point| sign * point[1] >= 0.0);
        let [low, high] = [1.0, -1.0].map(|sign| if has_sign(sign) { -sign * off } else { 0.0 });
        let at = |at: f64| {
            let value = value(curve, at)[0];
            if (low..0.0).contains(&value) || value > 0.0 && value <= high { 0.0 } else { value }
        };
        let values = self.see(found, at, [from, to]);
        let (mut integral, mut square) = (0.0, 0.0);
        for (i, value) in values.iter().enumerate() {
            // Simpson's rule.
            let weight = match i {
                _ if i == 0 || i + 1 == values.len() => 1.0,
                _ => 2.0 + 2.0 * (i % 2) as f64,
            };
            integral += weight * value;
            square += weight * value * value;
        }
        let share = (to - from).abs() * self.reach / (3.0 * f64::from(INTERVALS));
        found.integral += DoubleDouble::product(integral, share);
        found.square += DoubleDouble::product(square, share);
    }

    /// Looks at a function between two times, and beside its extremes; returns its values.
    fn see(&self, found: &mut Found, f: impl Fn(f64) -> f64, [from, to]: [f64; 2]) -> Vec<f64> {
        let place = |i: usize| from + (to - from) * (i as f64 / f64::from(INTERVALS));
        let mut seen = |at: f64| {
            let value = f(at);
            found.see(value, self.centre + at * self.reach);
            value
        };
        let values: Vec<f64> = (0..=INTERVALS as usize).map(|i| seen(place(i))).collect();
        for sign in [1.0, -1.0] {
            let signed = |i: &usize| sign * values[*i];
            let least = (0..values.len()).min_by(|a, b| signed(a).total_cmp(&signed(b))).unwrap_or(0);
            if (1..values.len() - 1).contains(&least) {
                let bracket = [place(least - 1), place(least + 1)];
                let Ok(()) = golden_sections(|at| Ok::<f64, Infallible>(sign * seen(at)), bracket, ROUNDS);
            }
        }
        values
    }
}

impl SideLimit {
    /// What it is on the other side, of which little is remembered: there the sense may be the other one.
    fn carried_on(&self, nearest: Option<[f64; 2]>) -> Self {
        match (self, nearest) {
            (Self::Unbounded(curve, share), Some([at, y])) => {
                let sign = if y * value(curve, at)[0] < 0.0 { -1.0 } else { 1.0 };
                Self::Unbounded(curve.iter().map(|power| sign * power).collect(), *share)
            }
            _ => self.clone(),
        }
    }
}

/// The largest magnitude.
fn most(points: &[Point]) -> f64 {
    points.iter().fold(0.0, |most: f64, point| most.max(point[1].abs()))
}

/// Limits before and after the singular position, as far as its sides have points enough.
pub(super) fn both_limits(points: &[Point]) -> Option<[f64; 2]> {
    SHARES.iter().rev().find_map(|share| {
        let [before, after] = [-1.0, 1.0].map(|sign| {
            let near = within(points, |at| sign * at > 0.0 && at.abs() <= *share);
            fitted(&near, ONE).map(|curve| curve[0])
        });
        Some([before?, after?])
    })
}

/// The points at such times.
fn within(points: &[Point], is_in: impl Fn(f64) -> bool) -> Vec<Point> {
    points.iter().copied().filter(|point| is_in(point[0])).collect()
}

/// The polynomial of a degree through points, in the least squares, where one of a lower degree is like it:
/// at the points, and at zero where that is asked.
fn alike(points: &[Point], degree: usize, rounding: f64, is_zero: bool) -> Option<Vec<f64>> {
    let (curve, lower) = (fitted(points, degree)?, fitted(points, degree - LOWER)?);
    let most = most(points);
    let apart = |at: f64| (value(&curve, at)[0] - value(&lower, at)[0]).abs();
    let is_alike = |at: f64| apart(at) <= (ALIKE * most).max(ROUNDING * rounding);
    ((!is_zero || is_alike(0.0)) && points.iter().all(|point| is_alike(point[0]))).then_some(curve)
}

/// The polynomial of a degree through points, in the least squares; `None` of too few of them.
fn fitted(points: &[Point], degree: usize) -> Option<Vec<f64>> {
    if points.len() <= degree {
        return None;
    }
    let weight = |i: usize| points[i][2];
    let powers = DMatrix::from_fn(points.len(), degree + 1, |i, k| weight(i) * points[i][0].powi(k as i32));
    let values = DVector::from_fn(points.len(), |i, _| weight(i) * points[i][1]);
    let qr = powers.qr();
    let found = qr.r().solve_upper_triangular(&(qr.q().transpose() * values))?;
    found.iter().all(|x| x.is_finite()).then(|| found.iter().copied().collect())
}
