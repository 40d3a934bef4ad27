//! What the record and the pages say of dry friction.

use super::page::{Page, counted, figure};
use crate::dynamics::Mechanism;
use crate::run::Outcome;
use crate::scene::{Friction, FrictionPlace, Scene};
use serde_json::{Value, json};

/// Transitions that the record names.
pub(super) const NAMED: usize = 100;

/// The part it acts at, in words: `hinge A (radius 0.01 m, kinetic 0.2, static 0.3)`.
fn described(scene: &Scene, friction: &Friction) -> String {
    let Friction { at, kinetic, stiction } = friction;
    let coefficients = format!("kinetic {kinetic}, static {stiction}");
    match at {
        FrictionPlace::Hinge { hinge, radius } => {
            format!("hinge {} (radius {radius} m, {coefficients})", scene.hinges[*hinge].name)
        }
        FrictionPlace::Slider(slider) => format!("slider {} ({coefficients})", scene.sliders[*slider].name),
        FrictionPlace::Wall { wall, is_newton } => {
            let law = if *is_newton { "Newton" } else { "Poisson" };
            format!("wall {} ({coefficients}, impacts by {law})", scene.walls[*wall].name)
        }
    }
}

/// What `check` says of a scene.
pub(super) fn listed(scene: &Scene) -> Vec<String> {
    scene.frictions.iter().map(|friction| described(scene, friction)).collect()
}

/// What the record of a run says; nothing for a scene without friction.
pub(super) fn object(mechanism: &Mechanism, outcome: &Outcome) -> Option<Value> {
    let first = &outcome.frictions[..outcome.frictions.len().min(NAMED)];
    (!mechanism.frictions.is_empty()).then(|| {
        json!({
            "energy_lost_j": outcome.last.friction,
            "transitions": outcome.friction_count,
            "first": first,
        })
    })
}

/// What the page of a run says.
pub(super) fn describe(page: &mut Page, mechanism: &Mechanism, outcome: &Outcome) {
    if mechanism.frictions.is_empty() {
        return;
    }
    let last = |name: &str| outcome.frictions.iter().rev().find(|record| record.name == name);
    let ends: Vec<_> = (mechanism.frictions.iter().filter_map(|friction| last(&friction.name)))
        .filter(|_| outcome.friction_count <= outcome.frictions.len() as u64)
        .map(|record| (record.name.as_str(), record.mode.as_str(), record.t))
        .collect();
    describe_ends(page, outcome.last.friction, outcome.friction_count, &ends);
}

/// The same of an energy lost \[J\], a number of transitions, and what places do since when.
pub(super) fn describe_ends(page: &mut Page, lost: f64, transitions: u64, ends: &[(&str, &str, f64)]) {
    let transitions = counted(transitions, "transition", "transitions");
    let since = |(name, mode, t): &(&str, &str, f64)| format!("{name} {mode} since {} s", figure(*t));
    let ends: Vec<String> = ends.iter().map(since).collect();
    let ends = if ends.is_empty() { String::new() } else { format!("; {}", ends.join(", ")) };
    page.entry("dry friction", &format!("{} J lost in sliding, {transitions}{ends}", figure(lost)));
}
