//! A law of a scene as it is recorded: on the branches of some modes, with some parameters.

use super::formula::{DrivenPart, Expression, FormulaEvent, Formulas, span};
use super::span::SpanLaw;
use super::{Loads, UserForce};
use crate::arithmetic::Scalar;
use crate::arithmetic::tape::Symbol;
use crate::dynamics::constraint::Site;
use crate::dynamics::{CompileError, Configuration};
use crate::scene::{Decimal, Meaning, Profile};

/// Where a law acts.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Acts<C = f64> {
    Point {
        site: Site<C>,
        follows: bool,
        force: Box<[Expression<C>; 2]>,
    },
    Torque {
        body: usize,
        base: Option<usize>,
        torque: Expression<C>,
    },
    /// A spring; what of its tension has no potential.
    Span {
        sites: [Site<C>; 2],
        tension: Option<Expression<C>>,
    },
    Nowhere,
}

impl<C: PartialEq> Acts<C> {
    /// True where it is more than the place of a potential.
    pub fn applies(&self) -> bool {
        !matches!(self, Self::Nowhere | Self::Span { tension: None, .. })
    }
}

/// One law.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ForceLaw<C = f64> {
    pub name: String,
    pub potential: Option<Expression<C>>,
    pub place: Acts<C>,
}

impl<C> ForceLaw<C> {
    /// Its formulas in the order in which they were bound.
    pub fn expressions(&self) -> impl Iterator<Item = &Expression<C>> {
        let acting: Vec<&Expression<C>> = match &self.place {
            Acts::Point { force, .. } => force.iter().collect(),
            Acts::Torque { torque, .. } => vec![torque],
            Acts::Span { tension, .. } => tension.iter().collect(),
            Acts::Nowhere => Vec::new(),
        };
        self.potential.iter().chain(acting)
    }
}

/// A law on the branches of some modes, as it is recorded.
pub(super) struct LawOnBranches<'a, C> {
    pub law: &'a ForceLaw<C>,
    pub formulas: &'a Formulas<C>,
    pub parameters: &'a [C],
    pub modes: &'a [bool],
}

impl<C: Decimal> Formulas<C> {
    /// How many forces it records.
    pub fn force_count(&self) -> usize {
        self.laws.len()
    }

    /// Records its laws on the branches that `modes` say.
    ///
    /// # Errors
    /// A potential that depends on time or rates.
    pub fn record(&self, parameters: &[C], modes: &[bool]) -> Result<Vec<UserForce<C>>, CompileError> {
        let record = |law| LawOnBranches { law, formulas: self, parameters, modes }.record();
        self.laws.iter().map(record).collect()
    }

    /// The laws of motors and walls on the same branches.
    pub fn profiles(
        &self,
        parameters: &[C],
        modes: &[bool],
    ) -> impl Iterator<Item = (&DrivenPart, Profile<C>)> {
        self.profiles.iter().map(move |(part, expression)| {
            let value = |meaning: &Meaning<Site<C>>| match meaning {
                Meaning::Parameter(number) => Some(parameters[*number]),
                _ => None,
            };
            let values: Vec<Option<C>> = expression.meanings.iter().map(value).collect();
            (part, {
                let Expression { formula, numbers, .. } = expression;
                Profile::on_branch(formula, numbers.as_deref(), &values, expression.modes(modes))
            })
        })
    }

    /// Records the functions of its events on the branches that `modes` say: each as a torque on the first
    /// body.
    ///
    /// # Errors
    /// None: they are no potentials.
    pub fn record_events(&self, parameters: &[C], modes: &[bool]) -> Result<Vec<UserForce<C>>, CompileError> {
        let record = |event: &FormulaEvent<C>| {
            let place = Acts::Torque { body: 0, base: None, torque: event.when.clone() };
            let law = ForceLaw { name: event.name.clone(), potential: None, place };
            LawOnBranches { law: &law, formulas: self, parameters, modes }.record()
        };
        self.events.iter().map(record).collect()
    }

