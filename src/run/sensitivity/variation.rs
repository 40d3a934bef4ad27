//! Small differences beside a motion: of its start and of the numbers of its scene.
//!
//! ```text
//! dq' = dw,    dw' = A_q dq + A_w dw + a_p dp
//!     a(t, q, w; p) with the multipliers in it, all coordinates (index 1)
//! G dq + C_p dp = 0,  (G w + C_t)' (dq, dw) + C'_p dp = 0        kept after every step
//! ```
//!
//! The columns (dq, dw) are integrated on the steps of the motion itself, inside which its dense output is
//! known (module `collocation`); A_q and A_w are evaluated on dual numbers, what a number p does at a state
//! is told by its neighbours (module `neighbours`), what an impact or an event does by the saltation matrix
//! ([`saltation`](crate::run::saltation)).  Driven angles are coordinates like all others here: their rows
//! give them what the law's own numbers do.
//!
//! Source: M. Géradin, A. Cardona, *Flexible Multibody Dynamics* (2001), chapter 12; E. Hairer, S. P.
//! Nørsett, G. Wanner, *Solving Ordinary Differential Equations I*, section I.14 (variational equation,
//! parameters).

use super::super::contact::{ContactDriver, JumpLog};
use super::super::observer::{Observer, ObserverAdapter, Step};
use super::super::trust::Ground;
use super::collocation::{Collocation, ColumnLimits, STAGES};
use super::crossing::SetNumbers;
use super::expanded::{self, Expansions};
use super::fractional;
use super::lyapunov::Dissipation;
use super::neighbours::{Neighbour, Neighbours, residuals};
use crate::dynamics::jacobian::Jacobian;
use crate::dynamics::kernel::Bias;
use crate::dynamics::{Mechanism, Motion, State, Time};
use crate::run::driver::Pause;
use crate::run::running::Outcome;
use crate::run::saltation::set_by_events;
use crate::stepping::StepError;
use std::ops::ControlFlow;
use std::sync::Arc;

/// The last Legendre coefficient over what is integrated, at most: the error is about its power 12/5.
pub(super) const LIMIT: f64 = 3e-6;
/// Steps of this share of that of the motion are too short to go on with.
const SHORTEST: f64 = 1e-6;
/// Coordinates up to which the equations of all stages are solved at once.
pub(super) const MOST_COORDINATES: usize = 64;

/// Columns beside a motion.
pub(in crate::run) struct Variation {
    /// The mechanism with the contacts held at the moment.
    pub mechanism: Arc<Mechanism>,
    /// All coordinates, then all rates, for every column.
    pub columns: Vec<Vec<f64>>,
    /// The numbers that columns are of, where they are named.
    pub names: Vec<String>,
    /// What moves each column beside the motion.
    pub neighbours: Vec<Option<Neighbours>>,
    /// Parameters that events set.
    pub set: SetNumbers,
    /// The mechanism as compiled.
    pub(super) compiled: Arc<Mechanism>,
    /// Motors and locks that engaged on the way, by row.
    pub(super) engaged: Vec<usize>,
    /// Places with friction that stick, and are open beside the motion.
    pub(super) loose: Vec<usize>,
    /// Whether several walls were met at once.
    pub met_several: bool,
    /// The series of the columns, where they have such.
    pub(super) expanded: Option<Expansions>,
    /// Impacts so far.
    pub impacts: Vec<CrossingTime>,
    /// Times \[s\] at which rates have jumped, with their derivatives, column by column.
    pub jumped: Vec<(f64, Vec<f64>)>,
    jacobian: Jacobian,
    pub ground: Option<Ground>,
    pub jumps: JumpLog,
    /// When columns were taken through something last, and how much later \[s\] each comes to it.
    pub(super) moment: Option<(Time, Vec<f64>)>,
    pub(super) method: Collocation,
    pub(super) pull: Vec<f64>,
    pub(super) forcing: Vec<Vec<f64>>,
    pub(super) now: f64,
    /// The longest step \[s\].
    reach: f64,
    /// Parts that do not act at the moment.
    pub off: Vec<String>,
    /// Steps of the columns, steps tried, and how many may be.
    pub steps: u64,
    pub tried: u64,
    pub most: u64,
    /// What steps next to the zeros of fractional powers leave, over the rates of a column.
    pub(super) rough: f64,
    /// Why they go no further.
    pub lost: Option<String>,
    /// What forces that depend on rates, and impacts, take off volumes, where somebody asks.
    pub dissipation: Option<Dissipation>,
}

