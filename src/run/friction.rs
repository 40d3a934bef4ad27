//! Dry friction in a run: when places begin and cease to stick, and what is counted of it.
//!
//! The event functions of the places are watched beside those of the scene: the relative velocity of what
//! slides, or is held by others, and `(mu0 N)² - tau²` of what sticks.  Steps end at their zeros, and there
//! the modes of all places are found anew, see [`modes`](crate::dynamics::friction::modes).

use super::contact::ContactDriver;
use super::running::Outcome;
use crate::arithmetic::Complex;
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::friction::evidence::NO_SPEED;
use crate::dynamics::friction::modes::Modes;
use crate::dynamics::friction::paradox::{HINT, JAMMED, JAMS, REGULAR};
use crate::dynamics::friction::{CompiledFriction, FrictionMode, FrictionMoment, Transition};
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stepping::{Cause, StepError};
use serde::{Deserialize, Serialize};
use std::cell::{Cell, RefCell};
use std::sync::Arc;

/// Transitions kept by name; the rest are counted.
const KEPT: usize = 1000;
/// Velocity over the sum of the magnitudes of its parts and the mechanism's own up to which what others hold
/// rests: they may begin to move it.
const AT_REST: f64 = 1e-11;
/// How many times a force is to grow within a moment for its sign to count as that of rounding.
const NO_FORCE: f64 = 100.0;

/// A place with friction began to stick or to slide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrictionRecord {
    /// Time \[s\].
    pub t: f64,
    /// Name of the hinge, slider or wall.
    pub name: String,
    /// What it does from then on: `sticks`, `slides` or `apart`.
    pub mode: String,
}

/// The event functions of a mechanism's places with friction, in their present modes.
pub(super) struct FrictionWatch {
    mechanism: Arc<Mechanism>,
    kernel: RefCell<Kernel<f64>>,
    /// The regularity at the first place of the search under way, where it is far from zero.
    regularity: Cell<Option<f64>>,
    /// The largest `(mu0 N)² + tau²` of every place that sticks in the search under way.
    forces: RefCell<Vec<f64>>,
}

impl FrictionWatch {
    /// Those of a mechanism; `None` where it has no friction.
    pub fn new(mechanism: &Arc<Mechanism>) -> Option<Self> {
        let kernel = || RefCell::new(Kernel::new(mechanism));
        let mechanism = Arc::clone(mechanism);
        (!mechanism.frictions.is_empty()).then(|| Self {
            kernel: kernel(),
            mechanism,
            regularity: Cell::new(None),
            forces: RefCell::default(),
        })
    }

    /// How many there are: one a place, and the regularity of their equations.
    pub fn functions(&self) -> usize {
        self.mechanism.frictions.len() + 1
    }

    /// The place a function is of; `None` for the regularity.
    pub fn place(&self, function: usize) -> Option<&CompiledFriction> {
        self.mechanism.frictions.get(function)
    }

    /// Magnitude up to which a function is rounding of a place that slides from rest, or what a method of
    /// this tolerance leaves open of it.
    pub fn at_rest(&self, function: usize, tolerance: f64) -> f64 {
        match self.mechanism.modes.get(function) {
            Some(FrictionMode::Slip(_)) => NO_SPEED.max(tolerance) * self.mechanism.speed_unit(function),
            _ => 0.0,
        }
    }

    /// The size of what a function's values are differences of: changes that are small beside it may be
    /// rounding.  After [`values`](Self::values).
    pub fn size(&self, function: usize) -> f64 {
        match self.mechanism.modes.get(function) {
            Some(FrictionMode::Slip(_) | FrictionMode::Strained(_)) => self.mechanism.speed_unit(function),
            Some(FrictionMode::Stick(_)) => self.forces.borrow().get(function).copied().unwrap_or(0.0),
            _ => 0.0,
        }
    }

    /// Begins to search a part of a step.
    pub fn search(&self) {
        self.regularity.set(None);
        let mut forces = self.forces.borrow_mut();
        forces.clear();
        forces.resize(self.mechanism.frictions.len(), 0.0);
    }

