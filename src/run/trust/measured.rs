//! What a reference solution has measured so far, and what it amounts to.

use super::growth::{Growth, Nature};
use super::tangent::TangentFlow;
use super::{CAUTION, HORIZON, How, LEAST, LOST, Level, Trust};
use crate::arithmetic::shown::estimate;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Times at which the estimate is kept.
const KEPT: usize = 512;
/// Growth within the second half of the time \[ln\] up to which a motion is regular.
const REGULAR: f64 = 2.0;
/// Powers of time with which the error of a regular motion grows.
const POWERS: [f64; 2] = [1.0, 2.0];

/// What a number loses where it is written as a double, as a share of it.
const ROUNDED: f64 = 2.2e-16;
/// Looks at the end without a comparison of rates after which nothing is told of them.
const UNTOLD: u32 = 2;
/// What the last digit of the scene's numbers moves them by, in units of their size; fitted.
pub(super) const LAST_DIGIT: f64 = 2.5 * 1.1e-16;

/// How far a run and its reference solution are apart at one time: an angle \[rad\], a rate \[rad/s\], and
/// the torque of a motor \[N·m\], each the largest.  `None` where it is not to be told there.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Apart {
    pub angle: f64,
    pub rate: Option<f64>,
    pub torque: Option<f64>,
}

/// What is measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct TrustMeasurement {
    pub level: Level,
    /// The reference solution, in words.
    pub name: String,
    /// What it cannot see, in words.
    pub shared: Vec<String>,
    /// True once its own rounding may be as large as the run's error: E is an upper bound then.
    pub is_bound: bool,
    /// The time reached \[s\], and E there: of angles, rates and torques.
    pub until: f64,
    pub error: f64,
    pub rate: f64,
    pub torque: Option<f64>,
    /// Impacts and lasting contacts of the run and of its reference at the last look, and at how many looks
    /// up to it their rates could not be compared.
    events: [u64; 2],
    untold: u32,
    /// The largest angle \[rad\], whole turns counted, or position over the longest bar, the largest rate
    /// \[rad/s\] and torque \[N·m\] seen: what their rounding is measured against.
    pub farthest: f64,
    pub fastest: f64,
    pub strongest: f64,
    pub record: Vec<[f64; 2]>,
    stride: u64,
    pub seen: u64,
    /// The time of the next look \[s\].
    pub due: f64,
    pub horizon: Option<f64>,
    /// Errors of rates and torques at the horizon.
    beside: Option<(f64, Option<f64>)>,
    pub lost: Option<f64>,
    /// What the last digit of the inputs came to at the horizon.
    pub input_error: Option<f64>,
    /// Why it went no further, and whether that is what it may cost.
    pub why: Option<String>,
    pub is_cut: bool,
    /// Growth of small differences against time, once the reference solution has ended, and of which kind it
    /// may be.
    pub history: Vec<[f64; 2]>,
    pub nature: Nature,
    /// Why nothing is known of it, or not from some time on.
    pub no_growth: Option<String>,
    /// The time \[s\] up to which it was followed where that would have cost too much, and what the last
    /// digit of the inputs had come to.
    stopped: Option<[f64; 2]>,
    /// Work spent, and of it that of the tangent flow.
    pub spent: f64,
    pub flow: f64,
    /// The work of the run so far.
    pub run: f64,
}

impl TrustMeasurement {
    /// Nothing so far.
    pub(super) fn new(level: Level, name: String, shared: Vec<String>) -> Self {
        Self {
            level,
            name,
            shared,
            is_bound: false,
            until: 0.0,
            error: 0.0,
            rate: 0.0,
            torque: None,
            events: [0; 2],
            untold: 0,
            farthest: 0.0,
            fastest: 0.0,
            strongest: 0.0,
            record: Vec::new(),
            stride: 1,
            seen: 0,
            due: 0.0,
            horizon: None,
            beside: None,
            lost: None,
            input_error: None,
            why: None,
            is_cut: false,
            history: Vec::new(),
            nature: Nature::default(),
            no_growth: None,
            stopped: None,
            spent: 0.0,
            flow: 0.0,
            run: 0.0,
        }
    }

    pub(super) fn is_sound(&self) -> bool {
        self.stride > 0 && !self.due.is_nan()
    }

    /// True where rates can be compared: between an impact of the run and that of its reference they differ
    /// by all of it, unless both have had none since the last look and bounces that died out were of another
    /// number.
    pub(super) fn tells_rates(&mut self, events: [u64; 2]) -> bool {
        let is_told = events[0] == events[1] || events == self.events;
        (self.events, self.untold) = (events, if is_told { 0 } else { self.untold + 1 });
        is_told
    }

