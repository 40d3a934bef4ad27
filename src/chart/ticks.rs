//! Places and words of ticks.
//!
//! Every tick is an integer times a step, and its label is written from that integer, so there are neither
//! 0.30000000000000004 nor −0.

use std::f64::consts::PI;

/// A labelled tick.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    pub value: f64,
    pub label: String,
}

/// The ticks of an axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Ticks {
    pub majors: Vec<Tick>,
    pub minors: Vec<f64>,
    /// Written before the name's unit: a factor such as `×10^{6}`.
    pub factor: Option<String>,
    /// Subtracted from every label and written into the name.
    pub offset: Option<String>,
}

impl Ticks {
    /// The axis name with factor and offset.
    pub(crate) fn name(&self, name: &str) -> String {
        let parts = self.parts(name);
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
    }

    /// Quantity, offset, and factor and unit in brackets, of an axis name; empty where it has none.  Beside a
    /// factor the offset has the unit, as the factor is not meant for it.
    pub(crate) fn parts(&self, name: &str) -> [String; 3] {
        let (quantity, unit) = match name.rsplit_once(" [") {
            Some((quantity, unit)) => (quantity, unit.trim_end_matches(']')),
            None => (name, ""),
        };
        // A pure number has no unit to be shown.
        let unit = if unit == "1" { "" } else { unit };
        let offset = match (self.offset.as_deref().unwrap_or_default(), &self.factor) {
            (offset, Some(_)) if !offset.is_empty() && !matches!(unit, "" | "?") => {
                format!("{offset} {unit}")
            }
            (offset, _) => offset.to_owned(),
        };
        let unit = match (&self.factor, unit.is_empty()) {
            (Some(factor), true) => format!("[{factor}]"),
            (Some(factor), false) => format!("[{factor} {unit}]"),
            (None, true) => String::new(),
            (None, false) => format!("[{unit}]"),
        };
        [quantity.to_owned(), offset, unit]
    }
}

/// Ten to an integer power, correctly rounded.
pub(crate) fn ten(power: i32) -> f64 {
    format!("1e{power}").parse().unwrap_or(f64::NAN)
}

/// Mantissa and exponent of the smallest of 1, 2, 5 times a power of ten that is not below `rough`.
fn nice(rough: f64) -> (f64, i32) {
    let power = rough.log10().floor().clamp(-320.0, 306.0) as i32;
    let mantissa = [1.0, 2.0, 5.0].into_iter().find(|m| m * ten(power) >= rough * (1.0 - 1e-9));
    mantissa.map_or((1.0, power + 1), |mantissa| (mantissa, power))
}

/// The smallest nice step not below `rough` (positive).
pub(crate) fn nice_step(rough: f64) -> f64 {
    let (mantissa, power) = nice(rough);
    mantissa * ten(power)
}

/// Words for a [`nice_step`]: a decimal, or a power of ten where the axes beside it have one.
pub(crate) fn nice_words(step: f64) -> String {
    let (mantissa, exponent) = nice(step);
    match (exponent, mantissa == 1.0) {
        (-4..=5, _) => decimal(step, (-exponent).max(0) as usize),
        (_, true) => power(exponent),
        (_, false) => format!("{mantissa}·{}", power(exponent)),
    }
}

/// A plain decimal with true minus and thin spaces from five digits on.
pub(crate) fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let (whole, fraction) =
        text.split_once('.').map_or((text.as_str(), ""), |(whole, fraction)| (whole, fraction));
    let mut out = String::new();
    if value < 0.0 && text.bytes().any(|digit| (b'1'..=b'9').contains(&digit)) {
        out.push('−');
    }
    for (k, digit) in whole.chars().enumerate() {
        if k > 0 && whole.len() >= 5 && (whole.len() - k).is_multiple_of(3) {
            out.push('\u{2009}');
        }
        out.push(digit);
    }
    if !fraction.is_empty() {
        out.push('.');
        out.push_str(fraction);
    }
    out
}

/// A power of ten.
pub(crate) fn power(exponent: i32) -> String {
    if exponent < 0 { format!("10^{{−{}}}", -exponent) } else { format!("10^{{{exponent}}}") }
}

/// A number for a sentence: about three digits, as a decimal or with a power of ten.
pub(crate) fn figure(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "not finite".to_owned() };
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-3..5).contains(&exponent) {
        return decimal(value, (2 - exponent).clamp(0, 5).max(if exponent < 2 { 2 } else { 0 }) as usize);
    }
    let mut mantissa = value / ten(exponent.max(-307));
    if exponent < -307 {
        mantissa *= ten(-307 - exponent);
    }
    format!("{}·{}", decimal(mantissa, 2), power(exponent))
}