    /// Relative velocities of what slides, which take no forces.
    fn sliding(&self, t: Time, phi: &[f64], omega: &[f64]) -> Vec<f64> {
        let z = self.mechanism.elements(phi);
        let (at, mut row) = (ConstraintArguments { phi, z: &z, omega }, vec![0.0; phi.len()]);
        let of_place = |(number, (friction, mode)): (usize, (&CompiledFriction, &FrictionMode))| match mode {
            FrictionMode::Slip(_) | FrictionMode::Strained(_) => {
                row.fill(0.0);
                friction.tangent.differentiate(t, at, &mut row);
                self.velocity(number, *mode, &row, omega)
            }
            _ => 1.0,
        };
        self.mechanism.frictions.iter().zip(&self.mechanism.modes).enumerate().map(of_place).collect()
    }

    /// The relative velocity of a place that slides, and what is left to one that motors hold of what counts
    /// as rest; `row` is the place's Jacobian.
    fn velocity(&self, place: usize, mode: FrictionMode, row: &[f64], omega: &[f64]) -> f64 {
        match mode {
            FrictionMode::Slip(sign) => sign * dot(row, omega),
            FrictionMode::Strained(0.0) => {
                let parts: f64 = row.iter().zip(omega).map(|(d, omega)| (d * omega).abs()).sum();
                AT_REST * parts.max(self.mechanism.speed_unit(place)) - dot(row, omega).abs()
            }
            _ => 1.0,
        }
    }

    /// Their values at a motion: positive as long as the modes hold.
    ///
    /// Where nothing sticks, forces are needed for the regularity only.  It is looked at where a search
    /// begins, and everywhere where it is near zero.
    pub fn values(&self, motion: &Motion) -> Vec<f64> {
        let mechanism = &*self.mechanism;
        let [phi, omega] = motion.rounded();
        let is_sticking = mechanism.sticking() > 0;
        if let Some(regularity) = self.regularity.get() {
            let mut values = self.sliding(motion.time, &phi, &omega);
            values.push(regularity);
            return values;
        }
        let (kernel, n) = (&mut *self.kernel.borrow_mut(), phi.len());
        kernel.accelerations(mechanism, motion.time, &phi, &omega, Bias::default());
        if !is_sticking && kernel.regularity > REGULAR {
            self.regularity.set(Some(kernel.regularity));
        }
        let forces = if is_sticking {
            kernel.friction_forces(mechanism, motion.time, &phi, &omega)
        } else {
            Vec::new()
        };
        let (mut rows, mut sizes) = (kernel.friction_rows.chunks_exact(n), self.forces.borrow_mut());
        let of_place = |(number, (friction, mode)): (usize, (&CompiledFriction, &FrictionMode))| match mode {
            FrictionMode::Open => 1.0,
            FrictionMode::Slip(_) | FrictionMode::Strained(_) => {
                rows.next().map_or(0.0, |row| self.velocity(number, *mode, row, &omega))
            }
            FrictionMode::Stick(_) => {
                let [tau, pressing] = forces[number];
                let most = friction.stiction * pressing;
                if let Some(size) = sizes.get_mut(number) {
                    *size = size.max(most * most + tau * tau);
                }
                most * most - tau * tau
            }
        };
        let places = mechanism.frictions.iter().zip(&mechanism.modes).enumerate();
        let mut values: Vec<f64> = places.map(of_place).collect();
        values.push(kernel.regularity);
        values
    }

    /// The force by which a place that sticks breaks loose; where it has none, as without a load, that of a
    /// moment later.
    fn breaking_force(&self, place: usize, motion: &Motion) -> f64 {
        let mechanism = &*self.mechanism;
        let kernel = &mut *self.kernel.borrow_mut();
        let mut force = |time: Time, phi: &[f64], omega: &[f64]| {
            kernel.accelerations(mechanism, time, phi, omega, Bias::default());
            (kernel.friction_forces(mechanism, time, phi, omega)[place][0], kernel.load.clone())
        };
        let [phi, omega] = motion.rounded();
        let (now, accelerations) = force(motion.time, &phi, &omega);
        let (t, [phi, omega]) = mechanism.a_moment_later(motion.time, [&phi, &omega], &accelerations);
        let (later, _) = force(t, &phi, &omega);
        if later.abs() > NO_FORCE * now.abs() { later } else { now }
    }

