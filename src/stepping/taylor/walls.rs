//! What walls ask of a step: how far their laws are known, and the powers of event functions.

use super::expansion::Expansion;
use crate::dynamics::impact::Contact;
use crate::dynamics::series::{Coefficient, Series, powers};
use crate::dynamics::{Form, Mechanism, Time};

/// How far ahead the series of the laws of walls are known to rounding \[s\].
pub(super) fn walls_known<T: Coefficient>(mechanism: &Mechanism, t: Time, series: &Series<T>) -> f64 {
    let order = series.order();
    let known = |contact: &Contact| {
        let powers = match (&contact.row.law, &contact.row.aim) {
            _ if contact.is_off => return None,
            (_, Some(aim)) => series.aim(aim).iter().map(|power| power.value()).collect(),
            (Some(law), None) => powers(law, t, order + 1),
            (None, None) => return None,
        };
        let last = powers.iter().enumerate().skip(order.saturating_sub(3).max(3));
        last.map(|(m, power)| (f64::EPSILON * contact.length / power.abs()).powf(1.0 / m as f64))
            .reduce(f64::min)
    };
    mechanism.contacts.iter().filter_map(known).fold(f64::INFINITY, f64::min)
}

/// Powers of an event function along the series: the gap of a wall over its contact's length, or the force on
/// a point held there over its contact's force.
pub(super) fn trace<T: Coefficient, P: Form + ?Sized>(
    problem: &P,
    expansion: &Expansion<T>,
    t: Time,
    contact: usize,
    powers: &mut Vec<f64>,
) {
    let mechanism = problem.mechanism();
    let series = expansion.series();
    match mechanism.held.iter().position(|&held| held == contact) {
        None => series.gap(&mechanism.contacts[contact], t, powers),
        Some(place) => {
            powers.clear();
            powers.extend((0..series.order()).map(|m| expansion.pressure(place, m)));
        }
    }
}