/// A whole positive number times a power of ten, with all its digits.
fn exact(number: f64, exponent: i32) -> String {
    let text = format!("{number:.0}");
    let digits = text.trim_end_matches('0');
    let last = exponent + (text.len() - digits.len()) as i32;
    let first = last + digits.len() as i32 - 1;
    if (-4..9).contains(&first) {
        return decimal(number * ten(exponent), (-last).max(0) as usize);
    }
    match digits.split_at(1) {
        ("1", "") => power(first),
        (whole, "") => format!("{whole}·{}", power(first)),
        (whole, fraction) => format!("{whole}.{fraction}·{}", power(first)),
    }
}

/// Largest label beside an offset, without its point.
const LABEL: f64 = 999.0;

/// The roundest number, a whole one times a power of ten, from which labels from `low` to `high`, whole
/// numbers times the power of ten `exponent`, are short.
fn offset_of(low: f64, high: f64, exponent: i32) -> (f64, i32) {
    let largest = low.abs().max(high.abs()).log10().ceil() as i32;
    let near = |power: i32| (0.5 * (low + high) / ten(power)).round();
    let is_short = |&power: &i32| {
        let offset = near(power) * ten(power);
        (low - offset).abs().max((high - offset).abs()) <= LABEL
    };
    let power = (3..=largest).rev().find(is_short).unwrap_or(2);
    (near(power), exponent + power)
}

pub(crate) fn linear(low: f64, high: f64, most: usize) -> Ticks {
    let most = most.max(2) as f64;
    let (mantissa, exponent) = nice((high - low) / most);
    let step = mantissa * ten(exponent);
    let (first, last) = ((low / step - 1e-6).ceil(), (high / step + 1e-6).floor());
    if !(last - first).is_finite() || last - first > 1000.0 || step == 0.0 {
        return Ticks::default();
    }
    // Labels of a narrow range far from zero are told from a round number on.
    let far = first.abs().max(last.abs()) > 20_000.0;
    let (number, place) = if far { offset_of(first * mantissa, last * mantissa, exponent) } else { (0.0, 0) };
    let start = number * ten(place - exponent) / mantissa;
    let offset = far.then(|| {
        let sign = if number < 0.0 { "+" } else { "−" };
        format!("{sign} {}", exact(number.abs(), place))
    });
    // Labels mean `index * mantissa * 10^(exponent - shift)`.
    let largest = (first - start).abs().max((last - start).abs()) * step;
    let magnitude = if largest > 0.0 { largest.log10().floor() as i32 } else { 0 };
    let shift = if magnitude >= 6 || exponent < -4 { magnitude.div_euclid(3) * 3 } else { 0 };
    let place = exponent - shift;
    let decimals = (-place).max(0) as usize;
    let label = |index: f64| {
        decimal((index - start) * mantissa * 10_f64.powi(place), if index == start { 0 } else { decimals })
    };
    let count = (last - first) as usize + 1;
    let majors = (0..count)
        .map(|k| first + k as f64)
        .map(|index| Tick { value: index * step, label: label(index) })
        .collect();
    let parts: f64 = if mantissa == 2.0 { 4.0 } else { 5.0 };
    let (from, to) = ((low / step * parts - 1e-6).ceil(), (high / step * parts + 1e-6).floor());
    let minors =
        (0..=(to - from) as usize).map(|k| from + k as f64).filter(|index| index.rem_euclid(parts) != 0.0);
    let minors = minors.map(|index| index / parts * step).collect();
    Ticks { majors, minors, factor: (shift != 0).then(|| format!("×{}", power(shift))), offset }
}

