//! Poles of formulas, and where roots and logarithms end: the zeros of denominators, of arguments of `sqrt`,
//! `log` and powers, and of the cosine in `tan`.

use super::branches::GivenBranches;
use super::{Formula, Node};

/// What an operation has no finite value at the zeros of, or none beyond them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pole {
    /// The result of the operation of this number.
    Result(usize),
    /// The cosine of the angle of the tangent of this number.
    Cosine(usize),
}

impl Formula {
    /// All of them that change with the names of which `varies` is true, by number.
    pub(crate) fn poles(&self, varies: impl Fn(usize) -> bool) -> Vec<Pole> {
        let mut found = Vec::new();
        let mut depends = vec![false; self.nodes.len()];
        for (place, &node) in self.nodes.iter().enumerate() {
            let operands = node.operands().into_iter().flatten();
            depends[place] = match node {
                Node::Name(number) => varies(number),
                // What holds on either side of a change is another branch.
                _ => operands.into_iter().any(|operand| depends[operand]),
            };
            match node {
                Node::Quotient(_, b) => self.add_zeros(b, &mut found),
                Node::Logarithm(a) => self.add_zeros(a, &mut found),
                Node::Root(a) if self.range(a)[0] < 0.0 => found.push(Pole::Result(a)),
                Node::Power(a, b) => match self.constants[b] {
                    Some(power) if power < 0.0 => self.add_zeros(a, &mut found),
                    Some(power) if power.fract() == 0.0 => {}
                    _ if self.range(a)[0] >= 0.0 => {}
                    _ => found.push(Pole::Result(a)),
                },
                Node::Tangent(_) => found.push(Pole::Cosine(place)),
                _ => {}
            }
        }
        found.retain(|pole| depends[pole.node()]);
        found
    }

    /// Adds the zeros of what an operation comes to: of factors, bases and what signs are taken of, as far
    /// as they change sign there.
    fn add_zeros(&self, node: usize, found: &mut Vec<Pole>) {
        match self.nodes[node] {
            Node::Product(a, b) => [a, b].into_iter().for_each(|factor| self.add_zeros(factor, found)),
            Node::Negative(a) | Node::Quotient(a, _) | Node::Power(a, _) | Node::Root(a) => {
                self.add_zeros(a, found);
            }
            Node::Flip(condition, a) if self.conditions[condition] == a => self.add_zeros(a, found),
            _ if self.range(node)[0] > 0.0 => {}
            _ => found.push(Pole::Result(node)),
        }
    }

    /// Appends what is zero at these poles, on these branches.
    pub(crate) fn pole_values(&self, values: &[f64], bits: &[bool], poles: &[Pole], all: &mut Vec<f64>) {
        if poles.is_empty() {
            return;
        }
        let results = self.results(values, bits, None);
        all.extend(poles.iter().map(|pole| match (*pole, self.nodes.get(pole.node())) {
            (Pole::Cosine(_), Some(Node::Tangent(angle))) => results[*angle].cos(),
            _ => results[pole.node()],
        }));
    }

    /// Its value on these branches where what is zero at a pole is this zero, of either sign.
    pub(crate) fn value_at_pole(&self, values: &[f64], bits: &[bool], pole: Pole, zero: f64) -> f64 {
        self.results(values, bits, Some((pole, zero))).last().copied().unwrap_or_default()
    }

    fn results(&self, values: &[f64], bits: &[bool], zero: Option<(Pole, f64)>) -> Vec<f64> {
        let mut results: Vec<f64> = Vec::with_capacity(self.nodes.len());
        let mut branches = GivenBranches(bits);
        for place in 0..self.nodes.len() {
            let given = zero.filter(|(pole, _)| pole.node() == place);
            let result = match (given, self.nodes[place]) {
                (Some((Pole::Cosine(_), zero)), Node::Tangent(angle)) => results[angle].sin() / zero,
                (Some((Pole::Result(_), zero)), _) => zero,
                _ => self.operation(place, &results, values, &|_, value| value, &mut branches),
            };
            results.push(result);
        }
        results
    }
}

impl Pole {
    fn node(self) -> usize {
        match self {
            Self::Result(node) | Self::Cosine(node) => node,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zeros(text: &str, x: f64) -> Vec<f64> {
        let formula = Formula::parse(text).expect("a formula");
        let mut found = Vec::new();
        formula.pole_values(&[x], &[], &formula.poles(|_| true), &mut found);
        found
    }

    #[test]
    fn factors_bases_and_arguments_are_zero_at_poles() {
        assert_eq!(zeros("1/x + log(x - 1) + sqrt(2 - x)", 3.0), [3.0, 2.0, -1.0]);
        assert_eq!(zeros("1/((x - 1)^2*sqrt(x))", 3.0), [3.0, 2.0, 3.0]);
        assert_eq!(zeros("(x - 1)^-2 + (x - 2)^1.5 + x^2", 4.0), [3.0, 2.0]);
        assert_eq!(zeros("tan(x)", 1.0), [f64::cos(1.0)]);
        assert_eq!(zeros("sqrt(x^2 + 1) + 1/exp(x) + x/2", 1.0).len(), 1);
    }

    #[test]
    fn values_at_poles_are_limits_of_either_side() {
        let value = |text: &str, zero: f64| {
            let formula = Formula::parse(text).expect("a formula");
            let pole = formula.poles(|_| true)[0];
            formula.value_at_pole(&[1e-20], &[], pole, zero)
        };
        assert_eq!(
            ["1/x", "2 - 1/x", "1/x^2"].map(|text| value(text, 0.0)),
            [1.0, -1.0, 1.0].map(|x| x / 0.0)
        );
        assert_eq!(
            ["1/x", "2 - 1/x", "1/x^2"].map(|text| value(text, -0.0)),
            [-1.0, 1.0, 1.0].map(|x| x / 0.0)
        );
        assert_eq!((value("log(x)", 0.0), value("1 + sqrt(x)", 0.0)), (f64::NEG_INFINITY, 1.0));
    }
}
