//! A moment of a motion, the start of a scene or a later one, looked at closely: accelerations, multipliers,
//! motors, hinge forces, energies, impacts.
//!
//! Signs, whichever body is the ground:
//!
//! | of | force or torque | on | from |
//! | --- | --- | --- | --- |
//! | hinge, weld | force | the second body in `between` | the first |
//! | slider | force across the rail | the body of its `point` | the body of its `rail` |
//! | rigid spring | force | the first body in `between` | the second |
//! | motor, lock | torque | its `body` | what `relative_to` names, else the ground |
//! | motor on a slider | force along the rail | the body of the slider's `point` | that of the rail |
//! | weld's `NAME.angle` | torque | the second body, or the first if that is the ground | the other |
//! | locked slider's `NAME.angle` | torque | that of its `point`, or else of the rail | the other |
//! | wall | impulse along the normal | its `body` | the ground |
//!
//! Forces are in the directions of the ground, torques counter-clockwise; each body that is named `from` gets
//! the opposite at the same place.  A torque is minus its constraint's multiplier, a force minus the
//! multiplier along the constraint's direction: the rail's direction for a travel, that turned left by a
//! quarter for a slider, x and y for `NAME.x` and `NAME.y` of a hinge that closes a loop, on its first body.
//! A power is what a motor feeds in.

mod text;

use crate::arithmetic::DoubleDouble;
use crate::dynamics::compile::Joint;
use crate::dynamics::constraint::{ConstraintArguments, ConstraintEquation, RowMeasure};
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::output::{Moment, OutputScratch};
use crate::dynamics::{Mechanism, Motion};
use crate::scene::Scene;
use serde_json::{Value, json};

/// What there is to know of a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inspection {
    /// Time \[s\].
    pub t: f64,
    /// Each body with the acceleration of its centre of mass (x, y) \[m/s²\] and of its angle \[rad/s²\].
    pub bodies: Vec<(String, [f64; 3])>,
    /// Each constraint with its multiplier \[N·m or N\], its violation \[rad or m\] and the rate of that
    /// \[rad/s or m/s\].
    pub constraints: Vec<(String, [f64; 3])>,
    /// What each of the constraints exerts, in their order.
    pub reactions: Vec<Reaction>,
    /// Each motor with its torque \[N·m\], or its force \[N\] on a slider, and power \[W\].
    pub motors: Vec<(String, [f64; 2])>,
    /// Each hinge with what it does.
    pub hinges: Vec<HingeForce>,
    /// Kinetic and potential energy \[J\].
    pub energy: [f64; 2],
    /// What energies are divided by in reports \[J\].
    pub energy_scale: f64,
    /// Each wall with what happens there at the start.
    pub walls: Vec<ReportedContact>,
    /// Places with dry friction: what they do, whether it is a torque \[N·m\] or a force \[N\], it and the
    /// force \[N\] that presses them.
    pub frictions: Vec<(String, &'static str, bool, [f64; 2])>,
    /// Name, unit and value of each of the scene's outputs.
    pub outputs: Vec<(String, String, f64)>,
    /// True at a singular position: the state does not tell accelerations and what constraints exert, which
    /// are not a number.
    pub is_singular: bool,
}

/// What a hinge carries.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HingeForce {
    /// Name of the hinge.
    pub name: String,
    /// Force (x, y) \[N\].
    pub force: [f64; 2],
    /// The body it acts on.
    pub on: String,
    /// The body it comes from.
    pub from: String,
    /// False where redundant constraints leave it open: it is one of those of least norm then.  `None` where
    /// that was not examined.
    pub is_determinate: Option<bool>,
}

/// What a constraint exerts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reaction {
    /// Unit of what it measures, `rad` or `m`.
    pub unit: &'static str,
    /// Unit of its multiplier, `N m` or `N`.
    pub unit_of_multiplier: &'static str,
    /// Torque on a body \[N·m\], for constraints of angles.
    pub torque: Option<f64>,
    /// Force (x, y) on a body \[N\], for others.
    pub force: Option<[f64; 2]>,
    /// The body it acts on.
    pub on: String,
    /// The body it comes from.
    pub from: String,
    /// As that of a hinge.
    pub is_determinate: Option<bool>,
}

/// A wall.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportedContact {
    /// Name of the wall.
    pub name: String,
    /// Distance of the point from it \[m\].
    pub gap: f64,
    /// Rate of that \[m/s\].
    pub approach: f64,
    /// The impact, where the point is on the wall and moving into it.
    pub impact: Option<ReportedImpact>,
}

/// An impact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportedImpact {
    /// Impulse on the point along the normal \[N·s\].
    pub impulse: f64,
    /// Energy lost, work of the motors not counted \[J\].
    pub energy_lost: f64,
    /// Impulsive work of the motors \[J\].
    pub motor_work: f64,
    /// Rate of each body after it \[rad/s\].
    pub omega: Vec<f64>,
}

/// A gap, over the length of its contact, below which a point is on its wall.
const TOUCHING: f64 = 1e-12;

