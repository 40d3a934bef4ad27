//! The program's motion against the auditor's.
//!
//! A disagreement is a difference beyond ten times the error that the run claims, or 1e-6 of the quantity's
//! scale, whichever is larger, that the run does not report itself by a stop, a note of doubt, or a trust
//! horizon before it.

use super::reader::Measure;
use super::record::{Look, Record};
use driftless::dynamics::kernel::{Bias, Kernel};
use driftless::dynamics::{Mechanism, Time};
use driftless::run::trust::Level;
use driftless::run::{Limits, Outcome, Plan, Request, Run, RunError, Sample, integrate};
use driftless::scene::parse_scene;
use std::fmt;
use std::sync::Arc;

/// What a difference may be where the run claims less.
const ALLOWED: f64 = 1e-6;
/// How many times the claimed error a difference may be.
const CLAIMED: f64 = 10.0;
/// The same of the imbalance of energy and work that it reports, which is measured and not estimated.
const MEASURED: f64 = 1.2;
/// Growth of a change of the start beyond which the auditor's own rounding would be seen.
const MOST_GROWTH: f64 = 1e8;

/// A run of the program.
pub struct Ran {
    pub mechanism: Arc<Mechanism>,
    pub samples: Vec<Sample>,
    pub outcome: Outcome,
    /// At each sample, the force of each hinge or weld, of its first body on its second, and the multiplier
    /// of each row.
    pub forces: Vec<(Vec<[f64; 2]>, Vec<f64>)>,
}

/// Runs a scene by the library.
pub fn run(text: &str, request: &Request) -> Result<Ran, String> {
    let scene = parse_scene(text, "audit", &[]).map_err(|error| format!("reader: {error}"))?;
    let mechanism = Arc::new(Mechanism::new(&scene).map_err(|error| format!("compiler: {error}"))?);
    let plan = Plan::new(&scene, &mechanism, request).map_err(|refusal| format!("plan: {refusal}"))?;
    let start = mechanism.start(&scene);
    let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start)
        .map_err(|error| format!("start: {error}"))?;
    let mut samples = Vec::new();
    let outcome = integrate(run.trusted(Level::Full, &start), &mut |sample| {
        samples.push(sample.clone());
        Ok(())
    });
    let outcome = outcome.map_err(|error: RunError| format!("run: {error}"))?;
    let mut kernel = Kernel::<f64>::new(&mechanism);
    let forces = samples.iter().map(|sample| {
        kernel.accelerations(&mechanism, Time::from(sample.t), &sample.phi, &sample.omega, Bias::default());
        let found = mechanism.joint_forces(Time::from(sample.t), &kernel, &sample.phi, &sample.omega);
        (found.hinges.iter().map(|force| [force.re, force.im]).collect(), found.multipliers)
    });
    let forces = forces.collect();
    Ok(Ran { samples, forces, outcome, mechanism })
}

/// What came of a comparison.
#[derive(Clone, Debug)]
pub enum Verdict {
    /// All within what is allowed; the largest share of it.
    Agrees(f64),
    /// The run reports of itself that it is not to be relied on: how.
    Reported(String),
    /// Nothing can be said: why.
    Unclear(String),
    Differs(Vec<Difference>),
}

/// One quantity that differs.
#[derive(Clone, Debug)]
pub struct Difference {
    pub what: String,
    pub t: f64,
    pub run: f64,
    pub auditor: f64,
    /// Over the quantity's scale.
    pub error: f64,
    pub allowed: f64,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { what, t, run, auditor, error, allowed } = self;
        write!(
            f,
            "{what} at t = {t}: run {run:.12e}, auditor {auditor:.12e}, {error:.1e} of its scale, allowed {allowed:.1e}"
        )
    }
}

/// Collects differences of one pair.
struct Judge<'a> {
    record: &'a Record,
    ran: &'a Ran,
    allowed: f64,
    /// What the run claims for positions, and for rates over their scale.
    claimed: f64,
    claimed_rate: f64,
    worst: f64,
    found: Vec<Difference>,
}

