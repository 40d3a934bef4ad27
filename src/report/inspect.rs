//! The start of a scene, looked at closely: accelerations, multipliers, motors, hinge forces, energies, impacts.
//!
//! Signs: a hinge's force is the one of the first body listed in the hinge on the second; a motor's torque acts on the driven body,
//! and its power is what it feeds in; an impulse acts on the wall's point along the normal.

use super::page::{Page, figure};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::kernel::{Bias, Kernel};
use crate::dynamics::row::Posture;
use crate::dynamics::{Mechanism, Motion};
use crate::scene::Scene;
use serde_json::{Map, Value, json};

/// What there is to know of a scene's start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inspection {
    /// Each body with the acceleration of its centre of mass (x, y) \[m/s²\] and of its angle \[rad/s²\].
    pub bodies: Vec<(String, [f64; 3])>,
    /// Each constraint with its multiplier \[N·m or N\], its violation \[rad or m\] and the rate of that \[rad/s or m/s\].
    pub constraints: Vec<(String, [f64; 3])>,
    /// Each motor with its torque \[N·m\] and power \[W\].
    pub motors: Vec<(String, [f64; 2])>,
    /// Each hinge with what it does.
    pub hinges: Vec<HingeForce>,
    /// Kinetic and potential energy \[J\].
    pub energy: [f64; 2],
    /// What energies are divided by in reports \[J\].
    pub energy_scale: f64,
    /// Each wall with what happens there at the start.
    pub walls: Vec<Contact>,
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
}

/// A wall at the start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contact {
    /// Name of the wall.
    pub name: String,
    /// Distance of the point from it \[m\].
    pub gap: f64,
    /// Rate of that \[m/s\].
    pub approach: f64,
    /// The impact, where the point is on the wall and moving into it.
    pub impact: Option<Impact>,
}

/// An impact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Impact {
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
    let phi: Vec<f64> = start.phi.iter().map(|phi| phi.hi).collect();
    let omega: Vec<f64> = start.omega.iter().map(|omega| omega.hi).collect();
    let mut kernel = Kernel::<f64>::new(mechanism);
    kernel.accelerate::<0>(mechanism, start.time, &phi, &omega, Bias::default());
    mechanism.spread_multipliers(&mut kernel);
    let mut found = Inspection { energy_scale: mechanism.energy_scale, ..Inspection::default() };
    let centres = mechanism.centre_accelerations(&kernel.z, &omega, &kernel.load);
    for (k, (body, centre)) in mechanism.bodies.iter().zip(centres).enumerate() {
        found.bodies.push((body.name.clone(), [centre.re, centre.im, kernel.load[k]]));
    }
    for (r, row) in mechanism.rows.iter().enumerate() {
        let here = kernel.rows[r];
        found.constraints.push((row.name().to_owned(), [kernel.multiplier[r], here.position, kernel.row_rate(r, &omega)]));
        if row.law.is_some() {
            let torque = -kernel.multiplier[r];
            found.motors.push((row.name().to_owned(), [torque, -torque * here.drive]));
        }
    }
    let forces = mechanism.hinge_forces(start.time, &kernel, &omega);
    for (joint, force) in mechanism.joints.iter().zip(forces) {
        let [from, on] = joint.between.map(|body| body.map_or("ground", |body| mechanism.bodies[body].name.as_str()).to_owned());
        found.hinges.push(HingeForce { name: joint.name.clone(), force: [force.re, force.im], on, from });
    }
    let energy = mechanism.energy(&mut Kernel::<DoubleDouble>::without_rows(mechanism), &start.phi, &start.omega);
    found.energy = [energy.kinetic.hi, energy.potential.hi];
    found.walls = contacts(mechanism, &start, &phi, omega, &kernel);
    found
}

/// The walls one after another, each with the rates that the one before left, as a run meets them.
fn contacts(mechanism: &Mechanism, start: &Motion, phi: &[f64], mut omega: Vec<f64>, kernel: &Kernel<f64>) -> Vec<Contact> {
    let mut contacts = Vec::new();
    for (number, contact) in mechanism.contacts.iter().enumerate() {
        let gap = contact.row.gap(&kernel.z);
        let mut jacobian = vec![0.0; phi.len()];
        contact.row.differentiate(start.time, Posture { phi, z: &kernel.z, omega: &omega }, &mut jacobian);
        let approach = crate::dynamics::kernel::dot(&jacobian, &omega);
        let jump =
            if gap <= TOUCHING * contact.length && approach < 0.0 { mechanism.strike(number, start.time, phi, &omega) } else { None };
        let impact = jump.map(|jump| {
            omega.clone_from(&jump.omega);
            let energy_lost = jump.motor_work - jump.energy_change;
            Impact { impulse: jump.impulse, energy_lost, motor_work: jump.motor_work, omega: jump.omega }
        });
        contacts.push(Contact { name: contact.row.name.clone(), gap, approach, impact });
    }
    contacts
}

