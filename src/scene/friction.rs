//! Dry friction of hinges, sliders and walls.

use serde::Serialize;

/// Dry friction by Coulomb's law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Friction<C = f64> {
    /// Where it acts.
    pub at: FrictionPlace<C>,
    /// Coefficient while the two slide on each other, not negative.
    pub kinetic: C,
    /// Coefficient while they stick, at least the kinetic one.
    pub stiction: C,
}

/// What has friction, by its number in the scene's list.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum FrictionPlace<C = f64> {
    /// A hinge: friction acts at this radius \[m\] of it.
    Hinge {
        /// The hinge.
        hinge: usize,
        /// The radius, positive.
        radius: C,
    },
    /// A slider.
    Slider(usize),
    /// A wall.
    Wall {
        /// The wall.
        wall: usize,
        /// True where restitution multiplies the normal velocity (Newton), not the impulse of compression
        /// (Poisson).
        is_newton: bool,
    },
}

/// A kind of part that may have friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrictionPart {
    Hinge,
    Slider,
    Wall,
}

impl<C> FrictionPlace<C> {
    /// The part by its kind and number.
    pub(super) fn part(&self) -> (FrictionPart, usize) {
        match *self {
            Self::Hinge { hinge, .. } => (FrictionPart::Hinge, hinge),
            Self::Slider(slider) => (FrictionPart::Slider, slider),
            Self::Wall { wall, .. } => (FrictionPart::Wall, wall),
        }
    }
}
