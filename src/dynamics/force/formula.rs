//! Laws of a scene that are formulas of time and state: recorded like forces from outside.
//!
//! A formula with corners (`abs`, `sign`, `min`, `max`, `if`) is recorded on the branches that its conditions
//! choose, the *modes*; a run that meets a zero of a condition ends its step there and records the laws anew
//! on the other branch, so that no method ever steps across a corner.

mod binding;
mod dependence;
mod there;

use super::law::ForceLaw;
use crate::arithmetic::Scalar;
use crate::arithmetic::scratch::with_copies;
use crate::arithmetic::tape::Symbol;
use crate::dynamics::constraint::{Aim, Site};
use crate::dynamics::{CompileError, Configuration};
use crate::scene::formula::{Formula, Numbers, Origin};
use crate::scene::{Decimal, Direction, Meaning};
use std::sync::Arc;

/// From the first point to the second: the vector and its length.
pub(super) fn span<S: Scalar, C>(at: &Configuration<S, C>, [a, b]: &[Site<C>; 2]) -> ([S; 2], S) {
    let [from, to] = [at.position(a), at.position(b)];
    let vector = [to[0] - from[0], to[1] - from[1]];
    (vector, (vector[0] * vector[0] + vector[1] * vector[1]).sqrt())
}

impl<C: Copy> Meaning<Site<C>> {
    pub(in crate::dynamics) fn value<S: Scalar>(
        &self,
        at: &Configuration<S, C>,
        parameters: &[C],
        signals: &[S],
    ) -> S {
        match self {
            Self::Time => at.time(),
            Self::Parameter(number) => at.constant(parameters[*number]),
            Self::Signal(number) => signals[*number],
            Self::Angle(body) => at.angle(*body),
            Self::Rate(body) => at.rate(*body),
            Self::Cosine(body) => at.direction(*body)[0],
            Self::Sine(body) => at.direction(*body)[1],
            Self::X(site) => at.position(site)[0],
            Self::Y(site) => at.position(site)[1],
            Self::XRate(site) => at.velocity(site)[0],
            Self::YRate(site) => at.velocity(site)[1],
            Self::Length(sites) => span(at, sites).1,
            Self::LengthRate(sites) => {
                let (vector, length) = span(at, sites);
                let [from, to] = sites.each_ref().map(|site| at.velocity(site));
                (vector[0] * (to[0] - from[0]) + vector[1] * (to[1] - from[1])) / length
            }
            Self::RelativeAngle(body, base) => base.iter().fold(at.angle(*body), |a, &b| a - at.angle(b)),
            Self::RelativeRate(body, base) => base.iter().fold(at.rate(*body), |a, &b| a - at.rate(b)),
        }
    }
}

/// A formula that can be evaluated on a mechanism.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Expression<C = f64> {
    pub formula: Formula,
    pub meanings: Vec<Meaning<Site<C>>>,
    /// Its numbers, where they may be no doubles.
    pub(super) numbers: Option<Box<Numbers<C>>>,
    /// The number of its first condition among all.
    first: usize,
}

impl<C: Decimal> Expression<C> {
    /// Calls `then` with what its names stand for.
    pub fn with_values<S: Scalar, R>(
        &self,
        at: &Configuration<S, C>,
        parameters: &[C],
        signals: &[S],
        then: impl FnOnce(&[S]) -> R,
    ) -> R {
        with_copies(S::ZERO, self.meanings.len(), |values| {
            for (value, meaning) in values.iter_mut().zip(&self.meanings) {
                *value = meaning.value(at, parameters, signals);
            }
            then(values)
        })
    }

    /// Its value on the branches that `modes` say.
    pub fn evaluated<S: Scalar>(
        &self,
        at: &Configuration<S, C>,
        parameters: &[C],
        signals: &[S],
        modes: &[bool],
    ) -> S {
        let modes = self.modes(modes);
        self.with_values(at, parameters, signals, |values| match &self.numbers {
            None => self.formula.evaluate(values, modes),
            Some(numbers) => {
                self.formula.evaluate_over(values, modes, |origin| at.constant(numbers.at(origin)))
            }
        })
    }

    /// Adds the values of its conditions on those branches.
    fn conditions<S: Scalar>(
        &self,
        at: &Configuration<S, C>,
        parameters: &[C],
        signals: &[S],
        modes: &[bool],
        all: &mut Vec<S>,
    ) {
        let modes = self.modes(modes);
        let number = |origin: Origin, value: f64| match &self.numbers {
            Some(numbers) => at.constant(numbers.at(origin)),
            None => S::of(value),
        };
        self.with_values(at, parameters, signals, |values| {
            self.formula.condition_values_over(values, modes, &number, all);
        });
    }

    /// Its value on those branches where `value` says what its names stand for; `None` where it does not.
    pub fn over<S: Scalar>(
        &self,
        modes: &[bool],
        value: impl Fn(&Meaning<Site<C>>) -> Option<S>,
    ) -> Option<S> {
        let values: Option<Vec<S>> = self.meanings.iter().map(value).collect();
        Some(self.formula.evaluate(&values?, self.modes(modes)))
    }

    pub fn modes<'a>(&self, modes: &'a [bool]) -> &'a [bool] {
        modes.get(self.first..self.first + self.formula.conditions()).unwrap_or(&[])
    }
}