impl Inspection {
    /// The report as one JSON object.
    pub fn object(&self, scene: &Scene) -> Value {
        let bodies: Map<String, Value> =
            self.bodies.iter().map(|(name, [x, y, phi])| (name.clone(), json!({"x": x, "y": y, "phi": phi}))).collect();
        let constraints: Map<String, Value> = (self.constraints.iter())
            .map(|(name, [multiplier, position, velocity])| {
                (name.clone(), json!({"multiplier": multiplier, "position": position, "velocity": velocity}))
            })
            .collect();
        let motors: Map<String, Value> =
            self.motors.iter().map(|(name, [torque, power])| (name.clone(), json!({"torque": torque, "power": power}))).collect();
        let hinges: Map<String, Value> = (self.hinges.iter())
            .map(|hinge| (hinge.name.clone(), json!({"force": hinge.force, "on": hinge.on, "from": hinge.from})))
            .collect();
        let walls: Map<String, Value> = (self.walls.iter())
            .map(|wall| {
                let impact = wall.impact.as_ref().map(|impact| {
                    let after: Map<String, Value> =
                        self.bodies.iter().zip(&impact.omega).map(|((name, _), omega)| (name.clone(), json!(omega))).collect();
                    json!({
                        "impulse": impact.impulse,
                        "energy_lost": impact.energy_lost,
                        "motor_work": impact.motor_work,
                        "omega_after": after,
                    })
                });
                (wall.name.clone(), json!({"gap": wall.gap, "approach": wall.approach, "impact": impact}))
            })
            .collect();
        let [kinetic, potential] = self.energy;
        json!({
            "scene": scene.name,
            "bodies": bodies,
            "constraints": constraints,
            "motors": motors,
            "hinges": hinges,
            "energy": {"kinetic": kinetic, "potential": potential, "total": kinetic + potential, "scale": self.energy_scale},
            "walls": walls,
        })
    }

    /// The report as a page.
    pub fn text(&self, scene: &Scene) -> String {
        let mut page = Page::new(&scene.name, &scene.description);
        let row = |name: &str, values: &[f64]| std::iter::once(name.to_owned()).chain(values.iter().map(|&x| figure(x))).collect();
        let rows: Vec<Vec<String>> = self.bodies.iter().map(|(name, values)| row(name, values)).collect();
        page.entry("accelerations", "of the centres of mass at the start");
        page.table(&["body", "x [m/s²]", "y [m/s²]", "phi [rad/s²]"], &rows);
        if !self.constraints.is_empty() {
            let rows: Vec<Vec<String>> = self.constraints.iter().map(|(name, values)| row(name, values)).collect();
            page.entry("constraints", "");
            page.table(&["name", "multiplier [N m]", "C [rad]", "C' [rad/s]"], &rows);
        }
        if !self.motors.is_empty() {
            let rows: Vec<Vec<String>> = self.motors.iter().map(|(name, values)| row(name, values)).collect();
            page.entry("motors", "");
            page.table(&["name", "torque [N m]", "power [W]"], &rows);
        }
        let rows: Vec<Vec<String>> = (self.hinges.iter())
            .map(|hinge| vec![hinge.name.clone(), figure(hinge.force[0]), figure(hinge.force[1]), hinge.on.clone(), hinge.from.clone()])
            .collect();
        page.entry("hinges", "");
        page.table(&["name", "Fx [N]", "Fy [N]", "on", "from"], &rows);
        let [kinetic, potential] = self.energy;
        page.entry(
            "energy",
            &format!("kinetic {} J, potential {} J, total {} J", figure(kinetic), figure(potential), figure(kinetic + potential)),
        );
        for wall in &self.walls {
            page.entry("wall", &format!("{}: gap {} m, approached at {} m/s", wall.name, figure(wall.gap), figure(-wall.approach)));
            if let Some(impact) = &wall.impact {
                page.entry(
                    "",
                    &format!("struck: impulse {} N s, {} J lost; rates after:", figure(impact.impulse), figure(impact.energy_lost)),
                );
                let rows: Vec<Vec<String>> = self.bodies.iter().zip(&impact.omega).map(|((name, _), &omega)| row(name, &[omega])).collect();
                page.table(&["body", "omega [rad/s]"], &rows);
            }
        }
        page.into_text()
    }
}
