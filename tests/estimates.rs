//! Estimates of the error against the truth, on random scenes of every kind by every method.
//!
//! The truth is the motion by the series in double-double; for scenes with walls, and where that does not
//! reach, the finer of two runs near rounding.  It counts only where it is itself known to a thirtieth of the
//! error.  Judged is r = estimate/truth of the largest error of an angle up to the end, where neither has a
//! horizon; truths below 4e-15 rad are rounding, for which an estimate of up to 1e-13 rad is right.
//!
//! `.ci/estimates [CASES [SEED]]` runs more cases; with `TABLE=1` it writes `docs/estimates.md` anew.
//! `SHOW=1` prints every case that is outside, and `FOUND` names a folder for the scenes.

use crate::common;
use crate::mechanisms;

use common::shipped;
use driftless::dynamics::{Mechanism, Motion, Time};
use driftless::run::trust::{DistanceMetric, How, Level, Trust};
use driftless::run::{Limits, METHODS, MethodId, Plan, Request, Run, integrate, reference};
use driftless::scene::{Scene, parse_scene};
use mechanisms::Dice;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Arc;

/// Cases where nobody says how many, and the first.
const USUAL: u64 = 60;
const FIRST: u64 = 1;
/// Evaluations allowed to a run.
const MAX_EVALUATIONS: u64 = 300_000;
/// Rows of fine output.
const FINE: f64 = 160.0;
/// How much finer than an error a truth must be.
const KNOWN: f64 = 30.0;
/// Truths below this \[rad\] are rounding, and what an estimate may be then.
const ROUNDING: [f64; 2] = [4e-15, 1e-13];

/// A scene, how it is run, and what it is of.
struct Case {
    scene: Scene,
    kinds: Vec<&'static str>,
    request: Request,
    is_default: bool,
    rows: f64,
}

