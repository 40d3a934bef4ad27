//! The points of a sweep: a grid of named values, each from one end to the other in equal steps, or a list.

use crate::scene::number;
use std::str::FromStr;
use std::sync::Arc;

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
    /// Value number `index`: both ends exactly, and opposite ends give opposite values.
    pub fn value(&self, index: u64) -> f64 {
        let last = self.count - 1;
        match index {
            0 => self.from,
            index if index >= last => self.to,
            index => {
                let share = |index: u64| index as f64 / last as f64;
                if self.from == -self.to {
                    self.to * (index as f64 - (last - index) as f64) / last as f64
                } else {
                    self.from * share(last - index) + self.to * share(index)
                }
            }
        }
    }
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
