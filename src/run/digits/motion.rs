//! The state of a run in many digits, and its steps by power series.
//!
//! ```text
//! u(t+h) = u + Σ w_m h^(m+1)/(m+1),  w(t+h) = Σ w_m h^m,
//!     h = (tolerance / |w_k|)^(1/k), least over the last five powers k
//! ```
//!
//! So are those of the gaps of walls.
//!
//! The series is that of all methods ([`Series`]), over numbers of `W` limbs; the m-th power is kept to as
//! many limbs as it weighs.  A step's length is a double, so that time is a sum of such and exact, and output
//! times are read off the steps.  Angles are not wrapped: turns cost no digits worth the name.  Rows that are
//! not eliminated are put back by Newton's iteration after every step (module `keep`), walls located by it
//! (module `wall`), and so are events (module `events`) and the corners of formulas (module `branches`): a
//! step ends where one of them changes the equations.

use super::branches::BranchConditions;
use super::confirm::{Probe, confirmed};
use super::events::EventWatch;
use super::friction::{self, Turn};
use super::functions::Functions;
use super::precision::Precision;
use super::projection::DigitsProjection;
use super::resting::Hold;
use super::transitions;
use super::wall::{self, Ends};
use crate::arithmetic::digits::{Digits, TimeScale};
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::Coordinates;
use crate::dynamics::compile::exact::{Acting, ExactMechanism, ExactStart};
use crate::dynamics::constraint::ConstraintEquation;
use crate::dynamics::friction::Transition;
use crate::dynamics::friction::paradox::{HINT, JAMMED, JAMS};
use crate::dynamics::series::Series;
use crate::stepping::{Cause, StepError};

/// log2 of the factor by which a step may be longer than the one before.
const SLACK: f64 = 0.25;
/// The finest step over the time, where laws do not ask for less.
const FINEST: f64 = 1e-13;
/// Changes of what is held at one moment, beyond four a wall.
const ROUNDS: usize = 16;

/// Where a run is, with all that its next step depends on.
#[derive(Clone, Debug)]
pub struct LongState<const W: usize> {
    /// Time \[s\].
    pub t: Digits<W>,
    /// Independent coordinates \[rad, m\], not wrapped.
    pub u: Vec<Digits<W>>,
    /// Their rates \[rad/s, m/s\].
    pub rate: Vec<Digits<W>>,
    /// Work of motors, dampers and applied forces since t = 0 \[J\].
    pub work: Digits<W>,
    /// Energy that impacts, corners of potentials and events have put in since t = 0 \[J\].
    pub jump_energy: Digits<W>,
    /// Steps made.
    pub steps: u64,
    /// Impacts passed.
    pub impacts: u64,
    /// log2 of the radius of convergence of the last step's series \[s\], as far as its last powers tell;
    /// `None` before there is one.
    pub radius: Option<f64>,
    /// What acts.
    pub acting: Acting<Digits<W>>,
    /// Times that points stayed on their walls.
    pub holds: Vec<Hold<W>>,
    /// Energy lost in dry friction since t = 0, which the work has as well \[J\].
    pub lost: Digits<W>,
    /// Transitions of places with friction.
    pub turns: Vec<Turn<W>>,
    /// False until it is known what places with friction do at the start.
    pub is_decided: bool,
}

/// A mechanism in motion.
pub struct DigitsMotion<const W: usize> {
    pub(super) mechanism: ExactMechanism<Digits<W>>,
    pub(super) precision: Precision,
    pub(super) coordinates: Coordinates,
    pub(super) series: Series<Digits<W>>,
    pub(super) state: LongState<W>,
    pub(super) projection: DigitsProjection<W>,
    /// What confirms steps, where laws need it.
    pub(super) probe: Option<Probe<W>>,
    /// Watches for events.
    pub(super) watch: EventWatch<W>,
    /// The branches of formulas.
    pub(super) branches: BranchConditions<W>,
    /// Powers of the gaps of walls that may be met; none of the others.
    pub(super) gaps: Vec<Vec<Digits<W>>>,
    /// The step the series is to make, where it is that of the state: its length \[s\], and what it ends with
    /// at a wall.
    step: Option<(Digits<W>, Option<Ends>)>,
    /// The radius its series has: see [`LongState`].
    radius: Option<f64>,
    /// Limbs that each power is kept to.
    pub(super) kept: Vec<usize>,
    /// Steps may be as long at most \[s\].
    longest: f64,
    pub(super) zeros: Vec<Digits<W>>,
}

