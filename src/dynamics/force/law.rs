//! A law of a scene as it is recorded: on the branches of some modes, with some parameters.

use super::formula::{Acts, Expression, Formulas, Law, span};
use super::{Loads, UserForce};
use crate::arithmetic::Scalar;
use crate::arithmetic::tape::Symbol;
use crate::dynamics::{CompileError, Configuration};
use crate::scene::Decimal;

/// A law on the branches of some modes, as it is recorded.
pub(super) struct Recorded<'a, C> {
    pub law: &'a Law<C>,
    pub formulas: &'a Formulas<C>,
    pub parameters: &'a [C],
    pub modes: &'a [bool],
}

impl<C: Decimal> Recorded<'_, C> {
    /// Records it.
    ///
    /// # Errors
    /// A potential that depends on time or rates.
    pub fn record(&self) -> Result<UserForce<C>, CompileError> {
        UserForce::recorded(&self.law.name, |at| self.potential(at), |at, loads| self.apply(at, loads))
    }

    fn signals(&self, at: &Configuration<Symbol, C>) -> Vec<Symbol> {
        self.formulas.signals(at, self.parameters, self.modes)
    }

    fn evaluate(
        &self,
        expression: &Expression<C>,
        at: &Configuration<Symbol, C>,
        signals: &[Symbol],
    ) -> Symbol {
        expression.evaluated(at, self.parameters, signals, self.modes)
    }

    fn potential(&self, at: &Configuration<Symbol, C>) -> Symbol {
        let Some(potential) = &self.law.potential else { return Symbol::ZERO };
        self.evaluate(potential, at, &self.signals(at))
    }

    fn apply(&self, at: &Configuration<Symbol, C>, loads: &mut Loads<Symbol, C>) {
        if self.law.place == Acts::Nowhere {
            return;
        }
        let signals = self.signals(at);
        let of = |expression: &Expression<C>| self.evaluate(expression, at, &signals);
        match &self.law.place {
            Acts::Point { site, follows, force } => {
                let [x, y] = force.each_ref().map(of);
                match site.body.filter(|_| *follows) {
                    Some(body) => {
                        let [c, s] = at.direction(body);
                        loads.force(site, [c * x - s * y, s * x + c * y]);
                    }
                    None => loads.force(site, [x, y]),
                }
            }
            Acts::Torque { body, base, torque } => {
                let torque = of(torque);
                loads.torque(*body, torque);
                if let Some(base) = base {
                    loads.torque(*base, -torque);
                }
            }
            Acts::Span { sites, tension } => {
                let (vector, length) = span(at, sites);
                let pull = of(tension) / length;
                let force = [vector[0] * pull, vector[1] * pull];
                loads.force(&sites[0], force);
                loads.force(&sites[1], [-force[0], -force[1]]);
            }
            Acts::Nowhere => {}
        }
    }
}
