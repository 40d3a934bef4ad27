//! Formulas as lists of operations: recorded once from code written over [`Scalar`], evaluated on any scalar
//! and as power series.
//!
//! Code that is generic over the scalar cannot branch on values, so what one run of it does on [`Symbol`]s is
//! what every run does.  The list is a straight line: an operation refers to those before it by number.
//! Equal operations are recorded once, constants are folded, and what no result depends on is left out.
//!
//! Source: A. Griewank, A. Walther, *Evaluating Derivatives*, 2nd ed. (2008), chapters 2 (evaluation
//! procedures) and 13 (Taylor arithmetic).

mod series;
mod symbol;

pub use series::TapeSeries;
pub use symbol::Symbol;

use super::{Real, Scalar};
use std::cell::RefCell;

/// Number of an operation on its tape.
pub type Slot = u32;

/// The number of an input in a list of those handed out, to which it is added where it is new.
pub fn number_of<T: Clone + PartialEq>(list: &RefCell<Vec<T>>, input: &T) -> usize {
    let mut list = list.borrow_mut();
    list.iter().position(|known| known == input).unwrap_or_else(|| {
        list.push(input.clone());
        list.len() - 1
    })
}

/// One operation; its operands are the results of operations before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operation {
    /// A value from outside, by number.
    Input(u32),
    /// A constant.
    Constant(f64),
    /// a + b.
    Add(Slot, Slot),
    /// a - b.
    Subtract(Slot, Slot),
    /// a b.
    Multiply(Slot, Slot),
    /// a / b.
    Divide(Slot, Slot),
    /// -a.
    Negate(Slot),
    /// A plain number times a.
    Scale(Slot, f64),
    /// Square root.
    Root(Slot),
    /// Sine; the cosine is the result [`Beside`](Operation::Beside) it.
    Sine(Slot),
    /// Exponential.
    Exponential(Slot),
    /// Natural logarithm.
    Logarithm(Slot),
    /// Hyperbolic tangent c; 1 - c² is the result [`Beside`](Operation::Beside) it.
    HyperbolicTangent(Slot),
    /// The angle of the vector (x, y), given y, x and x² + y².
    Angle(Slot, Slot, Slot),
    /// The [power above zero](Scalar::power_above_zero) of a, whose exponent b does not change with time.
    Power(Slot, Slot),
    /// The second result of the operation before.
    Beside,
}

impl Operation {
    /// The operands, as far as there are any.
    pub fn operands(&self) -> [Option<Slot>; 3] {
        match *self {
            Self::Input(_) | Self::Constant(_) | Self::Beside => [None; 3],
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Power(a, b) => [Some(a), Some(b), None],
            Self::Negate(a)
            | Self::Scale(a, _)
            | Self::Root(a)
            | Self::Sine(a)
            | Self::Exponential(a)
            | Self::Logarithm(a)
            | Self::HyperbolicTangent(a) => [Some(a), None, None],
            Self::Angle(y, x, square) => [Some(y), Some(x), Some(square)],
        }
    }

    /// The same with other numbers for its operands.
    fn renumbered(self, new: &[Slot]) -> Self {
        let of = |slot: Slot| new[slot as usize];
        match self {
            Self::Input(_) | Self::Constant(_) | Self::Beside => self,
            Self::Add(a, b) => Self::Add(of(a), of(b)),
            Self::Subtract(a, b) => Self::Subtract(of(a), of(b)),
            Self::Multiply(a, b) => Self::Multiply(of(a), of(b)),
            Self::Divide(a, b) => Self::Divide(of(a), of(b)),
            Self::Negate(a) => Self::Negate(of(a)),
            Self::Scale(a, factor) => Self::Scale(of(a), factor),
            Self::Root(a) => Self::Root(of(a)),
            Self::Sine(a) => Self::Sine(of(a)),
            Self::Exponential(a) => Self::Exponential(of(a)),
            Self::Logarithm(a) => Self::Logarithm(of(a)),
            Self::HyperbolicTangent(a) => Self::HyperbolicTangent(of(a)),
            Self::Angle(y, x, square) => Self::Angle(of(y), of(x), of(square)),
            Self::Power(a, b) => Self::Power(of(a), of(b)),
        }
    }

