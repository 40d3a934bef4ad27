//! Small differences through an impact, an event that switches parts and branches, and the transitions of dry
//! friction: neighbours come there earlier or later, by the saltation matrix.
//!
//! ```text
//! dt = -dg / g'⁻,     dq = dq⁻ + q'⁻ dt,   dw = dw⁻ + a⁻ dt       at the zero of g;      w⁺ = I(t, q, w⁻)
//! dq⁺ = dq - q'⁺ dt,      dw⁺ = dI(dt, dq, dw) - a⁺ dt                     a⁺ with what acts, sticks and is held from then on
//! ```
//!
//! g is the gap of a wall, the event function of a switch, or that of a place with friction: the relative
//! velocity of what slides, `(mu0 N)² - tau²` of what sticks.  I is the law of impact, or what a joint that
//! closes does to the rates.
//!
//! Source: P. C. Müller, *Calculation of Lyapunov exponents for dynamic systems with discontinuities*, Chaos,
//! Solitons & Fractals 5 (1995).

use super::numbers::{moved, set_at};
use super::{Path, Tangent, together};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::Posture;
use crate::dynamics::friction::Mode;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Coordinates, Mechanism, Motion};
use crate::run::contact::{Jump, Switch, in_modes};
use crate::run::event::SwitchFunction;
use crate::run::friction::FrictionWatch;
use crate::run::latch::plastic;
use std::sync::Arc;

/// Normal velocity over that of the point's parts below which a wall is grazed, and neighbours may miss it;
/// and over a usual one where the parts are nearly at rest: there differences of 1e-12 may.
const GRAZED: f64 = 1e-7;
const HARDLY_MET: f64 = 1e-6;
/// Difference the impact's derivative is taken from, over the size of what it changes.
const DIFFERENCE: f64 = 1e-6;

/// What is on both sides of an impact, in plain doubles.
pub(super) struct Side {
    pub phi: Vec<f64>,
    pub omega: Vec<f64>,
    pub acceleration: Vec<f64>,
}

/// A function of the motion, and of how far the parameters that events set are from their values.
type Function<'a> = &'a dyn Fn(&Motion, &[f64]) -> Option<Vec<f64>>;

impl Side {
    /// The motion itself as a column.
    fn ahead(&self) -> Vec<f64> {
        [&self.omega[..], &self.acceleration[..]].concat()
    }

    /// The derivative of a function along a column, and `late` \[s\]; `None` where there is no such function.
    pub(super) fn slope(
        &self,
        motion: &Motion,
        column: &[f64],
        late: f64,
        value: Function,
    ) -> Option<Vec<f64>> {
        let n = self.phi.len();
        let (moving, parameters) = column.split_at(2 * n);
        let given = parameters.iter().fold(late.abs(), |most, change| most.max(change.abs()));
        let most = size(&moving[..n], &self.phi).max(size(&moving[n..], &self.omega)).max(given);
        let small = if most > 0.0 { DIFFERENCE / most } else { 1.0 };
        let beside = |sign: f64| {
            let moved = |from: &[f64], by: &[f64]| -> Vec<DoubleDouble> {
                from.iter().zip(by).map(|(x, y)| DoubleDouble::from(x + sign * small * y)).collect()
            };
            let mut moved = Motion {
                phi: moved(&self.phi, &column[..n]),
                omega: moved(&self.omega, &moving[n..]),
                ..motion.clone()
            };
            moved.time = motion.time + sign * small * late;
            let given: Vec<f64> = parameters.iter().map(|change| sign * small * change).collect();
            value(&moved, &given)
        };
        let (ahead, behind) = (beside(1.0)?, beside(-1.0)?);
        Some(ahead.iter().zip(behind).map(|(ahead, behind)| (ahead - behind) / (2.0 * small)).collect())
    }