/// What became of a case.
enum Verdict {
    /// Estimates over truths: of angles, and of rates.
    Ratio([f64; 2], Option<f64>),
    /// At rounding, and the estimate says so or does not.
    Rounding(bool),
    /// Horizons told and true.
    Horizons(Option<f64>, Option<[f64; 2]>),
    /// The estimate is carried on by a power law.
    Extrapolated(f64),
    /// No estimate, and why.
    None(String),
    /// Not run, or the truth is not known.
    Unknown(&'static str),
}

/// The case of a seed.
fn case(seed: u64) -> Option<Case> {
    let mut dice = Dice::new(seed ^ 0x0e57_1a7e);
    let (scene, kinds) = if dice.chance(0.35) { chain(&mut dice) } else { of_any_kind(seed, &mut dice)? };
    let info = dice.one(METHODS);
    let is_default = dice.chance(0.5);
    let mut request =
        Request { method: Some(info.id), max_evaluations: Some(MAX_EVALUATIONS), ..Request::default() };
    // A quarter of the default ones is run by the method the program chooses.
    if is_default && dice.chance(0.5) {
        request.method = None;
    }
    let rows = if dice.chance(0.5) { FINE } else { [1.0, 2.0, 4.0, 8.0][dice.pick(4)] };
    request.every = Some(scene.until / rows);
    if !is_default {
        if info.id.is_adaptive() {
            let least = if info.id == MethodId::Taylor {
                1e-15
            } else if matches!(info.id, MethodId::Dopri5 | MethodId::Dp5) {
                1e-11
            } else {
                1e-14
            };
            request.rtol = Some(dice.size(least, 1e-4));
            request.extended = info.id == MethodId::Taylor && dice.chance(0.15);
        } else {
            let mechanism = Mechanism::new(&scene).ok()?;
            let usual =
                Plan::new(&scene, &mechanism, &Request { every: Some(scene.until / 8.0), ..request.clone() })
                    .ok()?
                    .step?;
            request.step = Some(usual * [0.25, 0.5, 2.0][dice.pick(3)]);
        }
    }
    Some(Case { scene, kinds, request, is_default, rows })
}

/// Chains of a few bars, with a spring or a motor or neither.
fn chain(dice: &mut Dice) -> (Scene, Vec<&'static str>) {
    let name = dice.one(&["free", "free", "gentle", "spring", "stiff", "motor", "chain"]);
    let mut scene = shipped(
        if name == "stiff" {
            "spring"
        } else if name == "chain" {
            "chain8"
        } else {
            name
        },
        &[],
    );
    if name == "chain" {
        let count = 3 + dice.pick(3);
        scene.bars.truncate(count);
        scene.hinges.truncate(count);
        scene.start.truncate(count);
    }
    let [angle, rate] = if name == "gentle" { [0.5, 0.5] } else { [3.1, 4.0] };
    for start in &mut scene.start {
        (start.phi, start.omega) = (dice.within(-angle, angle), dice.within(-rate, rate));
    }
    if name == "stiff" {
        scene.springs[0].stiffness *= dice.size(1e2, 1e4);
    }
    if let Some(motor) = scene.motors.first_mut() {
        motor.law.rate = dice.within(2.0, 9.0);
        (scene.start[0].phi, scene.start[0].omega) = (motor.law.start, motor.law.rate);
    }
    scene.until = if name == "stiff" { dice.size(0.5, 2.0) } else { dice.size(1.0, 25.0) };
    (
        scene,
        vec![match name {
            "spring" => "springs",
            "stiff" => "stiff springs",
            "motor" => "motors",
            _ => "chains",
        }],
    )
}

/// A scene of any kind, a while longer than usual in half of all cases.
fn of_any_kind(seed: u64, dice: &mut Dice) -> Option<(Scene, Vec<&'static str>)> {
    let generated = mechanisms::scene(seed);
    let mut scene = parse_scene(&generated.text, "scene", &[]).ok()?;
    scene.until *= if dice.chance(0.5) { dice.size(1.0, 8.0) } else { 1.0 };
    let mechanism = Mechanism::new(&scene).ok()?;
    let has = |what: bool, name: &'static str| what.then_some(name);
    let kinds: Vec<&str> = [
        has(!scene.walls.is_empty(), "walls"),
        has(mechanism.has_closed_loops(), "loops and sliders"),
        has(mechanism.coordinates() > mechanism.bodies.len(), "floating bodies"),
        has(!scene.motors.is_empty() || !scene.drives.is_empty(), "motors"),
        has(mechanism.vibration.is_some() || mechanism.slowest_rod.is_some(), "rigid springs"),
        has(!scene.springs.is_empty() || !scene.torsion_springs.is_empty(), "springs"),
    ]
    .into_iter()
    .flatten()
    .collect();
    Some((scene, if kinds.is_empty() { vec!["others"] } else { kinds }))
}

/// A run's samples as `[t, angles…]` and rates, and what it says of itself.
struct Told {
    times: Vec<Time>,
    samples: Vec<[Vec<f64>; 2]>,
    trust: Option<Trust>,
}

fn told(mechanism: &Arc<Mechanism>, plan: Plan, start: &Motion, level: Level) -> Result<Told, &'static str> {
    let run = Run::new(Arc::clone(mechanism), plan.clone(), Limits::default(), start)
        .map_err(|_| "cannot begin")?;
    let (mut times, mut samples) = (Vec::new(), Vec::new());
    let outcome = integrate(run.trusted(level, start), &mut |sample| {
        // Rows are at times that doubles round.
        let time = plan.time(times.len() as u64);
        times.push(if time.hi == sample.t { time } else { Time::from(sample.t) });
        samples.push([sample.phi.clone(), sample.omega.clone()]);
        Ok(())
    });
    let outcome = outcome.map_err(|_| "an observer failed")?;
    if outcome.stop.is_some() { Err("stopped") } else { Ok(Told { times, samples, trust: outcome.trust }) }
}

/// The largest differences of angles and rates over what they are measured by.
fn apart(ruler: &DistanceMetric, one: &[Vec<f64>; 2], other: &[Vec<f64>; 2]) -> [f64; 2] {
    [0, 1].map(|i| {
        one[i]
            .iter()
            .zip(&other[i])
            .enumerate()
            .fold(0.0, |most: f64, (k, (a, b))| most.max((a - b).abs() * ruler.weight(k)))
    })
}

/// Angles and rates at some times, and how far they are off.
type Known = (Vec<[Vec<f64>; 2]>, Vec<f64>);