impl<const W: usize> DigitsMotion<W> {
    /// At its start.
    ///
    /// # Errors
    /// The start cannot be brought onto the constraints.
    pub fn new(
        mechanism: ExactMechanism<Digits<W>>,
        start: ExactStart<Digits<W>>,
        precision: Precision,
        until: f64,
    ) -> Result<Self, StepError> {
        let coordinates = coordinates_of(&mechanism);
        let mut series = Series::of_terms(&mechanism.terms(), coordinates, precision.order);
        let kept = precision.kept();
        series.keep(kept.clone());
        series.resolve_reversals(precision.rounding(friction::SURE));
        let projection = DigitsProjection::new(&mechanism, precision);
        let f = series.coordinates();
        let cut = |x: Digits<W>| x.shortened(precision.limbs);
        let mut motion = Self {
            zeros: vec![Digits::ZERO; f],
            coordinates,
            series,
            projection,
            probe: Probe::of(&mechanism, coordinates),
            watch: EventWatch::new(&mechanism, precision.order),
            branches: BranchConditions::new(Functions::new(&mechanism.conditions, precision.order)),
            gaps: Vec::new(),
            step: None,
            radius: None,
            longest: until,
            kept,
            precision,
            state: LongState {
                t: Digits::ZERO.shortened(precision.limbs),
                u: Vec::new(),
                rate: Vec::new(),
                work: Digits::ZERO,
                jump_energy: Digits::ZERO,
                steps: 0,
                impacts: 0,
                radius: None,
                acting: mechanism.acting.clone(),
                holds: Vec::new(),
                lost: Digits::ZERO,
                turns: Vec::new(),
                is_decided: mechanism.frictions.is_empty(),
            },
            mechanism,
        };
        let (mut phi, mut omega): (Vec<_>, Vec<_>) =
            start.phi.iter().map(|&x| cut(x)).zip(start.omega.iter().map(|&x| cut(x))).unzip();
        if coordinates == Coordinates::All {
            motion.projection.assemble(&motion.mechanism, [&mut phi, &mut omega], &start.given)?;
        }
        let (u, rate) = motion.independent(&phi, &omega, &start.given);
        (motion.state.u, motion.state.rate) = (u, rate);
        Ok(motion)
    }

    /// The state at a time inside the step that is next.
    pub(super) fn state_at(&self, t: Digits<W>) -> LongState<W> {
        let (u, rate, [work, lost]) = self.evaluate(t - self.state.t);
        let (work, lost) = (self.state.work + work, self.state.lost + lost);
        LongState { t, u, rate, work, lost, ..self.state.clone() }
    }

    /// Another motion of the same mechanism at the same state.
    pub(super) fn beside(&self) -> Self {
        Self {
            mechanism: self.mechanism.clone(),
            series: self.series.clone(),
            state: self.state.clone(),
            projection: self.projection.clone(),
            probe: self.probe.clone(),
            watch: self.watch.clone(),
            branches: self.branches.clone(),
            zeros: self.zeros.clone(),
            kept: self.kept.clone(),
            gaps: Vec::new(),
            step: None,
            ..*self
        }
    }

    /// Puts the state onto the constraints.
    pub(super) fn settle(&mut self) -> Result<(), StepError> {
        if self.coordinates == Coordinates::All && !self.mechanism.constraints.is_empty() {
            let LongState { t, u, rate, .. } = &mut self.state;
            self.projection.project(&self.mechanism, *t, u, rate)?;
        }
        Ok(())
    }

    /// Goes on from a state of this motion; false where it is none.
    pub fn resume(&mut self, state: LongState<W>) -> bool {
        let is_known = state.acting == self.mechanism.acting || {
            let fits = |acting: &Acting<Digits<W>>| {
                (acting.parameters.len(), acting.modes.len(), acting.shifts.len(), acting.sliding.len())
            };
            let walls = self.mechanism.walls.len();
            fits(&state.acting) == fits(&self.mechanism.acting)
                && state.acting.held.iter().all(|&wall| wall < walls)
                && state.acting.held.is_sorted_by(|a, b| a < b)
                && self.exchange(&state.acting).is_ok()
        };
        let is_known = is_known && state.u.len() == self.zeros.len();
        self.state = state;
        self.step = None;
        is_known
    }

