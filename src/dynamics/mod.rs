//! The equation of motion.
//!
//! ```text
//! M(q) a + G(q,t)ᵀ lambda = b(t,q,w)        [N m]      n equations of motion, one a coordinate
//! G(q,t) a                = -gamma(t,q,w)   [rad/s²]
//!     one row per constraint C(q,t) = 0, differentiated twice
//! Baumgarte replaces gamma by gamma + 2 alpha C' + beta² C
//! ```
//!
//! | letter | name in code | meaning | unit | shape | file |
//! | --- | --- | --- | --- | --- | --- |
//! | q | `phi` | angles from +x; then free translational coordinates | rad, m | n | here, [`forest`] |
//! | w | `omega` | their rates q' | rad/s, m/s | n | here |
//! | z | `z` | elements: unit vectors exp(i q), and x + iy of what moves freely | 1, m | n | [`forest`] |
//! | M | `mass` | mass matrix, `M_ij = Re(conj(z_i) H_ij z_j)` | kg m² | n × n | [`tree`] |
//! | b | `load` | velocity terms, gravity, springs, dampers, applied forces | N m | n | [`tree`], [`force`] |
//! | C | `position` | a constraint's violation | rad, m | rows | [`constraint`] |
//! | G | `jacobian` | dC/dq | 1, m | rows × n | [`constraint`] |
//! | C_t | `drive` | dC/dt at fixed q; C' = G w + C_t | rad/s, m/s | rows | [`constraint`] |
//! | gamma | `convective` | what is left of C'' at a = 0 | rad/s², m/s² | rows | [`constraint`] |
//! | lambda | `multiplier` | a row's force is `-G_kᵀ lambda_k` | N m, N | rows | [`multiplier`] |
//!
//! **Everything planar is a sum of unit vectors.**  In a tree of hinged bodies every point is `P = p0 + Σ
//! gamma_k z_k` with complex constants ([`point`]), so the constant Hermitian matrix `H_ij = Σ_m m_m
//! conj(gamma_mi) gamma_mj` (`A = Re H`, `B = Im H`) is formed once per scene, and one sine and cosine per
//! body is all the trigonometry there is.  Where many bodies make that matrix dear, the accelerations are
//! found body by body ([`recursive`]), and those of rows from the factors left behind.
//!
//! **Everything else is a row.**  The hinges make a [`forest`]; those that close a loop, sliders, slots,
//! locks and motors are rows, each a measured angle or a quadratic function of the elements ([`constraint`]).
//! Where rows lose their independence ([`rank`]) they are left out ([`schur`]); the start is found from them
//! ([`assembly`]).
//!
//! The same mechanism is integrated in several forms, chosen before the first step: [`multiplier`] in (q, w)
//! with one multiplier per row, [`looped`] the same with the solve in natural coordinates, [`elimination`]
//! with the driven angles as known functions of time, [`canonical`] in (q, p), the form in which Gauss
//! methods are symplectic, and [`natural`] in the unit vectors themselves, for RATTLE. Evaluated on dual
//! numbers the same formulas are their own [`jacobian`], for implicit methods and for [`stiffness`], the
//! fastest mode and its spring.

#[doc(hidden)]
pub mod assembly;
#[doc(hidden)]
pub mod canonical;
#[doc(hidden)]
pub mod compile;
#[doc(hidden)]
pub mod configuration;
#[doc(hidden)]
pub mod constraint;
#[doc(hidden)]
pub mod contact;
#[doc(hidden)]
pub mod elimination;
#[doc(hidden)]
pub mod energy;
#[doc(hidden)]
pub mod envelope;
mod fingerprint;
#[doc(hidden)]
pub mod force;
#[doc(hidden)]
pub mod forest;
#[doc(hidden)]
pub mod friction;
#[doc(hidden)]
pub mod gap;
#[doc(hidden)]
pub mod impact;
#[doc(hidden)]
pub mod indeterminate;
#[doc(hidden)]
pub mod jacobian;
#[doc(hidden)]
pub mod kernel;
#[doc(hidden)]
pub mod law;
#[doc(hidden)]
pub mod looped;
#[doc(hidden)]
pub mod multiplier;
#[doc(hidden)]
pub mod natural;
pub(crate) mod output;
#[doc(hidden)]
pub mod partition;
#[doc(hidden)]
pub mod point;
#[doc(hidden)]
pub mod points;
#[doc(hidden)]
pub mod quadratic;
#[doc(hidden)]
pub mod rank;
#[doc(hidden)]
pub mod reaction;
#[doc(hidden)]
pub mod recursive;
#[doc(hidden)]
pub mod schur;
#[doc(hidden)]
pub mod series;
#[doc(hidden)]
pub mod stiffness;
#[doc(hidden)]
pub mod tree;
#[doc(hidden)]
pub mod units;

