//! Springs whose laws are formulas of their length and rate, in the lanes of the built-in ones.
//!
//! The span D, a = L'/L and s = 1/L are those of [`springs`](super); the tension T is what the recurrences
//! of a [`TapeSeries`](crate::arithmetic::tape::TapeSeries) make of the length:
//!
//! ```text
//! L'_m = Σ_{j=0..m} a_j L_{m-j},    (m+1) L_{m+1} = L'_m,    κ_m = -Σ_{j=0..m} T_j s_{m-j}
//! power of what has no potential = -Σ_{j=0..m} T_j L'_{m-j}
//! ```
//!
//! A series stands in memory forwards, and backwards for its products, which take four terms at a time;
//! what is not known yet is zero, so that sums may run over it.
//!
//! Wins over the series of any mechanism with the tape of points (whole runs by `taylor` of a double
//! pendulum with a linear law, by instructions): 5 times.

use super::HIGHEST_ORDER;
use crate::arithmetic::Scalar;
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::tape::{Operation, Slot, has_no_powers};
use crate::dynamics::force::span::{LENGTH, RATE, SpanLaw};

/// Blocks of four that hold all powers, and how many powers these are.
const BLOCKS: usize = (HIGHEST_ORDER + 2).div_ceil(4);
const ROOM: usize = 4 * BLOCKS;

/// Powers of one series.
#[derive(Clone, Debug)]
#[repr(align(32))]
struct LawPowers {
    /// c_j, and j c_j.
    forward: [[f64; 4]; BLOCKS],
    weighted: [[f64; 4]; BLOCKS],
    /// c_j at ROOM - 1 - j, and zeros behind.
    backward: [f64; ROOM + 4],
}

impl LawPowers {
    const NONE: Self =
        Self { forward: [[0.0; 4]; BLOCKS], weighted: [[0.0; 4]; BLOCKS], backward: [0.0; ROOM + 4] };

    #[inline(always)]
    fn at(&self, m: usize) -> f64 {
        self.forward.as_flattened()[m]
    }

    #[inline(always)]
    fn put(&mut self, m: usize, power: f64) {
        self.forward.as_flattened_mut()[m] = power;
        self.weighted.as_flattened_mut()[m] = power * m as f64;
        self.backward[ROOM - 1 - m] = power;
    }
}

/// Σ_{j=0..m} a_j b_{m-j}.
#[inline(always)]
fn product<L: Lanes>(a: &[[f64; 4]; BLOCKS], b: &LawPowers, m: usize) -> f64 {
    let (b, _) = b.backward[ROOM - 1 - m..].as_chunks::<4>();
    let mut sums = L::ZERO;
    for i in 0..=m / 4 {
        sums = L::of(a[i]).mul_add(L::of(b[i]), sums);
    }
    let [first, second, third, fourth] = sums.array();
    (first + second) + (third + fourth)
}

/// One spring and its coefficients in the step.
#[derive(Clone, Debug)]
pub struct LawSeries {
    law: SpanLaw,
    length: LawPowers,
    rate: LawPowers,
    /// a and s.
    strain: LawPowers,
    reciprocal: LawPowers,
    /// All results of the tape.
    results: Vec<LawPowers>,
}

impl LawSeries {
    /// Room for the series of a law, as far as time is not in it.
    pub fn new(law: &SpanLaw) -> Self {
        let results = vec![LawPowers::NONE; law.tape.len()];
        let [length, rate, strain, reciprocal] = [LawPowers::NONE; 4];
        Self { law: law.clone(), length, rate, strain, reciprocal, results }
    }

    /// True where the energy balance has a work of it.
    pub fn does_work(&self) -> bool {
        self.law.applied.is_some()
    }

    /// Power zero of the length, and of s; nothing else is known.
    #[inline(never)]
    pub fn begin(&mut self, length: f64, reciprocal: f64) {
        let Self { length: own, rate, strain, reciprocal: inverse, results, .. } = self;
        for series in [&mut *own, rate, strain, &mut *inverse].into_iter().chain(results) {
            *series = LawPowers::NONE;
        }
        own.put(0, length);
        inverse.put(0, reciprocal);
    }

    /// κ_m, from a_m and s_{m+1}.
    #[inline(always)]
    pub fn factor<L: Lanes>(&mut self, m: usize, strain: f64, reciprocal: f64) -> f64 {
        self.strain.put(m, strain);
        let rate = product::<L>(&self.strain.forward, &self.length, m);
        self.rate.put(m, rate);
        self.length.put(m + 1, rate / (m + 1) as f64);
        let (length, rate) = (self.length.at(m), rate);
        let input = |input: u32| match input {
            LENGTH => length,
            RATE => rate,
            _ => f64::NAN,
        };
        advance::<L>(self.law.tape.operations(), &mut self.results, m, input);
        let tension = &self.results[self.law.tension as usize];
        let factor = -product::<L>(&tension.forward, &self.reciprocal, m);
        self.reciprocal.put(m + 1, reciprocal);
        factor
    }

    /// Power m of what has no potential \[W/s^m\].
    #[inline(always)]
    pub fn power<L: Lanes>(&self, m: usize) -> f64 {
        let of = |slot: Slot| -product::<L>(&self.results[slot as usize].forward, &self.rate, m);
        self.law.applied.map_or(0.0, of)
    }

