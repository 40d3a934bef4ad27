//! Axes: the range of the data, its place between 0 and 1, linear or by decades.

use super::ticks::{self, Ticks};
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use std::f64::consts::PI;
use std::ops::Range;

/// Larger numbers count as infinite, so that no difference of two overflows.
const LARGEST: f64 = 1e300;

/// How an axis is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    /// Linear, with ticks at multiples of π.
    Pi,
    Log,
}

/// A named axis from one end to the other; it runs downwards if `from` exceeds `to`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Axis {
    /// Name with its unit in brackets.
    pub name: String,
    pub scale: Scale,
    pub from: f64,
    pub to: f64,
    /// The least and the largest value that have ticks, where these are not the ends.
    pub within: Option<[f64; 2]>,
}

fn usable(value: f64) -> bool {
    value.abs() <= LARGEST
}

fn extremes(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range, value| match range {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}

impl Axis {
    /// A linear axis with exactly these ends; equal ends are moved apart.
    pub(crate) fn linear(name: &str, from: f64, to: f64) -> Self {
        let (from, to) = if from == to { apart(from) } else { (from, to) };
        Axis { name: name.to_owned(), scale: Scale::Linear, from, to, within: None }
    }

    /// A linear axis around the data: 6 % of air, ends at ticks.
    pub(crate) fn fit(name: &str, values: impl Iterator<Item = f64>) -> Self {
        let Some((low, high)) = extremes(values.filter(|&v| usable(v))) else {
            return Axis::linear(name, 0.0, 1.0);
        };
        // Below a few units in the last place a spread is rounding, not data.
        if high - low <= 16.0 * f64::EPSILON * low.abs().max(high.abs()) || high - low < 1e-290 {
            let (from, to) = apart(0.5 * low + 0.5 * high);
            return Axis::linear(name, from, to);
        }
        let air = 0.06 * (high - low);
        let step = ticks::nice_step((high - low + 2.0 * air) / 10.0);
        // All data on one side of zero stay there.
        let below = if low >= 0.0 { (low - air).max(0.0) } else { low - air };
        let above = if high <= 0.0 { (high + air).min(0.0) } else { high + air };
        Axis::linear(name, (below / step).floor() * step, (above / step).ceil() * step)
    }

    /// A linear axis that ends where the data end, as time does.
    pub(crate) fn tight(name: &str, values: impl Iterator<Item = f64>) -> Self {
        let (from, to) = extremes(values.filter(|&v| usable(v))).unwrap_or((0.0, 1.0));
        // Of a single time the axis shows how long it took to come there.
        let from = if from == to && to > 0.0 { 0.0 } else { from };
        // A last sample just before a round time does not cost the axis its last label.
        let step = ticks::nice_step((to - from).max(1e-290) / 10.0);
        let (below, above) = ((from / step).floor() * step, (to / step).ceil() * step);
        let near = 0.012 * (to - from);
        Axis::linear(
            name,
            if from - below < near { below } else { from },
            if above - to < near { above } else { to },
        )
    }

    /// Angles in radians, at multiples of π once they leave a quarter turn.
    pub(crate) fn angle(name: &str, values: impl Iterator<Item = f64>) -> Self {
        let Some((low, high)) = extremes(values.filter(|&v| usable(v))) else {
            return Axis::linear(name, 0.0, 1.0);
        };
        if high - low < 0.75 * PI || high.max(-low) > 1e4 * PI {
            return Axis::fit(name, [low, high].into_iter());
        }
        let air = 0.06 * (high - low);
        let step = PI
            * if high - low < 4.0 * PI {
                0.25
            } else {
                ticks::nice_step((high - low) / (10.0 * PI)).max(0.5)
            };
        Axis {
            name: name.to_owned(),
            scale: Scale::Pi,
            from: ((low - air) / step).floor() * step,
            to: ((high + air) / step).ceil() * step,
            within: None,
        }
    }

    /// A logarithmic axis over whole decades around the positive data, at least one.
    pub(crate) fn decades(name: &str, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) =
            extremes(values.filter(|&v| v > 0.0 && usable(v)).map(f64::log10)).unwrap_or((0.0, 1.0));
        // A line on the very edge could be taken for the axis.
        let (low, high) = ((low - 1e-3).floor().max(-320.0), (high + 0.04).ceil());
        Axis {
            name: name.to_owned(),
            scale: Scale::Log,
            from: ticks::ten(low as i32),
            to: ticks::ten(high.max(low + 1.0) as i32),
            within: None,
        }
    }

    /// A logarithmic axis that ends where the positive data end, at least a factor of two.
    pub(crate) fn log_tight(name: &str, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extremes(values.filter(|&v| v > 0.0 && usable(v))).unwrap_or((1.0, 10.0));
        let (from, to) = if high >= 2.0 * low { (low, high) } else { (0.5 * low, 2.0 * high) };
        Axis { name: name.to_owned(), scale: Scale::Log, from, to, within: None }
    }

    fn measure(&self, value: f64) -> f64 {
        if self.scale == Scale::Log { value.log10() } else { value }
    }

    /// Place of a value: 0 at `from`, 1 at `to`; not finite where a log axis has none.
    pub(crate) fn fraction(&self, value: f64) -> f64 {
        let (from, to) = (self.measure(self.from), self.measure(self.to));
        (self.measure(value) - from) / (to - from)
    }

    /// The value at a place.
    #[cfg(test)]
    pub(crate) fn value(&self, fraction: f64) -> f64 {
        let (from, to) = (self.measure(self.from), self.measure(self.to));
        let measure = from + fraction * (to - from);
        if self.scale == Scale::Log { 10_f64.powf(measure) } else { measure }
    }

    /// Smaller and larger end.
    pub(crate) fn ends(&self) -> (f64, f64) {
        (self.from.min(self.to), self.from.max(self.to))
    }

    /// At most about `most` labelled ticks, and the minor ones between them.
    pub(crate) fn ticks(&self, most: usize) -> Ticks {
        let (low, high) = self.ends();
        let mut ticks = match self.scale {
            Scale::Linear => ticks::linear(low, high, most),
            Scale::Pi => ticks::pi(low, high, most),
            Scale::Log => ticks::log(low, high, most),
        };
        if let Some([low, high]) = self.within {
            let slack = 1e-9 * (high - low);
            let is_within = |value: f64| (low - slack..=high + slack).contains(&value);
            // Fewer than two would not tell the scale.
            if ticks.majors.iter().filter(|tick| is_within(tick.value)).count() > 1 {
                ticks.majors.retain(|tick| is_within(tick.value));
                ticks.minors.retain(|&value| is_within(value));
            }
        }
        ticks
    }
}