pub use compile::{CompileError, Mechanism};
pub use configuration::Configuration;
pub use points::Points;
pub use series::columns::MotionPowers;
pub use stiffness::Stiffness;
pub use units::Units;

use crate::arithmetic::{DoubleDouble, Scalar, angle};
use natural::ReducedMatrices;

/// Time \[s\], as a pair: at 1e6 s a plain double resolves no better than 1e-10 s, and a motor's phase with
/// it.
pub type Time = DoubleDouble;

/// What a method integrates: the numbers, and everything else a restart needs to go on bit for bit.
#[derive(Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct State {
    /// Time.
    pub time: Time,
    /// The leading parts of the unknowns; the first [`OdeSystem::angles`] are angles in [-π, π].
    pub y: Vec<f64>,
    /// What the leading parts leave out; zero for methods without compensation.
    pub low: Vec<f64>,
    /// Whole turns taken off each angle.
    pub turns: Vec<i64>,
    /// True where none are taken off: see [`Mechanism::is_winding`].
    pub is_winding: bool,
    /// What a method carries from step to step (controller, predictor); empty before the first step.
    pub memory: Vec<f64>,
}

impl State {
    /// A state at time zero from double-double unknowns, of which the first `angles` are angles of any number
    /// of turns.
    pub fn new(unknowns: &[DoubleDouble], angles: usize) -> Self {
        let mut state = Self {
            time: Time::default(),
            y: unknowns.iter().map(|x| x.hi).collect(),
            low: unknowns.iter().map(|x| x.lo).collect(),
            turns: vec![0; angles],
            is_winding: false,
            memory: Vec::new(),
        };
        state.wrap();
        state
    }

    /// Puts whole turns back into the angles, and leaves them there from now on.
    pub fn unwind(&mut self) {
        for (i, turns) in self.turns.iter_mut().enumerate() {
            let angle = DoubleDouble::sum(self.y[i], self.low[i])
                + DoubleDouble::TAU.scale(std::mem::take(turns) as f64);
            (self.y[i], self.low[i]) = (angle.hi, angle.lo);
        }
        self.is_winding = true;
    }

    /// Brings every angle back into [-π, π] and counts the turns.
    pub fn wrap(&mut self) {
        if self.is_winding {
            return;
        }
        for (i, turns) in self.turns.iter_mut().enumerate() {
            // An angle beyond all counting has no turns to lose.
            *turns = turns.saturating_add(angle::wrap(&mut self.y[i], &mut self.low[i]));
        }
    }

    /// Unknown `i` in full.
    pub fn unknown(&self, i: usize) -> DoubleDouble {
        DoubleDouble::sum(self.y[i], self.low[i])
    }
}

impl Clone for State {
    fn clone(&self) -> Self {
        let mut state = Self::default();
        state.clone_from(self);
        state
    }

    /// Allocates nothing where there is room: copies are made every step.
    fn clone_from(&mut self, other: &Self) {
        self.time = other.time;
        self.y.clone_from(&other.y);
        self.low.clone_from(&other.low);
        self.turns.clone_from(&other.turns);
        self.is_winding = other.is_winding;
        self.memory.clone_from(&other.memory);
    }
}

/// A first-order system `y' = f(t, y)` as the methods see it.
pub trait OdeSystem {
    /// Number of unknowns.
    fn dimension(&self) -> usize;

    /// How many of the unknowns, counted from the first, are angles that may be wrapped.
    fn angles(&self) -> usize;

