//! Walls: impacts by Newton's law, points that come to rest and stay, and their release.
//!
//! A step is halved until a polynomial of degree five through both its ends follows the motion to [`FINE`] of
//! the size; gaps and forces are then looked at at many points of it, and what is found is located by
//! integrating parts of the step anew.
//!
//! ```text
//! M Δv = Gᵀ Λ + Jᵀ ρ + Hᵀ η,   G Δv = 0,   J v⁺ = -e J v⁻,   0 <= η  ⟂  H v⁺ >= 0       H: points that stay on their walls
//! 0 <= λ_c  ⟂  a_c >= 0                                                                  all points that touch and do not move off
//! ```
//!
//! Both complementarities are solved by trying every set.

use super::double_double::Dd;
use super::linear::{self, Row};
use super::model::{Model, State};
use super::motion::{Integrator, Lost};
use super::start::project;

/// How well the polynomial of a step follows the motion, over the size.
const FINE: f64 = 1e-11;
/// Points of a step that are looked at.
const LOOKS: usize = 16;
/// A gap that counts as touching, over the size: events are located far below it.
const TOUCH: f64 = 1e-13;
/// A rebound of this height, over the size, is none: the point stays.
const REST: f64 = 1e-12;
/// An approach \[1/s\] of the size within the horizon below which an impact grazes.
const GRAZE: f64 = 1e-6;
/// Events of a run.
const MOST_EVENTS: usize = 2000;

#[derive(Clone, Debug)]
pub struct Impact {
    pub t: f64,
    pub wall: usize,
    pub impulse: f64,
    pub approach: f64,
    pub energy_lost: f64,
}

#[derive(Clone, Debug)]
pub struct Stay {
    pub t: f64,
    pub wall: usize,
    pub until: Option<f64>,
}

/// A motion on its way through impacts.
pub struct ContactDriver<'a> {
    pub integrator: Integrator<'a>,
    pub state: State,
    pub held: Vec<usize>,
    pub impacts: Vec<Impact>,
    pub stays: Vec<Stay>,
    /// Why the motion is not unique from a time on: grazing impacts, two at once.
    pub doubt: Option<(f64, String)>,
    events: usize,
    /// A step that the polynomial was seen to follow \[s\].
    span: f64,
}

enum Event {
    ImpactRecord(usize),
    Release(usize),
}

impl<'a> ContactDriver<'a> {
    pub fn new(model: &'a Model, state: State, most_evaluations: u64) -> Result<Self, Lost> {
        let mut contact_driver = Self {
            integrator: Integrator::new(model, most_evaluations),
            state,
            held: Vec::new(),
            impacts: Vec::new(),
            stays: Vec::new(),
            doubt: None,
            events: 0,
            span: f64::INFINITY,
        };
        for wall in 0..model.scene.walls.len() {
            let gap = model.gap(wall, &contact_driver.state);
            if gap.off.hi < -1e-12 * model.scene.size {
                return Err(Lost(format!("{} starts behind its wall", model.scene.walls[wall].name)));
            }
        }
        contact_driver.meet(None)?;
        Ok(contact_driver)
    }

