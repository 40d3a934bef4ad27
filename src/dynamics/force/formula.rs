//! Laws of a scene that are formulas of time and state: recorded like forces from outside.
//!
//! A formula with corners (`abs`, `sign`, `min`, `max`, `if`) is recorded on the branches that its conditions
//! choose, the *modes*; a run that meets a zero of a condition ends its step there and records the laws anew
//! on the other branch, so that no method ever steps across a corner.

mod dependence;
mod there;

use super::law::{Acts, ForceLaw};
use crate::arithmetic::Scalar;
use crate::arithmetic::scratch::with_copies;
use crate::arithmetic::tape::Symbol;
use crate::dynamics::constraint::{Aim, Site};
use crate::dynamics::forest::Forest;
use crate::dynamics::{CompileError, Configuration};
use crate::scene::formula::{Formula, Numbers, Origin};
use crate::scene::{
    Bound, Coupled, Coupling, Decimal, Direction, Load, Meaning, Names, Parameter, Place, PointTable, Scene,
    Scope, Wall,
};
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
    aims: Vec<(DrivenPart, Vec<usize>, Expression<C>)>,
    /// Events.
    pub events: Vec<FormulaEvent<C>>,
    /// What each condition is part of, for messages.
    pub conditions: Vec<String>,
}

/// Collects expressions and numbers their conditions.
struct Binder<'a, C> {
    forest: &'a Forest<C>,
    tables: &'a [PointTable<C>],
    /// Parameters above zero that no event sets.
    positive: Vec<bool>,
    conditions: Vec<String>,
}

impl<C: Decimal> Binder<'_, C> {
    fn bind(scope: &Scope<C>, text: &str, owner: &str) -> Result<Bound<C>, CompileError> {
        let unsound = |error| CompileError::Unsound(format!("formula of `{owner}`: {error}"));
        scope.bind(text).map(|(bound, _)| bound).map_err(unsound)
    }

    /// Numbers the conditions of a formula and finds its points.
    fn placed(&mut self, Bound { mut formula, meanings }: Bound<C>, owner: &str) -> Expression<C> {
        let is_positive = |parameter: usize| self.positive.get(parameter) == Some(&true);
        formula.note_exponents(
            |name| matches!(meanings[name], Meaning::Parameter(parameter) if is_positive(parameter)),
        );
        let first = self.conditions.len();
        self.conditions.extend(std::iter::repeat_n(owner.to_owned(), formula.conditions()));
        let site = |place| self.forest.site(&place);
        let meanings = meanings.into_iter().map(|meaning| meaning.with_points(site)).collect();
        let numbers = C::HAS_CONSTANTS.then(|| Box::new(Numbers::of(&formula, self.tables)));
        Expression { formula, meanings, numbers, first }
    }

    fn expression(
        &mut self,
        scope: &Scope<C>,
        text: &str,
        owner: &str,
    ) -> Result<Expression<C>, CompileError> {
        let bound = Self::bind(scope, text, owner)?;
        Ok(self.placed(bound, owner))
    }
}

