//! The first zero of an event function inside a step, told by bounds and not by samples.
//!
//! ```text
//! on |t - c| <= r, with B a bound of |g''| there, and g(c) known to e:
//! |g(c)| > |g'(c)| r + B r²/2 + e     no zero
//! |g'(c)| > B r                   monotone: at most one, told by the signs at the ends
//! else                            both halves, the earlier one first
//! ```
//!
//! An event function is a [`Curve`]: a power series ([`PowerSeries`]), a function of a motion whose unknowns
//! are polynomials (`event`, and whatever else watches a motion), or a Chebyshev interpolant
//! ([`interpolated`]) where nothing bounds it.  Where all that is left of a part is rounding, there is
//! nothing to be told apart, and signs at the ends decide.
//!
//! Two zeros as close together as 1e-9 of the step are found.  Source: R. E. Moore, *Methods and Applications
//! of Interval Analysis* (1979), chapter 5, for exclusion by bounds; Newton's method inside a bracket after
//! W. Press et al., *Numerical Recipes*, 3rd ed. (2007), section 9.4.

mod chebyshev;

pub use chebyshev::{Chebyshev, Interpolants, Nodes, interpolated, oscillates};

/// A value that counts as zero at the step's start: it must open before it can close.
pub const TOUCH: f64 = 1e-12;
/// Depth of a minimum below zero, over what rounding may do there, up to which it touches zero.
const GRAZE: f64 = 0.5;
/// Share of the step below which two zeros are one.
const CLOSE: f64 = 1e-9;
/// Dips into the zone of doubt that are looked at in a step.
const DIPS: usize = 64;
/// Parts looked at before signs at the ends of what is left decide: by then there is nothing but rounding.
const MOST: usize = 4000;
/// Share of the step from which on down a power series is taken about the middle of a part.
const SMALL: f64 = 1.0 / 64.0;
/// Roundings of its largest terms up to which a value is zero.
pub const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The side of zero a value is on: -1, 0 or 1.
pub fn sign(value: f64) -> i8 {
    if value > 0.0 { 1 } else { -i8::from(value < 0.0) }
}

/// A function of time, or of the share of a step, with bounds.
pub trait Curve {
    /// Value and slope at `t`.
    fn at(&self, t: f64) -> [f64; 2];

    /// What is known of it at most `radius` away from `centre`.
    fn about(&self, centre: f64, radius: f64) -> IntervalBounds;
}

/// A function on a part of a step.
#[derive(Clone, Copy, Debug)]
pub struct IntervalBounds {
    /// Value in the middle.
    pub value: f64,
    /// Slope there.
    pub slope: f64,
    /// Bound of the second derivative; more exactly the slope is off by no more than this times the distance
    /// from the middle.
    pub bend: f64,
    /// What rounding may do to values.
    pub rounding: f64,
}

/// What bounds tell of a part.
enum ZeroBounds {
    NoZero,
    /// At most one, or nothing but rounding: the signs at the ends tell.
    BySigns,
    Open,
}

impl IntervalBounds {
    fn tells(&self, level: f64, radius: f64) -> ZeroBounds {
        let (value, slope) = ((self.value - level).abs(), self.slope.abs());
        let tilt = self.bend * radius;
        let reach = radius * (slope + 0.5 * tilt);
        let most = value + reach;
        // A zero may be where the part begins or ends.
        if value > reach + self.rounding {
            ZeroBounds::NoZero
        } else if slope > tilt || most <= self.rounding || most.is_nan() {
            ZeroBounds::BySigns
        } else {
            ZeroBounds::Open
        }
    }
}

/// What an event function does in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crossing {
    /// It stays positive, or at zero.
    Nothing,
    /// It passes from positive to negative here.
    At(f64),
    /// From zero it goes negative without opening first; it has left zero here.
    Inside(f64),
}

/// The first passage of a function within `end`.
pub fn crossing(curve: &impl Curve, end: f64) -> Crossing {
    let [first, _] = curve.at(0.0);
    if first > TOUCH {
        return passage(curve, 0.0, end);
    }
    let opens = root(curve, TOUCH, 0.0, end);
    let is_below = first <= -TOUCH;
    let sinks = root(curve, if is_below { first - 0.1 * TOUCH } else { -TOUCH }, 0.0, end);
    match (opens, sinks) {
        (open, Some(sink)) if open.is_none_or(|open| sink < open) => {
            Crossing::Inside(if is_below { 0.0 } else { sink })
        }
        (Some(open), _) => passage(curve, open, end),
        (None, _) => Crossing::Nothing,
    }
}

