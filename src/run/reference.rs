//! The reference motion of a scene: by the power series in double-double, from the bits its runs start from.
//!
//! A second motion of lower order tells how far the first is to be believed.  Both share the scene's constants, rounded to doubles as every run has them:
//! against tables made from exact decimals they differ by what that rounding makes of the motion.
//!
//! Impacts are located in doubles.  Scenes with walls have references of that accuracy, and say so.

use super::contact::Course;
use super::march::{build, exact};
use super::plan::Plan;
use super::running::Outcome;
use super::trust::Ruler;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stepping::{Cause, StepError, Tolerance};
use std::sync::Arc;

/// Orders and tolerances \[rad/s\] of the motion given, and of the one it is compared with.
const EXACT: [(usize, f64); 2] = [(30, 1e-36), (28, 1e-33)];
/// Tolerances of both where there are walls \[rad/s\], and what an impact located in doubles leaves at least.
const LOCATED: [f64; 2] = [1e-16, 1e-15];
const LOCATED_TO: f64 = 1e-14;

/// A motion at the times asked for.
#[derive(Clone, Debug, Default)]
pub struct Reference {
    /// Positions and rates, in double-double.
    pub motions: Vec<Motion>,
    /// About how far each is off, as far as the second motion tells: the largest difference of an angle \[rad\], a position over the longest bar, or the
    /// rate of one of them \[1/s\].
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
/// The stop of the series: a number that is not finite, a time before the start, a singular position it does not get through.
pub fn reference(mechanism: &Arc<Mechanism>, start: &Motion, times: &[Time]) -> Result<Reference, StepError> {
    let unsuited = |what: &str, hint: &str| {
        let (cause, t) = (Cause::Unsuited, start.time.hi);
        Err(StepError { cause, method: "taylor".into(), t, step: 0.0, what: what.into(), hint: hint.into() })
    };
    if !mechanism.tree.is_dense() {
        return unsuited("a series takes the matrices of the tree, which are too large here", "compare with dop853 at a tighter tolerance");
    }
    if mechanism.vibration.is_some() {
        return unsuited("the mean force of a rigid spring's vibration has no series", "compare with dop853 at a tighter tolerance");
    }
    if !std::iter::once(&start.time).chain(times).is_sorted() {
        return unsuited("a time lies behind the one before it", "ask for times in ascending order");
    }
    let is_free = mechanism.contacts.is_empty();
    let both = [0, 1].map(|i| {
        let (order, tolerance) = EXACT[i];
        if is_free { unhindered(mechanism, start, times, order, tolerance) } else { struck(mechanism, start, times, LOCATED[i]) }
    });
    let [motions, others] = both;
    let (motions, ruler) = (motions?, Ruler::new(mechanism));
    let floor = if is_free { 0.0 } else { LOCATED_TO };
    let off = |(one, other): (&Motion, &Motion)| ruler.apart(one, other).max(ruler.rates_apart(one, other)).max(floor);
    let accuracy = motions.iter().zip(&others?).map(off).collect();
    Ok(Reference { motions, accuracy })
}

/// By the series in double-double.
fn unhindered(mechanism: &Arc<Mechanism>, start: &Motion, times: &[Time], order: usize, tolerance: f64) -> Result<Vec<Motion>, StepError> {
    let mut marcher = exact(mechanism, start, order, tolerance);
    let horizon = times.last().copied().unwrap_or_default();
    let mut at = |&time: &Time| {
        marcher.advance(time, horizon, None, &mut || false)?;
        let mut motion = Motion::default();
        marcher.read(&mut motion);
        Ok(motion)
    };
    times.iter().map(&mut at).collect()
}

/// By the series in doubles, through impacts and holds.
fn struck(mechanism: &Arc<Mechanism>, start: &Motion, times: &[Time], tolerance: f64) -> Result<Vec<Motion>, StepError> {
    let until = times.last().copied().unwrap_or_default().hi;
    let tolerance = Tolerance { relative: tolerance, absolute: tolerance };
    let mut plan = Plan::of_series(mechanism, tolerance, until);
    let marcher = build(mechanism, &mut plan, start)?;
    let mut outcome = Outcome::begun(mechanism, plan);
    let mut course = Course::new(Arc::clone(mechanism), marcher);
    course.meet(&mut outcome)?;
    let mut at = |&time: &Time| {
        course.go(time, &mut outcome, &mut || false)?;
        Ok(course.motion())
    };
    times.iter().map(&mut at).collect()
}
