//! Methods compared: one JSON object, a table for spreadsheets, a page, and three charts.

#[cfg(feature = "charts")]
mod charts;

#[cfg(feature = "charts")]
pub use charts::{CompareChart, chart_data, draw};

use super::page::{Page, counted, figure, magnitude, rough};
use crate::dynamics::Mechanism;
use crate::run::compare::{Advice, Comparison, Entry, Fate, LOST, RunMeasurement};
use crate::run::{Drift, MethodId, Plan, Stabilization};
use crate::scene::Scene;
use serde_json::{Value, json};

/// The comparison as one JSON object: `rows`, `reference`, `recommendations`, `notes`; times in seconds.
/// What was not measured is `null`.
pub fn object(scene: &Scene, mechanism: &Mechanism, comparison: &Comparison) -> Value {
    let front = comparison.front();
    let truth = &comparison.truth;
    let rows = comparison.entries.iter().enumerate().map(|(k, entry)| row(entry, front.contains(&k)));
    let advice = comparison.advice();
    let advice = advice.iter().map(|advice| recommendation(comparison, advice));
    json!({
        "scene": scene.name,
        "until": comparison.until,
        "energy_kind": Drift::new(mechanism, comparison.until).kind,
        "rows": rows.collect::<Vec<_>>(),
        "reference": {
            "how": truth.how,
            "until": truth.until,
            "horizon_s": truth.horizon,
            "accuracy": if truth.until > 0.0 { Some(truth.accuracy) } else { None },
            "times": truth.marks().collect::<Vec<_>>(),
        },
        "recommendations": advice.collect::<Vec<_>>(),
        "notes": comparison.notes,
        "complete": comparison.is_whole,
        "wall_s": comparison.wall.as_secs_f64(),
    })
}

fn row(entry: &Entry, is_on_front: bool) -> Value {
    let found = entry.found.as_ref();
    let done = found.filter(|_| entry.fate == Fate::Done);
    let plan = entry.plan.as_ref();
    let tolerance = plan.and_then(|plan| plan.tolerance);
    let (stop, refusal, reached) = match &entry.fate {
        Fate::Done => (None, None, plan.map(|plan| plan.until)),
        Fate::Stopped(stop) => (Some(stop), None, Some(stop.t)),
        Fate::Refused(refusal) => (
            None,
            Some(json!({"what": refusal.what, "reason": refusal.reason, "alternative": refusal.alternative})),
            None,
        ),
        Fate::Late(t) => (None, None, Some(*t)),
    };
    json!({
        "method": entry.method.info().name,
        "setting": plan.map(setting),
        "stabilize": entry.stabilization,
        "status": status(&entry.fate),
        "error": entry.error(),
        "rate_error": done.map(|found| found.rate_error),
        "errors": done.map(|found| &found.errors),
        "energy_drift": done.map(|found| found.energy),
        "constraint_drift": done.and_then(|found| found.constraint).map(|levels| levels[0]),
        "constraint_rate_drift": done.and_then(|found| found.constraint).map(|levels| levels[1]),
        "wall_s": entry.median(),
        "wall_spread": entry.spread(),
        "wall_min_s": entry.blocks.iter().copied().reduce(f64::min),
        "blocks": entry.blocks.len(),
        "evaluations": found.map(|found| found.statistics.evaluations),
        "steps": found.map(|found| found.statistics.steps),
        "rejected": found.map(|found| found.statistics.rejected),
        "step": plan.and_then(|plan| plan.step),
        "rtol": tolerance.map(|tolerance| tolerance.relative),
        "atol": tolerance.map(|tolerance| tolerance.absolute),
        "extended": entry.extended,
        "pareto": is_on_front,
        "t": reached,
        "stop": stop,
        "refusal": refusal,
    })
}

/// One word for what became of a setting.
fn status(fate: &Fate) -> &'static str {
    match fate {
        Fate::Done => "done",
        Fate::Stopped(_) => "stopped",
        Fate::Refused(_) => "refused",
        Fate::Late(_) => "over_budget",
    }
}

