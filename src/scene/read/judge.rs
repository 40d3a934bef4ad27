//! What is said of names and formulas that do not fit.

use crate::scene::error::SceneError;
use crate::scene::format::QuantityRange;
use crate::scene::formula::unit::Dimension;
use crate::scene::formula::{FUNCTIONS, Formula, FormulaError};
use crate::scene::locate::{Span, Texts};

/// Names that formulas give a meaning of their own.
const RESERVED: [&str; 5] = ["t", "pi", "length", "rate", "angle"];
/// What to do about a formula without a value: of names, and of numbers alone.
pub(super) const HINTS: [&str; 2] = [
    "look at the parameters it is made of",
    "roots and logarithms of what is below zero, (-1)^1.5 and 0/0 have no value, and 1/0 is infinite",
];

/// Refuses a name that formulas cannot use.
pub(super) fn check_name(
    source: &Texts,
    name: &str,
    span: Span,
    path: &str,
    taken: &[&str],
) -> Result<(), SceneError> {
    let mut bytes = name.bytes();
    let is_plain = bytes.next().is_some_and(|byte| byte.is_ascii_alphabetic() || byte == b'_')
        && bytes.all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
        && name.len() <= crate::scene::format::LONGEST_NAME;
    let allowed = "must be a name: a letter a to z or A to Z, then such letters, digits or _";
    if !is_plain {
        return Err(source.refusal(span, path, "is no name for formulas", allowed, "for example \"k\""));
    }
    if RESERVED.contains(&name) || FUNCTIONS.iter().any(|function| function.0 == name) {
        let hint = match name {
            "t" => "t is time: choose another name".to_owned(),
            "pi" => "pi is the number 3.14159…: choose another name".to_owned(),
            _ if RESERVED.contains(&name) => {
                format!("{name} is that of the spring a formula belongs to: choose another name")
            }
            _ => format!("{name} is a function: choose another name"),
        };
        return Err(source.refusal(span, path, "has a meaning of its own in formulas", allowed, &hint));
    }
    if taken.contains(&name) {
        let allowed = "names must be different";
        return Err(source.refusal(span, path, "is a name that is taken", allowed, "rename one"));
    }
    Ok(())
}

/// An error about a formula in the text at `span`, with the bytes at fault marked.
pub(super) fn refused(
    source: &Texts,
    span: Span,
    path: &str,
    allowed: &str,
    error: &FormulaError,
) -> SceneError {
    let place = source.inside(span, error.bytes.0, error.bytes.1);
    let problem = format!("= {}: {}", source.written(span), error.problem);
    source.refusal(place, path, &problem, allowed, &error.hint).with_value(source.written(span))
}

/// Refuses a formula of another dimension than its field has.
pub(super) fn fits(
    formula: &Formula,
    dimension: Option<Dimension>,
    quantity: &QuantityRange,
) -> Result<(), FormulaError> {
    let wanted = Dimension::of(quantity.unit);
    match dimension {
        Some(found) if !found.is(wanted) => {
            let unit = if quantity.unit.is_empty() { "a pure number" } else { quantity.unit };
            let trimmed = formula.text().trim();
            let hint = match found.is(Dimension::of("")) {
                true if quantity.unit.starts_with("rad/") && trimmed.ends_with("rad") => {
                    format!("write {trimmed}{}", quantity.unit.replacen("rad", "", 1).replace('²', "^2"))
                }
                true => format!("a number before it gives it the unit: 1*({trimmed})"),
                false if quantity.unit.is_empty() => "write it without a unit".to_owned(),
                false => format!("write it in {unit}; numbers without a unit are in {unit} as well"),
            };
            let (text, what) = (formula.text(), format!("is {found}, not {unit}"));
            Err(FormulaError::new(text, 0, text.len(), what, hint))
        }
        _ => Ok(()),
    }
}
