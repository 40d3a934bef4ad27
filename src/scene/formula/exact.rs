//! The numbers of a formula exactly as written: 0.1 is 1/10, 30 deg is π/6; and those of its tables.

use super::parse::Parser;
use super::table::Spline;
use super::unit::{Dimension, Unit};
use super::{Formula, Node, Origin};
use crate::scene::PointTable;
use crate::scene::number::Decimal;
use std::f64::consts::PI;

/// The numbers of a formula.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Numbers<C> {
    /// Those of its text, node by node; zero for nodes that are none.
    nodes: Vec<C>,
    /// Its tables.
    splines: Vec<Spline<C>>,
}

impl<C: Decimal> Numbers<C> {
    /// Those of a formula of a scene with these tables.
    pub fn of(formula: &Formula, tables: &[PointTable<C>]) -> Self {
        let number = |(&node, &(start, end)): (&Node, &(u32, u32))| match node {
            Node::Number(value) => {
                // What is not written stands for a part of a function.
                written(&formula.text[start as usize..end as usize])
                    .unwrap_or_else(|| if value == PI { C::pi() } else { C::of(value) })
            }
            _ => C::ZERO,
        };
        let spline = |name: &String| tables.iter().find(|table| table.name == *name);
        let splines = formula.tables.iter().filter_map(|table| spline(&table.name));
        Self {
            nodes: formula.nodes.iter().zip(&formula.places).map(number).collect(),
            splines: splines.map(|table| Spline::new(&table.points)).collect(),
        }
    }

    /// The number there.
    pub fn at(&self, origin: Origin) -> C {
        match origin {
            Origin::Node(node) => self.nodes[node],
            Origin::Knot { table, point } => self.splines[table].knot(point),
            Origin::Coefficient { table, piece, power } => self.splines[table].coefficients(piece)[power],
        }
    }
}

impl Formula {
    /// The digits of the number that it is, where it is nothing but one with its sign and unit, and the
    /// dimension of that unit.
    pub(crate) fn number_alone(&self) -> Option<(&str, Option<Dimension>)> {
        let ([Node::Number(_)] | [Node::Number(_), Node::Negative(0)]) = self.nodes[..] else { return None };
        let (start, end) = self.places[0];
        let digits = Parser::new(&self.text[start as usize..end as usize], &[]).digits();
        let unit = self.units.iter().find(|unit| unit.0 == 0).map(|unit| unit.1);
        (!digits.is_empty()).then_some((digits, unit))
    }
}

/// A number with its units.
fn written<C: Decimal>(text: &str) -> Option<C> {
    if text == "pi" {
        return Some(C::pi());
    }
    let mut parser = Parser::new(text, &[]);
    let digits = parser.digits();
    // The decimals of a formula may begin with their point.
    let number = C::parse(&format!("0{digits}"))?;
    let units = parser.units().ok()?;
    units.into_iter().try_fold(number, |number, (unit, power)| {
        let factor = factor::<C>(unit)?.powi(power.abs());
        Some(if power > 0 { number * factor } else { number / factor })
    })
}

/// How many of its SI unit a unit is.
fn factor<C: Decimal>(unit: &Unit) -> Option<C> {
    let exact = |value: f64| match value / PI {
        1.0 => Some(C::pi()),
        2.0 => Some(C::pi() + C::pi()),
        _ => C::parse(&format!("{value:?}")),
    };
    Some(exact(unit.above)? / exact(unit.below)?)
}

#[cfg(all(test, feature = "digits"))]
mod tests {
    use super::*;
    use crate::arithmetic::digits::{Digits, pi};

    #[test]
    fn numbers_and_units_are_those_of_the_text() {
        type Exact = Digits<8>;
        let whole = |x: u64| Exact::whole(x);
        for (text, expected) in [
            ("0.1", whole(1) / whole(10)),
            (".25e1", whole(5) / whole(2)),
            ("0.12345678901234567890123", Exact::parse("0.12345678901234567890123").expect("a number")),
            ("3 in", whole(762) / whole(10_000)),
            ("30 deg", pi::<8>() / whole(6)),
            ("7 turn", pi::<8>() * whole(14)),
            ("2 rpm/s^2", pi::<8>() / whole(15)),
            ("5 N*s/mm", whole(5000)),
            ("pi", pi()),
        ] {
            let formula = Formula::parse(text).expect("a formula");
            let found = formula.exact_value::<Exact>(&[]);
            let off = ((found - expected) / expected).log2();
            assert!(off < -380.0, "{text}: {found:?} {expected:?}");
        }
        let formula = Formula::parse("2*x^(1/3) - log(0.3)").expect("a formula");
        let found = formula.exact_value(&[whole(27)]);
        use crate::arithmetic::Scalar;
        let expected = whole(6) - (whole(3) / whole(10)).ln();
        assert!((found - expected).log2() < -380.0);
    }
}
