//! Events of scenes and from outside the crate: conditions on the motion, and what happens where they come
//! true.
//!
//! The module `detector` looks for them in every step, `search` finds them on its dense output, `located`
//! says exactly where; `branches` are those of laws that an event changes.

mod branches;
mod detector;
mod far;
mod flat;
mod located;
mod search;

#[cfg(feature = "digits")]
pub(super) use detector::KEPT;
pub(super) use detector::{EventDetector, EventMemory, SwitchFunction};

use crate::dynamics::configuration::Configuration;
use crate::dynamics::{Mechanism, Motion};
pub use crate::scene::Direction;
use serde::{Deserialize, Serialize};

/// A condition on the motion, and what happens where it comes true.
///
/// ```
/// use driftless::run::{Action, Change, Event};
/// use driftless::{Configuration, MethodId, Motion, Simulation, Site, read_scene};
///
/// /// Stops when a point comes to a height from below.
/// struct Reaches {
///     tip: Site,
///     height: f64,
/// }
///
/// impl Event for Reaches {
///     fn name(&self) -> &str {
///         "reaches"
///     }
///
///     fn value(&self, at: &Configuration<f64>) -> f64 {
///         at.position(&self.tip)[1] - self.height
///     }
///
///     fn action(&mut self, _at: &Configuration<f64>, _motion: &Motion) -> Action {
///         Action::Stop
///     }
/// }
///
/// # fn main() -> Result<(), driftless::Error> {
/// let scene = read_scene("examples/scenes/free.json".as_ref(), &[])?;
/// let simulation = Simulation::new(&scene)?;
/// let tip = simulation.site("bar2", [0.6, 0.0])?;
/// let outcome = simulation.event(Reaches { tip, height: 0.5 }).method(MethodId::Taylor).run()?;
/// assert_eq!(outcome.ended_by.as_deref(), Some("reaches"));
/// assert_eq!(outcome.events[0].t, outcome.last.t);
/// # Ok(())
/// # }
/// ```
pub trait Event: Send + Sync {
    /// Name in records.
    fn name(&self) -> &str;

    /// The event function: a smooth function of time, positions and rates, whose zero is the event; so is its
    /// way past zero where an impact, or a joint that closes, makes the rates jump.  Where it is not a
    /// number, as of a body that is not there, the run stops.
    fn value(&self, at: &Configuration<f64>) -> f64;

    /// Which passages count; both unless said otherwise.
    fn direction(&self) -> Direction {
        Direction::Either
    }

    /// What happens there; it is recorded in any case.
    fn action(&mut self, _at: &Configuration<f64>, _motion: &Motion) -> Action {
        Action::Record
    }
}

/// What happens at an event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// Nothing beside the record.
    #[default]
    Record,
    /// The run ends here; its outcome is kept.
    Stop,
    /// The motion goes on changed.  A fixed step that is cut short there is followed by one that ends on the
    /// next output time.
    Change(Change),
}

/// A change of the motion or of the scene's parts at an event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The motion after it, where that is another one.
    pub(super) motion: Option<Motion>,
    /// Springs, torsion springs and forces by name, and whether they act from now on.
    pub(super) switches: Vec<(String, bool)>,
    /// Values of the scene's parameters from now on, where they change.
    pub(super) parameters: Option<Vec<f64>>,
    /// The condition of the scene's laws that changes its sign.
    pub(super) flips: Option<usize>,
}

impl Change {
    /// Goes on from another motion: positions and rates, which must satisfy the constraints; the change of
    /// energy is booked as that of an impact.
    #[must_use]
    pub fn to(mut self, motion: Motion) -> Self {
        self.motion = Some(motion);
        self
    }

    /// Lets a spring, a torsion spring, or an applied force or torque act from now on, or no longer; the
    /// energy it stores is booked likewise.
    #[must_use]
    pub fn switch(mut self, part: &str, on: bool) -> Self {
        self.switches.push((part.into(), on));
        self
    }
}

/// An event that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventRecord {
    /// Its name.
    pub name: String,
    /// Time \[s\].
    pub t: f64,
    /// Winding angles of all bodies \[rad\], then translational coordinates \[m\].
    pub phi: Vec<f64>,
    /// Rates \[rad/s, m/s\].
    pub omega: Vec<f64>,
}

/// What tells an event from outside from others: its name, its direction, and its value at a moment, to the
/// bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct EventMark {
    pub name: String,
    direction: u8,
    value: u64,
}

/// Those of some events at a motion.
pub(super) fn marks(mechanism: &Mechanism, motion: &Motion, events: &[Box<dyn Event>]) -> Vec<EventMark> {
    let marks = events.iter().map(|event| EventMark {
        name: event.name().into(),
        direction: event.direction() as u8,
        value: mechanism.seen(motion, |at| value(mechanism, event.as_ref(), at)).to_bits(),
    });
    marks.collect()
}

/// The name of the first of some events that asks at a motion for a body the mechanism does not have.
pub(crate) fn foreign_event<'a>(
    mechanism: &Mechanism,
    motion: &Motion,
    events: &'a [Box<dyn Event>],
) -> Option<&'a str> {
    let is_foreign =
        |event: &dyn Event| mechanism.seen(motion, |at| mechanism.checked(at, |at| event.value(at)).1);
    events.iter().map(Box::as_ref).find(|event| is_foreign(*event)).map(Event::name)
}

/// The function of an event from outside, not a number where it asks for a body that is not there.
fn value(mechanism: &Mechanism, event: &dyn Event, at: &Configuration<f64>) -> f64 {
    let (value, is_foreign) = mechanism.checked(at, |at| event.value(at));
    if is_foreign { f64::NAN } else { value }
}