    pub(super) fn new(mechanism: &Mechanism, motion: &Motion) -> Self {
        let [phi, omega] = plain(motion);
        let mut kernel = Kernel::<f64>::new(mechanism);
        kernel.accelerate::<0>(mechanism, motion.time, &phi, &omega, Bias::default());
        Self { acceleration: kernel.load, phi, omega }
    }
}

/// The largest entry over the size of what it changes.
fn size(of: &[f64], from: &[f64]) -> f64 {
    of.iter().zip(from).fold(0.0, |most: f64, (x, y)| most.max(x.abs() / (1.0 + y.abs())))
}

impl Path {
    /// Takes the motors and locks that have engaged between two mechanisms.
    fn engage(&mut self, [before, after]: [&Mechanism; 2]) {
        let acts = |mechanism: &Mechanism, r: usize| {
            mechanism.constraints.get(r).is_some_and(|row| !row.coordinates().is_empty())
        };
        self.engaged.retain(|&r| acts(after, r));
        for r in 0..after.standing_rows() {
            let may = after.switches.clutches.contains(&after.constraints[r].name);
            if may && acts(after, r) && !acts(before, r) && !self.engaged.contains(&r) {
                self.engaged.push(r);
            }
        }
    }
}

impl Tangent {
    /// Tells the constraints which of them have engaged on the way.
    pub(super) fn hold_engaged(&mut self) {
        if let Some(ground) = &mut self.ground {
            ground.engaged.clone_from(&self.path.engaged);
        }
    }

    /// Takes impacts, holds and releases on the way to [`Tangent::next`], in their order.
    pub(in crate::run) fn jump(&mut self, jumps: &[Jump]) {
        for jumps in jumps.chunk_by(|one, other| one.before.time == other.before.time) {
            self.jump_at_once(jumps);
        }
    }

    /// Takes those of one moment.
    fn jump_at_once(&mut self, jumps: &[Jump]) {
        let ([first, ..], [.., last]) = (jumps, jumps) else { return };
        self.advance(first.before.time, None, 0.0);
        if self.path.lost.is_some() {
            return;
        }
        let n = self.mechanism.coordinates();
        let unknowns = 2 * self.weights.len();
        let spread = |column: &Vec<f64>| [&self.spread(column)[..], &column[unknowns..]].concat();
        let mut all: Vec<Vec<f64>> = self.path.columns.iter().chain(&self.path.inputs).map(spread).collect();
        if let Err(why) = cross(&self.mechanism, &self.set, jumps, &mut all) {
            return self.lose(&why);
        }
        if !Arc::ptr_eq(&last.mechanism, &self.mechanism) {
            let mut path = std::mem::take(&mut self.path);
            path.engage([&self.mechanism, &last.mechanism]);
            match Self::bare(&last.mechanism) {
                Ok(other) => *self = Self { path, ..other },
                Err(why) => {
                    self.path = path;
                    return self.lose(&why);
                }
            }
            self.hold_engaged();
            self.path.held.clone_from(&self.mechanism.held);
        }
        if self.coordinates == Coordinates::Independent {
            let own = &self.mechanism.partition.independent;
            for column in &mut all {
                let moving = own.iter().copied().chain(own.iter().map(|&k| n + k));
                *column = moving.chain(2 * n..column.len()).map(|k| column[k]).collect();
            }
        }
        let inputs = all.split_off(self.path.columns.len());
        (self.path.columns, self.path.inputs) = (all, inputs);
        self.path.state = self.problem.state(&last.after);
        self.make_room();
        if let Err(why) = self.take_parameters() {
            return self.lose(&why);
        }
        self.keep();
        self.evaluate();
        if self.normalise() {
            self.prepare();
        }
    }
}

