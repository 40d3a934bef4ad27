//! What a run in many digits shows of itself.

use super::Wide;
use crate::arithmetic::Real;

/// What there is to know at an output time.
#[derive(Clone, Debug)]
pub struct ShownRow {
    /// Time \[s\].
    pub t: Wide,
    /// Of every body: angle \[rad\], not wrapped, and rate \[rad/s\], position of the centre of mass \[m\]
    /// and its velocity \[m/s\].
    pub bodies: Vec<[Wide; 6]>,
    /// Kinetic and potential energy, and the work of motors, dampers and applied forces \[J\].
    pub energy: [Wide; 3],
    /// Energy lost in dry friction since the start, where there is any \[J\].
    pub friction: Option<Wide>,
    /// Energy less work and what impacts took, less that at the start, over the energy scale.
    pub drift: f64,
    /// Largest residual of the constraints \[rad or m\] and of its rate.
    pub residual: [f64; 2],
    /// That of each constraint of the scene.
    pub residuals: Vec<[f64; 2]>,
}

impl ShownRow {
    /// Time \[s\], as a double.
    pub fn time(&self) -> f64 {
        self.t.value()
    }
}

/// An event of a run in many digits.
#[derive(Clone, Debug)]
pub struct LongEvent {
    /// Its name.
    pub name: String,
    /// Time \[s\].
    pub t: Wide,
    /// Angles of all bodies, not wrapped, then positions of origins \[rad, m\].
    pub phi: Vec<Wide>,
    /// Their rates \[rad/s, m/s\].
    pub omega: Vec<Wide>,
}

/// A time a point stayed on its wall, in many digits.
#[derive(Clone, Debug)]
pub struct LongHold {
    /// Name of the wall.
    pub wall: String,
    /// Beginning \[s\]: where bounces died out, the time at which infinitely many of them have ended.
    pub t: Wide,
    /// End \[s\]; `None`: held to the end of the run.
    pub until: Option<Wide>,
}

/// A transition of a place with dry friction, in many digits.
#[derive(Clone, Debug)]
pub struct LongTurn {
    /// Name of the hinge, slider or wall.
    pub name: String,
    /// Time \[s\].
    pub t: Wide,
    /// What it does from then on: `sticks`, `slides` or `apart`.
    pub does: &'static str,
}
