//! Sensitivities: derivatives of outputs and measures of a run by any number of its scene.
//!
//! One run of [`taylor`](crate::stepping::taylor) carries a column for each number beside the motion (module
//! `variation`), through impacts, events and the transitions of dry friction (module `crossing`).  Columns
//! are power series on numbers with derivatives (module `expanded`) where the scene has such, and else
//! integrated by collocation (module `collocation`); what a number does there, to the start, to outputs and
//! to impacts, is told by neighbouring mechanisms at one and the same state (module `neighbours`).  Nothing
//! is a difference of runs, so that the derivatives are as accurate as the motion, however fast neighbouring
//! motions part.
//!
//! ```text
//! dy/dp = Y_x δ + Y_p       of an output Y(t, x; p)       δ  the column of p
//! dt/dp = -(g_x δ + g_p)/g'  of the time of g = 0
//!     extremes: as of an output at their own time, which counts
//!                                                           at corners, jumps and the end of a run:
//!                                                               dy/dp + y' dt/dp
//! ```

mod at_rest;
mod collocation;
mod crossing;
mod expanded;
mod extreme;
mod fractional;
mod lyapunov;
mod measure;
mod neighbours;
mod recorder;
mod result;
mod singular;
mod variation;

use expanded::Expansions;
pub use lyapunov::{Regime, Spectrum, lyapunov};
pub use measure::Measure;
#[cfg(feature = "fit")]
pub(super) use measure::{Derived, outputs};
use neighbours::Neighbours;
use recorder::{RecordedTime, SensitivityRecorder, taken};
pub use result::{InputNumber, Measured, Sensitivity, SensitivityError, SensitivityRequest, SensitivityRow};
pub(super) use variation::{Look, Variation};

use super::build::build;
use super::contact::{ContactDriver, JumpLog};
use super::driver::Pause;
use super::extremes::ExtremesDetector;
use super::flip::FlipDetector;
use super::plan::Plan;
use super::running::Outcome;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::scene::{LONGEST_TIME, OF_THE_RUN, Output, OutputNames, Scene, Template};
use crate::stepping::Tolerance;
use std::sync::Arc;

/// Tolerance of the motion \[rad/s\].
pub const TOLERANCE: f64 = 1e-14;

/// A measure on its way.
struct Query {
    measure: Measure,
    /// Its output among all, where it has one.
    output: Option<usize>,
    /// When it is taken \[s\], where that is known, or why never.
    t: Result<f64, String>,
    /// Its value, of an extreme: on which side of a jump that is.
    value: f64,
    /// The least and the largest value of its output over the run.
    range: [f64; 2],
    /// The bar that turns over, or the event, by number.
    number: usize,
    /// True where an extreme is taken as the run ends, and the event that ends it.
    is_end: bool,
    ended_by: Option<usize>,
}

impl Query {
    fn is_extreme(&self) -> bool {
        matches!(self.measure, Measure::Max(_) | Measure::Min(_))
    }
}

/// Derivatives of measures of a scene's run by numbers of it.
///
/// ```
/// use driftless::{SensitivityRequest, Template, sensitivity};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let template = Template::read("examples/scenes/spring.json".as_ref(), &[])?;
/// let request = SensitivityRequest {
///     of: vec!["bar2.phi".parse()?, "max:spring.force".parse()?],
///     to: vec!["spring.stiffness".into(), "bar1.phi".into()],
///     at: Some(2.0),
///     ..SensitivityRequest::default()
/// };
/// let found = sensitivity(&template, &request, &mut || false)?;
/// // A stiffness larger by 1 N/m turns the second bar so many rad further within 2 s.
/// assert_eq!(found.jacobian().shape(), (2, 2));
/// assert!((found.jacobian()[(0, 0)] - found.measures[0].slopes[0]).abs() < 1e-15);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// The scene, or what is asked for, makes no sense, or the motion stops.
pub fn sensitivity(
    template: &Template,
    request: &SensitivityRequest,
    pause: &mut Pause,
) -> Result<Sensitivity, SensitivityError> {
    for name in &request.to {
        let path = template.variable(name)?.path;
        if OF_THE_RUN.contains(&path.as_str()) {
            let what = format!("no derivative by {path}: it is no number of the mechanism");
            let hint = "name a start, a length, a mass, a parameter; rates of outputs are outputs themselves";
            return Err(SensitivityError::Unsuited(format!("{what}\nhint: {hint}")));
        }
    }
    let study = Study::new(template, request)?;
    let mut asked = study.asked(request)?;
    study.find_times(&mut asked, pause)?;
    study.derive(asked, pause)
}

/// A scene with its numbers.
pub(super) struct Study {
    template: Template,
    pub scene: Scene,
    pub mechanism: Arc<Mechanism>,
    pub start: Motion,
    pub plan: Plan,
    pub inputs: Vec<InputNumber>,
    neighbours: Vec<Neighbours>,
    times: Vec<f64>,
}