/// Looks at the start of a scene.
pub fn inspect(scene: &Scene, mechanism: &Mechanism) -> Inspection {
    let start = mechanism.start(scene);
    let moving = mechanism.moving_at_start(&start);
    inspect_at(moving.as_ref().unwrap_or(mechanism), &start)
}

/// Looks at a moment of a motion; the mechanism is the one of that moment, as
/// [`Running::mechanism`](crate::run::Running::mechanism) gives it.
pub fn inspect_at(mechanism: &Mechanism, start: &Motion) -> Inspection {
    let [phi, omega] = start.rounded();
    let mut kernel = Kernel::<f64>::new(mechanism);
    kernel.accelerations(mechanism, start.time, &phi, &omega, Bias::default());
    let (t, energy_scale) = (start.time.hi, mechanism.energy_scale);
    let is_singular = mechanism.hides_forces(&kernel);
    let mut found = Inspection { t, energy_scale, is_singular, ..Inspection::default() };
    if is_singular {
        kernel.load.fill(f64::NAN);
        kernel.multiplier.fill(f64::NAN);
    }
    let centres = mechanism.centre_accelerations(&kernel.z, &omega, &kernel.load);
    for (k, (body, centre)) in mechanism.own_bodies().iter().zip(centres).enumerate() {
        found.bodies.push((body.name.clone(), [centre.re, centre.im, kernel.load[k]]));
    }
    let mut forces = mechanism.joint_forces(start.time, &kernel, &phi, &omega);
    if is_singular {
        forces.hinge_is_determinate.fill(Some(false));
        forces.row_is_determinate.fill(Some(false));
    }
    let name =
        |body: Option<usize>| body.map_or("ground", |body| mechanism.bodies[body].name.as_str()).to_owned();
    for (r, row) in mechanism.constraints.iter().enumerate() {
        let (here, multiplier) = (kernel.rows[r], forces.multipliers[r]);
        found
            .constraints
            .push((row.name().to_owned(), [multiplier, here.position, kernel.row_rate(r, &omega)]));
        if mechanism.is_motor(r) {
            found.motors.push((row.name().to_owned(), [-multiplier, multiplier * here.drive]));
        }
        let [on, from] = sides(row).map(name);
        let force = row
            .push
            .as_ref()
            .map(|push| push.direction(&kernel.z).times(-multiplier))
            .map(|force| [force.re, force.im]);
        found.reactions.push(Reaction {
            unit: row.unit(),
            unit_of_multiplier: row.unit_of_force(),
            torque: row.is_in_radians().then_some(-multiplier),
            force,
            on,
            from,
            is_determinate: forces.row_is_determinate[r],
        });
    }
    let is_rotor = |joint: &Joint| joint.outer.is_some_and(|body| body >= mechanism.own_bodies().len());
    for (j, joint) in mechanism.joints.iter().enumerate().filter(|(_, joint)| !is_rotor(joint)) {
        let ([from, on], force) = (joint.between.map(name), forces.hinges[j]);
        let is_determinate = forces.hinge_is_determinate[j];
        found.hinges.push(HingeForce {
            name: joint.name.clone(),
            force: [force.re, force.im],
            on,
            from,
            is_determinate,
        });
    }
    let energy =
        mechanism.energy(&mut Kernel::<DoubleDouble>::without_rows(mechanism), &start.phi, &start.omega);
    found.energy = [energy.kinetic.hi, energy.potential.hi];
    let frictions = kernel.friction_forces(mechanism, start.time, &phi, &omega);
    for ((friction, mode), force) in mechanism.frictions.iter().zip(&mechanism.modes).zip(frictions) {
        found.frictions.push((friction.name.clone(), mode.word(), friction.tangent.is_angle(), force));
    }
    found.outputs = outputs(mechanism, start, &phi, &omega, &kernel);
    found.walls = contacts(mechanism, start, &phi, omega, &kernel);
    found
}

/// Name, unit and value of each of the scene's outputs, after an evaluation.
fn outputs(
    mechanism: &Mechanism,
    start: &Motion,
    phi: &[f64],
    omega: &[f64],
    kernel: &Kernel<f64>,
) -> Vec<(String, String, f64)> {
    let Some(outputs) = &mechanism.outputs else { return Vec::new() };
    let winding: Vec<f64> = (0..phi.len()).map(|k| start.unwrapped(k)).collect();
    let moment = Moment { mechanism, time: start.time, phi, winding: &winding, omega, kernel };
    let mut values = Vec::new();
    outputs.evaluate(&moment, &mut OutputScratch::default(), &[], &mut values);
    if mechanism.hides_forces(kernel) {
        outputs.withhold(&mut values);
    }
    let named = outputs.heads().zip(values);
    named.map(|((name, unit), value)| (name.into(), unit.into(), value)).collect()
}

/// The body a row's force or torque acts on, and the one it comes from.
fn sides(row: &ConstraintEquation) -> [Option<usize>; 2] {
    match (&row.measure, &row.push) {
        (RowMeasure::Angle { body, base }, _) => [Some(*body), *base],
        (_, None) if row.is_in_radians() => {
            let angles = row.aim.as_ref().map_or(&[][..], |aim| &aim.angles);
            [angles.first().copied(), angles.get(1).copied()]
        }
        (_, Some(push)) => [push.on, push.from],
        (_, None) => [None, None],
    }
}