    /// True for a wall that lets its point pass.
    pub(super) fn is_off(&self, wall: &ConstraintEquation<Digits<W>>) -> bool {
        self.state.acting.off.contains(&wall.name)
    }

    /// The state at the last step's end.
    pub fn state(&self) -> &LongState<W> {
        &self.state
    }

    /// Makes steps until the one that holds `until`, or an event that ends the run, is the next; pauses after
    /// a step where `pause` is true.  True where it is there.
    ///
    /// # Errors
    /// The series is not finite, or steps become too small.
    pub fn reach(&mut self, until: Digits<W>, pause: &mut dyn FnMut() -> bool) -> Result<bool, StepError> {
        loop {
            let (step, ends) = self.ready()?;
            if until <= self.state.t + step || self.end().is_some() {
                return Ok(true);
            }
            let change = self.watch.change(&self.mechanism);
            self.watched(EventWatch::pass);
            self.advance(step)?;
            match ends {
                Some(Ends::Met(wall)) => wall::impact(self, wall)?,
                Some(Ends::Let(wall)) => self.let_go(&[wall])?,
                Some(Ends::Changes(change)) => self.change_mode(change)?,
                _ => {}
            }
            change.map_or(Ok(()), |event| self.change(event))?;
            if pause() {
                return Ok(false);
            }
        }
    }

    /// Shows the motion to what watches for its events.
    fn watched<R>(&mut self, show: impl FnOnce(&mut EventWatch<W>, &Self) -> R) -> R {
        let mut watch = std::mem::take(&mut self.watch);
        let result = show(&mut watch, self);
        self.watch = watch;
        result
    }

    /// The event that ends the run within the step that is next, and its time \[s\].
    pub fn end(&self) -> Option<(usize, Digits<W>)> {
        self.watch.stop(&self.mechanism).map(|(event, after)| (event, self.state.t + after))
    }

    /// The series of the state, and the length of the step it makes, which ends where a wall is met or lets
    /// its point go, a formula has a corner, or an event changes what acts.
    fn ready(&mut self) -> Result<(Digits<W>, Option<Ends>), StepError> {
        if let Some(step) = self.step {
            return Ok(step);
        }
        for _ in 0..ROUNDS + 4 * (self.mechanism.walls.len() + self.mechanism.frictions.len()) {
            let step = self.on_its_branches()?;
            let corner = self.branches.change(self, step);
            let mut end = (corner.unwrap_or(Digits::of(step)), None);
            match wall::first(self, end.0.value())? {
                // What acts is another thing then.
                Some((Ends::Rests(wall), _)) => {
                    self.rest(wall)?;
                    continue;
                }
                Some((Ends::Let(wall), length)) if length <= Digits::ZERO => {
                    self.let_go(&[wall])?;
                    continue;
                }
                Some((ends, length)) => end = (length, Some(ends)),
                None => {}
            }
            if !self.state.is_decided {
                self.settle_modes(Transition::default())?;
                continue;
            }
            match transitions::first(self, end.0.value())? {
                Some((Ends::Changes(change), length)) if length <= Digits::ZERO => {
                    self.change_mode(change)?;
                    continue;
                }
                Some((ends, length)) if length <= end.0 => end = (length, Some(ends)),
                _ => {}
            }
            let ends_at_corner = end.1.is_none() && corner == Some(end.0);
            let span = [end.0.value(), step];
            if let Some(event) = self.watched(|watch, motion| watch.look(motion, span, ends_at_corner)) {
                end = (event, end.1.filter(|_| event >= end.0));
            }
            self.step = Some(end);
            return Ok(end);
        }
        let what = match self.has_friction() {
            true => "contacts are made and released, or places stick and slide, without end",
            false => "contacts are made and released without end",
        };
        Err(self.stop(Cause::RestingContact, 0.0, what, "move one of the walls, or end the run before"))
    }

