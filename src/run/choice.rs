//! The method for a run nobody named one for, and why, in one line.
//!
//! | asked | what decides | method |
//! | --- | --- | --- |
//! | 1 | extended orders | `taylor` has them |
//! | 2 | dry friction | `taylor`; `radau9` for damped modes that are stiff; `dp8` where matrices do not pay |
//! | 3 | more coordinates than matrices pay for | `taylor`; `dop853`, `dp8` with rows, without matrices |
//! | 4 | a rigid spring that vibrates | `dp8`, `dop853`: its mean force is known to them |
//! | 5 | laws that depend on where the mechanism is | `dp8`, `dop853` |
//! | 6 | a fixed step | `gauss16`, the most accurate of those |
//! | 7 | a mode much faster than the rest that dies away | `radau5`, `radau9` below 1e-7 |
//! | 8 | walls | `dp8` locates impacts, `taylor` over long horizons |
//! | 9 | invariants asked for, without dampers | `taylor`, extended; `gauss16` where coordinates are many |
//! | 10 | the path | `taylor`; `dop853` with Baumgarte's term, or of many coordinates not body by body |
//!
//! Everywhere else the series is the faster one at every tolerance measured: a seventh of the time of the
//! classic pairs at 1e-6, a sixteenth at 1e-9. Over long horizons too: at 1e-15, which leaves rounding as
//! what drifts, `motor` is off by 6e-14 of its energy after 5000 s, for a sixtieth of the time of
//! `gauss16`; with first orders in double-double by 1e-18 for a tenth (`gauss16`: 1e-20), `spring` by 5e-20
//! for a quarter (1e-21).

use super::methods::{MethodId, Stabilization};
use super::plan::{MANY_COORDINATES, Request, usual};
use crate::arithmetic::shown::plain;
use crate::dynamics::Mechanism;
use crate::dynamics::stiffness::Stiffness;
use crate::stepping::Taylor;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Runs of at least so many units of time (seconds, where the mechanism is of human size) take a tolerance
/// that leaves rounding as what drifts, where nobody names one.
const LONG: f64 = 60.0;
/// Steps beyond which a fixed step is not chosen unasked.
const MANY_STEPS: f64 = 2e7;
/// Radians of the fastest motion in a step of `gauss16`.
const STEP: f64 = 0.12;
/// How many times faster than the rest a mode that dies away must be for an implicit method to pay, and the
/// phase it must run through until the horizon \[rad\].
const STIFF: f64 = 300.0;
/// Tolerances below this are for the five-stage method.
const TIGHT: f64 = 1e-7;
/// Coordinates beyond which the matrices of a series cost more than the evaluations it saves.
const FEW_COORDINATES: usize = 12;

/// Tolerance of a series over a long horizon, times the horizon in units of time.  At 1e-9 `free` drifts by
/// 4e-11 of its energy a second, 0.04 of the tolerance: truncation adds 4e-15 in all, the rounding of a
/// thousand seconds.
const LONG_TOLERANCE: f64 = 1e-13;

/// Why the series is chosen where invariants were asked for: its first orders are then carried in
/// double-double.
const EXTENDED: &str = "invariants were asked for, and with its first orders in double-double its series \
    keeps them best for the time";

/// Why a symplectic method is chosen there.
const SYMPLECTIC: &str = "invariants were asked for, and a symplectic method keeps them best";

/// What matters more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Prefer {
    /// Where everything is at each time.
    Path,
    /// Energy and constraints, over long horizons.
    Invariants,
}

impl Prefer {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Path, Self::Invariants];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Invariants => "invariants",
        }
    }
}

impl fmt::Display for Prefer {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Prefer {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|prefer| prefer.name() == name)
            .ok_or_else(|| format!("no preference `{name}`; there are path, invariants"))
    }
}

/// A method nobody named.
pub(super) struct Choice {
    pub method: MethodId,
    /// With first orders in double-double.
    pub extended: bool,
    /// Why, in one line.
    pub why: String,
}

/// The method for a run to `until` \[s\] of a mechanism so stiff at its start, where the scene's rates go up
/// to `rate` \[rad/s\], and why.
pub(super) fn choose(
    mechanism: &Mechanism,
    request: &Request,
    stiffness: Option<&Stiffness>,
    until: f64,
    rate: f64,
) -> Choice {
    let (method, why) = chosen(mechanism, request, stiffness, until, rate);
    let is_met = why == EXTENDED || why == SYMPLECTIC;
    let extended = request.extended || why == EXTENDED;
    let unmet = match request.prefer {
        Some(Prefer::Invariants) if !is_met && !extended => {
            format!("; invariants were asked for, but {}", obstacle(mechanism, request))
        }
        _ => String::new(),
    };
    Choice { method, extended, why: format!("{method}: {why}{unmet}") }
}