/// How the time of an impact moves with every column.
#[derive(Clone, Debug)]
pub(in crate::run) struct CrossingTime {
    pub wall: String,
    pub t: f64,
    pub slopes: Vec<f64>,
}

/// Sees a variation and its motion.
pub(in crate::run) trait Look {
    /// Times \[s\] at which it wants to see them, rising; those at which it was are not named again.
    fn next(&self) -> Option<f64>;

    /// At such a time.
    fn at(&mut self, variation: &mut Variation, motion: &Motion, time: f64);

    /// Behind an impact, an event or a transition, of which [`Look::at`] shows the near side.
    fn crossed(&mut self, _variation: &mut Variation, _motion: &Motion, _time: f64) {}

    /// At the end of every step.
    fn stepped(&mut self, _variation: &mut Variation, _motion: &Motion, _time: f64) {}
}

impl Variation {
    /// Columns beside the motion of a mechanism with the contacts held at the start.
    ///
    /// # Errors
    /// Why there are none.
    pub fn new(
        mechanism: &Arc<Mechanism>,
        columns: Vec<Vec<f64>>,
        mut neighbours: Vec<Option<Neighbours>>,
    ) -> Result<Self, String> {
        if mechanism.vibration.is_some() {
            return Err("the mean force of a rigid spring's vibration is not followed".into());
        }
        let n = mechanism.coordinates();
        if n > MOST_COORDINATES {
            return Err(format!("there are {n} coordinates, and at most {MOST_COORDINATES} are followed"));
        }
        let forcing = vec![Vec::new(); columns.len()];
        let off = mechanism.whole.as_ref().map(|(_, off)| off.clone()).unwrap_or_default();
        for neighbours in neighbours.iter_mut().flatten() {
            neighbours.follow(mechanism, &off, &[])?;
        }
        let numbers = set_by_events(mechanism);
        let is_set = vec![false; numbers.len()];
        let mut variation = Self {
            set: SetNumbers { numbers, is_set, slopes: Vec::new() },
            compiled: Arc::clone(mechanism),
            engaged: Vec::new(),
            loose: Vec::new(),
            met_several: false,
            jacobian: Jacobian::new(mechanism),
            ground: None,
            mechanism: Arc::clone(mechanism),
            columns,
            names: Vec::new(),
            neighbours,
            expanded: None,
            impacts: Vec::new(),
            jumped: Vec::new(),
            jumps: JumpLog::with_switches(),
            moment: None,
            method: Collocation::new(mechanism.rotors().collect()),
            pull: Vec::new(),
            forcing,
            now: 0.0,
            reach: f64::INFINITY,
            off,
            steps: 0,
            tried: 0,
            most: u64::MAX,
            rough: 0.0,
            lost: None,
            dissipation: None,
        };
        variation.hold(mechanism);
        Ok(variation)
    }

    /// Takes the columns through what happened at the start itself, and puts them onto the constraints there.
    pub fn begin(&mut self, motion: &Motion) {
        self.now = motion.time.hi;
        self.catch_up();
        self.keep(motion);
    }

    /// Takes columns that span all directions tangent to the constraints at a motion, without an order, and
    /// returns the degrees of freedom.
    pub fn span(&mut self, motion: &Motion) -> usize {
        let n = self.mechanism.coordinates();
        let rows = self.ground.as_mut().map_or(0, |ground| {
            let (time, phi, omega) = plain(motion);
            ground.stand(&self.mechanism, &State { time, y: [phi, omega].concat(), ..State::default() })
        });
        let freedom = n.saturating_sub(rows);
        // Numbers of no particular kind: any others span the same.
        let entry = |i: usize, j: usize| libm::sin(1.0 + 1.7 * i as f64 + 2.9 * j as f64 + (i * j) as f64);
        self.columns = (0..2 * freedom).map(|j| (0..2 * n).map(|i| entry(i, j)).collect()).collect();
        self.neighbours = vec![None; 2 * freedom];
        self.forcing = vec![Vec::new(); 2 * freedom];
        self.keep(motion);
        freedom
    }

    /// Keeps the first so many columns.
    pub fn keep_columns(&mut self, count: usize) {
        self.columns.truncate(count);
        self.neighbours.truncate(count);
        self.forcing.truncate(count);
    }

    /// Adds columns that nothing moves but the motion, for which there is room.
    #[cfg(feature = "fit")]
    pub fn add(&mut self, columns: &[Vec<f64>]) {
        self.columns.extend_from_slice(columns);
        self.neighbours.resize(self.columns.len(), None);
        self.forcing.resize(self.columns.len(), Vec::new());
    }

