//! What a scene and a plan amount to: what is active, what was left out, which method and why.

use super::page::{Page, figure};
use crate::dynamics::Mechanism;
use crate::dynamics::assembly::Assembly;
use crate::run::{MethodId, Plan, Stabilization};
use crate::scene::{Load, LoadLaw, Scene, Spring};
use serde_json::{Value, json};

/// The form of the equations that a plan integrates in.
pub fn form(mechanism: &Mechanism, plan: &Plan) -> &'static str {
    match (plan.method, plan.stabilization) {
        (MethodId::Rattle(_), _) => "unit vectors and their rates, with a constant mass matrix",
        (MethodId::Gauss(_), _) if mechanism.constraints.is_empty() => "angles and momenta",
        (MethodId::Gauss(_), _) => "angles and momenta, driven angles as functions of time",
        (_, Stabilization::Elimination) => "angles and rates, driven angles as functions of time",
        _ if mechanism.constraints.is_empty() => "angles and rates",
        _ => "angles and rates, one multiplier a constraint",
    }
}

/// What the scene does not need and the equations do not contain.
fn left_out(scene: &Scene, mechanism: &Mechanism, plan: &Plan) -> Vec<&'static str> {
    let is_spring = |law: &LoadLaw| matches!(law.load, Load::Spring { .. } | Load::TorsionSpring { .. });
    let has_springs = !scene.springs.is_empty() || !scene.torsion_springs.is_empty();
    let multipliers = !mechanism.constraints.is_empty()
        && (matches!(plan.method, MethodId::Rattle(_))
            || !matches!(plan.stabilization, Stabilization::Elimination));
    let mut left_out = Vec::new();
    for (needed, what) in [
        (!motors(scene).is_empty() || !scene.couplings.is_empty(), "motors"),
        (multipliers, "the solve for multipliers"),
        (plan.stabilization == Stabilization::Projection, "projection"),
        (has_springs || scene.laws.iter().any(is_spring), "springs"),
        (mechanism.is_damped(), "dampers"),
        (!mechanism.contacts.is_empty(), "impacts"),
        (mechanism.tree.off_axis, "off-axis couplings"),
        (mechanism.gravity != crate::arithmetic::Complex::ZERO, "gravity"),
    ] {
        if !needed {
            left_out.push(what);
        }
    }
    left_out
}

/// The motors on angles, then those on sliders.
fn motors(scene: &Scene) -> Vec<&String> {
    let on_angles = scene.motors.iter().map(|motor| &motor.name);
    on_angles.chain(scene.drives.iter().map(|drive| &drive.name)).collect()
}