    fn model(&self) -> &'a Model {
        self.integrator.model
    }

    /// Goes on to a time.
    pub fn go(&mut self, until: Dd) -> Result<(), Lost> {
        while (until - self.state.t).hi > 0.0 {
            let before = self.state.clone();
            let held = self.held.clone();
            let rest = until - before.t;
            let most = if rest.hi > 1.2 * self.span { Dd::from(self.span) } else { rest };
            let mut after = self.integrator.step(&before, most, &held)?;
            if (until - after.t).hi.abs() <= 1e-28 * until.hi.abs() {
                after.t = until;
            }
            if self.model().scene.walls.is_empty() {
                self.state = after;
                continue;
            }
            match self.first(&before, &after)? {
                None => self.state = after,
                Some((at, event)) => {
                    self.events += 1;
                    if self.events > MOST_EVENTS {
                        return Err(Lost("too many impacts".into()));
                    }
                    self.state = at;
                    match event {
                        Event::ImpactRecord(_) => self.meet(None)?,
                        Event::Release(wall) => self.meet(Some(wall))?,
                    }
                }
            }
        }
        Ok(())
    }

    fn doubts(&mut self, why: String) {
        let t = self.state.t.hi;
        self.doubt.get_or_insert((t, why));
    }

    /// The first event between two states, at its state.
    fn first(&mut self, before: &State, after: &State) -> Result<Option<(State, Event)>, Lost> {
        let held = self.held.clone();
        let step = after.t - before.t;
        let middle = self.integrator.reach(before, before.t + step.scale(0.5), &held)?;
        let arc = self.arc(before, after);
        let size = self.model().scene.size;
        let off = |i: usize, a: Dd, b: Dd| (a - b).hi.abs() / if i % 3 == 2 { 1.0 } else { size };
        let polynomial = arc.at(0.5);
        let worst = (0..before.q.len()).map(|i| off(i, polynomial.q[i], middle.q[i])).fold(0.0, f64::max);
        self.span = step.hi * (0.7 * (FINE / worst.max(1e-30)).powf(1.0 / 6.0)).clamp(0.3, 2.0);
        if worst > FINE {
            let found = self.first(before, &middle)?;
            return if found.is_some() { Ok(found) } else { self.first(&middle, after) };
        }
        let mut first: Option<(f64, Event)> = None;
        for wall in 0..self.model().scene.walls.len() {
            let found = match self.held.iter().position(|&held| held == wall) {
                Some(place) => self.release(&arc, place).map(|s| (s, Event::Release(wall))),
                None => self.crossing(&arc, wall).map(|s| (s, Event::ImpactRecord(wall))),
            };
            if let Some((s, event)) = found
                && first.as_ref().is_none_or(|(earliest, _)| s < *earliest)
            {
                first = Some((s, event));
            }
        }
        let Some((s, event)) = first else { return Ok(None) };
        let mut t = before.t + step.scale(s);
        let mut at = self.integrator.reach(before, t, &held)?;
        if let Event::ImpactRecord(wall) = event {
            // Newton's method on the motion itself, from where the polynomial says.
            for _ in 0..12 {
                let gap = self.model().gap(wall, &at);
                if gap.off.hi.abs() < 1e-24 * size || gap.rate.hi >= 0.0 {
                    break;
                }
                t -= gap.off / gap.rate;
                at = self.integrator.reach(before, t, &held)?;
            }
        }
        Ok(Some((at, event)))
    }

    fn arc(&mut self, before: &State, after: &State) -> Arc {
        let model = self.model();
        let a0 = model.accelerations(before, &self.held).solution.x;
        let a1 = model.accelerations(after, &self.held).solution.x;
        self.integrator.evaluations += 2;
        Arc { before: before.clone(), after: after.clone(), a0, a1 }
    }

    /// Where a gap first becomes negative, as a share of the step.
    fn crossing(&mut self, arc: &Arc, wall: usize) -> Option<f64> {
        let model = self.model();
        let size = model.scene.size;
        let gap = |s: f64| model.gap(wall, &arc.at(s));
        let touches = gap(0.0).off.hi.abs() < TOUCH * size;
        let mut low = 0.0;
        let mut rate = gap(0.0).rate.hi;
        for look in 1..=LOOKS {
            let mut high = look as f64 / LOOKS as f64;
            let here = gap(high);
            let mut is_behind = here.off.hi < 0.0;
            if !is_behind && rate < 0.0 && here.rate.hi > 0.0 {
                // It came nearer and moved off again: the least gap between.
                let (mut from, mut to) = (low, high);
                for _ in 0..60 {
                    let middle = 0.5 * (from + to);
                    if gap(middle).rate.hi < 0.0 { from = middle } else { to = middle }
                }
                let least = gap(from).off.hi;
                if least.abs() < 30.0 * FINE * size && !(touches && low == 0.0) {
                    self.doubt.get_or_insert((
                        arc.before.t.hi,
                        format!("{} is grazed", model.scene.walls[wall].name),
                    ));
                }
                if least < 0.0 {
                    (is_behind, high) = (true, from);
                }
            }
            if is_behind {
                // From where it is still in front.
                let mut from = if low == 0.0 && touches { high } else { low };
                while from == high || gap(from).off.hi < 0.0 {
                    from *= 0.5;
                    if from < 1e-18 {
                        return Some(0.0);
                    }
                    if from > low && gap(from).off.hi < 0.0 {
                        high = from;
                    }
                }
                for _ in 0..60 {
                    let middle = 0.5 * (from + high);
                    if gap(middle).off.hi < 0.0 { high = middle } else { from = middle }
                }
                return Some(high);
            }
            (low, rate) = (high, here.rate.hi);
        }
        None
    }

    /// Where the force of a held point first becomes negative.
    fn release(&mut self, arc: &Arc, place: usize) -> Option<f64> {
        let model = self.model();
        let joints = model.scene.joints.len();
        let held = self.held.clone();
        let force = |s: f64| model.accelerations(&arc.at(s), &held).solution.multipliers[joints + place].hi;
        self.integrator.evaluations += LOOKS as u64;
        let mut low = 0.0;
        for look in 1..=LOOKS {
            let mut high = look as f64 / LOOKS as f64;
            if force(high) < 0.0 {
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    if force(middle) < 0.0 { high = middle } else { low = middle }
                }
                self.integrator.evaluations += 50;
                return Some(high);
            }
            low = high;
        }
        None
    }

    /// Lets impacts happen, then decides which points stay; `released` goes in any case.
    fn meet(&mut self, released: Option<usize>) -> Result<(), Lost> {
        let model = self.model();
        let size = model.scene.size;
        let touching: Vec<usize> = (0..model.scene.walls.len())
            .filter(|wall| {
                self.held.contains(wall) || model.gap(*wall, &self.state).off.hi.abs() < TOUCH * size
            })
            .collect();
        for round in 0..100 {
            let moving = |wall: usize| model.gap(wall, &self.state).rate;
            // An impact leaves rounding of its own.
            let least = 1e-22 * (size + self.state.v.iter().fold(0.0, |most: f64, v| most.max(v.hi.abs())));
            let striking: Vec<usize> = touching
                .iter()
                .copied()
                .filter(|wall| !self.held.contains(wall) && moving(*wall).hi < -least)
                .collect();
            let Some(&wall) = striking.first() else { break };
            if striking.len() > 1 || round > 0 {
                self.doubts("two points strike at once".into());
            }
            self.impact_at(wall)?;
        }
        self.settle(&touching, released)
    }

    fn impact_at(&mut self, wall: usize) -> Result<(), Lost> {
        let model = self.model();
        let gap = model.gap(wall, &self.state);
        if -gap.rate.hi * model.scene.until < GRAZE * model.scene.size {
            // Rest after chatter ends here too; only what comes from afar is in doubt.
            let bounced = self.impacts.iter().any(|impact| impact.wall == wall);
            if !bounced {
                self.doubts("an impact grazes".into());
            }
        }
        let restitution = model.scene.walls[wall].restitution;
        let equations = model.equations(&self.state);
        let joints = equations.len();
        let zero = vec![Dd::ZERO; model.mass.len()];
        for set in subsets(&self.held) {
            let mut rows: Vec<Row> = equations.iter().map(|equation| equation.row.clone()).collect();
            let mut right = vec![Dd::ZERO; joints];
            rows.push(gap.row.clone());
            right.push(-(gap.rate + restitution * gap.rate));
            for &held in &set {
                rows.push(model.gap(held, &self.state).row);
                right.push(Dd::ZERO);
            }
            let jump = linear::solve(&model.mass, &rows, &zero, &right);
            let reached = linear::row_times(&gap.row, &jump.x);
            // No freedom is left for the point to rebound with.
            if jump.is_open[joints] || (reached - right[joints]).hi.abs() > 1e-15 * gap.rate.hi.abs() {
                continue;
            }
            let small = 1e-20 * jump.multipliers[joints].hi.abs();
            let presses = jump.multipliers[joints + 1..].iter().all(|eta| eta.hi >= -small);
            let leaves = self.held.iter().filter(|held| !set.contains(held));
            let opens = { leaves }.all(|&held| {
                linear::row_times(&model.gap(held, &self.state).row, &jump.x).hi >= -1e-20 * gap.rate.hi.abs()
            });
            if !presses || !opens {
                continue;
            }
            let [before, _] = model.energy(&self.state);
            let (t, impulse) = (self.state.t.hi, jump.multipliers[joints].hi);
            let drives = model.targets.iter().zip(&jump.multipliers);
            let motor_work =
                drives.fold(Dd::ZERO, |sum, (law, &lambda)| sum + law.at(self.state.t)[1] * lambda);
            self.state.v.iter_mut().zip(&jump.x).for_each(|(v, &dv)| *v += dv);
            self.state.work += motor_work;
            let [after, _] = model.energy(&self.state);
            let energy_lost = (before - after + motor_work).hi;
            self.impacts.push(Impact { t, wall, impulse, approach: gap.rate.hi, energy_lost });
            let let_go: Vec<usize> = self.held.iter().copied().filter(|held| !set.contains(held)).collect();
            self.hold(set);
            debug_assert!(let_go.iter().all(|wall| !self.held.contains(wall)));
            return Ok(());
        }
        Err(Lost("no set of contacts leaves a point the freedom to rebound".into()))
    }

    /// Decides which touching points stay on their walls.
    fn settle(&mut self, touching: &[usize], released: Option<usize>) -> Result<(), Lost> {
        let model = self.model();
        let joints = model.scene.joints.len();
        let mut candidates = Vec::new();
        for &wall in touching.iter().filter(|wall| Some(**wall) != released) {
            let others: Vec<usize> = self.held.iter().copied().filter(|&held| held != wall).collect();
            let gap = model.gap(wall, &self.state);
            let free = model.accelerations(&self.state, &others).solution;
            let inward = -(linear::row_times(&gap.row, &free.x) + gap.bend).hi;
            let rate = gap.rate.hi;
            if self.held.contains(&wall)
                || rate.abs() < 1e-22
                || (inward > 0.0 && rate * rate < 2.0 * inward * REST * model.scene.size)
            {
                candidates.push(wall);
            }
        }
        for set in subsets(&candidates) {
            let found = model.accelerations(&self.state, &set).solution;
            if found.is_open[joints..].contains(&true) {
                continue;
            }
            let scale = found.multipliers.iter().fold(1e-300, |most: f64, lambda| most.max(lambda.hi.abs()));
            let presses = found.multipliers[joints..].iter().all(|lambda| lambda.hi > 1e-18 * scale);
            let opens = candidates.iter().filter(|wall| !set.contains(wall)).all(|&wall| {
                let gap = model.gap(wall, &self.state);
                (linear::row_times(&gap.row, &found.x) + gap.bend).hi
                    >= -1e-15 * (found.x.iter().fold(0.0, |most: f64, a| most.max(a.hi.abs())))
            });
            if presses && opens {
                self.hold(set.clone());
                return project(model, &mut self.state, &set);
            }
        }
        Err(Lost("no set of contacts holds".into()))
    }

    fn hold(&mut self, set: Vec<usize>) {
        let t = self.state.t.hi;
        for stay in self.stays.iter_mut().filter(|stay| stay.until.is_none() && !set.contains(&stay.wall)) {
            stay.until = Some(t);
        }
        for &wall in set.iter().filter(|wall| !self.held.contains(wall)) {
            self.stays.push(Stay { t, wall, until: None });
        }
        self.held = set;
        self.held.sort_unstable();
    }
}