    /// Takes what there is to see at a time \[s\]; true where the horizon is passed by it.
    pub(super) fn take(&mut self, t: f64, apart: Apart) -> bool {
        let passes = apart.angle > HORIZON && self.horizon.is_none();
        if passes {
            self.horizon = Some(crossing([self.until, self.error], [t, apart.angle]));
            // Of the look before, or of this one where it was the first: brought to where the error is that
            // of the horizon.
            let share = HORIZON / apart.angle;
            let larger = |before: f64, now: Option<f64>| now.map_or(before, |now| before.max(now * share));
            let torque =
                self.torque.or(apart.torque).map(|_| larger(self.torque.unwrap_or_default(), apart.torque));
            self.beside = Some((larger(self.rate, apart.rate), torque));
        }
        (self.until, self.error) = (t, self.error.max(apart.angle));
        self.rate = apart.rate.map_or(self.rate, |rate| self.rate.max(rate));
        if let Some(torque) = apart.torque {
            self.torque = Some(self.torque.unwrap_or_default().max(torque));
        }
        self.keep();
        passes
    }

    /// Takes what is known of growth when its flow ends.
    pub(super) fn conclude(&mut self, tangent: Option<&TangentFlow>) {
        let Some(tangent) = tangent else { return };
        self.history = tangent.history();
        // Where the flow ended early, what inputs come to at the end is not known.
        if self.input_error.is_none() && tangent.lost().is_none() {
            self.input_error = Some(LAST_DIGIT * tangent.reach_ahead(self.until));
        }
    }

    /// Takes what is known of growth where following it further would cost too much.
    pub(super) fn stop_growth(&mut self, tangent: Option<&TangentFlow>) {
        let Some(tangent) = tangent else { return };
        let [t, _] = tangent.now();
        (self.history, self.stopped) = (tangent.history(), Some([t, LAST_DIGIT * tangent.reach(t)]));
    }

    /// What the last digit of the inputs comes to at a time \[s\]: beyond what was followed it grows as the
    /// error of the run does, which is a small difference, too.  That goes where growth is known to be
    /// exponential, and else from the second half of the way on: in the beginning an error tells nothing of
    /// how it grows.
    fn inputs_at(&self, t: f64, is_chaotic: bool) -> Option<f64> {
        let [until, reach] = self.stopped.filter(|[until, _]| is_chaotic || *until >= 0.5 * t)?;
        let grown = if t >= self.until { self.error } else { self.error_at(t) };
        (t <= self.until).then(|| reach * (grown / self.error_at(until)).max(1.0))
    }

    /// E at a time that was passed \[s\].
    pub(super) fn error_at(&self, t: f64) -> f64 {
        self.record.iter().take_while(|look| look[0] <= t).last().map_or(LEAST, |look| look[1].max(LEAST))
    }

    /// Keeps the estimate of this time.
    fn keep(&mut self) {
        if self.record.len() == KEPT {
            // The first one stays.
            let mut keep = false;
            self.record.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride *= 2;
        }
        if self.seen.is_multiple_of(self.stride) {
            self.record.push([self.until, self.error]);
        }
        self.seen += 1;
    }

    /// Leaves out what was seen after the last output time of a run that stopped, `t` \[s\].
    fn cut(&mut self, t: f64) {
        self.lost = self.lost.filter(|&lost| lost <= t);
        if self.horizon.is_some_and(|horizon| horizon > t) {
            (self.horizon, self.beside, self.input_error) = (None, None, None);
        }
        if self.horizon.is_none() {
            let before = self.record.iter().rev().find(|look| look[0] <= t);
            let after = self.record.iter().find(|look| look[0] > t && look[1] <= HORIZON);
            self.error = after.or(before).map_or(self.error.min(HORIZON), |look| look[1]);
        }
        self.record.retain(|look| look[0] <= t);
        self.until = t;
    }

    /// How errors grew up to the end of the run, `t` \[s\], as far as that was followed; notes where it was
    /// not followed far enough.
    fn growth(&mut self, t: f64) -> Growth {
        let Growth { lyapunov, power: found, why: neither } =
            if self.no_growth.is_some() { Growth::default() } else { self.nature.judge(&self.history) };
        // A power shows over most of the run only: in the beginning it is that of one oscillation.
        let power = found.filter(|_| self.stopped.is_none_or(|[followed, _]| followed >= 0.5 * t));
        if let (Some([followed, _]), None, None) = (self.stopped, lyapunov, power) {
            let why = || {
                let seconds = if followed >= 0.01 { format!("{followed:.2}") } else { estimate(followed) };
                format!(
                    "it was followed to t = {seconds} s only, more would have taken too large a share of the \
                        run (see --trust full)"
                )
            };
            self.no_growth.get_or_insert_with(why);
        }
        let is_open = self.no_growth.is_none() && power.is_none() && lyapunov.is_none();
        Growth { lyapunov, power, why: neither.filter(|_| is_open) }
    }

