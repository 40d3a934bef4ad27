//! Units behind numbers, and the dimensions that formulas are checked with.

use std::fmt;

/// Exponents of metre, kilogram and second; a radian counts as 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dimension([f64; 3]);

/// Exponents nearer to one another than this are the same: they come from sums and products of a few.
const SAME: f64 = 1e-9;

impl Dimension {
    /// That of a pure number.
    pub const NONE: Self = Self([0.0; 3]);

    /// True where both are the same.
    pub fn is(self, other: Self) -> bool {
        self.0.iter().zip(other.0).all(|(a, b)| (a - b).abs() < SAME)
    }

    /// That of a product with a power of another.
    pub(in crate::scene) fn times(self, other: Self, power: f64) -> Self {
        Self([0, 1, 2].map(|k| self.0[k] + power * other.0[k]))
    }

    /// That of a power.
    pub(super) fn power(self, power: f64) -> Self {
        Self(self.0.map(|exponent| exponent * power))
    }

    /// It as the unit of a column: `N`, `m/s²`, `kg m²/s`; a pure number is `1`.
    pub fn unit(self) -> String {
        let known = ["m", "kg", "s", "N", "J", "W"].into_iter().filter_map(find);
        if let Some(unit) = known.into_iter().find(|unit| unit.dimension.is(self)) {
            return unit.name.to_owned();
        }
        let side = |sign: f64| {
            let part = |(name, exponent): (&str, f64)| {
                let exponent = (sign * exponent * 1e6).round() / 1e6;
                let power = match exponent {
                    1.0 => String::new(),
                    2.0 => "²".to_owned(),
                    3.0 => "³".to_owned(),
                    _ => format!("^{exponent}"),
                };
                (exponent > SAME).then(|| format!("{name}{power}"))
            };
            ["kg", "m", "s"]
                .into_iter()
                .zip([self.0[1], self.0[0], self.0[2]])
                .filter_map(part)
                .collect::<Vec<_>>()
        };
        let (above, below) = (side(1.0), side(-1.0));
        let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
        match &below[..] {
            [] => above,
            [one] => format!("{above}/{one}"),
            _ => format!("{above}/({})", below.join(" ")),
        }
    }

    /// That of a unit of the format, as `N·s/m` or `kg·m²`; of an empty text that of a pure number.
    pub fn of(unit: &str) -> Self {
        UnitScale::read(unit).map_or(Self::NONE, |unit| unit.dimension)
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is(Self::NONE) {
            return write!(f, "a pure number");
        }
        f.write_str(&self.unit().replace(' ', "·"))
    }
}

/// What a unit measures, and how large it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitScale {
    /// Its dimension.
    pub dimension: Dimension,
    /// Multiplied by the first and divided by the second one it is in units of the SI.
    factors: [f64; 2],
}

impl UnitScale {
    /// Those of a unit, as `deg/s`, `kg·m²`, `N m` or `kg/(m s^2)`; of an empty text those of 1.
    ///
    /// # Errors
    /// The part of it that is no unit.
    pub fn read(unit: &str) -> Result<Self, &str> {
        let (mut dimension, mut factors) = (Dimension::NONE, [1.0; 2]);
        for (number, part) in unit.split('/').enumerate() {
            let side = if number == 0 { 1.0 } else { -1.0 };
            let names = part.split(|c: char| "·*()".contains(c) || c.is_whitespace());
            for factor in names.filter(|factor| !factor.is_empty() && *factor != "1") {
                let (name, power) = match (factor.strip_suffix('²'), factor.strip_suffix('³')) {
                    (Some(name), _) => (name, 2.0),
                    (_, Some(name)) => (name, 3.0),
                    _ => match factor.split_once('^') {
                        Some((name, power)) => (name, power.parse().map_err(|_| factor)?),
                        None => (factor, 1.0),
                    },
                };
                let (unit, power) = (find(name).ok_or(factor)?, side * power);
                dimension = dimension.times(unit.dimension, power);
                let [above, below] =
                    if power < 0.0 { [unit.below, unit.above] } else { [unit.above, unit.below] };
                factors[0] *= libm::pow(above, power.abs());
                factors[1] *= libm::pow(below, power.abs());
            }
        }
        Ok(Self { dimension, factors })
    }

    /// A number in units of the SI.
    pub fn of_number(&self, number: f64) -> f64 {
        number * self.factors[0] / self.factors[1]
    }

    /// The names of all units, to choose from.
    pub fn names() -> String {
        UNITS.each_ref().map(|unit| unit.name).join(", ")
    }
}

/// What does not go together.
pub(super) enum Mismatch {
    /// A sum or comparison.
    Sum(Dimension, Dimension),
    /// An argument or exponent.
    Pure(Dimension),
    /// The base of a power whose exponent is no number that is known before.
    Base(Dimension),
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sum(a, b) => write!(f, "puts {a} and {b} together"),
            Self::Pure(a) => write!(f, "takes a pure number, not {a}"),
            Self::Base(a) => write!(f, "raises {a} to a power that is not a plain number"),
        }
    }
}

