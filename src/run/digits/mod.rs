//! Runs in many digits: positions to as many digits as asked for, and up to any horizon with proof.
//!
//! [`Precision`] says what a number of digits asks of numbers and series; a [`LongRun`] takes a scene whose
//! numbers are read as written from row to row; [`DigitsPair`] runs two side by side and tells to how many
//! digits they agree; [`forecast`] measures how fast errors grow and how many digits that takes.

mod bounces;
mod branches;
mod changes;
mod confirm;
mod coordinates;
mod events;
mod evidence;
mod first_passage;
mod friction;
mod friction_impact;
mod functions;
mod growth;
mod limits;
mod motion;
mod pair;
mod polynomial;
mod precision;
mod projection;
mod resting;
mod saved;
mod shown;
mod simultaneous;
mod transitions;
mod wall;

pub use self::growth::{Forecast, forecast, planned};
pub use self::limits::exceeded;
pub use self::pair::{DigitsPair, PairProgress};
pub use self::precision::{DIGITS, Precision};
pub use self::saved::SavedDigits;
pub use self::shown::{LongEvent, LongHold, LongTurn, ShownRow};

use self::coordinates::DigitsCoordinates;
use self::events::Happened;
use self::friction::Turn;
use self::motion::DigitsMotion;
use self::resting::Hold;
use super::plan::{RequestRefusal, check_forces_of_joints};
use super::rounding::changes;
use crate::arithmetic::digits::{Digits, MIDDLE, MOST};
use crate::arithmetic::sum::larger;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::Mechanism;
use crate::dynamics::compile::Laws;
use crate::dynamics::compile::exact::ExactMechanism;
use crate::dynamics::configuration::Configuration;
use crate::scene::exact::exact_number;
use crate::scene::{Scene, SceneError, Template};
use crate::stepping::StepError;
use std::sync::Arc;

/// Numbers with room for all digits a run may have.
pub type Wide = Digits<MOST>;

/// What is run: the text of a scene, and what of it the command line says otherwise.
#[derive(Clone, Debug)]
pub struct DigitsSource {
    /// The scene's text with its overrides.
    pub template: Template,
    /// The overrides as they were typed, `PATH=VALUE`.
    pub typed: Vec<String>,
    /// Horizon \[s\], as a decimal number or a fraction; `None`: the scene's.
    pub until: Option<String>,
    /// Output interval \[s\], likewise.
    pub every: Option<String>,
    /// The scene in doubles.
    pub scene: Scene,
    /// Its mechanism.
    pub mechanism: Arc<Mechanism>,
}