    /// What it has come to at the end of the run, `t` \[s\].
    pub(super) fn trust(mut self, t: f64) -> Trust {
        if self.until > t {
            self.cut(t);
        }
        let Growth { lyapunov, power: growth_power, why } = self.growth(t);
        let unclear_growth = why.map(str::to_owned);
        let input_error =
            self.input_error.or_else(|| self.inputs_at(self.horizon.unwrap_or(t), lyapunov.is_some()));
        let Self {
            name,
            shared,
            until,
            error,
            mut record,
            horizon,
            lost,
            why,
            is_cut,
            history,
            no_growth,
            nature,
            ..
        } = self;
        if record.last().is_some_and(|last| last[0] < until) {
            record.push([until, error]);
        }
        let mut trust = Trust {
            how: How::None,
            error_estimate: None,
            rate_error: None,
            torque_error: None,
            is_upper_bound: self.is_bound,
            at: t,
            horizon,
            lost,
            lyapunov,
            growth_power,
            no_growth,
            unclear_growth,
            // More is no more uncertain.
            input_error: input_error.filter(|&error| error > 0.0).map(|error| error.min(TAU)),
            inputs: None,
            model_error: None,
            error_estimator: Some(name),
            shared,
            covered: until,
            why,
            record,
            work: [self.spent, self.flow, self.run],
        };
        // Angles and positions are written as doubles.
        let least = LEAST.max(ROUNDED * self.farthest);
        let printed = |error: f64| (CAUTION * error).max(least);
        let (mut rate, mut torque) = (self.rate, self.torque);
        if let (Some(horizon), Some(beside)) = (trust.horizon, self.beside) {
            trust.how = How::ReferenceSolution;
            (trust.error_estimate, trust.at) = (Some(printed(HORIZON)), horizon);
            (rate, torque) = beside;
        } else if until >= t && trust.record.len() > 1 || t == 0.0 {
            (trust.how, trust.error_estimate) = (How::ReferenceSolution, Some(printed(error)));
        } else if let Some(power) = power(&trust.record, &history, nature, t).filter(|_| is_cut) {
            (trust.how, trust.is_upper_bound) = (How::Extrapolated(until), false);
            let base = error.max(LEAST);
            let ahead = base * libm::pow(t / until, power);
            if ahead > HORIZON {
                let at = until * libm::pow(HORIZON / base, 1.0 / power);
                (trust.horizon, trust.at) = (Some(at), at);
            }
            if ahead > LOST {
                trust.lost = Some(until * libm::pow(LOST / base, 1.0 / power));
            }
            let share = ahead.min(HORIZON) / base;
            (rate, torque) = (rate * share, torque.map(|torque| torque * share));
            trust.error_estimate = Some(printed(ahead.min(HORIZON)));
        }
        trust.is_upper_bound &= trust.error_estimate.is_some();
        if trust.error_estimate.is_some() {
            let is_told = self.untold <= UNTOLD;
            trust.rate_error = is_told.then_some((CAUTION * rate).max(LEAST * self.fastest));
            trust.torque_error = torque.map(|torque| (CAUTION * torque).max(LEAST * self.strongest));
        }
        trust
    }
}

/// The time at which the error passes the horizon between two looks, `[t, E]` each: it grows exponentially
/// from one to the other, or as the square of the time from nothing.
pub(in crate::run) fn crossing([t0, e0]: [f64; 2], [t1, e1]: [f64; 2]) -> f64 {
    if e0 <= 0.0 {
        return t0 + (t1 - t0) * (HORIZON / e1).sqrt();
    }
    t0 + (t1 - t0) * (libm::log(HORIZON / e0) / libm::log(e1 / e0))
}