fn recommendation(comparison: &Comparison, advice: &Advice) -> Value {
    let chosen = advice.entry.map(|number| &comparison.entries[number]);
    json!({
        "error": advice.target,
        "method": chosen.map(|entry| entry.method.info().name),
        "setting": chosen.and_then(|entry| entry.plan.as_ref()).map(setting),
        "stabilize": chosen.and_then(|entry| entry.stabilization),
        "options": chosen.and_then(options),
        "row": advice.entry,
        "sentence": sentence(comparison, advice),
    })
}

/// `1e-9`, `0.005 s`, `1e-20 extended`.
fn setting(plan: &Plan) -> String {
    match (plan.step, plan.tolerance) {
        (Some(step), _) => format!("{step} s"),
        (None, tolerance) => {
            format!(
                "{:e}{}",
                tolerance.unwrap_or_default().relative,
                if plan.extended { " extended" } else { "" }
            )
        }
    }
}

/// What to give to `run` for it.
pub(super) fn options(entry: &Entry) -> Option<String> {
    let plan = entry.plan.as_ref()?;
    let value = match (plan.step, plan.tolerance) {
        (Some(step), _) => format!("--step {step}"),
        (None, tolerance) => format!("--rtol {:e}", tolerance?.relative),
    };
    let extended = if plan.extended { " --extended" } else { "" };
    let kept = match entry.stabilization {
        Some(kind) if !matches!(entry.method, MethodId::Rattle(_)) => format!(" --stabilize {kind}"),
        _ => String::new(),
    };
    Some(format!("--method {} {value}{extended}{kept}", entry.method))
}

/// One plain sentence: what to choose for an error on this scene.
fn sentence(comparison: &Comparison, advice: &Advice) -> String {
    let target = advice.target;
    if advice.is_blind {
        return match comparison.truth.until > 0.0 {
            true => format!(
                "For {target:e} nothing can be said: the reference is good to {}.",
                magnitude(comparison.truth.accuracy)
            ),
            false => format!("For {target:e} nothing can be said: there is no reference."),
        };
    }
    let described = |number: usize| {
        let entry = &comparison.entries[number];
        Some((entry, options(entry)?, entry.error()?, entry.median()?))
    };
    match (advice.entry.and_then(described), advice.nearest.and_then(described)) {
        (Some((_, options, error, time)), _) => {
            let next = advice.next.and_then(described).map_or(String::new(), |(_, options, _, other)| {
                format!("; next is {options}, {} times as long", rough((10.0 * other / time).round() / 10.0))
            });
            format!("For {target:e} take {options}: error {}, {}{next}.", magnitude(error), duration(time))
        }
        (None, Some((_, options, error, _))) => {
            format!("No method reaches {target:e} here; the nearest is {options} with {}.", magnitude(error))
        }
        (None, None) => format!("No method reaches {target:e} here."),
    }
}

/// `12.3 µs`, `4.56 ms`, `7.89 s`.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{} µs", rough(1e6 * s)),
        s if s < 1.0 => format!("{} ms", rough(1e3 * s)),
        s => format!("{} s", rough(s)),
    }
}

/// The rows as a table for spreadsheets, with units in its head; what was not measured is empty.
pub fn csv(comparison: &Comparison) -> String {
    const HEAD: &str = "method,setting,stabilize,status,error [rad],rate_error [rad/s],\
                        energy_drift [1],constraint_drift [rad or m],\
                        constraint_rate_drift [rad/s or m/s],wall [s],wall_spread [s],\
                        evaluations,steps,rejected,pareto\n";
    let front = comparison.front();
    let number = |x: Option<f64>| x.filter(|x| x.is_finite()).map_or(String::new(), |x| format!("{x:e}"));
    let mut text = HEAD.to_owned();
    for (k, entry) in comparison.entries.iter().enumerate() {
        let found = entry.found.as_ref().filter(|_| entry.fate == Fate::Done);
        let of = |what: &dyn Fn(&RunMeasurement) -> Option<f64>| number(found.and_then(what));
        let count = |what: &dyn Fn(&RunMeasurement) -> u64| {
            entry.found.as_ref().map_or(String::new(), |found| what(found).to_string())
        };
        let cells = [
            entry.method.info().name.to_owned(),
            entry.plan.as_ref().map_or(String::new(), setting),
            entry.stabilization.map_or(String::new(), |kind| kind.name().to_owned()),
            status(&entry.fate).to_owned(),
            number(entry.error()),
            of(&|found| Some(found.rate_error)),
            of(&|found| Some(found.energy)),
            of(&|found| found.constraint.map(|levels| levels[0])),
            of(&|found| found.constraint.map(|levels| levels[1])),
            number(entry.median()),
            number(entry.spread()),
            count(&|found| found.statistics.evaluations),
            count(&|found| found.statistics.steps),
            count(&|found| found.statistics.rejected),
            u8::from(front.contains(&k)).to_string(),
        ];
        text += &cells.join(",");
        text.push('\n');
    }
    text
}

