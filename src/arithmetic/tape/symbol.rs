//! The scalar that writes down what is done to it.

use super::{Operation, Slot, Tape};
use crate::arithmetic::Scalar;
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value on the tape that is being recorded, or a constant.
///
/// Symbols live as long as the recording they were made in ([`Symbol::record`]); used outside of one they are
/// NaN.
#[derive(Clone, Copy, Debug)]
pub struct Symbol {
    slot: Option<Slot>,
    /// The value of a constant.
    value: f64,
}

/// What is being recorded.
#[derive(Default)]
struct Recording {
    operations: Vec<Operation>,
    /// Where an operation has been recorded before.
    known: HashMap<[u64; 4], Slot>,
}

thread_local! {
    static RECORDING: RefCell<Option<Recording>> = const { RefCell::new(None) };
}

/// Two operations are the same where these numbers are.
fn key(operation: &Operation) -> [u64; 4] {
    let [a, b, c] = operation.operands().map(|operand| operand.map_or(u64::MAX, u64::from));
    let more = match *operation {
        Operation::Input(number) => u64::from(number),
        Operation::Constant(value) | Operation::Scale(_, value) => value.to_bits(),
        _ => c,
    };
    let kind = match operation {
        Operation::Input(_) => 0,
        Operation::Constant(_) => 1,
        Operation::Add(..) => 2,
        Operation::Subtract(..) => 3,
        Operation::Multiply(..) => 4,
        Operation::Divide(..) => 5,
        Operation::Negate(_) => 6,
        Operation::Scale(..) => 7,
        Operation::Root(_) => 8,
        Operation::Sine(_) => 9,
        Operation::Exponential(_) => 10,
        Operation::Logarithm(_) => 11,
        Operation::HyperbolicTangent(_) => 12,
        Operation::Angle(..) => 13,
        Operation::Beside => 14,
        Operation::Power(..) => 15,
    };
    [kind, a, b, more]
}

impl Recording {
    fn push(&mut self, operation: Operation) -> Slot {
        let next = self.operations.len() as Slot;
        let slot = *self.known.entry(key(&operation)).or_insert(next);
        if slot == next {
            self.operations.push(operation);
            if operation.has_two_results() {
                self.operations.push(Operation::Beside);
            }
        }
        slot
    }
}

impl Symbol {
    /// Records what `formula` does: for each list of results a tape of what they depend on, with their
    /// numbers on it.
    pub fn record<const N: usize>(formula: impl FnOnce() -> [Vec<Symbol>; N]) -> [(Tape, Vec<Slot>); N] {
        let before = RECORDING.with(|recording| recording.replace(Some(Recording::default())));
        let results = formula();
        let slots = results.map(|results| results.into_iter().map(Self::slot).collect::<Vec<Slot>>());
        let recording = RECORDING.with(|recording| recording.replace(before)).unwrap_or_default();
        slots.map(|mut slots| (Tape::new(&recording.operations, &mut slots), slots))
    }

    /// The value from outside with this number.
    pub fn input(number: u32) -> Self {
        Self::push(Operation::Input(number))
    }

    /// Derivatives of a result by inputs: the sums of these weights by the numbers of the inputs, in the
    /// order in which they were first asked for.
    ///
    /// By the reverse mode: one pass backwards over the operations, whatever the number of inputs.
    pub fn gradient(self) -> Vec<(u32, Symbol)> {
        let Some(result) = self.slot else { return Vec::new() };
        let operations = RECORDING
            .with(|recording| recording.borrow().as_ref().map(|recording| recording.operations.clone()));
        let Some(operations) = operations else { return Vec::new() };
        let mut weights = vec![Self::ZERO; operations.len()];
        weights[result as usize] = Self::ONE;
        let mut gradient = Vec::new();
        for i in (0..operations.len()).rev() {
            let (weight, at) = (weights[i], |slot: Slot| Self { slot: Some(slot), value: 0.0 });
            let beside = weights.get(i + 1).copied().unwrap_or(Self::ZERO);
            let has_beside = operations[i].has_two_results() && !beside.is_zero();
            if weight.is_zero() && !has_beside {
                continue;
            }
            let this = at(i as Slot);
            let mut add = |slot: Slot, more: Symbol| weights[slot as usize] += more;
            match operations[i] {
                Operation::Input(number) => gradient.push((number, weight)),
                Operation::Constant(_) | Operation::Beside => {}
                Operation::Add(a, b) => {
                    add(a, weight);
                    add(b, weight);
                }
                Operation::Subtract(a, b) => {
                    add(a, weight);
                    add(b, -weight);
                }
                Operation::Multiply(a, b) => {
                    add(a, weight * at(b));
                    add(b, weight * at(a));
                }
                Operation::Divide(a, b) => {
                    add(a, weight / at(b));
                    add(b, -(weight * this / at(b)));
                }
                Operation::Negate(a) => add(a, -weight),
                Operation::Scale(a, factor) => add(a, weight.scale(factor)),
                Operation::Root(a) => add(a, weight.scale(0.5) / this),
                Operation::Sine(a) => add(a, weight * at(i as Slot + 1) - beside * this),
                Operation::Exponential(a) => add(a, weight * this),
                Operation::Logarithm(a) => add(a, weight / at(a)),
                Operation::HyperbolicTangent(a) => {
                    let slope = at(i as Slot + 1);
                    add(a, weight * slope - (beside * this * slope).scale(2.0));
                }
                Operation::Angle(y, x, square) => {
                    add(y, weight * at(x) / at(square));
                    add(x, -(weight * at(y) / at(square)));
                }
                Operation::Power(a, b) => {
                    let exponent = match operations[b as usize] {
                        Operation::Constant(value) => Self::of(value),
                        _ => at(b),
                    };
                    add(a, weight * exponent * at(a).power_above_zero(exponent - Self::ONE));
                }
            }
        }
        gradient.reverse();
        gradient
    }