/// Ticks at −π/2, 0, π/2, π, 2π and so on.
pub(crate) fn pi(low: f64, high: f64, most: usize) -> Ticks {
    let rough = (high - low) / (most.max(2) as f64 * PI);
    // In quarters of π, so that every index is whole.
    let (step, minor) = if rough <= 0.25 {
        (1.0, 1.0)
    } else if rough <= 0.5 {
        (2.0, 1.0)
    } else if rough <= 1.0 {
        (4.0, 1.0)
    } else {
        let (mantissa, exponent) = nice(rough);
        let step = mantissa * ten(exponent);
        (4.0 * step, if mantissa == 2.0 { 2.0 * step } else { 0.8 * step })
    };
    let quarter = 0.25 * PI;
    let indices = |step: f64| {
        let (first, last) =
            ((low / (quarter * step) - 1e-6).ceil(), (high / (quarter * step) + 1e-6).floor());
        (0..=(last - first).max(-1.0) as usize)
            .map(move |k| first + k as f64)
            .filter(move |&index| index <= last)
    };
    let label = |index: f64| {
        let quarters = (index * step) as i64;
        let (number, part) = match quarters.rem_euclid(4) {
            0 => (quarters / 4, ""),
            2 => (quarters / 2, "/2"),
            _ => (quarters, "/4"),
        };
        match number {
            0 => "0".to_owned(),
            1 => format!("π{part}"),
            -1 => format!("−π{part}"),
            _ => format!("{}π{part}", decimal(number as f64, 0)),
        }
    };
    let majors: Vec<Tick> =
        indices(step).map(|index| Tick { value: index * step * quarter, label: label(index) }).collect();
    let minors = indices(minor)
        .filter(|index| (index * minor).rem_euclid(step).min(step - (index * minor).rem_euclid(step)) > 1e-6);
    let minors = minors.map(|index| index * minor * quarter).collect();
    Ticks { majors, minors, factor: None, offset: None }
}

