//! How exactly a scene states its numbers: by the digits it is written with.
//!
//! A number is uncertain by half a unit of its last digit as written: 0.25 by 0.005, 0.250 by 0.0005, 670 by
//! 0.5, 1.5e3 by 50, "60 cm" by 0.005 m.  Exact are 0, however it is written (at rest, on an axis, without
//! damping), formulas such as `pi/2` and `0.1*l`, defaults, and the times of the output, `until` and `every`.

use super::error::SceneError;
use super::formula::Formula;
use super::locate::{Located, Texts, Value, push_index, push_key};
use super::read::put_together;
use super::set::name;
use super::template::{FormatWalk, Template};

/// A number of a scene with what its digits leave open.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenNumber {
    /// Its whole path: `start.bar1.phi`.
    pub path: String,
    /// Its unit: `rad`; empty for a pure number.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// Half a unit of the last digit it is written with.
    pub uncertainty: f64,
}

/// Numbers of the format that are no input of the motion: how long it is followed, and how often it is shown.
pub(crate) const OF_THE_RUN: [&str; 2] = ["until", "every"];

impl Template {
    /// The numbers of the scene that its digits leave uncertain, in the order of its text.  `typed` are the
    /// texts `PATH=VALUE` of the overrides as they were typed; where one is missing, the shortest digits of
    /// its value count.
    ///
    /// # Errors
    /// As [`parse_scene`](super::parse_scene) where the text is no JSON or an override does not fit it.
    pub fn written_numbers(&self, typed: &[String]) -> Result<Vec<WrittenNumber>, SceneError> {
        let (text, source, overrides) = self.parts();
        let (source, tree) = put_together(text, source, overrides)?;
        let mut search = DigitSearch { source: &source, tree: &tree, typed, found: Vec::new() };
        search.visit(&tree, "");
        Ok(search.found)
    }
}

struct DigitSearch<'a> {
    source: &'a Texts,
    tree: &'a Located,
    typed: &'a [String],
    found: Vec<WrittenNumber>,
}

impl DigitSearch<'_> {
    fn visit(&mut self, node: &Located, path: &str) {
        match &node.value {
            Value::Object(members) => {
                for member in members {
                    let mut inner = path.to_owned();
                    push_key(&mut inner, &member.key);
                    self.visit(&member.node, &inner);
                }
            }
            Value::List(nodes) => {
                for (index, node) in nodes.iter().enumerate() {
                    let mut inner = path.to_owned();
                    match name(node) {
                        Some(name) => push_key(&mut inner, name),
                        None => push_index(&mut inner, index),
                    }
                    self.visit(node, &inner);
                }
            }
            Value::Number(value) => self.take(path, *value, half_unit(self.digits(node))),
            Value::Text(text) => {
                if let Some((value, half)) = with_unit(text) {
                    self.take(path, value, Some(half));
                }
            }
            _ => {}
        }
    }

    /// Takes a number that is uncertain by this, where it is an input of the motion.
    fn take(&mut self, path: &str, value: f64, uncertainty: Option<f64>) {
        let Some(uncertainty) = uncertainty.filter(|half| half.is_finite()) else { return };
        let Ok(unit) = FormatWalk { tree: self.tree }.unit(path) else { return };
        if !OF_THE_RUN.contains(&path) {
            self.found.push(WrittenNumber { path: path.to_owned(), unit, value, uncertainty });
        }
    }

    /// What a number was written as.
    fn digits(&self, node: &Located) -> &str {
        let (text, digits, is_all) = self.source.text(node.span);
        let typed = text
            .checked_sub(1)
            .and_then(|index| self.typed.get(index))
            .and_then(|typed| typed.split_once('='));
        typed.filter(|_| is_all).map_or(digits, |(_, value)| value.trim())
    }
}

/// A number in a text, as "60 cm", with half a unit of its last digit, both in units of the SI; `None` for
/// what is exact, or more than one number.
fn with_unit(text: &str) -> Option<(f64, f64)> {
    let formula = Formula::parse(text).ok()?;
    let (digits, _) = formula.number_alone()?;
    // The decimals of a formula may begin with their point.
    let (half, value) = (half_unit(&format!("0{digits}"))?, formula.value(&[]));
    let scale = (value / digits.parse::<f64>().ok()?).abs();
    scale.is_finite().then_some((value, half * scale))
}

