//! From a scene and what was asked for to a plan: method, step, stabilization, output times, and why.
//!
//! A pairing that makes no sense is refused here, before anything is computed, with the reason and an
//! alternative.

mod pairing;
mod rates;
mod rows;

#[cfg(feature = "digits")]
pub(super) use self::pairing::check_forces_of_joints;
pub(super) use self::pairing::usual;

use self::pairing::{check_method, check_vibration, pair};
use self::rates::{fastest_rate, fixed_step, model_error, rate_about_rods, set_in_vain};
use self::rows::{checked_rows, rows};
use super::choice::{Choice, Prefer, choose, least_tolerance, usual_tolerance};
use super::custom::Custom;
use super::fast::{self, FastMode};
use super::methods::{MethodId, Stabilization};
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::shown::{self, figure, order, plain};
use crate::dynamics::{Mechanism, Stiffness, Time};
use crate::scene::{LONGEST_TIME, Scene};
use crate::stepping::{Taylor, Tolerance};

/// What the user asked for; `None` leaves it to the plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    /// Method.
    pub method: Option<MethodId>,
    /// Fixed step \[s\].
    pub step: Option<f64>,
    /// Relative tolerance.
    pub rtol: Option<f64>,
    /// Absolute tolerance.
    pub atol: Option<f64>,
    /// Horizon \[s\].
    pub until: Option<f64>,
    /// Output interval \[s\].
    pub every: Option<f64>,
    /// Stabilization.
    pub stabilize: Option<Stabilization>,
    /// Time constant of Baumgarte's term \[s\].
    pub time_constant: Option<f64>,
    /// First orders in double-double, of the method that has such a setting.
    pub extended: bool,
    /// Evaluations allowed.
    pub max_evaluations: Option<u64>,
    /// What the method is chosen for, where none is named.
    pub prefer: Option<Prefer>,
}

/// Everything a run needs to know beside the mechanism.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Plan {
    /// Method.
    pub method: MethodId,
    /// The step of a fixed-step method \[s\].
    pub step: Option<f64>,
    /// The tolerance of an adaptive method.
    pub tolerance: Option<Tolerance>,
    /// How the rows are kept.
    pub stabilization: Stabilization,
    /// Baumgarte's time constant \[s\]; `None`: five mean steps, measured by a pilot run.
    pub time_constant: Option<f64>,
    /// The first orders of the series in double-double.
    pub extended: bool,
    /// All of the series in double-double, as references are.
    pub in_double_double: bool,
    /// The order of the series, where it is not that of its tolerance.
    #[serde(default)]
    pub order: Option<usize>,
    /// Evaluations allowed, expansions of a series counted alike: a run that needs more stops.
    pub max_evaluations: u64,
    /// Horizon \[s\].
    pub until: f64,
    /// Output interval \[s\].
    pub every: f64,
    /// Rows after the first; the last may come early.
    pub rows: u64,
    /// Why this method, in one line, where it was not asked for.
    pub why: Option<String>,
    /// The fastest mode at the start, of scenes with springs.
    pub stiffness: Option<FastMode>,
    /// What taking stiff springs for rods may do to an angle \[rad\], about: the model's own error, that of
    /// no method.
    pub model_error: Option<f64>,
    /// What was adjusted or left out, one line each.
    pub notes: Vec<String>,
    /// The integrator from outside, of [`MethodId::Custom`].
    #[serde(skip)]
    pub integrator: Option<Custom>,
}

/// Why a request was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}: {reason}\nhint: {alternative}")]
pub struct RequestRefusal {
    /// True where the options contradict one another whatever the scene.
    pub is_usage: bool,
    /// The pairing or option.
    pub what: String,
    /// Why it makes no sense.
    pub reason: String,
    /// What to ask for instead.
    pub alternative: String,
}

