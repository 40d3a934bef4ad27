//! Formulas of time and state: points, signals, laws of forces and springs, and potentials.

use super::at::{At, Fields};
use super::judge::{check_name, fits, refused};
use super::loads;
use super::names::{BarNames, named};
use super::resolve::Valued;
use crate::scene::error::SceneError;
use crate::scene::format::{Field, FieldShape, QuantityRange, SCENE};
use crate::scene::formula::Formula;
use crate::scene::formula::unit::Dimension;
use crate::scene::law::{Integral, Load, LoadLaw, NamedPoint, Signal};
use crate::scene::locate::{Located, Member, Value};
use crate::scene::names::{Bound, Names, Scope};
use crate::scene::{Coupling, Force, Scene, Spring, Torque, TorsionSpring};

/// Signals at most.
const MOST: usize = 1000;

/// A part as the format has always known it, or one whose law is a formula.
pub(super) enum Either<T> {
    Plain(T),
    Law(LoadLaw),
}

/// The plain parts of a list, and its laws at the end of `laws`.
pub(super) fn split<T>(all: Vec<Either<T>>, laws: &mut Vec<LoadLaw>) -> Vec<T> {
    let mut plain = Vec::new();
    for one in all {
        match one {
            Either::Plain(part) => plain.push(part),
            Either::Law(law) => laws.push(law),
        }
    }
    plain
}

/// The parts that exert forces: the plain ones, and the laws of all others.
pub(super) struct LoadedParts<'a> {
    pub springs: Vec<Spring>,
    /// Places of the plain springs.
    pub spring_places: Vec<At<'a>>,
    pub torsion_springs: Vec<TorsionSpring>,
    pub forces: Vec<Force>,
    pub torques: Vec<Torque>,
    pub laws: Vec<LoadLaw>,
}

/// Those of a scene.
pub(super) fn loaded_parts<'a>(fields: &Fields<'a>, known: &BarNames) -> Result<LoadedParts<'a>, SceneError> {
    let (springs, places) = named(fields, "springs", |fields, name| spring(fields, name, known))?;
    let (torsion_springs, _) =
        named(fields, "torsion_springs", |fields, name| torsion_spring(fields, name, known))?;
    let (forces, _) = named(fields, "forces", |fields, name| force(fields, name, known))?;
    let (torques, _) = named(fields, "torques", |fields, name| torque(fields, name, known))?;
    let is_plain = |(spring, at): (&Either<_>, _)| matches!(spring, Either::Plain(_)).then_some(at);
    let spring_places = springs.iter().zip(places).filter_map(is_plain).collect();
    let mut laws = Vec::new();
    let springs = split(springs, &mut laws);
    let torsion_springs = split(torsion_springs, &mut laws);
    let forces = split(forces, &mut laws);
    let torques = split(torques, &mut laws);
    Ok(LoadedParts { springs, spring_places, torsion_springs, forces, torques, laws })
}

/// A text, or a number as one.
pub(super) fn written(node: &Located) -> Option<String> {
    match &node.value {
        Value::Text(text) => Some(text.clone()),
        Value::Number(number) => Some(format!("{number:?}")),
        _ => None,
    }
}

/// The text of a formula that must be there.
pub(super) fn formula(fields: &Fields, name: &str) -> Result<String, SceneError> {
    let at = fields.required(name)?;
    written(at.node).ok_or_else(|| match fields.table.field(name) {
        Some(field) => at.refuse_value(&field.shape.allowed(), &field.for_example()),
        None => at.refuse_value("must be a formula", fields.table.about),
    })
}

fn formula_if_any(fields: &Fields, name: &str) -> Result<Option<String>, SceneError> {
    fields.optional(name).map(|_| formula(fields, name)).transpose()
}

fn is_formula(node: &Located) -> bool {
    match &node.value {
        Value::Text(text) => text.trim().parse::<f64>().is_err(),
        Value::List(nodes) => nodes.iter().any(is_formula),
        _ => false,
    }
}

/// Refuses a `law` of time beside a formula.
fn without_law(fields: &Fields) -> Result<(), SceneError> {
    match fields.optional("law") {
        None => Ok(()),
        Some(at) => Err(at.refuse(
            "stands beside a formula",
            "must be left out where the force or torque is a formula",
            "multiply the formula by it: formulas may use t",
        )),
    }
}

