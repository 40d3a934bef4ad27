//! Values of options.

use crate::run::trust::Level;
use crate::run::{METHODS, MethodId, Prefer, Stabilization};
use crate::scene;
use clap::builder::{PossibleValuesParser, TypedValueParser};

#[cfg(feature = "charts")]
pub(super) fn window(text: &str) -> Result<[f64; 2], String> {
    scene::range(text)
        .filter(|[from, _]| *from >= 0.0)
        .ok_or_else(|| "must be FROM..TO with 0 <= FROM < TO, as 10..12.5".to_owned())
}

pub(super) fn methods() -> impl TypedValueParser<Value = MethodId> {
    PossibleValuesParser::new(METHODS.iter().map(|info| info.name)).try_map(|name| name.parse::<MethodId>())
}

pub(super) fn stabilizations() -> impl TypedValueParser<Value = Stabilization> {
    PossibleValuesParser::new(Stabilization::ALL.map(Stabilization::name))
        .try_map(|name| name.parse::<Stabilization>())
}

pub(super) fn preferences() -> impl TypedValueParser<Value = Prefer> {
    PossibleValuesParser::new(Prefer::ALL.map(Prefer::name)).try_map(|name| name.parse::<Prefer>())
}

pub(super) fn levels() -> impl TypedValueParser<Value = Level> {
    PossibleValuesParser::new(Level::ALL.map(Level::name)).try_map(|name| name.parse::<Level>())
}

/// A number as everywhere on the command line; infinities and NaN, which a plan refuses, are numbers too.
pub(super) fn number(text: &str) -> Result<f64, String> {
    let read = scene::number(text).or_else(|| text.trim().parse().ok());
    read.ok_or_else(|| "not a number; write 0.01, 1e-9, 1/64, pi/2 or 1/2*pi".to_owned())
}

/// A whole number from 1 to 1e18, as 50000 or 5e4.
pub(super) fn count(text: &str) -> Result<u64, String> {
    let value = number(text)?;
    if (1.0..=1e18).contains(&value) && value.fract() == 0.0 {
        Ok(value as u64)
    } else {
        Err("a whole number from 1 to 1e18".to_owned())
    }
}

/// A whole number of a range.
pub(super) fn whole(text: &str, [least, most]: [u32; 2]) -> Result<u32, String> {
    let read = text.trim().parse().ok().filter(|number| (least..=most).contains(number));
    read.ok_or_else(|| format!("a whole number from {least} to {most}"))
}

/// Threads to be used.
pub(super) fn threads(text: &str) -> Result<u16, String> {
    whole(text, [1, 1024]).map(|threads| threads as u16)
}

/// Positions of a range.
pub(super) fn positions(text: &str) -> Result<u32, String> {
    whole(text, [1, 10_000_000])
}

/// Parts of data.
pub(super) fn segments(text: &str) -> Result<u32, String> {
    whole(text, [1, 10_000])
}

/// Starts of a search.
pub(super) fn starts(text: &str) -> Result<u32, String> {
    whole(text, [0, 1_000_000])
}

/// A time to wait \[s\]: any number that is not negative.
pub(super) fn wait(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if (0.0..=1e9).contains(&value) { Ok(value) } else { Err("a number of seconds from 0 to 1e9".to_owned()) }
}

/// A limit: any number that is not negative.
pub(super) fn limit(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value >= 0.0 { Ok(value) } else { Err("a limit is a number from 0 up".to_owned()) }
}

/// A rate: any number but zero.
pub(super) fn rate(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value != 0.0 && value.is_finite() { Ok(value) } else { Err("a rate other than 0".to_owned()) }
}

/// A number above zero.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("a number above 0".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_are_numbers() {
        assert_eq!(number("1/64"), Ok(0.015625));
        assert_eq!(number("-1e-3"), Ok(-0.001));
        assert_eq!((count("5e4"), count("7")), (Ok(50_000), Ok(7)));
        assert!(
            count("0").is_err() && count("1.5").is_err() && count("1e19").is_err() && count("-1").is_err()
        );
        assert_eq!((threads("8"), starts("0"), positions("360")), (Ok(8), Ok(0), Ok(360)));
        assert!(threads("-1").is_err() && threads("1025").is_err() && starts("-1").is_err());
        assert!(
            number("1/").is_err() && number("ten").is_err() && limit("nan").is_err() && limit("-1").is_err()
        );
    }
}