    /// Writes y' at (t, y).  Never fails: what cannot be computed comes out non-finite, and the method stops
    /// with [`OdeSystem::label`].
    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]);

    /// Writes y' at a point given with what it leaves out; fields that can take the forces of stiff springs
    /// from there, which plain doubles round.
    fn fine_rate(&mut self, t: Time, y: &[f64], _low: &[f64], rate: &mut [f64]) {
        self.rhs(t, y, rate);
    }

    /// Writes y' at several points; a field that can evaluates them as lanes of one scalar.
    fn rates(&mut self, points: &mut Points) {
        points.each(|t, y, rate| self.rhs(t, y, rate));
    }

    /// Whether it has [`OdeSystem::exact_rates`].
    fn has_exact_rates(&self) -> bool {
        false
    }

    /// Writes y' and what it leaves out at points given with what *they* leave out; nothing where the field
    /// cannot.
    fn exact_rates(&mut self, _points: &mut Points) {}

    /// Writes dy'/dy at (t, y), row by row (d × d); false, and nothing written, where the field has none.
    fn jacobian(&mut self, _t: Time, _y: &[f64], _jacobian: &mut [f64]) -> bool {
        false
    }

    /// False where nothing feeds modes by their rates: what grows then is an equilibrium left behind.
    fn may_grow_by_rates(&self) -> bool {
        true
    }

    /// How stiff the mechanism is at (t, y); `None` where the field stands for none.
    fn stiffness(&mut self, _t: Time, _y: &[f64]) -> Option<Stiffness> {
        None
    }

    /// What unknown `i` is, for messages: `omega of bar2`.
    fn label(&self, i: usize) -> String;

    /// What the absolute tolerance of unknown `i` counts in: 1 for angles, the units of the mechanism for
    /// positions and rates (see [`Units`]), its energy scale \[J\] for work and other energies.  Energies are
    /// quadratures: no rate depends on them.
    fn unit(&self, _i: usize) -> f64 {
        1.0
    }

    /// The unit of time \[s\]: see [`Units`].
    fn time_unit(&self) -> f64 {
        1.0
    }

    /// The unknown, where there is one, that is a quadrature whose rate may change fast where no other does:
    /// the energy lost in dry friction, which goes with the magnitude of a force.
    fn rough_quadrature(&self) -> Option<usize> {
        None
    }

    /// Number of event functions; none by default.
    fn events(&self) -> usize {
        0
    }

    /// Writes the event functions (gaps over the length, or forces over the force of their contact) at (t,
    /// y): an event is a passage from positive to negative.
    fn gaps(&mut self, _t: Time, _y: &[f64], _gaps: &mut [f64]) {}

    /// How many of the first unknowns the event functions depend on.
    fn watched(&self) -> usize {
        self.dimension()
    }

    /// An event function along a motion, its slope, and the magnitude it is rounded to; `None` for one of
    /// which only the value is known.
    fn gap(&self, _event: usize, _along: Along) -> Option<[f64; 3]> {
        None
    }

    /// A bound of its second derivative up to the time `t` \[s\], where derivatives of the unknowns are at
    /// most these; none where it is infinite.
    fn gap_bend(&self, _event: usize, _t: f64, _pace: f64, _first: &[f64], _second: &[f64]) -> f64 {
        f64::INFINITY
    }
}

/// A moment of a motion that goes by something else than time: the share of a step.
#[derive(Clone, Copy, Debug)]
pub struct Along<'a> {
    /// Time.
    pub time: Time,
    /// How fast time goes by \[s\].
    pub step_size: f64,
    /// Unknowns, as many as are [watched](OdeSystem::watched) at least.
    pub y: &'a [f64],
    /// Their derivatives.
    pub slope: &'a [f64],
}

/// What the first unknowns of a form are; their rates follow, then the work of motors and dampers where there
/// are any.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// All of them: rows are kept by multipliers.
    All,
    /// The angles left by the [`partition`], with the motors' rows eliminated.
    Independent,
    /// Something else.
    Other,
}

/// A form of a mechanism: how a state of its unknowns reads as a motion, and back.
pub trait Form {
    /// The mechanism.
    fn mechanism(&self) -> &Mechanism;

    /// What its first unknowns are, for methods that expand the mechanism itself.
    fn coordinates(&self) -> Coordinates {
        Coordinates::Other
    }

    /// The matrices of the natural form, of a form that solves with them.
    fn reduced(&self) -> Option<&ReducedMatrices> {
        None
    }

    /// The state in which this motion is held.
    fn state(&self, motion: &Motion) -> State;

    /// Writes the motion a state stands for.
    fn read(&mut self, state: &State, motion: &mut Motion);

    /// Writes what there is to see of a state in plain doubles; cheap enough for every step where a form has
    /// its own.
    fn body_angles(&mut self, state: &State, body_angles: &mut BodyAngles) {
        let mut motion = Motion::default();
        self.read(state, &mut motion);
        body_angles.take(&motion);
    }
}