/// A force, or one by formulas.
pub(super) fn force(fields: &Fields, name: String, known: &BarNames) -> Result<Either<Force>, SceneError> {
    let at = fields.required("force")?;
    let nodes = match &at.node.value {
        Value::List(nodes) if nodes.len() == 2 && is_formula(at.node) => nodes,
        _ => return loads::force(fields, name, known).map(Either::Plain),
    };
    without_law(fields)?;
    let component = |number: usize| {
        let refused = || {
            at.item(&nodes[number], number)
                .refuse_value("must be a number or a formula", "for example \"-c*tip.vx\"")
        };
        written(&nodes[number]).ok_or_else(refused)
    };
    let force = [component(0)?, component(1)?];
    let load = Load::Force {
        bar: known.bar(fields, "a force on the ground moves nothing")?,
        point: fields.pair("point")?,
        force,
        follows: fields.word_or_first("frame")? == 1,
    };
    Ok(Either::Law(LoadLaw { name, load }))
}

/// A torque, or one by a formula.
pub(super) fn torque(fields: &Fields, name: String, known: &BarNames) -> Result<Either<Torque>, SceneError> {
    if !is_formula(fields.required("torque")?.node) {
        return loads::torque(fields, name, known).map(Either::Plain);
    }
    without_law(fields)?;
    let (bar, relative_to) = loads::torque_bodies(fields, known)?;
    let load = Load::Torque { bar, relative_to, torque: formula(fields, "torque")? };
    Ok(Either::Law(LoadLaw { name, load }))
}

/// A spring, or one by formulas.
pub(super) fn spring(fields: &Fields, name: String, known: &BarNames) -> Result<Either<Spring>, SceneError> {
    if fields.table.field("stiffness").is_some() {
        return loads::spring(fields, name, known).map(Either::Plain);
    }
    let load = Load::Spring {
        between: known.between(fields, "spring")?,
        potential: formula_if_any(fields, "potential")?,
        tension: formula_if_any(fields, "tension")?,
    };
    Ok(Either::Law(LoadLaw { name, load }))
}

/// A torsion spring, or one by formulas.
pub(super) fn torsion_spring(
    fields: &Fields,
    name: String,
    known: &BarNames,
) -> Result<Either<TorsionSpring>, SceneError> {
    if fields.table.field("stiffness").is_some() {
        return loads::torsion_spring(fields, name, known).map(Either::Plain);
    }
    let (bar, relative_to) = loads::coil_bodies(fields, known)?;
    let load = Load::TorsionSpring {
        bar,
        relative_to,
        potential: formula_if_any(fields, "potential")?,
        torque: formula_if_any(fields, "torque")?,
    };
    Ok(Either::Law(LoadLaw { name, load }))
}

/// A point with a name.
pub(super) fn point(fields: &Fields, name: String, known: &BarNames) -> Result<NamedPoint, SceneError> {
    let at = fields.required("name")?;
    check_name(at.source, &name, at.node.span, &at.path, &[])?;
    Ok(NamedPoint { name, place: known.place_of(fields)? })
}

/// A potential.
pub(super) fn potential(fields: &Fields, name: String) -> Result<LoadLaw, SceneError> {
    Ok(LoadLaw { name, load: Load::Potential { energy: formula(fields, "energy")? } })
}

/// Formulas by name.
pub(super) fn pairs<'a>(at: &At<'a>) -> Result<Vec<(String, String)>, SceneError> {
    let hint = "for example {\"speed\": \"sqrt(tip.vx^2 + tip.vy^2)\"}";
    let Value::Object(members) = &at.node.value else {
        return Err(at.refuse_value(&FieldShape::Signals.allowed(), hint));
    };
    let pair = |member: &Member| {
        let refused = || at.member(member).refuse_value("must be a formula", hint);
        Ok((member.key.clone(), written(&member.node).ok_or_else(refused)?))
    };
    members.iter().map(pair).collect()
}

