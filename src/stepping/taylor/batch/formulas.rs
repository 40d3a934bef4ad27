//! How far the series of a mechanism with formulas, or with bodies that float, carries, lane by lane: as in
//! [`Taylor`](super::super::Taylor), since nothing bounds how fast a formula may change.

use super::super::JUDGES;
use super::super::confirm::{self, Accelerations};
use super::super::step_size;
use super::LaneStep;
use crate::arithmetic::eight::{LANES, Octet};
use crate::dynamics::elimination::Elimination;
use crate::dynamics::multiplier::Multiplier;
use crate::dynamics::{Mechanism, OdeSystem, State};
use std::sync::Arc;

/// The longest step in units of time, where every power but the first vanishes.
pub(super) const LONGEST: f64 = 1e9;

/// The equations in the coordinates of the lanes.
#[derive(Debug)]
enum Equations {
    Independent(Box<Elimination<0>>),
    All(Box<Multiplier<0, true>>),
}

/// What steps are judged by.
#[derive(Debug, Default)]
pub(super) struct StepJudge {
    /// Those of every lane, where steps of formulas need it: see [`confirm`].
    equations: [Option<Equations>; LANES],
    inside: State,
    rates: Vec<f64>,
    both: Accelerations,
}

/// Where the steps of the lanes begin, and the powers of its rates, coordinate by coordinate.
#[derive(Clone, Copy)]
pub(super) struct Begun<'a> {
    /// Coordinates and rates (2f).
    pub high: &'a [Octet],
    /// Powers ((P+1) × f).
    pub rates: &'a [Octet],
    pub coordinates: usize,
    /// So many of the coordinates are angles; the others count over the unit of length \[1/m\].
    pub angles: usize,
    pub per_length: f64,
}

impl StepJudge {
    /// Takes the mechanism of the trajectory in a lane.
    pub(super) fn take_in(&mut self, lane: usize, mechanism: &Mechanism) {
        let equations = || match (mechanism.has_multipliers(), Arc::new(mechanism.clone())) {
            (true, mechanism) => Equations::All(Box::new(Multiplier::new(mechanism))),
            (false, mechanism) => Equations::Independent(Box::new(Elimination::new(mechanism))),
        };
        self.equations[lane] = mechanism.needs_confirmation().then(equations);
    }

    /// Of the step a lane wants as much as its series carries \[s\].
    pub(super) fn allowed(&mut self, begun: Begun, step: &LaneStep, order: usize, tolerance: f64) -> f64 {
        let lane = step.lane;
        let Begun { rates, coordinates: f, angles, per_length, .. } = begun;
        let power = |k: usize, c: usize| rates[k * f + c].0[lane] * if c < angles { 1.0 } else { per_length };
        let largest = |k: usize| (0..f).fold(0.0, |most: f64, c| most.max(power(k, c).abs())) * step.unit;
        let last: [f64; JUDGES] = std::array::from_fn(|back| largest(order - back));
        let wanted = step_size::falling(tolerance, order, (&last, largest), step.wanted);
        let h = wanted.min(step.left);
        let confirmed = self.confirmed(begun, step, (order, tolerance), h);
        if confirmed < h { confirmed } else { wanted }
    }

    /// Of the step `h` \[s\] as much as the equations confirm.
    fn confirmed(
        &mut self,
        Begun { high, rates, coordinates: f, .. }: Begun,
        &LaneStep { lane, time: begin, .. }: &LaneStep,
        (order, tolerance): (usize, f64),
        h: f64,
    ) -> f64 {
        let Self { equations, inside, rates: found, both } = self;
        let Some(equations) = &mut equations[lane] else { return h };
        let dimension = match equations {
            Equations::Independent(equations) => equations.dimension(),
            Equations::All(equations) => equations.dimension(),
        };
        inside.y.resize(dimension, 0.0);
        found.resize(dimension, 0.0);
        confirm::confirmed(tolerance, h, both, |t, [series, by_equations]| {
            series.clear();
            for c in 0..f {
                let (mut angle, mut rate, mut acceleration) = (0.0, 0.0, 0.0);
                for k in (1..=order).rev() {
                    let power = rates[k * f + c].0[lane];
                    angle = angle * t + power / (k + 1) as f64;
                    rate = rate * t + power;
                    acceleration = acceleration * t + k as f64 * power;
                }
                let start = rates[c].0[lane];
                inside.y[c] = high[c].0[lane] + t * (start + t * angle);
                inside.y[f + c] = start + t * rate;
                series.push(acceleration);
            }
            let time = begin + t;
            match equations {
                Equations::Independent(equations) => equations.rhs(time, &inside.y, found),
                Equations::All(equations) => equations.rhs(time, &inside.y, found),
            }
            by_equations.clear();
            by_equations.extend_from_slice(&found[f..2 * f]);
        })
    }
}
