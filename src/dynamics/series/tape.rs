//! The series of a tape on numbers that are constants too: the recurrences of [`TapeSeries`], whose sums of
//! products are those of [factors](super::factors), and numbers of the tape that no time is in, which have
//! one power.
//!
//! [`TapeSeries`]: crate::arithmetic::tape::TapeSeries

use super::factors::{CauchyFactor, Factored, Scale};
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::tape::{Operation, Slot, Tape, TapeSeries, has_no_powers};

/// The series of a tape, as the numbers they are of multiply series.
#[derive(Clone, Debug)]
pub enum TapePowers<T: Factored> {
    /// Plainly.
    Plain(TapeSeries<T>),
    /// As factors.
    Factored(FactorTape<T>),
}

impl<T: Factored> TapePowers<T> {
    /// Room for powers up to `order`; `is_number` tells the inputs that do not change with time.
    pub fn new(tape: &Tape, order: usize, is_number: impl Fn(u32) -> bool) -> Self {
        match T::HAS_CONSTANTS {
            true => Self::Factored(FactorTape::new(tape, order, is_number)),
            false => Self::Plain(TapeSeries::new(tape, order)),
        }
    }

    /// Finds power `m` of all results, from that of the inputs and from all powers before.
    #[inline(always)]
    pub fn advance(&mut self, tape: &Tape, m: usize, scale: &Scale<T>, input: impl Fn(u32) -> T) {
        match self {
            Self::Plain(series) => series.advance(tape, m, &input),
            Self::Factored(series) => series.advance(tape, m, scale, input),
        }
    }

    /// Power `m` of a result.
    #[inline(always)]
    pub fn power(&self, slot: Slot, m: usize) -> T {
        match self {
            Self::Plain(series) => series.of(slot)[m],
            Self::Factored(series) => series.power(slot, m),
        }
    }

    /// Powers 0, 1, … of a result; one alone where the others are zero.
    #[inline(always)]
    pub fn of(&self, slot: Slot) -> &[T] {
        match self {
            Self::Plain(series) => series.of(slot),
            Self::Factored(series) => &series.results[slot as usize].powers,
        }
    }

    /// False where powers grow by more than products are made for.
    pub fn is_sound(&self) -> bool {
        match self {
            Self::Plain(_) => true,
            Self::Factored(series) => series.is_sound(),
        }
    }

    /// The first powers from a series in more digits.
    pub fn take(&mut self, other: &TapePowers<DoubleDouble>) {
        if let (Self::Plain(series), TapePowers::Plain(other)) = (self, other) {
            series.take(other);
        }
    }
}

/// The series of one result.
#[derive(Clone, Debug)]
struct Result<T: Factored> {
    /// Powers found so far.
    powers: Vec<T>,
    /// True where all powers but the first are zero.
    is_constant: bool,
    factor: T::Factor,
    /// j a_j.
    weighted: T::Factor,
    /// What its recurrence divides by, as a factor.
    inverse: T,
}

/// Powers 0 … P of all results of a tape.
#[derive(Clone, Debug)]
pub struct FactorTape<T: Factored> {
    results: Vec<Result<T>>,
    /// Who is a factor of a product, plainly and [weighted](Result::weighted).
    is_factor: Vec<[bool; 2]>,
}

impl<T: Factored> FactorTape<T> {
    /// Room for powers up to `order`; `is_number` tells the inputs that do not change with time.
    pub fn new(tape: &Tape, order: usize, is_number: impl Fn(u32) -> bool) -> Self {
        let operations = tape.operations();
        let mut constants: Vec<bool> = Vec::with_capacity(operations.len());
        for operation in operations {
            let is_constant = match *operation {
                Operation::Input(number) => is_number(number),
                Operation::Beside => constants.last().copied().unwrap_or(false),
                _ => operation.operands().into_iter().flatten().all(|operand| constants[operand as usize]),
            };
            constants.push(is_constant);
        }
        let is_factor = factors(operations, &constants);
        let result = |(&is_constant, &[is_plain, is_weighted]): (&bool, &[bool; 2])| Result {
            powers: Vec::with_capacity(order + 1),
            is_constant,
            factor: T::Factor::new(if is_plain { order } else { 0 }),
            weighted: T::Factor::new(if is_weighted { order } else { 0 }),
            inverse: T::ZERO,
        };
        Self { results: constants.iter().zip(&is_factor).map(result).collect(), is_factor }
    }

