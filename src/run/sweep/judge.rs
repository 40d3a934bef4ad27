//! How far the points of a sweep may be trusted: in lanes by a second integration at a hundredth of the
//! tolerance beside the first.
//!
//! The second integration has an order of its own, so that steps that end at the same output times have other
//! errors.  Both are compared at the output times and where a point ends, and the horizon is interpolated
//! between these.  Beside an integration at 1e-9 both together cost 2.2 times as much (32 points of `free`,
//! counted instructions).

use super::ensemble::Ensemble;
use super::point::Ready;
use super::watching::Watching;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::plan::Plan;
use crate::run::trust::{CAUTION, DistanceMetric, HORIZON, LEAST, Trust, crossing};
use crate::stepping::Tolerance;
use crate::stepping::taylor::batch::{Batch, BatchMember, Going, read};

/// Tolerance of the second integration over that of the first, its least, and its order.
const FINER: f64 = 100.0;
const FINEST: f64 = 1e-16;
const ORDER: usize = 24;

/// How far a point may be trusted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointTrust {
    /// The largest error of an angle \[rad\], or of a position over the longest bar, up to the end or the
    /// horizon; `None` where it is not known.
    pub error: Option<f64>,
    /// The first time it passes 1e-3 rad \[s\].
    pub horizon: Option<f64>,
}

impl PointTrust {
    /// True where the angles at the end are not known to 1e-3 rad.
    pub fn is_doubtful(&self) -> bool {
        self.horizon.is_some() || self.error.is_some_and(|error| error > HORIZON)
    }
}

impl From<&Trust> for PointTrust {
    fn from(trust: &Trust) -> Self {
        Self { error: trust.error_estimate, horizon: trust.horizon }
    }
}

/// What is known of a lane.
struct LaneRecord {
    metric: DistanceMetric,
    /// The time looked at last \[s\], and the largest difference so far \[rad, or positions over the size\].
    last: [f64; 2],
    horizon: Option<f64>,
    is_lost: bool,
}

/// The second integration.
pub(super) struct Judge<'a> {
    ensemble: Ensemble,
    members: Vec<BatchMember<'a>>,
    known: Vec<LaneRecord>,
    /// Room for a motion of both.
    motions: [Motion; 2],
}

impl<'a> Judge<'a> {
    /// Beside the points of a chunk.
    pub(super) fn new(ready: &'a [Ready], plan: &Plan) -> Self {
        let tolerance = plan.tolerance.unwrap_or_default();
        let finer = (tolerance.relative.min(tolerance.absolute) / FINER).max(FINEST);
        let tolerance = Tolerance { relative: finer, absolute: finer };
        let plan = Plan { tolerance: Some(tolerance), ..plan.clone() };
        Self {
            ensemble: Ensemble::new(
                Batch::new(tolerance).with_order(ORDER),
                &plan,
                ready.iter().map(|_| Watching::default()).collect(),
            ),
            members: ready.iter().map(|ready| ready.member(2)).collect(),
            known: ready.iter().map(|ready| LaneRecord::new(&ready.mechanism)).collect(),
            motions: Default::default(),
        }
    }

    /// Goes on to an output time, and compares all points: at their ends, where these come before it.
    pub(super) fn integrate(&mut self, points: &[BatchMember], until: Time) {
        let Self { ensemble, members, known, motions } = self;
        for (number, point) in points.iter().enumerate() {
            if point.state.time < until {
                let member = &mut members[number..=number];
                ensemble.integrate(number, member, point.state.time, &mut |_, _| Going::On);
                known[number].take(point, &members[number], motions);
            }
        }
        ensemble.integrate(0, members, until, &mut |_, _| Going::On);
        for ((point, member), known) in points.iter().zip(members).zip(known) {
            if point.state.time >= until {
                known.take(point, member, motions);
            }
        }
    }

    /// What is known of a point, which goes no further.
    pub(super) fn remove(&mut self, number: usize) -> PointTrust {
        self.members.swap_remove(number);
        self.ensemble.swap_remove(number);
        let LaneRecord { last: [_, error], horizon, is_lost, .. } = self.known.swap_remove(number);
        let printed = |error: f64| (CAUTION * error).max(LEAST);
        match horizon {
            Some(horizon) => PointTrust { error: Some(printed(HORIZON)), horizon: Some(horizon) },
            None => PointTrust { error: (!is_lost).then(|| printed(error)), horizon: None },
        }
    }
}

impl LaneRecord {
    fn new(mechanism: &Mechanism) -> Self {
        Self { metric: DistanceMetric::new(mechanism), last: [0.0; 2], horizon: None, is_lost: false }
    }

    fn take(&mut self, point: &BatchMember, finer: &BatchMember, motions: &mut [Motion; 2]) {
        for (motion, member) in motions.iter_mut().zip([point, finer]) {
            read(member.mechanism, &member.state, motion);
        }
        let apart = self.metric.apart(&motions[0], &motions[1]);
        let [t, error] = self.last;
        if finer.stopped.is_some() || !apart.is_finite() {
            self.is_lost = true;
        } else if !self.is_lost {
            if apart > HORIZON && self.horizon.is_none() {
                self.horizon = Some(crossing([t, error], [point.state.time.hi, apart]));
            }
            self.last = [point.state.time.hi, error.max(apart)];
        }
    }
}
