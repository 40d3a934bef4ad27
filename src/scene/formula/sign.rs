//! Bounds of parts of formulas, and powers of what branches hold at zero or above.
//!
//! Fractional powers have no series at zero, where laws like `max(0, depth)^1.5` begin and end: an impact by
//! Hertz, a flow through an orifice.  Rounding and trial steps put their bases a little below zero on the
//! branch where they are above it.  Such powers are told here, from the functions and conditions that hold
//! their bases, and are evaluated as zero there.

use super::{Formula, LARGEST_POWER, Node};
use crate::arithmetic::Scalar;

impl Formula {
    /// Bounds of what an operation comes to, whatever its names are.
    pub(super) fn range(&self, node: usize) -> [f64; 2] {
        if let Some(value) = self.constants[node] {
            return [value; 2];
        }
        match self.nodes[node] {
            Node::Negative(a) => {
                let [least, most] = self.range(a);
                [-most, -least]
            }
            Node::Sum(a, b) => {
                let (a, b) = (self.range(a), self.range(b));
                [a[0] + b[0], a[1] + b[1]]
            }
            Node::Difference(a, b) => {
                let (a, b) = (self.range(a), self.range(b));
                [a[0] - b[1], a[1] - b[0]]
            }
            Node::Product(a, b) | Node::Quotient(a, b)
                if self.range(a)[0] >= 0.0 && self.range(b)[0] >= 0.0 =>
            {
                [0.0, f64::INFINITY]
            }
            Node::Sine(_) | Node::Cosine(_) | Node::HyperbolicTangent(_) => [-1.0, 1.0],
            Node::Root(_) | Node::Exponential(_) => [0.0, f64::INFINITY],
            Node::Power(_, b) if self.constants[b].is_some_and(|power| power % 2.0 == 0.0) => {
                [0.0, f64::INFINITY]
            }
            Node::Power(a, _) if self.range(a)[0] >= 0.0 => [0.0, f64::INFINITY],
            Node::Flip(condition, a) if self.conditions[condition] == a => [0.0, f64::INFINITY],
            Node::Select(condition, a, b) => {
                let (ranges, larger) = ([self.range(a), self.range(b)], Node::Difference(a, b));
                let least = ranges.map(|range| range[0]);
                let is_larger = self.nodes[self.conditions[condition]] == larger;
                let least = if is_larger { least[0].max(least[1]) } else { least[0].min(least[1]) };
                [least, ranges[0][1].max(ranges[1][1])]
            }
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// Whole powers by multiplications, at any base; others by the logarithm of a positive base.
    pub(super) fn power<S: Scalar>(&self, [a, b]: [usize; 2], base: S, exponent: S) -> S {
        match self.constants[b] {
            Some(power) if power.fract() == 0.0 && power.abs() <= LARGEST_POWER => base.powi(power as i32),
            Some(power) if power > 0.0 && self.is_held_above_zero(a) => base.power_above_zero(exponent),
            Some(0.5) => base.sqrt(),
            None if self.fixed.contains(&b) && self.is_held_above_zero(a) => base.power_above_zero(exponent),
            _ => (base.ln() * exponent).exp(),
        }
    }

    /// Notes the exponents of these names, by number, which are above zero and do not change with time.
    pub(crate) fn note_exponents(&mut self, is_fixed: impl Fn(usize) -> bool) {
        let exponents = self.nodes.iter().filter_map(|node| match node {
            Node::Power(_, exponent) if self.constants[*exponent].is_none() => Some(*exponent),
            _ => None,
        });
        self.fixed = exponents.filter(|&exponent| self.is_above_zero(exponent, &is_fixed)).collect();
    }

    /// True for sums, products and quotients of numbers and names that are above zero.
    fn is_above_zero(&self, node: usize, is_name: &impl Fn(usize) -> bool) -> bool {
        match self.nodes[node] {
            Node::Number(number) => number > 0.0,
            Node::Name(name) => is_name(name),
            Node::Sum(a, b) | Node::Product(a, b) | Node::Quotient(a, b) => {
                [a, b].into_iter().all(|node| self.is_above_zero(node, is_name))
            }
            _ => false,
        }
    }

    /// True for a base that branches hold at zero or above.
    pub(super) fn is_held_above_zero(&self, base: usize) -> bool {
        self.held.contains(&base)
    }

    /// Notes whether branches hold the base of a power at zero or above.
    pub(super) fn note_base(&mut self, node: Node) {
        let (Node::Power(base, _) | Node::Root(base)) = node else { return };
        if self.range(base)[0] == 0.0 && self.has_condition(base) {
            self.held.push(base);
        }
    }

    /// Notes the bases of powers that a comparison holds on its branches, ranges of nodes: that where the
    /// condition is positive, and that where it is not.
    pub(super) fn note_bases(&mut self, condition: usize, branches: [std::ops::Range<usize>; 2]) {
        for (branch, sign) in branches.into_iter().zip([1.0, -1.0]) {
            for place in branch {
                let (Node::Power(base, _) | Node::Root(base)) = self.nodes[place] else { continue };
                if !self.held.contains(&base) && self.is_same(base, condition, sign) {
                    self.held.push(base);
                }
            }
        }
    }

    /// True where a node is plus or minus another one, or a number above zero times it, as they are written.
    fn is_same(&self, node: usize, other: usize, sign: f64) -> bool {
        let is_zero = |node: usize| self.constants[node] == Some(0.0);
        let (node, other) = (self.without_factors(node), self.without_factors(other));
        match (self.nodes[node], self.nodes[other]) {
            (_, Node::Difference(a, b)) if is_zero(b) => self.is_same(node, a, sign),
            (_, Node::Difference(a, b)) if is_zero(a) => self.is_same(node, b, -sign),
            (Node::Difference(a, b), _) if is_zero(b) => self.is_same(a, other, sign),
            (Node::Difference(a, b), _) if is_zero(a) => self.is_same(b, other, -sign),
            (_, Node::Negative(a)) => self.is_same(node, a, -sign),
            (Node::Negative(a), _) => self.is_same(a, other, -sign),
            (Node::Difference(a, b), Node::Difference(c, d)) if sign < 0.0 => {
                self.is_equal(a, d) && self.is_equal(b, c)
            }
            _ => sign > 0.0 && self.is_equal(node, other),
        }
    }

    /// A node without the numbers above zero that multiply or divide it.
    fn without_factors(&self, node: usize) -> usize {
        let is_above = |node: usize| self.constants[node].is_some_and(|number| number > 0.0);
        match self.nodes[node] {
            Node::Product(a, b) | Node::Quotient(a, b) if is_above(b) => self.without_factors(a),
            Node::Product(a, b) if is_above(a) => self.without_factors(b),
            _ => node,
        }
    }

    /// True for the same operations of the same numbers and names.
    fn is_equal(&self, a: usize, b: usize) -> bool {
        let (first, second) = (self.nodes[a], self.nodes[b]);
        let has_same_condition = match (first, second) {
            (Node::Number(a), Node::Number(b)) => return a == b,
            (Node::Name(a), Node::Name(b)) => return a == b,
            (Node::Table(..), _) => return false,
            (Node::Flip(a, _), Node::Flip(b, _)) | (Node::Select(a, ..), Node::Select(b, ..)) => {
                self.is_equal(self.conditions[a], self.conditions[b])
            }
            _ => std::mem::discriminant(&first) == std::mem::discriminant(&second),
        };
        let both = first.operands().into_iter().zip(second.operands());
        has_same_condition && both.into_iter().all(|(a, b)| a.zip(b).is_none_or(|(a, b)| self.is_equal(a, b)))
    }

    /// True where branches are chosen in a node.
    pub(super) fn has_condition(&self, node: usize) -> bool {
        matches!(self.nodes[node], Node::Flip(..) | Node::Select(..))
            || self.nodes[node].operands().into_iter().flatten().any(|node| self.has_condition(node))
    }
}
