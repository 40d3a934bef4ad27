//! The format of scene files as tables: what the reader accepts, what its refusals say is allowed, and what
//! the JSON Schema states all come from here, so that they cannot part.

mod tables;

use crate::arithmetic::shown::plain;
pub(super) use tables::*;

/// An object with a fixed set of keys.
pub(super) struct KeyTable {
    /// What it describes, with its article.
    pub title: &'static str,
    /// One sentence more, for the schema and the hint at an unknown key.
    pub about: &'static str,
    /// Its keys.
    pub fields: &'static [Field],
}

/// One key of an object.
pub(super) struct Field {
    /// The key.
    pub name: &'static str,
    /// What it means.
    pub about: &'static str,
    /// What it may hold.
    pub shape: FieldShape,
    /// True where it must be there; else `about` says what its absence means.
    pub required: bool,
    /// A value, as JSON.
    pub example: &'static str,
}

/// What a field may hold.
pub(super) enum FieldShape {
    /// A number.
    Number(QuantityRange),
    /// Two numbers, x and y.
    Pair(QuantityRange),
    /// A number, or a formula of time and state.
    LawNumber(QuantityRange),
    /// Two of them, x and y.
    LawPair(QuantityRange),
    /// A formula of time and state.
    Formula(QuantityRange),
    /// Numbers by name, or formulas of one another.
    Parameters,
    /// Formulas of time and state by name.
    Signals,
    /// Lists of points by name.
    Tables,
    /// Formulas of outputs by name, or a list of them.
    Outputs,
    /// Names of parts.
    Names,
    /// A name: 1 to 64 letters `a` to `z` or `A` to `Z`, digits, `-`, `_`.
    Name,
    /// The name of the scene, which also names a folder.
    FolderName,
    /// Any text on one line.
    Text,
    /// The name of a bar, or `ground` where that is true.
    Body { ground: bool },
    /// The name of a slider.
    SliderName,
    /// One of these words.
    Word(&'static [&'static str]),
    /// `full`, `slender` or a number.
    Inertia(QuantityRange),
    /// The places of a hinge, a weld or a spring.
    Between,
    /// An object.
    Object(&'static KeyTable),
    /// An object, or a formula of time that comes to this unit.
    Law(&'static KeyTable, QuantityRange),
    /// So many objects, each of one of these kinds.
    List { of: &'static [&'static KeyTable], least: usize, most: usize },
    /// One object of this kind for each bar name.
    ByBar(&'static KeyTable),
}

/// A range of numbers and its unit.
#[derive(Clone, Copy)]
pub(super) struct QuantityRange {
    pub least: f64,
    pub most: f64,
    /// Empty for a pure number.
    pub unit: &'static str,
}

/// Magnitudes beyond these have no physical sense, and their squares would leave the doubles.
const TINY: f64 = 1e-30;
pub(super) const HUGE: f64 = 1e30;

/// Just below 2⁴³, where the last place of an angle grows beyond 1e-3 rad.
pub(super) const WIDEST_ANGLE: f64 = 8.796093e12;

/// Longest name \[characters\].
pub(super) const LONGEST_NAME: usize = 64;
/// Longest description \[characters\].
pub(super) const LONGEST_TEXT: usize = 1000;
/// Most bars of a scene.
pub(super) const MOST_BARS: usize = 10_000;
/// Longest file \[bytes\].
pub(super) const LONGEST_FILE: u64 = 16 << 20;
/// The reserved name of what does not move.
pub(super) const GROUND: &str = "ground";

const fn positive(unit: &'static str) -> QuantityRange {
    QuantityRange { least: TINY, most: HUGE, unit }
}

const fn not_negative(unit: &'static str) -> QuantityRange {
    QuantityRange { least: 0.0, most: HUGE, unit }
}

const fn signed(unit: &'static str) -> QuantityRange {
    QuantityRange { least: -HUGE, most: HUGE, unit }
}

/// The longest time a run may take \[s\].
pub(crate) const LONGEST_TIME: f64 = 1e12;

/// A time from the start \[s\].
const TIME: QuantityRange = QuantityRange { least: TINY, most: LONGEST_TIME, unit: "s" };

/// An absolute angle \[rad\].
pub(super) const ANGLE: QuantityRange =
    QuantityRange { least: -WIDEST_ANGLE, most: WIDEST_ANGLE, unit: "rad" };
/// A rate \[rad/s\].
pub(super) const RATE: QuantityRange = signed("rad/s");
/// A mass \[kg\].
pub(super) const MASS: QuantityRange = positive("kg");
/// A moment of inertia \[kg·m²\].
pub(super) const INERTIA: QuantityRange = not_negative("kg·m²");

const fn required(
    name: &'static str,
    shape: FieldShape,
    example: &'static str,
    about: &'static str,
) -> Field {
    Field { name, about, shape, required: true, example }
}

const fn optional(
    name: &'static str,
    shape: FieldShape,
    example: &'static str,
    about: &'static str,
) -> Field {
    Field { name, about, shape, required: false, example }
}

/// Of the kinds of a list the one that an object with these keys is of: the last that has one of them as a
/// key of its own that it must have, else the first.
pub(super) fn kind(of: &[&'static KeyTable], has: impl Fn(&str) -> bool) -> Option<&'static KeyTable> {
    let [first, others @ ..] = of else { return None };
    let own = |table: &KeyTable| {
        table
            .fields
            .iter()
            .any(|field| field.required && first.field(field.name).is_none() && has(field.name))
    };
    Some(others.iter().rfind(|table| own(table)).unwrap_or(first))
}

impl KeyTable {
    /// The field of that name.
    pub fn field(&self, name: &str) -> Option<&'static Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// Its keys, for messages.
    pub fn keys(&self) -> String {
        self.fields.iter().map(|field| field.name).collect::<Vec<_>>().join(", ")
    }
}

impl Field {
    /// `for example "density": 670`.
    pub fn for_example(&self) -> String {
        format!("for example \"{}\": {}", self.name, self.example)
    }
}

impl FieldShape {
    /// What is allowed, as it follows "must".
    pub fn allowed(&self) -> String {
        match self {
            Self::Number(quantity) => format!("must be a number {quantity}"),
            Self::Pair(quantity) => format!("must be two numbers [x, y], each {quantity}"),
            Self::LawNumber(quantity) => format!("must be a number {quantity}, or a formula"),
            Self::LawPair(quantity) => format!("must be two numbers [x, y], each {quantity}, or formulas"),
            Self::Formula(quantity) if quantity.unit.is_empty() => "must be a formula in quotes".to_owned(),
            Self::Formula(quantity) => format!("must be a formula in quotes whose unit is {}", quantity.unit),
            Self::Parameters => "must be {name: number, or formula of other parameters in quotes}".to_owned(),
            Self::Signals => "must be {name: formula in quotes, or number}".to_owned(),
            Self::Tables => {
                let [least, most] = super::formula::POINTS;
                format!("must be {{name: list of {least} to {most} points [x, y], x ascending, or CSV file}}")
            }
            Self::Outputs => "must be {name: formula in quotes}, or a list of formulas in quotes".to_owned(),
            Self::Names => "must be a list of names of parts".to_owned(),
            Self::Name => {
                format!("must be a name: 1 to {LONGEST_NAME} letters a to z or A to Z, digits, - or _")
            }
            Self::FolderName => {
                let letters = "letters a to z or A to Z";
                format!("must be a name: 1 to {LONGEST_NAME} {letters}, digits, - or _, not starting with -")
            }
            Self::Text => format!("must be text on one line, at most {LONGEST_TEXT} characters"),
            Self::Body { ground: true } => "must be the name of a bar, or \"ground\"".to_owned(),
            Self::Body { ground: false } => "must be the name of a bar".to_owned(),
            Self::SliderName => "must be the name of a slider".to_owned(),
            Self::Word(words) => format!(
                "must be {}",
                words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or ")
            ),
            Self::Inertia(quantity) => format!("must be \"full\", \"slender\" or a number {quantity}"),
            Self::Between => "must be a list of two places, each {\"body\": …, \"point\": [x, y]}".to_owned(),
            Self::Object(table) => format!("must be an object with the keys {}", table.keys()),
            Self::Law(table, _) => {
                format!("must be an object with the keys {}, or a formula of t in quotes", table.keys())
            }
            Self::List { least: 0, most: usize::MAX, .. } => "must be a list of objects [{…}, …]".to_owned(),
            Self::List { least, most: usize::MAX, .. } => {
                format!("must be a list of at least {least} objects [{{…}}, …]")
            }
            Self::List { least, most, .. } => {
                format!("must be a list of {least} to {most} objects [{{…}}, …]")
            }
            Self::ByBar(table) => format!("must be an object of {{bar name: {{{}}}}}", table.keys()),
        }
    }
}

impl std::fmt::Display for QuantityRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "from {} to {}", plain(self.least), plain(self.most))?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

impl QuantityRange {
    /// True where `number` is inside the range; infinities and NaN are not.
    pub fn holds(&self, number: f64) -> bool {
        (self.least..=self.most).contains(&number)
    }
}
