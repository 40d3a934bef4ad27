//! One point of a sweep, or several integrated in lanes.

use super::ensemble::{Ensemble, form_in_lanes};
use super::judge::{Judge, PointTrust};
use super::lane::Lane;
use super::watching::Watching;
use super::{Sweep, timed};
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::sum::larger;
use crate::dynamics::kernel::Kernel;
use crate::dynamics::{Mechanism, Motion};
use crate::run::extremes::Extremes;
use crate::run::flip::Flip;
use crate::run::methods::{MethodId, Stabilization};
use crate::run::plan::{Plan, Request};
use crate::run::running::{Run, Running};
use crate::run::trust::Level;
use crate::scene::{Scene, StartValue};
use crate::stepping::StepError;
use crate::stepping::taylor::batch::{Batch, BatchMember, Going};
use std::ops::Range;
use std::sync::Arc;

/// What became of a point.
#[derive(Clone, Debug, PartialEq)]
pub enum Status {
    /// It came to its end.
    Done,
    /// The method stopped on the way, or a limit was exceeded.
    Stopped(StepError),
    /// With these values there is no scene, or no plan; the reason in one line.
    Refused(String),
    /// It was to be left out.
    Skipped,
}

/// One point of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepPoint {
    /// Its number in the grid.
    pub index: u64,
    /// What was varied, in the units of the scene, slowest first.
    pub values: Vec<f64>,
    /// By how much each of these is another at the start, as the constraints do not let it be as varied.
    pub displaced: Vec<f64>,
    /// What became of it.
    pub status: Status,
    /// The time reached \[s\].
    pub t: f64,
    /// Winding angles then \[rad\]; none where it never began.
    pub phi: Vec<f64>,
    /// Rates then \[rad/s\].
    pub omega: Vec<f64>,
    /// Centres of mass then \[m\] and their velocities \[m/s\], where bodies are free or slide.
    pub centres: Vec<[[f64; 2]; 2]>,
    /// Largest drift of energy, or energy minus work, over the energy scale.
    pub energy: f64,
    /// Largest violation of any constraint, at position \[rad or m\] and velocity level \[rad/s or m/s\],
    /// where there are any.
    pub constraint: Option<[f64; 2]>,
    /// Steps taken.
    pub steps: u64,
    /// The first time the angle of any bar, driven ones included, passed an odd multiple of π.
    pub flip: Option<Flip>,
    /// How far it may be trusted, where that was asked for.
    pub trust: Option<PointTrust>,
    /// Least and largest value, mean and rms of each of the scene's outputs.
    pub extremes: Vec<[f64; 4]>,
}

/// A point ready to run.
pub(super) struct Ready {
    pub point: SweepPoint,
    pub mechanism: Arc<Mechanism>,
    pub plan: Plan,
    pub start: Motion,
    /// What its energies are divided by \[J\].
    pub scale: f64,
}

impl Ready {
    /// Its trajectory, which may take so many times the evaluations planned.
    pub fn member(&self, times: u64) -> BatchMember<'_> {
        let state = form_in_lanes(Arc::clone(&self.mechanism)).state(&self.start);
        let mut member = BatchMember::new(&self.mechanism, state);
        member.statistics.max_evaluations = self.plan.max_evaluations.saturating_mul(times);
        member
    }
}

impl Sweep {
    /// Runs one point; the same as in a whole sweep.
    pub fn point(&self, index: u64) -> Option<SweepPoint> {
        if index < self.grid.count() {
            self.integrate(index..index + 1, &|| (), &|| false).pop()
        } else {
            None
        }
    }

    /// The scene, the equations and the plan of a point, with about so many `rows`; steps and tolerances are
    /// those of the sweep.
    ///
    /// # Errors
    /// With its values there is no scene, or no plan: the reason.
    pub fn run_of(&self, index: u64, rows: f64) -> Result<(Scene, Arc<Mechanism>, Plan), String> {
        let values = self.grid.values(index);
        let scene = self.template.filled(&self.variables, &values).map_err(|error| error.to_string())?;
        let mechanism = Arc::new(Mechanism::of_sound(&scene, Vec::new()).map_err(|error| error.to_string())?);
        let planned = |request: &Request| self.planned(&scene, &mechanism, request);
        let plan = planned(&timed(&self.request, &scene))?;
        let (every, method) = (Some(plan.until / rows), Some(plan.method));
        let plan = planned(&Request { every, method, step: plan.step, ..self.request.clone() })?;
        Ok((scene, mechanism, plan))
    }

