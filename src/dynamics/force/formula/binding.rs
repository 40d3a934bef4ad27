//! The formulas of a scene, bound to what they name.

use super::{AngleAim, DrivenPart, Expression, FormulaEvent, Formulas};
use crate::dynamics::CompileError;
use crate::dynamics::force::law::{Acts, ForceLaw};
use crate::dynamics::forest::Forest;
use crate::scene::formula::Numbers;
use crate::scene::{
    Bound, Coupled, Decimal, Load, LoadLaw, Meaning, Names, Parameter, Place, PointTable, Profile, Scene,
    SceneEvent, Scope,
};

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
        formula.note_active_arguments(|name| matches!(meanings[name], Meaning::Parameter(_)));
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

    /// Where a force or torque acts, and by which law.
    fn force_law(&mut self, names: &Names<C>, law: &LoadLaw<C>) -> Result<ForceLaw<C>, CompileError> {
        let (forest, scope) = (self.forest, names.within(&law.load));
        let mut expression = |text: &str| self.expression(&scope, text, &law.name);
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
        Ok(ForceLaw { name: law.name.clone(), potential, place })
    }

    /// The aims of motors, then of walls.
    fn aims(&mut self, names: &Names<C>, scene: &Scene<C>) -> Result<Vec<AngleAim<C>>, CompileError> {
        let of_motors = scene.couplings.iter().map(|coupling| {
            let angles = match coupling.coupled {
                Coupled::Angle { bar, relative_to } => std::iter::once(bar).chain(relative_to).collect(),
                Coupled::Travel(_) => Vec::new(),
            };
            (&coupling.name, false, angles, &coupling.aim)
        });
        let of_walls = scene.walls.iter().filter_map(|wall| {
            let aim = wall.aim.as_ref()?;
            Some((&wall.name, true, Vec::new(), aim))
        });
        let bound = of_motors.chain(of_walls).map(|(name, is_wall, angles, aim)| {
            let part = DrivenPart { name: name.clone(), is_wall };
            Ok((part, angles, self.expression(&names.alone(), aim, name)?))
        });
        bound.collect()
    }

    /// An event by its function and the parameters it sets.
    fn event(
        &mut self,
        names: &Names<C>,
        scene: &Scene<C>,
        event: &SceneEvent,
        when: Expression<C>,
    ) -> Result<FormulaEvent<C>, CompileError> {
        let mut set = Vec::new();
        for (name, text) in &event.set {
            let number = (scene.parameters.iter().position(|known| known.name == *name))
                .ok_or_else(|| CompileError::Unsound(format!("event `{}` sets {name}", event.name)))?;
            set.push((number, self.expression(&names.alone(), text, &event.name)?));
        }
        Ok(FormulaEvent {
            name: event.name.clone(),
            when,
            direction: event.direction,
            stop: event.stop,
            on: event.on.clone(),
            off: event.off.clone(),
            set,
        })
    }
}

/// The motors and walls with a law of time that is a formula.
fn driven<C: Decimal>(scene: &Scene<C>) -> Vec<(DrivenPart, &Profile<C>)> {
    let laws = (scene.motors.iter().map(|motor| (&motor.name, Some(&motor.law), false)))
        .chain(scene.drives.iter().map(|drive| (&drive.name, Some(&drive.law), false)))
        .chain(scene.walls.iter().map(|wall| (&wall.name, wall.law.as_ref(), true)));
    laws.filter_map(|(name, law, is_wall)| {
        Some((DrivenPart { name: name.clone(), is_wall }, law?.profile.as_ref()?))
    })
    .collect()
}

impl<C: Decimal> Formulas<C> {
    /// Those of a scene; `None` where it has none.
    pub fn of(scene: &Scene<C>, forest: &Forest<C>) -> Result<Option<Self>, CompileError> {
        let driven = driven(scene);
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
        let laws = scene.laws.iter().map(|law| binder.force_law(&names, law)).collect::<Result<_, _>>()?;
        let mut profiles = Vec::new();
        for (part, profile) in driven {
            let expression = binder.expression(&names.alone(), profile.text(), &part.name)?;
            profiles.push((part, expression));
        }
        let aims = binder.aims(&names, scene)?;
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
        let events = scene.events.iter().zip(whens);
        let events = events.map(|(event, when)| binder.event(&names, scene, event, when));
        let events = events.collect::<Result<_, _>>()?;
        let parameters = scene.parameters.iter().map(|parameter| parameter.value).collect();
        Ok(Some(Self { parameters, signals, laws, profiles, aims, events, conditions }))
    }
}