/// A unit: a number of it is multiplied by `above` and divided by `below`, both exact or nearly so, so that
/// `5 mm` is the double nearest to 0.005.
pub(super) struct Unit {
    pub name: &'static str,
    pub above: f64,
    pub below: f64,
    pub dimension: Dimension,
}

const fn unit(name: &'static str, above: f64, below: f64, dimension: [f64; 3]) -> Unit {
    Unit { name, above, below, dimension: Dimension(dimension) }
}

const LENGTH: [f64; 3] = [1.0, 0.0, 0.0];
const MASS: [f64; 3] = [0.0, 1.0, 0.0];
const TIME: [f64; 3] = [0.0, 0.0, 1.0];
const FREQUENCY: [f64; 3] = [0.0, 0.0, -1.0];
const FORCE: [f64; 3] = [1.0, 1.0, -2.0];
const ENERGY: [f64; 3] = [2.0, 1.0, -2.0];
const POWER: [f64; 3] = [2.0, 1.0, -3.0];
const PURE: [f64; 3] = [0.0; 3];
const PI: f64 = std::f64::consts::PI;

/// The units.
pub(super) static UNITS: [Unit; 27] = [
    unit("m", 1.0, 1.0, LENGTH),
    unit("mm", 1.0, 1e3, LENGTH),
    unit("cm", 1.0, 1e2, LENGTH),
    unit("km", 1e3, 1.0, LENGTH),
    unit("in", 0.0254, 1.0, LENGTH),
    unit("ft", 0.3048, 1.0, LENGTH),
    unit("kg", 1.0, 1.0, MASS),
    unit("g", 1.0, 1e3, MASS),
    unit("lb", 0.453_592_37, 1.0, MASS),
    unit("s", 1.0, 1.0, TIME),
    unit("ms", 1.0, 1e3, TIME),
    unit("us", 1.0, 1e6, TIME),
    unit("min", 60.0, 1.0, TIME),
    unit("h", 3600.0, 1.0, TIME),
    unit("rad", 1.0, 1.0, PURE),
    unit("deg", PI, 180.0, PURE),
    unit("turn", 2.0 * PI, 1.0, PURE),
    unit("rpm", PI, 30.0, FREQUENCY),
    unit("Hz", 1.0, 1.0, FREQUENCY),
    unit("N", 1.0, 1.0, FORCE),
    unit("mN", 1.0, 1e3, FORCE),
    unit("kN", 1e3, 1.0, FORCE),
    unit("J", 1.0, 1.0, ENERGY),
    unit("kJ", 1e3, 1.0, ENERGY),
    unit("W", 1.0, 1.0, POWER),
    unit("kW", 1e3, 1.0, POWER),
    unit("lbf", 4.448_221_615_260_5, 1.0, FORCE),
];

/// The unit of a name.
pub(super) fn find(name: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| unit.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_the_format_have_their_dimensions() {
        for (unit, [m, kg, s]) in [
            ("N·s/m", [0.0, 1.0, -1.0]),
            ("kg·m²", [2.0, 1.0, 0.0]),
            ("kg/m³", [-3.0, 1.0, 0.0]),
            ("N·m·s/rad", [2.0, 1.0, -1.0]),
            ("rad/s²", [0.0, 0.0, -2.0]),
            ("1/s", [0.0, 0.0, -1.0]),
            ("", [0.0; 3]),
        ] {
            assert!(Dimension::of(unit).is(Dimension([m, kg, s])), "{unit}");
        }
        assert_eq!(Dimension::of("N/m").to_string(), "kg/s²");
        assert_eq!(Dimension::of("N").to_string(), "N");
        for unit in ["N", "m/s", "1/s²", "kg m²/s", "kg/s²", "1", "J"] {
            assert_eq!(Dimension::of(&unit.replace(' ', "·")).unit(), unit);
        }
        assert_eq!(Dimension::of("N/m²").unit(), "kg/(m s²)");
        assert!(Dimension::of("kg/(m s²)").is(Dimension::of("N/m^2")));
    }

    #[test]
    fn numbers_are_brought_to_units_of_the_si() {
        for (unit, number, found) in [
            ("ms", 250.0, 0.25),
            ("mm/s", 5.0, 0.005),
            ("deg", 180.0, PI),
            ("kN mm", 3.0, 3.0),
            ("1", 2.0, 2.0),
        ] {
            assert_eq!(UnitScale::read(unit).map(|unit| unit.of_number(number)), Ok(found), "{unit}");
        }
        let per_minute = UnitScale::read("rad/min").map(|unit| unit.of_number(60.0));
        assert_eq!((per_minute, UnitScale::read("mm/min^2").is_ok()), (Ok(1.0), true));
        assert_eq!(
            ["degs", "m/foo", "m^x"].map(|unit| UnitScale::read(unit).err()),
            ["degs", "foo", "m^x"].map(Some)
        );
    }
}
