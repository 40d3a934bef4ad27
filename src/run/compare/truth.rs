//! What the runs are held against: the reference motion, how far it means anything, and the distance of a run from it.

use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::contact::Course;
use crate::run::march::build;
use crate::run::methods::MethodId;
use crate::run::plan::{MANY_COORDINATES, Plan};
use crate::run::reference::{Reference, reference};
use crate::run::running::Outcome;
use crate::run::trust::Ruler;
use crate::stepping::{StepError, Tolerance};
use std::sync::Arc;
use std::time::Duration;

/// Distance \[rad\] at which motions from starts an ulp apart count as parted.
const PARTED: f64 = 1e-3;
/// Growth of the times at which that is looked at.
const GROWTH: f64 = 1e-3;
/// Times, at most, at which errors are told one by one.
const MARKS: usize = 8;
/// Tolerances of a reference in doubles and of what it is compared with.
const FINE: [f64; 2] = [1e-14, 1e-13];
/// Times of fixed steps and of the reference agree to this share; see [`Truth::error`].
const SAME_TIME: f64 = 1e-9;

/// A reference motion at times that are a fixed interval apart.
#[derive(Clone, Debug)]
pub struct Truth {
    /// How it was made, in words.
    pub how: String,
    /// Until when errors are measured \[s\].
    pub until: f64,
    /// When motions from starts an ulp apart part \[s\], where they do before the horizon.
    pub horizon: Option<f64>,
    /// About how far it is off by itself: the largest difference of its two motions \[rad, 1/s\].
    pub accuracy: f64,
    /// Why errors are not measured to the horizon, where they are not.
    pub why: Option<String>,
    pub(super) every: f64,
    pub(super) motions: Vec<Motion>,
    /// Accelerations at these times \[rad/s², m/s²\].
    pub(super) accelerations: Vec<Vec<f64>>,
    /// Numbers of the times at which errors are told one by one.
    pub(super) marks: Vec<usize>,
    pub(super) ruler: Ruler,
}

impl Truth {
    /// No reference at all.
    pub(super) fn none(mechanism: &Mechanism) -> Self {
        Self {
            how: "none".to_owned(),
            until: 0.0,
            horizon: None,
            accuracy: 0.0,
            why: None,
            every: 1.0,
            motions: Vec::new(),
            accelerations: Vec::new(),
            marks: Vec::new(),
            ruler: Ruler::new(mechanism),
        }
    }

    /// Times at which errors are told one by one \[s\].
    pub fn marks(&self) -> impl Iterator<Item = f64> {
        self.marks.iter().map(|&row| self.motions[row].time.hi)
    }

    /// How far a motion is off: angles \[rad\] or places over the mechanism's size, and rates; and the number among [`Truth::marks`], where it is one.
    /// `None` where there is no reference at its time.
    pub fn error(&self, motion: &Motion) -> Option<([f64; 2], Option<usize>)> {
        let row = (motion.time.hi / self.every).round() as usize;
        let known = self.motions.get(row.wrapping_sub(1))?;
        let late = (motion.time - known.time).hi;
        if late.abs() > SAME_TIME * self.every {
            return None;
        }
        // Fixed steps meet the times of the reference to rounding; what the motion does in that time is no error.
        let there;
        let known = if late == 0.0 {
            known
        } else {
            let accelerations = &self.accelerations[row - 1];
            let mut moved = known.clone();
            for k in 0..moved.phi.len() {
                moved.phi[k] += known.omega[k] * Time::from(late);
                moved.omega[k] = moved.omega[k] + accelerations[k] * late;
            }
            there = moved;
            &there
        };
        let mark = self.marks.iter().position(|&mark| mark == row - 1);
        Some(([self.ruler.apart(motion, known), self.ruler.rates_apart(motion, known)], mark))
    }