    /// Runs points; tells of each that is `finished`, and gives up where all `is_over`.
    pub(super) fn integrate(
        &self,
        points: Range<u64>,
        finished: &dyn Fn(),
        is_over: &dyn Fn() -> bool,
    ) -> Vec<SweepPoint> {
        let mut found = Vec::with_capacity((points.end - points.start) as usize);
        let mut in_lanes = Vec::new();
        for index in points {
            if is_over() {
                return found;
            }
            match self.prepare(index) {
                Ok(ready) if self.takes(&ready) => in_lanes.push(ready),
                other => {
                    found.push(other.map_or_else(|point| *point, |ready| self.single(ready, is_over)));
                    finished();
                }
            }
        }
        found.extend(self.batch(in_lanes, finished, is_over));
        found.sort_by_key(|point| point.index);
        found
    }

    /// True for a point that can be integrated beside others.
    fn takes(&self, ready: &Ready) -> bool {
        let alike = (ready.plan.until, ready.plan.rows) == (self.plan.until, self.plan.rows);
        alike
            && self.trust != Level::Full
            && ready.plan.method == MethodId::Taylor
            && !ready.plan.extended
            && match ready.plan.stabilization {
                Stabilization::None => !ready.mechanism.has_multipliers(),
                // The rows are kept, so that limits on them are not looked at.
                Stabilization::Projection => {
                    ready.mechanism.has_multipliers() && self.limits.constraint.is_none()
                }
                Stabilization::Elimination => true,
                Stabilization::Baumgarte => false,
            }
            && self.has_lanes_for(&ready.mechanism)
    }

    /// Puts the values in; a point that cannot run is finished.
    fn prepare(&self, index: u64) -> Result<Ready, Box<SweepPoint>> {
        let values = self.grid.values(index);
        let mut point = SweepPoint {
            index,
            displaced: vec![0.0; values.len()],
            values,
            status: Status::Done,
            t: 0.0,
            phi: Vec::new(),
            omega: Vec::new(),
            centres: Vec::new(),
            energy: 0.0,
            constraint: None,
            steps: 0,
            flip: None,
            trust: None,
            extremes: Vec::new(),
        };
        if self.skips.as_ref().is_some_and(|skips| skips(&point.values)) {
            point.status = Status::Skipped;
            return Err(Box::new(point));
        }
        match self.filled(&point.values) {
            Ok((mechanism, plan, start, scale)) => {
                for change in &mechanism.assembly.changes {
                    let path = change.path();
                    let varied = self.variables.iter().position(|variable| variable.path == path);
                    if let Some(k) = varied {
                        point.displaced[k] = change.used - change.given;
                    }
                }
                Ok(Ready { point, mechanism, plan, start, scale })
            }
            Err(reason) => {
                point.status = Status::Refused(reason.lines().next().unwrap_or_default().to_owned());
                Err(Box::new(point))
            }
        }
    }

    /// The plan of a point: where the method chosen for all does not suit it, that of a run alone.
    fn planned(&self, scene: &Scene, mechanism: &Mechanism, request: &Request) -> Result<Plan, String> {
        let alone = |refusal| match self.is_chosen {
            true => {
                Plan::new(scene, mechanism, &Request { method: None, ..request.clone() }).map_err(|_| refusal)
            }
            false => Err(refusal),
        };
        Plan::new(scene, mechanism, request).or_else(alone).map_err(|refusal| refusal.to_string())
    }

    /// Mechanism, plan, start and energy scale at these values; else why not.
    fn filled(&self, values: &[f64]) -> Result<(Arc<Mechanism>, Plan, Motion, f64), String> {
        let in_range = |(value, variable): (&f64, &crate::scene::Variable)| match variable.start {
            Some((_, StartValue::Phi)) => crate::scene::is_start_angle(*value),
            Some((_, StartValue::Omega)) => crate::scene::is_start_rate(*value),
            None => false,
        };
        // What is out of range is left to the reader, which can say why.
        if self.shares && values.iter().zip(&self.variables).all(in_range) {
            let mut scene = self.scene.clone();
            for (variable, &value) in self.variables.iter().zip(values) {
                match variable.start {
                    Some((bar, StartValue::Phi)) => scene.start[bar].phi = value,
                    Some((bar, StartValue::Omega)) => scene.start[bar].omega = value,
                    None => {}
                }
            }
            let start = self.mechanism.start(&scene);
            let scale = self.mechanism.scale_of_energy(&start);
            // An adaptive plan does not look at the start.
            let plan = if self.plan.method.is_adaptive() {
                self.plan.clone()
            } else {
                self.planned(&scene, &self.mechanism, &timed(&self.request, &scene))?
            };
            return Ok((Arc::clone(&self.mechanism), plan, start, scale));
        }
        let scene = self.template.filled(&self.variables, values).map_err(|error| error.to_string())?;
        let mechanism = Arc::new(Mechanism::of_sound(&scene, Vec::new()).map_err(|error| error.to_string())?);
        if let (true, Some(change)) = (self.is_strict, mechanism.assembly.changes.first()) {
            return Err(change.to_string());
        }
        let plan = self.planned(&scene, &mechanism, &timed(&self.request, &scene))?;
        let (start, scale) = (mechanism.start(&scene), mechanism.energy_scale);
        Ok((mechanism, plan, start, scale))
    }

