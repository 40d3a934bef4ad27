//! What the digits of a scene's numbers leave uncertain in its motion, number by number.
//!
//! ```text
//! effect of p = u max over times t <= at of |x(t; p + h) - x(t; p - h)| / 2h
//!     u  half a unit of the last digit of p, as written
//! total       = root of the sum of the squares of all effects
//!     x  angles, and positions over the longest bar
//! ```
//!
//! x(t; p ± h) are runs from neighbouring scenes by the series in doubles, at the tolerance of a reference
//! solution.  They go through whatever the scene has: impacts, constraints that change with p, starts that
//! are found.  h is chosen for each number so that the difference is far above the rounding of such runs,
//! which two runs of the scene itself tell, and small enough to be proportional to h, which the two sides
//! tell.  The effect is that of u *in proportion*: u itself may be so large that the motion becomes another.
//!
//! Where one side is refused (a restitution of 1), h / 2 on the other takes its place.

use super::finer::neighbour;
use super::measured::LAST_DIGIT;
use super::{DistanceMetric, Trust};
use crate::arithmetic::shown::figure;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::build::build;
use crate::run::contact::ContactDriver;
use crate::run::driver::Pause;
use crate::run::plan::Plan;
use crate::run::running::Outcome;
use crate::scene::{Scene, SceneError, Template, Variable, WrittenNumber};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Times at which runs are compared, equally spaced, beside the start.
const LOOKS: u32 = 64;
/// The second run of the scene itself: its tolerance over that of all others.
const COARSER: f64 = 2.0;
/// Rounding \[rad\] up to which a difference can be told, and the least there is.
const MOST_NOISE: f64 = 1e-4;
const LEAST_NOISE: f64 = 1e-15;
/// Differences \[rad\] so small may be rounding whatever two runs of the scene tell: where its motion is a
/// polynomial they are the same.
const ROUNDING: f64 = 1e-10;
/// The difference aimed at \[rad\]: so many times the rounding, within these bounds; and how far from it may
/// be taken.
const ABOVE_NOISE: f64 = 1e3;
const DIFFERENCE: [f64; 2] = [1e-7, 1e-3];
const WINDOW: [f64; 2] = [1e-2, 10.0];
/// The least and the largest change, over the number.
const CHANGE: [f64; 2] = [3.6e-15, 1e-3];
/// Differences on both sides in proportion to their changes, at most.
const PROPORTION: f64 = 1.5;
/// By how much a change is made smaller where they are not.
const SMALLER: f64 = 30.0;
/// Changes tried for a number, and those of them that may stop a run.
const TRIES: u32 = 8;
const STOPS: u32 = 3;

/// A number of the scene, and what its last digit comes to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Its path, as in `--set`.
    pub path: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Half a unit of the last digit it is written with.
    pub uncertainty: f64,
    /// What that comes to, in proportion: the largest change of an angle \[rad\], or of a position over the
    /// longest bar.  May be any size.
    pub effect: Option<f64>,
    /// True where the effect is lost in rounding, so that it is at most so large.
    pub is_upper_bound: bool,
    /// Why nothing is known of it.
    pub why: Option<String>,
}

/// The same for all numbers of a scene, the largest effect first, and those of which nothing is known last.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// Effects are the largest up to this time \[s\]: the end of the run, or the horizon, or as far as the
    /// runs compared are known.
    pub at: f64,
    /// Root of the sum of the squares of the effects known \[rad\].
    pub total: Option<f64>,
    /// The numbers.
    pub numbers: Vec<Input>,
    /// Runs made.
    pub runs: u64,
    /// Evaluations in them.
    pub evaluations: u64,
    /// Why there are no effects at all, or none up to the time they were asked for.
    pub why: Option<String>,
}