impl Study {
    pub fn new(template: &Template, request: &SensitivityRequest) -> Result<Self, SensitivityError> {
        let known = template.scene()?;
        let outputs: Vec<Output> = request
            .of
            .iter()
            .filter_map(Measure::output)
            .filter(|output| known.outputs.iter().all(|known| known.name != output.name))
            .cloned()
            .collect();
        let names = OutputNames::of(&known);
        for output in &outputs {
            names
                .bind(output)
                .map_err(|error| refused(format!("{}: {}", output.name, error.problem), &error.hint))?;
        }
        let template = template.clone().with_outputs(outputs);
        let scene = template.scene()?;
        let mechanism = Arc::new(Mechanism::new(&scene)?);
        if mechanism.vibration.is_some() || !mechanism.tree.is_dense() {
            let what = "small differences are followed beside `taylor`, which does not take this scene: \
                rigid springs that vibrate have no series, and very many bodies are too many";
            return Err(SensitivityError::Unsuited(what.into()));
        }
        let until = request.at.unwrap_or(scene.until);
        if !(until > 0.0 && until <= LONGEST_TIME) {
            let hint = format!("a time in seconds above 0 and up to {LONGEST_TIME:e}, as --at 2");
            return Err(refused(format!("the time is {until:e} s"), &hint));
        }
        let tolerance = request.tolerance.unwrap_or(TOLERANCE);
        let plan = Plan::of_series(&mechanism, Tolerance { relative: tolerance, absolute: tolerance }, until);
        let times = recorder::times(until, request.every)?;
        let start = mechanism.start(&scene);
        let mut study = Self {
            template: template.clone(),
            scene,
            mechanism,
            start,
            plan,
            inputs: Vec::new(),
            neighbours: Vec::new(),
            times,
        };
        for name in &request.to {
            study.add_number(&template, name)?;
        }
        Ok(study)
    }

    fn add_number(&mut self, template: &Template, name: &str) -> Result<(), SensitivityError> {
        let variable = template.variable(name)?;
        let value = template.value(&variable)?.ok_or_else(|| {
            let what = format!("{} is not a number written in the scene", variable.path);
            let hint = "add it to the scene or by --set, or name the parameter in its formula";
            SensitivityError::Unsuited(format!("{what}\nhint: {hint}"))
        })?;
        let base = (&self.mechanism, &self.start);
        let neighbours =
            Neighbours::new(template, (&variable, value), base, self.plan.until).map_err(|why| {
                SensitivityError::Unsuited(format!("no derivative by {}: {why}", variable.path))
            })?;
        let (unit, error) = (template.unit(&variable.path)?, neighbours.error);
        self.inputs.push(InputNumber { path: variable.path, unit, value, error });
        self.neighbours.push(neighbours);
        Ok(())
    }

    /// Numbers that neither the equations nor the start depend on.
    #[cfg(feature = "fit")]
    pub fn idle(&self) -> impl Iterator<Item = &InputNumber> {
        let does_nothing = |neighbours: &Neighbours| {
            neighbours.levels.is_empty() && neighbours.start.iter().all(|slope| *slope == 0.0)
        };
        let each = self.inputs.iter().zip(&self.neighbours);
        each.filter(move |(_, neighbours)| does_nothing(neighbours)).map(|(input, _)| input)
    }

    /// The measures, with the outputs they are of.
    fn asked(&self, request: &SensitivityRequest) -> Result<Vec<Query>, SensitivityError> {
        let heads: Vec<String> = (self.mechanism.outputs.iter())
            .flat_map(|outputs| outputs.heads().map(|(name, _)| name.to_owned()))
            .collect();
        let asked = |measure: &Measure| {
            let output =
                measure.output().and_then(|output| heads.iter().position(|name| *name == output.name));
            let mut number = 0;
            if let Measure::Event(name) = measure {
                let events = self.scene.events.iter();
                let known: Vec<&str> = events.map(|event| event.name.as_str()).collect();
                number = position(&known, name, "event")?;
            }
            if let Measure::Impact(name) = measure {
                let known: Vec<&str> = self.scene.walls.iter().map(|wall| wall.name.as_str()).collect();
                position(&known, name, "wall")?;
            }
            let t = Ok(self.plan.until);
            let (measure, value, range) = (measure.clone(), f64::NAN, [f64::NAN; 2]);
            Ok(Query { measure, output, t, value, range, number, is_end: false, ended_by: None })
        };
        request.of.iter().map(asked).collect()
    }