/// The comparison as a page.
pub fn text(scene: &Scene, mechanism: &Mechanism, comparison: &Comparison) -> String {
    let truth = &comparison.truth;
    let mut page = Page::new(&scene.name, &scene.description);
    page.entry("horizon", &format!("{} s", figure(comparison.until)));
    if truth.until > 0.0 {
        page.entry("reference", &format!("{}, good to {}", truth.how, magnitude(truth.accuracy)));
        let (times, until) = (truth.times(), figure(truth.until));
        page.entry("errors", &format!("of angles in rad, largest at {times} times up to t = {until} s"));
    } else {
        page.entry("reference", "none");
    }
    if let Some(horizon) = truth.horizon {
        page.entry(
            "",
            &format!(
                "starts an ulp apart part by 1e-3 rad after {} s: beyond it no path means anything",
                rough(horizon)
            ),
        );
    }
    for note in &comparison.notes {
        page.entry("note", note);
    }
    let letters = has_letters(comparison);
    if letters {
        page.entry("stabilization", "n none, b baumgarte, p projection, e elimination");
    }
    table(&mut page, mechanism, comparison, letters);
    failures(&mut page, comparison, letters);
    for (k, advice) in comparison.advice().iter().enumerate() {
        page.entry(if k == 0 { "to choose" } else { "" }, &sentence(comparison, advice));
    }
    if !comparison.is_whole {
        page.entry("interrupted", "what is above is all there was");
    }
    page.into_text()
}

/// Whether a method appears with several stabilizations, which are then told by a letter.
pub(super) fn has_letters(comparison: &Comparison) -> bool {
    let several = |a: &Entry, b: &Entry| a.method == b.method && a.stabilization != b.stabilization;
    comparison.entries.iter().any(|a| comparison.entries.iter().any(|b| several(a, b)))
}

/// `dp8 p 1e-9`, `gauss16 0.005`, `taylor+ 1e-20`.
pub(super) fn short(entry: &Entry, letters: bool) -> String {
    let letter = match entry.stabilization.filter(|_| letters) {
        None => "",
        Some(Stabilization::None) => " n",
        Some(Stabilization::Baumgarte) => " b",
        Some(Stabilization::Projection) => " p",
        Some(Stabilization::Elimination) => " e",
    };
    let value = match entry.plan.as_ref().map(|plan| (plan.step, plan.tolerance)) {
        // Steps have few digits, but where the horizon has many.
        Some((Some(step), _)) if step.to_string().len() <= 9 => format!(" {step}"),
        Some((Some(step), _)) => format!(" {step:.3e}"),
        Some((None, tolerance)) => format!(" {:e}", tolerance.unwrap_or_default().relative),
        None => String::new(),
    };
    format!("{}{}{letter}{value}", entry.method, if entry.extended { "+" } else { "" })
}

fn table(page: &mut Page, mechanism: &Mechanism, comparison: &Comparison, letters: bool) {
    let front = comparison.front();
    let has_rows = !mechanism.constraints.is_empty();
    let mut head = vec!["", "error", "energy"];
    head.extend(has_rows.then_some(["|C|", "|C'|"]).into_iter().flatten());
    head.extend(["time", "+-", "evals"]);
    let mut rows = Vec::new();
    for (k, entry) in sorted(comparison) {
        let Some(found) = entry.found.as_ref().filter(|_| entry.fate == Fate::Done) else { continue };
        let mark = if front.contains(&k) { "*" } else { " " };
        let mut cells = vec![format!("{mark} {}", short(entry, letters))];
        cells.push(match entry.error() {
            None => "-".into(),
            Some(error) if error > LOST => "lost".into(),
            Some(error) => magnitude(error),
        });
        cells.push(magnitude(found.energy));
        cells.extend(found.constraint.filter(|_| has_rows).into_iter().flatten().map(magnitude));
        let time = entry.median().unwrap_or(f64::NAN);
        cells.push(duration(time));
        cells.push(entry.spread().map_or("-".into(), |spread| format!("{:.0}%", 50.0 * spread / time)));
        cells.push(count(found.statistics.evaluations));
        rows.push(cells);
    }
    if rows.is_empty() {
        return;
    }
    page.table(&head, &rows);
    let extended = if comparison.entries.iter().any(|entry| entry.extended) {
        "; + first orders in double-double"
    } else {
        ""
    };
    let lost = format!("lost: off by more than {LOST} rad");
    page.entry(
        "",
        &format!(
            "* no other is faster and more accurate; +- half the distance of the quartiles; {lost}{extended}"
        ),
    );
}