/// Angles and rates of all bodies at a moment, in plain doubles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyAngles {
    /// Absolute angles in [-π, π] \[rad\].
    pub phi: Vec<f64>,
    /// Whole turns to be added to each.
    pub turns: Vec<i64>,
    /// Rates \[rad/s\].
    pub omega: Vec<f64>,
}

impl BodyAngles {
    /// Takes it from a motion.
    pub fn take(&mut self, motion: &Motion) {
        self.phi.clear();
        self.phi.extend(motion.phi.iter().map(|phi| phi.hi));
        self.turns.clone_from(&motion.turns);
        self.omega.clear();
        self.omega.extend(motion.omega.iter().map(|omega| omega.hi));
    }

    /// Takes it from a state whose unknowns begin with so many coordinates and their rates.
    pub fn take_leading(&mut self, state: &State, coordinates: usize) {
        self.phi.clear();
        self.phi.extend_from_slice(&state.y[..coordinates]);
        self.turns.clone_from(&state.turns);
        self.turns.resize(coordinates, 0);
        self.omega.clear();
        self.omega.extend_from_slice(&state.y[coordinates..2 * coordinates]);
    }
}

/// What every form can tell of a moment: angles and rates of all bodies, and the work done on them.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Motion {
    /// Time.
    pub time: Time,
    /// Absolute angles \[rad\], in the order of the scene's bars and in [-π, π] but where turns matter; then
    /// positions of translational coordinates \[m\].
    pub phi: Vec<DoubleDouble>,
    /// Whole turns to be added to each angle.
    pub turns: Vec<i64>,
    /// Rates \[rad/s, m/s\].
    pub omega: Vec<DoubleDouble>,
    /// Work of motors, dampers and applied forces on the bodies since t = 0 \[J\].
    pub work: DoubleDouble,
    /// Energy a stabilizer has put in since t = 0 \[J\], negative where it took some out.
    pub stabilizer: f64,
    /// Energy lost in dry friction since t = 0 \[J\]; the work has it as well, with its sign.
    #[serde(default)]
    pub friction: f64,
}

impl Motion {
    /// That of coordinates \[rad, m\] and rates \[rad/s, m/s\] in plain doubles at a time \[s\].
    pub(crate) fn of_doubles(t: f64, numbers: [&[f64]; 2]) -> Self {
        let [phi, omega] = numbers.map(|all| all.iter().copied().map(DoubleDouble::from).collect::<Vec<_>>());
        Self { time: t.into(), turns: vec![0; phi.len()], phi, omega, ..Self::default() }
    }

    /// Room for so many coordinates.
    pub fn resize(&mut self, coordinates: usize) {
        self.phi.resize(coordinates, DoubleDouble::ZERO);
        self.omega.resize(coordinates, DoubleDouble::ZERO);
        self.turns.resize(coordinates, 0);
    }

    /// Takes time, turns, coordinates and rates of a state that begins with all of so many coordinates.
    pub(crate) fn follow(&mut self, state: &State, coordinates: usize) {
        self.resize(coordinates);
        self.time = state.time;
        self.turns[..state.turns.len()].copy_from_slice(&state.turns);
        for k in 0..coordinates {
            (self.phi[k], self.omega[k]) = (state.unknown(k), state.unknown(coordinates + k));
        }
    }

    /// Coordinates \[rad, m\] and rates \[rad/s, m/s\] in plain doubles.
    pub(crate) fn rounded(&self) -> [Vec<f64>; 2] {
        [&self.phi, &self.omega].map(|all| all.iter().map(|x| x.hi).collect())
    }

    /// The motion so much later \[s\], at these accelerations; those that are not given are zero.
    pub(crate) fn later(&self, h: f64, accelerations: &[f64]) -> Self {
        let mut later = self.clone();
        later.time = later.time + h;
        for (k, (phi, omega)) in later.phi.iter_mut().zip(&mut later.omega).enumerate() {
            let acceleration = accelerations.get(k).copied().filter(|a| a.is_finite()).unwrap_or(0.0);
            *phi += *omega * DoubleDouble::from(h) + DoubleDouble::from(0.5 * h * h * acceleration);
            *omega += DoubleDouble::from(h * acceleration);
        }
        later
    }

    /// The winding angle of a body \[rad\].
    pub fn unwrapped(&self, body: usize) -> f64 {
        angle::unwrapped(self.phi[body], self.turns[body])
    }
}
