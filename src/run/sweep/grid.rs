//! The points of a sweep: a grid of named values, each from one end to the other in equal steps, or a list.

use crate::scene::number;
use std::str::FromStr;
use std::sync::Arc;

/// Digits of numbers that are taken as they are written.
const DIGITS: u32 = 15;

/// A value that is varied: `bar1.phi=-pi..pi:512`.
///
/// ```
/// let vary: driftless::run::Vary = "bar1.phi=-pi/2..pi/2:5".parse().expect("a name and a range");
/// assert_eq!((vary.name.as_str(), vary.count), ("bar1.phi", 5));
/// assert_eq!((vary.value(0), vary.value(2)), (-std::f64::consts::FRAC_PI_2, 0.0));
/// ```
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Vary {
    /// Path of the value in the scene, or its short form.
    pub name: String,
    /// First value, in the unit of the scene's field.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of values, at least 1; a single one is the first.
    pub count: u64,
}

/// Why a text is no [`Vary`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{given}` is not NAME=FROM..TO:COUNT, as in bar1.phi=-pi..pi:64: {why}")]
pub struct VaryError {
    /// The text.
    pub given: String,
    /// What of it is wrong.
    pub why: String,
}

impl FromStr for Vary {
    type Err = VaryError;

    fn from_str(given: &str) -> Result<Self, VaryError> {
        let fail = |why: &str| VaryError { given: given.to_owned(), why: why.to_owned() };
        let (name, range) = given.split_once('=').ok_or_else(|| fail("there is no ="))?;
        let (ends, count) = range.rsplit_once(':').ok_or_else(|| fail("there is no :COUNT"))?;
        let (from, to) = ends.split_once("..").ok_or_else(|| fail("there is no .. between two numbers"))?;
        let end = |text: &str| {
            number(text).ok_or_else(|| {
                fail(&format!("`{text}` is not a number; write 0.1, 1e-3, 1/64, pi/2 or 1/2*pi"))
            })
        };
        let (from, to) = (end(from)?, end(to)?);
        let count = count
            .trim()
            .parse()
            .ok()
            .filter(|&count: &u64| count > 0)
            .ok_or_else(|| fail("COUNT must be a whole number from 1"))?;
        if name.trim().is_empty() {
            return Err(fail("there is no NAME"));
        }
        Ok(Self { name: name.trim().to_owned(), from, to, count })
    }
}

impl Vary {
    /// Value number `index`: both ends exactly, opposite ends give opposite values, and decimals of at most
    /// 15 digits are what one writes.
    pub fn value(&self, index: u64) -> f64 {
        let last = self.count - 1;
        match index {
            0 => self.from,
            index if index >= last => self.to,
            index => {
                let share = |index: u64| index as f64 / last as f64;
                if let Some(value) = written([self.from, self.to], index, last) {
                    value
                } else if self.from == -self.to {
                    self.to * (index as f64 - (last - index) as f64) / last as f64
                } else {
                    self.from * share(last - index) + self.to * share(index)
                }
            }
        }
    }
}

/// A number as an integer and a power of ten, as it is written in at most [`DIGITS`] digits.
fn decimal(x: f64) -> Option<(i128, i32)> {
    let text = format!("{x:e}");
    let (mantissa, exponent) = text.split_once('e')?;
    let (whole, rest) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let number: i128 = format!("{whole}{rest}").parse().ok()?;
    let exponent = exponent.parse::<i32>().ok()? - rest.len() as i32;
    (number.abs() < 10_i128.pow(DIGITS)).then_some((number, exponent))
}

/// The value `index` of `last` steps between two ends where these and it are written in so many digits: what
/// one writes.
fn written([from, to]: [f64; 2], index: u64, last: u64) -> Option<f64> {
    let ((from, p), (to, q)) = (decimal(from)?, decimal(to)?);
    let mut exponent = p.min(q);
    let times = |number: i128, power: i32| {
        10_i128.checked_pow((power - exponent) as u32).and_then(|ten| number.checked_mul(ten))
    };
    let [from, to] = [times(from, p)?, times(to, q)?];
    let (index, last) = (i128::from(index), i128::from(last));
    let mut sum = from.checked_mul(last - index)?.checked_add(to.checked_mul(index)?)?;
    for _ in 0..DIGITS {
        if sum % last == 0 {
            break;
        }
        (sum, exponent) = (sum.checked_mul(10)?, exponent - 1);
    }
    let is_short = sum % last == 0 && (sum / last).abs() < 10_i128.pow(DIGITS);
    is_short.then(|| format!("{}e{exponent}", sum / last).parse().ok()).flatten()
}

/// Points of several values varied at once: a grid, numbered so that the first varies slowest, or a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    axes: Vec<Vary>,
    count: u64,
    /// The values of all points of a list, point by point.
    listed: Option<Arc<[f64]>>,
}

impl Grid {
    /// The grid of these axes; `None` where it has more points than 2⁶⁴ - 1.  It takes no memory for its
    /// points.
    pub fn new(axes: Vec<Vary>) -> Option<Self> {
        let count = axes.iter().try_fold(1_u64, |count, axis| count.checked_mul(axis.count))?;
        Some(Self { axes, count, listed: None })
    }

    /// The points of a list, all values of one after those of the other; its axes tell between what values
    /// they lie.  `None` where there are no names, or the list does not hold as many values for each.
    pub fn listed(names: Vec<String>, values: Vec<f64>) -> Option<Self> {
        let width = names.len();
        if width == 0 || !values.len().is_multiple_of(width) {
            return None;
        }
        let count = (values.len() / width) as u64;
        let axis = |(k, name): (usize, String)| {
            let of = || values.iter().skip(k).step_by(width).copied();
            let (from, to) = (of().fold(f64::INFINITY, f64::min), of().fold(f64::NEG_INFINITY, f64::max));
            Vary { name, from, to, count }
        };
        let axes = names.into_iter().enumerate().map(axis).collect();
        Some(Self { axes, count, listed: Some(values.into()) })
    }