/// Why no method is chosen for the sake of invariants.
fn obstacle(mechanism: &Mechanism, request: &Request) -> &'static str {
    let kept = request.stabilize.unwrap_or(usual(mechanism));
    if request.step.is_some() || request.rtol.or(request.atol).is_some() {
        "a step or a tolerance decides how well they are kept"
    } else if !mechanism.contacts.is_empty() || !mechanism.frictions.is_empty() {
        "walls and dry friction decide"
    } else if mechanism.is_damped() {
        "dampers take energy"
    } else if mechanism.is_switched() {
        "events or branches change what acts"
    } else if !mechanism.constraints.is_empty() && kept != Stabilization::Elimination {
        "constraints are kept by projection, and not eliminated"
    } else {
        "what acts or how many coordinates there are decides first"
    }
}

/// The tolerance of a method for a run to `until` \[s\] where nobody names one.  What truncation leaves adds
/// up: over a long horizon it is kept below rounding, by the methods for which that costs little.
pub(super) fn usual_tolerance(mechanism: &Mechanism, method: MethodId, extended: bool, until: f64) -> f64 {
    match method {
        _ if extended => 1e-20,
        MethodId::Taylor if is_long(mechanism, until) => long_tolerance(mechanism, until),
        MethodId::Dp8 | MethodId::Dop853 if is_long(mechanism, until) => 1e-13,
        _ => 1e-9,
    }
}

/// The power of ten up to 1e-15 at which the truncation of a series up to `until` \[s\] is below its
/// rounding.
fn long_tolerance(mechanism: &Mechanism, until: f64) -> f64 {
    // Past 1e-15 only the lanes are known to get better: elsewhere the last orders of a series are rounding.
    let decades: &[f64] =
        if Taylor::has_lanes(mechanism, false) { &[1e-15, 1e-16, 1e-17, 1e-18, 1e-19] } else { &[1e-15] };
    let wanted = LONG_TOLERANCE * mechanism.units.time / until * (1.0 + 1e-9);
    decades.iter().copied().find(|&decade| decade <= wanted).unwrap_or(decades[decades.len() - 1])
}

/// The least tolerance that a method makes any use of.
pub(super) fn least_tolerance(method: MethodId, extended: bool) -> f64 {
    match method {
        // Far below what the later orders are rounded to.
        _ if extended => 1e-25,
        // Its later orders weigh less than its first ones are rounded to.
        MethodId::Taylor => 1e-19,
        _ => 1e-15,
    }
}

fn is_long(mechanism: &Mechanism, until: f64) -> bool {
    until >= LONG * mechanism.units.time
}

/// True where a mode that dies away makes an implicit method pay in a run to `until` \[s\].
fn is_overdamped(stiffness: &Stiffness, until: f64) -> bool {
    stiffness.is_damped() && stiffness.ratio() > STIFF && stiffness.radians(until) > STIFF
}

/// What the choice of a method rests on.
struct Situation<'a> {
    mechanism: &'a Mechanism,
    request: &'a Request,
    stiffness: Option<&'a Stiffness>,
    /// Horizon \[s\].
    until: f64,
    /// How constraints are kept, where there are any.
    kept: Stabilization,
    has_rows: bool,
    /// True without walls.
    is_free: bool,
    /// Number of coordinates.
    n: usize,
    /// True where a series keeps the constraints.
    is_kept: bool,
    /// True where the series is that of the bodies one by one.
    is_expanded: bool,
}