impl Inputs {
    /// The effects of these numbers of a scene up to `until` \[s\], on runs of at most so many evaluations
    /// each; `reach` \[rad\] is about what a relative change of 1 in all of them comes to, where that is
    /// known.
    pub fn of(
        template: &Template,
        numbers: &[WrittenNumber],
        until: f64,
        max_evaluations: u64,
        reach: Option<f64>,
        pause: &mut Pause,
    ) -> Self {
        let mut inputs = Self { at: until, ..Self::default() };
        let mut found = Vec::new();
        match NeighbourRuns::new(template, until, max_evaluations, reach, &mut inputs, pause) {
            Err(why) => inputs.why = Some(why),
            Ok(mut neighbours) => found.extend(numbers.iter().map(|number| neighbours.input(number))),
        }
        if inputs.why.is_some() && found.is_empty() {
            inputs.at = 0.0;
        }
        found.sort_by(|a, b| b.effect.unwrap_or(-1.0).total_cmp(&a.effect.unwrap_or(-1.0)));
        let squares = found.iter().filter_map(|input| input.effect).map(|effect| effect * effect);
        inputs.total = found.iter().any(|input| input.effect.is_some()).then(|| squares.sum::<f64>().sqrt());
        inputs.numbers = found;
        inputs
    }

    /// Numbers of which nothing is known.
    pub fn unknown(&self) -> usize {
        self.numbers.iter().filter(|input| input.effect.is_none()).count()
    }
}

impl Trust {
    /// The same with the effects of the scene's numbers as they are written, of the run by a plan.
    ///
    /// # Errors
    /// As [`Template::written_numbers`].
    pub fn with_inputs(
        mut self,
        template: &Template,
        typed: &[String],
        plan: &Plan,
        pause: &mut Pause,
    ) -> Result<Self, SceneError> {
        let numbers = template.written_numbers(typed)?;
        let reach = self.input_error.map(|error| error / LAST_DIGIT);
        let inputs = Inputs::of(template, &numbers, self.at, plan.max_evaluations, reach, pause);
        let is_whole = inputs.at == self.at;
        self.input_error = inputs.total.filter(|_| is_whole).map(|total| total.min(TAU));
        self.inputs = Some(inputs);
        Ok(self)
    }
}

/// A neighbour: by how much its number is changed, and its motions.
struct NeighbourRun {
    change: f64,
    motions: Vec<Motion>,
}

/// Runs beside that of the scene.
struct NeighbourRuns<'a, 'b> {
    template: &'a Template,
    times: Vec<Time>,
    max_evaluations: u64,
    metric: DistanceMetric,
    coordinates: usize,
    /// The motions of the scene itself, and what rounding does to them at most \[rad\].
    motions: Vec<Motion>,
    noise: f64,
    /// What a relative change of 1 comes to, about \[rad\].
    reach: f64,
    inputs: &'a mut Inputs,
    pause: &'a mut Pause<'b>,
}

impl<'a, 'b> NeighbourRuns<'a, 'b> {
    fn new(
        template: &'a Template,
        until: f64,
        max_evaluations: u64,
        reach: Option<f64>,
        inputs: &'a mut Inputs,
        pause: &'a mut Pause<'b>,
    ) -> Result<Self, String> {
        if !(until > 0.0 && until.is_finite()) {
            return Err("the run ended at its start".into());
        }
        let scene = template.scene().map_err(|error| first_line(&error))?;
        let mechanism =
            Arc::new(Mechanism::of_sound(&scene, Vec::new()).map_err(|error| first_line(&error))?);
        let times = (0..=LOOKS).map(|k| Time::from(until * f64::from(k) / f64::from(LOOKS))).collect();
        let mut neighbours = Self {
            template,
            times,
            max_evaluations,
            metric: DistanceMetric::new(&mechanism),
            coordinates: mechanism.coordinates(),
            motions: Vec::new(),
            noise: LEAST_NOISE,
            reach: reach.filter(|reach| reach.is_finite() && *reach > 0.0).unwrap_or(1.0),
            inputs,
            pause,
        };
        let (motions, stop) = neighbours.go(&mechanism, &scene, 1.0);
        let (others, other_stop) = neighbours.go(&mechanism, &scene, COARSER);
        neighbours.keep(motions, &others, stop.or(other_stop))?;
        Ok(neighbours)
    }

