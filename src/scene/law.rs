//! What a scene says in formulas: parameters, points, signals, laws of forces, and events.
//!
//! Texts are kept as they were written; [`Names`](super::Names) says what the names in them stand for.

use super::{Bar, Given, Hinge, Place, Scene, Start};
use crate::arithmetic::Real;
use serde::Serialize;

/// A number with a name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter<C = f64> {
    /// Name, unique among parameters and signals.
    pub name: String,
    /// Value, in SI units.
    pub value: C,
}

/// A place with a name: `tip` makes `tip.x`, `tip.y`, `tip.vx` and `tip.vy` known to formulas.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedPoint<C = f64> {
    /// Name, unique among points.
    pub name: String,
    /// The place.
    pub place: Place<C>,
}

/// A function given by points, interpolated smoothly.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PointTable<C = f64> {
    /// Name, as formulas call it.
    pub name: String,
    /// Points (x, y) with ascending x.
    pub points: Vec<[C; 2]>,
}

/// A formula with a name, for others to use.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Signal {
    /// Name, unique among parameters and signals.
    pub name: String,
    /// The formula.
    pub formula: String,
}

/// An integral over time of a formula, as a controller has one, for other formulas to use.
///
/// It is carried as the rate of a rotor of its own, on which nothing but a torque of `INERTIA` times the
/// formula acts, so that every method integrates it with its own accuracy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Integral {
    /// Name, unique among parameters, signals and integrals; also that of its rotor.
    pub name: String,
    /// What is integrated, from 0 on.
    pub formula: String,
    /// The number of its rotor among the bars; those of integrals are the last.
    pub bar: usize,
}

impl Integral {
    /// Mass and moment of inertia of the rotor, a power of two so small that its energy counts nothing
    /// \[kg, kg·m²\]; what is told of energy and work leaves it out.
    pub const INERTIA: f64 = 1.0 / (1_u64 << 60) as f64;
    /// The same in formulas, exactly.
    pub(super) const INERTIA_AS_FORMULA: &str = "2^(-60)";
}

impl<C: Real> Scene<C> {
    /// Adds the rotors of the integrals with their hinges, torques and starts.
    pub(super) fn with_rotors(mut self) -> Self {
        for Integral { name, formula, bar } in self.integrals.clone() {
            let place = |bar| Place { bar, point: [C::ZERO; 2] };
            let (mass, inertia) = (C::of(Integral::INERTIA), C::of(Integral::INERTIA));
            self.bars.push(Bar { name: name.clone(), length: C::ZERO, mass, centre: [C::ZERO; 2], inertia });
            self.hinges.push(Hinge { name: name.clone(), between: [place(None), place(Some(bar))] });
            self.start.push(Start { phi: C::ZERO, omega: C::ZERO });
            self.given.push(Given::ANGLE_AND_RATE);
            let torque = format!("{}*({formula})", Integral::INERTIA_AS_FORMULA);
            self.laws.push(LoadLaw { name, load: Load::Torque { bar, relative_to: None, torque } });
        }
        self
    }
}

/// A force, torque or spring whose law is a formula of time and state.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadLaw<C = f64> {
    /// Name, unique among the parts of its kind.
    pub name: String,
    /// Where it acts and by what law.
    pub load: Load<C>,
}

/// Where a [`LoadLaw`] acts, and its formulas.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Load<C = f64> {
    /// A force at a point of a bar.
    Force {
        /// The bar.
        bar: usize,
        /// The point of the bar, in its frame \[m\].
        point: [C; 2],
        /// The force, x and y \[N\].
        force: [String; 2],
        /// True where its directions are those of the bar.
        follows: bool,
    },
    /// A torque on a bar, and its opposite on another.
    Torque {
        /// The bar.
        bar: usize,
        /// The bar that takes the opposite torque; `None`: the ground.
        relative_to: Option<usize>,
        /// The torque \[N·m\].
        torque: String,
    },
    /// A spring: formulas may use `length` and `rate`.
    Spring {
        /// Its two ends.
        between: [Place<C>; 2],
        /// Energy stored \[J\].
        potential: Option<String>,
        /// Force that pulls the ends together \[N\], beside that of the potential.
        tension: Option<String>,
    },
    /// A torsion spring: formulas may use `angle` and `rate`.
    TorsionSpring {
        /// The bar.
        bar: usize,
        /// The bar its angle is measured from; `None`: from +x.
        relative_to: Option<usize>,
        /// Energy stored \[J\].
        potential: Option<String>,
        /// Torque that turns the bar back, against its angle \[N·m\], beside that of the potential.
        torque: Option<String>,
    },
    /// A potential energy of angles and positions.
    Potential {
        /// The energy \[J\].
        energy: String,
    },
}

/// Passages of an event function through zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Both.
    #[default]
    Either,
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
}

/// A condition on the motion, and what happens where it comes true.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneEvent {
    /// Name, unique among events.
    pub name: String,
    /// The event function: its zeros are the event.
    pub when: String,
    /// Which of them count.
    pub direction: Direction,
    /// True where the run ends there.
    pub stop: bool,
    /// Parts that act from then on, by name.
    pub on: Vec<String>,
    /// Parts that act no longer from then on.
    pub off: Vec<String>,
    /// Parameters of laws that have another value from then on, and the formulas of it.
    pub set: Vec<(String, String)>,
}

impl SceneEvent {
    /// True where it switches parts or sets parameters.
    pub fn changes(&self) -> bool {
        !(self.on.is_empty() && self.off.is_empty() && self.set.is_empty())
    }
}