/// The first passage of a positive function to negative values that are no rounding: what touches zero with
/// its minimum stays on its side, and what has hardly passed at the end of a step is found in the next one.
fn passage(curve: &impl Curve, mut from: f64, end: f64) -> Crossing {
    for _ in 0..DIPS {
        let Some(at) = root(curve, 0.0, from, end) else { break };
        let rounding = curve.about(at, 0.0).rounding;
        let depth = GRAZE * rounding;
        let is_low = curve.at(at)[0] <= -depth;
        let low = if is_low { Some(at) } else { root(curve, -depth, at, end) };
        match (low, root(curve, TOUCH.max(2.0 * rounding), at, end)) {
            (Some(low), high) if high.is_none_or(|high| low < high) => return Crossing::At(at),
            (_, Some(high)) => from = high,
            _ => break,
        }
    }
    Crossing::Nothing
}

/// The first minimum in (begin, end], and before a passage at `passes` that does not lead to it, whose value
/// is not known to be on either side of zero: where values are `off(t) <= zone` from the truth.
pub fn doubtful(
    curve: &impl Curve,
    zone: f64,
    off: impl Fn(f64) -> f64,
    [begin, end]: [f64; 2],
    passes: Option<f64>,
) -> Option<f64> {
    let known = begin;
    let mut begin = 0.0;
    for _ in 0..DIPS {
        let low = if curve.at(begin)[0] < zone { begin } else { root(curve, zone, begin, end)? };
        // So far above the level it came down to that rounding makes no dips.
        let high = root(curve, 2.0 * zone, low, end).unwrap_or(end);
        if curve.at(low)[1] < 0.0 && curve.at(high)[1] > 0.0 {
            let lowest = turn(curve, low, high);
            if lowest > known && curve.at(lowest)[0].abs() < off(lowest) {
                return Some(lowest);
            }
        }
        if high >= end || passes.is_some_and(|passes| passes <= high) {
            break;
        }
        begin = high;
    }
    None
}

/// A minimum between two places where the slope is negative, and positive.
fn turn(curve: &impl Curve, mut low: f64, mut high: f64) -> f64 {
    while high - low > 4.0 * f64::EPSILON * high {
        let middle = 0.5 * (low + high);
        if curve.at(middle)[1] < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Asks for values in a bracket by golden sections, as they close in on the least one.
///
/// # Errors
/// What asking for a value ends with.
pub fn golden_sections<E>(
    mut value: impl FnMut(f64) -> Result<f64, E>,
    [mut low, mut high]: [f64; 2],
    sections: usize,
) -> Result<(), E> {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let [mut one, mut other] = [high - golden * (high - low), low + golden * (high - low)];
    let [mut at_one, mut at_other] = [value(one)?, value(other)?];
    for _ in 0..sections {
        if at_one < at_other {
            (high, other, at_other) = (other, one, at_one);
            one = high - golden * (high - low);
            at_one = value(one)?;
        } else {
            (low, one, at_one) = (one, other, at_other);
            other = low + golden * (high - low);
            at_other = value(other)?;
        }
    }
    Ok(())
}

/// The first change of sign of `curve - level` in (from, to].
pub fn root(curve: &impl Curve, level: f64, from: f64, to: f64) -> Option<f64> {
    search(curve, level, from, to).0
}

/// The same, and the number of parts it took.
fn search(curve: &impl Curve, level: f64, from: f64, to: f64) -> (Option<f64>, usize) {
    // Later halves wait; thirty halvings come down to what counts as close.
    let mut parts = [(from, to); 40];
    let (mut count, mut seen) = (1, 0);
    let least = CLOSE * (to - from);
    // What the curve was last, wherever it was not zero.
    let mut side = 0.0_f64;
    while count > 0 {
        count -= 1;
        seen += 1;
        let (low, high) = parts[count];
        let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low));
        let part = curve.about(centre, radius);
        match part.tells(level, radius) {
            ZeroBounds::NoZero => side = part.value - level,
            ZeroBounds::Open if radius >= least && seen < MOST && count + 2 <= parts.len() => {
                (parts[count], parts[count + 1]) = ((centre, high), (low, centre));
                count += 2;
            }
            _ => {
                let at = |t: f64| curve.at(t)[0] - level;
                let (before, after) = (at(low), at(high));
                // A zero at the beginning is the one the search starts from.
                if before != 0.0 && (before > 0.0) != (after > 0.0) {
                    return (Some(bracketed(curve, level, low, high, before > 0.0)), seen);
                }
                // Between two parts, it is passed where the sides differ.
                if before == 0.0 && side < 0.0 && after > 0.0 {
                    return (Some(low), seen);
                }
                side = [after, before, side].into_iter().find(|value| *value != 0.0).unwrap_or(0.0);
            }
        }
    }
    (None, seen)
}