    /// Goes on beside this mechanism.
    pub fn hold(&mut self, mechanism: &Arc<Mechanism>) {
        self.jacobian = Jacobian::new(mechanism);
        if let Some(dissipation) = &mut self.dissipation {
            dissipation.hold(mechanism);
        }
        self.ground = (!mechanism.constraints.is_empty()).then(|| Ground::new(mechanism));
        if let Some(ground) = &mut self.ground {
            ground.engaged.clone_from(&self.engaged);
        }
        self.mechanism = Arc::clone(mechanism);
    }

    /// Integrates beside a driver up to `until` \[s\], looked at on the way.
    ///
    /// # Errors
    /// The motion itself stops.
    pub fn go(
        &mut self,
        driver: &mut ContactDriver,
        until: f64,
        outcome: &mut Outcome,
        look: &mut dyn Look,
        pause: &mut Pause,
    ) -> Result<bool, StepError> {
        driver.jumps = Some(self.jumps.clone());
        let mut beside = VariationObserver { variation: self, look, until };
        let mut adapter = ObserverAdapter { observer: &mut beside, has_enough: false };
        let is_through = driver.go_watched(Time::from(until), outcome, None, Some(&mut adapter), pause)?;
        // What happens at the end itself has no step behind it.
        if self.catch_up() && self.lost.is_none() {
            let motion = driver.motion();
            look.crossed(self, &motion, motion.time.hi);
        }
        Ok(is_through)
    }

    /// To a time inside a step; false where that is not possible.
    fn advance(&mut self, step: &mut Step, to: f64) -> bool {
        while self.now < to {
            if self.tried >= self.most {
                self.lose("small differences take too many steps");
                return false;
            }
            self.tried += 1;
            let left = to - self.now;
            let pieces = (left / self.reach).ceil().max(1.0);
            let h = left / pieces;
            let (now, columns) = (self.now, &mut self.columns);
            let tail = self.expanded.as_mut().map(|expanded| expanded.advance(step, now, h, columns));
            let (tail, limit, order) = match tail.filter(|tail| *tail != expanded::NEAR_SINGULAR) {
                Some(tail) => (tail, expanded::LIMIT, expanded::ORDER),
                None => (self.collocated(step, h), LIMIT, STAGES - 1),
            };
            // No step asks for more than four times its length.
            let growth = match tail <= limit && pieces == 1.0 && self.reach >= 4.0 * h {
                true => 4.0,
                false => 0.9 * libm::pow(limit / tail.max(f64::MIN_POSITIVE), 1.0 / order as f64),
            };
            if tail <= limit {
                self.steps += 1;
                if let Some(dissipation) = &mut self.dissipation {
                    dissipation.add(&self.mechanism, step, (now, h), &self.method);
                }
                self.now = if pieces == 1.0 { to } else { self.now + h };
                let next = h * growth.min(4.0);
                self.reach = if pieces == 1.0 { next.max(self.reach) } else { next };
                continue;
            }
            self.reach = h * if growth.is_finite() { growth.clamp(0.1, 0.8) } else { 0.1 };
            if self.reach < SHORTEST * (step.end() - step.begin()) || !self.reach.is_finite() {
                self.lose("small differences change too fast to be followed");
                return false;
            }
        }
        true
    }

    /// A step by collocation, and its last Legendre coefficient.
    fn collocated(&mut self, step: &mut Step, h: f64) -> f64 {
        self.look_at_nodes(step, h);
        let unit = self.mechanism.units.time;
        let Self { method, pull, columns, forcing, neighbours, .. } = self;
        let limit = |neighbours: &Option<Neighbours>| {
            let of = |&Neighbours { floor, noise, .. }: &Neighbours| ColumnLimits { floor, noise };
            neighbours.as_ref().map(of).unwrap_or_default()
        };
        let limits: Vec<ColumnLimits> = neighbours.iter().map(limit).collect();
        let Some(tails) = method.solve((h, unit), pull, columns, (forcing, &limits)) else { return f64::NAN };
        if tails.rough > fractional::RESOLVED
            && let Some(tail) = self.fractional_step(step, h, (&limits, tails))
        {
            return tail;
        }
        if tails.last <= LIMIT {
            self.method.take(h, &mut self.columns);
        }
        tails.last
    }