/// The walls one after another, each with the rates that the one before left, as a run meets them.
fn contacts(
    mechanism: &Mechanism,
    start: &Motion,
    phi: &[f64],
    mut omega: Vec<f64>,
    kernel: &Kernel<f64>,
) -> Vec<ReportedContact> {
    let mut contacts = Vec::new();
    for (number, contact) in mechanism.contacts.iter().enumerate() {
        let gap = contact.distance(start.time, phi, &kernel.z);
        let mut jacobian = vec![0.0; phi.len()];
        let at = ConstraintArguments { phi, z: &kernel.z, omega: &omega };
        let drive = contact.row.differentiate(start.time, at, &mut jacobian).drive;
        let approach = crate::dynamics::kernel::dot(&jacobian, &omega) + drive;
        let is_held = mechanism.held.contains(&number);
        let jump = if gap <= TOUCHING * contact.length && approach < 0.0 && !is_held && !contact.is_off {
            mechanism.impact_at(number, start.time, phi, &omega)
        } else {
            None
        };
        let impact = jump.map(|jump| {
            omega.clone_from(&jump.omega);
            let energy_lost = jump.motor_work - jump.energy_change;
            ReportedImpact {
                impulse: jump.impulse,
                energy_lost,
                motor_work: jump.motor_work,
                omega: jump.omega,
            }
        });
        contacts.push(ReportedContact { name: contact.row.name.clone(), gap, approach, impact });
    }
    contacts
}

/// One JSON object of all of them, by their names.
fn by_name<'a, T>(all: impl IntoIterator<Item = T>, entry: impl Fn(T) -> (&'a String, Value)) -> Value {
    let entries = all.into_iter().map(entry).map(|(name, told)| (name.clone(), told));
    Value::Object(entries.collect())
}

impl Reaction {
    /// What a constraint exerts, beside its multiplier, its violation and the rate of that.
    fn object(&self, [multiplier, position, velocity]: [f64; 3]) -> Value {
        let mut told = json!({
            "multiplier": multiplier,
            "position": position,
            "velocity": velocity,
            "unit": self.unit,
            "unit_of_multiplier": self.unit_of_multiplier,
            "on": self.on,
            "from": self.from,
            "determinate": self.is_determinate,
        });
        match (self.torque, self.force) {
            (Some(torque), _) => told["torque"] = json!(torque),
            (None, force) => told["force"] = json!(force),
        }
        told
    }
}

impl Inspection {
    /// The report as one JSON object.
    pub fn object(&self, scene: &Scene) -> Value {
        let bodies = by_name(&self.bodies, |(name, [x, y, phi])| (name, json!({"x": x, "y": y, "phi": phi})));
        let constraints = by_name(self.constraints.iter().zip(&self.reactions), |(constraint, reaction)| {
            (&constraint.0, reaction.object(constraint.1))
        });
        let motors = by_name(&self.motors, |(name, [torque, power])| {
            let reaction = self.reaction(name);
            let told = json!({
                "torque": torque,
                "power": power,
                "unit": reaction.map(|reaction| reaction.unit_of_multiplier),
                "determinate": reaction.and_then(|reaction| reaction.is_determinate),
            });
            (name, told)
        });
        let hinges = by_name(&self.hinges, |hinge| {
            let told = json!({"force": hinge.force, "on": hinge.on, "from": hinge.from,
                "determinate": hinge.is_determinate});
            (&hinge.name, told)
        });
        let walls = by_name(&self.walls, |wall| (&wall.name, self.contact_object(wall)));
        let [kinetic, potential] = self.energy;
        let mut said = json!({
            "scene": scene.name,
            "t": self.t,
            "bodies": bodies,
            "constraints": constraints,
            "motors": motors,
            "hinges": hinges,
            "energy": {"kinetic": kinetic, "potential": potential, "total": kinetic + potential,
                "scale": self.energy_scale},
            "walls": walls,
        });
        if !self.outputs.is_empty() {
            said["outputs"] =
                by_name(&self.outputs, |(name, unit, value)| (name, json!({"value": value, "unit": unit})));
        }
        if !self.frictions.is_empty() {
            said["friction"] = by_name(&self.frictions, |(name, mode, is_torque, [friction, pressing])| {
                let unit = if *is_torque { "N m" } else { "N" };
                let told = json!({"mode": mode, "friction": -friction, "unit": unit, "pressed_by": pressing});
                (name, told)
            });
        }
        said
    }

    /// A wall with its impact, where there is one.
    fn contact_object(&self, wall: &ReportedContact) -> Value {
        let impact = wall.impact.as_ref().map(|impact| {
            let after = self.bodies.iter().zip(&impact.omega);
            json!({
                "impulse": impact.impulse,
                "energy_lost": impact.energy_lost,
                "motor_work": impact.motor_work,
                "omega_after": by_name(after, |((name, _), omega)| (name, json!(omega))),
            })
        });
        json!({"gap": wall.gap, "approach": wall.approach, "impact": impact})
    }
}