/// The zero between two places at which the signs differ: Newton's method, and bisection where it would leave
/// the bracket.
fn bracketed(curve: &impl Curve, level: f64, mut low: f64, mut high: f64, falls: bool) -> f64 {
    let mut t = 0.5 * (low + high);
    for _ in 0..100 {
        let [value, slope] = curve.at(t);
        let value = value - level;
        if (value > 0.0) == falls {
            low = t
        } else {
            high = t
        }
        let next = t - value / slope;
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        if next == t || next <= low || next >= high {
            return high;
        }
        if (next - t).abs() <= f64::EPSILON * t {
            return next;
        }
        t = next;
    }
    // Where rounding leaves the same value at many places it goes from one to the next, and the other end of
    // the bracket stays far off.
    t
}

/// A power series about zero, for the search up to `end`.
///
/// The bound of its second derivative is a sum of magnitudes, and far too large where high powers cancel: on
/// small parts it is that of the powers a_k about their middle, `Σ k |a_k| r^(k-2)`.
#[derive(Clone, Copy, Debug)]
pub struct PowerSeries<'a> {
    /// a_0, a_1, …
    pub powers: &'a [f64],
    /// The end of the step.
    pub end: f64,
}

impl Curve for PowerSeries<'_> {
    fn at(&self, t: f64) -> [f64; 2] {
        value(self.powers, t)
    }

    fn about(&self, centre: f64, radius: f64) -> IntervalBounds {
        let rounding = ROUNDING * size(self.powers, centre + radius);
        if radius > SMALL * self.end {
            let ([value, slope], bend) = (value(self.powers, centre), bend(self.powers, centre + radius));
            return IntervalBounds { value, slope, bend, rounding };
        }
        let mut local = self.powers.to_vec();
        shift(&mut local, centre);
        let steeper = |sum: f64, (m, a): (usize, &f64)| sum * radius + m as f64 * a.abs();
        let bend = local.iter().enumerate().skip(2).rev().fold(0.0, steeper);
        IntervalBounds {
            value: local.first().copied().unwrap_or(0.0),
            slope: local.get(1).copied().unwrap_or(0.0),
            bend,
            rounding,
        }
    }
}

/// Powers about `centre`, in their place: Horner's scheme, once a power.
pub fn shift(powers: &mut [f64], centre: f64) {
    for first in 0..powers.len() {
        for m in (first + 1..powers.len()).rev() {
            powers[m - 1] += centre * powers[m];
        }
    }
}

/// Value and slope of a polynomial.
pub fn value(powers: &[f64], t: f64) -> [f64; 2] {
    powers.iter().rev().fold([0.0, 0.0], |[value, slope], &power| [value * t + power, slope * t + value])
}

/// Sum of the magnitudes of all terms up to time `t`.
fn size(powers: &[f64], t: f64) -> f64 {
    powers.iter().rev().fold(0.0, |sum, power| sum * t + power.abs())
}

/// A bound of the second derivative up to time `t`.
fn bend(powers: &[f64], t: f64) -> f64 {
    let terms = powers.iter().enumerate().skip(2).rev();
    terms.fold(0.0, |sum, (m, power)| sum * t + (m * (m - 1)) as f64 * power.abs())
}

#[cfg(test)]
mod tests;