    /// Jacobians and forcing at the nodes of a step.
    fn look_at_nodes(&mut self, step: &mut Step, h: f64) {
        let n = self.mechanism.coordinates();
        self.pull.clear();
        self.neighbours.iter_mut().flatten().for_each(|neighbours| neighbours.noise = 0.0);
        let forcing = self.forcing.iter_mut();
        forcing.zip(&self.neighbours).for_each(|(forcing, neighbours)| {
            let acts = neighbours.as_ref().is_some_and(|neighbours| !neighbours.levels.is_empty());
            forcing.clear();
            forcing.resize(if acts { STAGES * n } else { 0 }, 0.0);
        });
        for (i, node) in self.method.nodes.iter().enumerate() {
            let motion = step.at(self.now + node * h);
            let (t, phi, omega) = plain(motion);
            self.jacobian.evaluate(&self.mechanism, t, &phi, &omega, Bias::default());
            self.pull.extend_from_slice(&self.jacobian.acceleration);
            if let Some(expanded) = &mut self.expanded {
                expanded.force(motion, &mut self.forcing, i * n);
                continue;
            }
            for (forcing, neighbours) in self.forcing.iter_mut().zip(&mut self.neighbours) {
                let of = |neighbour: &mut Neighbour| neighbour.accelerations(t, &phi, &omega).to_vec();
                if let Some(moved) = neighbours.as_mut().and_then(|neighbours| neighbours.derivative(of)) {
                    forcing[i * n..(i + 1) * n].copy_from_slice(&moved);
                }
            }
        }
    }

    /// Puts the columns onto the constraints, which the numbers move too.
    pub fn keep(&mut self, motion: &Motion) {
        if let Some(expanded) = &mut self.expanded {
            return expanded.keep(&self.mechanism, &mut self.ground, motion, &mut self.columns);
        }
        let Self { mechanism, ground: Some(ground), columns, neighbours, .. } = self else { return };
        let (t, phi, omega) = plain(motion);
        let state = State { time: t, y: [&phi[..], &omega[..]].concat(), ..State::default() };
        ground.stand(mechanism, &state);
        let rows = mechanism.constraints.len();
        for (column, neighbours) in columns.iter_mut().zip(neighbours) {
            let of = |neighbour: &mut Neighbour| {
                let (positions, rates) = residuals(&neighbour.mechanism, t, &phi, &omega);
                [positions, rates].concat()
            };
            let moved = neighbours.as_mut().and_then(|neighbours| neighbours.derivative(of));
            let moved = moved.unwrap_or_else(|| vec![0.0; 2 * rows]);
            ground.keep_moved(mechanism, &state, column, [&moved[..rows], &moved[rows..]]);
        }
    }

    /// They go no further than the present time.
    pub fn lose(&mut self, why: &str) {
        self.lost.get_or_insert_with(|| format!("{why}, at t = {} s", self.now));
    }

    /// Takes what happened since the last step; true where anything did.
    fn catch_up(&mut self) -> bool {
        let jumps = self.jumps.take();
        for jumps in jumps.chunk_by(|one, other| one.before.time == other.before.time) {
            if self.lost.is_none()
                && let Err(why) = self.cross(jumps)
            {
                self.lose(&why);
            }
        }
        !jumps.is_empty()
    }
}

/// Time, coordinates and rates in plain doubles.
pub(super) fn plain(motion: &Motion) -> (Time, Vec<f64>, Vec<f64>) {
    let [phi, omega] = motion.rounded();
    (motion.time, phi, omega)
}

/// A variation as an observer of its motion.
struct VariationObserver<'a, 'b> {
    variation: &'a mut Variation,
    look: &'b mut dyn Look,
    until: f64,
}

impl Observer for VariationObserver<'_, '_> {
    fn step(&mut self, step: &mut Step) -> ControlFlow<()> {
        let Self { variation, look, until } = self;
        let has_crossed = variation.catch_up();
        let (begin, end) = (step.begin(), step.end().min(*until));
        variation.now = begin;
        if has_crossed && variation.lost.is_none() {
            look.crossed(variation, step.at(begin), begin);
        }
        let passage = variation.singular_passage(step, end);
        let last = passage.map_or(end, |(time, _)| time);
        while let Some(time) = look.next().filter(|&time| time <= last) {
            if variation.lost.is_some() || !variation.advance(step, time) {
                return ControlFlow::Break(());
            }
            let motion = step.at(time);
            variation.keep(motion);
            variation.watch_loose(motion);
            if variation.lost.is_none() {
                look.at(variation, motion, time);
            }
        }
        if let Some(passage) = passage {
            variation.lose_at_passage(passage);
        }
        if variation.lost.is_some() || !variation.advance(step, end) {
            return ControlFlow::Break(());
        }
        let motion = step.at(end);
        variation.keep(motion);
        variation.watch_loose(motion);
        look.stepped(variation, motion, end);
        ControlFlow::Continue(())
    }
}
