//! What the runs are held against: the reference motion, how far it means anything, and the distance of a run
//! from it.

use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::methods::MethodId;
use crate::run::plan::MANY_COORDINATES;
use crate::run::reference::{Reference, ReferenceWalk, reference_while, side_by_side};
use crate::run::trust::DistanceMetric;
use crate::stepping::StepError;
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
    pub(super) ruler: DistanceMetric,
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
            ruler: DistanceMetric::new(mechanism),
        }
    }

    /// Number of times at which errors are measured.
    pub fn times(&self) -> usize {
        self.motions.len()
    }

    /// Times at which errors are told one by one \[s\].
    pub fn marks(&self) -> impl Iterator<Item = f64> {
        self.marks.iter().map(|&row| self.motions[row].time.hi)
    }

    /// How far a motion is off: angles \[rad\] or places over the mechanism's size, and rates; and whether
    /// its time is one of [`Truth::marks`]. `None` where there is no reference at its time.
    pub fn error(&self, motion: &Motion) -> Option<([f64; 2], bool)> {
        let row = (motion.time.hi / self.every).round() as usize;
        let known = self.motions.get(row.wrapping_sub(1))?;
        let late = (motion.time - known.time).hi;
        if late.abs() > SAME_TIME * self.every {
            return None;
        }
        // Fixed steps meet the times of the reference to rounding; what the motion does in that time is no
        // error.
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
        Some((
            [self.ruler.apart(motion, known), self.ruler.rates_apart(motion, known)],
            self.marks.contains(&(row - 1)),
        ))
    }

    /// The reference of a mechanism every so often \[s\], as far as `until` \[s\] and what time there is for
    /// it.
    pub(super) fn new(
        mechanism: &Arc<Mechanism>,
        start: &Motion,
        every: f64,
        until: f64,
        room: TimeLimit,
        is_over: &dyn Fn() -> bool,
    ) -> Self {
        let count = (until / every * (1.0 + 1e-12)).floor() as usize;
        if count == 0 {
            return Self { why: Some("paths part at once".to_owned()), ..Self::none(mechanism) };
        }
        let times: Vec<Time> = (1..=count).map(|row| Time::product(every, row as f64)).collect();
        let mut pause = room.runs_out(is_over);
        let is_plain = is_in_doubles(mechanism);
        let found = if is_plain {
            let walk = |tolerance| {
                ReferenceWalk::in_doubles(mechanism, start, MethodId::Dp8, tolerance, times[count - 1])
            };
            let [fine, coarse] = FINE.map(walk);
            fine.and_then(|fine| Ok(side_by_side(mechanism, [fine, coarse?], &times, 0.0, &mut pause)))
        } else {
            reference_while(mechanism, start, &times, &mut pause)
        };
        let (Reference { mut motions, accuracy }, stop) =
            found.unwrap_or_else(|stop| (Reference::default(), Some(stop)));
        let mut why = stop.map(|stop| format!("the reference stopped at t = {:.4} s: {}", stop.t, stop.what));
        if why.is_none() && motions.len() < count {
            why = Some("the reference takes too long for more".to_owned());
        }
        let sound = accuracy.iter().take_while(|&&accuracy| accuracy < PARTED).count();
        if sound < motions.len() {
            why = Some("the reference itself is no better there".to_owned());
            motions.truncate(sound);
        }
        let mut kernel = Kernel::<f64>::new(mechanism);
        let accelerations =
            motions.iter().map(|motion| acceleration(mechanism, &mut kernel, motion)).collect();
        let count = motions.len();
        let marks = (1..=MARKS.min(count)).map(|mark| mark * count / MARKS.min(count) - 1).collect();
        let how = if is_plain {
            format!("dp8 at tolerance {:e}", FINE[0])
        } else if mechanism.is_switched() {
            "taylor at tolerance 1e-16, through its switches".to_owned()
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
            ruler: DistanceMetric::new(mechanism),
        }
    }
}

/// What time there is for something.
#[derive(Clone, Copy)]
pub(super) struct TimeLimit<'a> {
    pub clock: &'a dyn Fn() -> Duration,
    /// \[s\]
    pub seconds: f64,
}

impl<'a> TimeLimit<'a> {
    /// True from when that time is over, or all is.
    pub(super) fn runs_out(self, is_over: &'a dyn Fn() -> bool) -> impl Fn() -> bool + 'a {
        let begin = (self.clock)();
        move || is_over() || (self.clock)().saturating_sub(begin).as_secs_f64() > self.seconds
    }
}

/// True where there is no series in double-double, or where it would take too long.
fn is_in_doubles(mechanism: &Mechanism) -> bool {
    mechanism.coordinates() > MANY_COORDINATES || !mechanism.has_series()
}

/// Accelerations of all coordinates at a motion.
fn acceleration(mechanism: &Mechanism, kernel: &mut Kernel<f64>, motion: &Motion) -> Vec<f64> {
    let [phi, omega] = motion.rounded();
    kernel.accelerations(mechanism, motion.time, &phi, &omega, Bias::default());
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
    room: TimeLimit,
    is_over: &dyn Fn() -> bool,
) -> Together {
    let (method, tolerance) =
        if is_in_doubles(mechanism) { (MethodId::Dp8, 1e-13) } else { (MethodId::Taylor, 1e-15) };
    let mut near = start.clone();
    for phi in &mut near.phi {
        *phi += Time::from(f64::EPSILON * phi.hi.abs().max(0.5));
    }
    let ruler = DistanceMetric::new(mechanism);
    let is_late = room.runs_out(is_over);
    let mut reached = 0.0;
    let follow = |reached: &mut f64| -> Result<Option<f64>, StepError> {
        let begin = |start| ReferenceWalk::in_doubles(mechanism, start, method, tolerance, Time::from(until));
        let (mut one, mut other) = (begin(start)?, begin(&near)?);
        while *reached < until && !is_late() {
            let t = (*reached + every.max(GROWTH * *reached)).min(until);
            let at = |walk: &mut ReferenceWalk| walk.to(Time::from(t), &mut || is_late());
            let (Some(one), Some(other)) = (at(&mut one)?, at(&mut other)?) else { break };
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