    /// Expands the state and all functions, and tells how long a step the series makes \[s\].
    pub(super) fn expanded(&mut self) -> Result<f64, StepError> {
        let wanted = self.expand();
        self.watched(|watch, motion| watch.functions.expand(motion, &motion.mechanism.functions));
        let mut branches = std::mem::take(&mut self.branches);
        branches.functions.expand(self, &self.mechanism.conditions);
        self.branches = branches;
        let tolerance = self.precision.tolerance();
        let allowed = self.watch.functions.allows(wanted, tolerance);
        let allowed = self.branches.functions.allows(allowed, tolerance);
        let wanted = if allowed < wanted { short(allowed) } else { wanted };
        let step = confirmed(self, wanted);
        let seconds = self.state.t.value();
        if step.is_nan() {
            let hint = crate::stepping::NOT_FINITE;
            return Err(self.stop(Cause::NotFinite, 0.0, "the series is not finite", hint));
        }
        if step < self.finest() * seconds.abs().max(1e-3 * self.mechanism.structure.units.time) {
            if self.series.regularity().abs() < JAMMED {
                return Err(self.stop(Cause::Friction, step, JAMS, HINT));
            }
            let hint = match self.probe {
                Some(_) => {
                    "a root of a rate does not pass zero in many digits: run it in doubles; elsewhere more \
                    digits carry nearer to a singular position"
                }
                None => "more digits carry nearer to a singular position",
            };
            return Err(self.stop(
                Cause::StepTooSmall,
                step,
                "the series converges in ever smaller circles",
                hint,
            ));
        }
        Ok(step)
    }

    /// The finest step over the time that is not one of ever smaller circles: fractional powers begin and end
    /// at zero by such as only many digits tell apart.
    fn finest(&self) -> f64 {
        if self.probe.is_none() {
            return FINEST;
        }
        let least = libm::exp2(-friction::SURE * self.precision.bits as f64);
        least.clamp(f64::MIN_POSITIVE, FINEST)
    }

    /// Expands the state, and tells how long a step its series makes \[s\].
    ///
    /// Products are formed for the radius of convergence that the last step had, and steps may grow by a
    /// fifth. Where powers turn out larger, where there is no step before, and of mechanisms with loops,
    /// whose radius changes too fast near singular positions, they are formed in full.
    fn expand(&mut self) -> f64 {
        let Precision { order, bits, .. } = self.precision;
        let far = -self.precision.tolerance() / order as f64;
        let found = |wanted: f64| Some(libm::log2(wanted) + far).filter(|radius| radius.is_finite());
        if let (Some(radius), Coordinates::Independent) = (self.state.radius, self.coordinates) {
            let scale = TimeScale::new(radius, radius - far + SLACK, order, bits);
            let longest = scale.longest();
            self.series.rescale(scale);
            let wanted = self.expand_once();
            let step = short(wanted.min(longest).min(self.longest));
            if !wanted.is_nan() && self.series.is_sound() && self.is_enough(step) {
                self.radius = found(wanted);
                return step;
            }
        }
        self.series.rescale(TimeScale::default());
        self.series.keep(Vec::new());
        let wanted = self.expand_once();
        self.series.keep(self.kept.clone());
        self.radius = found(wanted);
        if wanted.is_nan() { wanted } else { short(wanted.min(self.longest)) }
    }

    /// The series of the state, as products and powers are kept; the step it makes \[s\].
    fn expand_once(&mut self) -> f64 {
        let LongState { t, u, rate, .. } = &self.state;
        self.series.expand_terms(&self.mechanism.terms(), *t, u, &self.zeros, rate);
        self.gaps = wall::gaps(self);
        self.wanted()
    }

    /// An error at the present state.
    pub(super) fn stop(&self, cause: Cause, step: f64, what: &str, hint: &str) -> StepError {
        let t = self.state.t.value();
        StepError { cause, method: "taylor".into(), t, step, what: what.into(), hint: hint.into() }
    }

    /// Moves the state along the series.
    pub(super) fn advance(&mut self, length: Digits<W>) -> Result<(), StepError> {
        let (u, rate, [work, lost]) = self.evaluate(length);
        self.state.t += length;
        (self.state.u, self.state.rate) = (u, rate);
        self.state.work += work;
        self.state.lost += lost;
        self.state.steps += 1;
        self.state.radius = self.radius;
        self.step = None;
        self.settle()
    }
}

/// The coordinates that a mechanism is integrated in.
pub(super) fn coordinates_of<const W: usize>(mechanism: &ExactMechanism<Digits<W>>) -> Coordinates {
    let structure = &mechanism.structure;
    // Friction follows from the multipliers of motors, and what sticks is a row.
    let has_modes =
        !structure.frictions.is_empty() && (structure.sticking() > 0 || structure.partition.driven());
    if structure.has_multipliers() || has_modes { Coordinates::All } else { Coordinates::Independent }
}

/// A step with few bits, so that times have few: 2⁻²⁰ of its size is cut off.
fn short(step: f64) -> f64 {
    f64::from_bits(step.to_bits() >> 32 << 32)
}
