//! Parts of a sweep for several machines: contiguous points of one grid, each with the grid's own values, so
//! that the parts together are the sweep byte for byte.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// One of several parts of nearly equal size.
///
/// ```
/// let shard: driftless::run::Shard = "2/3".parse().expect("a part");
/// assert_eq!(shard.range(10), 3..6);
/// assert!("0/3".parse::<driftless::run::Shard>().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Shard {
    number: u64,
    of: u64,
}

impl Shard {
    /// Most parts of a sweep.
    pub const MOST: u64 = 1_000_000;

    /// Part `number`, from 1, of `of`; `None` where there is no such part.
    #[must_use]
    pub fn new(number: u64, of: u64) -> Option<Self> {
        ((1..=of).contains(&number) && of <= Self::MOST).then_some(Self { number, of })
    }

    /// Its number, from 1.
    #[must_use]
    pub fn number(self) -> u64 {
        self.number
    }

    /// How many parts there are.
    #[must_use]
    pub fn of(self) -> u64 {
        self.of
    }

    /// Its points among `count`; none where there are more parts than points.
    #[must_use]
    pub fn range(self, count: u64) -> Range<u64> {
        let end = |number: u64| (u128::from(count) * u128::from(number) / u128::from(self.of)) as u64;
        end(self.number - 1)..end(self.number)
    }

    /// Name of its folder: `shard-003-of-120`.
    #[must_use]
    pub fn folder(self) -> String {
        let digits = self.of.to_string().len();
        format!("shard-{:0digits$}-of-{}", self.number, self.of)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let both = text.split_once('/').and_then(|(number, of)| {
            let [number, of] = [number, of].map(|digits| digits.trim().parse().ok());
            Self::new(number?, of?)
        });
        both.ok_or_else(|| format!("must be I/N with I from 1 to N and N up to {}, as 3/8", Self::MOST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_contiguous_and_together_the_whole() {
        for (count, of) in [(10, 3), (1, 5), (0, 2), (1_000_000_000, 7), (12, 12)] {
            let parts: Vec<Range<u64>> =
                (1..=of).map(|number| Shard::new(number, of).expect("a part").range(count)).collect();
            assert_eq!((parts[0].start, parts[parts.len() - 1].end), (0, count));
            assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start));
            let sizes: Vec<u64> = parts.iter().map(|part| part.end - part.start).collect();
            assert!(sizes.iter().max().expect("some") - sizes.iter().min().expect("some") <= 1);
        }
    }

    #[test]
    fn folders_sort_as_their_parts_do() {
        let names: Vec<String> =
            (1..=120).map(|number| Shard::new(number, 120).expect("a part").folder()).collect();
        assert!(names.is_sorted());
        assert_eq!(names[2], "shard-003-of-120");
    }
}