    /// Records its conditions on the branches that `modes` say: each as a torque on the first body.
    ///
    /// # Errors
    /// None: they are no potentials.
    pub fn record_conditions(
        &self,
        parameters: &[C],
        modes: &[bool],
    ) -> Result<Vec<UserForce<C>>, CompileError> {
        let record = |(number, owner): (usize, &String)| {
            UserForce::recorded(
                owner,
                |_| Symbol::ZERO,
                |at, loads| loads.torque(0, self.condition_values(at, parameters, modes)[number]),
            )
        };
        self.conditions.iter().enumerate().map(record).collect()
    }
}

#[cfg(feature = "digits")]
impl<C: Decimal + crate::arithmetic::Over<C>> Formulas<C> {
    /// The parameters after an event, all numbers as they are written.
    pub fn set_exactly_by(
        &self,
        event: usize,
        at: &Configuration<C, C>,
        parameters: &[C],
        modes: &[bool],
    ) -> Vec<C> {
        let mut next = parameters.to_vec();
        self.with_signals(at, parameters, modes, |signals| {
            for (number, expression) in &self.events[event].set {
                let of = |values: &[C]| expression.formula.exact_value(values);
                next[*number] = expression.with_values(at, parameters, signals, of);
            }
        });
        next
    }
}

impl<C: Decimal> LawOnBranches<'_, C> {
    /// Records it.
    ///
    /// # Errors
    /// A potential that depends on time or rates.
    pub fn record(&self) -> Result<UserForce<C>, CompileError> {
        let force =
            UserForce::recorded(&self.law.name, |at| self.potential(at), |at, loads| self.apply(at, loads))?;
        Ok(match self.span() {
            // What it divides by the length for is no more flat than a built-in spring is.
            Some(span) => UserForce {
                needs_confirmation: span.tape.needs_confirmation(),
                span: Some(Box::new(span)),
                ..force
            },
            None => force,
        })
    }

    /// The law of a spring whose formulas ask for nothing but its length, its rate and time.
    fn span(&self) -> Option<SpanLaw<C>> {
        let Acts::Span { sites, tension } = &self.law.place else { return None };
        if C::HAS_CONSTANTS {
            return None;
        }
        let of = |expression: &Option<Expression<C>>, inputs: [Symbol; 3]| match expression {
            Some(expression) => self.along(sites, expression, inputs, &self.signals_along(sites, inputs)),
            None => Some(Symbol::ZERO),
        };
        let span = sites[0].point.minus(&sites[1].point);
        SpanLaw::record(span, |inputs| of(&self.law.potential, inputs), |inputs| of(tension, inputs))
    }

    /// A formula of the length of a spring, its rate and time, where it is one.
    fn along(
        &self,
        sites: &[Site<C>; 2],
        expression: &Expression<C>,
        [length, rate, time]: [Symbol; 3],
        signals: &[Option<Symbol>],
    ) -> Option<Symbol> {
        expression.over(self.modes, |meaning| match meaning {
            Meaning::Time => Some(time),
            Meaning::Parameter(number) => Some(Symbol::of(self.parameters[*number].value())),
            Meaning::Signal(number) => signals[*number],
            Meaning::Length(of) if of == sites => Some(length),
            Meaning::LengthRate(of) if of == sites => Some(rate),
            _ => None,
        })
    }

    /// The signals that are such formulas.
    fn signals_along(&self, sites: &[Site<C>; 2], inputs: [Symbol; 3]) -> Vec<Option<Symbol>> {
        let mut signals = Vec::with_capacity(self.formulas.signals.len());
        for signal in &self.formulas.signals {
            signals.push(self.along(sites, signal, inputs, &signals));
        }
        signals
    }

    fn signals(&self, at: &Configuration<Symbol, C>) -> Vec<Symbol> {
        self.formulas.with_signals(at, self.parameters, self.modes, |signals| signals.to_vec())
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
        if !self.law.place.applies() {
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
            Acts::Span { sites, tension: Some(tension) } => {
                let (vector, length) = span(at, sites);
                let pull = of(tension) / length;
                let force = [vector[0] * pull, vector[1] * pull];
                loads.force(&sites[0], force);
                loads.force(&sites[1], [-force[0], -force[1]]);
            }
            Acts::Span { tension: None, .. } | Acts::Nowhere => {}
        }
    }
}
