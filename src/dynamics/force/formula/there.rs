//! Formulas in doubles on the branches that hold at a configuration, by the signs of their conditions there:
//! functions of events, what events set, and which branches a motion is on.

use super::{Expression, Formulas};
use crate::dynamics::Configuration;

impl Expression {
    /// Its value on the branches that hold at a configuration.
    fn there(&self, at: &Configuration<f64>, parameters: &[f64], signals: &[f64]) -> f64 {
        self.with_values(at, parameters, signals, |values| self.formula.value(values))
    }
}

impl Formulas {
    /// The modes at a configuration, by the signs of the conditions there.
    pub fn modes(&self, at: &Configuration<f64>, parameters: &[f64]) -> Vec<bool> {
        let mut modes = Vec::with_capacity(self.conditions.len());
        if self.conditions.is_empty() {
            return modes;
        }
        self.with_signals_there(at, parameters, |signals| {
            for expression in self.switched().filter(|expression| expression.formula.conditions() > 0) {
                let of = |values: &[f64]| expression.formula.modes(values);
                modes.extend(expression.with_values(at, parameters, signals, of));
            }
        });
        modes
    }

    /// Which conditions are zero at a configuration, on these branches.
    pub fn zeros(&self, at: &Configuration<f64>, parameters: &[f64], modes: &[bool]) -> Vec<bool> {
        let (mut values, mut modes) = (Vec::with_capacity(modes.len()), modes);
        self.with_signals_there(at, parameters, |signals| {
            for expression in self.switched().filter(|expression| expression.formula.conditions() > 0) {
                let (own, rest) = modes.split_at(expression.formula.conditions().min(modes.len()));
                modes = rest;
                expression.with_values(at, parameters, signals, |sources| {
                    expression.formula.condition_values(sources, own, &mut values);
                });
            }
        });
        values.into_iter().map(|value: f64| value == 0.0).collect()
    }

    /// Calls `then` with the signals on the branches that hold at a configuration.
    fn with_signals_there<R>(
        &self,
        at: &Configuration<f64>,
        parameters: &[f64],
        then: impl FnOnce(&[f64]) -> R,
    ) -> R {
        self.with_signals_by(|signal, known| signal.there(at, parameters, known), then)
    }

    /// The value of every formula of a force, torque, spring, motor or wall, with the name of its part.
    pub fn values_by_part(&self, at: &Configuration<f64>, parameters: &[f64]) -> Vec<(&str, f64)> {
        self.with_signals_there(at, parameters, |signals| {
            let value = |(name, one): (_, &Expression)| (name, one.there(at, parameters, signals));
            self.by_part().map(value).collect()
        })
    }

    /// Appends the functions of all events.
    pub fn append_event_values(&self, at: &Configuration<f64>, parameters: &[f64], all: &mut Vec<f64>) {
        self.with_signals_there(at, parameters, |signals| {
            all.extend(self.events.iter().map(|event| event.when.there(at, parameters, signals)));
        });
    }

    /// The function of event number `event`.
    pub fn event_value(&self, event: usize, at: &Configuration<f64>, parameters: &[f64]) -> f64 {
        self.with_signals_there(at, parameters, |signals| {
            self.events[event].when.there(at, parameters, signals)
        })
    }

    /// The parameters after an event.
    pub fn set_by(&self, event: usize, at: &Configuration<f64>, parameters: &[f64]) -> Vec<f64> {
        let mut next = parameters.to_vec();
        self.with_signals_there(at, parameters, |signals| {
            for (number, expression) in &self.events[event].set {
                next[*number] = expression.there(at, parameters, signals);
            }
        });
        next
    }

    /// The formulas that have [active arguments](Formula::note_active_arguments).
    fn with_active_arguments(&self) -> impl Iterator<Item = &Expression> {
        let laws = self.signals.iter().chain(self.acting());
        let all = laws.chain(self.events.iter().map(|event| &event.when));
        all.filter(|expression| expression.formula.has_active_arguments())
    }

    /// True where there is one.
    pub fn has_active_arguments(&self) -> bool {
        self.with_active_arguments().next().is_some()
    }

    /// Appends these arguments.
    pub fn append_active_arguments(&self, at: &Configuration<f64>, parameters: &[f64], all: &mut Vec<f64>) {
        if !self.has_active_arguments() {
            return;
        }
        self.with_signals_there(at, parameters, |signals| {
            for expression in self.with_active_arguments() {
                expression.with_values(at, parameters, signals, |values| {
                    expression.formula.append_active_arguments(values, all);
                });
            }
        });
    }
}
