//! Which series accompanies a run: always one that is finer than the run itself, as far as there is one.

use super::Level;
use crate::dynamics::Mechanism;
use crate::run::build::order_in_double_double;
use crate::run::methods::MethodId;
use crate::run::plan::Plan;
use crate::stepping::composition::Composition;
use crate::stepping::{Taylor, Tolerance};

/// The reference solution's tolerance over the run's.
const FINER: f64 = 100.0;
/// The least order of reference solutions in double-double: where a run has few steps those beside it end
/// where its own do, and of the same order they would have the same error.
const ORDER: usize = 24;
/// The order of those in doubles where powers of formulas or of friction are what a step costs.
const ORDER_OF_FORMULAS: usize = 16;
/// The least order of those in doubles beside a series of the same order, and what is added to that order
/// where tables, transitions, events or a horizon this near \[rad of the fastest mode\] end the steps of
/// both: they are the same, and of the same order they would have the same error.
const ANOTHER_ORDER: usize = 20;
const HIGHER: usize = 4;
const NEAR: f64 = 20.0;
/// From which tolerance of a run on its rounding counts.
const NEAR_ROUNDING: f64 = 1e-10;
/// Tolerance \[rad/s\] of reference solutions in doubles: of runs that are not near rounding, at most, and of
/// all others.  Below 1e-15 the last orders of a series in doubles are rounding, and its steps come out too
/// long for modes that are fast, and for chains of bodies.
const FINE: f64 = 1e-14;
const FINEST: f64 = 1e-15;
/// Tolerance \[rad/s\] with the first orders in double-double, of reference solutions all in double-double,
/// and of those of runs with extended orders.
const EXTENDED: f64 = 1e-20;
const BEYOND: f64 = 1e-22;
/// The same where only the growth of small differences is asked for.
const COARSE: f64 = 1e-8;

/// A reference solution's plan, and what it is in words.
pub(super) struct Finer {
    pub plan: Plan,
    pub name: String,
}

/// True where the rounding of a run counts.
pub(super) fn is_near_rounding(plan: &Plan) -> bool {
    match plan.method {
        MethodId::Gauss(stages) => stages > 2,
        MethodId::Rattle(composition) => !matches!(composition, Composition::Single | Composition::Suzuki5),
        _ => tolerance(plan).is_some_and(|tolerance| tolerance < NEAR_ROUNDING),
    }
}

fn tolerance(plan: &Plan) -> Option<f64> {
    plan.tolerance.map(|tolerance| tolerance.relative.min(tolerance.absolute))
}

/// Whether formulas or friction are what a step of a series costs: their work grows with the square of the
/// order.
fn is_dear(mechanism: &Mechanism) -> bool {
    !(mechanism.forces.is_empty() && mechanism.frictions.is_empty())
}

/// The first reference solution of a run.
pub(super) fn first(mechanism: &Mechanism, run: &Plan, level: Level) -> Finer {
    let finer = tolerance(run).map(|tolerance| tolerance / FINER);
    let finds_impacts_likewise = run.method == MethodId::Taylor && !mechanism.contacts.is_empty();
    if !mechanism.has_series_between_switches() || finds_impacts_likewise {
        return stepwise(mechanism, run, finer.filter(|_| !finds_impacts_likewise).unwrap_or(FINE).max(FINE));
    }
    if !mechanism.frictions.is_empty() {
        let finer = finer.filter(|_| run.method == MethodId::Taylor);
        return in_doubles_at(mechanism, run, finer.unwrap_or(FINE).max(FINE));
    }
    let is_near = is_near_rounding(run);
    // Impacts are located in doubles. A series whose steps are those of the run shares their errors; with
    // loops and sliders these are in what no step is judged by.  Where motors leave no freedom they do not
    // add up.
    let is_free = mechanism.assembly.degrees_of_freedom > 0;
    let is_alike = run.method == MethodId::Taylor && mechanism.has_multipliers() && is_free;
    let may_extend = mechanism.contacts.is_empty() && (is_near || is_alike || level == Level::Full);
    let has_lanes =
        may_extend && !run.extended && !mechanism.has_multipliers() && Taylor::has_lanes(mechanism, true);
    if may_extend && !has_lanes {
        let tolerance = if run.extended { BEYOND } else { EXTENDED };
        // There it is the other form that counts, not the digits.
        let least = if is_near || level == Level::Full { tolerance } else { 1.0 };
        return series(mechanism, run, finer.unwrap_or(tolerance).min(least), [false, true]);
    }
    if has_lanes {
        return series(mechanism, run, finer.unwrap_or(EXTENDED).min(EXTENDED), [true, false]);
    }
    in_doubles(mechanism, run)
}

/// The finest that is of use in doubles.
fn in_doubles(mechanism: &Mechanism, run: &Plan) -> Finer {
    let finer = tolerance(run).filter(|_| !is_near_rounding(run)).map(|tolerance| tolerance / FINER);
    let tolerance = match finer {
        // Those of gears and cams do not get better in step with their tolerance.
        Some(finer) if run.method == MethodId::Taylor && !mechanism.has_aims() => finer.max(FINEST),
        // Steps that end at every output time are often far better than their tolerance, and a finer series
        // costs little.
        Some(finer) => finer.min(FINE),
        None => FINEST,
    };
    in_doubles_at(mechanism, run, tolerance)
}