/// Evaluations allowed where nobody says: so many at once, and so many a simulated second.  A thousand times
/// what everyday scenes take.
const MAX_EVALUATIONS: (f64, f64) = (1e8, 1e7);
/// The most of them, whatever the horizon, and the most expansions of a series, each of which takes about as
/// long as ten: some minutes to an hour of computing.
const MOST_EVALUATIONS: [f64; 2] = [1e10, 1e9];
/// Most rows a run may write.
pub const MAX_ROWS: f64 = 1e9;
/// So many coordinates are cheaper body by body, with multipliers, than in the matrices that eliminated
/// coordinates and momenta ask for.
pub(in crate::run) const MANY_COORDINATES: usize = 48;

impl Plan {
    /// The same by an integrator from outside; tolerance and step are its own affair, the stabilization is
    /// kept.
    #[must_use]
    pub fn integrated_by(mut self, integrator: Custom) -> Self {
        (self.method, self.step, self.why) = (MethodId::Custom, None, None);
        (self.extended, self.in_double_double, self.order) = (false, false, None);
        self.integrator = Some(integrator);
        self
    }

    /// Decides; see [`Plan::notes`] and [`Plan::why`] for what it decided by itself.
    ///
    /// # Errors
    /// Options out of range, or a pairing of scene, method and stabilization that makes no sense.
    pub fn new(scene: &Scene, mechanism: &Mechanism, request: &Request) -> Result<Self, RequestRefusal> {
        check_method(request)?;
        check_numbers(request)?;
        let until = request.until.unwrap_or(scene.until);
        let mut every = request.every.unwrap_or(scene.every).min(until);
        let mut notes = Vec::new();
        if request.every.is_some_and(|asked| asked > until) {
            notes.push(format!("the output interval is cut to the horizon, {} s", plain(until)));
        }
        let rate = fastest_rate(scene, mechanism);
        let stiffness = Stiffness::at_start(mechanism, &mechanism.start(scene));
        let (method, extended, why) = match request.method {
            Some(method) => (method, request.extended, None),
            None => {
                let Choice { method, extended, why } =
                    choose(mechanism, request, stiffness.as_ref(), until, rate);
                (method, extended, Some(why))
            }
        };
        check_tolerances(request, method, extended)?;
        let stabilization = pair(mechanism, method, request, &mut notes)?;
        let about_rods = rate_about_rods(scene, mechanism);
        check_vibration(mechanism, method, about_rods.unwrap_or(rate), &mut notes)?;
        let (mut step, mut tolerance) = (None, None);
        if method.is_adaptive() {
            let relative =
                request.rtol.unwrap_or_else(|| usual_tolerance(mechanism, method, extended, until));
            tolerance = Some(Tolerance { relative, absolute: request.atol.unwrap_or(relative) });
        } else {
            step = Some(fixed_step(method, request, rate, until, &mut every, &mut notes)?);
        }
        let stiffness = stiffness.map(|found| FastMode::new(found, method, step, until));
        if let Some(mode) = &stiffness {
            mode.check(mechanism, method, request, until)?;
            notes.extend(mode.note(method, until));
        }
        notes.extend(set_in_vain(scene, mechanism));
        let max_evaluations = request.max_evaluations.unwrap_or(usual_max_evaluations(method, until));
        notes.extend(cut_short(method, step, rate, until, max_evaluations));
        let rows = checked_rows(mechanism, request, until, every)?;
        Ok(Self {
            method,
            step,
            tolerance,
            stabilization,
            time_constant: request.time_constant,
            extended,
            in_double_double: false,
            order: None,
            max_evaluations,
            until,
            every,
            rows: rows as u64,
            why,
            stiffness,
            model_error: model_error(mechanism, about_rods, &mut notes),
            notes,
            integrator: None,
        })
    }

    /// A plan nobody asked for: `taylor` at a tolerance to a horizon \[s\], its rows kept as usual.
    pub(super) fn of_series(mechanism: &Mechanism, tolerance: Tolerance, until: f64) -> Self {
        Self {
            method: MethodId::Taylor,
            step: None,
            tolerance: Some(tolerance),
            stabilization: if mechanism.constraints.is_empty() {
                Stabilization::None
            } else {
                usual(mechanism)
            },
            time_constant: None,
            extended: false,
            in_double_double: false,
            order: None,
            max_evaluations: usual_max_evaluations(MethodId::Taylor, until),
            until,
            every: until,
            rows: 1,
            why: None,
            stiffness: None,
            model_error: None,
            notes: Vec::new(),
            integrator: None,
        }
    }