/// An event of a scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FormulaEvent<C = f64> {
    /// Name.
    pub name: String,
    pub(super) when: Expression<C>,
    /// Which zeros count.
    pub direction: Direction,
    /// True where the run ends there.
    pub stop: bool,
    /// Parts that act from then on.
    pub on: Vec<String>,
    /// Parts that act no longer.
    pub off: Vec<String>,
    pub(super) set: Vec<(usize, Expression<C>)>,
}

impl<C> FormulaEvent<C> {
    /// True where other parts, or numbers, act from then on.
    #[cfg(feature = "fit")]
    pub fn changes_what_acts(&self) -> bool {
        !self.on.is_empty() || !self.off.is_empty() || !self.set.is_empty()
    }

    /// The parameters it sets, by number.
    pub fn parameters(&self) -> impl Iterator<Item = usize> {
        self.set.iter().map(|(number, _)| *number)
    }
}

/// A part that moves by a law of time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DrivenPart {
    /// Its name.
    pub name: String,
    /// True for a wall, false for a motor.
    pub is_wall: bool,
}

/// An aim and what has it.
pub(crate) type PlacedAim<'a, C> = (&'a DrivenPart, Arc<Aim<C>>);

/// An aim with what has it and the angles it is of.
type AngleAim<C> = (DrivenPart, Vec<usize>, Expression<C>);

/// All formulas of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Formulas<C = f64> {
    /// Values of the parameters at the start.
    pub parameters: Vec<C>,
    pub(super) signals: Vec<Expression<C>>,
    pub(super) laws: Vec<ForceLaw<C>>,
    /// Laws of motors and walls that are formulas.
    pub(super) profiles: Vec<(DrivenPart, Expression<C>)>,
    /// Aims of motors and walls that depend on the mechanism, with the angles they are of.
    aims: Vec<AngleAim<C>>,
    /// Events.
    pub events: Vec<FormulaEvent<C>>,
    /// What each condition is part of, for messages.
    pub conditions: Vec<String>,
}

impl<C: Decimal> Formulas<C> {
    /// Calls `then` with the signals on the branches that `modes` say.
    pub(super) fn with_signals<S: Scalar, R>(
        &self,
        at: &Configuration<S, C>,
        parameters: &[C],
        modes: &[bool],
        then: impl FnOnce(&[S]) -> R,
    ) -> R {
        self.with_signals_by(|signal, known| signal.evaluated(at, parameters, known, modes), then)
    }

    /// The same where `value` finds a signal from those before it.
    fn with_signals_by<S: Scalar, R>(
        &self,
        value: impl Fn(&Expression<C>, &[S]) -> S,
        then: impl FnOnce(&[S]) -> R,
    ) -> R {
        with_copies(S::ZERO, self.signals.len(), |signals| {
            for (number, signal) in self.signals.iter().enumerate() {
                signals[number] = value(signal, &signals[..number]);
            }
            then(signals)
        })
    }

    /// The values of all conditions, on the branches that `modes` say.
    pub fn condition_values<S: Scalar>(
        &self,
        at: &Configuration<S, C>,
        parameters: &[C],
        modes: &[bool],
    ) -> Vec<S> {
        let mut all = Vec::with_capacity(self.conditions.len());
        self.append_condition_values(at, parameters, modes, &mut all);
        all
    }

    /// Appends them.
    pub fn append_condition_values<S: Scalar>(
        &self,
        at: &Configuration<S, C>,
        parameters: &[C],
        modes: &[bool],
        all: &mut Vec<S>,
    ) {
        if self.conditions.is_empty() {
            return;
        }
        self.with_signals(at, parameters, modes, |signals| {
            for expression in self.switched().filter(|expression| expression.formula.conditions() > 0) {
                expression.conditions(at, parameters, signals, modes, all);
            }
        });
    }

    /// The aims of motors and walls that depend on the mechanism, on the branches that `modes` say.
    ///
    /// # Errors
    /// One that depends on rates.
    pub fn aims(&self, parameters: &[C], modes: &[bool]) -> Result<Vec<PlacedAim<'_, C>>, CompileError> {
        let aim = |(part, angles, expression): &'_ AngleAim<C>| {
            let formula = |at: &Configuration<Symbol, C>| {
                self.with_signals(at, parameters, modes, |signals| {
                    expression.evaluated(at, parameters, signals, modes)
                })
            };
            Aim::record(angles, formula)
                .map(Arc::new)
                .ok_or_else(|| CompileError::Unsound(format!("law of {}: it depends on rates", part.name)))
        };
        self.aims.iter().map(|of| Ok((&of.0, aim(of)?))).collect()
    }

    /// The formulas that act: of forces, motors, walls.
    fn acting(&self) -> impl Iterator<Item = &Expression<C>> {
        let laws = self.laws.iter().flat_map(ForceLaw::expressions);
        let profiles = self.profiles.iter().map(|profile| &profile.1);
        laws.chain(profiles).chain(self.aims.iter().map(|aim| &aim.2))
    }

    /// Every formula whose conditions count, in the order in which they are numbered.
    fn switched(&self) -> impl Iterator<Item = &Expression<C>> {
        let laws = self.signals.iter().chain(self.acting());
        laws.chain(self.events.iter().filter(|_| C::HAS_CONSTANTS).map(|event| &event.when))
    }
}