/// Compares a run with the auditor's motion.
pub fn compare(record: &Record, ran: &Ran) -> Verdict {
    let Outcome { stop, trust, drift, .. } = &ran.outcome;
    let claimed = trust.as_ref().and_then(|trust| trust.error_estimate);
    let horizon = trust.as_ref().and_then(|trust| trust.horizon).unwrap_or(f64::INFINITY);
    let error = claimed.unwrap_or(0.0);
    let error = error.max(looseness(record) / CLAIMED);
    let claimed_rate = trust.as_ref().and_then(|trust| trust.rate_error).unwrap_or(0.0) / record.scales.rate;
    let mut judge = Judge {
        record,
        ran,
        allowed: ALLOWED.max(CLAIMED * error),
        claimed: error,
        claimed_rate,
        worst: 0.0,
        found: Vec::new(),
    };
    let doubt = record.doubt.as_ref().map_or(f64::INFINITY, |(t, _)| *t);
    let chaos = record
        .looks
        .iter()
        .zip(&record.growth)
        .find(|(_, growth)| **growth > MOST_GROWTH)
        .map_or(f64::INFINITY, |(look, _)| look.state.t.hi);
    let until = doubt.min(chaos).min(horizon);
    let mut compared = 0;
    for (sample, (forces, multipliers)) in ran.samples.iter().zip(&ran.forces) {
        let Some(look) =
            record.looks.iter().find(|look| (look.state.t.hi - sample.t).abs() < 1e-12 * (1.0 + sample.t))
        else {
            continue;
        };
        if sample.t >= until || stop.as_ref().is_some_and(|stop| sample.t >= stop.t) {
            break;
        }
        judge.moment(look, sample);
        if !look.is_held && !judge.is_at_impact(sample.t) && looseness(record) == 0.0 {
            judge.forces(look, sample, forces, multipliers);
        }
        compared += 1;
    }
    let reached = ran.samples.last().map_or(0.0, |sample| sample.t).min(until);
    judge.impacts(reached);
    if let Some(stop) = stop {
        return Verdict::Reported(format!("{:?}", stop.cause));
    }
    if judge.found.is_empty() {
        return match compared {
            0 | 1 if until.is_finite() => {
                let why = record
                    .doubt
                    .as_ref()
                    .filter(|_| doubt == until)
                    .map_or("the motion is too sensitive", |(_, why)| why);
                Verdict::Unclear(why.into())
            }
            _ => Verdict::Agrees(judge.worst),
        };
    }
    if drift.is_doubtful() {
        return Verdict::Reported("a note of doubt".into());
    }
    if claimed.is_none()
        && horizon.is_infinite()
        && judge.found.iter().all(|difference| difference.error < 1e-2)
    {
        return Verdict::Reported("no estimate".into());
    }
    judge.found.sort_by(|a, b| (b.error / b.allowed).total_cmp(&(a.error / a.allowed)));
    Verdict::Differs(judge.found)
}

/// What a rod in the place of a very stiff spring may differ from the spring, which is what the auditor
/// moves: some periods of its vibration.
fn looseness(record: &Record) -> f64 {
    let rigid =
        record.model.scene.springs.iter().filter(|spring| spring.is_rigid).map(|spring| spring.stiffness.hi);
    let softest = rigid.fold(f64::INFINITY, f64::min);
    let mass: f64 = record.model.scene.bodies.iter().map(|body| body.mass.hi).sum();
    if softest.is_finite() {
        30.0 * std::f64::consts::TAU * (mass / softest).sqrt() * record.scales.rate
    } else {
        0.0
    }
}

