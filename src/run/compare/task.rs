//! The comparison itself: lines of settings, measured rung by rung and timed round by round.

use super::measure::{MeasurementEnd, RunMeasurement};
use super::truth::{TimeLimit, Truth, together};
use super::{Asked, Comparison, Entry, Fate, Stage, ladder, measure, name};
use crate::dynamics::{Mechanism, Motion};
use crate::run::drift::Limits;
use crate::run::methods::{METHODS, MethodId, Stabilization};
use crate::run::plan::{Plan, Request, RequestRefusal};
use crate::run::running::{Run, Running};
use crate::scene::Scene;
use std::sync::Arc;
use std::time::Duration;

/// Time a block of repeated short runs fills \[s\].
const QUANTUM: f64 = 0.01;
/// Shares of the budget for the common life of two near runs, for the reference, and up to which settings are
/// measured.
const SHARES: [f64; 3] = [0.05, 0.25, 0.6];
/// Output times on the way to where errors are measured, at least, and most of all: methods that are not
/// dense cut their steps there, so that they are few.
const LOOKS: f64 = 8.0;
const MOST_LOOKS: f64 = 1e6;
/// A finer setting whose error is above this share of the best so far brings nothing, once errors are below
/// the second number \[rad\]; below the third there is nothing to be gained.
const NO_BETTER: [f64; 3] = [0.5, 1e-4, 1e-13];
/// Settings of a method, and how many times the time of `dp8` at 1e-9 one of them takes, in the mean; to
/// guess what a horizon costs.
const GUESS: [f64; 2] = [8.0, 8.0];
/// Output times of the run that tells what a horizon costs.
const PARTS: f64 = 200.0;

/// A method with a stabilization, and the settings it has yet to be tried at.
struct MethodLine {
    method: MethodId,
    extended: bool,
    stabilize: Option<Stabilization>,
    /// From the last one on.
    rungs: Vec<Request>,
    best: f64,
    /// Settings in a row that brought nothing.
    idle: usize,
    /// Time of the last one \[s\], and its evaluations.
    last: f64,
    evaluations: u64,
}

/// Compares methods on a scene; `see` is told how far it is, and it is given up where all `is_over`.
///
/// # Errors
/// A horizon that makes no sense.  What a method refuses is an entry.
pub fn compare(
    scene: &Scene,
    mechanism: &Arc<Mechanism>,
    asked: &Asked,
    clock: &dyn Fn() -> Duration,
    see: &mut dyn FnMut(&Stage),
    is_over: &dyn Fn() -> bool,
) -> Result<Comparison, RequestRefusal> {
    let until = asked.horizon(scene, mechanism)?;
    let start = mechanism.start(scene);
    let task = CompareTask { scene, mechanism, start: &start, asked, begin: clock(), clock, is_over };
    Ok(task.run(until, see))
}

struct CompareTask<'a> {
    scene: &'a Scene,
    mechanism: &'a Arc<Mechanism>,
    start: &'a Motion,
    asked: &'a Asked,
    begin: Duration,
    clock: &'a dyn Fn() -> Duration,
    is_over: &'a dyn Fn() -> bool,
}