/// Refuses a key of an object that is no name for formulas, or is taken.
fn check_keys<'a>(at: &At<'a>, mut taken: Vec<&'a str>) -> Result<(), SceneError> {
    let Value::Object(members) = &at.node.value else { return Ok(()) };
    for member in members {
        check_name(at.source, &member.key, member.span, &at.member(member).path, &taken)?;
        taken.push(&member.key);
    }
    Ok(())
}

/// The signals of a scene.
pub(super) fn signals(fields: &Fields, taken: &[Valued]) -> Result<Vec<Signal>, SceneError> {
    let Some(at) = fields.optional("signals") else { return Ok(Vec::new()) };
    let all = pairs(&at)?;
    if all.len() > MOST {
        return Err(at.refuse(
            &format!("has {} entries", all.len()),
            &format!("must be at most {MOST}"),
            "merge some",
        ));
    }
    check_keys(&at, taken.iter().map(|known| known.name.as_str()).collect())?;
    Ok(all.into_iter().map(|(name, formula)| Signal { name, formula }).collect())
}

/// Columns that every trajectory has, beside which integrals stand by their names.
const COLUMNS: [&str; 5] = ["kinetic", "potential", "work", "imbalance", "friction"];

/// The integrals of a scene of so many bars.
pub(super) fn integrals(
    fields: &Fields,
    parameters: &[Valued],
    signals: &[Signal],
    bars: &BarNames,
) -> Result<Vec<Integral>, SceneError> {
    let Some(at) = fields.optional("integrals") else { return Ok(Vec::new()) };
    let mut taken: Vec<&str> = parameters.iter().map(|known| known.name.as_str()).collect();
    taken.extend(signals.iter().map(|signal| signal.name.as_str()));
    taken.extend(bars.bars.iter().map(|bar| bar.name.as_str()));
    taken.extend(COLUMNS);
    let all = pairs(&at)?;
    check_keys(&at, taken)?;
    let first = bars.bars.len();
    let integral = |(number, (name, formula))| Integral { name, formula, bar: first + number };
    Ok(all.into_iter().enumerate().map(integral).collect())
}

/// Judges every formula of a scene where it stands: its names, its dimensions; and what events do.
pub(super) fn check<'a>(root: &At<'a>, scene: &Scene, parameters: &[Valued]) -> Result<(), SceneError> {
    let is_plain = scene.laws.is_empty() && scene.signals.is_empty() && scene.integrals.is_empty();
    let is_plain = is_plain && scene.walls.iter().all(|wall| wall.aim.is_none());
    if is_plain && scene.events.is_empty() && scene.inactive.is_empty() && scene.couplings.is_empty() {
        return Ok(());
    }
    let mut names = Names::of(scene);
    for known in parameters {
        names.set_dimension(&known.name, known.dimension);
    }
    // What was read stands in the file.
    let found = |at: Option<At<'a>>| at.unwrap_or_else(|| root.clone());
    for (number, signal) in scene.signals.iter().enumerate() {
        let at = found(root.child("signals").and_then(|at| at.child(&signal.name)));
        let later: Vec<&str> = scene.signals[number..].iter().map(|signal| signal.name.as_str()).collect();
        is_in_order(&at, &signal.formula, &names, &later)?;
        let (bound, dimension) = judge(&at, &signal.formula, &names.alone(), None)?;
        names.signal(&signal.name, &bound, dimension);
    }
    for law in &scene.laws {
        let scope = names.within(&law.load);
        let (list, keys): (&str, &[&str]) = match law.load {
            Load::Force { .. } => ("forces", &["force"]),
            Load::Torque { .. } => ("torques", &["torque"]),
            Load::Spring { .. } => ("springs", &["potential", "tension"]),
            Load::TorsionSpring { .. } => ("torsion_springs", &["potential", "torque"]),
            Load::Potential { .. } => ("potentials", &["energy"]),
        };
        let part = found(root.child(list).and_then(|at| at.named(&law.name)));
        for key in keys {
            let Some(at) = part.child(key) else { continue };
            let formulas = match &at.node.value {
                Value::List(nodes) => nodes.iter().enumerate().map(|(i, node)| at.item(node, i)).collect(),
                _ => vec![at],
            };
            let quantity = quantity_of(list, key, &part);
            for at in &formulas {
                let Value::Text(text) = &at.node.value else { continue };
                let (bound, _) = judge(at, text, &scope, quantity.as_ref())?;
                if matches!(*key, "potential" | "energy") {
                    is_of_place(at, &names, &bound)?;
                }
            }
        }
    }
    let scope = names.alone();
    for integral in &scene.integrals {
        let at = found(root.child("integrals").and_then(|at| at.child(&integral.name)));
        judge(&at, &integral.formula, &scope, None)?;
    }
    let of_walls = scene.walls.iter().filter_map(|wall| Some(("walls", &wall.name, wall.aim.as_ref()?)));
    let of_motors = scene.couplings.iter().map(|Coupling { name, aim, .. }| ("motors", name, aim));
    for (list, name, aim) in of_motors.chain(of_walls) {
        let part = found(root.child(list).and_then(|at| at.named(name)));
        let at = found(part.child("law"));
        let (bound, _) = judge(&at, aim, &scope, quantity_of(list, "law", &part).as_ref())?;
        if let Some(name) = names.rate_in(&bound) {
            let problem = format!("depends on {name}");
            let (allowed, hint) = match list {
                "motors" => (
                    "the aim of a motor is a formula of time, angles and positions; one of rates would be a \
                        non-holonomic constraint",
                    "what acts on rates is a torque, as \"kp*(aim - arm.phi) - kd*arm.omega\" in torques",
                ),
                _ => (
                    "a wall moves by a formula of time, angles and positions; rates jump where it is met, \
                        and the wall would jump with them",
                    "carry the wall by a bar that a torque or a force drives by rates",
                ),
            };
            return Err(at.refuse(&problem, allowed, hint));
        }
    }
    super::events::check(root, scene, &scope, parameters)
}