impl Situation<'_> {
    /// The classic pair that keeps the constraints, in steps of its own where walls ask for that.
    fn classic(&self) -> MethodId {
        match self.is_free && !(self.has_rows && self.kept == Stabilization::Projection) {
            true => MethodId::Dop853,
            false => MethodId::Dp8,
        }
    }

    /// The tolerance asked for.
    fn tolerance(&self) -> Option<f64> {
        self.request.rtol.or(self.request.atol)
    }

    /// The stiffness of a mode that makes an implicit method pay.
    fn overdamped(&self) -> Option<&Stiffness> {
        self.stiffness.filter(|stiffness| is_overdamped(stiffness, self.until))
    }

    /// Where parts of the scene leave few methods: friction, very many bodies, vibrating rods, aims.
    fn by_parts(&self) -> Option<(MethodId, String)> {
        let Self { mechanism, n, .. } = *self;
        let is_adaptive = self.request.step.is_none();
        if !mechanism.frictions.is_empty() && is_adaptive {
            let method = match n > MANY_COORDINATES {
                true => MethodId::Dp8,
                false if self.overdamped().is_some() => MethodId::Radau(5),
                false => MethodId::Taylor,
            };
            let why = "the scene has dry friction, whose transitions are located on its dense output";
            return Some((method, why.into()));
        }
        if n > MANY_COORDINATES && self.is_free && is_adaptive {
            let method = match (self.is_expanded, self.has_rows) {
                (true, _) => MethodId::Taylor,
                (false, true) => MethodId::Dp8,
                (false, false) => MethodId::Dop853,
            };
            return Some((method, format!("{n} coordinates are taken body by body")));
        }
        if let Some(vibration) = &mechanism.vibration {
            let why = format!("the vibration of rigid spring {} acts by its mean force", vibration.name);
            return Some((self.classic(), why));
        }
        (mechanism.has_aims() && is_adaptive)
            .then(|| (self.classic(), "laws of motors or walls depend on where the mechanism is".into()))
    }

    /// Where a fixed step is given.
    fn by_step(&self) -> Option<(MethodId, String)> {
        self.request.step?;
        let why = if self.mechanism.has_closed_loops() {
            "closed loops and sliders are kept by symmetric projection"
        } else {
            "it is the most accurate such method"
        };
        Some((MethodId::Gauss(8), format!("a fixed step was given; {why}")))
    }

    /// Where a stiff mode dies away.
    fn by_damping(&self) -> Option<(MethodId, String)> {
        let damped = self.overdamped()?;
        let stages = if self.tolerance().unwrap_or_default() >= TIGHT { 3 } else { 5 };
        let mode = damped
            .culprit
            .as_ref()
            .map_or("the fastest mode".to_owned(), |name| format!("the mode of {name}"));
        let why = format!("{mode} is {:.0} times as fast as the rest, and dies away", damped.ratio());
        Some((MethodId::Radau(stages), why))
    }

    /// Where there are walls.
    fn by_walls(&self) -> Option<(MethodId, String)> {
        if self.is_free {
            return None;
        }
        // Over 150 s of `wall` the tolerance that leaves rounding costs `dp8` 2.6 times as much, for a
        // thousand times the drift.
        let is_series = self.tolerance().is_none()
            && is_long(self.mechanism, self.until)
            && self.n <= FEW_COORDINATES
            && self.is_kept;
        Some(match is_series {
            true => (
                MethodId::Taylor,
                format!(
                    "over {} s its series drifts by rounding only, and impacts are located on it",
                    plain(self.until)
                ),
            ),
            false => (MethodId::Dp8, "the scene has walls, and impacts are located inside its steps".into()),
        })
    }

    /// Where invariants are asked for and can be kept; the scene's rates go up to `rate` \[rad/s\].
    fn by_invariants(&self, rate: f64) -> Option<(MethodId, String)> {
        let mechanism = self.mechanism;
        let is_eliminated = !self.has_rows || self.kept == Stabilization::Elimination;
        let fastest = self.stiffness.map_or(rate, |stiffness| stiffness.fastest.max(rate));
        let is_bearable = self.until * fastest / STEP <= MANY_STEPS;
        let keeps =
            self.tolerance().is_none() && !mechanism.is_damped() && !mechanism.is_switched() && is_eliminated;
        let method = || match self.n > FEW_COORDINATES && is_bearable {
            true => (MethodId::Gauss(8), SYMPLECTIC.into()),
            false => (MethodId::Taylor, EXTENDED.into()),
        };
        (self.request.prefer == Some(Prefer::Invariants) && keeps).then(method)
    }

    /// For all others: the series, where it pays.
    fn by_cost(&self) -> (MethodId, String) {
        let Self { mechanism, request, n, .. } = *self;
        if self.kept == Stabilization::Baumgarte && self.has_rows {
            let why = "Baumgarte's term is a force, and the everyday choice takes any";
            return (MethodId::Dop853, why.into());
        }
        if n > FEW_COORDINATES && !self.is_expanded {
            return (self.classic(), format!("{n} coordinates are cheaper to evaluate than to expand"));
        }
        let fast = self.stiffness.filter(|stiffness| stiffness.ratio() > STIFF && !stiffness.is_damped());
        let why = if let Some(name) = fast.and_then(|fast| fast.culprit.as_ref()) {
            format!("spring {name} vibrates undamped and is resolved, which its long steps do best")
        } else if mechanism.has_closed_loops() {
            "closed loops and sliders are kept by projection, and its steps pass singular positions".into()
        } else if request.prefer == Some(Prefer::Path) {
            "the path was asked for, and its series is the most accurate for the time".into()
        } else if self.tolerance().is_some() {
            "a tolerance was given, and its series is the fastest to it".into()
        } else if mechanism.is_damped() {
            "the scene is damped, and its series is the most accurate for the time".into()
        } else if is_long(mechanism, self.until) {
            format!("over {} s its series drifts by rounding only, for the least time", plain(self.until))
        } else {
            "over a short horizon its series is the most accurate for the time".into()
        };
        (MethodId::Taylor, why)
    }
}