    /// The reference of a mechanism every so often \[s\], as far as `until` \[s\] and what time there is for it.
    pub(super) fn new(mechanism: &Arc<Mechanism>, start: &Motion, every: f64, until: f64, room: Room) -> Self {
        let count = (until / every * (1.0 + 1e-12)).floor() as usize;
        let times: Vec<Time> = (1..=count).map(|row| Time::product(every, row as f64)).collect();
        let is_large = is_in_doubles(mechanism);
        let make = |times: &[Time]| if is_large { fine(mechanism, start, times) } else { reference(mechanism, start, times) };
        let mut why = None;
        if count == 0 {
            return Self { why: Some("paths part at once".to_owned()), ..Self::none(mechanism) };
        }
        // A first part tells what the whole would take.
        let first = count.div_ceil(32).min(count);
        let begin = (room.clock)();
        let mut found = make(&times[..first]);
        let spent = (room.clock)().saturating_sub(begin).as_secs_f64();
        let possible = (room.seconds / spent.max(1e-9) * first as f64) as usize;
        if found.is_ok() && count > first {
            if possible < count {
                why = Some("the reference takes too long for more".to_owned());
            }
            found = make(&times[..count.min(possible.max(first))]);
        }
        // Where it stops on the way, what comes before is as good.
        let mut most = count;
        let found = loop {
            match found {
                Ok(found) => break found,
                Err(stop) => {
                    why = Some(format!("the reference stopped at t = {:.4} s: {}", stop.t, stop.what));
                    let reached = ((stop.t / every) as usize).min(most.saturating_sub(1));
                    if reached == 0 {
                        break Reference::default();
                    }
                    most = reached;
                    found = make(&times[..reached]);
                }
            }
        };
        let Reference { mut motions, accuracy } = found;
        let sound = accuracy.iter().take_while(|&&accuracy| accuracy < PARTED).count();
        if sound < motions.len() {
            why = Some("the reference itself is no better there".to_owned());
            motions.truncate(sound);
        }
        let mut kernel = Kernel::<f64>::new(mechanism);
        let accelerations = motions.iter().map(|motion| acceleration(mechanism, &mut kernel, motion)).collect();
        let count = motions.len();
        let marks = (1..=MARKS.min(count)).map(|mark| mark * count / MARKS.min(count) - 1).collect();
        let how = if is_large {
            format!("dp8 at tolerance {:e}", FINE[0])
        } else if mechanism.contacts.is_empty() {
            "taylor of order 30 in double-double".to_owned()
        } else {
            "taylor at tolerance 1e-16, through its impacts".to_owned()
        };
        Self {
            how,
            until: motions.last().map_or(0.0, |motion| motion.time.hi),
            horizon: None,
            accuracy: accuracy[..count].iter().copied().fold(0.0, f64::max),
            why,
            every,
            motions,
            accelerations,
            marks,
            ruler: Ruler::new(mechanism),
        }
    }
}

/// What time there is for something.
#[derive(Clone, Copy)]
pub(super) struct Room<'a> {
    pub clock: &'a dyn Fn() -> Duration,
    /// \[s\]
    pub seconds: f64,
}

/// A run that is read at any times, without drift or samples.
struct Walk {
    course: Course,
    outcome: Outcome,
}

impl Walk {
    fn begin(mechanism: &Arc<Mechanism>, start: &Motion, method: MethodId, tolerance: f64, until: f64) -> Result<Self, StepError> {
        let tolerance = Tolerance { relative: tolerance, absolute: tolerance };
        let mut plan = Plan { method, ..Plan::of_series(mechanism, tolerance, until) };
        let marcher = build(mechanism, &mut plan, start)?;
        let mut outcome = Outcome::begun(mechanism, plan);
        let mut course = Course::new(Arc::clone(mechanism), marcher);
        course.meet(&mut outcome)?;
        Ok(Self { course, outcome })
    }