/// `850`, `12.3k`, `4.56M`.
fn count(number: u64) -> String {
    match number as f64 {
        n if n < 1e4 => format!("{number}"),
        n if n < 1e6 => format!("{}k", rough(n / 1e3)),
        n if n < 1e9 => format!("{}M", rough(n / 1e6)),
        n => format!("{}G", rough(n / 1e9)),
    }
}

/// Settings of one method together, in the order of the table of methods.
pub(super) fn sorted(comparison: &Comparison) -> Vec<(usize, &Entry)> {
    let mut entries: Vec<(usize, &Entry)> = comparison.entries.iter().enumerate().collect();
    let place = |entry: &Entry| {
        let first = comparison.entries.iter().position(|other| other.name() == entry.name());
        (crate::run::METHODS.iter().position(|info| info.id == entry.method), entry.extended, first)
    };
    entries.sort_by_key(|(number, entry)| (place(entry), *number));
    entries
}

/// What did not come to its end, and why: settings of one method that ended for one cause in one line.
fn failures(page: &mut Page, comparison: &Comparison, letters: bool) {
    let mut label = "not finished";
    let failed: Vec<&Entry> = (sorted(comparison).into_iter().map(|(_, entry)| entry))
        .filter(|entry| entry.fate != Fate::Done)
        .collect();
    for group in failed.chunk_by(|a, b| is_alike(a, b)) {
        let [entry, others @ ..] = group else { continue };
        let why = match &entry.fate {
            Fate::Done => continue,
            Fate::Stopped(stop) => {
                format!("stopped ({}) at t = {}: {}", stop.cause.word(), times(group), stop.what)
            }
            Fate::Refused(refusal) => format!("refused: {}", refusal.reason),
            Fate::Late(0.0) => "and finer ones left out: a coarser one took too long".into(),
            Fate::Late(_) => format!("at t = {} its share of the time was over", times(group)),
        };
        let kept = match (&entry.fate, entry.stabilization) {
            (Fate::Refused(_), Some(kind)) => format!(" with {kind}"),
            _ => String::new(),
        };
        let more = match others.len() {
            _ if entry.fate == Fate::Late(0.0) || !kept.is_empty() => String::new(),
            0 => String::new(),
            count => format!(" and {}", counted(count as u64, "other setting", "other settings")),
        };
        page.entry(
            std::mem::take(&mut label),
            &format!("{}{kept}{more}: {why}", short(entry, letters && kept.is_empty())),
        );
    }
}

/// True for settings of one method that did not finish for one cause.
fn is_alike(a: &Entry, b: &Entry) -> bool {
    a.name() == b.name()
        && match (&a.fate, &b.fate) {
            (Fate::Stopped(a), Fate::Stopped(b)) => a.cause == b.cause,
            (Fate::Late(a), Fate::Late(b)) => (*a == 0.0) == (*b == 0.0),
            (a, b) => a == b,
        }
}

/// The times at which settings ended: `3 s`, `0.5 to 3 s`.
fn times(group: &[&Entry]) -> String {
    let time = |entry: &&Entry| match &entry.fate {
        Fate::Stopped(stop) => stop.t,
        Fate::Late(t) => *t,
        Fate::Done | Fate::Refused(_) => 0.0,
    };
    let times = group.iter().map(time);
    let [first, last] = times.fold([f64::INFINITY, 0.0_f64], |[a, b], t| [a.min(t), b.max(t)]).map(rough);
    if first == last { format!("{first} s") } else { format!("{first} to {last} s") }
}