/// All subsets, the largest first.
fn subsets(of: &[usize]) -> Vec<Vec<usize>> {
    let mut all: Vec<Vec<usize>> = (0..1usize << of.len())
        .map(|bits| {
            of.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, &wall)| wall).collect()
        })
        .collect();
    all.sort_by_key(|set| std::cmp::Reverse(set.len()));
    all
}

/// A polynomial of degree five through positions, rates and accelerations at both ends of a step.
struct Arc {
    before: State,
    after: State,
    a0: Vec<Dd>,
    a1: Vec<Dd>,
}

impl Arc {
    /// The state at a share of the step.
    fn at(&self, s: f64) -> State {
        let step = self.after.t - self.before.t;
        let (x, n) = (Dd::from(s), self.before.q.len());
        let mut state = self.before.clone();
        state.t = self.before.t + step * x;
        let inverse = Dd::ONE / step;
        for i in 0..n {
            let (p0, v0, c) =
                (self.before.q[i], self.before.v[i] * step, (self.a0[i] * step * step).scale(0.5));
            let (p1, v1, a1) = (self.after.q[i], self.after.v[i] * step, self.a1[i] * step * step);
            // What the three higher coefficients must bring about at the end.
            let (d, dv, da) = (p1 - p0 - v0 - c, v1 - v0 - c.scale(2.0), a1 - c.scale(2.0));
            let cubic = d.scale(10.0) - dv.scale(4.0) + da.scale(0.5);
            let quartic = -d.scale(15.0) + dv.scale(7.0) - da;
            let quintic = d.scale(6.0) - dv.scale(3.0) + da.scale(0.5);
            state.q[i] = p0 + x * (v0 + x * (c + x * (cubic + x * (quartic + x * quintic))));
            let rate = v0
                + x * (c.scale(2.0)
                    + x * (cubic.scale(3.0) + x * (quartic.scale(4.0) + x * quintic.scale(5.0))));
            state.v[i] = rate * inverse;
        }
        state
    }
}
