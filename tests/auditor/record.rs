//! The auditor's motion of a scene at its output times, with all that the program reports of it, and how far
//! its start determines it.

use super::double_double::Dd;
use super::model::{Model, State};
use super::motion::Lost;
use super::start::{Start, project};
use super::walls::{ContactDriver, Impact, Stay};

/// One output time.
#[derive(Clone, Debug)]
pub struct Look {
    pub state: State,
    pub acceleration: Vec<Dd>,
    /// Of each joint's equation, and whether redundant ones leave it open.
    pub multipliers: Vec<Dd>,
    pub is_open: Vec<bool>,
    /// Power of each joint's target \[W\].
    pub motor_power: Vec<Dd>,
    pub energy: [Dd; 2],
    pub is_held: bool,
}

/// A motion.
pub struct Record {
    pub model: Model,
    pub looks: Vec<Look>,
    pub impacts: Vec<Impact>,
    pub stays: Vec<Stay>,
    /// Time from which the motion is not unique, and why.
    pub doubt: Option<(f64, String)>,
    /// By how much a small change of the start has grown up to each output time.
    pub growth: Vec<f64>,
    /// What a change of positions comes to in other quantities.
    pub response: Response,
    pub evaluations: u64,
    pub scales: Scales,
}

/// What differences are divided by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Scales {
    /// \[m\]
    pub length: f64,
    /// The fastest rate \[1/s\].
    pub rate: f64,
    /// \[N\]
    pub force: f64,
    /// \[N·m\]
    pub torque: f64,
    /// \[J\]
    pub energy: f64,
    /// \[N·s\]
    pub impulse: f64,
}

/// Of a neighbouring motion, the largest difference of a quantity over its scale, over the largest difference
/// of positions; at least 1.
#[derive(Clone, Copy, Debug)]
pub struct Response {
    pub rate: f64,
    pub force: f64,
    pub energy: f64,
}

/// A change of the start that is followed to see how it grows.
const CHANGE: f64 = 1e-11;

impl Record {
    /// The motion from a start at the times k·every and at the end.
    pub fn new(start: Start, times: &[f64], most_evaluations: u64) -> Result<Self, Lost> {
        let Start { model, state, .. } = start;
        let (looks, contact_driver) = march(&model, state.clone(), times, most_evaluations)?;
        let scales = Scales::of(&model, &looks, &contact_driver.impacts);
        let (impacts, stays, doubt) = (contact_driver.impacts, contact_driver.stays, contact_driver.doubt);
        let mut evaluations = contact_driver.integrator.evaluations;
        let (growth, response) =
            match march(&model, changed(&model, &state, scales)?, times, most_evaluations) {
                Ok((other, contact_driver)) => {
                    evaluations += contact_driver.integrator.evaluations;
                    (growth(&looks, &other, scales), Response::of(&model, &looks, &other, scales))
                }
                // A neighbour that cannot be followed tells that this one is on an edge.
                Err(_) => (vec![f64::INFINITY; looks.len()], Response { rate: 1.0, force: 1.0, energy: 1.0 }),
            };
        Ok(Self { model, looks, impacts, stays, doubt, growth, response, evaluations, scales })
    }
}

fn march<'a>(
    model: &'a Model,
    state: State,
    times: &[f64],
    most: u64,
) -> Result<(Vec<Look>, ContactDriver<'a>), Lost> {
    let mut contact_driver = ContactDriver::new(model, state, most)?;
    let mut looks = vec![look(&contact_driver)];
    for &t in times.iter().filter(|&&t| t > 0.0) {
        contact_driver.go(Dd::from(t))?;
        looks.push(look(&contact_driver));
    }
    if contact_driver.integrator.least_pivot < 1e-18 {
        return Err(Lost("a singular position".into()));
    }
    Ok((looks, contact_driver))
}

fn look(contact_driver: &ContactDriver) -> Look {
    let model = contact_driver.integrator.model;
    let found = model.accelerations(&contact_driver.state, &contact_driver.held);
    Look {
        acceleration: found.solution.x,
        multipliers: found.solution.multipliers,
        is_open: found.solution.is_open,
        motor_power: found.motor_power,
        energy: model.energy(&contact_driver.state),
        is_held: !contact_driver.held.is_empty(),
        state: contact_driver.state.clone(),
    }
}

/// The start with every number a little off, back on its constraints and in front of its walls.
fn changed(model: &Model, state: &State, scales: Scales) -> Result<State, Lost> {
    let mut changed = state.clone();
    for i in 0..state.q.len() {
        // Shares without a pattern.
        let share = |salt: f64| ((i as f64 + 1.0) * salt).sin();
        let unit = if i % 3 == 2 { 1.0 } else { scales.length };
        changed.q[i] += Dd::from(CHANGE * unit * share(12.9898));
        changed.v[i] += Dd::from(CHANGE * unit * scales.rate * share(78.233));
    }
    project(model, &mut changed, &[])?;
    let behind =
        (0..model.scene.walls.len()).any(|wall| model.gap(wall, &changed).off.hi < 1e-9 * scales.length);
    // A start on a wall stays as it is.
    Ok(if behind { state.clone() } else { changed })
}