/// A series in doubles, of another order than a run that is a series itself.
fn in_doubles_at(mechanism: &Mechanism, run: &Plan, at: f64) -> Finer {
    let mut finer = series(mechanism, run, at, [false; 2]);
    let order = |plan: &Plan| {
        let is_series = plan.method == MethodId::Taylor;
        is_series.then(|| plan.series(plan.tolerance.unwrap_or_default()).order)
    };
    let is_no_coarser = tolerance(run).is_some_and(|own| own <= at);
    // At the least tolerance it is rounding that they differ by, where the run's is another.
    if let Some(own) = order(run).filter(|_| at > FINEST || is_no_coarser)
        && order(&finer.plan) == Some(own)
    {
        let tree = &mechanism.tree;
        let is_near = || tree.is_dense() && run.until * tree.fastest_rate(&mechanism.springs) < NEAR;
        let higher = if is_no_coarser || mechanism.is_switched() || is_near() { HIGHER } else { 0 };
        finer.plan.order = Some((own + higher).max(ANOTHER_ORDER));
    }
    finer
}

/// The one that goes on where double-double would cost too much; `None` where it would be coarser than the
/// run.
pub(super) fn second(mechanism: &Mechanism, run: &Plan) -> Option<Finer> {
    if !run.extended {
        return Some(in_doubles(mechanism, run));
    }
    let has_lanes = !mechanism.has_multipliers() && Taylor::has_lanes(mechanism, true);
    has_lanes.then(|| series(mechanism, run, BEYOND, [true, false]))
}

/// For runs of neighbouring scenes, which share no impacts with the run: the first series in doubles at so
/// many times its tolerance, up to a time \[s\].
pub(super) fn neighbour(mechanism: &Mechanism, until: f64, coarser: f64) -> Plan {
    let tolerance = Tolerance { relative: coarser * FINE, absolute: coarser * FINE };
    let method = if mechanism.has_series() { MethodId::Taylor } else { MethodId::Dp8 };
    Plan { method, ..Plan::of_series(mechanism, tolerance, until) }
}

/// What is still near a motion where no more is asked of it.
pub(super) fn coarse(mechanism: &Mechanism, run: &Plan) -> Finer {
    series(mechanism, run, COARSE, [false; 2])
}

/// Where there is no series, or the run is one that finds its impacts on it: never by the run's own method at
/// its own tolerance, which would make the same errors.
fn stepwise(mechanism: &Mechanism, run: &Plan, at: f64) -> Finer {
    let is_run = run.method == MethodId::Dp8 && tolerance(run).is_some_and(|own| own <= at);
    let method = if is_run { MethodId::Radau(5) } else { MethodId::Dp8 };
    let tolerance = Tolerance { relative: at, absolute: at };
    let plan = Plan { method, ..Plan::of_series(mechanism, tolerance, run.until) };
    Finer { name: format!("{method} at {at:.0e}"), plan }
}

fn series(
    mechanism: &Mechanism,
    run: &Plan,
    tolerance: f64,
    [extended, in_double_double]: [bool; 2],
) -> Finer {
    if !mechanism.has_series_between_switches() {
        return stepwise(mechanism, run, tolerance.max(FINE));
    }
    let tolerance = Tolerance { relative: tolerance, absolute: tolerance };
    let mut plan = Plan::of_series(mechanism, tolerance, run.until);
    (plan.extended, plan.in_double_double) = (extended, in_double_double);
    plan.order = match in_double_double {
        true => Some(order_in_double_double(tolerance.relative).max(ORDER)),
        false => is_dear(mechanism).then_some(ORDER_OF_FORMULAS),
    };
    let digits = match (in_double_double, extended) {
        (true, _) => " in double-double",
        (_, true) => ", first orders in double-double",
        _ => "",
    };
    Finer { name: format!("taylor at {:.0e}{digits}", tolerance.relative), plan }
}

/// Whether the difference from a reference solution is mostly the error of that, so that the run is off by no
/// more: not where both are alike.
pub(super) fn is_bound(series: &Plan, run: &Plan) -> bool {
    if series.method != MethodId::Taylor {
        // Beside a series at its own tolerance the classic pairs are tens of times as far off.
        return run.method == MethodId::Taylor && tolerance(run) <= tolerance(series);
    }
    is_rounded(series) && !is_alike(series, run)
}

/// Whether a reference solution is a series in doubles hardly finer than its run, which is one, too.
pub(super) fn is_alike(series: &Plan, run: &Plan) -> bool {
    is_rounded(series)
        && run.method == MethodId::Taylor
        && !run.extended
        && tolerance(run).is_some_and(|own| own <= FINE)
}

/// What a reference solution in doubles may be off by \[rad\] in each of the mechanism's units of time, where
/// that may be as much as a run is: where it is as fine as doubles allow.
pub(super) fn own_error(series: &Plan) -> f64 {
    let is_finest = series.method == MethodId::Taylor
        && !series.extended
        && !series.in_double_double
        && tolerance(series).is_some_and(|tolerance| tolerance <= FINE);
    if is_finest { FINE } else { 0.0 }
}

/// Whether a reference solution's own rounding counts.
pub(super) fn is_rounded(series: &Plan) -> bool {
    series.method == MethodId::Taylor
        && !series.extended
        && !series.in_double_double
        && series.tolerance.unwrap_or_default().relative <= FINEST
}
