//! Scales of a map in words, for a page that draws it itself.

use super::{Colours, Map, MapAxis, SIDE};
use crate::chart::axis::{Axis, Scale};
use crate::chart::text::unmarked;
use crate::chart::ticks::Ticks;
use std::f64::consts::PI;

/// Labelled ticks of an axis.
const ALONG: usize = 6;

/// Name and ticks of a scale, in words for a page: places from 0 to 1 with their labels.
pub(crate) struct ScaleWords {
    /// Its name with its unit.
    pub name: String,
    /// Its ticks.
    pub ticks: Vec<(f64, String)>,
}

impl Map {
    /// The scales of both axes and of the colours, as they are drawn, and the values at the ends of the
    /// colours.
    pub(crate) fn scales(&self) -> ([ScaleWords; 3], [f64; 2]) {
        let words = |axis: &Axis, ticks: Ticks| ScaleWords {
            name: unmarked(&raised(&ticks.name(&axis.name))),
            ticks: (ticks.majors.iter())
                .map(|tick| (axis.fraction(tick.value), unmarked(&raised(&tick.label))))
                .collect(),
        };
        let colours = Colours::of(self);
        let [x, y] = [self.x.drawn(), self.y.drawn()].map(|axis| words(&axis, axis.ticks(ALONG)));
        let bar = words(&colours.axis, colours.ticks(SIDE));
        ([x, y, bar], [colours.axis.from, colours.axis.to])
    }
}

impl MapAxis {
    /// The axis that ends with the outermost cells.  Its ticks end with the outermost values, as what lies
    /// beyond, half a cell, may mean nothing; where cells end at quarters of π, these have ticks too.
    pub(super) fn drawn(&self) -> Axis {
        let MapAxis { ref name, from, to, count, log } = *self;
        if count < 2 || from == to {
            return Axis::linear(name, from, from);
        }
        let within = Some([from.min(to), from.max(to)]);
        if log && from > 0.0 && to > 0.0 {
            let half = (to / from).powf(0.5 / (count - 1) as f64);
            return Axis { scale: Scale::Log, from: from / half, to: to * half, name: name.clone(), within };
        }
        let half = 0.5 * (to - from) / (count - 1) as f64;
        let spread = (to - from).abs();
        let in_pi = name.contains("[rad]") && spread > 0.75 * PI && from.abs().max(to.abs()) < 1e4 * PI;
        let quarters = |end: f64| (end / (0.25 * PI)).round() * 0.25 * PI;
        let is_whole = |end: f64| in_pi && (end - quarters(end)).abs() < 1e-9;
        let whole = |end: f64| if is_whole(end) { quarters(end) } else { end };
        let ends = [from - half, to + half];
        Axis {
            scale: if in_pi { Scale::Pi } else { Scale::Linear },
            from: whole(ends[0]),
            to: whole(ends[1]),
            name: name.clone(),
            within: within.filter(|_| !ends.into_iter().all(is_whole)),
        }
    }
}

/// Digits above the line as characters of their own.
fn raised(text: &str) -> String {
    let Some((before, (above, after))) =
        text.split_once("^{").and_then(|(a, b)| Some((a, b.split_once('}')?)))
    else {
        return text.to_owned();
    };
    let above = above.chars().map(|c| match c {
        '−' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => c.to_digit(10).and_then(|digit| char::from_u32(0x2070 + digit)).unwrap_or(c),
    });
    format!("{before}{}{}", above.collect::<String>(), raised(after))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Cell;

    #[test]
    fn ticks_of_a_page_are_those_of_the_picture() {
        let axis = MapAxis { name: "phi [rad]".into(), from: -PI, to: PI, count: 40, log: false };
        let chart = Map {
            x: axis.clone(),
            y: axis,
            cells: (0..1600).map(|k| Cell::Value(if k < 76 { 0.0 } else { 1e-5 * f64::from(k) })).collect(),
            value: "flip time [s]".into(),
            log: true,
            ..Map::default()
        };
        let ([x, _, bar], [low, high]) = chart.scales();
        let labels: Vec<&str> = x.ticks.iter().map(|tick| tick.1.as_str()).collect();
        assert_eq!(labels, ["−π", "−π/2", "0", "π/2", "π"]);
        assert!((x.ticks[2].0 - 0.5).abs() < 1e-12 && x.ticks[0].0 > 0.0);
        assert_eq!((low, bar.name.as_str()), (5e-4, "flip time [s]"));
        assert_eq!(bar.ticks[0].1, "≤ 5·10⁻⁴");
        assert!(high > 0.015, "{high}");
        assert_eq!(raised("2·10^{−13} and 10^{40}"), "2·10⁻¹³ and 10⁴⁰");
    }

    #[test]
    fn ticks_end_with_the_outermost_values() {
        let labels = |from: f64, to: f64, count: usize, log: bool| -> Vec<String> {
            let axis = MapAxis { name: "restitution [1]".into(), from, to, count, log };
            axis.drawn().ticks(8).majors.into_iter().map(|tick| tick.label).collect()
        };
        assert_eq!(labels(0.0, 1.0, 3, false), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(1.0, 0.0, 3, false), labels(0.0, 1.0, 3, false));
        assert_eq!(labels(2.0, 200.0, 3, true), ["10", "100"], "the axis begins at 0.6");
    }
}