    /// Power `m` of a result.
    #[inline(always)]
    pub fn power(&self, slot: Slot, m: usize) -> T {
        self.results[slot as usize].powers.get(m).copied().unwrap_or(T::ZERO)
    }

    /// False where powers grow by more than products are made for.
    pub fn is_sound(&self) -> bool {
        self.results.iter().zip(&self.is_factor).all(|(result, is_factor)| {
            (!is_factor[0] || result.factor.is_sound()) && (!is_factor[1] || result.weighted.is_sound())
        })
    }

    /// Finds power `m` of all results, from that of the inputs and from all powers before.
    #[inline(always)]
    pub fn advance(&mut self, tape: &Tape, m: usize, scale: &Scale<T>, input: impl Fn(u32) -> T) {
        for (i, &operation) in tape.operations().iter().enumerate() {
            if operation == Operation::Beside || (m > 0 && self.results[i].is_constant) {
                continue;
            }
            let (power, beside) = match (operation, m) {
                (Operation::Input(number), _) => (input(number), None),
                (_, 0) => self.first(i, operation),
                _ => self.next(i, operation, m, scale),
            };
            self.push(i, m, scale, power);
            if let Some(beside) = beside {
                self.push(i + 1, m, scale, beside);
            } else if matches!(operation, Operation::HyperbolicTangent(_)) {
                // 1 - c², of which the newest power of c is known now.
                let square = match m {
                    0 => power * power,
                    _ => self.results[i].factor.product(&self.results[i].factor, scale, m, 0..=m),
                };
                self.push(i + 1, m, scale, if m == 0 { T::ONE - square } else { -square });
            }
        }
    }

    #[inline(always)]
    fn push(&mut self, i: usize, m: usize, scale: &Scale<T>, power: T) {
        let (result, [is_plain, is_weighted]) = (&mut self.results[i], self.is_factor[i]);
        if m == 0 {
            result.powers.clear();
            result.factor.restart(scale);
            result.weighted.restart(scale);
        }
        result.powers.push(power);
        if is_plain {
            result.factor.push(scale, power);
        }
        if is_weighted {
            result.weighted.push(scale, power.scale(m as f64));
        }
    }

    /// Power zero of an operation that is no input, and of the second result beside it.
    fn first(&mut self, i: usize, operation: Operation) -> (T, Option<T>) {
        let of = |slot: Slot| self.results[slot as usize].powers[0];
        let mut inverse = T::ZERO;
        let found = match operation {
            Operation::Input(_) | Operation::Beside => (T::ZERO, None),
            Operation::Constant(value) => (T::of(value), None),
            Operation::Add(a, b) => (of(a) + of(b), None),
            Operation::Subtract(a, b) => (of(a) - of(b), None),
            Operation::Multiply(a, b) => (of(a) * of(b), None),
            Operation::Divide(a, b) => {
                inverse = T::ONE / of(b);
                (of(a) / of(b), None)
            }
            Operation::Negate(a) => (-of(a), None),
            Operation::Scale(a, factor) => (of(a).scale(factor), None),
            Operation::Root(a) => {
                let root = of(a).sqrt();
                inverse = T::ONE / (root + root);
                (root, None)
            }
            Operation::Sine(a) => {
                let (sin, cos) = of(a).sin_cos();
                (sin, Some(cos))
            }
            Operation::Exponential(a) => (of(a).exp(), None),
            Operation::Logarithm(a) => {
                inverse = T::ONE / of(a);
                (of(a).ln(), None)
            }
            Operation::HyperbolicTangent(a) => (of(a).tanh(), None),
            Operation::Power(a, b) => {
                inverse = T::ONE / of(a);
                (of(a).power_above_zero(of(b)), None)
            }
            Operation::Angle(y, x, square) => {
                inverse = T::ONE / of(square);
                (of(y).atan2(of(x)), None)
            }
        };
        self.results[i].inverse = inverse;
        found
    }