impl CompareTask<'_> {
    fn run(&self, mut until: f64, see: &mut dyn FnMut(&Stage)) -> Comparison {
        let mut notes = Vec::new();
        if let Some((event, t)) = self.ended_by(until) {
            // Coarse settings may find it earlier.
            let before = 0.99 * t;
            let digits = libm::exp10(libm::floor(libm::log10(before)) - 2.0);
            let rounded = format!("{:.2e}", (before / digits).floor() * digits);
            until = rounded.parse().unwrap_or(before);
            notes.push(format!(
                "the event {event} ends the motion at t = {t:.6} s: methods are compared up to {until} s"
            ));
        }
        see(&self.stage("how long paths mean anything"));
        let near = together(
            self.mechanism,
            self.start,
            self.scene.every.min(until),
            until,
            self.room(SHARES[0]),
            self.is_over,
        );
        if let Some(stop) = &near.stop {
            let (t, what) = (crate::arithmetic::shown::figure(stop.t), &stop.what);
            notes.push(format!("runs in doubles for the horizon stopped at t = {t} s: {what}"));
        }
        let mut measured = near.horizon.unwrap_or(if near.until > 0.0 { near.until } else { until });
        let lines = self.lines_of(|_, _| Vec::new(), &mut Vec::new(), until).len();
        if self.asked.until.is_none()
            && let Some(possible) = self.possible(until, lines)
        {
            until =
                if near.horizon.is_some() { possible.max(ladder::round_down(measured)) } else { possible };
            notes.push(format!(
                "the horizon is {until} s, which all methods can be taken to in the time given; --until or \
                    --budget change that"
            ));
        }
        measured = measured.min(until);
        let looks = (LOOKS * until / measured.max(f64::MIN_POSITIVE)).clamp(LOOKS, MOST_LOOKS);
        let every = ladder::interval(until, looks);
        see(&self.stage("reference"));
        let mut truth =
            Truth::new(self.mechanism, self.start, every, measured, self.room(SHARES[1]), self.is_over);
        truth.horizon = near.horizon.filter(|&horizon| horizon < until);
        if let Some(why) = &truth.why {
            notes.push(format!("errors are measured up to t = {:.4} s: {why}", truth.until));
        } else if truth.until < until && truth.horizon.is_none() {
            notes.push(format!("errors are measured up to t = {:.4} s: no time for more", truth.until));
        }
        let mut comparison =
            Comparison { until, truth, entries: Vec::new(), notes, is_whole: false, wall: Duration::ZERO };
        let steps = |method: MethodId, usual: f64| ladder::steps(method.info(), usual, every);
        let mut lines = self.lines_of(steps, &mut comparison.entries, until);
        for request in lines.iter_mut().flat_map(|line| &mut line.rungs) {
            request.every = Some(every);
        }
        self.measure(&mut comparison, &mut lines, see);
        comparison.is_whole = self.repeat(&mut comparison, see);
        comparison.wall = self.spent();
        comparison
    }

    /// The event that ends the motion before `until` \[s\], and when \[s\].
    fn ended_by(&self, until: f64) -> Option<(String, f64)> {
        if !self.mechanism.has_stops() {
            return None;
        }
        let request = Request { until: Some(until), every: Some(until), ..Request::default() };
        let plan = Plan::new(self.scene, self.mechanism, &request).ok()?;
        let run = Run::new(Arc::clone(self.mechanism), plan, Limits::default(), self.start).ok()?;
        let mut running = Running::new(run);
        running.go(&mut |_| Ok(()), &mut || (self.is_over)()).ok()?;
        let outcome = running.finish();
        outcome.ended_by.map(|event| (event, outcome.last.t)).filter(|(_, t)| *t > 0.0)
    }

    /// The methods and stabilizations asked for, with their settings; what is refused is an entry.
    fn lines_of(
        &self,
        steps: impl Fn(MethodId, f64) -> Vec<f64>,
        entries: &mut Vec<Entry>,
        until: f64,
    ) -> Vec<MethodLine> {
        let mut lines: Vec<MethodLine> = Vec::new();
        let all: Vec<MethodId> = METHODS.iter().map(|info| info.id).collect();
        let methods = if self.asked.methods.is_empty() { &all } else { &self.asked.methods };
        let kinds: Vec<Option<Stabilization>> = match self.asked.stabilize.is_empty() {
            true => vec![None],
            false => self.asked.stabilize.iter().copied().map(Some).collect(),
        };
        let mut seen = Vec::new();
        for (&method, &stabilize) in
            methods.iter().flat_map(|method| kinds.iter().map(move |kind| (method, kind)))
        {
            let is_twice = seen.contains(&(method, stabilize));
            seen.push((method, stabilize));
            for extended in [false, true]
                .into_iter()
                .filter(|&extended| !is_twice && (!extended || method == MethodId::Taylor))
            {
                let request = Request {
                    method: Some(method),
                    stabilize,
                    extended,
                    until: Some(until),
                    ..Request::default()
                };
                let plan = match Plan::new(self.scene, self.mechanism, &request) {
                    Ok(plan) => plan,
                    Err(refusal) => {
                        entries.push(Entry::without(
                            method,
                            extended,
                            stabilize,
                            None,
                            Fate::Refused(refusal),
                        ));
                        continue;
                    }
                };
                // Where there is nothing to stabilize all stabilizations are one.
                let is_one = self.mechanism.constraints.is_empty();
                if is_one && lines.iter().any(|line| (line.method, line.extended) == (method, extended)) {
                    continue;
                }
                let at = |rtol: Option<f64>, step: Option<f64>| Request { rtol, step, ..request.clone() };
                let mut rungs: Vec<Request> = match plan.step {
                    Some(usual) => {
                        steps(method, usual).into_iter().map(|step| at(None, Some(step))).collect()
                    }
                    None => ladder::tolerances(method.info(), extended)
                        .iter()
                        .map(|&rtol| at(Some(rtol), None))
                        .collect(),
                };
                rungs.reverse();
                lines.push(MethodLine {
                    method,
                    extended,
                    stabilize,
                    rungs,
                    best: f64::INFINITY,
                    idle: 0,
                    last: 0.0,
                    evaluations: 0,
                });
            }
        }
        lines
    }

    /// A horizon up to which there is probably time to take all methods \[s\], where that is less than
    /// `until` \[s\].
    fn possible(&self, until: f64, lines: usize) -> Option<f64> {
        let method = if self.mechanism.tree.is_dense() || !self.mechanism.constraints.is_empty() {
            MethodId::Dp8
        } else {
            MethodId::Dop853
        };
        // How far it is, is told by the last output time.
        let request = Request {
            method: Some(method),
            until: Some(until),
            every: Some(until / PARTS),
            ..Request::default()
        };
        let plan = Plan::new(self.scene, self.mechanism, &request).ok()?;
        let begin = (self.clock)();
        let room = TimeLimit { clock: self.clock, seconds: 0.1 };
        let truth = Truth::none(self.mechanism);
        let reached = match measure::measure(self.mechanism, self.start, plan, &truth, room, self.is_over) {
            Ok(MeasurementEnd::Late(t)) => t,
            Ok(MeasurementEnd::Stopped(_, stop)) | Err(stop) => stop.t,
            Ok(MeasurementEnd::Whole(..) | MeasurementEnd::Over) => until,
        };
        let spent = (self.clock)().saturating_sub(begin).as_secs_f64();
        let cost = GUESS[0] * GUESS[1] * lines as f64 * spent / reached.max(f64::MIN_POSITIVE);
        let most = (SHARES[2] - SHARES[1]) * self.asked.budget.as_secs_f64() / cost;
        (most < until && reached > 0.0).then(|| ladder::round_down(most))
    }

    /// Measures all settings, rung by rung, and times each once.
    fn measure(&self, comparison: &mut Comparison, lines: &mut [MethodLine], see: &mut dyn FnMut(&Stage)) {
        while lines.iter().any(|line| !line.rungs.is_empty()) {
            for number in 0..lines.len() {
                if (self.is_over)() {
                    return;
                }
                let open = lines.iter().filter(|line| !line.rungs.is_empty()).count();
                let line = &mut lines[number];
                let Some(request) = line.rungs.pop() else { continue };
                see(&self.stage(&line.name()));
                let left = SHARES[2] * self.asked.budget.as_secs_f64() - self.spent().as_secs_f64();
                let room = TimeLimit { clock: self.clock, seconds: (left / open as f64).max(QUANTUM) };
                let (entry, is_over) = self.entry(line, &request, &comparison.truth, room);
                comparison.entries.extend(entry);
                if is_over {
                    return;
                }
            }
        }
    }

    /// Measures one setting; the second is true where it was given up.
    fn entry(
        &self,
        line: &mut MethodLine,
        request: &Request,
        truth: &Truth,
        room: TimeLimit,
    ) -> (Option<Entry>, bool) {
        let plan = match Plan::new(self.scene, self.mechanism, request) {
            Ok(plan) => plan,
            Err(refusal) => {
                let refused =
                    Entry::without(line.method, line.extended, line.stabilize, None, Fate::Refused(refusal));
                return (Some(refused), false);
            }
        };
        let has_rows = !self.mechanism.constraints.is_empty();
        let kept = if has_rows { Some(plan.stabilization) } else { None };
        let mut entry = Entry::without(line.method, line.extended, kept, Some(plan.clone()), Fate::Late(0.0));
        // A finer setting takes no less time than the one before.
        if line.last > room.seconds {
            return (Some(entry), false);
        }
        let begin = (self.clock)();
        match measure::measure(self.mechanism, self.start, plan, truth, room, self.is_over) {
            Ok(MeasurementEnd::Over) => return (None, true),
            Ok(MeasurementEnd::Late(t)) => {
                entry.fate = Fate::Late(t);
                line.last = f64::INFINITY;
            }
            Ok(MeasurementEnd::Stopped(found, stop)) => {
                entry.fate = Fate::Stopped(stop);
                entry.found = Some(found);
            }
            Err(stop) => entry.fate = Fate::Stopped(stop),
            Ok(MeasurementEnd::Whole(found, plan)) => {
                line.last = (self.clock)().saturating_sub(begin).as_secs_f64();
                line.judge(&found);
                entry.fate = Fate::Done;
                let room = TimeLimit { clock: self.clock, seconds: QUANTUM };
                let block =
                    measure::time(self.mechanism, self.start, &plan, Some(line.last), room, self.is_over);
                entry.blocks.extend(block);
                entry.found = Some(found);
                entry.plan = Some(*plan);
            }
        }
        (Some(entry), false)
    }

    /// Times all settings again, in turn and in another order each time, as long as there is time; true where
    /// it came to its end.
    fn repeat(&self, comparison: &mut Comparison, see: &mut dyn FnMut(&Stage)) -> bool {
        let (blocks, count) = (self.asked.blocks, comparison.entries.len());
        for round in 1..blocks {
            for k in 0..count {
                // A step that goes through all of them in another order each time.
                let number = (k + round * count.div_ceil(blocks)) % count;
                if (self.is_over)() {
                    return false;
                }
                let Some(block) = comparison.entries[number].median().map(|median| median.max(QUANTUM))
                else {
                    continue;
                };
                let left = self.asked.budget.saturating_sub(self.spent());
                if block > left.as_secs_f64() {
                    continue;
                }
                let costs = comparison
                    .entries
                    .iter()
                    .filter_map(Entry::median)
                    .map(|median| median.max(QUANTUM))
                    .sum::<f64>();
                let rest = ((blocks - round) as f64 - k as f64 / count as f64) * costs;
                let mut stage = self.stage("timing");
                stage.left = stage.left.min(Duration::from_secs_f64(rest));
                stage.share =
                    self.spent().as_secs_f64() / (self.spent() + stage.left).as_secs_f64().max(1e-9);
                see(&stage);
                let entry = &mut comparison.entries[number];
                let Some(plan) = &entry.plan else { continue };
                let room = TimeLimit { clock: self.clock, seconds: QUANTUM };
                let before = entry.blocks.last().copied();
                entry.blocks.extend(measure::time(
                    self.mechanism,
                    self.start,
                    plan,
                    before,
                    room,
                    self.is_over,
                ));
            }
        }
        !(self.is_over)()
    }

    fn spent(&self) -> Duration {
        (self.clock)().saturating_sub(self.begin)
    }

    fn room(&self, share: f64) -> TimeLimit<'_> {
        TimeLimit { clock: self.clock, seconds: share * self.asked.budget.as_secs_f64() }
    }

    /// What can be told before it is known what all of it takes: no more than the budget.
    fn stage(&self, doing: &str) -> Stage {
        let left = self.asked.budget.saturating_sub(self.spent());
        let share = self.spent().as_secs_f64() / self.asked.budget.as_secs_f64().max(1e-9);
        Stage { doing: doing.to_owned(), left, share: share.min(1.0) }
    }
}

