//! Formulas of time that are sums of sines and a parabola: what motors' laws are made of, so that their
//! phases stay exact over long horizons.
//!
//! ```text
//! a0 + a1 t + a2 t² + Σ (c cos w t + s sin w t)
//! ```
//!
//! Such sums are closed under sums and, as far as no t stands before a sine, under products:
//! `cos a cos b = (cos(a - b) + cos(a + b))/2`, and so on.

use super::{Formula, FormulaError, Node};
use crate::scene::{Law, Sine};

/// A sum of sines and a parabola.
#[derive(Clone, Debug)]
struct Wave {
    /// Coefficients of 1, t and t².
    powers: [f64; 3],
    /// Angular frequency above 0, and the coefficients of cosine and sine.
    waves: Vec<(f64, [f64; 2])>,
}

/// Frequencies nearer to one another than this share are the same.
const SAME: f64 = 1e-14;
/// The longest sum.
const MOST: usize = 64;

impl Wave {
    fn constant(value: f64) -> Self {
        Self { powers: [value, 0.0, 0.0], waves: Vec::new() }
    }

    fn as_constant(&self) -> Option<f64> {
        (self.waves.is_empty() && self.powers[1] == 0.0 && self.powers[2] == 0.0).then_some(self.powers[0])
    }

    fn scale(mut self, factor: f64) -> Self {
        self.powers.iter_mut().for_each(|power| *power *= factor);
        self.waves.iter_mut().flat_map(|wave| &mut wave.1).for_each(|share| *share *= factor);
        self
    }

    fn add(mut self, other: Self) -> Self {
        self.powers.iter_mut().zip(other.powers).for_each(|(power, more)| *power += more);
        other.waves.into_iter().for_each(|(frequency, shares)| self.put(frequency, shares));
        self
    }

    /// Adds a wave; one that goes backwards is turned round, one that stands still is a constant.
    fn put(&mut self, frequency: f64, [cosine, sine]: [f64; 2]) {
        if frequency == 0.0 {
            self.powers[0] += cosine;
            return;
        }
        let (frequency, sine) = if frequency < 0.0 { (-frequency, -sine) } else { (frequency, sine) };
        match self.waves.iter_mut().find(|wave| (wave.0 - frequency).abs() <= SAME * frequency) {
            Some((_, shares)) => {
                shares[0] += cosine;
                shares[1] += sine;
            }
            None => self.waves.push((frequency, [cosine, sine])),
        }
    }

    fn times(&self, other: &Self) -> Option<Self> {
        if let Some(factor) = other.as_constant() {
            return Some(self.clone().scale(factor));
        }
        if let Some(factor) = self.as_constant() {
            return Some(other.clone().scale(factor));
        }
        let grows = |wave: &Self| wave.powers[1] != 0.0 || wave.powers[2] != 0.0;
        if grows(self) || grows(other) {
            let is_plain = self.waves.is_empty() && other.waves.is_empty();
            let ([a0, a1, a2], [b0, b1, b2]) = (self.powers, other.powers);
            let is_square = a2 * b1 + a1 * b2 == 0.0 && a2 * b2 == 0.0;
            let powers = [a0 * b0, a0 * b1 + a1 * b0, a0 * b2 + a1 * b1 + a2 * b0];
            return (is_plain && is_square).then_some(Self { powers, waves: Vec::new() });
        }
        let mut product = Self::constant(self.powers[0] * other.powers[0]);
        self.waves.iter().for_each(|(w, [c, s])| product.put(*w, [c * other.powers[0], s * other.powers[0]]));
        other.waves.iter().for_each(|(w, [c, s])| product.put(*w, [c * self.powers[0], s * self.powers[0]]));
        for (a, [ac, as_]) in &self.waves {
            for (b, [bc, bs]) in &other.waves {
                let near = |b: f64| (a - b).abs() <= SAME * a;
                let difference = if near(*b) { 0.0 } else { a - b };
                product.put(difference, [0.5 * (ac * bc + as_ * bs), 0.5 * (as_ * bc - ac * bs)]);
                product.put(a + b, [0.5 * (ac * bc - as_ * bs), 0.5 * (as_ * bc + ac * bs)]);
            }
        }
        Some(product)
    }

    /// Sine (0) or cosine (1) of phase + w t.
    fn sine(&self, cosine: bool) -> Option<Self> {
        if !self.waves.is_empty() || self.powers[2] != 0.0 {
            return None;
        }
        let [phase, frequency, _] = self.powers;
        let (s, c) = (libm::sin(phase), libm::cos(phase));
        if frequency == 0.0 {
            return Some(Self::constant(if cosine { c } else { s }));
        }
        let mut wave = Self::constant(0.0);
        wave.put(frequency, if cosine { [c, -s] } else { [s, c] });
        Some(wave)
    }

