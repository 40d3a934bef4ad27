//! The reference motion of a scene: by the power series in double-double, from the bits its runs start from.
//!
//! A second motion of lower order tells how far the first is to be believed.  Both share the scene's
//! constants, rounded to doubles as every run has them: against tables made from exact decimals they differ
//! by what that rounding makes of the motion.
//!
//! Impacts are located in doubles.  Scenes with walls have references of that accuracy, and say so.

use super::build::{build, exact};
use super::contact::ContactDriver;
use super::driver::{Driver, Halt, Pause, StepWatch};
use super::methods::MethodId;
use super::plan::Plan;
use super::running::Outcome;
use super::trust::DistanceMetric;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stepping::{Cause, StepError, Tolerance};
use std::sync::Arc;

/// Orders and tolerances \[rad/s\] of the motion given, and of the one it is compared with.
const EXACT: [(usize, f64); 2] = [(30, 1e-36), (28, 1e-33)];
/// Tolerances of both where there are walls \[rad/s\], and what an impact located in doubles leaves at least.
const LOCATED: [f64; 2] = [1e-16, 1e-15];
const LOCATED_TO: f64 = 1e-14;
/// The same where there is no series.
const STEPPED: [f64; 2] = [1e-14, 1e-13];
const STEPPED_TO: f64 = 1e-13;

/// A motion at the times asked for.
#[derive(Clone, Debug, Default)]
pub struct Reference {
    /// Positions and rates, in double-double.
    pub motions: Vec<Motion>,
    /// About how far each is off, as far as the second motion tells: the largest difference of an angle
    /// \[rad\], a position over the longest bar, or the rate of one of them \[1/s\].
    pub accuracy: Vec<f64>,
}

/// The motion of a mechanism from `start` at these times \[s\], in ascending order.
///
/// ```
/// use driftless::dynamics::{Mechanism, Time};
/// use driftless::run::reference;
/// use driftless::scene::read_scene;
/// use std::sync::Arc;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
/// let mechanism = Arc::new(Mechanism::new(&scene)?);
/// let found = reference(&mechanism, &mechanism.start(&scene), &[Time::from(1.0), Time::from(2.0)])?;
/// assert_eq!(found.motions[1].time, Time::from(2.0));
/// assert!(found.accuracy[1] < 1e-28);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// The stop of the series: a number that is not finite, a time before the start, a singular position it does
/// not get through.
pub fn reference(mechanism: &Arc<Mechanism>, start: &Motion, times: &[Time]) -> Result<Reference, StepError> {
    let (found, stop) = reference_while(mechanism, start, times, &mut || false)?;
    stop.map_or(Ok(found), Err)
}

/// The same as far as it gets: until it stops, which is told then, or `pause` is true.
///
/// # Errors
/// There can be no such motion.
pub(super) fn reference_while(
    mechanism: &Arc<Mechanism>,
    start: &Motion,
    times: &[Time],
    pause: &mut Pause,
) -> Result<(Reference, Option<StepError>), StepError> {
    let unsuited = |what: &str, hint: &str| {
        let (cause, t) = (Cause::Unsuited, start.time.hi);
        Err(StepError { cause, method: "taylor".into(), t, step: 0.0, what: what.into(), hint: hint.into() })
    };
    if !mechanism.tree.is_dense() {
        return unsuited(
            "a series takes the matrices of the tree, which are too large here",
            "compare with dop853 at a tighter tolerance",
        );
    }
    if mechanism.vibration.is_some() {
        return unsuited(
            "the mean force of a rigid spring's vibration has no series",
            "compare with dop853 at a tighter tolerance",
        );
    }
    if !std::iter::once(&start.time).chain(times).is_sorted() {
        return unsuited("a time lies behind the one before it", "ask for times in ascending order");
    }
    let horizon = times.last().copied().unwrap_or_default();
    if mechanism.contacts.is_empty() && !mechanism.is_switched() && !mechanism.has_aims() {
        let walks =
            EXACT.map(|(order, tolerance)| ReferenceWalk::exact(mechanism, start, order, tolerance, horizon));
        return Ok(side_by_side(mechanism, walks, times, 0.0, pause));
    }
    let (method, tolerances, floor) = match mechanism.has_series() {
        true => (MethodId::Taylor, LOCATED, LOCATED_TO),
        false => (MethodId::Dp8, STEPPED, STEPPED_TO),
    };
    let [fine, coarse] =
        tolerances.map(|tolerance| ReferenceWalk::in_doubles(mechanism, start, method, tolerance, horizon));
    Ok(side_by_side(mechanism, [fine?, coarse?], times, floor, pause))
}