/// Kinds of parts that a scene may have, with the names of those it has: a key and words for each.
fn parts(scene: &Scene) -> [([&'static str; 2], Vec<&String>); 7] {
    [
        (["sliders", "sliders"], scene.sliders.iter().map(|part| &part.name).collect()),
        (["welds", "welds"], scene.welds.iter().map(|part| &part.name).collect()),
        (["locks", "locks"], scene.locks.iter().map(|part| &part.name).collect()),
        (["motors", "motors"], motors(scene)),
        (["torsion_springs", "torsion"], scene.torsion_springs.iter().map(|part| &part.name).collect()),
        (["forces", "forces"], scene.forces.iter().map(|part| &part.name).collect()),
        (["torques", "torques"], scene.torques.iter().map(|part| &part.name).collect()),
    ]
}

/// The report as one JSON object.
pub fn object(scene: &Scene, mechanism: &Mechanism, plan: &Plan) -> Value {
    let names = |names: Vec<&str>| json!(names);
    let springs = scene.springs.iter().map(|spring| (&spring.name, spring.damping));
    let coils = scene.torsion_springs.iter().map(|coil| (&coil.name, coil.damping));
    let dampers = springs.chain(coils).filter(|spring| spring.1 != 0.0);
    let mut object = json!({
        "scene": scene.name,
        "description": scene.description,
        "bodies": names(scene.bars[..scene.own_bars()].iter().map(|bar| bar.name.as_str()).collect()),
        "degrees_of_freedom": mechanism.assembly.degrees_of_freedom - mechanism.integrals,
        "constraints": names(mechanism.constraints.iter().map(|row| row.name()).collect()),
        "assembly": assembly(mechanism),
        "hinges": names(scene.hinges[..scene.own_hinges()].iter().map(|hinge| hinge.name.as_str()).collect()),
        "springs": names(scene.springs.iter().map(|spring| spring.name.as_str()).collect()),
        "dampers": names(dampers.map(|spring| spring.0.as_str()).collect()),
        "walls": names(scene.walls.iter().map(|wall| wall.name.as_str()).collect()),
        "off_axis": mechanism.tree.off_axis,
        "left_out": left_out(scene, mechanism, plan),
        "energy_scale": mechanism.energy_scale,
        "form": form(mechanism, plan),
        "method": plan.method.info().name,
        "why": plan.why,
        "settings": super::settings(plan),
        "until": plan.until,
        "rows": plan.rows,
        "stiffness": plan.stiffness,
        "notes": plan.notes,
    });
    for ([key, _], found) in parts(scene) {
        object[key] = json!(found);
    }
    if !(scene.laws.is_empty() && scene.events.is_empty()) {
        object["formulas"] = names(scene.acting_laws().map(|law| law.name.as_str()).collect());
        object["events"] = names(scene.events.iter().map(|event| event.name.as_str()).collect());
        object["switches"] = json!(mechanism.is_switched());
    }
    if !scene.couplings.is_empty() {
        object["couplings"] = names(scene.couplings.iter().map(|coupling| coupling.name.as_str()).collect());
    }
    if !scene.frictions.is_empty() {
        object["friction"] = json!(super::friction::listed(scene));
    }
    object
}

/// How the start was found, as one JSON object.
pub(super) fn assembly(mechanism: &Mechanism) -> Value {
    let Assembly { changes, singular, conditioning, .. } = &mechanism.assembly;
    json!({"changes": changes, "redundant": mechanism.redundant(), "singular": singular,
        "conditioning": conditioning})
}

/// Degrees of freedom, rows that say nothing new, and what of the start is not as given.
fn freedom(page: &mut Page, mechanism: &Mechanism) {
    let Assembly { singular, degrees_of_freedom: free, .. } = &mechanism.assembly;
    let redundant = mechanism.redundant();
    let free = &(free - mechanism.integrals);
    let coordinates = mechanism.coordinates() - mechanism.integrals;
    let rows = mechanism.constraints.iter().filter(|row| !row.coordinates().is_empty()).count();
    let less = match (rows, redundant.len()) {
        (0, _) => String::new(),
        (rows, 0) => format!(
            ": {coordinates} coordinate{} less {rows} constraint{}",
            plural(coordinates),
            plural(rows)
        ),
        (rows, doubled) => {
            format!(": {coordinates} coordinates less {rows} constraints, {doubled} of them redundant")
        }
    };
    page.entry("freedom", &format!("{free} degree{}{less}", plural(*free)));
    if !redundant.is_empty() {
        page.entry("redundant", &redundant.join(", "));
    }
    if !singular.is_empty() {
        page.entry("singular", &format!("{} at the start", singular.join(", ")));
    }
    start_changes(page, mechanism);
}

/// What of the start is not as given.
pub(super) fn start_changes(page: &mut Page, mechanism: &Mechanism) {
    for (number, change) in mechanism.assembly.changes.iter().enumerate() {
        page.entry(if number == 0 { "start" } else { "" }, &change.to_string());
    }
}

/// The report as a page.
pub fn text(scene: &Scene, mechanism: &Mechanism, plan: &Plan) -> String {
    let mut page = Page::new(&scene.name, &scene.description);
    page.entry("bodies", &list(&scene.bars[..scene.own_bars()], |bar| &bar.name));
    freedom(&mut page, mechanism);
    page.entry("hinges", &list(&scene.hinges[..scene.own_hinges()], |hinge| &hinge.name));
    for ([_, kind], found) in parts(scene).into_iter().filter(|(_, found)| !found.is_empty()) {
        page.entry(kind, &list(&found, |name| name));
    }
    if !scene.couplings.is_empty() {
        page.entry("gears, cams", &list(&scene.couplings, |coupling| &coupling.name));
    }
    if !scene.springs.is_empty() {
        let kind = |spring: &Spring| match spring {
            Spring { rigid: true, .. } => " as a rod",
            Spring { damping, .. } if *damping != 0.0 => " with a damper",
            _ => "",
        };
        let each: Vec<String> =
            scene.springs.iter().map(|spring| format!("{}{}", spring.name, kind(spring))).collect();
        page.entry("springs", &each.join(", "));
    }
    if !scene.parameters.is_empty() {
        page.entry("parameters", &list(&scene.parameters, |parameter| &parameter.name));
    }
    let laws: Vec<&LoadLaw> = scene.acting_laws().collect();
    if !laws.is_empty() {
        page.entry("formulas", &list(&laws, |law| &law.name));
    }
    if !scene.integrals.is_empty() {
        page.entry("integrals", &list(&scene.integrals, |integral| &integral.name));
    }
    if mechanism.is_switched() && mechanism.frictions.is_empty() {
        page.entry("steps", "end at corners of formulas and where events switch parts or set parameters");
    }
    if !scene.events.is_empty() {
        page.entry("events", &list(&scene.events, |event| &event.name));
    }
    if !scene.walls.is_empty() {
        let each: Vec<String> = scene
            .walls
            .iter()
            .map(|wall| {
                let on = wall.on.map_or(String::new(), |bar| format!(", on {}", scene.bars[bar].name));
                let moves = if wall.moves() { ", moves" } else { "" };
                format!("{} (restitution {}{on}{moves})", wall.name, wall.restitution)
            })
            .collect();
        page.entry("walls", &each.join(", "));
    }
    if !scene.frictions.is_empty() {
        page.entry("dry friction", &super::friction::listed(scene).join(", "));
        page.entry("", "steps end where parts begin to stick or to slide");
    }
    if mechanism.tree.off_axis {
        page.entry("couplings", "off the bars' axes");
    }
    let left_out = left_out(scene, mechanism, plan);
    page.entry(
        "left out",
        if left_out.is_empty() { "nothing".to_owned() } else { left_out.join(", ") }.as_str(),
    );
    page.entry("energy scale", &format!("{} J", figure(mechanism.energy_scale)));
    page.entry("form", form(mechanism, plan));
    describe(&mut page, mechanism, plan);
    page.into_text()
}

/// Integrator, stabilization, horizon and notes of a plan.
pub(super) fn describe(page: &mut Page, mechanism: &Mechanism, plan: &Plan) {
    page.entry("method", &super::setting(plan));
    if let Some(why) = &plan.why {
        page.entry("", why);
    }
    page.entry("stabilization", &stabilization(mechanism, plan));
    page.entry("horizon", &format!("{} s, a row every {} s", figure(plan.until), figure(plan.every)));
    for (number, note) in plan.notes.iter().enumerate() {
        page.entry(if number == 0 { "note" } else { "" }, note);
    }
}

/// The stabilization in words.
pub(super) fn stabilization(mechanism: &Mechanism, plan: &Plan) -> String {
    match (plan.stabilization, plan.time_constant) {
        _ if mechanism.constraints.is_empty() => "none needed: the scene has no constraint".into(),
        _ if matches!(plan.method, MethodId::Rattle(_)) => {
            "by the method itself, positions and velocities".into()
        }
        (Stabilization::Baumgarte, Some(constant)) => {
            format!("baumgarte, time constant {} s", figure(constant))
        }
        (Stabilization::Baumgarte, None) => "baumgarte, time constant five mean steps".into(),
        (other, _) => other.to_string(),
    }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// `2 (bar1, bar2)`; names are left out where there are many.
fn list<T>(items: &[T], name: impl Fn(&T) -> &String) -> String {
    let names: Vec<&str> = items.iter().map(|item| name(item).as_str()).collect();
    if names.len() > 20 { names.len().to_string() } else { format!("{} ({})", names.len(), names.join(", ")) }
}
