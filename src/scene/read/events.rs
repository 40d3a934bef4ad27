//! Events: when they come, what they set, and the parts they switch.

use super::at::{At, Fields, listed, nearest};
use super::judge::HINTS;
use super::laws::{formula, judge, pairs};
use super::resolve::Valued;
use crate::arithmetic::shown::about;
use crate::scene::Scene;
use crate::scene::error::SceneError;
use crate::scene::format::{FieldShape, HUGE};
use crate::scene::law::{Direction, Load, SceneEvent};
use crate::scene::locate::Value;
use crate::scene::names::{Bound, Meaning, Scope};
use crate::scene::set::hint;

/// An event.
pub(super) fn event(fields: &Fields, name: String) -> Result<SceneEvent, SceneError> {
    let direction = match fields.word_or_first("direction")? {
        0 => Direction::Either,
        1 => Direction::Rising,
        _ => Direction::Falling,
    };
    let set = match fields.optional("set") {
        None => Vec::new(),
        Some(at) => pairs(&at)?,
    };
    Ok(SceneEvent {
        name,
        when: formula(fields, "when")?,
        direction,
        stop: fields.word_or_first("action")? == 1,
        on: fields.optional("on").map_or(Ok(Vec::new()), |at| names(&at))?,
        off: fields.optional("off").map_or(Ok(Vec::new()), |at| names(&at))?,
        set,
    })
}

/// Refuses a part that an event switches on and off at once.
fn check_on_and_off(event: &SceneEvent, at: &At) -> Result<(), SceneError> {
    let Some(off) = at.child("off") else { return Ok(()) };
    let Value::List(nodes) = &off.node.value else { return Ok(()) };
    let both = nodes.iter().zip(&event.off).position(|(_, part)| event.on.contains(part));
    both.map_or(Ok(()), |number| {
        let allowed = "must be a part that the event does not switch on";
        let hint = "leave it in `on` or in `off`; a later change takes another event";
        Err(off.item(&nodes[number], number).refuse_value(allowed, hint))
    })
}

/// A list of names.
pub(super) fn names(at: &At) -> Result<Vec<String>, SceneError> {
    let hint = "for example [\"latch\"]";
    let Value::List(nodes) = &at.node.value else {
        return Err(at.refuse_value(&FieldShape::Names.allowed(), hint));
    };
    let name = |(number, node)| match &at.item(node, number).node.value {
        Value::Text(name) => Ok(name.clone()),
        _ => Err(at.item(node, number).refuse_value("must be the name of a part", hint)),
    };
    nodes.iter().enumerate().map(name).collect()
}

/// Judges the events of a scene and what is inactive at its start.
pub(super) fn check<'a>(
    root: &At<'a>,
    scene: &Scene,
    scope: &Scope,
    parameters: &[Valued],
) -> Result<(), SceneError> {
    // What was read stands in the file.
    let found = |at: Option<At<'a>>| at.unwrap_or_else(|| root.clone());
    let parts = Parts::of(scene);
    for event in &scene.events {
        let at = found(root.child("events").and_then(|at| at.named(&event.name)));
        judge(&found(at.child("when")), &event.when, scope, None)?;
        at.child("on").map_or(Ok(()), |list| parts.check(&list))?;
        at.child("off").map_or(Ok(()), |list| parts.check(&list))?;
        check_on_and_off(event, &at)?;
        for (name, text) in &event.set {
            let value = found(at.child("set").and_then(|set| set.child(name)));
            check_set(&value, name, text, scope, parameters)?;
        }
    }
    root.child("inactive").map_or(Ok(()), |list| parts.check(&list))
}

/// Refuses a value at `at` that the parameter `name` cannot have.
fn check_set(
    at: &At,
    name: &str,
    text: &str,
    scope: &Scope,
    parameters: &[Valued],
) -> Result<(), SceneError> {
    let Some(parameter) = parameters.iter().find(|known| known.name == name) else {
        let known: Vec<&str> = parameters.iter().map(|known| known.name.as_str()).collect();
        return Err(at.refuse("is no parameter", "must be a parameter of the scene", &hint(name, &known)));
    };
    let (bound, dimension) = judge(at, text, scope, None)?;
    if let (Some(found), Some(wanted)) = (dimension, parameter.dimension)
        && !found.is(wanted)
    {
        let allowed = format!("must be of the unit of the parameter {name}, {wanted}");
        let problem = format!("= {}: is {found}", at.source.written(at.node.span));
        return Err(at.refuse(&problem, &allowed, "write it in the unit of the parameter"));
    }
    let Some(value) = constant(&bound, parameters) else { return Ok(()) };
    if value.abs() <= HUGE {
        return Ok(());
    }
    let what = match value {
        value if value.is_nan() => "has no value".into(),
        value if value.is_infinite() => "is infinite".into(),
        value => format!("comes to {}", about(value)),
    };
    let problem = format!("= {}: {what}", at.source.written(at.node.span));
    let allowed = format!("must be a number from -{HUGE:e} to {HUGE:e}");
    Err(at.refuse(&problem, &allowed, HINTS[usize::from(bound.formula.names().next().is_none())]))
}