impl MethodLine {
    fn name(&self) -> String {
        name(self.method, self.extended, self.stabilize)
    }

    /// Ends the line where finer settings bring nothing: twice in a row the error, or where there is none to
    /// be had the drift, is no better.
    fn judge(&mut self, found: &RunMeasurement) {
        let figure = if found.error.is_finite() { found.error } else { found.energy };
        // A setting that takes no more evaluations than the one before has made the same steps, and says
        // nothing.
        let has_worked = found.statistics.evaluations
            > std::mem::replace(&mut self.evaluations, found.statistics.evaluations);
        let is_idle = has_worked && figure > NO_BETTER[0] * self.best && self.best < NO_BETTER[1];
        self.idle = if is_idle { self.idle + 1 } else { 0 };
        self.best = self.best.min(figure);
        if self.idle >= 2 || self.best <= NO_BETTER[2] {
            self.rungs.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finer_settings_are_tried_as_long_as_they_bring_something() {
        let mut line = MethodLine {
            method: MethodId::Taylor,
            extended: false,
            stabilize: None,
            rungs: vec![Request::default(); 9],
            best: f64::INFINITY,
            idle: 0,
            last: 0.0,
            evaluations: 0,
        };
        let mut statistics = crate::stepping::Statistics::default();
        let mut goes_on = |error: f64| {
            statistics.evaluations += 10;
            let found = RunMeasurement {
                error,
                rate_error: error,
                errors: Vec::new(),
                energy: 1e-9,
                constraint: None,
                statistics,
            };
            line.judge(&found);
            !line.rungs.is_empty()
        };
        // Lost paths, then progress, one setting without, and two.
        assert!([3.0, 7.0, 5.0, 1e-3, 1e-6, 2e-6, 1e-7, 0.9e-7].into_iter().all(&mut goes_on));
        assert!(!goes_on(2e-7));
    }
}