/// Why a run in many digits does not begin.
#[derive(Debug, thiserror::Error)]
pub enum LongError {
    /// The scene has numbers or parts that are not known exactly.
    #[error("{0}")]
    Scene(#[from] SceneError),
    /// The scene, or a time, is not carried in many digits.
    #[error("{0}")]
    Refused(#[from] RequestRefusal),
    /// The run stopped.
    #[error("{0}")]
    Step(#[from] StepError),
}

/// A run in many digits, whatever their number.
pub trait LongRun: Send {
    /// Digits and order.
    fn precision(&self) -> Precision;

    /// The number of the last row.
    fn last_row(&self) -> u64;

    /// The row of this number; `None` where `pause` came true before it was reached.  Rows are asked for in
    /// rising order.
    ///
    /// # Errors
    /// The run stops.
    fn row(&mut self, number: u64, pause: &mut dyn FnMut() -> bool) -> Result<Option<ShownRow>, StepError>;

    /// The row of the last state before a stop; `None` where that is not beyond the last row.
    fn stopped(&mut self) -> Option<ShownRow>;

    /// Everything it needs to go on, to the last bit.
    fn save(&self) -> SavedDigits;

    /// Goes on from where another run of the same scene was; false where it cannot have been one.
    fn resume(&mut self, saved: &SavedDigits) -> bool;

    /// Steps made and impacts passed.
    fn counts(&self) -> [u64; 2];

    /// The horizon \[s\], or the time of the event that has ended the run.
    fn last_time(&self) -> f64;

    /// The events up to the last row that was asked for.
    fn events(&self) -> Vec<LongEvent>;

    /// The times that points stayed on their walls, up to the last row that was asked for.
    fn holds(&self) -> Vec<LongHold>;

    /// The transitions of places with dry friction, up to the last row that was asked for.
    fn turns(&self) -> Vec<LongTurn>;

    /// The event that has ended the run.
    fn ended_by(&self) -> Option<&str>;
}

/// A run of a scene in so many digits.
///
/// # Errors
/// The scene is not carried in many digits, or its start cannot be brought onto its constraints.
pub fn long_run(source: &DigitsSource, precision: Precision) -> Result<Box<dyn LongRun>, LongError> {
    match precision.room() {
        5 => Ok(Box::new(Runner::<5>::new(source, precision)?)),
        8 => Ok(Box::new(Runner::<8>::new(source, precision)?)),
        MIDDLE => Ok(Box::new(Runner::<MIDDLE>::new(source, precision)?)),
        _ => Ok(Box::new(Runner::<MOST>::new(source, precision)?)),
    }
}

/// Output times, exactly.
#[derive(Clone, Copy, Debug)]
struct OutputTimes<const W: usize> {
    until: Digits<W>,
    every: Digits<W>,
    last: u64,
}

impl<const W: usize> OutputTimes<W> {
    fn new(until: Digits<W>, every: Digits<W>) -> Result<Self, RequestRefusal> {
        let whole = (until / every).value();
        let is_sound = until > Digits::ZERO && every > Digits::ZERO && until >= every && whole < 1e15;
        if !is_sound {
            return Err(refusal(
                "--until and --every",
                "0 < every <= until, and fewer than 1e15 rows",
                "check both",
            ));
        }
        // The quotient of decimals may be a hair off a whole number.
        let near = whole.round();
        let is_near = (every.scale(near) - until).abs() < every.scale(1e-12);
        Ok(Self { until, every, last: if is_near { near } else { whole.ceil() } as u64 })
    }

    fn time(&self, number: u64) -> Digits<W> {
        if number >= self.last { self.until } else { self.every * Digits::whole(number) }
    }
}

fn refusal(what: &str, reason: &str, alternative: &str) -> RequestRefusal {
    RequestRefusal {
        what: what.into(),
        reason: reason.into(),
        alternative: alternative.into(),
        is_usage: true,
    }
}

/// A run on numbers of `W` limbs.
struct Runner<const W: usize> {
    motion: DigitsMotion<W>,
    rows: OutputTimes<W>,
    /// Energy at the start \[J\].
    energy: Digits<W>,
    /// Time of the last row that was asked for \[s\].
    seen: Digits<W>,
    /// True where an event has ended the run there.
    has_ended: bool,
}

impl<const W: usize> Runner<W> {
    fn new(source: &DigitsSource, precision: Precision) -> Result<Self, LongError> {
        if let Some(force) = source.mechanism.forces_from_outside().first() {
            let what = format!("force {} in many digits", force.name);
            let reason = "it is no part of the scene, and is recorded in doubles";
            return Err(refusal(&what, reason, "write it as a formula of the scene").into());
        }
        check_forces_of_joints(&source.mechanism)?;
        let (scene, times) = source.template.exact::<Digits<W>>(&source.typed)?;
        let time = |text: &Option<String>, other: Digits<W>| {
            text.as_ref().map_or(Some(other), |text| exact_number(text))
        };
        let missing =
            || refusal("--until or --every", "it is no decimal number or fraction", "write 0.01 or 1/64");
        let (until, every) = (
            time(&source.until, times.until).ok_or_else(missing)?,
            time(&source.every, times.every).ok_or_else(missing)?,
        );
        let rows = OutputTimes::new(until, if every > until { until } else { every })?;
        // Formulas begin on the branches of the start.
        let start = source.mechanism.start(&source.scene);
        let structure = match source.mechanism.on_branches_of(&start) {
            Ok(Some(structure)) => Arc::new(structure),
            _ => Arc::clone(&source.mechanism),
        };
        let mut mechanism = ExactMechanism::new(&scene, &structure).map_err(|reason| {
            let alternative = "run it without --digits".into();
            RequestRefusal { what: "--digits".into(), reason, alternative, is_usage: false }
        })?;
        if let Some(Laws { formulas, parameters, .. }) = &structure.laws {
            let functions = 0..formulas.events.len();
            let magnitudes = changes(&structure, &start, |motion| {
                let value = |at: &Configuration<f64>, event| formulas.event_value(event, at, parameters);
                structure.seen(motion, |at| functions.clone().map(|event| value(at, event)).collect())
            });
            let events = mechanism.events.iter_mut().zip(magnitudes);
            events.for_each(|(event, magnitude)| event.magnitude = magnitude);
        }
        let start = mechanism.start(&scene, &source.scene);
        let motion = DigitsMotion::new(mechanism, start, precision, until.value())?;
        let coordinates = motion.state_coordinates();
        let z = motion.mechanism.elements(&coordinates.phi);
        let [kinetic, potential] = motion.mechanism.energy(&coordinates.phi, &coordinates.omega, &z);
        let seen = Digits::of(-1.0);
        Ok(Self { motion, rows, energy: kinetic + potential, seen, has_ended: false })
    }
}

impl<const W: usize> Runner<W> {
    /// The row of a moment.
    fn shown(&mut self, t: Digits<W>, coordinates: &DigitsCoordinates<W>) -> ShownRow {
        let mechanism = &self.motion.mechanism;
        let z = mechanism.elements(&coordinates.phi);
        let [kinetic, potential] = mechanism.energy(&coordinates.phi, &coordinates.omega, &z);
        let balance = kinetic + potential - coordinates.work[0] - coordinates.work[1] - self.energy;
        let drift = balance.value() / mechanism.structure.energy_scale;
        let centres = mechanism.centres(&z, &coordinates.omega);
        let body = |(k, [at, rate]): (usize, [crate::arithmetic::Complex<Digits<W>>; 2])| {
            [coordinates.phi[k], coordinates.omega[k], at.re, at.im, rate.re, rate.im].map(Digits::resized)
        };
        let bodies = centres.into_iter().enumerate().map(body).collect();
        let of_integrals = mechanism.structure.energy_of_integrals(&coordinates.omega);
        let energy =
            [kinetic - of_integrals, potential, coordinates.work[0] - of_integrals].map(Digits::resized);
        let left = self.motion.projection.left(mechanism, t, &coordinates.phi, &coordinates.omega);
        let residual = [0, 1].map(|level| left.iter().fold(0.0, |most, left| larger(left[level], most)));
        let residuals = left.into_iter().take(mechanism.structure.standing_rows()).collect();
        let friction = self.motion.has_friction().then(|| coordinates.lost.resized());
        ShownRow { t: t.resized(), bodies, energy, friction, drift, residual, residuals }
    }
}

impl<const W: usize> LongRun for Runner<W> {
    fn precision(&self) -> Precision {
        self.motion.precision
    }

    fn last_row(&self) -> u64 {
        self.rows.last
    }

    fn row(&mut self, number: u64, pause: &mut dyn FnMut() -> bool) -> Result<Option<ShownRow>, StepError> {
        let mut t = self.rows.time(number);
        if !self.motion.reach(t, pause)? {
            return Ok(None);
        }
        if let Some((_, end)) = self.motion.end().filter(|(_, end)| *end <= t) {
            (t, self.has_ended) = (end, true);
            self.rows = OutputTimes { until: end, last: number, ..self.rows };
        }
        self.seen = t;
        let coordinates = self.motion.at(t);
        Ok(Some(self.shown(t, &coordinates)))
    }

    fn stopped(&mut self) -> Option<ShownRow> {
        let (t, coordinates) = (self.motion.state().t, self.motion.state_coordinates());
        let is_finite = coordinates.phi.iter().chain(&coordinates.omega).all(|x| x.is_finite());
        // A row that is beside it by rounding has it.
        let rounding = t.log2() + self.motion.precision.rounding(1.0);
        if t <= self.seen || (t - self.seen).log2() <= rounding || !is_finite {
            return None;
        }
        self.seen = t;
        Some(self.shown(t, &coordinates))
    }

    fn save(&self) -> SavedDigits {
        saved::save(self)
    }

    fn resume(&mut self, saved: &SavedDigits) -> bool {
        saved::resume(self, saved)
    }

    fn counts(&self) -> [u64; 2] {
        [self.motion.state().steps, self.motion.state().impacts]
    }

    fn last_time(&self) -> f64 {
        self.rows.until.value()
    }

    fn events(&self) -> Vec<LongEvent> {
        let motion = &self.motion;
        let resized = |numbers: &[Digits<W>]| numbers.iter().map(|number| number.resized()).collect();
        let event = |Happened { event, t, phi, omega }: Happened<W>| LongEvent {
            name: motion.mechanism.events[event].name.clone(),
            t: t.resized(),
            phi: resized(&phi),
            omega: resized(&omega),
        };
        motion.watch.until(motion, self.seen).into_iter().map(event).collect()
    }

    fn holds(&self) -> Vec<LongHold> {
        let hold = |hold: &Hold<W>| LongHold {
            wall: self.motion.mechanism.walls[hold.wall].0.name.clone(),
            t: hold.since.resized(),
            until: hold.until.map(Digits::resized),
        };
        self.motion.state().holds.iter().map(hold).collect()
    }

    fn turns(&self) -> Vec<LongTurn> {
        let turn = |turn: &Turn<W>| LongTurn {
            name: self.motion.mechanism.frictions[turn.place].name.clone(),
            t: turn.t.resized(),
            does: turn.word(),
        };
        self.motion.state().turns.iter().map(turn).collect()
    }

    fn ended_by(&self) -> Option<&str> {
        let ended = self.motion.end().filter(|_| self.has_ended);
        ended.map(|(event, _)| self.motion.mechanism.events[event].name.as_str())
    }
}
