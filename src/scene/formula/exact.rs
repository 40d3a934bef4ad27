//! The numbers in the text of a formula exactly as written: 0.1 is 1/10, 30 deg is π/6.

use super::parse::Parser;
use super::unit::Unit;
use super::{Formula, Node};
use crate::scene::number::Decimal;
use std::f64::consts::PI;

impl Formula {
    /// What its nodes are as numbers of its text; zero for those that are none.
    pub(crate) fn numbers<C: Decimal>(&self) -> Vec<C> {
        let number = |(&node, &(start, end)): (&Node, &(u32, u32))| match node {
            Node::Number(value) => {
                written(&self.text[start as usize..end as usize]).unwrap_or_else(|| C::of(value))
            }
            _ => C::ZERO,
        };
        self.nodes.iter().zip(&self.places).map(number).collect()
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