    /// True for the constant zero.
    pub fn is_zero(self) -> bool {
        self.slot.is_none() && self.value == 0.0
    }

    fn push(operation: Operation) -> Self {
        let slot = RECORDING
            .with(|recording| recording.borrow_mut().as_mut().map(|recording| recording.push(operation)));
        Self { slot, value: f64::NAN }
    }

    /// Its number on the tape.
    fn slot(self) -> Slot {
        self.slot.or_else(|| Self::push(Operation::Constant(self.value)).slot).unwrap_or(0)
    }

    /// The second result of the operation it is.
    fn beside(self) -> Self {
        Self { slot: self.slot.map(|slot| slot + 1), ..self }
    }

    /// The value of a constant.
    fn constant(self) -> Option<f64> {
        self.slot.is_none().then_some(self.value)
    }
}

impl Default for Symbol {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Scalar for Symbol {
    const ZERO: Self = Self { slot: None, value: 0.0 };
    const ONE: Self = Self { slot: None, value: 1.0 };

    fn of(value: f64) -> Self {
        Self { slot: None, value }
    }

    fn scale(self, factor: f64) -> Self {
        match self.constant() {
            Some(value) => Self::of(value * factor),
            None if factor == 1.0 => self,
            None if factor == 0.0 => Self::ZERO,
            None => Self::push(Operation::Scale(self.slot(), factor)),
        }
    }

    fn sqrt(self) -> Self {
        self.constant()
            .map_or_else(|| Self::push(Operation::Root(self.slot())), |value| Self::of(value.sqrt()))
    }

    fn sin_cos(self) -> (Self, Self) {
        if let Some(value) = self.constant() {
            let (sin, cos) = Scalar::sin_cos(value);
            return (Self::of(sin), Self::of(cos));
        }
        let sin = Self::push(Operation::Sine(self.slot()));
        (sin, sin.beside())
    }

    fn exp(self) -> Self {
        self.constant().map_or_else(
            || Self::push(Operation::Exponential(self.slot())),
            |value| Self::of(Scalar::exp(value)),
        )
    }

    fn ln(self) -> Self {
        self.constant().map_or_else(
            || Self::push(Operation::Logarithm(self.slot())),
            |value| Self::of(Scalar::ln(value)),
        )
    }

    fn tanh(self) -> Self {
        self.constant().map_or_else(
            || Self::push(Operation::HyperbolicTangent(self.slot())),
            |value| Self::of(Scalar::tanh(value)),
        )
    }

    fn atan2(self, x: Self) -> Self {
        if let (Some(y), Some(x)) = (self.constant(), x.constant()) {
            return Self::of(Scalar::atan2(y, x));
        }
        let square = self * self + x * x;
        Self::push(Operation::Angle(self.slot(), x.slot(), square.slot()))
    }

    fn power_above_zero(self, exponent: Self) -> Self {
        match (self.constant(), exponent.constant()) {
            (Some(base), Some(exponent)) => Self::of(base.power_above_zero(exponent)),
            (_, Some(0.0)) => Self::ONE,
            (_, Some(1.0)) => self,
            _ => Self::push(Operation::Power(self.slot(), exponent.slot())),
        }
    }
}

impl Add for Symbol {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (self.constant(), other.constant()) {
            (Some(a), Some(b)) => Self::of(a + b),
            _ if self.is_zero() => other,
            _ if other.is_zero() => self,
            _ => Self::push(Operation::Add(self.slot(), other.slot())),
        }
    }
}

impl Sub for Symbol {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (self.constant(), other.constant()) {
            (Some(a), Some(b)) => Self::of(a - b),
            _ if self.is_zero() => -other,
            _ if other.is_zero() => self,
            _ => Self::push(Operation::Subtract(self.slot(), other.slot())),
        }
    }
}

impl Mul for Symbol {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match (self.constant(), other.constant()) {
            (Some(a), _) => other.scale(a),
            (_, Some(b)) => self.scale(b),
            _ => Self::push(Operation::Multiply(self.slot(), other.slot())),
        }
    }
}

impl Div for Symbol {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        match (self.constant(), other.constant()) {
            (Some(a), Some(b)) => Self::of(a / b),
            (_, Some(1.0)) => self,
            _ if self.is_zero() => self,
            _ => Self::push(Operation::Divide(self.slot(), other.slot())),
        }
    }
}

impl Neg for Symbol {
    type Output = Self;
    fn neg(self) -> Self {
        self.constant().map_or_else(|| Self::push(Operation::Negate(self.slot())), |value| Self::of(-value))
    }
}

crate::arithmetic::assign_by_operators!([] Symbol);