    /// What tells it from others: its kind, its operands from 1 on, and its number.
    pub fn signature(&self) -> ([u32; 4], f64) {
        let (kind, number) = match *self {
            Self::Input(input) => return ([0, input, 0, 0], 0.0),
            Self::Constant(value) => (1, value),
            Self::Add(..) => (2, 0.0),
            Self::Subtract(..) => (3, 0.0),
            Self::Multiply(..) => (4, 0.0),
            Self::Divide(..) => (5, 0.0),
            Self::Negate(_) => (6, 0.0),
            Self::Scale(_, factor) => (7, factor),
            Self::Root(_) => (8, 0.0),
            Self::Sine(_) => (9, 0.0),
            Self::Exponential(_) => (10, 0.0),
            Self::Logarithm(_) => (11, 0.0),
            Self::HyperbolicTangent(_) => (12, 0.0),
            Self::Angle(..) => (13, 0.0),
            Self::Power(..) => (14, 0.0),
            Self::Beside => (15, 0.0),
        };
        let [a, b, c] = self.operands().map(|slot| slot.map_or(0, |slot| slot + 1));
        ([kind, a, b, c], number)
    }

    /// True for operations with a second result.
    pub fn has_two_results(&self) -> bool {
        matches!(self, Self::Sine(_) | Self::HyperbolicTangent(_))
    }
}

/// True for a base, with its rate, whose fractional powers have no series: at zero and below, and so near
/// that their coefficients leave the range of exponents.  Their first value stands for them, as long as the
/// equations confirm it.
#[inline(always)]
pub fn has_no_powers<T: Real>(base: T, rate: T) -> bool {
    base <= T::ZERO || base.is_steep(rate)
}

/// A formula with any number of results.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tape {
    operations: Vec<Operation>,
}

impl Tape {
    /// The same formula with its constants as inputs, of which `input` gives the number; and where its
    /// results are then.
    pub fn lifted(&self, mut input: impl FnMut(f64) -> u32) -> (Self, Vec<Slot>) {
        let (mut operations, mut new) = (Vec::with_capacity(self.operations.len()), Vec::<Slot>::new());
        for &operation in &self.operations {
            let operation = match operation {
                Operation::Constant(value) => Operation::Input(input(value)),
                Operation::Scale(a, factor) => {
                    operations.push(Operation::Input(input(factor)));
                    Operation::Multiply(new[a as usize], operations.len() as Slot - 1)
                }
                other => other.renumbered(&new),
            };
            new.push(operations.len() as Slot);
            operations.push(operation);
        }
        (Self { operations }, new)
    }

    /// The formula of `operations`, of which the `results` are asked for; these are renumbered.
    fn new(operations: &[Operation], results: &mut [Slot]) -> Self {
        let mut is_needed = vec![false; operations.len()];
        for &result in results.iter() {
            is_needed[result as usize] = true;
        }
        for i in (0..operations.len()).rev() {
            if operations[i] == Operation::Beside && is_needed[i] {
                is_needed[i - 1] = true;
            }
            if is_needed[i] {
                operations[i]
                    .operands()
                    .into_iter()
                    .flatten()
                    .for_each(|operand| is_needed[operand as usize] = true);
            }
            if operations[i].has_two_results() && is_needed[i] {
                is_needed[i + 1] = true;
            }
        }
        let mut new = vec![0; operations.len()];
        let mut kept = Vec::new();
        for (i, operation) in operations.iter().enumerate().filter(|(i, _)| is_needed[*i]) {
            new[i] = kept.len() as Slot;
            kept.push(operation.renumbered(&new));
        }
        results.iter_mut().for_each(|result| *result = new[*result as usize]);
        Self { operations: kept }
    }

    /// Number of operations, and of the [results](Tape::results).
    pub fn len(&self) -> usize {
        self.operations.len()
    }

    /// True where its powers at one time may say nothing of what it is a little later: of exponentials,
    /// hyperbolic tangents and quotients by what is no constant, which may be flat, and of roots, powers and
    /// angles, which nearly have a corner or a jump where their arguments are nearly zero.
    pub fn needs_confirmation(&self) -> bool {
        self.operations.iter().any(|operation| match *operation {
            Operation::Exponential(_)
            | Operation::HyperbolicTangent(_)
            | Operation::Root(_)
            | Operation::Power(..)
            | Operation::Angle(..) => true,
            Operation::Divide(_, by) => !matches!(self.operations[by as usize], Operation::Constant(_)),
            _ => false,
        })
    }

    /// True where fractional powers of what branches hold at zero or above are among its operations.
    pub fn has_powers_above_zero(&self) -> bool {
        self.operations.iter().any(|operation| matches!(operation, Operation::Power(..)))
    }