    /// What happens to the modes at the zero of a function, at a motion.
    fn transition(&self, function: usize, motion: &Motion) -> Option<Transition> {
        let mode = self.mechanism.modes.get(function)?;
        Some(match mode {
            FrictionMode::Stick(_) => {
                let sign = if self.breaking_force(function, motion) < 0.0 { -1.0 } else { 1.0 };
                Transition { arrived: None, breaks: Some((function, sign)) }
            }
            // It moves already.
            FrictionMode::Strained(_) => Transition::default(),
            _ => Transition { arrived: Some(function), breaks: None },
        })
    }
}

impl ContactDriver {
    /// Lets the zero of an event function of friction take effect.
    pub(super) fn friction_event(&mut self, function: usize, outcome: &mut Outcome) -> Result<(), StepError> {
        let motion = self.motion();
        let watch = self.events.as_ref().and_then(|events| events.friction.as_ref());
        if let Some(transition) = watch.and_then(|watch| watch.transition(function, &motion)) {
            let is_changed = self.settles_by(transition, outcome)?;
            // Friction of bounces that are left out may have carried a place beyond rest.
            if !is_changed && transition.arrived.is_some() {
                self.settles_anew(outcome)?;
            }
            return Ok(());
        }
        // What rests may do so by other forces.
        if self.settles_anew(outcome)? { Ok(()) } else { Err(self.paradox(outcome, JAMS.into())) }
    }

    /// The contacts held and the modes of the places with friction from the present moment on.
    pub(super) fn friction_modes(
        &mut self,
        staying: Vec<usize>,
        touching: &[usize],
        transition: Transition,
        outcome: &Outcome,
    ) -> Result<Modes, StepError> {
        if self.free.frictions.is_empty() {
            return Ok((staying, Vec::new()));
        }
        let motion = self.motion();
        let [phi, omega] = motion.rounded();
        let z: Vec<Complex<f64>> = self.free.elements(&phi);
        let at = FrictionMoment { t: motion.time, phi: &phi, z: &z, omega: &omega };
        let found = self.free.modes_at(at, &self.mechanism.modes, [&staying, touching], transition);
        found.map_err(|paradox| {
            let places: Vec<&str> =
                self.free.frictions.iter().map(|friction| friction.name.as_str()).collect();
            let places = places.join(", ");
            self.paradox(outcome, paradox.message(&places))
        })
    }

    /// True where friction hardly follows from the present motion.
    pub(super) fn jams(&mut self) -> bool {
        if self.mechanism.sliding().next().is_none() {
            return false;
        }
        let motion = self.motion();
        let [phi, omega] = motion.rounded();
        let mut kernel = Kernel::<f64>::new(&self.mechanism);
        kernel.accelerations(&self.mechanism, motion.time, &phi, &omega, Bias::default());
        kernel.regularity.abs() < JAMMED
    }

    pub(super) fn paradox(&mut self, outcome: &Outcome, what: String) -> StepError {
        StepError {
            cause: Cause::Friction,
            method: outcome.plan.method.to_string(),
            t: self.motion().time.hi,
            step: 0.0,
            what,
            hint: HINT.into(),
        }
    }

    /// Counts the places that begin to stick, to slide, or are apart.
    pub(super) fn record_modes(&self, modes: &[FrictionMode], t: f64, outcome: &mut Outcome) {
        for (number, (mode, before)) in modes.iter().zip(&self.mechanism.modes).enumerate() {
            let mode = mode.word();
            if mode == before.word() {
                continue;
            }
            outcome.friction_count += 1;
            if outcome.frictions.len() < KEPT {
                let name = self.free.frictions[number].name.clone();
                outcome.frictions.push(FrictionRecord { t, name, mode: mode.into() });
            }
        }
    }
}