/// What a formula of parameters comes to; `None` where there is more in it.
fn constant(bound: &Bound, parameters: &[Valued]) -> Option<f64> {
    let value = |meaning: &Meaning| match meaning {
        Meaning::Parameter(number) => parameters.get(*number).map(|known| known.value),
        _ => None,
    };
    let values: Option<Vec<f64>> = bound.meanings.iter().map(value).collect();
    Some(bound.formula.value(&values?))
}

/// What events can switch, by kind and name, and springs that they cannot.
struct Parts<'a> {
    all: Vec<(&'static str, &'a str)>,
    rigid: Vec<&'a str>,
}

impl<'a> Parts<'a> {
    fn of(scene: &'a Scene) -> Self {
        let laws = scene.laws.iter().map(|law| match law.load {
            Load::Force { .. } => ("force", &law.name),
            Load::Torque { .. } => ("torque", &law.name),
            Load::Spring { .. } => ("spring", &law.name),
            Load::TorsionSpring { .. } => ("torsion spring", &law.name),
            Load::Potential { .. } => ("potential", &law.name),
        });
        let springs = scene.springs.iter().filter(|spring| !spring.rigid);
        let all = (springs.map(|part| ("spring", &part.name)))
            .chain(scene.torsion_springs.iter().map(|part| ("torsion spring", &part.name)))
            .chain(scene.forces.iter().map(|part| ("force", &part.name)))
            .chain(scene.torques.iter().map(|part| ("torque", &part.name)))
            .chain(laws)
            .chain(scene.hinges.iter().map(|part| ("hinge", &part.name)))
            .chain(scene.motors.iter().map(|part| ("motor", &part.name)))
            .chain(scene.drives.iter().map(|part| ("motor", &part.name)))
            .chain(scene.couplings.iter().map(|part| ("motor", &part.name)))
            .chain(scene.locks.iter().map(|part| ("lock", &part.name)))
            .chain(scene.walls.iter().map(|part| ("wall", &part.name)))
            .map(|(kind, name)| (kind, name.as_str()));
        let rigid = scene.springs.iter().filter(|spring| spring.rigid).map(|spring| spring.name.as_str());
        Self { all: all.collect(), rigid: rigid.collect() }
    }

    /// Refuses a list with a name that none has, or several.
    fn check(&self, list: &At) -> Result<(), SceneError> {
        let Value::List(nodes) = &list.node.value else { return Ok(()) };
        for (number, node) in nodes.iter().enumerate() {
            let at = list.item(node, number);
            let Value::Text(name) = &node.value else { continue };
            let kinds: Vec<&str> = self.all.iter().filter(|part| part.1 == name).map(|part| part.0).collect();
            if kinds.len() == 1 {
                continue;
            }
            if kinds.len() > 1 {
                let problem = format!("= \"{name}\" is the name of a {}", kinds.join(" and a "));
                return Err(at.refuse(
                    &problem,
                    "must be the name of one part",
                    "rename all but one of them",
                ));
            }
            let names: Vec<&str> = self.all.iter().map(|part| part.1).collect();
            let hint = match nearest(name, names.iter().copied()) {
                _ if self.rigid.contains(&name.as_str()) => {
                    "a spring whose model is \"rigid\" always acts".into()
                }
                Some(near) => format!("did you mean \"{near}\"?"),
                None if names.is_empty() => "the scene has none".to_owned(),
                None => format!("there are: {}", listed(&names)),
            };
            let allowed = "must be the name of a spring, torsion spring, force, torque, potential, hinge, \
                motor, lock or wall";
            return Err(at.refuse_value(allowed, &hint));
        }
        Ok(())
    }
}