    /// Power `m` above zero of an operation with operands, and of the second result beside it.
    #[inline(always)]
    fn next(&self, i: usize, operation: Operation, m: usize, scale: &Scale<T>) -> (T, Option<T>) {
        let at = |slot: Slot| &self.results[slot as usize];
        let of = |slot: Slot| self.power(slot, m);
        let own = &self.results[i];
        let over = |x: T| x / T::of(m as f64);
        let power = match operation {
            Operation::Input(_) | Operation::Beside | Operation::Constant(_) => T::ZERO,
            Operation::Add(a, b) => of(a) + of(b),
            Operation::Subtract(a, b) => of(a) - of(b),
            Operation::Negate(a) => -of(a),
            Operation::Scale(a, factor) => of(a).scale(factor),
            Operation::Multiply(a, b) if at(a).is_constant => at(a).powers[0] * of(b),
            Operation::Multiply(a, b) if at(b).is_constant => of(a) * at(b).powers[0],
            Operation::Multiply(a, b) => at(a).factor.product(&at(b).factor, scale, m, 0..=m),
            Operation::Divide(a, b) if at(b).is_constant => of(a) * own.inverse,
            Operation::Divide(a, b) => {
                (of(a) - at(b).factor.product(&own.factor, scale, m, 1..=m)) * own.inverse
            }
            Operation::Root(a) => {
                (of(a) - own.factor.product(&own.factor, scale, m, 1..=m - 1)) * own.inverse
            }
            Operation::Exponential(a) => over(at(a).weighted.product(&own.factor, scale, m, 1..=m)),
            Operation::Power(a, _) if has_no_powers(at(a).powers[0], self.power(a, 1)) => T::ZERO,
            Operation::Power(a, b) => {
                let by_base = at(b).powers[0] * at(a).weighted.product(&own.factor, scale, m, 1..=m);
                over(by_base - own.weighted.product(&at(a).factor, scale, m, 1..=m - 1)) * own.inverse
            }
            Operation::Logarithm(a) => {
                (of(a) - over(own.weighted.product(&at(a).factor, scale, m, 1..=m - 1))) * own.inverse
            }
            Operation::Sine(a) => {
                let (inner, cosine) = (&at(a).weighted, &self.results[i + 1].factor);
                let cos = -over(inner.product(&own.factor, scale, m, 1..=m));
                return (over(inner.product(cosine, scale, m, 1..=m)), Some(cos));
            }
            Operation::HyperbolicTangent(a) => {
                over(at(a).weighted.product(&self.results[i + 1].factor, scale, m, 1..=m))
            }
            Operation::Angle(y, x, square) => {
                let turning = at(y).weighted.product(&at(x).factor, scale, m, 1..=m)
                    - at(x).weighted.product(&at(y).factor, scale, m, 1..=m);
                let known = own.weighted.product(&at(square).factor, scale, m, 1..=m - 1);
                over((turning - known) * own.inverse)
            }
        };
        (power, None)
    }
}

/// Which results are factors of products, plainly and weighted.
fn factors(operations: &[Operation], constants: &[bool]) -> Vec<[bool; 2]> {
    let mut is_factor = vec![[false; 2]; operations.len()];
    let mut plain = Vec::new();
    let mut weighted = Vec::new();
    for (i, &operation) in operations.iter().enumerate().filter(|(i, _)| !constants[*i]) {
        let (own, beside) = (i as Slot, i as Slot + 1);
        match operation {
            Operation::Multiply(a, b) if !(constants[a as usize] || constants[b as usize]) => {
                plain.extend([a, b]);
            }
            Operation::Divide(_, b) if !constants[b as usize] => plain.extend([own, b]),
            Operation::Root(_) => plain.push(own),
            Operation::Exponential(a) => {
                plain.push(own);
                weighted.push(a);
            }
            Operation::Logarithm(a) => {
                plain.push(a);
                weighted.push(own);
            }
            Operation::Power(a, _) => {
                plain.extend([own, a]);
                weighted.extend([own, a]);
            }
            Operation::Sine(a) | Operation::HyperbolicTangent(a) => {
                plain.extend([own, beside]);
                weighted.push(a);
            }
            Operation::Angle(y, x, square) => {
                plain.extend([x, y, square]);
                weighted.extend([x, y, own]);
            }
            _ => {}
        }
    }
    plain.iter().for_each(|&slot| is_factor[slot as usize][0] = true);
    weighted.iter().for_each(|&slot| is_factor[slot as usize][1] = true);
    is_factor
}