impl Judge<'_> {
    /// Compares a number, over its scale.
    fn number(&mut self, what: impl Fn() -> String, t: f64, run: f64, auditor: f64, scale: f64) {
        self.within(what, t, [run, auditor], scale, self.allowed);
    }

    /// The same for a quantity that differs so many times as much as positions do, and as rates do where
    /// those are claimed to be worse.
    fn response(&mut self, what: impl Fn() -> String, t: f64, pair: [f64; 2], scale: f64, response: f64) {
        let claimed = self.claimed.max(self.claimed_rate / self.record.response.rate);
        self.within(what, t, pair, scale, self.allowed.max(CLAIMED * claimed * response));
    }

    fn within(
        &mut self,
        what: impl Fn() -> String,
        t: f64,
        [run, auditor]: [f64; 2],
        scale: f64,
        allowed: f64,
    ) {
        let error = (run - auditor).abs() / scale;
        self.worst = self.worst.max(error / allowed);
        if error.is_nan() || error > allowed {
            self.found.push(Difference { what: what(), t, run, auditor, error, allowed });
        }
    }

    /// True where an impact happened at about that time, so that rates on either side of it are right.
    fn is_at_impact(&self, t: f64) -> bool {
        let near = self.allowed.max(1e-9) * 100.0 / self.record.scales.rate;
        t > 0.0 && self.record.impacts.iter().any(|impact| (impact.t - t).abs() < near)
    }

    fn moment(&mut self, look: &Look, sample: &Sample) {
        let (model, scales, response, t) =
            (&self.record.model, self.record.scales, self.record.response, sample.t);
        let (first, first_sample) = (&self.record.looks[0], &self.ran.samples[0]);
        let at_impact = self.is_at_impact(t);
        for (k, body) in model.scene.bodies.iter().enumerate() {
            let name = |what: &str| format!("{what} of {}", body.name);
            let [x, y, phi] = [0, 1, 2].map(|i| look.state.q[3 * k + i].hi);
            let [vx, vy, omega] = [0, 1, 2].map(|i| look.state.v[3 * k + i].hi);
            // Angles beyond 1e9 rad have no more digits than this.
            self.number(|| name("phi"), t, sample.phi[k], phi, 1.0 + 1e-9 * phi.abs());
            self.number(|| name("x"), t, sample.centre[k][0], x, scales.length);
            self.number(|| name("y"), t, sample.centre[k][1], y, scales.length);
            if !at_impact {
                self.response(|| name("omega"), t, [sample.omega[k], omega], scales.rate, response.rate);
                self.response(
                    || name("vx"),
                    t,
                    [sample.velocity[k][0], vx],
                    scales.rate * scales.length,
                    response.rate,
                );
                self.response(
                    || name("vy"),
                    t,
                    [sample.velocity[k][1], vy],
                    scales.rate * scales.length,
                    response.rate,
                );
            }
        }
        if !at_impact {
            self.response(
                || "kinetic energy".into(),
                t,
                [sample.kinetic, look.energy[0].hi],
                scales.energy,
                response.energy,
            );
            let potential = (look.energy[1] - first.energy[1]).hi;
            let gained = sample.potential - first_sample.potential;
            self.response(
                || "potential energy".into(),
                t,
                [gained, potential],
                scales.energy,
                response.energy,
            );
            // No estimate covers the work: what a run claims of it is its tolerance, and the imbalance of
            // energy and work that it reports.
            let Outcome { plan, drift, .. } = &self.ran.outcome;
            let tolerance = plan.tolerance.map_or(0.0, |tolerance| tolerance.relative);
            let reported = drift.energy.max * self.ran.mechanism.energy_scale / scales.energy;
            let rough = ((CLAIMED * tolerance).max(MEASURED * reported) / self.allowed).max(1.0);
            self.response(
                || "work".into(),
                t,
                [sample.work, look.state.work.hi],
                rough * scales.energy,
                response.energy,
            );
        }
    }

    fn forces(&mut self, look: &Look, sample: &Sample, hinges: &[[f64; 2]], multipliers: &[f64]) {
        let (record, ran, scales, t) = (self.record, self.ran, self.record.scales, sample.t);
        let response = record.response.force;
        for (joint, force) in ran.mechanism.joints.iter().zip(hinges) {
            for (axis, letter) in ["x", "y"].iter().enumerate() {
                let name = format!("{}.{letter}", joint.name);
                let Some(place) = record.model.scene.joints.iter().position(|own| own.name == name) else {
                    continue;
                };
                if !look.is_open[place] {
                    // The equation's multiplier acts on the first body, the force reported on the second.
                    self.response(
                        || format!("force of {name}"),
                        t,
                        [force[axis], -look.multipliers[place].hi],
                        scales.force,
                        response,
                    );
                }
            }
        }
        for (r, row) in ran.mechanism.constraints.iter().enumerate() {
            let own = record
                .model
                .scene
                .joints
                .iter()
                .position(|own| own.name == row.name() && !matches!(own.kind, "hinge"));
            let Some((place, joint)) = own.map(|place| (place, &record.model.scene.joints[place])) else {
                continue;
            };
            if look.is_open[place] || (joint.kind == "weld" && !joint.is_angle()) {
                continue;
            }
            // Torques are those on the body; where the ground comes in its place, on the other.
            let sign = if let Measure::Angle { body: None, .. } = joint.measure { -1.0 } else { 1.0 };
            let (force, scale) = (
                sign * look.multipliers[place].hi,
                if joint.is_angle() { scales.torque } else { scales.force },
            );
            self.response(
                || format!("force or torque of {}", joint.name),
                t,
                [-multipliers[r], force],
                scale,
                response,
            );
            if joint.kind.ends_with("motor") {
                self.response(
                    || format!("torque of {}", joint.name),
                    t,
                    [sample.motors[r][0], force],
                    scale,
                    response,
                );
                let power = look.motor_power[place].hi;
                let speed = if joint.is_angle() { scales.rate } else { scales.rate * scales.length };
                self.response(
                    || format!("power of {}", joint.name),
                    t,
                    [sample.motors[r][1], power],
                    scale * speed,
                    response,
                );
            }
        }
    }

    /// Impacts up to a time, each against one of the other's at the same wall: in their order, or by their
    /// times, whichever fits better.  In a chatter they follow each other more closely than either tells
    /// their times.
    fn impacts(&mut self, until: f64) {
        let before = self.worst;
        let [by_order, by_time] = [Self::by_order, Self::by_time].map(|pair| {
            self.worst = before;
            let partners = pair(self);
            let others = std::mem::take(&mut self.found);
            self.compare_impacts(until, &partners);
            (std::mem::replace(&mut self.found, others), self.worst)
        });
        let (found, worst) = if by_order.0.len() <= by_time.0.len() { by_order } else { by_time };
        self.found.extend(found);
        self.worst = worst;
    }

    /// True of an impact of the run at the wall of one of the auditor's.
    fn is_same_wall(&self, own: usize, strike: usize) -> bool {
        let (record, strikes) = (self.record, &self.ran.outcome.impacts);
        strikes[strike].wall == record.model.scene.walls[record.impacts[own].wall].name
    }

    /// The run's impact for each of the auditor's: the first at a wall for the first there.
    fn by_order(&self) -> Vec<Option<usize>> {
        let (impacts, strikes) = (&self.record.impacts, &self.ran.outcome.impacts);
        let place = |own: usize| (0..own).filter(|&other| impacts[other].wall == impacts[own].wall).count();
        (0..impacts.len())
            .map(|own| (0..strikes.len()).filter(|&strike| self.is_same_wall(own, strike)).nth(place(own)))
            .collect()
    }

    /// The same with the nearest in time, hard impacts first.
    fn by_time(&self) -> Vec<Option<usize>> {
        let (impacts, strikes) = (&self.record.impacts, &self.ran.outcome.impacts);
        let (mut is_taken, mut partners) = (vec![false; strikes.len()], vec![None; impacts.len()]);
        let (hard, soft): (Vec<usize>, Vec<usize>) =
            (0..impacts.len()).partition(|&own| -impacts[own].approach > self.least_approach());
        for own in hard.into_iter().chain(soft) {
            let free =
                (0..strikes.len()).filter(|&strike| !is_taken[strike] && self.is_same_wall(own, strike));
            let away = |strike: &usize| (strikes[*strike].t - impacts[own].t).abs();
            partners[own] = free.min_by(|a, b| away(a).total_cmp(&away(b)));
            partners[own].into_iter().for_each(|strike| is_taken[strike] = true);
        }
        partners
    }

    /// The last ones of a chatter are cut off by either in its own way \[m/s\].
    fn least_approach(&self) -> f64 {
        let fastest = 1e-4 * self.record.scales.rate * self.record.scales.length;
        1e-3 * self.record.impacts.iter().fold(fastest, |most: f64, impact| most.max(-impact.approach))
    }

    /// Compares impacts that are partners; neither may have one by itself, unless so near the end that the
    /// other's may come after it.
    fn compare_impacts(&mut self, until: f64, partners: &[Option<usize>]) {
        let (record, ran, scales) = (self.record, self.ran, self.record.scales);
        let (least, unit) =
            (self.least_approach(), |approach: f64| 1.0 / scales.rate + scales.length / approach.abs());
        let is_due = |t: f64, approach: f64, allowed: f64| t < until - allowed * unit(approach);
        for (own, partner) in record.impacts.iter().zip(partners) {
            if -own.approach <= least || !is_due(own.t, own.approach, self.allowed) {
                continue;
            }
            let wall = &record.model.scene.walls[own.wall].name;
            let Some(strike) = partner.map(|strike| &ran.outcome.impacts[strike]) else {
                self.number(|| format!("impact at {wall}"), own.t, f64::NAN, own.t, 1.0);
                continue;
            };
            self.number(|| format!("time of impact at {wall}"), own.t, strike.t, own.t, unit(own.approach));
            let (response, speed) = (record.response.rate, scales.rate * scales.length);
            self.response(
                || format!("impulse at {wall}"),
                own.t,
                [strike.impulse, own.impulse],
                scales.impulse,
                response,
            );
            self.response(
                || format!("approach at {wall}"),
                own.t,
                [strike.approach, own.approach],
                speed,
                response,
            );
            self.response(
                || format!("energy lost at {wall}"),
                own.t,
                [strike.energy_lost, own.energy_lost],
                scales.energy,
                response,
            );
        }
        for (i, strike) in ran.outcome.impacts.iter().enumerate() {
            if !partners.contains(&Some(i))
                && -strike.approach > 2.0 * least
                && is_due(strike.t, strike.approach, self.allowed)
            {
                self.number(
                    || format!("impact at {} that is none", strike.wall),
                    strike.t,
                    strike.t,
                    f64::NAN,
                    1.0,
                );
            }
        }
    }
}