    /// The series of this plan in doubles.
    pub(super) fn series(&self, tolerance: Tolerance) -> Taylor<f64> {
        let mut series = match self.order {
            Some(order) => Taylor::with_order(tolerance.relative.min(tolerance.absolute), order),
            None => Taylor::new(tolerance),
        };
        series.extended = self.extended;
        series
    }

    /// The same to a later horizon \[s\], with the same output times up to the former one; false, and nothing
    /// changed, where they would be too many, or fixed steps would not end there.
    pub(super) fn extend(&mut self, until: f64) -> bool {
        let rows = rows(until, self.every);
        let is_whole = self.step.is_none_or(|step| is_whole(until, step));
        let is_possible = until.is_finite() && rows <= MAX_ROWS && is_whole;
        if is_possible {
            if self.max_evaluations == usual_max_evaluations(self.method, self.until) {
                self.max_evaluations = usual_max_evaluations(self.method, until);
            }
            if let Some(mode) = &mut self.stiffness {
                mode.extend(until / self.until);
            }
            (self.until, self.rows) = (until, rows as u64);
        }
        is_possible
    }

    /// Whether its numbers are such as [`Plan::new`] gives; a plan that was read from a file may hold any.
    pub(super) fn is_sound(&self) -> bool {
        let positive = |value: Option<f64>| value.is_none_or(|value| value > 0.0 && value.is_finite());
        let tolerances = self
            .tolerance
            .is_none_or(|tolerance| positive(Some(tolerance.relative)) && positive(Some(tolerance.absolute)));
        let numbers = [Some(self.until), Some(self.every), self.step, self.time_constant];
        let given = if self.method.is_adaptive() { self.tolerance.is_some() } else { self.step.is_some() }
            && (self.stabilization != Stabilization::Baumgarte || self.time_constant.is_some());
        let is_known = self.method == MethodId::Custom
            || super::methods::METHODS.iter().any(|info| info.id == self.method);
        numbers.into_iter().all(positive)
            && tolerances
            && given
            && self.order.is_none_or(|order| (8..=64).contains(&order))
            && is_known
            && rows(self.until, self.every) == self.rows as f64
    }

    /// Time of output row `row`: a product, never a repeated sum.
    pub fn time(&self, row: u64) -> Time {
        if row >= self.rows {
            return Time::from(self.until);
        }
        match self.step {
            // Rows of a fixed-step run lie on its steps, whose lengths are the double `step` itself.
            Some(step) => DoubleDouble::product(step, (self.every / step).round() * row as f64),
            None => DoubleDouble::product(self.every, row as f64),
        }
    }

    /// The folder of its results: method, setting and stabilization.
    pub fn folder(&self, mechanism: &Mechanism) -> String {
        let setting = match (self.step, self.tolerance) {
            (Some(step), _) => format!("{step}s"),
            (None, Some(tolerance)) if tolerance.absolute != tolerance.relative => {
                format!("{:e}-{:e}", tolerance.relative, tolerance.absolute)
            }
            (None, tolerance) => format!("{:e}", tolerance.unwrap_or_default().relative),
        };
        let setting = if self.extended { setting + "-extended" } else { setting };
        let keeps_rows = !mechanism.constraints.is_empty() && !matches!(self.method, MethodId::Rattle(_));
        if keeps_rows {
            format!("{}-{setting}-{}", self.method, self.stabilization)
        } else {
            format!("{}-{setting}", self.method)
        }
    }
}

/// Evaluations allowed up to a horizon \[s\] where nobody says how many.
fn usual_max_evaluations(method: MethodId, until: f64) -> u64 {
    (MAX_EVALUATIONS.0 + MAX_EVALUATIONS.1 * until)
        .min(MOST_EVALUATIONS[usize::from(method == MethodId::Taylor)]) as u64
}

/// How a note ends that says that the evaluations allowed may not do.
pub(super) const MORE_IS_ALLOWED: &str = "--max-evaluations allows more, with `resume` too";

