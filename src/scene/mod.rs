//! A scene: bars, joints, springs, forces, motors and walls as plain data in SI units, checked and resolved.
//!
//! [`read`] turns JSON into a [`Scene`] or refuses it with one precise error.  What stands here is already
//! *resolved*: a uniform bar has become mass, centre and inertia; names have become indices.  Angles are
//! absolute, from +x, counter-clockwise, in radians.

mod build;
mod digits;
mod error;
pub(crate) mod exact;
mod fit;
mod format;
pub mod formula;
mod friction;
mod law;
mod locate;
mod names;
mod number;
mod output;
mod plausible;
mod profile;
#[doc(hidden)]
pub mod read;
mod schema;
mod set;
mod sound;
mod stays;
mod template;
mod write;

pub use build::{SceneBuilder, ground, on};
pub(crate) use digits::OF_THE_RUN;
pub use digits::WrittenNumber;
pub use error::{Refusal, SceneError};
pub(crate) use format::LONGEST_TIME;
pub use friction::{Friction, FrictionPlace};
pub use law::{Direction, Integral, Load, LoadLaw, NamedPoint, Parameter, PointTable, SceneEvent, Signal};
pub use names::{Bound, Meaning, Names, Scope};
pub(crate) use number::Decimal;
pub use number::{number, range};
pub use output::{BoundOutput, Component, Output, OutputNames, Quantity, Source};
pub use profile::Profile;
pub use read::{TableFiles, parse_scene, read_scene, read_text, source_name, table_files};
#[cfg(feature = "charts")]
pub(crate) use read::{listed, nearest};
pub use schema::schema;
pub use set::{Override, OverrideError};
pub use stays::points_that_stay;
pub use template::{StartValue, Template, Variable};

use crate::arithmetic::Real;
use serde::Serialize;

/// True for an angle a bar may start at \[rad\].
pub fn is_start_angle(phi: f64) -> bool {
    format::ANGLE.holds(phi)
}

/// True for a rate a bar may start with \[rad/s\].
pub fn is_start_rate(omega: f64) -> bool {
    format::RATE.holds(omega)
}

/// A checked scene.  As [`Default`] makes it, it is empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Scene<C = f64> {
    /// Name, also of its output folder: letters, digits, `-`, `_`.
    pub name: String,
    /// One sentence for reports and charts; may be empty.
    pub description: String,
    /// Gravitational acceleration (x, y) \[m/s²\].
    pub gravity: [C; 2],
    /// Bodies, at least one.
    pub bars: Vec<Bar<C>>,
    /// Hinges; those that close a loop and bars that hang on nothing are told apart when the scene is
    /// compiled.
    pub hinges: Vec<Hinge<C>>,
    /// Points that slide along lines.
    pub sliders: Vec<Slider<C>>,
    /// Bodies that are one.
    pub welds: Vec<Weld<C>>,
    /// Angles that stay as they are.
    pub locks: Vec<Lock<C>>,
    /// Springs with dampers.
    pub springs: Vec<Spring<C>>,
    /// Springs and dampers between angles.
    pub torsion_springs: Vec<TorsionSpring<C>>,
    /// Forces that act at points.
    pub forces: Vec<Force<C>>,
    /// Torques that act on bodies.
    pub torques: Vec<Torque<C>>,
    /// Motors: prescribed angles.
    pub motors: Vec<Motor<C>>,
    /// Motors on sliders: prescribed travels.
    pub drives: Vec<Drive<C>>,
    /// Motors whose aims depend on where the mechanism is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub couplings: Vec<Coupling>,
    /// Walls a point cannot pass.
    pub walls: Vec<Wall<C>>,
    /// Dry friction of hinges, sliders and walls, each of them once at most.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frictions: Vec<Friction<C>>,
    /// Numbers with names, for formulas.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<Parameter<C>>,
    /// Places with names, for formulas.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<NamedPoint<C>>,
    /// Functions given by points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<PointTable<C>>,
    /// Formulas with names, each of those before it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub signals: Vec<Signal>,
    /// Integrals of formulas over time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub integrals: Vec<Integral>,
    /// Forces, torques and springs by formulas.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub laws: Vec<LoadLaw<C>>,
    /// Events.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<SceneEvent>,
    /// What a run writes beside its own columns.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<Output>,
    /// Parts that do not act until an event switches them on, by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inactive: Vec<String>,
    /// Angle and rate of each bar at t = 0, in the order of `bars`; agrees with the motors.
    pub start: Vec<Start<C>>,
    /// What the scene says of it, the rest of which is found when the scene is compiled; of bars beyond the
    /// list's end, angle and rate.
    pub given: Vec<Given<C>>,
    /// Horizon \[s\], positive.
    pub until: f64,
    /// Output interval \[s\], positive, at most the horizon.
    pub every: f64,
}

