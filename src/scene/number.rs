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

/// A finite number: a decimal (`0.1`, `1e-3`), a multiple of pi (`pi`, `-0.5pi`), or a product or quotient of
/// such (`1/64`, `pi/2`, `1/2*pi`), read from left to right.  What can be read in two ways is none (`1/2pi`).
///
/// ```
/// use driftless::scene::number;
/// assert_eq!(number("-pi/2"), Some(-std::f64::consts::FRAC_PI_2));
/// assert_eq!((number("1/2*pi"), number("1/2pi"), number("1/2 pi")), (number("pi/2"), None, None));
/// assert_eq!((number("1/64"), number("ten"), number("1/0")), (Some(0.015625), None, None));
/// ```
pub fn number(text: &str) -> Option<f64> {
    exact_number(text).filter(|value: &f64| value.is_finite())
}

/// The same in any numbers, finite or not.
pub fn exact_number<C: Decimal>(text: &str) -> Option<C> {
    let factor = |part: &str, is_below: bool| {
        let part = part.trim();
        match part.strip_suffix("pi").or_else(|| part.strip_suffix('π')) {
            None => C::parse(part),
            Some(sign @ ("" | "+" | "-")) => Some(if sign == "-" { -C::pi() } else { C::pi() }),
            // 1/2pi: half of pi, or one over a whole turn?
            Some(_) if is_below => None,
            Some(multiple) => Some(C::parse(multiple.trim_end())? * C::pi()),
        }
    };
    let operators = ['*', '/'];
    let mut parts = text.split(operators);
    let first = factor(parts.next()?, false)?;
    text.matches(operators).zip(parts).try_fold(first, |value, (operator, part)| {
        let is_below = operator == "/";
        let factor = factor(part, is_below)?;
        Some(if is_below { value / factor } else { value * factor })
    })
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