    /// |dT/dL| \[N/m\] where the step begins.
    #[inline(never)]
    pub fn stiffness(&self) -> f64 {
        self.law.slope(self.length.at(0), self.rate.at(0)).abs()
    }
}

/// Finds power `m` of all results, from that of the inputs and from all powers before.
#[inline(always)]
fn advance<L: Lanes>(
    operations: &[Operation],
    results: &mut [LawPowers],
    m: usize,
    input: impl Fn(u32) -> f64,
) {
    let over = |x: f64| x / m as f64;
    for (i, operation) in operations.iter().enumerate() {
        let (before, rest) = results.split_at_mut(i);
        let Some((own, after)) = rest.split_first_mut() else { return };
        let of = |slot: Slot| &before[slot as usize];
        let at = |slot: Slot| before[slot as usize].at(m);
        // Σ j a_j b_{m-j}.
        let turned = |a: &LawPowers, b: &LawPowers| product::<L>(&a.weighted, b, m);
        let power = match *operation {
            Operation::Input(number) => input(number),
            Operation::Constant(value) => {
                if m == 0 {
                    value
                } else {
                    0.0
                }
            }
            Operation::Add(a, b) => at(a) + at(b),
            Operation::Subtract(a, b) => at(a) - at(b),
            Operation::Negate(a) => -at(a),
            Operation::Scale(a, factor) => at(a) * factor,
            Operation::Multiply(a, b) => product::<L>(&of(a).forward, of(b), m),
            Operation::Divide(a, b) => (at(a) - product::<L>(&of(b).forward, own, m)) / of(b).at(0),
            Operation::Root(a) if m == 0 => at(a).sqrt(),
            Operation::Root(a) => (at(a) - product::<L>(&own.forward, own, m)) / (own.at(0) + own.at(0)),
            Operation::Exponential(a) if m == 0 => Scalar::exp(at(a)),
            Operation::Exponential(a) => over(turned(of(a), own)),
            Operation::Logarithm(a) if m == 0 => Scalar::ln(at(a)),
            Operation::Logarithm(a) => (at(a) - over(turned(own, of(a)))) / of(a).at(0),
            Operation::Sine(a) => {
                let Some(cosine) = after.first_mut() else { return };
                let (sin, cos) = match m {
                    0 => Scalar::sin_cos(at(a)),
                    _ => (over(turned(of(a), cosine)), -over(turned(of(a), own))),
                };
                cosine.put(m, cos);
                sin
            }
            Operation::HyperbolicTangent(a) => {
                let Some(slope) = after.first_mut() else { return };
                let tangent = match m {
                    0 => Scalar::tanh(at(a)),
                    _ => over(turned(of(a), slope)),
                };
                own.put(m, tangent);
                slope.put(m, if m == 0 { 1.0 } else { 0.0 } - product::<L>(&own.forward, own, m));
                tangent
            }
            Operation::Angle(y, x, _) if m == 0 => Scalar::atan2(at(y), at(x)),
            Operation::Angle(y, x, square) => {
                let turning = turned(of(y), of(x)) - turned(of(x), of(y));
                over((turning - turned(own, of(square))) / of(square).at(0))
            }
            Operation::Power(a, b) if m == 0 => at(a).power_above_zero(at(b)),
            Operation::Power(a, _) if has_no_powers(of(a).at(0), of(a).at(1)) => 0.0,
            Operation::Power(a, b) => {
                over(of(b).at(0) * turned(of(a), own) - turned(own, of(a))) / of(a).at(0)
            }
            Operation::Beside => continue,
        };
        own.put(m, power);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::DoubleDouble;
    use crate::arithmetic::lanes::Portable;
    use crate::arithmetic::tape::{Symbol, TapeSeries};

    /// Every operation there is.
    fn everything(x: Symbol, y: Symbol) -> Symbol {
        let (sin, cos) = (x * y).sin_cos();
        let flat = (x - y).scale(0.7).tanh() + (-(x * x)).exp() / (y + Symbol::of(2.0));
        let power = (x + y).power_above_zero(Symbol::of(1.3));
        sin * cos.scale(2.0) + flat + (x + y).sqrt() * (x.ln() + sin.atan2(y)) - power
    }

    #[test]
    fn the_recurrences_are_those_of_a_tape_in_double_double() {
        let [(tape, slots)] = Symbol::record(|| [vec![everything(Symbol::input(0), Symbol::input(1))]]);
        let inputs = |number: u32, m: usize| [1.3, 0.4][number as usize] / ((m * m + 1) as f64 * 1.5);
        let mut exact = TapeSeries::<DoubleDouble>::new(&tape, HIGHEST_ORDER);
        let mut results = vec![LawPowers::NONE; tape.len()];
        for m in 0..=HIGHEST_ORDER {
            exact.advance(&tape, m, &|number| DoubleDouble::from(inputs(number, m)));
            advance::<Portable>(tape.operations(), &mut results, m, |number| inputs(number, m));
            let (found, wanted) = (results[slots[0] as usize].at(m), exact.of(slots[0])[m].hi);
            assert!((found - wanted).abs() < 1e-13 * (1.0 + 2f64.powi(m as i32)), "{m}: {found} {wanted}");
        }
    }
}