/// The truth at these times.
fn truth(scene: &Scene, mechanism: &Arc<Mechanism>, start: &Motion, times: &[Time]) -> Option<Known> {
    if scene.walls.is_empty()
        && let Ok(found) = reference(mechanism, start, times)
    {
        let phi = |motion: &Motion| (0..motion.phi.len()).map(|k| motion.unwrapped(k)).collect();
        let omega = |motion: &Motion| motion.omega.iter().map(|omega| omega.hi).collect();
        return Some((
            found.motions.iter().map(|motion| [phi(motion), omega(motion)]).collect(),
            found.accuracy,
        ));
    }
    // Two runs near rounding by methods that find events in ways of their own.
    let every = Some(scene.until / (times.len() - 1) as f64);
    let by = |method, rtol| Request {
        method: Some(method),
        rtol: Some(rtol),
        max_evaluations: Some(40 * MAX_EVALUATIONS),
        every,
        until: Some(scene.until),
        ..Request::default()
    };
    let [one, other] = [by(MethodId::Taylor, 1e-15), by(MethodId::Dp8, 1e-14)].map(|request| {
        let plan = Plan::new(scene, mechanism, &request).ok()?;
        told(mechanism, plan, start, Level::Off).ok().filter(|told| told.times.len() == times.len())
    });
    let (one, other) = match (one, other) {
        (Some(one), Some(other)) => (one, other),
        // A mean force has no series.
        (None, Some(other)) => {
            let plan = Plan::new(scene, mechanism, &by(MethodId::Dp8, 3e-14)).ok()?;
            (
                told(mechanism, plan, start, Level::Off)
                    .ok()
                    .filter(|told| told.times.len() == times.len())?,
                other,
            )
        }
        _ => return None,
    };
    let ruler = DistanceMetric::new(mechanism);
    let accuracy = one
        .samples
        .iter()
        .zip(&other.samples)
        .map(|(one, other)| apart(&ruler, one, other)[0].max(1e-14))
        .collect();
    Some((one.samples, accuracy))
}

/// The largest error so far at each time, of angles and rates, as far as it is known.
struct Errors {
    /// True where few output times are all there is to see: the error may have been larger between them.
    is_sparse: bool,
    times: Vec<f64>,
    most: Vec<[f64; 2]>,
    known: Vec<f64>,
}

fn judge(case: &Case) -> Verdict {
    let Ok(mechanism) = Mechanism::new(&case.scene) else { return Verdict::Unknown("no mechanism") };
    let (mechanism, start) = (Arc::new(mechanism.clone()), mechanism.start(&case.scene));
    let Ok(plan) = Plan::new(&case.scene, &mechanism, &case.request) else {
        return Verdict::Unknown("refused");
    };
    let is_own = plan.step.is_none() && !matches!(plan.method, MethodId::Taylor | MethodId::Radau(_));
    let told_by_run = match told(&mechanism, plan.clone(), &start, Level::Auto) {
        Ok(told) => told,
        Err(why) => return Verdict::Unknown(why),
    };
    let trust = told_by_run.trust.clone().expect("asked for");
    if trust.how == How::None {
        return Verdict::None(trust.why.unwrap_or_else(|| "no reason".into()));
    }
    // What is between the rows counts, too, where finer rows do not change the motion.
    let ends = told_by_run.samples.last().cloned();
    let finer = Request { every: Some(case.scene.until / FINE), ..case.request.clone() };
    let shown = (!is_own && case.rows < FINE)
        .then(|| Plan::new(&case.scene, &mechanism, &finer).ok())
        .flatten()
        .filter(|fine| fine.step == plan.step)
        .and_then(|fine| told(&mechanism, fine, &start, Level::Off).ok())
        .filter(|fine| fine.samples.last() == ends.as_ref())
        .unwrap_or(told_by_run);
    let Some((exact, accuracy)) = truth(&case.scene, &mechanism, &start, &shown.times) else {
        return Verdict::Unknown("no truth");
    };
    let ruler = DistanceMetric::new(&mechanism);
    let is_sparse = (shown.times.len() as f64) < 0.5 * FINE;
    let mut errors = Errors {
        is_sparse,
        times: shown.times.iter().map(|t| t.hi).collect(),
        most: Vec::new(),
        known: accuracy,
    };
    let mut most = [0.0_f64; 2];
    for (sample, exact) in shown.samples.iter().zip(&exact) {
        let now = apart(&ruler, sample, exact);
        most = [most[0].max(now[0]), most[1].max(now[1])];
        errors.most.push(most);
    }
    errors.verdict(&case.scene, &trust)
}

impl Errors {
    /// The times between which the error passes the horizon, if it does, and is known there: rows that are
    /// far apart do not tell more.
    fn horizon(&self) -> Result<Option<[f64; 2]>, ()> {
        let Some(row) = self.most.iter().position(|most| most[0] > 1e-3) else { return Ok(None) };
        if self.known[row] * KNOWN > self.most[row][0] {
            return Err(());
        }
        let [(t0, e0), (t1, e1)] = [row.max(1) - 1, row].map(|row| (self.times[row], self.most[row][0]));
        if e1 > 0.03 || e0 < 1e-5 {
            return Ok(Some([t0, t1]));
        }
        let at = t0 + (t1 - t0) * (1e-3 / e0).ln() / (e1 / e0).ln();
        Ok(Some([at, at]))
    }

