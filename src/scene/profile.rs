//! Laws of motors that are no sum of sines and a parabola: any formula of time, recorded with its first two
//! derivatives.
//!
//! A formula with corners, or with tables, is recorded on the branches that hold at one time; a run that
//! meets a zero of one of its conditions records it anew, as it does with laws of forces.

use super::formula::{Formula, Numbers};
use super::number::Decimal;
use crate::arithmetic::tape::{Slot, Symbol, Tape, TapeSeries, number_of};
use crate::arithmetic::{DoubleDouble, Over, Real, Scalar};
use std::cell::RefCell;
use std::sync::Arc;

/// Times at which the pace of a law is looked at, an eighth of a second apart.
const LOOKS: usize = 65;

/// A formula of time, on the branches of one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile<C = f64> {
    text: String,
    tape: Arc<Tape>,
    /// The law and its first two derivatives.
    results: [Slot; 3],
    /// Numbers that may be no doubles: inputs of the tape, after the time.
    numbers: Vec<C>,
    /// The largest rate and acceleration in the first seconds, roughly \[u/s, u/s²\].
    peaks: [f64; 2],
}

impl<C: Decimal> Profile<C> {
    /// The law of a formula on the branches that hold at t = 0; `numbers` are its own where they may be no
    /// doubles, `values` those of its names, `None` for t.
    pub(crate) fn new(formula: &Formula, numbers: Option<&Numbers<C>>, values: &[Option<C>]) -> Self {
        let modes = formula.modes(&at(values, 0.0));
        Self::on_branch(formula, numbers, values, &modes)
    }

    /// The same on the branches where the conditions whose `modes` are set are positive.
    pub(crate) fn on_branch(
        formula: &Formula,
        numbers: Option<&Numbers<C>>,
        values: &[Option<C>],
        modes: &[bool],
    ) -> Self {
        let law = Self::recorded(formula, numbers, values, modes);
        let looks: Vec<f64> = (0..LOOKS).map(|look| formula.value(&at(values, look as f64 / 8.0))).collect();
        let most = |values: &mut dyn Iterator<Item = f64>| {
            values.map(f64::abs).filter(|value| value.is_finite()).fold(0.0, f64::max)
        };
        let peaks = [
            8.0 * most(&mut looks.windows(2).map(|pair| pair[1] - pair[0])),
            64.0 * most(&mut looks.windows(3).map(|three| three[0] - 2.0 * three[1] + three[2])),
        ];
        Self { peaks, ..law }
    }
}

/// The names of a formula in doubles at a time.
fn at<C: Decimal>(values: &[Option<C>], t: f64) -> Vec<f64> {
    values.iter().map(|value| value.map_or(t, |value| value.value())).collect()
}

impl Profile {
    /// Powers 0 … `order` of the law about a time \[u/s^m\].
    pub fn series<T: Real>(&self, t: DoubleDouble, order: usize) -> Vec<T> {
        let mut series = TapeSeries::<T>::new(&self.tape, order);
        for m in 0..=order {
            let power = match m {
                0 => T::split(t).0,
                1 => T::ONE,
                _ => T::ZERO,
            };
            series.advance(&self.tape, m, &|_| power);
        }
        series.of(self.results[0]).to_vec()
    }
}

impl<C> Profile<C> {
    /// The same formula with other numbers.
    pub(crate) fn map_numbers<D>(&self, of: impl FnMut(&C) -> D) -> Profile<D> {
        Profile {
            text: self.text.clone(),
            tape: Arc::clone(&self.tape),
            results: self.results,
            numbers: self.numbers.iter().map(of).collect(),
            peaks: self.peaks,
        }
    }

    /// True where time is in it, on its branches.
    pub fn depends_on_time(&self) -> bool {
        self.tape.inputs().any(|input| input == 0)
    }

    /// Its formula.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The largest rate and acceleration in the first eight seconds, as seen at 65 times \[u/s, u/s²\].
    pub fn peaks(&self) -> [f64; 2] {
        self.peaks
    }
}