/// The power of time with which the error of a regular motion grew over the last three quarters of the
/// logarithm of time; `None` where it is not known to be regular, over many turns or half of the run of
/// `until` \[s\] at least.
fn power(record: &[[f64; 2]], history: &[[f64; 2]], nature: Nature, until: f64) -> Option<f64> {
    let (last, end) = (history.last()?, record.last()?);
    let half = history.iter().rev().find(|point| point[0] <= 0.5 * last[0])?;
    let is_known = nature.has_shown(last[0]) || last[0] >= 0.5 * until;
    if !is_known || !last[1].is_finite() || last[1] - half[1] > REGULAR {
        return None;
    }
    let first = record.iter().find(|point| point[0] > 0.0)?;
    let from = first[0] * libm::pow(end[0] / first[0], 0.25);
    let points: Vec<[f64; 2]> = record
        .iter()
        .filter(|point| point[0] >= from && point[1] > 0.0)
        .map(|point| point.map(libm::log))
        .collect();
    let count = points.len() as f64;
    let mean = |k: usize| points.iter().map(|point| point[k]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let (above, below) = points.iter().fold((0.0, 0.0), |(above, below), point| {
        (above + (point[0] - x) * (point[1] - y), below + (point[0] - x) * (point[0] - x))
    });
    let slope = if below > 0.0 { above / below } else { POWERS[1] };
    Some(slope.clamp(POWERS[0], POWERS[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_carried_on_where_growth_was_followed_in_the_beginning_only() {
        let record: Vec<[f64; 2]> = (1..=20).map(|k| [0.1 * f64::from(k), 1e-9 * f64::from(k)]).collect();
        let followed = |until: f64| -> Vec<[f64; 2]> {
            (0..=8).map(|k| [until * f64::from(k) / 8.0, 0.05 * f64::from(k)]).collect()
        };
        let power = |followed_to, until| power(&record, &followed(followed_to), Nature::default(), until);
        assert!(power(1.5, 3.0).is_some_and(|power| (power - 1.0).abs() < 0.1));
        assert_eq!(power(0.5, 2.0), None);
        // Half of what the reference solution covered is little of a run that is much longer.
        assert_eq!(power(1.5, 10.0), None);
    }

    #[test]
    fn an_estimate_is_carried_on_from_where_the_budget_ends_and_not_from_a_stop() {
        let mut measured = TrustMeasurement::new(Level::Auto, String::new(), Vec::new());
        for k in 0..=20 {
            let t = 0.1 * f64::from(k);
            measured.take(t, Apart { angle: 1e-9 * t, ..Apart::default() });
        }
        measured.history = (0..=8).map(|k| [0.25 * f64::from(k), 0.05 * f64::from(k)]).collect();
        measured.why = Some("the reference solution stopped".into());
        let stopped = measured.clone().trust(4.0);
        assert_eq!((stopped.how, stopped.error_estimate), (How::None, None));
        measured.is_cut = true;
        let cut = measured.trust(4.0);
        assert_eq!(cut.how, How::Extrapolated(2.0));
        assert!(cut.error_estimate.is_some_and(|error| (error / (CAUTION * 4e-9) - 1.0).abs() < 0.1));
    }

    #[test]
    fn the_horizon_lies_where_the_error_passes_it() {
        // Tenfold a second from 1e-6 at 0.
        let found = crossing([0.0, 1e-6], [5.0, 0.1]);
        assert!((found - 3.0).abs() < 1e-12);
        let found = crossing([1.0, 0.0], [3.0, 4e-3]);
        assert!((found - 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_seen_after_the_last_row_is_left_out() {
        let mut measured = TrustMeasurement::new(Level::Auto, String::new(), Vec::new());
        for (t, angle) in [(0.0, 0.0), (1.0, 1e-9), (2.0, 1e-6), (3.0, 0.2)] {
            measured.take(t, Apart { angle, ..Apart::default() });
        }
        measured.lost = Some(3.0);
        assert!(measured.clone().trust(3.0).horizon.is_some_and(|horizon| horizon > 2.0));
        let trust = measured.trust(1.5);
        assert_eq!((trust.horizon, trust.lost, trust.covered, trust.at), (None, None, 1.5, 1.5));
        assert_eq!((trust.error_estimate, trust.record.last()), (Some(CAUTION * 1e-6), Some(&[1.5, 1e-6])));
    }

    #[test]
    fn a_regular_error_is_carried_on_by_its_power_and_a_chaotic_one_is_not() {
        let times: Vec<f64> = (0..100).map(f64::from).collect();
        let record: Vec<[f64; 2]> = times.iter().map(|&t| [t, 1e-12 * t.powf(1.5)]).collect();
        let regular: Vec<[f64; 2]> = times.iter().map(|&t| [t, (1.0 + t).ln()]).collect();
        let chaotic: Vec<[f64; 2]> = times.iter().map(|&t| [t, t]).collect();
        assert!((power(&record, &regular, Nature::default(), 100.0).expect("regular") - 1.5).abs() < 1e-9);
        assert_eq!(power(&record, &chaotic, Nature::default(), 100.0), None);
    }
}