pub(crate) fn log(low: f64, high: f64, most: usize) -> Ticks {
    let (from, to) = (low.log10(), high.log10());
    if to - from < 1.0 - 1e-9 {
        // Labels by decades would be too few.
        return linear(low, high, most);
    }
    let (first, last) = ((from - 1e-9).ceil() as i32, (to + 1e-9).floor() as i32);
    let inside = |value: &f64| *value >= low * (1.0 - 1e-9) && *value <= high * (1.0 + 1e-9);
    let between = |factors: &'static [f64]| {
        (first - 1..=last).flat_map(move |k| factors.iter().map(move |factor| factor * ten(k)))
    };
    let short = to - from < 3.05;
    let mut majors: Vec<(f64, f64, i32)> = Vec::new();
    let mut step = 1;
    if short {
        majors = (first - 1..=last)
            .flat_map(|k| [1.0, 2.0, 5.0].map(|factor| (factor * ten(k), factor, k)))
            .filter(|(v, ..)| inside(v))
            .collect();
    }
    if !short || majors.len() > most.max(3) {
        let steps = [1, 2, 3, 4, 5, 6, 10, 20, 50, 100];
        step = steps.into_iter().find(|step| (last - first) / step < most.max(2) as i32).unwrap_or(200);
        majors = (first..=last).filter(|k| k.rem_euclid(step) == 0).map(|k| (ten(k), 1.0, k)).collect();
    }
    let plain = low >= 0.99e-3 && high <= 1.01e5;
    let words = |&(value, factor, k): &(f64, f64, i32)| match (plain, factor == 1.0) {
        (true, _) => decimal(value, (-k).max(0) as usize),
        (false, true) => power(k),
        (false, false) => format!("{factor}·{}", power(k)),
    };
    let majors: Vec<Tick> = majors.iter().map(|tick| Tick { value: tick.0, label: words(tick) }).collect();
    let minors: Vec<f64> = if step == 1 {
        between(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]).filter(inside).collect()
    } else {
        (first..=last).map(ten).collect()
    };
    let minors =
        minors.into_iter().filter(|value| majors.iter().all(|major| major.value != *value)).collect();
    Ticks { majors, minors, factor: None, offset: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &Ticks) -> Vec<&str> {
        ticks.majors.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn linear_labels_are_short_and_exact() {
        assert_eq!(labels(&linear(-0.2, 0.4, 6)), ["−0.2", "−0.1", "0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(labels(&linear(0.0, 10_000.0, 5)), ["0", "2000", "4000", "6000", "8000", "10\u{2009}000"]);
        assert_eq!(labels(&linear(0.0, 1.0, 4)), ["0", "0.5", "1.0"]);
        let tiny = linear(0.0, 1e-17, 5);
        assert_eq!(labels(&tiny)[1], "2", "{tiny:?}");
        assert_eq!(tiny.name("defect [m]"), "defect [×10^{−18} m]");
        let huge = linear(-1e300, 1e300, 5);
        assert!(huge.majors.iter().all(|tick| tick.label.chars().count() < 8), "{huge:?}");
        let far = linear(1e6, 1e6 + 1e-3, 5);
        assert!(far.name("x [m]").starts_with("x − 1\u{2009}000\u{2009}000"), "{}", far.name("x [m]"));
        assert!(far.majors.len() >= 3);
        assert_eq!(linear(0.0, 1.0, 5).name("ratio [1]"), "ratio", "a pure number has no unit");
        assert_eq!(tiny.name("ratio [1]"), "ratio [×10^{−18}]");
    }

    /// Offset and factor of an axis name, read back.
    fn read(name: &str) -> [f64; 2] {
        let number = |text: &str| -> f64 {
            let plain = text.replace(['\u{2009}', '}'], "").replace('−', "-").replace("10^{", "1e");
            plain.split('·').map(|part| part.parse::<f64>().unwrap()).product()
        };
        let (offset, factor) = name.trim_start_matches("x ").split_once('[').unwrap();
        let (sign, offset) = offset.trim_end_matches(" N ").trim().split_once(' ').unwrap();
        let sign = if sign == "+" { -1.0 } else { 1.0 };
        let factor = factor.trim_start_matches('×').trim_end_matches(']').trim_end_matches('N').trim();
        [sign * number(offset), if factor.is_empty() { 1.0 } else { number(factor) }]
    }

    #[test]
    fn offset_and_label_are_the_value_of_the_tick_to_the_last_digit() {
        let ranges = [
            [9.809995e-9, 9.810008e-9],
            [-9.810008e-9, -9.809995e-9],
            [999_999.3, 1_000_000.7],
            [0.123_456_781, 0.123_456_789],
            [9.81e-12, 9.81e-12 * (1.0 + 2e-13)],
            [1.000_000_001e21, 1.000_000_002e21],
            [-7.3e-21 - 1e-29, -7.3e-21 + 3e-30],
        ];
        for [low, high] in ranges {
            let ticks = linear(low, high, 8);
            let name = ticks.name("x [N]");
            let [offset, factor] = read(&name);
            let step = ticks.majors[1].value - ticks.majors[0].value;
            for tick in &ticks.majors {
                let label: f64 = tick.label.replace('−', "-").parse().unwrap();
                let error = offset + label * factor - tick.value;
                assert!(error.abs() < 0.01 * step, "{name}: {tick:?}");
                assert!(tick.label.chars().filter(char::is_ascii_digit).count() <= 4, "{name}: {tick:?}");
            }
        }
        assert_eq!(linear(9.809995e-9, 9.810008e-9, 8).name("f [N]"), "f − 9.81·10^{−9} N [×10^{−15} N]");
        let round = linear(999_999.3, 1_000_000.7, 8);
        assert_eq!(round.name("x [m]"), "x − 1\u{2009}000\u{2009}000 [m]");
        assert_eq!(labels(&round)[..3], ["−0.6", "−0.4", "−0.2"]);
    }

    #[test]
    fn decades_reach_far_below_the_rounding_unit() {
        let ticks = log(1e-18, 1e-6, 7);
        assert_eq!(labels(&ticks)[0], "10^{−18}");
        assert_eq!(ticks.majors.len(), 7);
        assert_eq!(ticks.minors.len(), 6);
        assert_eq!(labels(&log(1.0, 1e4, 8))[4], "10\u{2009}000");
        assert_eq!(labels(&log(10.0, 300.0, 8)), ["10", "20", "50", "100", "200"]);
        assert!(log(2.0, 2.1, 6).majors.len() >= 3);
        assert!(log(1e-300, 1e300, 8).majors.len() >= 4);
    }

    #[test]
    fn angles_are_told_in_pi() {
        assert_eq!(labels(&pi(-PI, PI, 5)), ["−π", "−π/2", "0", "π/2", "π"]);
        assert_eq!(labels(&pi(-1.0, 65.0, 5)), ["0", "5π", "10π", "15π", "20π"]);
    }

    #[test]
    fn nice_steps_are_told_as_decimals_or_powers() {
        let words = |step| nice_words(nice_step(step));
        assert_eq!([words(0.1), words(0.02), words(5.0), words(0.0001)], ["0.1", "0.02", "5", "0.0001"]);
        assert_eq!(words(2e4), "20\u{2009}000");
        assert_eq!([words(1e-6), words(2e-9), words(1e6)], ["10^{−6}", "2·10^{−9}", "10^{6}"]);
    }

    #[test]
    fn figures_for_sentences() {
        assert_eq!(figure(3.7345), "3.73");
        assert_eq!(figure(23.43), "23.43");
        assert_eq!(figure(-0.0123), "−0.0123");
        assert_eq!(figure(1.5e-9), "1.50·10^{−9}");
        assert_eq!(figure(0.0), "0");
        assert!(figure(5e-324).contains("10^"));
    }
}