    fn verdict(&self, scene: &Scene, trust: &Trust) -> Verdict {
        let Ok(horizon) = self.horizon() else { return Verdict::Unknown("truth not fine enough") };
        let (last, known) = (*self.most.last().expect("a row"), *self.known.last().expect("a row"));
        let estimate = trust.error_estimate.expect("a figure");
        if trust.model_error.is_some() {
            return Verdict::Unknown("the model's own error");
        }
        if let (How::Extrapolated(_), None) = (trust.how, horizon) {
            return Verdict::Extrapolated(estimate / last[0]);
        }
        let is_near_end = |t: Option<f64>| t.is_none_or(|t| t > 0.8 * scene.until);
        match (trust.horizon, horizon) {
            (None, None) => {}
            // A horizon next to the end may lie behind it.
            (Some(_), None) if is_near_end(trust.horizon) => {}
            (None, Some([first, _])) if is_near_end(Some(first)) || last[0] < 2e-3 => {}
            (Some(told), Some([first, _])) if told < 0.8 * first && self.is_sparse => {
                return Verdict::Unknown("rows far apart");
            }
            (Some(_), None) if self.is_sparse => return Verdict::Unknown("rows far apart"),
            (told, truth) => return Verdict::Horizons(told, truth),
        }
        if last[0] < ROUNDING[0] && known <= ROUNDING[0] {
            return Verdict::Rounding(estimate <= ROUNDING[1]);
        }
        if known * KNOWN > last[0] {
            return Verdict::Unknown("truth not fine enough");
        }
        if self.is_sparse && estimate > 10.0 * last[0] {
            return Verdict::Unknown("rows far apart");
        }
        let rate = trust
            .rate_error
            .filter(|_| last[1] > (30.0 * known).max(1e-13) && scene.walls.is_empty())
            .map(|rate| rate / last[1]);
        Verdict::Ratio([estimate / last[0], last[0]], rate)
    }
}

/// A line of the table.
#[derive(Default)]
struct Line {
    ratios: Vec<f64>,
    rates: Vec<f64>,
    rounding: [u64; 2],
    /// Within 20 %, others, those that never come, those that are missed.
    horizons: [u64; 4],
    extrapolated: Vec<f64>,
    without: BTreeMap<String, u64>,
    unknown: BTreeMap<&'static str, u64>,
}

impl Line {
    fn take(&mut self, verdict: &Verdict) {
        match verdict {
            Verdict::Ratio([ratio, _], rate) => {
                self.ratios.push(*ratio);
                self.rates.extend(rate);
            }
            Verdict::Rounding(is_right) => self.rounding[usize::from(!is_right)] += 1,
            Verdict::Horizons(told, truth) => self.horizons[horizon_class(*told, *truth)] += 1,
            Verdict::Extrapolated(ratio) => self.extrapolated.push(*ratio),
            Verdict::None(why) => {
                let why = why.split(" at t = ").next().unwrap_or_default();
                *self.without.entry(why.to_owned()).or_default() += 1;
            }
            Verdict::Unknown(why) => *self.unknown.entry(why).or_default() += 1,
        }
    }

    fn share(of: &[f64], is: impl Fn(f64) -> bool) -> f64 {
        if of.is_empty() {
            f64::NAN
        } else {
            of.iter().filter(|&&ratio| is(ratio)).count() as f64 / of.len() as f64
        }
    }

    /// Shares inside [1/3, 10] and below, and of horizons within 20 %.
    fn shares(&self) -> [f64; 3] {
        let horizons: u64 = self.horizons.iter().sum();
        let inside = Self::share(&self.ratios, |ratio| (1.0 / 3.0..=10.0).contains(&ratio));
        [
            inside,
            Self::share(&self.ratios, |ratio| ratio < 1.0 / 3.0),
            self.horizons[0] as f64 / horizons as f64,
        ]
    }

    fn print(&self, name: &str, to: &mut String) {
        let [inside, below, within] = self.shares();
        let percent =
            |share: f64| if share.is_nan() { "–".to_owned() } else { format!("{:.1} %", 100.0 * share) };
        let horizons: u64 = self.horizons.iter().sum();
        let rates = Self::share(&self.rates, |ratio| (1.0 / 3.0..=10.0).contains(&ratio));
        let [right, wrong] = self.rounding;
        let _ = writeln!(
            to,
            "| {name} | {} | {} | {} | {} | {right} of {} | {horizons} | {} | {} | {} | {} | {} |",
            self.ratios.len(),
            percent(inside),
            percent(below),
            percent(rates),
            right + wrong,
            percent(within),
            self.horizons[2],
            self.horizons[3],
            self.extrapolated.len(),
            self.without.values().sum::<u64>(),
        );
    }
}