impl<C: Decimal> Profile<C> {
    /// The law on these branches, without its peaks.
    fn recorded(
        formula: &Formula,
        numbers: Option<&Numbers<C>>,
        values: &[Option<C>],
        modes: &[bool],
    ) -> Self {
        let inputs = RefCell::new(Vec::new());
        let constant = |value: C| match C::HAS_CONSTANTS {
            // The tape folds constants in doubles.
            true => Symbol::input(1 + number_of(&inputs, &value) as u32),
            false => Symbol::of(value.value()),
        };
        let [(tape, results)] = Symbol::record(|| {
            let slope = |of: Symbol| {
                of.gradient().iter().find(|part| part.0 == 0).map_or(Symbol::ZERO, |part| part.1)
            };
            let t = Symbol::input(0);
            let values: Vec<Symbol> = values.iter().map(|value| value.map_or(t, constant)).collect();
            let law = match numbers {
                Some(numbers) => formula.evaluate_over(&values, modes, |origin| constant(numbers.at(origin))),
                None => formula.evaluate(&values, modes),
            };
            let rate = slope(law);
            [vec![law, rate, slope(rate)]]
        });
        Self {
            text: formula.text().to_owned(),
            tape: Arc::new(tape),
            results: [results[0], results[1], results[2]],
            numbers: inputs.into_inner(),
            peaks: [0.0; 2],
        }
    }

    /// The law and its first two derivatives at a time \[u, u/s, u/s²\].
    pub fn at<S: Over<C>>(&self, t: S) -> [S; 3] {
        let input = |number: u32| match number.checked_sub(1) {
            None => t,
            Some(number) => S::constant(self.numbers[number as usize]),
        };
        self.tape.results(input, |slots| self.results.map(|result| slots[result as usize]))
    }

    /// Its tape, the number of the law on it, and the numbers that are its inputs after the time.
    pub(crate) fn parts(&self) -> (&Tape, Slot, &[C]) {
        (&self.tape, self.results[0], &self.numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_and_series_are_those_of_the_formula() {
        let formula = Formula::parse("a*tanh(2*t) + exp(-t)*sin(3*t^2)").expect("a formula");
        let values: Vec<Option<f64>> = formula.names().map(|name| (name == "a").then_some(1.5)).collect();
        let profile = Profile::new(&formula, None, &values);
        let (t, h) = (0.7_f64, 1e-4);
        let exact = |t: f64| 1.5 * (2.0 * t).tanh() + (-t).exp() * (3.0 * t * t).sin();
        let [value, rate, acceleration] = profile.at(t);
        assert!((value - exact(t)).abs() < 1e-15);
        assert!((rate - (exact(t + h) - exact(t - h)) / (2.0 * h)).abs() < 1e-6);
        assert!((acceleration - (exact(t + h) - 2.0 * exact(t) + exact(t - h)) / (h * h)).abs() < 1e-5);
        let powers = profile.series::<f64>(DoubleDouble::of(t), 30);
        let sum = powers.iter().rev().fold(0.0, |sum, power| sum * 0.1 + power);
        assert!((sum - exact(t + 0.1)).abs() < 1e-14, "{sum} {}", exact(t + 0.1));
        assert!((powers[1] - rate).abs() < 1e-13 && (2.0 * powers[2] - acceleration).abs() < 1e-12);
        let far = profile.at(DoubleDouble::of(0.7))[0];
        assert!((far.hi - exact(0.7)).abs() < 1e-15);
    }

    #[test]
    fn corners_are_recorded_on_the_branch_of_the_start() {
        let formula = Formula::parse("if(t < 2, t^3, 8 + 12*(t - 2))").expect("a formula");
        let profile = Profile::new(&formula, None, &[None]);
        assert_eq!(profile.at(3.0), [27.0, 27.0, 18.0]);
        let late = Profile::on_branch(&formula, None, &[None], &formula.modes(&[3.0]));
        assert_eq!(late.at(3.0), [20.0, 12.0, 0.0]);
    }
}