    /// Runs a point as a single run would; one that is given up is not worth a look.
    fn single(&self, ready: Ready, is_over: &dyn Fn() -> bool) -> SweepPoint {
        let Ready { mut point, mechanism, plan, start, scale } = ready;
        let mechanism = if scale == mechanism.energy_scale {
            mechanism
        } else {
            Arc::new(Mechanism { energy_scale: scale, ..(*mechanism).clone() })
        };
        let mut running = match Run::new(Arc::clone(&mechanism), plan, self.limits, &start) {
            Ok(run) => Running::new(run.of_ensemble(self.ends_at_flips).trusted(self.trust, &start)),
            Err(stop) => {
                point.status = Status::Stopped(stop);
                return point;
            }
        };
        let outcome = running.go(&mut |_| Ok(()), &mut || is_over()).map(|_| running.finish());
        match outcome {
            Ok(outcome) => {
                let levels = outcome
                    .drift
                    .constraints
                    .iter()
                    .map(|(_, [position, velocity])| [position.max, velocity.max]);
                if mechanism.has_translations() {
                    let centres = outcome.last.centre.iter().zip(&outcome.last.velocity);
                    point.centres = centres.map(|(&centre, &velocity)| [centre, velocity]).collect();
                }
                point.t = outcome.last.t;
                point.phi = outcome.last.phi;
                point.omega = outcome.last.omega;
                point.energy = outcome.drift.energy.max;
                point.constraint = levels.reduce(|a, b| [larger(a[0], b[0]), larger(a[1], b[1])]);
                point.steps = outcome.statistics.steps;
                point.flip = outcome.flip;
                point.trust = outcome.trust.as_ref().map(PointTrust::from);
                point.extremes = outcome.extremes.iter().map(Extremes::figures).collect();
                point.status = outcome.stop.map_or(Status::Done, Status::Stopped);
            }
            Err(error) => point.status = Status::Refused(error.to_string()),
        }
        point
    }

    /// Runs points beside each other, a lane each.
    fn batch(&self, ready: Vec<Ready>, finished: &dyn Fn(), is_over: &dyn Fn() -> bool) -> Vec<SweepPoint> {
        let Some(first) = ready.first() else { return Vec::new() };
        let (plan, bodies) = (first.plan.clone(), first.mechanism.own_bodies().len());
        let batch = Batch::new(plan.tolerance.unwrap_or_default());
        let mut kernel = Kernel::<DoubleDouble>::without_rows(&first.mechanism);
        let mut lanes: Vec<Lane> = Vec::with_capacity(ready.len());
        let mut members: Vec<BatchMember> = Vec::with_capacity(ready.len());
        for ready in &ready {
            members.push(ready.member(1));
            let reference = ready.mechanism.energy(&mut kernel, &ready.start.phi, &ready.start.omega).total();
            lanes.push(Lane::new(ready, reference));
        }
        let watching = ready.iter().map(|ready| Watching::of(&ready.mechanism, &plan)).collect();
        let mut ensemble = Ensemble::new(batch, &plan, watching);
        let mut judge = (self.trust != Level::Off).then(|| Judge::new(&ready, &plan));
        let mut found = Vec::with_capacity(ready.len());
        let mut motion = Motion::default();
        for row in 1..=plan.rows {
            ensemble.integrate(0, &mut members, plan.time(row), &mut |lane, passage| {
                let lane = &mut lanes[lane];
                if lane.point.flip.is_none() {
                    lane.look(bodies, passage);
                }
                if (self.ends_at_flips && lane.point.flip.is_some()) || is_over() {
                    Going::Enough
                } else {
                    Going::On
                }
            });
            if is_over() {
                return found;
            }
            if let Some(judge) = &mut judge {
                judge.integrate(&members, plan.time(row));
            }
            let mut number = 0;
            while number < lanes.len() {
                let (lane, member) = (&mut lanes[number], &members[number]);
                let has_flipped = self.ends_at_flips && lane.point.flip.is_some();
                let over = row == plan.rows || has_flipped || ensemble.has_ended(number);
                let moved = ensemble.energy_of_impacts(number);
                let limit = self.limits.energy;
                if lane.measure(member, moved, &mut motion, &mut kernel, limit, &plan) && !over {
                    number += 1;
                    continue;
                }
                let mut point = lanes.swap_remove(number).point;
                point.trust = judge.as_mut().map(|judge| judge.remove(number));
                point.extremes = ensemble.extremes(number);
                let mechanism = members[number].mechanism;
                if mechanism.has_translations() {
                    // Of winding angles rounding leaves too little.
                    let [phi, omega] = motion.rounded();
                    point.centres = mechanism.centres(&phi, &omega);
                }
                found.push(point);
                members.swap_remove(number);
                ensemble.swap_remove(number);
                finished();
            }
            if lanes.is_empty() {
                break;
            }
        }
        found
    }
}