fn horizon_class(told: Option<f64>, truth: Option<[f64; 2]>) -> usize {
    match (told, truth) {
        (Some(told), Some([first, last])) => usize::from(!(0.8 * first..=1.2 * last).contains(&told)),
        (Some(_), None) => 2,
        (None, _) => 3,
    }
}

/// All lines.
#[derive(Default)]
struct Table {
    all: Line,
    default: Line,
    lines: BTreeMap<(u8, String), Line>,
}

impl Table {
    fn take(&mut self, case: &Case, verdict: &Verdict, method: &str) {
        self.all.take(verdict);
        if case.is_default {
            self.default.take(verdict);
        }
        let kinds = case.kinds.iter().map(|kind| (0, (*kind).to_owned()));
        let rows = if case.rows < FINE { "coarse rows" } else { "fine rows" };
        for key in kinds.chain([(1, rows.to_owned()), (2, method.to_owned())]) {
            self.lines.entry(key).or_default().take(verdict);
        }
    }

    fn text(&self, cases: u64, seed: u64) -> String {
        let mut text = format!(
            "{cases} cases from seed {seed}.\n\n| cases | judged | inside [1/3, 10] | below | rates inside | rounding | horizons | within 20 % | never come | missed | \
             extrapolated | no estimate |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
        );
        self.all.print("all", &mut text);
        self.default.print("default settings", &mut text);
        for ((_, name), line) in &self.lines {
            line.print(name, &mut text);
        }
        let _ = writeln!(text, "\nNo estimate: {:?}\n\nNot judged: {:?}", self.all.without, self.all.unknown);
        text
    }
}

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(usual)
}

#[test]
fn estimates_are_near_the_truth() {
    let (cases, first) = (number("CASES", USUAL), number("SEED", FIRST));
    let shows = std::env::var("SHOW").is_ok();
    let mut table = Table::default();
    for seed in first..first + cases {
        let Some(case) = case(seed) else { continue };
        if let Ok(path) = std::env::var("FOUND") {
            std::fs::write(format!("{path}/{seed}.json"), case.scene.to_input().to_string())
                .expect("a folder");
        }
        let verdict = judge(&case);
        let method = case.request.method.map_or("chosen".to_owned(), |method| method.to_string());
        table.take(&case, &verdict, &method);
        let setting = case
            .request
            .rtol
            .or(case.request.step)
            .map_or("default".to_owned(), |setting| format!("{setting:.1e}"));
        let told = match &verdict {
            Verdict::Ratio([ratio, truth], rate) if !(1.0 / 3.0..=10.0).contains(ratio) => {
                format!("r = {ratio:.3e} at {truth:.1e}, rates {rate:?}")
            }
            Verdict::Ratio([ratio, truth], Some(rate)) if !(1.0 / 3.0..=10.0).contains(rate) => {
                format!("rates r = {rate:.3e}, angles {ratio:.2} at {truth:.1e}")
            }
            Verdict::Horizons(told, truth) if horizon_class(*told, *truth) > 0 => {
                format!("horizon {told:?} instead of {truth:?}")
            }
            Verdict::Rounding(false) => "too large at rounding".into(),
            Verdict::Extrapolated(ratio) => format!("extrapolated, r = {ratio:.2e}"),
            Verdict::None(why) => format!("none: {why}"),
            _ => continue,
        };
        if shows {
            println!(
                "{seed}: {:?} {method} {setting}{} rows {}: {told}",
                case.kinds,
                if case.request.extended { " extended" } else { "" },
                case.rows
            );
        }
    }
    let text = table.text(cases, first);
    println!("{text}");
    if let Ok(path) = std::env::var("ESTIMATES_TABLE") {
        let head = "# Estimates of the error against the truth\n\nWritten by `TABLE=1 .ci/estimates`; what is judged, and by what, is told in `tests/estimates.rs`.  Every figure is a \
                    share of the cases judged.\n\n";
        // What follows the table is kept.
        let before = std::fs::read_to_string(&path).unwrap_or_default();
        let rest = before.find("\n## ").map_or("", |from| &before[from..]);
        std::fs::write(&path, format!("{head}{text}{rest}")).expect("the table can be written");
    }
    let [inside, below, within] = table.all.shares();
    assert!(inside.is_nan() || inside >= 0.95, "inside: {inside}");
    assert!(below.is_nan() || below <= 0.02, "below: {below}");
    assert!(within.is_nan() || within >= 0.9, "horizons: {within}");
}