    /// Whether it is a list.
    pub fn is_listed(&self) -> bool {
        self.listed.is_some()
    }

    /// What is varied, slowest first.
    pub fn axes(&self) -> &[Vary] {
        &self.axes
    }

    /// Number of points.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The values of point number `index`, slowest first.
    pub fn values(&self, index: u64) -> Vec<f64> {
        if let Some(values) = &self.listed {
            let begin = index as usize * self.axes.len();
            return values[begin..begin + self.axes.len()].to_vec();
        }
        let mut rest = index;
        let mut values: Vec<f64> = (self.axes.iter().rev())
            .map(|axis| {
                let value = axis.value(rest % axis.count);
                rest /= axis.count;
                value
            })
            .collect();
        values.reverse();
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn ranges_are_read_and_their_faults_told() {
        for (text, from, to, count) in [
            ("a=0..1:11", 0.0, 1.0, 11),
            ("a=-pi..pi:3", -PI, PI, 3),
            ("a= -0.5pi .. pi/2 :2", -0.5 * PI, PI / 2.0, 2),
            ("a=2*pi/3..1/64:1", 2.0 * PI / 3.0, 1.0 / 64.0, 1),
            ("a=1e-3...5:7", 1e-3, 0.5, 7),
        ] {
            let vary: Vary = text.parse().expect(text);
            assert_eq!((vary.from, vary.to, vary.count), (from, to, count), "{text}");
        }
        for (text, why) in [
            ("a", "no ="),
            ("a=1..2", "COUNT"),
            ("a=1:3", ".."),
            ("a=one..2:3", "`one`"),
            ("a=1..inf:3", "`inf`"),
            ("a=1..2:0", "from 1"),
            ("a=1..2:2.5", "whole"),
            ("=1..2:2", "NAME"),
        ] {
            let error = text.parse::<Vary>().expect_err(text).to_string();
            assert!(error.contains(why) && error.contains("NAME=FROM..TO:COUNT"), "{error}");
        }
    }

    #[test]
    fn ends_are_exact_and_the_middle_is_symmetric() {
        let vary: Vary = "a=-pi..pi:513".parse().expect("a range");
        assert_eq!((vary.value(0), vary.value(256), vary.value(512)), (-PI, 0.0, PI));
        assert!((0..513).all(|i| vary.value(i) == -vary.value(512 - i)));
        let tenths: Vary = "a=0..1:11".parse().expect("a range");
        assert_eq!(
            (0..11).map(|i| tenths.value(i)).collect::<Vec<_>>(),
            [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
        );
    }

    #[test]
    fn decimals_are_what_one_writes_and_others_keep_their_bits() {
        for (text, written) in [
            ("a=-0.4..1.2:9", vec![-0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2]),
            ("a=0.1..0.7:7", vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]),
            ("a=-0.3..0.3:7", vec![-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3]),
            ("a=1e-9..7e-9:4", vec![1e-9, 3e-9, 5e-9, 7e-9]),
            ("a=2e20..1e20:5", vec![2e20, 1.75e20, 1.5e20, 1.25e20, 1e20]),
            ("a=1e-300..1e300:3", vec![1e-300, 0.5 * 1e300, 1e300]),
        ] {
            let vary: Vary = text.parse().expect("a range");
            let values: Vec<f64> = (0..vary.count).map(|i| vary.value(i)).collect();
            assert_eq!(values, written, "{text}");
            assert!(values.iter().all(|value| *value != 0.0 || value.is_sign_positive()), "{text}");
        }
        let third: Vary = "a=0.1..1.1:4".parse().expect("a range");
        assert_eq!(third.value(1), 0.1 * (2.0 / 3.0) + 1.1 * (1.0 / 3.0));
        let pi: Vary = "a=0..pi:8".parse().expect("a range");
        assert!((0..8).all(|i| pi.value(i) == PI * (i as f64 / 7.0) || i == 7));
    }

    #[test]
    fn a_list_has_its_points_and_their_ranges() {
        let names = || vec!["a".to_owned(), "b".to_owned()];
        let list = Grid::listed(names(), vec![1.0, 5.0, -2.0, 7.0, 0.5, 6.0]).expect("three points");
        assert_eq!((list.count(), list.values(1)), (3, vec![-2.0, 7.0]));
        assert_eq!((list.axes()[0].from, list.axes()[0].to, list.axes()[1].to), (-2.0, 1.0, 7.0));
        assert!(Grid::listed(names(), vec![1.0]).is_none() && Grid::listed(Vec::new(), Vec::new()).is_none());
    }

    #[test]
    fn the_first_axis_varies_slowest_and_huge_grids_cost_nothing() {
        let axis = |text: &str| text.parse::<Vary>().expect("a range");
        let grid = Grid::new(vec![axis("a=0..1:2"), axis("b=0..2:3")]).expect("six points");
        let points: Vec<Vec<f64>> = (0..grid.count()).map(|index| grid.values(index)).collect();
        assert_eq!(points, [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]);
        let many = || axis("a=0..1:1000000");
        assert_eq!(
            Grid::new(vec![many(), many(), many()]).map(|grid| grid.count()),
            Some(1_000_000_000_000_000_000)
        );
        assert_eq!(Grid::new(vec![many(); 4]), None);
    }
}