/// Takes columns of all coordinates and rates through what happens at one moment to a mechanism with what acts
/// and is held before it.
///
/// What is held or let go with it comes earlier or later as well; what is held is put on its wall afterwards.
///
/// # Errors
/// Why neighbours do not go the same way.
fn cross(
    mechanism: &Arc<Mechanism>,
    set: &[usize],
    jumps: &[Jump],
    columns: &mut [Vec<f64>],
) -> Result<(), String> {
    if together::is_at_several(jumps) {
        return columns.iter_mut().try_for_each(|column| together::cross(mechanism, jumps, column));
    }
    let is_cause = |jump: &&Jump| jump.contact.is_some() || jump.switch.is_some() || jump.friction.is_some();
    let (Some(cause), Some(last)) = (jumps.iter().find(is_cause), jumps.last()) else { return Ok(()) };
    if jumps.iter().filter(|jump| jump.switch.is_some()).count() > 1 {
        return Err(
            "several events happen at once, which neighbouring motions meet one after the other".into()
        );
    }
    let here = Side::new(mechanism, &cause.before);
    let there = Side::new(&last.mechanism, &last.after);
    let late = match cause {
        Jump { contact: Some(contact), .. } => late_at_wall(mechanism, *contact, cause, &here, columns)?,
        Jump { switch: Some(switch), .. } => late_at_switch(mechanism, set, switch, cause, &here, columns)?,
        Jump { friction, .. } => late_at_friction(mechanism, *friction, cause, &here, columns)?,
    };
    for (column, late) in columns.iter_mut().zip(late) {
        shift(column, late, &here);
        for jump in jumps {
            if let Some(contact) = jump.contact {
                impact_at(jump, contact, late, column)?;
            }
            if let Some(switch) = &jump.switch {
                set_at(mechanism, set, (switch, &jump.before), (&here, late), column)?;
                if jump.before.omega != jump.after.omega {
                    close_at(jump, late, column)?;
                }
            }
        }
        shift(column, -late, &there);
    }
    Ok(())
}

/// Takes a column to a moment so much later \[s\].
pub(super) fn shift(column: &mut [f64], late: f64, side: &Side) {
    let n = side.phi.len();
    for k in 0..n {
        column[k] += late * side.omega[k];
        column[n + k] += late * side.acceleration[k];
    }
}

/// How much later \[s\] a point meets its wall, column by column.
fn late_at_wall(
    mechanism: &Mechanism,
    contact: usize,
    struck: &Jump,
    here: &Side,
    columns: &[Vec<f64>],
) -> Result<Vec<f64>, String> {
    let n = mechanism.coordinates();
    if !mechanism.frictions.is_empty() && !mechanism.held.is_empty() {
        return Err("an impact beside a contact with dry friction is not followed".into());
    }
    let touched = &mechanism.contacts[contact];
    let mut gradient = vec![0.0; n];
    let z = mechanism.elements(&here.phi);
    let at = touched.row.linearise(
        struck.before.time,
        Posture { phi: &here.phi, z: &z, omega: &here.omega },
        &mut gradient,
    );
    let approach = dot(&gradient, &here.omega) + at.drive;
    let usual = touched.length / mechanism.units.time;
    if approach >= -(GRAZED * touched.step_size(&here.omega)).max(HARDLY_MET * usual) {
        return Err("a point grazes a wall, which neighbouring motions may miss".into());
    }
    Ok(columns.iter().map(|column| -dot(&gradient, &column[..n]) / approach).collect())
}

/// How much later \[s\] an event happens that switches parts or branches, column by column.
fn late_at_switch(
    mechanism: &Mechanism,
    set: &[usize],
    switch: &Switch,
    cause: &Jump,
    here: &Side,
    columns: &[Vec<f64>],
) -> Result<Vec<f64>, String> {
    if !switch.keeps_motion {
        return Err("an event from outside sets the motion, which is not followed".into());
    }
    let value = |motion: &Motion, given: &[f64]| {
        let laws = mechanism.laws.as_ref()?;
        let parameters = moved(&laws.parameters, set, given);
        mechanism.seen(motion, |at| match switch.at {
            SwitchFunction::Event(number) => Some(vec![laws.formulas.event_value(number, at, &parameters)]),
            SwitchFunction::Condition(number) => {
                let values = laws.formulas.condition_values(at, &parameters, &laws.modes);
                values.get(number).map(|&value| vec![value])
            }
            SwitchFunction::Other => None,
        })
    };
    late_at_zero(cause, here, columns, &value)
}