    /// Takes the scene's own motions as far as they are known.
    fn keep(
        &mut self,
        mut motions: Vec<Motion>,
        others: &[Motion],
        stop: Option<String>,
    ) -> Result<(), String> {
        let mut kept = 0;
        for (one, other) in motions.iter().zip(others) {
            let apart = self.metric.apart(one, other);
            if apart.is_nan() || apart > MOST_NOISE {
                break;
            }
            (self.noise, kept) = (self.noise.max(apart), kept + 1);
        }
        if kept < self.times.len() {
            let why = stop.unwrap_or_else(|| {
                format!("rounding alone moves runs in doubles by more than {MOST_NOISE:e} rad from then on")
            });
            let last = kept.saturating_sub(1);
            if last == 0 {
                return Err(why);
            }
            (self.inputs.at, self.inputs.why) = (self.times[last].hi, Some(why));
        }
        self.times.truncate(kept);
        motions.truncate(kept);
        self.motions = motions;
        Ok(())
    }

    /// The motions of a scene at the times, as far as it goes, and why it goes no further.
    fn go(
        &mut self,
        mechanism: &Arc<Mechanism>,
        scene: &Scene,
        coarser: f64,
    ) -> (Vec<Motion>, Option<String>) {
        let Some(&until) = self.times.last() else { return (Vec::new(), None) };
        let mut motions = Vec::new();
        let mut plan =
            Plan { max_evaluations: self.max_evaluations, ..neighbour(mechanism, until.hi, coarser) };
        let mut outcome = Outcome::begun(mechanism, plan.clone());
        let mut driver = match build(mechanism, &mut plan, &mechanism.start(scene)) {
            Ok(driver) => driver,
            Err(stop) => return (motions, Some(stop.what)),
        };
        driver.allow(self.max_evaluations);
        let mut contact_driver = ContactDriver::new(Arc::clone(mechanism), driver);
        self.inputs.runs += 1;
        let mut stop = contact_driver.meet(&mut outcome).err();
        let mut is_paused = false;
        for &time in &self.times {
            if stop.is_some() || is_paused {
                break;
            }
            match contact_driver.go(time, &mut outcome, self.pause) {
                Ok(true) => motions.push(contact_driver.motion()),
                Ok(false) => is_paused = true,
                Err(reason) => stop = Some(reason),
            }
        }
        self.inputs.evaluations += contact_driver.statistics().evaluations;
        let why = stop.map(|stop| format!("at t = {} s: {}", figure(stop.t), stop.what));
        (motions, if is_paused { Some("interrupted".into()) } else { why })
    }

    fn input(&mut self, number: &WrittenNumber) -> Input {
        let WrittenNumber { path, unit, value, uncertainty } = number;
        let unit = self.template.unit(path).unwrap_or_else(|_| (*unit).into());
        let mut input =
            Input { path: path.clone(), unit, value: *value, uncertainty: *uncertainty, ..Input::default() };
        match self.slope(number) {
            Ok((slope, is_upper_bound)) => {
                (input.effect, input.is_upper_bound) = (Some(slope * uncertainty), is_upper_bound)
            }
            Err(why) => input.why = Some(why),
        }
        input
    }

