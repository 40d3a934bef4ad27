//! The arguments of `exp`, `tanh` and powers in the formulas of a scene, laws, events and outputs, at a
//! motion.

use super::{OutputExpression, Outputs};
use crate::dynamics::compile::Laws;
use crate::dynamics::configuration::Configuration;
use crate::dynamics::{Mechanism, Motion};
use crate::scene::formula::Formula;
use crate::scene::{Meaning, Source};

/// Notes those of an output whose names stand for these; not of one made of what parts carry.
pub(super) fn note<P>(formula: &mut Formula, sources: &[Source<P>]) {
    if sources.iter().all(|source| matches!(source, Source::State(_))) {
        formula.note_active_arguments(|name| matches!(sources[name], Source::State(Meaning::Parameter(_))));
    }
}

impl Outputs {
    fn with_active_arguments(&self) -> impl Iterator<Item = &OutputExpression> {
        let all = self.list.iter().map(|output| &output.expression);
        all.filter(|expression| expression.formula.has_active_arguments())
    }

    /// Appends those of outputs, which signals have as well.
    fn append_active_arguments(&self, at: &Configuration<f64>, parameters: &[f64], all: &mut Vec<f64>) {
        let value = |expression: &OutputExpression, signals: &[f64], sources: &mut Vec<f64>| {
            sources.clear();
            sources.extend(expression.sources.iter().map(|source| match source {
                Source::State(meaning) => meaning.value(at, parameters, signals),
                Source::Carried(_) => f64::NAN,
            }));
        };
        let (mut signals, mut sources) = (Vec::new(), Vec::new());
        for signal in &self.signals {
            value(signal, &signals, &mut sources);
            if signal.formula.has_active_arguments() {
                signal.formula.append_active_arguments(&sources, all);
            }
            signals.push(signal.formula.value(&sources));
        }
        for output in self.with_active_arguments() {
            value(output, &signals, &mut sources);
            output.formula.append_active_arguments(&sources, all);
        }
    }
}

impl Mechanism {
    /// True where its laws, events or outputs have [active arguments](Formula::note_active_arguments).
    pub(crate) fn has_active_arguments(&self) -> bool {
        let of_signals =
            |outputs: &Outputs| outputs.signals.iter().any(|signal| signal.formula.has_active_arguments());
        self.laws.as_ref().is_some_and(|laws| laws.formulas.has_active_arguments())
            || self.outputs.as_ref().is_some_and(|outputs| {
                of_signals(outputs) || outputs.with_active_arguments().next().is_some()
            })
    }

    /// Appends these arguments at a motion.
    pub(crate) fn append_active_arguments(&self, motion: &Motion, all: &mut Vec<f64>) {
        self.seen(motion, |at| {
            if let Some(Laws { formulas, parameters, .. }) = &self.laws {
                formulas.append_active_arguments(at, parameters, all);
            }
            if let Some(outputs) = &self.outputs {
                let parameters = self.laws.as_ref().map_or(&outputs.parameters, |laws| &laws.parameters);
                outputs.append_active_arguments(at, parameters, all);
            }
        });
    }
}
