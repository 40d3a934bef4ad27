//! A scene: bars, hinges, springs, motors and walls as plain data in SI units, checked and resolved.
//!
//! [`read`] turns JSON into a [`Scene`] or refuses it with one precise error.  What stands here is already *resolved*: a uniform bar
//! has become mass, centre and inertia; names have become indices.  Angles are absolute, from +x, counter-clockwise, in radians.

mod assemble;
mod error;
mod format;
mod locate;
pub mod read;
mod schema;
mod set;
mod template;
mod write;

pub use error::{Refusal, SceneError};
pub use read::{parse_scene, read_scene, read_text};
pub use schema::schema;
pub use set::{Override, OverrideError};
pub use template::{StartValue, Template, Variable};

use serde::Serialize;

/// True for an angle a bar may start at \[rad\].
pub fn is_start_angle(phi: f64) -> bool {
    format::ANGLE.holds(phi)
}

/// True for a rate a bar may start with \[rad/s\].
pub fn is_start_rate(omega: f64) -> bool {
    format::RATE.holds(omega)
}

/// A checked scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// Name, also of its output folder: letters, digits, `-`, `_`.
    pub name: String,
    /// One sentence for reports and charts; may be empty.
    pub description: String,
    /// Gravitational acceleration (x, y) \[m/s²\].
    pub gravity: [f64; 2],
    /// Bodies, at least one.
    pub bars: Vec<Bar>,
    /// Hinges; every bar hangs on the ground through a tree of them.
    pub hinges: Vec<Hinge>,
    /// Springs with dampers.
    pub springs: Vec<Spring>,
    /// Motors: prescribed angles.
    pub motors: Vec<Motor>,
    /// Walls a point cannot pass.
    pub walls: Vec<Wall>,
    /// Angle and rate of each bar at t = 0, in the order of `bars`; agrees with the motors.
    pub start: Vec<Start>,
    /// Horizon \[s\], positive.
    pub until: f64,
    /// Output interval \[s\], positive, at most the horizon.
    pub every: f64,
}

/// A rigid body.  Its frame has the origin at one end and its x axis along the bar.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bar {
    /// Name, unique among bars; never `ground`.
    pub name: String,
    /// Length for drawings \[m\]: the body is drawn from its origin to (length, 0).
    pub length: f64,
    /// Mass \[kg\], positive.
    pub mass: f64,
    /// Centre of mass in the body's frame \[m\].
    pub centre: [f64; 2],
    /// Moment of inertia about the centre of mass \[kg·m²\], not negative.
    pub inertia: f64,
}

/// A point of a bar or of the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Index of the bar; `None` for the ground.
    pub bar: Option<usize>,
    /// Coordinates in the bar's frame, or in the world's for the ground \[m\].
    pub point: [f64; 2],
}

/// Two places that coincide for ever.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hinge {
    /// Name, unique among hinges.
    pub name: String,
    /// The two places; on different bodies.
    pub between: [Place; 2],
}

/// A linear spring with a damper beside it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spring {
    /// Name, unique among springs.
    pub name: String,
    /// Its two ends.
    pub between: [Place; 2],
    /// Stiffness \[N/m\], not negative.
    pub stiffness: f64,
    /// Length without force \[m\], not negative.
    pub free_length: f64,
    /// Damping along the spring \[N·s/m\], not negative.
    pub damping: f64,
}

/// A prescribed angle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Motor {
    /// Name, unique among motors; it also names the constraint.
    pub name: String,
    /// The driven bar.
    pub bar: usize,
    /// The bar its angle is measured from; `None`: from +x.
    pub relative_to: Option<usize>,
    /// The angle as a function of time.
    pub law: Law,
}

/// `start + rate·t + acceleration·t²/2 + Σ amplitude·sin(frequency·t + phase)` \[rad\].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Law {
    /// Angle at t = 0 without the sines \[rad\].
    pub start: f64,
    /// Rate \[rad/s\].
    pub rate: f64,
    /// Acceleration \[rad/s²\].
    pub acceleration: f64,
    /// Sines on top.
    pub sines: Vec<Sine>,
}

/// One sine of a [`Law`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sine {
    /// Amplitude \[rad\].
    pub amplitude: f64,
    /// Angular frequency \[rad/s\].
    pub frequency: f64,
    /// Phase at t = 0 \[rad\].
    pub phase: f64,
}

/// A line of the ground that a point of a bar cannot pass.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wall {
    /// Name, unique among walls.
    pub name: String,
    /// The bar.
    pub bar: usize,
    /// The point of the bar, in its frame \[m\].
    pub point: [f64; 2],
    /// A point of the line \[m\].
    pub through: [f64; 2],
    /// Unit normal, towards the side the point may be on.
    pub normal: [f64; 2],
    /// Restitution e: the normal velocity after an impact is -e times the one before; 0 to 1.
    pub restitution: f64,
}

/// Angle and rate of a bar at t = 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Start {
    /// Absolute angle \[rad\]; may be many turns.
    pub phi: f64,
    /// Rate \[rad/s\].
    pub omega: f64,
}