    fn law(&self) -> Law {
        let sine = |(frequency, [cosine, sine]): &(f64, [f64; 2])| {
            let (amplitude, phase) = match (*cosine, *sine) {
                (0.0, sine) => (sine, 0.0),
                (cosine, sine) => (libm::hypot(cosine, sine), libm::atan2(cosine, sine)),
            };
            Sine { amplitude, frequency: *frequency, phase }
        };
        let [start, rate, square] = self.powers;
        let moving = self.waves.iter().filter(|wave| wave.1 != [0.0; 2]);
        Law { start, rate, acceleration: 2.0 * square, sines: moving.map(sine).collect(), profile: None }
    }
}

impl Formula {
    /// The law of a motor that this formula of `t` is; `values` are those of its names, `None` for `t`.
    ///
    /// # Errors
    /// It is no sum of sines of affine functions of t, powers of t up to the second, and products of sines.
    pub fn law(&self, values: &[Option<f64>]) -> Result<Law, FormulaError> {
        let mut waves: Vec<Wave> = Vec::with_capacity(self.nodes.len());
        for (number, &node) in self.nodes.iter().enumerate() {
            let at = |node: usize| &waves[node];
            let constant = |node: usize| waves[node].as_constant();
            let both = node.operands().map(|operand| operand.and_then(constant));
            let wave = match node {
                Node::Name(name) => match values.get(name).copied().flatten() {
                    Some(value) => Some(Wave::constant(value)),
                    None => Some(Wave { powers: [0.0, 1.0, 0.0], waves: Vec::new() }),
                },
                Node::Number(value) => Some(Wave::constant(value)),
                Node::Negative(a) => Some(at(a).clone().scale(-1.0)),
                Node::Sum(a, b) => Some(at(a).clone().add(at(b).clone())),
                Node::Difference(a, b) => Some(at(a).clone().add(at(b).clone().scale(-1.0))),
                Node::Product(a, b) => at(a).times(at(b)),
                Node::Quotient(a, b) => constant(b).map(|below| at(a).clone().scale(1.0 / below)),
                Node::Sine(a) => at(a).sine(false),
                Node::Cosine(a) => at(a).sine(true),
                Node::Power(a, b) if both[0].is_none() => match constant(b) {
                    Some(power) if power == 1.0 || power == 2.0 || power == 3.0 || power == 4.0 => {
                        (1..power as usize).try_fold(at(a).clone(), |product, _| product.times(at(a)))
                    }
                    _ => None,
                },
                // What takes constants alone is one.
                node if node
                    .operands()
                    .iter()
                    .zip(both)
                    .all(|(operand, value)| operand.is_none() || value.is_some()) =>
                {
                    let value = match node {
                        Node::Flip(condition, a) => constant(self.conditions[condition])
                            .and_then(|c| constant(a).map(|a| if c > 0.0 { a } else { -a })),
                        Node::Select(condition, a, b) => constant(self.conditions[condition])
                            .and_then(|c| if c > 0.0 { constant(a) } else { constant(b) }),
                        Node::Table(table, _, a) => constant(a).map(|x| self.tables[table].at(x)),
                        node => Some(self.smooth(node, |node| constant(node).unwrap_or(0.0))),
                    };
                    value.map(Wave::constant)
                }
                _ => None,
            };
            match wave.filter(|wave| wave.waves.len() <= MOST) {
                Some(wave) => waves.push(wave),
                None => {
                    let (start, end) = self.places[number];
                    let problem = "the factor of a force or torque is a sum of sines and a parabola";
                    let hint = "write the force or torque itself as a formula, which may be any";
                    let (start, end) = (start as usize, end as usize);
                    return Err(FormulaError::new(&self.text, start, end, problem.into(), hint.into()));
                }
            }
        }
        Ok(waves.last().map_or(
            Law { start: 0.0, rate: 0.0, acceleration: 0.0, sines: Vec::new(), profile: None },
            Wave::law,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_have_the_values_of_their_formulas() {
        for text in [
            "1 + 2*t - t^2/3",
            "0.2*sin(5*t + 1) - cos(2*t)",
            "sin(t)^2",
            "3*sin(2*t)*cos(5*t - 1)*sin(t)",
            "(1 + sin(t))^3/4 + (2 + t)^2",
            "sin(-3*t)",
            "2*(t - 1)*(t + 1) + sqrt(2)*abs(-1)",
        ] {
            let formula = Formula::parse(text).expect("a formula");
            let law = formula.law(&[None]).expect("a law");
            for t in [0.0, 0.3, 1.7, -2.0] {
                let sines: f64 = law
                    .sines
                    .iter()
                    .map(|sine| sine.amplitude * (sine.frequency * t + sine.phase).sin())
                    .sum();
                let value = law.start + law.rate * t + law.acceleration * t * t / 2.0 + sines;
                assert!((value - formula.value(&[t])).abs() < 1e-13, "{text} at {t}: {value}");
            }
        }
        for text in ["t*sin(t)", "t^3", "exp(t)", "sin(t^2)", "1/t", "abs(t)"] {
            assert!(Formula::parse(text).expect("a formula").law(&[None]).is_err(), "{text}");
        }
    }
}