    /// Its operations.
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// True for a formula without results.
    pub fn is_empty(&self) -> bool {
        self.operations.is_empty()
    }

    /// The numbers of the inputs it asks for.
    pub fn inputs(&self) -> impl Iterator<Item = u32> + '_ {
        self.operations
            .iter()
            .filter_map(|operation| if let Operation::Input(input) = operation { Some(*input) } else { None })
    }

    /// True where these results stay as they are when all of these inputs grow by one number, since only
    /// their differences are asked for.
    pub fn is_unchanged_by_shifts(
        &self,
        is_shifted: impl Fn(u32) -> bool,
        mut results: impl Iterator<Item = Slot>,
    ) -> bool {
        // How many times that number each result grows by; `None` where that depends on values.
        let mut growth: Vec<Option<f64>> = Vec::with_capacity(self.operations.len());
        for operation in &self.operations {
            let of = |slot: Slot| growth[slot as usize];
            growth.push(match *operation {
                Operation::Input(input) => Some(f64::from(u8::from(is_shifted(input)))),
                Operation::Add(a, b) => of(a).zip(of(b)).map(|(a, b)| a + b),
                Operation::Subtract(a, b) => of(a).zip(of(b)).map(|(a, b)| a - b),
                Operation::Negate(a) => of(a).map(|a| -a),
                Operation::Scale(a, factor) => of(a).map(|a| factor * a),
                Operation::Beside => growth.last().copied().flatten(),
                other => other.operands().into_iter().flatten().all(|a| of(a) == Some(0.0)).then_some(0.0),
            });
        }
        results.all(|result| growth[result as usize] == Some(0.0))
    }

    /// The numbers of the inputs that these results depend on.
    pub fn inputs_of(&self, results: &[Slot]) -> Vec<u32> {
        Self::new(&self.operations, &mut results.to_vec()).inputs().collect()
    }

    /// Calls `then` with the results of all operations; up to 64 of them, of plain numbers 256, need no
    /// allocation.
    ///
    /// Operations are compiled once for a kind of numbers and inputs, wherever results are kept.
    #[inline]
    pub fn results<S: Scalar, R>(&self, input: impl Fn(u32) -> S, then: impl FnOnce(&[S]) -> R) -> R {
        let (mut few, mut some, mut many, mut more);
        let slots: &mut [S] = match self.len() {
            0..=16 => {
                few = [S::ZERO; 16];
                &mut few
            }
            17..=64 => {
                some = [S::ZERO; 64];
                &mut some
            }
            // Long scalars, such as dual numbers of many unknowns, would take much of a thread's stack.
            65..=256 if size_of::<S>() <= 16 => {
                many = [S::ZERO; 256];
                &mut many
            }
            count => {
                more = vec![S::ZERO; count];
                &mut more
            }
        };
        self.write(input, slots);
        then(slots)
    }

    /// Writes the results of all operations, of which there are [`Tape::len`].
    #[inline]
    fn write<S: Scalar>(&self, input: impl Fn(u32) -> S, slots: &mut [S]) {
        for (i, operation) in self.operations.iter().enumerate() {
            let of = |slot: Slot| slots[slot as usize];
            let result = match *operation {
                Operation::Input(number) => input(number),
                Operation::Constant(value) => S::of(value),
                Operation::Add(a, b) => of(a) + of(b),
                Operation::Subtract(a, b) => of(a) - of(b),
                Operation::Multiply(a, b) => of(a) * of(b),
                Operation::Divide(a, b) => of(a) / of(b),
                Operation::Negate(a) => -of(a),
                Operation::Scale(a, factor) => of(a).scale(factor),
                Operation::Root(a) => of(a).sqrt(),
                Operation::Exponential(a) => of(a).exp(),
                Operation::Logarithm(a) => of(a).ln(),
                Operation::Angle(y, x, _) => of(y).atan2(of(x)),
                Operation::Power(a, b) => of(a).power_above_zero(of(b)),
                Operation::Sine(a) => {
                    let (sin, cos) = of(a).sin_cos();
                    slots[i + 1] = cos;
                    sin
                }
                Operation::HyperbolicTangent(a) => {
                    let tangent = of(a).tanh();
                    slots[i + 1] = S::ONE - tangent * tangent;
                    tangent
                }
                Operation::Beside => continue,
            };
            slots[i] = result;
        }
    }
}

#[cfg(test)]
mod tests;