    /// The motion at a time; `None` where that was given up.
    fn to(&mut self, time: Time, is_over: &dyn Fn() -> bool) -> Result<Option<Motion>, StepError> {
        Ok(self.course.go(time, &mut self.outcome, &mut || is_over())?.then(|| self.course.motion()))
    }
}

/// True where there is no series in double-double, or where it would take too long.
fn is_in_doubles(mechanism: &Mechanism) -> bool {
    mechanism.coordinates() > MANY_COORDINATES || mechanism.vibration.is_some()
}

/// A reference in doubles, for mechanisms whose series in double-double would take too long.
fn fine(mechanism: &Arc<Mechanism>, start: &Motion, times: &[Time]) -> Result<Reference, StepError> {
    let until = times.last().copied().unwrap_or_default().hi;
    let all = |tolerance| {
        let mut walk = Walk::begin(mechanism, start, MethodId::Dp8, tolerance, until)?;
        times.iter().filter_map(|&time| walk.to(time, &|| false).transpose()).collect::<Result<Vec<Motion>, StepError>>()
    };
    let [motions, others] = FINE.map(all);
    let (motions, others, ruler) = (motions?, others?, Ruler::new(mechanism));
    let apart = |(one, other): (&Motion, &Motion)| ruler.apart(one, other).max(ruler.rates_apart(one, other));
    let accuracy = motions.iter().zip(&others).map(apart).collect();
    Ok(Reference { motions, accuracy })
}

/// Accelerations of all coordinates at a motion.
fn acceleration(mechanism: &Mechanism, kernel: &mut Kernel<f64>, motion: &Motion) -> Vec<f64> {
    let plain = |x: &[Time]| x.iter().map(|x| x.hi).collect::<Vec<f64>>();
    kernel.accelerate::<0>(mechanism, motion.time, &plain(&motion.phi), &plain(&motion.omega), Bias::default());
    kernel.load.clone()
}

/// How long two runs in doubles stay together whose starts are an ulp apart.
pub(super) struct Together {
    /// When they part \[s\], if they do.
    pub horizon: Option<f64>,
    /// How far they were followed \[s\].
    pub until: f64,
    /// What stopped them, where something did.
    pub stop: Option<StepError>,
}

/// Follows two such runs to `until` \[s\], looking at them every so often \[s\], as long as there is time.
pub(super) fn together(
    mechanism: &Arc<Mechanism>,
    start: &Motion,
    every: f64,
    until: f64,
    room: Room,
    is_over: &dyn Fn() -> bool,
) -> Together {
    let (method, tolerance) = if is_in_doubles(mechanism) { (MethodId::Dp8, 1e-13) } else { (MethodId::Taylor, 1e-15) };
    let mut near = start.clone();
    for phi in &mut near.phi {
        *phi += Time::from(f64::EPSILON * phi.hi.abs().max(0.5));
    }
    let ruler = Ruler::new(mechanism);
    let begin = (room.clock)();
    let is_late = || is_over() || (room.clock)().saturating_sub(begin).as_secs_f64() > room.seconds;
    let mut reached = 0.0;
    let follow = |reached: &mut f64| -> Result<Option<f64>, StepError> {
        let mut walks =
            [Walk::begin(mechanism, start, method, tolerance, until)?, Walk::begin(mechanism, &near, method, tolerance, until)?];
        while *reached < until && !is_late() {
            let t = (*reached + every.max(GROWTH * *reached)).min(until);
            let [one, other] = &mut walks;
            let (Some(one), Some(other)) = (one.to(Time::from(t), &is_late)?, other.to(Time::from(t), &is_late)?) else { break };
            let apart = ruler.apart(&one, &other);
            if apart > PARTED || apart.is_nan() {
                return Ok(Some(*reached));
            }
            *reached = t;
        }
        Ok(None)
    };
    let found = follow(&mut reached);
    let (horizon, stop) = match found {
        Ok(horizon) => (horizon, None),
        Err(stop) => (None, Some(stop)),
    };
    Together { horizon, until: reached, stop }
}