    /// A driver at the start, through what impacts there are at it, which a log takes where there is one.
    fn driver(
        &self,
        outcome: &mut Outcome,
        jumps: Option<JumpLog>,
    ) -> Result<ContactDriver, SensitivityError> {
        let mut plan = self.plan.clone();
        let driver = build(&self.mechanism, &mut plan, &self.start).map_err(stopped)?;
        let mut driver = ContactDriver::new(Arc::clone(&self.mechanism), driver);
        driver.jumps = jumps;
        driver.meet(outcome).map_err(stopped)?;
        Ok(driver)
    }

    /// A run beforehand, where measures are taken at times that only it tells.
    fn find_times(&self, asked: &mut [Query], pause: &mut Pause) -> Result<(), SensitivityError> {
        let is_known = |asked: &Query| matches!(asked.measure, Measure::Output(_) | Measure::Impact(_));
        if asked.iter().all(is_known) {
            return Ok(());
        }
        let mut outcome = Outcome::begun(&self.mechanism, self.plan.clone());
        let mut driver = self.driver(&mut outcome, None)?;
        driver.flips = Some(FlipDetector::default());
        driver.extremes = ExtremesDetector::new(&self.mechanism);
        driver.go(Time::from(self.plan.until), &mut outcome, pause).map_err(stopped)?;
        let extremes = driver.extremes.as_ref().map(ExtremesDetector::extremes).unwrap_or_default();
        let end = driver.motion().time.hi;
        let ended_by = driver.ended_by.as_ref();
        let ended_by = self.scene.events.iter().position(|event| ended_by == Some(&event.name));
        for asked in asked {
            let extreme = asked.output.and_then(|output| extremes.get(output));
            let nothing = |what: &str| format!("{what} up to {} s", self.plan.until);
            asked.t = match &asked.measure {
                Measure::Max(_) | Measure::Min(_) => {
                    let is_max = matches!(asked.measure, Measure::Max(_));
                    let found = extreme.map(|found| if is_max { found.max } else { found.min });
                    asked.value = found.map_or(f64::NAN, |[value, _]| value);
                    asked.range = extreme.map_or([f64::NAN; 2], |found| [found.min[0], found.max[0]]);
                    match found {
                        Some([value, t]) if value.is_finite() => Ok(t),
                        Some(_) => Err("unbounded or not known at a singular position on the way".into()),
                        None => Err(nothing("no extreme")),
                    }
                }
                Measure::Flip => match driver.flips.as_ref().and_then(|flips| flips.flip) {
                    Some(flip) => {
                        asked.number = flip.bar;
                        Ok(flip.t)
                    }
                    None => Err(nothing("no bar turns over")),
                },
                Measure::Event(name) => {
                    let found = outcome.events.iter().find(|event| event.name == *name);
                    found.map(|event| event.t).ok_or_else(|| nothing("the event does not happen"))
                }
                Measure::Output(_) | Measure::Impact(_) => Ok(self.plan.until),
            };
            let is_end = |t: &f64| (end - t).abs() <= 4.0 * f64::EPSILON * end;
            if asked.is_extreme() && asked.t.as_ref().is_ok_and(is_end) {
                (asked.t, asked.is_end, asked.ended_by) = (Ok(end), true, ended_by);
            }
        }
        Ok(())
    }

    /// Columns of all numbers at the start, and what moves them; and room for so many directions of the
    /// state.
    pub fn variation(&self, directions: usize) -> Result<Variation, SensitivityError> {
        let columns = self.neighbours.iter().map(|neighbours| neighbours.start.clone()).collect();
        let neighbours = self.neighbours.iter().cloned().map(Some).collect();
        let mut variation =
            Variation::new(&self.mechanism, columns, neighbours).map_err(SensitivityError::Unsuited)?;
        variation.expanded = self.expanded(directions, &mut variation.neighbours);
        Ok(variation)
    }

    /// The series of columns of all numbers, beside these neighbours, and of so many directions of the state,
    /// where there are such.
    fn expanded(&self, directions: usize, neighbours: &mut [Option<Neighbours>]) -> Option<Expansions> {
        if !self.mechanism.frictions.is_empty() {
            return None;
        }
        let numbers: Vec<_> = self.inputs.iter().map(|input| (input.path.as_str(), input.value)).collect();
        let starts: Vec<_> = self.neighbours.iter().map(|neighbours| neighbours.start.clone()).collect();
        let Self { template, scene, mechanism, .. } = self;
        let mut expanded = Expansions::new(template, scene, mechanism, &numbers, &starts, directions).ok()?;
        expanded.agrees(&self.start, neighbours).then_some(expanded)
    }

