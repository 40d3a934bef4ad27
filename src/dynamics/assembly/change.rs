//! What of a start is not as the scene gives it.

use super::SAME;
use super::newton::{AssemblyProblem, GivenNumber, Goal};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::forest::BodyOrigin;
use serde::Serialize;

/// A number of the start that is not what the scene gives.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StartChange {
    /// The bar.
    pub body: String,
    /// `phi`, `omega`, `origin.x`, …
    pub quantity: String,
    /// As given.
    pub given: f64,
    /// As used.
    pub used: f64,
    /// Its unit.
    pub unit: &'static str,
}

impl std::fmt::Display for StartChange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { body, quantity, given, used, unit } = self;
        write!(f, "{quantity} of {body} is {used:?} {unit} at the start instead of {given:?} {unit}")
    }
}

impl StartChange {
    /// Where the scene gives it: `start.bar1.phi`, `start.ball.origin[0]`.
    pub fn path(&self) -> String {
        let (quantity, place) = match self.quantity.split_once('.') {
            Some((quantity, axis)) => (quantity, if axis == "x" { "[0]" } else { "[1]" }),
            None => (self.quantity.as_str(), ""),
        };
        format!("start.{}.{quantity}{place}", self.body)
    }
}

impl AssemblyProblem<'_> {
    /// What of the positions is not as given.
    pub(super) fn changes(&self, q: &[DoubleDouble], aims: &[GivenNumber]) -> Vec<StartChange> {
        aims.iter()
            .zip(self.measured(q))
            .filter_map(|(aim, used)| self.change(aim, used, ["phi", "origin"], ["rad", "m"]))
            .collect()
    }

    pub(super) fn change(
        &self,
        aim: &GivenNumber,
        used: f64,
        [turn, shift]: [&str; 2],
        [of_turn, of_shift]: [&'static str; 2],
    ) -> Option<StartChange> {
        let is_angle = aim.goal == Goal::Coordinate(aim.bar);
        let scale = if is_angle { 1.0 } else { self.size };
        if (used - aim.given).abs() <= SAME * scale.max(aim.given.abs()) {
            return None;
        }
        let is_x = match aim.goal {
            Goal::Coordinate(k) => self.mechanism.forest.hangs[aim.bar].origin_point == BodyOrigin::Free(k),
            Goal::Origin(axis) => axis.re == 1.0,
        };
        let quantity =
            if is_angle { turn.to_owned() } else { format!("{shift}.{}", if is_x { "x" } else { "y" }) };
        let body = self.mechanism.bodies[aim.bar].name.clone();
        Some(StartChange {
            body,
            quantity,
            given: aim.given,
            used,
            unit: if is_angle { of_turn } else { of_shift },
        })
    }

    /// What of the rates is not as given.
    pub(super) fn rate_changes(
        &self,
        aims: &[GivenNumber],
        q: &[DoubleDouble],
        omega: &[DoubleDouble],
    ) -> Vec<StartChange> {
        let z = self.unit_vectors::<DoubleDouble>(q).1;
        let change = |aim: &GivenNumber| {
            self.change(aim, self.aim_rate(aim, &z, omega).hi, ["omega", "velocity"], ["rad/s", "m/s"])
        };
        aims.iter().filter_map(change).collect()
    }
}
