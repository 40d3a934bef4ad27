//! What is said of a stiff scene before it is run: which spring is fast, how many of its periods there are to
//! follow, and in about how many steps.
//!
//! A fast mode that swings is resolved, whatever it takes: its energy acts on the slow motion, and a method
//! that damps it away returns a wrong one, smoothly. Past 1e8 radians that wants to be asked for, and as much
//! of a mode that grows.

use super::methods::MethodId;
use super::plan::{Request, RequestRefusal};
use crate::arithmetic::shown::{estimate, order, plain, steps};
use crate::dynamics::{Mechanism, Stiffness};

/// How much faster than all else a mode must be to be worth a note.
const STIFF: f64 = 30.0;
/// Phase of a fast mode up to which it is followed unasked \[rad\]: about half a minute of computing.
const MOST_RADIANS: f64 = 1e8;
/// Share of the energy scale from which the energy of a fast mode counts.
const EXCITED: f64 = 1e-6;

/// The fastest mode at the start of a run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FastMode {
    /// The spring or damper it belongs to, if any.
    pub spring: Option<String>,
    /// Its rate \[rad/s\].
    pub rate: f64,
    /// How fast it dies away \[1/s\]; negative where it grows.
    pub decay: f64,
    /// The rate of all else \[rad/s\].
    pub slow: f64,
    /// Its periods to the horizon; zero where it dies away within a few, or grows as fast.
    pub periods: f64,
    /// About how many steps the method takes to follow it; zero where it need not.
    pub steps: f64,
    /// Energy in it over the energy scale, where it is a spring's.
    pub energy_share: Option<f64>,
}

impl FastMode {
    /// What is `found` of the start, on the way to `until` \[s\] by a method; `step` is that of a fixed-step
    /// method \[s\].
    pub fn new(found: Stiffness, method: MethodId, step: Option<f64>, until: f64) -> Self {
        let swings = !found.is_damped() && !found.is_growing();
        let passes = found.is_damped() && matches!(method, MethodId::Radau(_));
        let steps = step.map_or(found.radians(until) / radians_a_step(method), |step| until / step);
        Self {
            periods: if swings { found.periods(until) } else { 0.0 },
            steps: if passes { 0.0 } else { steps },
            spring: found.culprit,
            rate: found.fastest,
            decay: found.decay,
            slow: found.slow,
            energy_share: found.share,
        }
    }

    /// The same to a horizon so many times as late.
    pub(super) fn extend(&mut self, times: f64) {
        self.periods *= times;
        self.steps *= times;
    }

    /// True where it is so much faster than all else that it decides what a run costs.
    pub fn is_stiff(&self) -> bool {
        self.rate > STIFF * self.slow
    }

    /// True where it swings on, period after period.
    fn swings(&self) -> bool {
        self.periods > 0.0
    }

    /// True where it grows, by more than a tenth of its rate.
    fn grows(&self) -> bool {
        !self.swings() && self.decay < 0.0
    }

    /// What it does on the way to `until` \[s\] beside dying away.
    fn course(&self, until: f64) -> String {
        let rate = estimate(self.rate);
        match self.grows() {
            true => format!("grows at {rate} /s at the start"),
            false => {
                let periods = estimate(self.periods);
                format!("oscillates at {rate} rad/s, {periods} periods until t = {} s", plain(until))
            }
        }
    }

    fn name(&self) -> String {
        self.spring.as_ref().map_or_else(|| "the fastest mode".into(), |name| format!("spring {name}"))
    }

    /// Refuses to follow very many periods, or as much growth, unless that is asked for; Radau methods do not
    /// follow periods, and fixed steps are what they were asked to be.
    ///
    /// # Errors
    /// More than 1e8 rad, no effort stated.
    pub fn check(
        &self,
        mechanism: &Mechanism,
        method: MethodId,
        request: &Request,
        until: f64,
    ) -> Result<(), RequestRefusal> {
        let is_asked_for = request.max_evaluations.is_some()
            || !method.is_adaptive()
            || self.swings() && matches!(method, MethodId::Radau(_));
        if is_asked_for || !(self.swings() || self.grows()) || self.rate * until <= MOST_RADIANS {
            return Ok(());
        }
        let is_spring = mechanism.springs.iter().any(|spring| self.spring.as_ref() == Some(&spring.name));
        let rigid = if is_spring { "\"model\": \"rigid\" for the spring, " } else { "" };
        let alternative =
            format!("a shorter --until, {rigid}or --max-evaluations with the evaluations that may take");
        Err(RequestRefusal {
            is_usage: false,
            what: format!("{} over {} s", self.name(), plain(until)),
            reason: format!("it {}, about {}", self.course(until), steps(self.steps)),
            alternative,
        })
    }

    /// What there is to say of it, if it is stiff.
    pub fn note(&self, method: MethodId, until: f64) -> Option<String> {
        if !self.is_stiff() {
            return None;
        }
        let name = self.name();
        if !(self.swings() || self.grows()) {
            let cost = if self.steps > 0.0 {
                format!("; {method} follows it in about {}", steps(self.steps))
            } else {
                String::new()
            };
            return Some(format!(
                "{name} is stiff, {} rad/s, and dies away at {} /s{cost}",
                estimate(self.rate),
                estimate(self.decay)
            ));
        }
        let course = format!("{name} {}", self.course(until));
        if self.grows() && matches!(method, MethodId::Radau(_)) {
            return Some(format!("{course}; {method} takes short steps as long as it does"));
        }
        let followed = format!("{course}, about {}", steps(self.steps));
        Some(match (method, self.energy_share) {
            (MethodId::Radau(_), Some(share)) if share > EXCITED => {
                format!(
                    "{course}; {method} takes its energy away, {} of the scale, wherever its steps are \
                        longer than a period",
                    order(share)
                )
            }
            (_, Some(share)) => format!("{followed}; energy in it {} of the scale", order(share)),
            (_, None) => followed,
        })
    }
}

/// Phase of a fast mode in a step that follows it, about: by stability for the explicit methods at everyday
/// tolerances, by the radius of convergence for the series.
pub(super) fn radians_a_step(method: MethodId) -> f64 {
    match method {
        MethodId::Dopri5 | MethodId::Dp5 => 0.5,
        MethodId::Dop853 | MethodId::Dp8 => 2.0,
        MethodId::Taylor => 2.6,
        _ => 1.0,
    }
}

/// Evaluations of the equations in a step, at least; an expansion of a series counts as one.
pub(super) fn evaluations_a_step(method: MethodId) -> f64 {
    match method {
        MethodId::Dopri5 | MethodId::Dp5 => 6.0,
        MethodId::Dop853 | MethodId::Dp8 => 11.0,
        MethodId::Radau(stages) => 2.0 * stages as f64,
        MethodId::Gauss(stages) => 4.0 * stages as f64,
        MethodId::Taylor | MethodId::Rattle(_) | MethodId::Custom => 1.0,
    }
}