impl<C> Scene<C> {
    /// True where the part of that name does not act at the start, or events switch it.
    pub fn is_switched(&self, part: &str) -> bool {
        let mut switched = self.events.iter().flat_map(|event| event.off.iter().chain(&event.on));
        self.is_inactive(part) || switched.any(|name| name == part)
    }

    /// True where the part of that name does not act at the start.
    pub fn is_inactive(&self, part: &str) -> bool {
        self.inactive.iter().any(|name| name == part)
    }
}

impl<C: Real> Scene<C> {
    /// How many of the bars the scene names itself; the rest are the rotors of its integrals.
    pub fn own_bars(&self) -> usize {
        self.integrals.first().map_or(self.bars.len(), |integral| integral.bar.min(self.bars.len()))
    }

    /// How many of the hinges the scene names itself.
    pub fn own_hinges(&self) -> usize {
        self.hinges.len() - (self.bars.len() - self.own_bars()).min(self.hinges.len())
    }

    /// The laws that the scene names itself: not those of the rotors of integrals.
    pub fn acting_laws(&self) -> impl Iterator<Item = &LoadLaw<C>> {
        let own = self.own_bars();
        self.laws.iter().filter(move |law| !matches!(law.load, Load::Torque { bar, .. } if bar >= own))
    }
}

/// A rigid body.  Its frame has the origin at one end and its x axis along the bar.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bar<C = f64> {
    /// Name, unique among bars; never `ground`.
    pub name: String,
    /// Length for drawings \[m\]: the body is drawn from its origin to (length, 0), or about its
    /// origin where that is its centre of mass and nothing is elsewhere on it.
    pub length: C,
    /// Mass \[kg\], positive.
    pub mass: C,
    /// Centre of mass in the body's frame \[m\].
    pub centre: [C; 2],
    /// Moment of inertia about the centre of mass \[kg·m²\], not negative.
    pub inertia: C,
}

/// A point of a bar or of the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Place<C = f64> {
    /// Index of the bar; `None` for the ground.
    pub bar: Option<usize>,
    /// Coordinates in the bar's frame, or in the world's for the ground \[m\].
    pub point: [C; 2],
}

/// Two places that coincide for ever.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hinge<C = f64> {
    /// Name, unique among hinges.
    pub name: String,
    /// The two places; on different bodies.
    pub between: [Place<C>; 2],
}

/// A point that slides along a line of the ground or of another body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slider<C = f64> {
    /// Name, unique among sliders, motors, locks and rigid springs, whose constraints bear it.
    pub name: String,
    /// The point that slides; on another body than the rail.
    pub point: Place<C>,
    /// The line.
    pub rail: Rail<C>,
    /// True where the two bodies keep the angle between them that they have at the start.
    pub locked: bool,
}

/// A line of a bar or of the ground; travel along it is counted from its point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rail<C = f64> {
    /// A point of the line.
    pub place: Place<C>,
    /// Unit vector along it, in the bar's frame, or in the world's for the ground.
    pub direction: [C; 2],
}

/// Two places that coincide, of bodies that keep the angle between them that they have at the start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Weld<C = f64> {
    /// Name, unique among welds; it also names the constraints.
    pub name: String,
    /// The two places; on different bodies.
    pub between: [Place<C>; 2],
}

/// An angle that stays as it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lock<C = f64> {
    /// Name, unique among locks, motors, sliders and rigid springs, whose constraints bear it.
    pub name: String,
    /// The bar.
    pub bar: usize,
    /// The bar its angle is measured from; `None`: from +x.
    pub relative_to: Option<usize>,
    /// The angle \[rad\]; `None`: that of the start.
    pub angle: Option<C>,
}

/// A linear spring with a damper beside it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spring<C = f64> {
    /// Name, unique among springs.
    pub name: String,
    /// Its two ends.
    pub between: [Place<C>; 2],
    /// Stiffness \[N/m\], not negative.
    pub stiffness: C,
    /// Length without force \[m\], not negative.
    pub free_length: C,
    /// Damping along the spring \[N·s/m\], not negative.
    pub damping: C,
    /// True where it is taken for a rod of its free length, with what its fast vibration does on average.
    pub rigid: bool,
}

/// A spring and a damper between the angles of two bodies; whole turns count.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorsionSpring<C = f64> {
    /// Name, unique among torsion springs.
    pub name: String,
    /// The bar.
    pub bar: usize,
    /// The bar its angle is measured from; `None`: from +x.
    pub relative_to: Option<usize>,
    /// Stiffness \[N·m/rad\], not negative.
    pub stiffness: C,
    /// Angle without torque \[rad\].
    pub free_angle: C,
    /// Damping \[N·m·s/rad\], not negative.
    pub damping: C,
}

/// A force that acts at a point of a bar.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Force<C = f64> {
    /// Name, unique among forces.
    pub name: String,
    /// The bar.
    pub bar: usize,
    /// The point of the bar, in its frame \[m\].
    pub point: [C; 2],
    /// The force \[N\].
    pub force: [C; 2],
    /// True where it turns with the bar: `force` is in the bar's frame.
    pub follows: bool,
    /// What it is multiplied by \[1\]; `None`: it is constant.
    pub law: Option<Law<C>>,
}