    /// The largest difference per change of a number, and whether it is only known to be no larger.
    ///
    /// # Errors
    /// Why it is not known.
    fn slope(&mut self, number: &WrittenNumber) -> Result<(f64, bool), String> {
        let [least, most] = CHANGE.map(|change| change * number.value.abs());
        let mut wanted = (ABOVE_NOISE * self.noise).clamp(DIFFERENCE[0], DIFFERENCE[1]);
        let mut h = (wanted / self.reach * number.value.abs()).clamp(least, most);
        let (mut why, mut stops, mut before) = (String::new(), 0, None);
        for _ in 0..TRIES {
            if stops == STOPS {
                break;
            }
            if (self.pause)() {
                return Err("interrupted".into());
            }
            let main = match self.either(number, h) {
                Ok(main) => main,
                Err(reason) => {
                    // What stops a neighbour may not stop a nearer one.
                    (why, stops, h) = (reason, stops + 1, (h / SMALLER).max(least));
                    continue;
                }
            };
            let difference = self.apart(&main.motions, &self.motions);
            if difference > 0.0 && difference < ROUNDING.max(ABOVE_NOISE * self.noise) {
                // A larger change that does no more, or none but rounding has done anything.
                match before.replace([h, difference]) {
                    Some([other, less]) if is_flat([h, difference], [other, less]) => {
                        self.noise = self.noise.max(difference.min(less));
                        return Ok((difference.max(less) / h.max(other), true));
                    }
                    None if h == most => {
                        h /= SMALLER;
                        continue;
                    }
                    _ => {}
                }
            }
            let is_rounding = difference < 3.0 * self.noise;
            let is_far = difference > WINDOW[1] * wanted && h > least;
            let is_near = difference < WINDOW[0] * wanted && h < most;
            if is_far || is_near {
                h = (h * wanted / difference.max(self.noise)).clamp(least, most);
                continue;
            }
            let other = self.beside(number, -main.change).or_else(|_| self.beside(number, 0.5 * main.change));
            let other = match other {
                Ok(other) => other,
                Err(reason) => {
                    (why, stops, h) = (reason, stops + 1, (h / SMALLER).max(least));
                    continue;
                }
            };
            let span = (main.change - other.change).abs();
            if is_rounding {
                return Ok((
                    if difference == 0.0 { 0.0 } else { self.noise.max(difference) / span },
                    difference > 0.0,
                ));
            }
            let share = self.apart(&other.motions, &self.motions)
                / other.change.abs()
                / (difference / main.change.abs());
            if (1.0 / PROPORTION..PROPORTION).contains(&share) {
                return Ok((self.apart(&main.motions, &other.motions) / span, false));
            }
            why = "small changes of it do not act in proportion".into();
            (wanted, h) = (wanted / SMALLER, (h / SMALLER).max(least));
            if wanted < 10.0 * self.noise {
                break;
            }
        }
        Err(why)
    }

    /// A neighbour at a change, or else at the opposite one.
    fn either(&mut self, number: &WrittenNumber, h: f64) -> Result<NeighbourRun, String> {
        self.beside(number, h).or_else(|why| self.beside(number, -h).map_err(|_| why))
    }

    fn beside(&mut self, number: &WrittenNumber, h: f64) -> Result<NeighbourRun, String> {
        let value = number.value + h;
        let variable = Variable { path: number.path.clone(), unit: number.unit, start: None };
        let scene = self.template.filled(&[variable], &[value]).map_err(|error| {
            let refusal = error.refusal();
            format!("it cannot be changed alone: {} {}", refusal.path, refusal.allowed)
        })?;
        let mechanism =
            Arc::new(Mechanism::of_sound(&scene, Vec::new()).map_err(|error| first_line(&error))?);
        if mechanism.coordinates() != self.coordinates {
            return Err("with it changed the mechanism has other coordinates".into());
        }
        let (motions, stop) = self.go(&mechanism, &scene, 1.0);
        if motions.len() < self.times.len() {
            return Err(format!("with it changed the run stops {}", stop.unwrap_or_default()));
        }
        Ok(NeighbourRun { change: value - number.value, motions })
    }

    /// The largest difference at any of the times; infinite where one is not a number.
    fn apart(&self, one: &[Motion], other: &[Motion]) -> f64 {
        let apart = one.iter().zip(other).map(|(one, other)| self.metric.apart(one, other));
        apart.fold(0.0, |most, apart| if apart.is_nan() { f64::INFINITY } else { most.max(apart) })
    }
}

/// True where differences `[change, difference]` hardly follow their changes.
fn is_flat([h, difference]: [f64; 2], [other, less]: [f64; 2]) -> bool {
    let ratio = |a: f64, b: f64| libm::log(a / b).abs();
    ratio(h, other) > libm::log(10.0) && ratio(difference, less) < 0.5 * ratio(h, other)
}

/// The first line of a message.
fn first_line(error: &dyn std::fmt::Display) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}