fn apart(value: f64) -> (f64, f64) {
    let half = if value.abs() < 1e-290 { 1.0 } else { 0.05 * value.abs() };
    (value - half, value + half)
}

/// Lets the series and the mesh of plotters use the axis.
impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        // Far outside, and for values without a place, any place outside serves.
        let fraction = self.fraction(*value);
        let fraction = if fraction.is_nan() { -1.0 } else { fraction.clamp(-1.0, 2.0) };
        (f64::from(limit.0) + fraction * (f64::from(limit.1) - f64::from(limit.0))).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        self.ticks(hint.max_num_points().min(12)).majors.into_iter().map(|tick| tick.value).collect()
    }

    fn range(&self) -> Range<f64> {
        self.from..self.to
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_odd_data_are_sensible() {
        let fit = |values: &[f64]| {
            let axis = Axis::fit("", values.iter().copied());
            (axis.from, axis.to)
        };
        assert_eq!(fit(&[]), (0.0, 1.0));
        assert_eq!(fit(&[f64::NAN, f64::INFINITY]), (0.0, 1.0));
        assert_eq!(fit(&[0.0, 0.0]), (-1.0, 1.0));
        assert_eq!(fit(&[100.0]), (95.0, 105.0));
        assert_eq!(fit(&[-1e-6]), (-1.05e-6, -0.95e-6), "as far apart as fits its size");
        assert_eq!(fit(&[0.0, 10.0]), (0.0, 12.0), "nothing below zero");
        let (low, high) = fit(&[-1e300, 1e300]);
        assert!(low.is_finite() && high.is_finite() && low < -1e300);
        let single = Axis::tight("", [1e-6].into_iter());
        assert_eq!((single.from, single.to), (0.0, 1e-6));
        let decades = Axis::decades("", [0.0, -1.0, f64::NAN].into_iter());
        assert!(decades.to >= 10.0 * decades.from);
    }

    #[test]
    fn place_and_value_are_inverse_and_may_run_downwards() {
        let down = Axis::linear("", 3.0, -1.0);
        assert_eq!(down.fraction(3.0), 0.0);
        assert!((down.value(down.fraction(0.7)) - 0.7).abs() < 1e-12);
        let log = Axis::decades("", [2e-18, 3e-7].into_iter());
        assert_eq!((log.from, log.to), (1e-18, 1e-6));
        assert!((log.value(log.fraction(1e-9)) / 1e-9 - 1.0).abs() < 1e-9);
        assert!(!log.fraction(0.0).is_finite());
    }
}