/// The method and why, by the first reason that there is.
fn chosen(
    mechanism: &Mechanism,
    request: &Request,
    stiffness: Option<&Stiffness>,
    until: f64,
    rate: f64,
) -> (MethodId, String) {
    if request.extended {
        return (MethodId::Taylor, "extended orders are those of its series".into());
    }
    let kept = request.stabilize.unwrap_or(usual(mechanism));
    let has_rows = !mechanism.constraints.is_empty();
    let is_kept = kept == Stabilization::None || kept == Stabilization::Projection || !has_rows;
    let situation = Situation {
        mechanism,
        request,
        stiffness,
        until,
        kept,
        has_rows,
        is_free: mechanism.contacts.is_empty(),
        n: mechanism.coordinates(),
        is_kept,
        is_expanded: mechanism.recursion.is_some() && is_kept && mechanism.has_series(),
    };
    (situation.by_parts())
        .or_else(|| situation.by_step())
        .or_else(|| situation.by_damping())
        .or_else(|| situation.by_walls())
        .or_else(|| situation.by_invariants(rate))
        .unwrap_or_else(|| situation.by_cost())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Plan;
    use crate::scene::read_scene;

    fn why(scene: &str, overrides: &[&str], request: Request) -> (String, String) {
        let overrides: Vec<_> = overrides.iter().map(|text| text.parse().expect("an override")).collect();
        let scene = read_scene(format!("examples/{scene}.json").as_ref(), &overrides).expect("a scene");
        let mechanism = Mechanism::new(&scene).expect("a mechanism");
        let plan = Plan::new(&scene, &mechanism, &request).expect("a plan");
        (plan.method.to_string(), plan.why.expect("a reason"))
    }

    #[test]
    fn the_scene_and_what_is_asked_for_decide() {
        let usual = Request::default;
        let chosen = |scene, request| why(scene, &[], request).0;
        assert_eq!(chosen("scenes/free", usual()), "taylor");
        assert_eq!(chosen("scenes/free", Request { until: Some(1000.0), ..usual() }), "taylor");
        assert_eq!(
            chosen("scenes/free", Request { until: Some(1000.0), prefer: Some(Prefer::Path), ..usual() }),
            "taylor"
        );
        assert_eq!(chosen("scenes/free", Request { prefer: Some(Prefer::Invariants), ..usual() }), "taylor");
        assert_eq!(chosen("scenes/free", Request { step: Some(0.01), ..usual() }), "gauss16");
        assert_eq!(chosen("scenes/free", Request { extended: true, ..usual() }), "taylor");
        assert_eq!(chosen("scenes/motor", usual()), "taylor");
        assert_eq!(
            chosen("scenes/motor", Request { stabilize: Some(Stabilization::Baumgarte), ..usual() }),
            "dop853"
        );
        assert_eq!(chosen("scenes/wall", usual()), "dp8");
        assert_eq!(chosen("scenes/four_bars", usual()), "taylor");
    }

    #[test]
    fn stiffness_is_measured_and_told() {
        let (method, told) = why("stress/spring_damped_1e8", &[], Request::default());
        assert!(method == "radau9" && told.contains("spring"), "{method}: {told}");
        assert_eq!(
            why("stress/spring_damped_1e8", &[], Request { rtol: Some(1e-5), ..Request::default() }).0,
            "radau5"
        );
        // The same spring without its damper is resolved, and a soft one decides nothing.
        let (method, told) = why("stress/spring_1e6", &[], Request::default());
        assert!(method == "taylor" && told.contains("undamped"), "{method}: {told}");
        assert_eq!(why("stress/spring_damped_1e2", &[], Request::default()).0, "taylor");
    }

    #[test]
    fn invariants_that_are_asked_for_decide_or_what_does_is_told() {
        let asked = || Request { prefer: Some(Prefer::Invariants), ..Request::default() };
        // Too far for a fixed step, but not for a series.
        let far = Request { until: Some(1e7), every: Some(1e6), ..asked() };
        let (method, told) = why("scenes/chain8", &[], far);
        assert!(method == "taylor" && told.ends_with(EXTENDED), "{method}: {told}");
        for (scene, request, obstacle) in [
            ("scenes/free", Request { rtol: Some(1e-9), ..asked() }, "a tolerance decides"),
            ("scenes/wall", asked(), "walls and dry friction decide"),
            ("scenes/four_bars", asked(), "kept by projection"),
        ] {
            let (_, told) = why(scene, &[], request);
            assert!(told.contains("invariants were asked for, but") && told.contains(obstacle), "{told}");
        }
    }
}
