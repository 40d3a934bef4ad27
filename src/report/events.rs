//! The events of a run: a table of their own, and what the record and the page say of them.

use super::page::{Page, counted, figure};
use crate::dynamics::Mechanism;
use crate::run::Outcome;
use serde_json::{Value, json};
use std::fmt::Write;

/// Events that the record names; the table has all that were kept.
pub(super) const NAMED: usize = 100;

/// True where a scene has events.
pub fn has_any(mechanism: &Mechanism) -> bool {
    !mechanism.event_names().is_empty()
}

/// What stands above the table: name, time, angles and rates of all bars, integrals, translational
/// coordinates.
pub(super) fn header(mechanism: &Mechanism) -> String {
    let n = mechanism.bodies.len();
    let mut text = "event,t [s]".to_owned();
    for body in mechanism.own_bodies() {
        let _ = write!(text, ",{0}.phi [rad],{0}.omega [rad/s]", body.name);
    }
    for (name, _) in mechanism.integrals() {
        let _ = write!(text, ",{name}");
    }
    for k in n..mechanism.coordinates() {
        let _ = write!(text, ",{} [m],{} [m/s]", mechanism.coordinate_name(k), mechanism.rate_name(k));
    }
    text
}

/// The numbers of a row in this order, of those of all coordinates: an integral is the rate of its rotor.
pub(super) fn numbers<'a, T>(
    mechanism: &Mechanism,
    phi: &'a [T],
    omega: &'a [T],
) -> impl Iterator<Item = &'a T> {
    let rotors = mechanism.rotors();
    let both = phi.iter().zip(omega).enumerate();
    both.flat_map(move |(k, (phi, omega))| [Some(phi).filter(|_| !rotors.contains(&k)), Some(omega)])
        .flatten()
}

/// All events as a table.
pub fn table(mechanism: &Mechanism, outcome: &Outcome) -> String {
    let mut text = header(mechanism) + "\n";
    for event in &outcome.events {
        let _ = write!(text, "{},{:?}", event.name, event.t);
        for number in numbers(mechanism, &event.phi, &event.omega) {
            let _ = write!(text, ",{number:?}");
        }
        text.push('\n');
    }
    text
}

/// What the record says; nothing for a scene without events.
pub(super) fn object(mechanism: &Mechanism, outcome: &Outcome) -> Option<Value> {
    let first: Vec<Value> =
        outcome.events.iter().take(NAMED).map(|event| json!({"name": event.name, "t": event.t})).collect();
    has_any(mechanism).then(|| {
        json!({
            "count": outcome.event_count,
            "energy_j": outcome.event_energy,
            "ended_by": outcome.ended_by,
            "first": first,
        })
    })
}

/// When events have happened, on the page: by their names and times.
pub(super) fn describe_times(page: &mut Page, mechanism: &Mechanism, events: &[(&str, f64)]) {
    let names = mechanism.event_names();
    for (number, name) in names.iter().enumerate().take(10) {
        let times: Vec<f64> = events.iter().filter(|event| event.0 == *name).map(|event| event.1).collect();
        let when = match times[..] {
            [] => "never".to_owned(),
            [only] => format!("at t = {} s", figure(only)),
            [first, .., last] => {
                let count = counted(times.len() as u64, "time", "times");
                format!("{count}, t = {} s to {} s", figure(first), figure(last))
            }
        };
        page.entry(if number == 0 { "events" } else { "" }, &format!("{name}: {when}"));
    }
}

/// What the page says.
pub(super) fn describe(page: &mut Page, mechanism: &Mechanism, outcome: &Outcome) {
    let events: Vec<_> = outcome.events.iter().map(|event| (event.name.as_str(), event.t)).collect();
    describe_times(page, mechanism, &events);
    if let Some(event) = &outcome.ended_by {
        page.entry("ended by", &format!("{event}, before the horizon of {} s", figure(outcome.plan.until)));
    }
    if outcome.event_energy != 0.0 {
        page.entry("", &format!("{} J put in at events", figure(outcome.event_energy)));
    }
}