/// A torque that acts on a bar, and its opposite on another where it is between two.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Torque<C = f64> {
    /// Name, unique among torques.
    pub name: String,
    /// The bar.
    pub bar: usize,
    /// The bar that takes the opposite torque; `None`: the ground.
    pub relative_to: Option<usize>,
    /// The torque \[N·m\].
    pub torque: C,
    /// What it is multiplied by \[1\]; `None`: it is constant.
    pub law: Option<Law<C>>,
}

/// A prescribed travel of a slider.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drive<C = f64> {
    /// Name, unique among motors, sliders, locks and rigid springs, whose constraints bear it.
    pub name: String,
    /// Index of the slider.
    pub slider: usize,
    /// The travel as a function of time \[m\].
    pub law: Law<C>,
}

/// An angle or a travel prescribed by where the mechanism is: a gear, a cam.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coupling {
    /// Name, unique among motors, sliders, locks and rigid springs, whose constraints bear it.
    pub name: String,
    /// What is prescribed.
    pub coupled: Coupled,
    /// What it is to be, a formula of time, angles and positions \[rad; m\].
    pub aim: String,
}

/// What a [`Coupling`] prescribes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Coupled {
    /// The angle of a bar, from another's or from +x.
    Angle {
        /// The bar.
        bar: usize,
        /// The bar its angle is measured from; `None`: from +x.
        relative_to: Option<usize>,
    },
    /// The travel of a slider, by its index.
    Travel(usize),
}

/// A prescribed angle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Motor<C = f64> {
    /// Name, unique among motors, sliders, locks and rigid springs, whose constraints bear it.
    pub name: String,
    /// The driven bar.
    pub bar: usize,
    /// The bar its angle is measured from; `None`: from +x.
    pub relative_to: Option<usize>,
    /// The angle as a function of time.
    pub law: Law<C>,
}

/// `start + rate·t + acceleration·t²/2 + Σ amplitude·sin(frequency·t + phase)` in the unit u of what it
/// gives: \[rad\] of a motor on an angle, \[m\] of one on a slider, \[1\] of a force or a torque.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Law<C = f64> {
    /// Value at t = 0 without the sines \[u\].
    pub start: C,
    /// Rate \[u/s\].
    pub rate: C,
    /// Acceleration \[u/s²\].
    pub acceleration: C,
    /// Sines on top.
    pub sines: Vec<Sine<C>>,
    /// Any other formula of time, of which the law is the sum with the rest; motors and walls have one.
    pub profile: Option<Profile<C>>,
}

/// One sine of a [`Law`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sine<C = f64> {
    /// Amplitude \[u\].
    pub amplitude: C,
    /// Angular frequency \[rad/s\].
    pub frequency: C,
    /// Phase at t = 0 \[rad\].
    pub phase: C,
}

/// A line of the ground, or of another bar, that a point of a bar cannot pass.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wall<C = f64> {
    /// Name, unique among walls.
    pub name: String,
    /// The bar.
    pub bar: usize,
    /// The point of the bar, in its frame \[m\].
    pub point: [C; 2],
    /// The bar that carries the line; `None`: the ground.
    pub on: Option<usize>,
    /// A point of the line, in the frame of what carries it \[m\].
    pub through: [C; 2],
    /// Unit normal, towards the side the point may be on, likewise.
    pub normal: [C; 2],
    /// How far the line has moved along its normal, as a function of time \[m\]; `None`: it stays.
    pub law: Option<Law<C>>,
    /// The same as a formula of time, angles and positions \[m\]; `None`: it depends on time alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aim: Option<String>,
    /// Restitution e: the normal velocity after an impact is -e times the one before; 0 to 1.  With friction,
    /// and where several walls are hit at one moment, by Poisson's law if friction does not say otherwise.
    pub restitution: C,
}

impl<C> Wall<C> {
    /// True where its line moves along its normal.
    pub fn moves(&self) -> bool {
        self.law.is_some() || self.aim.is_some()
    }
}

/// Angle and rate of a bar at t = 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Start<C = f64> {
    /// Absolute angle \[rad\]; may be many turns.
    pub phi: C,
    /// Rate \[rad/s\].
    pub omega: C,
}

/// What a scene says of a bar at t = 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Given<C = f64> {
    /// True where the angle is given; else the one in [`Start`] is a guess.
    pub phi: bool,
    /// True where the rate is given.
    pub omega: bool,
    /// Position of the bar's origin \[m\]; only for a bar, or one of a group of bars, that hangs on nothing.
    pub origin: Option<[C; 2]>,
    /// Velocity of the bar's origin \[m/s\]; likewise.
    pub velocity: Option<[C; 2]>,
}

impl<C> Given<C> {
    /// Angle and rate are given, and nothing else.
    pub const ANGLE_AND_RATE: Self = Self { phi: true, omega: true, origin: None, velocity: None };
}