/// What there is to say of a horizon \[s\] that lies beyond what the evaluations allowed can reach, where the
/// scene's rates go up to `rate` \[rad/s\].
fn cut_short(
    method: MethodId,
    step: Option<f64>,
    rate: f64,
    until: f64,
    max_evaluations: u64,
) -> Option<String> {
    let steps = step.map_or(until * rate / fast::radians_a_step(method), |step| until / step);
    let reached = max_evaluations as f64 / (steps * fast::evaluations_a_step(method)) * until;
    (reached < until).then(|| {
        format!(
            "{} s take {method} about {}, and {} evaluations are allowed: it may stop at about \
                {} s; {MORE_IS_ALLOWED}",
            plain(until),
            shown::steps(steps),
            figure(max_evaluations as f64),
            order(reached)
        )
    })
}

/// True where so many steps end on the horizon.
fn is_whole(until: f64, step: f64) -> bool {
    let steps = (until / step).round();
    (until / step - steps).abs() <= 1e-9 * steps
}

/// Every number asked for must be positive and finite; steps and tolerances must suit one another.
fn check_numbers(request: &Request) -> Result<(), RequestRefusal> {
    let positive = [
        ("--step", request.step, LONGEST_TIME),
        ("--until", request.until, LONGEST_TIME),
        ("--every", request.every, LONGEST_TIME),
        ("--time-constant", request.time_constant, LONGEST_TIME),
    ];
    for (option, value, most) in positive {
        if let Some(value) = value.filter(|&value| !(value > 0.0 && value <= most)) {
            return Err(usage(
                option,
                format!("{} is not a number of seconds above 0 and up to {most:e}", plain(value)),
                "give a positive number of seconds",
            ));
        }
    }
    if request.extended && request.method.is_some_and(|method| method != MethodId::Taylor) {
        let reason = "it carries the first orders of a series in double-double, and only taylor has one";
        return Err(usage("--extended", reason.into(), "--method taylor, or leave it out"));
    }
    if let (Some(method), true) = (request.method, request.rtol.is_some() || request.atol.is_some())
        && !method.is_adaptive()
    {
        let reason =
            "a fixed-step symplectic method takes no tolerance: adapting the step destroys what it is for";
        return Err(usage(
            &format!("{method} with a tolerance"),
            reason.into(),
            "give --step, or --method dop853 with the tolerance",
        ));
    }
    if let (Some(method), Some(_)) = (request.method, request.step)
        && method.is_adaptive()
    {
        let reason = "an adaptive method finds its own step";
        return Err(usage(
            &format!("{method} with --step"),
            reason.into(),
            "give --rtol, or --method gauss16 with the step",
        ));
    }
    if request.step.is_some() && (request.rtol.is_some() || request.atol.is_some()) {
        return Err(usage(
            "--step with a tolerance",
            "a method takes one or the other".into(),
            "leave one of them out",
        ));
    }
    if request.time_constant.is_some() && request.stabilize != Some(Stabilization::Baumgarte) {
        let reason = "it is the time constant of Baumgarte's term, and of nothing else";
        return Err(usage("--time-constant", reason.into(), "--stabilize baumgarte, or leave it out"));
    }
    Ok(())
}

/// Tolerances must be such as the method makes use of.
fn check_tolerances(request: &Request, method: MethodId, extended: bool) -> Result<(), RequestRefusal> {
    let least = least_tolerance(method, extended);
    for (option, value) in [("--rtol", request.rtol), ("--atol", request.atol)] {
        if let Some(value) = value.filter(|&value| !(least..=0.1).contains(&value)) {
            let by = if extended { format!("{method} --extended") } else { method.to_string() };
            return Err(usage(
                option,
                format!("{} is not within {least:e} to 0.1, what {by} takes", plain(value)),
                "1e-9 is a good beginning",
            ));
        }
    }
    Ok(())
}

fn usage(what: &str, reason: String, alternative: &str) -> RequestRefusal {
    RequestRefusal { is_usage: true, what: what.into(), reason, alternative: alternative.into() }
}

fn mismatch(what: String, reason: &str, alternative: &str) -> RequestRefusal {
    RequestRefusal { is_usage: false, what, reason: reason.into(), alternative: alternative.into() }
}