impl<C: Decimal> Formulas<C> {
    /// Those of a scene; `None` where it has none.
    pub fn of(scene: &Scene<C>, forest: &Forest<C>) -> Result<Option<Self>, CompileError> {
        let motors = (scene.motors.iter().map(|motor| (&motor.name, Some(&motor.law), false)))
            .chain(scene.drives.iter().map(|drive| (&drive.name, Some(&drive.law), false)))
            .chain(scene.walls.iter().map(|wall| (&wall.name, wall.law.as_ref(), true)));
        let driven: Vec<_> = motors
            .filter_map(|(name, law, is_wall)| {
                Some((DrivenPart { name: name.clone(), is_wall }, law?.profile.as_ref()?))
            })
            .collect();
        let is_plain = scene.laws.is_empty()
            && scene.couplings.is_empty()
            && scene.walls.iter().all(|wall| wall.aim.is_none());
        if is_plain && scene.events.is_empty() && driven.is_empty() {
            return Ok(None);
        }
        let mut names = Names::of(scene);
        let is_set =
            |name: &String| scene.events.iter().any(|event| event.set.iter().any(|(set, _)| set == name));
        let is_positive =
            |parameter: &Parameter<C>| parameter.value.value() > 0.0 && !is_set(&parameter.name);
        let positive = scene.parameters.iter().map(is_positive).collect();
        let mut binder = Binder { forest, tables: &scene.tables, positive, conditions: Vec::new() };
        let mut signals = Vec::new();
        for signal in &scene.signals {
            let bound = Binder::bind(&names.alone(), &signal.formula, &signal.name)?;
            names.signal(&signal.name, &bound, None);
            signals.push(binder.placed(bound, &signal.name));
        }
        let mut laws = Vec::new();
        for law in &scene.laws {
            let scope = names.within(&law.load);
            let mut expression = |text: &str| binder.expression(&scope, text, &law.name);
            let (potential, place) = match &law.load {
                Load::Force { bar, point, force: [x, y], follows } => {
                    let site = forest.site(&Place { bar: Some(*bar), point: *point });
                    let force = Box::new([expression(x)?, expression(y)?]);
                    (None, Acts::Point { site, follows: *follows, force })
                }
                Load::Torque { bar, relative_to, torque } => {
                    let torque = expression(torque)?;
                    (None, Acts::Torque { body: *bar, base: *relative_to, torque })
                }
                Load::Spring { between, potential, tension } => {
                    let sites = between.each_ref().map(|place| forest.site(place));
                    let potential = potential.as_deref().map(&mut expression).transpose()?;
                    let tension = tension.as_deref().map(&mut expression).transpose()?;
                    (potential, Acts::Span { sites, tension })
                }
                Load::TorsionSpring { bar, relative_to, potential, torque } => {
                    let potential = potential.as_deref().map(&mut expression).transpose()?;
                    let place = match torque {
                        Some(torque) => Acts::Torque {
                            body: *bar,
                            base: *relative_to,
                            torque: expression(&format!("-({torque})"))?,
                        },
                        None => Acts::Nowhere,
                    };
                    (potential, place)
                }
                Load::Potential { energy } => (Some(expression(energy)?), Acts::Nowhere),
            };
            laws.push(ForceLaw { name: law.name.clone(), potential, place });
        }
        let mut profiles = Vec::new();
        for (part, profile) in driven {
            let expression = binder.expression(&names.alone(), profile.text(), &part.name)?;
            profiles.push((part, expression));
        }
        let mut aims = Vec::new();
        for Coupling { name, coupled, aim } in &scene.couplings {
            let angles = match *coupled {
                Coupled::Angle { bar, relative_to } => std::iter::once(bar).chain(relative_to).collect(),
                Coupled::Travel(_) => Vec::new(),
            };
            let part = DrivenPart { name: name.clone(), is_wall: false };
            aims.push((part, angles, binder.expression(&names.alone(), aim, name)?));
        }
        for Wall { name, aim, .. } in &scene.walls {
            let Some(aim) = aim else { continue };
            let part = DrivenPart { name: name.clone(), is_wall: true };
            aims.push((part, Vec::new(), binder.expression(&names.alone(), aim, name)?));
        }
        let mut whens = Vec::new();
        let of_laws = binder.conditions.len();
        for event in &scene.events {
            whens.push(binder.expression(&names.alone(), &event.when, &event.name)?);
        }
        let mut conditions = std::mem::take(&mut binder.conditions);
        if !C::HAS_CONSTANTS {
            // In doubles the functions of events are never extended beyond their corners.
            conditions.truncate(of_laws);
        }
        let parameter = |name: &String| scene.parameters.iter().position(|known| known.name == *name);
        let mut events = Vec::new();
        for (event, when) in scene.events.iter().zip(whens) {
            let mut set = Vec::new();
            for (name, text) in &event.set {
                let number = parameter(name)
                    .ok_or_else(|| CompileError::Unsound(format!("event `{}` sets {name}", event.name)))?;
                set.push((number, binder.expression(&names.alone(), text, &event.name)?));
            }
            events.push(FormulaEvent {
                name: event.name.clone(),
                when,
                direction: event.direction,
                stop: event.stop,
                on: event.on.clone(),
                off: event.off.clone(),
                set,
            });
        }
        let parameters = scene.parameters.iter().map(|parameter| parameter.value).collect();
        Ok(Some(Self { parameters, signals, laws, profiles, aims, events, conditions }))
    }

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
        let aim = |(part, angles, expression): &'_ (DrivenPart, Vec<usize>, Expression<C>)| {
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
