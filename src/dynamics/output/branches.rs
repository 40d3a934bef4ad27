//! Outputs on given branches of their formulas, and the conditions by which these hold.

use super::{Moment, OutputScratch, Outputs};
use crate::dynamics::constraint::Site;
use crate::scene::formula::{Formula, Pole};
use crate::scene::{Meaning, Source};

/// A formula with what its names stand for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OutputExpression {
    pub formula: Formula,
    pub sources: Vec<Source<Site>>,
    /// Where it has poles, or ends: what is zero there are conditions too.
    poles: Vec<Pole>,
}

impl OutputExpression {
    pub fn new(formula: Formula, sources: Vec<Source<Site>>) -> Self {
        let is_fixed = |source: &Source<Site>| matches!(source, Source::State(Meaning::Parameter(_)));
        let poles = formula.poles(|name| sources.get(name).is_some_and(|source| !is_fixed(source)));
        Self { formula, sources, poles }
    }

    fn conditions(&self) -> usize {
        self.formula.conditions() + self.poles.len()
    }
}

impl Outputs {
    /// How many conditions choose the branches of their formulas and of the signals', with what is zero at
    /// poles.
    pub fn condition_count(&self) -> usize {
        let all = self.list.iter().map(|output| &output.expression).chain(&self.signals);
        all.map(OutputExpression::conditions).sum()
    }

    /// Which of the conditions are zero at poles.
    pub fn are_poles(&self) -> Vec<bool> {
        let all = self.signals.iter().chain(self.list.iter().map(|output| &output.expression));
        let of = |expression: &OutputExpression| {
            let conditions = expression.formula.conditions();
            (0..expression.conditions()).map(move |k| k >= conditions)
        };
        all.flat_map(of).collect()
    }

    /// Appends their values at a moment on these branches; on those that hold there if none are given.
    pub fn evaluate(
        &self,
        at: &Moment,
        scratch: &mut OutputScratch,
        branches: &[bool],
        values: &mut Vec<f64>,
    ) {
        let mut branches = branches;
        self.visit(at, scratch, values, |expression, sources| match branches.is_empty() {
            true => expression.formula.value(sources),
            false => expression.formula.evaluate(sources, next(&mut branches, expression)),
        });
    }

    /// Their values at a moment on these branches, where the condition of this number, which is that of a
    /// pole, is this zero, of either sign.
    pub fn at_pole(
        &self,
        at: &Moment,
        scratch: &mut OutputScratch,
        branches: &[bool],
        (condition, zero): (usize, f64),
    ) -> Vec<f64> {
        let (mut branches, mut first, mut values) = (branches, 0, Vec::new());
        self.visit(at, scratch, &mut values, |expression, sources| {
            let own = next(&mut branches, expression);
            let pole = condition.checked_sub(first + expression.formula.conditions());
            first += expression.conditions();
            match pole.and_then(|pole| expression.poles.get(pole)) {
                Some(&pole) => expression.formula.value_at_pole(sources, own, pole, zero),
                None => expression.formula.evaluate(sources, own),
            }
        });
        values
    }

    /// The branches that hold at a moment, where these conditions are zero, whatever rounding makes of them.
    pub fn branches(&self, at: &Moment, scratch: &mut OutputScratch, zeros: &[bool]) -> Vec<bool> {
        let (mut zeros, mut found, mut beside) = (zeros, Vec::new(), Vec::new());
        self.visit(at, scratch, &mut Vec::new(), |expression, sources| {
            let OutputExpression { formula, poles, .. } = expression;
            let zeros = next(&mut zeros, expression);
            let own = formula.modes_beside_zeros(sources, zeros);
            let value = formula.evaluate(sources, &own);
            beside.clear();
            formula.pole_values(sources, &own, poles, &mut beside);
            let is_zero = |k: usize| zeros.get(own.len() + k).is_some_and(|&is_zero| is_zero);
            let signs: Vec<bool> = (0..beside.len()).map(|k| beside[k] > 0.0 && !is_zero(k)).collect();
            found.extend(own.into_iter().chain(signs));
            value
        });
        found
    }

    /// The conditions at a moment on these branches.
    pub fn conditions(&self, at: &Moment, scratch: &mut OutputScratch, branches: &[bool]) -> Vec<f64> {
        let (mut branches, mut found) = (branches, Vec::new());
        self.visit(at, scratch, &mut Vec::new(), |expression, sources| {
            let OutputExpression { formula, poles, .. } = expression;
            let own = next(&mut branches, expression);
            formula.condition_values(sources, own, &mut found);
            formula.pole_values(sources, own, poles, &mut found);
            formula.evaluate(sources, own)
        });
        found
    }
}

/// The branches of an expression, taken off those of it and of all that come after it.
fn next<'a>(branches: &mut &'a [bool], expression: &OutputExpression) -> &'a [bool] {
    let (own, rest) = branches.split_at(expression.conditions().min(branches.len()));
    *branches = rest;
    own
}
