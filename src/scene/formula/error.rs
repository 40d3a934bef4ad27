//! Why a text is no formula.

use std::fmt;

/// Why a text is no formula:
///
/// ```text
/// column 3: unknown function sinn
///   | 2*sinn(x)
///   |   ^^^^
///   hint: did you mean sin?
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FormulaError {
    /// Column, from 1, in characters.
    pub column: usize,
    /// What is wrong.
    pub problem: String,
    /// What to try.
    pub hint: String,
    /// The bytes at fault.
    pub(crate) bytes: (usize, usize),
    shown: String,
    indent: usize,
    width: usize,
}

/// The widest piece of a formula shown \[characters\].
const WIDEST: usize = 96;

impl FormulaError {
    /// At bytes `start` to `end` of a text.
    pub(crate) fn new(text: &str, start: usize, end: usize, problem: String, hint: String) -> Self {
        let before = text.char_indices().take_while(|(at, _)| *at < start).count();
        let marked = text.char_indices().filter(|(at, _)| (start..end).contains(at)).count();
        let from = before.saturating_sub(WIDEST / 2);
        let plain = |c: char| if c.is_control() { ' ' } else { c };
        let shown: String = text.chars().skip(from).take(WIDEST).map(plain).collect();
        let indent = before - from;
        let width = marked.clamp(1, WIDEST - indent);
        Self { column: before + 1, problem, hint, bytes: (start, end), shown, indent, width }
    }
}

impl std::error::Error for FormulaError {}

impl fmt::Display for FormulaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { column, problem, hint, shown, indent, width, .. } = self;
        let marks = "^".repeat(*width);
        write!(f, "column {column}: {problem}\n  | {shown}\n  | {:indent$}{marks}\n  hint: {hint}", "")
    }
}

/// A hint at the nearest of the known names: of a known part, at what it has.
pub(crate) fn meant(name: &str, known: &[&str]) -> String {
    if let Some((part, quantity)) = name.rsplit_once('.') {
        let quantities: Vec<&str> = (known.iter())
            .filter_map(|known| known.rsplit_once('.').filter(|(other, _)| *other == part))
            .map(|(_, quantity)| quantity)
            .collect();
        if !quantities.is_empty() {
            return match crate::scene::read::nearest(quantity, quantities.iter().copied()) {
                Some(near) => format!("did you mean {part}.{near}?"),
                None => format!("{part} has {}", quantities.join(", ")),
            };
        }
    }
    if name.eq_ignore_ascii_case("pi") {
        return "did you mean pi?".into();
    }
    match crate::scene::read::nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean {near}?"),
        None if known.is_empty() => "nothing has a name here".into(),
        None => format!("known are {}", first_of(known)),
    }
}

/// Words that a hint names at most, and at most so many more where that is all of them.
const NAMED: [usize; 2] = [20, 10];

/// All of a few words, or the first of many and how many more there are.
fn first_of(known: &[&str]) -> String {
    let more = known.len().saturating_sub(NAMED[0]);
    if more <= NAMED[1] {
        return known.join(", ");
    }
    format!("{} and {more} more", known[..NAMED[0]].join(", "))
}