/// Two motions of one mechanism, of which the first counts and the second tells how far it is off, `floor` at
/// least: as far as both get, and what stopped them.
pub(super) fn side_by_side(
    mechanism: &Mechanism,
    mut walks: [ReferenceWalk; 2],
    times: &[Time],
    floor: f64,
    pause: &mut Pause,
) -> (Reference, Option<StepError>) {
    let ruler = DistanceMetric::new(mechanism);
    let mut found = Reference::default();
    for &time in times {
        let [one, other] = &mut walks;
        match one.to(time, pause).and_then(|one| Ok((one, other.to(time, pause)?))) {
            Ok((Some(one), Some(other))) => {
                found
                    .accuracy
                    .push(ruler.apart(&one, &other).max(ruler.rates_apart(&one, &other)).max(floor));
                found.motions.push(one);
            }
            Ok(_) => return (found, None),
            Err(stop) => return (found, Some(stop)),
        }
    }
    (found, None)
}

/// A motion that is read at one time after another.
pub(super) enum ReferenceWalk {
    /// By the series in double-double, on its way to a horizon.
    Exact(Box<dyn Driver>, Time),
    /// By a method in doubles, through impacts and holds.
    InDoubles(Box<(ContactDriver, Outcome)>),
}

impl ReferenceWalk {
    fn exact(
        mechanism: &Arc<Mechanism>,
        start: &Motion,
        order: usize,
        tolerance: f64,
        horizon: Time,
    ) -> Self {
        Self::Exact(exact(mechanism, start, order, tolerance), horizon)
    }

    /// By an adaptive method at a tolerance.
    pub(super) fn in_doubles(
        mechanism: &Arc<Mechanism>,
        start: &Motion,
        method: MethodId,
        tolerance: f64,
        horizon: Time,
    ) -> Result<Self, StepError> {
        let tolerance = Tolerance { relative: tolerance, absolute: tolerance };
        // Whatever time is asked for must not lie beyond the plan's, which is a double.
        let until = if horizon.lo > 0.0 { horizon.hi.next_up() } else { horizon.hi };
        let mut plan = Plan { method, ..Plan::of_series(mechanism, tolerance, until) };
        let driver = build(mechanism, &mut plan, start)?;
        let mut outcome = Outcome::begun(mechanism, plan);
        let mut contact_driver = ContactDriver::new(Arc::clone(mechanism), driver);
        contact_driver.meet(&mut outcome)?;
        Ok(Self::InDoubles(Box::new((contact_driver, outcome))))
    }

    /// The motion at a time; `None` where `pause` was true on the way.
    pub(super) fn to(&mut self, time: Time, pause: &mut Pause) -> Result<Option<Motion>, StepError> {
        match self {
            Self::Exact(driver, horizon) => {
                if driver.advance(time, *horizon, StepWatch::default(), pause)? == Halt::Pause {
                    return Ok(None);
                }
                let mut motion = Motion::default();
                driver.read(&mut motion);
                Ok(Some(motion))
            }
            Self::InDoubles(walk) => {
                let (contact_driver, outcome) = &mut **walk;
                Ok(contact_driver.go(time, outcome, pause)?.then(|| contact_driver.motion()))
            }
        }
    }
}