    /// The run with the columns beside it.
    fn derive(self, asked: Vec<Query>, pause: &mut Pause) -> Result<Sensitivity, SensitivityError> {
        let mut times: Vec<f64> = self.times.clone();
        times.extend(asked.iter().filter_map(|asked| asked.t.as_ref().ok()));
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut outcome = Outcome::begun(&self.mechanism, self.plan.clone());
        let mut variation = self.variation(0)?;
        let mut driver = self.driver(&mut outcome, Some(variation.jumps.clone()))?;
        let begin = driver.motion();
        let numbers: Vec<&str> = self.inputs.iter().map(|input| input.path.as_str()).collect();
        variation.loosen(driver.holding(), &begin, &numbers);
        variation.names = numbers.iter().map(|&number| number.to_owned()).collect();
        variation.begin(&begin);
        let mut recorder = SensitivityRecorder { times, next: 0, asked: &asked, seen: Vec::new() };
        if recorder.next() == Some(0.0) {
            recorder.at(&mut variation, &begin, 0.0);
        }
        let until = self.plan.until;
        let is_through =
            variation.go(&mut driver, until, &mut outcome, &mut recorder, pause).map_err(stopped)?;
        if !is_through {
            return Err(SensitivityError::Stopped("interrupted".into()));
        }
        let seen = std::mem::take(&mut recorder.seen);
        let lost = variation.lost.clone().or_else(|| {
            let ended = driver.ended_by.as_ref().filter(|name| *name != "observer");
            ended.map(|name| format!("event `{name}` ended the run"))
        });
        let steps = [driver.statistics().steps, variation.steps];
        Ok(self.gathered(asked, &seen, (lost, steps), &variation))
    }

    fn gathered(
        self,
        asked: Vec<Query>,
        seen: &[RecordedTime],
        (lost, steps): (Option<String>, [u64; 2]),
        variation: &Variation,
    ) -> Sensitivity {
        let heads = self.mechanism.outputs.iter().flat_map(|outputs| outputs.heads());
        let outputs: Vec<[String; 2]> =
            heads.map(|(name, unit)| [name.to_owned(), unit.to_owned()]).collect();
        let tolerance = self.plan.tolerance.map_or(TOLERANCE, |known| known.relative);
        let doubt = |value: f64, slopes: &[f64]| result::doubt(&self.inputs, tolerance, value, slopes);
        let measures = asked.iter().enumerate().map(|(k, asked)| {
            let mut measured = Measured {
                name: asked.measure.to_string(),
                unit: asked.output.map_or("s", |output| &outputs[output][1]).to_owned(),
                t: f64::NAN,
                value: f64::NAN,
                slopes: Vec::new(),
                why: None,
            };
            match taken(k, asked, seen, variation) {
                Ok((t, value, slopes)) => match doubt(value, &slopes) {
                    Some(why) => measured.why = Some(why),
                    None => (measured.t, measured.value, measured.slopes) = (t, value, slopes),
                },
                Err(why) => measured.why = Some(lost.clone().filter(|_| why.is_empty()).unwrap_or(why)),
            }
            measured
        });
        let measures = measures.collect();
        let wanted = |seen: &&RecordedTime| self.times.contains(&seen.t);
        let mut rows: Vec<_> = seen
            .iter()
            .filter(wanted)
            .map(|seen| SensitivityRow {
                t: seen.t,
                values: seen.shown().values.clone(),
                slopes: seen.shown().slopes.clone(),
            })
            .collect();
        let unknown = |row: &SensitivityRow| {
            row.values.iter().zip(&row.slopes).find_map(|(value, slopes)| doubt(*value, slopes))
        };
        let end = rows.iter().enumerate().find_map(|(k, row)| Some((k, unknown(row)?)));
        let lost = lost.or_else(|| end.as_ref().map(|(k, why)| format!("at {} s {why}", rows[*k].t)));
        rows.truncate(end.map_or(rows.len(), |(k, _)| k));
        let by_series = variation.expanded.is_some();
        let Self { scene, mut inputs, plan, .. } = self;
        // Corners nearby may have asked for shorter distances on the way, and for steps that are shorter yet.
        for (input, neighbours) in inputs.iter_mut().zip(&variation.neighbours) {
            input.error = neighbours.as_ref().map_or(input.error, |neighbours| neighbours.error);
            input.error = input.error.max(variation.rough);
        }
        Sensitivity { scene, inputs, measures, outputs, rows, until: plan.until, lost, steps, by_series }
    }
}

fn position(known: &[&str], name: &str, what: &str) -> Result<usize, SensitivityError> {
    known.iter().position(|known| *known == name).ok_or_else(|| {
        let hint = match known {
            [] => format!("the scene has no {what}"),
            known => format!("there are: {}", known.join(", ")),
        };
        refused(format!("no {what} is called `{name}`"), &hint)
    })
}

fn refused(what: String, hint: &str) -> SensitivityError {
    SensitivityError::Asked { what, hint: hint.into() }
}

fn stopped(stop: crate::stepping::StepError) -> SensitivityError {
    SensitivityError::Stopped(stop.to_string())
}