fn growth(looks: &[Look], other: &[Look], scales: Scales) -> Vec<f64> {
    let mut most: f64 = 1.0;
    let one = |(a, b): (&Look, &Look)| {
        for i in 0..a.state.q.len() {
            let unit = if i % 3 == 2 { 1.0 } else { scales.length };
            let position = (a.state.q[i] - b.state.q[i]).hi.abs() / unit;
            let rate = (a.state.v[i] - b.state.v[i]).hi.abs() / (unit * scales.rate);
            most = most.max(position / CHANGE).max(rate / CHANGE);
        }
        most
    };
    looks.iter().zip(other).map(one).collect()
}

impl Response {
    fn of(model: &Model, looks: &[Look], others: &[Look], scales: Scales) -> Self {
        let mut most = [0.0f64; 4];
        let mut see = |class: usize, a: Dd, b: Dd, scale: f64| {
            let share = (a - b).hi.abs() / scale;
            if share.is_finite() {
                most[class] = most[class].max(share);
            }
        };
        for (a, b) in looks.iter().zip(others) {
            for i in 0..a.state.q.len() {
                let unit = if i % 3 == 2 { 1.0 } else { scales.length };
                see(0, a.state.q[i], b.state.q[i], unit);
                see(1, a.state.v[i], b.state.v[i], unit * scales.rate);
            }
            for (r, joint) in model.scene.joints.iter().enumerate().filter(|_| a.is_held == b.is_held) {
                if !a.is_open[r] {
                    see(
                        2,
                        a.multipliers[r],
                        b.multipliers[r],
                        if joint.is_angle() { scales.torque } else { scales.force },
                    );
                }
            }
            see(3, a.energy[0], b.energy[0], scales.energy);
            see(3, a.energy[1] - looks[0].energy[1], b.energy[1] - others[0].energy[1], scales.energy);
            see(3, a.state.work, b.state.work, scales.energy);
        }
        let over = |class: usize| if most[0] > 0.0 { (most[class] / most[0]).max(1.0) } else { 1.0 };
        Self { rate: over(1), force: over(2), energy: over(3) }
    }
}

impl Scales {
    fn of(model: &Model, looks: &[Look], impacts: &[Impact]) -> Self {
        let (n, length) = (model.scene.bodies.len(), model.scene.size);
        let mut scales = Self { length, rate: 0.1 / model.scene.until, ..Self::default() };
        let total: f64 = model.scene.bodies.iter().map(|body| body.mass.hi).sum();
        let weight = total * model.scene.gravity.length().hi;
        scales.force = weight;
        let first = looks[0].energy[1];
        for look in looks {
            for k in 0..n {
                let [ax, ay, alpha] = [0, 1, 2].map(|i| look.acceleration[3 * k + i].hi);
                let [vx, vy, omega] = [0, 1, 2].map(|i| look.state.v[3 * k + i].hi);
                let (speed, pull) = (vx.hypot(vy), ax.hypot(ay));
                scales.rate = scales
                    .rate
                    .max(omega.abs())
                    .max(speed / length)
                    .max(alpha.abs().sqrt())
                    .max((pull / length).sqrt());
                scales.force = scales.force.max(model.mass[3 * k].hi * pull);
                scales.torque = scales.torque.max(model.mass[3 * k + 2].hi * alpha.abs());
                scales.impulse = scales.impulse.max(model.mass[3 * k].hi * speed);
            }
            for (joint, lambda) in model.scene.joints.iter().zip(&look.multipliers) {
                let most = if joint.is_angle() { &mut scales.torque } else { &mut scales.force };
                *most = most.max(lambda.hi.abs());
            }
            let terms = [look.energy[0], look.energy[1] - first, look.state.work];
            scales.energy = terms.iter().fold(scales.energy, |most, term| most.max(term.hi.abs()));
        }
        scales.torque = scales.torque.max(scales.force * length);
        scales.energy = scales.energy.max(weight * length);
        scales.impulse = impacts.iter().fold(scales.impulse, |most, impact| most.max(impact.impulse));
        // Forces that only rounding makes are measured by those that would move the bodies at such rates.
        scales.force = scales.force.max(1e-3 * total * length * scales.rate * scales.rate);
        scales.torque = scales.torque.max(scales.force * length);
        scales.energy = scales.energy.max(scales.force * length);
        scales.impulse = scales.impulse.max(scales.force / scales.rate);
        scales
    }
}