/// Half a unit of the last digit of a decimal number; `None` for 0, and for what is no decimal number.
fn half_unit(digits: &str) -> Option<f64> {
    let (mantissa, exponent) = match digits.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i64>().ok()?),
        None => (digits, 0),
    };
    let (whole, decimals) = mantissa
        .trim_start_matches(['+', '-'])
        .split_once('.')
        .unwrap_or((mantissa.trim_start_matches(['+', '-']), ""));
    let mut all = whole.bytes().chain(decimals.bytes());
    if whole.is_empty() || !all.clone().all(|digit| digit.is_ascii_digit()) || all.all(|digit| digit == b'0')
    {
        return None;
    }
    // Read as a decimal number, it is the nearest double.
    format!("5e{}", exponent.checked_sub(decimals.len() as i64 + 1)?).parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Override;

    #[test]
    fn the_last_digit_counts_by_a_half() {
        for (digits, half) in [
            ("0.25", 0.005),
            ("-0.250", 0.0005),
            ("670", 0.5),
            ("1.5e3", 50.0),
            ("2E-4", 5e-5),
            ("1.5707963267948966", 5e-17),
            ("-10", 0.5),
            ("100.0", 0.05),
        ] {
            assert_eq!(half_unit(digits), Some(half), "{digits}");
        }
        for exact in ["0", "0.00", "-0", "0e5", "pi/2", "1/3", "inf", "", "-", "."] {
            assert_eq!(half_unit(exact), None, "{exact}");
        }
    }

    #[test]
    fn a_number_with_a_unit_is_as_uncertain_as_in_units_of_the_si() {
        for (text, plain) in [
            ("60 cm", "0.60"),
            ("600 mm", "0.600"),
            ("-9.8 m/s^2", "-9.8"),
            ("500 kg*cm^2", "0.0500"),
            ("1.50e3 g", "1.500"),
            ("2.5", "2.5"),
            (".5 m", "0.5"),
        ] {
            let (value, half) = with_unit(text).expect(text);
            let expected: f64 = plain.parse().expect("a number");
            let most = half_unit(plain).expect("a half");
            // The gram's 1.50e3 has its last digit at 10 g.
            let most = if text.ends_with(" g") { 10.0 * most } else { most };
            assert!((value - expected).abs() <= 1e-15 * expected.abs(), "{text}: {value}");
            assert!((half - most).abs() <= 1e-15 * most, "{text}: {half} and not {most}");
        }
        let (value, half) = with_unit("30 deg").expect("a number");
        assert!((value - std::f64::consts::FRAC_PI_6).abs() < 1e-15 && (half - value / 60.0).abs() < 1e-15);
        for exact in ["0 cm", "pi", "pi/2", "2*l", "l", "0.1*l", "1 m + 2 m", "bar1", "", "1e-400 m"] {
            assert_eq!(with_unit(exact), None, "{exact}");
        }
    }

    #[test]
    fn numbers_stand_with_their_paths_and_digits_also_those_of_overrides() {
        let typed =
            ["bar1.length=0.650".to_owned(), "bar2.phi=pi/2".to_owned(), "gravity=[9.80, 0]".to_owned()];
        let overrides: Vec<Override> =
            typed.iter().map(|set| set.parse().expect("a path and a value")).collect();
        let template =
            Template::read("examples/scenes/free.json".as_ref(), &overrides).expect("a shipped scene");
        let found = template.written_numbers(&typed).expect("a scene");
        let of = |path: &str| {
            found.iter().find(|number| number.path == path).map(|number| (number.value, number.uncertainty))
        };
        assert_eq!(of("bars.bar1.length"), Some((0.65, 0.0005)));
        assert_eq!(of("bars.bar2.density"), Some((670.0, 0.5)));
        assert_eq!(of("hinges.B.between[0].point[0]"), Some((0.6, 0.05)));
        assert_eq!(of("start.bar1.phi"), Some((std::f64::consts::FRAC_PI_2, 5e-17)));
        // Inside a list that was set, trailing zeros are not known.
        assert_eq!(of("gravity[0]"), Some((9.8, 0.05)));
        assert_eq!(
            (of("start.bar2.phi"), of("start.bar1.omega"), of("until"), of("gravity[1]")),
            (None, None, None, None)
        );
        assert!(found.iter().all(|number| {
            template.variable(&number.path).is_ok_and(|variable| variable.path == number.path)
        }));
        let untyped = template.written_numbers(&[]).expect("a scene");
        assert!(
            untyped.iter().any(|number| number.path == "bars.bar1.length" && number.uncertainty == 0.005)
        );
    }
}