/// How much later \[s\] a place with friction begins to stick or to slide, column by column.
fn late_at_friction(
    mechanism: &Arc<Mechanism>,
    place: Option<usize>,
    cause: &Jump,
    here: &Side,
    columns: &[Vec<f64>],
) -> Result<Vec<f64>, String> {
    let n = mechanism.coordinates();
    if columns.iter().any(|column| column[2 * n..].iter().any(|change| *change != 0.0)) {
        return Err(
            "dry friction beside a parameter that neighbouring motions set otherwise is not followed".into(),
        );
    }
    let watch = FrictionWatch::new(mechanism);
    let value = |motion: &Motion, _: &[f64]| {
        let values = watch.as_ref()?.values(motion);
        Some(vec![*values.get(place?)?])
    };
    late_at_zero(cause, here, columns, &value)
}

/// How much later \[s\] a function of the motion is zero, column by column.
fn late_at_zero(
    cause: &Jump,
    here: &Side,
    columns: &[Vec<f64>],
    value: Function,
) -> Result<Vec<f64>, String> {
    let slope = |column: &[f64], late: f64| {
        here.slope(&cause.before, column, late, value)
            .map(|slope| slope[0])
            .ok_or("what happens here is not known to the scene")
    };
    let rate = slope(&here.ahead(), 1.0)?;
    if rate == 0.0 || !rate.is_finite() {
        return Err("an event function only touches zero, which neighbouring motions may miss".into());
    }
    columns.iter().map(|column| Ok(-slope(column, 0.0)? / rate)).collect()
}

/// The derivative of an impact, along a column and `late` \[s\].
fn impact_at(jump: &Jump, contact: usize, late: f64, column: &mut [f64]) -> Result<(), String> {
    // Friction in hinges and sliders takes no part in impacts.
    let open = vec![Mode::Open; jump.mechanism.frictions.len()];
    let striking = in_modes(&jump.mechanism, &jump.mechanism.held, &open);
    let rates = |motion: &Motion, _: &[f64]| {
        let [phi, omega] = plain(motion);
        striking.impact_at(contact, motion.time, &phi, &omega).map(|impact| impact.omega)
    };
    change(&jump.before, late, column, &rates)
        .ok_or_else(|| "neighbouring motions have no way back from a wall".into())
}

/// The same of what closes or engages.
fn close_at(jump: &Jump, late: f64, column: &mut [f64]) -> Result<(), String> {
    let open = vec![Mode::Open; jump.mechanism.frictions.len()];
    let closing = in_modes(&jump.mechanism, &jump.mechanism.held, &open);
    let rates = |motion: &Motion, _: &[f64]| plastic(&closing, motion).map(|(rates, ..)| rates);
    change(&jump.before, late, column, &rates)
        .ok_or_else(|| "what closes leaves neighbouring motions no rates".into())
}

/// The rates of a column after they have become others.
pub(super) fn change(before: &Motion, late: f64, column: &mut [f64], rates: Function) -> Option<()> {
    let [phi, omega] = plain(before);
    let n = phi.len();
    let side = Side { acceleration: Vec::new(), phi, omega };
    let after = side.slope(before, column, late, rates)?;
    column[n..2 * n].copy_from_slice(&after);
    Some(())
}

/// Coordinates and rates in plain doubles.
pub(super) fn plain(motion: &Motion) -> [Vec<f64>; 2] {
    [&motion.phi, &motion.omega].map(|all| all.iter().map(|x| x.hi).collect())
}