/// What the field of a part must come to.
fn quantity_of(list: &str, key: &str, part: &At) -> Option<QuantityRange> {
    let Some(Field { shape: FieldShape::List { of, .. }, .. }) = SCENE.field(list) else { return None };
    let table = crate::scene::format::kind(of, |key| part.has(key))?;
    match table.field(key).map(|field| &field.shape) {
        Some(
            FieldShape::Formula(quantity)
            | FieldShape::LawNumber(quantity)
            | FieldShape::LawPair(quantity)
            | FieldShape::Law(_, quantity),
        ) => Some(*quantity),
        _ => None,
    }
}

/// Judges one formula that stands at `at`: its names, and its dimension where that of the field is known.
pub(super) fn judge(
    at: &At,
    text: &str,
    scope: &Scope,
    quantity: Option<&QuantityRange>,
) -> Result<(Bound, Option<Dimension>), SceneError> {
    let allowed =
        quantity.map_or("must be a formula".to_owned(), |quantity| FieldShape::Formula(*quantity).allowed());
    let refused = |error| refused(at.source, at.node.span, &at.path, &allowed, &error);
    let (bound, dimension) = scope.bind(text).map_err(refused)?;
    if let Some(quantity) = quantity {
        fits(&bound.formula, dimension, quantity).map_err(refused)?;
    }
    Ok((bound, dimension))
}

/// Refuses a signal that is made of itself or of `later` ones.
fn is_in_order(at: &At, text: &str, names: &Names, later: &[&str]) -> Result<(), SceneError> {
    let Ok(formula) = Formula::parse_with(text, names.tables()) else { return Ok(()) };
    let Some(name) = formula.names().find(|name| later.contains(name)) else { return Ok(()) };
    let (problem, hint) = match later.first() == Some(&name) {
        true => (format!("{name} is made of itself"), "a signal is made of those before it".to_owned()),
        false => {
            let hint = format!("a signal is made of those before it: write {name} first");
            (format!("{name} is a signal that comes later"), hint)
        }
    };
    let error = formula.refused(name, problem, hint);
    Err(refused(at.source, at.node.span, &at.path, "must be a formula", &error))
}

/// Refuses a potential that depends on time or rates.
fn is_of_place(at: &At, names: &Names, bound: &Bound) -> Result<(), SceneError> {
    let Some(name) = names.changing(bound) else { return Ok(()) };
    let problem = format!("depends on {name}");
    let allowed = "a potential is a formula of angles and positions";
    let hint = "what depends on time or rates does work: give it as a force, a torque or a tension";
    Err(at.refuse(&problem, allowed, hint))
}
