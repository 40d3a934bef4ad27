//! Numbers as people type them on a command line.

use crate::arithmetic::{Real, Varied};
use std::f64::consts::PI;

/// A number that decimal text can be read as.
pub trait Decimal: Real {
    /// The decimal number, to all digits there is room for; `None` where the text is none.
    fn parse(text: &str) -> Option<Self>;

    /// π.
    fn pi() -> Self;

    /// The number with another value, and the derivatives it has.
    fn moved_to(self, value: f64) -> Self {
        Self::of(value)
    }
}

impl Decimal for f64 {
    fn parse(text: &str) -> Option<Self> {
        text.trim().parse().ok()
    }

    fn pi() -> Self {
        PI
    }
}

impl<const D: usize> Decimal for Varied<D> {
    fn parse(text: &str) -> Option<Self> {
        f64::parse(text).map(Self::constant)
    }

    fn pi() -> Self {
        Self::constant(PI)
    }

    fn moved_to(self, value: f64) -> Self {
        Self::new(value, self.slope)
    }
}

#[cfg(feature = "digits")]
impl<const W: usize> Decimal for crate::arithmetic::digits::Digits<W> {
    fn parse(text: &str) -> Option<Self> {
        Self::from_decimal(text)
    }

    fn pi() -> Self {
        crate::arithmetic::digits::pi()
    }
}

/// A finite number: a decimal (`0.1`, `1e-3`), a multiple of pi (`pi`, `-0.5pi`, `2*pi`), or a fraction of
/// two such (`1/64`, `pi/2`).
///
/// ```
/// use driftless::scene::number;
/// assert_eq!(number("-pi/2"), Some(-std::f64::consts::FRAC_PI_2));
/// assert_eq!((number("1/64"), number("ten"), number("1/0")), (Some(0.015625), None, None));
/// ```
pub fn number(text: &str) -> Option<f64> {
    let factor = |part: &str| {
        let part = part.trim();
        match part.strip_suffix("pi").or_else(|| part.strip_suffix('π')) {
            None => part.parse::<f64>().ok(),
            Some(sign @ ("" | "+" | "-")) => Some(if sign == "-" { -PI } else { PI }),
            Some(multiple) => {
                multiple.trim_end_matches('*').trim_end().parse::<f64>().ok().map(|multiple| multiple * PI)
            }
        }
    };
    let value = match text.split_once('/') {
        Some((above, below)) => factor(above)? / factor(below)?,
        None => factor(text)?,
    };
    value.is_finite().then_some(value)
}

/// Two numbers in ascending order, as in `0..2pi`.
///
/// ```
/// use driftless::scene::range;
/// assert_eq!(range("-1/2 .. 3"), Some([-0.5, 3.0]));
/// assert_eq!((range("3..1"), range("1"), range("1..x")), (None, None, None));
/// ```
pub fn range(text: &str) -> Option<[f64; 2]> {
    let (from, to) = text.split_once("..")?;
    let [from, to] = [number(from.trim())?, number(to.trim())?];
    (from < to && (to - from).is_finite()).then_some([from, to])
}
