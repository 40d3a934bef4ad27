//! Stress: stiff and extreme scenes by every method, and what becomes of them.
//!
//! A cell of the matrix is one scene by one method, asked for one thing: the end of the motion, to the
//! scene's tolerance.  What a user would do is done: the method begins with its usual setting, and where the
//! estimate of its error, or else a finer run, does not confirm the tolerance, the setting is refined a few
//! times.  It ends in one of four ways.
//!
//! | verdict | what it means |
//! | --- | --- |
//! | right | confirmed, and within the tolerance of the known end; or refused or stopped where that is the only right answer |
//! | refused | the pairing makes no sense, and the reason and an alternative were given |
//! | stopped | a typed stop: a limit, the effort allowed, a step that does not converge, or an end that nothing confirms |
//! | wrong | returned as a success, and it is not: a defect of this program |

mod set;
mod steps;

pub use set::shipped;
pub use steps::{Stability, StabilityMap, stability};

use super::drift::larger;
use super::methods::{METHODS, MethodId};
use super::plan::{Plan, Request};
use super::running::{Outcome, Run, integrate};
use super::trust::{How, Level};
use super::{Limits, Sample, reference};
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::Mechanism;
use crate::scene::{Scene, parse_scene};
use crate::stepping::{Cause, StepError, Tolerance};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Evaluations of a cell where nobody says: all its runs together.
pub const MAX_EVALUATIONS: u64 = 1_000_000;
/// How often a setting is refined.
const REFINEMENTS: u32 = 3;
/// By how much, of a tolerance and of a step.
const FINER: (f64, f64) = (1e-2, 0.5);
/// Steps of the power series up to which an end is looked for in double-double.
const EXPANSIONS: u64 = 20_000;
/// Share of the tolerance below which a run's own estimate is enough.
const SURE: f64 = 1e-3;
/// The error of the finer of two runs over their difference, at most: methods of higher order leave less,
/// steps across a corner of the force as much.
const MARGIN: f64 = 3.0;
/// Least tolerance of a refinement.
const LEAST: f64 = 1e-13;

/// A scene to be run by every method.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Its name in the matrix.
    pub name: String,
    /// Where its text is from, for messages.
    pub origin: String,
    /// The text.
    pub text: String,
    /// What its end may be off \[rad; rates likewise, over 1 rad/s or themselves where they are larger\].
    pub tolerance: f64,
    /// What is known of it.
    pub expected: Expected,
}

/// What is known of a case.
#[derive(Clone, Debug, PartialEq)]
pub enum Expected {
    /// The last bodies' angles \[rad\] and rates \[rad/s\] at the horizon; no rates where they say too
    /// little.
    End {
        /// Angles \[rad\].
        angles: Vec<f64>,
        /// Rates \[rad/s\].
        rates: Vec<f64>,
    },
    /// That the balance of energy is kept to the tolerance.
    Energy,
    /// That there is no such motion.
    Refusal,
    /// That it cannot go on beyond a certain time, for want of what is named.
    Stop(String),
    /// Nothing yet: [`stress`] looks for the end by the power series in double-double; where it finds none,
    /// an end that a finer run confirms counts.
    Unknown,
}

/// What became of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// A right answer.
    Right,
    /// A typed refusal.
    Refused,
    /// A typed stop.
    Stopped,
    /// A wrong answer given for right.
    Wrong,
}

/// One scene by one method.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Cell {
    /// The method.
    pub method: &'static str,
    /// What became of it.
    pub verdict: Verdict,
    /// The last setting, in words of the command line: `--rtol 1e-9`.
    pub setting: Option<String>,
    /// What the end is off \[rad, as the tolerance\].
    pub error: Option<f64>,
    /// What it was said to be off.
    pub estimate: Option<f64>,
    /// The largest energy drift over the scale.
    pub energy: Option<f64>,
    /// Evaluations of all its runs.
    pub evaluations: u64,
    /// Runs.
    pub runs: u32,
    /// The stop, where it is one.
    pub stop: Option<StepError>,
    /// The refusal, where it is one.
    pub refusal: Option<String>,
}

/// A case and its cells.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Line {
    /// The scene.
    pub scene: String,
    /// What it may be off.
    pub tolerance: f64,
    /// By method, in the order asked for.
    pub cells: Vec<Cell>,
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Stress {
    /// The cases.
    pub cases: Vec<Case>,
    /// The methods.
    pub methods: Vec<MethodId>,
    /// Evaluations of a cell.
    pub max_evaluations: u64,
    /// Threads; 0: as many as there are processors.
    pub threads: usize,
}

impl Default for Stress {
    /// The shipped set by every method.
    fn default() -> Self {
        Self {
            cases: shipped(),
            methods: METHODS.iter().map(|info| info.id).collect(),
            max_evaluations: MAX_EVALUATIONS,
            threads: 0,
        }
    }
}

impl Stress {
    /// Number of cells.
    pub fn count(&self) -> usize {
        self.cases.len() * self.methods.len()
    }
}

/// Runs every cell; `finished`, told how many there are, may end it with false.  The cells are the same
/// whatever the number of threads.
///
/// Where it was ended, lines that are not whole are left out.
pub fn stress(plan: &Stress, finished: &mut dyn FnMut(usize) -> bool) -> Vec<Line> {
    let (count, cases) = (plan.count(), plan.cases.iter().map(known).collect::<Vec<Case>>());
    let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let available = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = if plan.threads == 0 { available } else { plan.threads }.min(count.max(1));
    let mut cells: Vec<Option<Cell>> = vec![None; count];
    std::thread::scope(|scope| {
        let (send, receive) = std::sync::mpsc::channel();
        for _ in 0..threads {
            let (send, next, is_over, cases) = (send.clone(), &next, &is_over, &cases);
            scope.spawn(move || {
                while !is_over.load(Ordering::Relaxed) {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(index / plan.methods.len().max(1)).filter(|_| index < count)
                    else {
                        break;
                    };
                    let cell = cell(case, plan.methods[index % plan.methods.len()], plan.max_evaluations);
                    if send.send((index, cell)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(send);
        for (done, (index, cell)) in receive.iter().enumerate() {
            cells[index] = Some(cell);
            if !finished(done + 1) {
                is_over.store(true, Ordering::Relaxed);
            }
        }
    });
    let lines = plan.cases.iter().zip(cells.chunks(plan.methods.len().max(1)));
    lines
        .filter_map(|(case, cells)| {
            let cells: Option<Vec<Cell>> = cells.iter().cloned().collect();
            Some(Line { scene: case.name.clone(), tolerance: case.tolerance, cells: cells? })
        })
        .collect()
}

/// The case with its end, where that is to be had at a bearable cost.
fn known(case: &Case) -> Case {
    let end = || {
        let (scene, mechanism) = prepared(case).ok()?;
        let start = mechanism.start(&scene);
        let request = Request {
            method: Some(MethodId::Taylor),
            every: Some(scene.until),
            max_evaluations: Some(EXPANSIONS),
            ..Request::default()
        };
        let plan = Plan::new(&scene, &mechanism, &request).ok()?;
        let trial =
            integrate(Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start).ok()?, &mut |_| {
                Ok(())
            })
            .ok()?;
        let found =
            reference(&mechanism, &start, &[trial.stop.is_none().then_some(scene.until)?.into()]).ok()?;
        // What it is off must be nothing beside the tolerance.
        let is_known = found.accuracy.iter().all(|&accuracy| accuracy <= 1e-3 * case.tolerance);
        let motion = found.motions.last().filter(|_| is_known)?;
        let bodies = mechanism.bodies.len();
        let angles = (0..bodies)
            .map(|k| (motion.phi[k] + DoubleDouble::TAU.scale(motion.turns[k] as f64)).hi)
            .collect();
        Some(Expected::End { angles, rates: motion.omega[..bodies].iter().map(|omega| omega.hi).collect() })
    };
    let expected = if case.expected == Expected::Unknown {
        end().unwrap_or(Expected::Unknown)
    } else {
        case.expected.clone()
    };
    Case { expected, ..case.clone() }
}

/// One scene by one method.
pub fn cell(case: &Case, method: MethodId, max_evaluations: u64) -> Cell {
    let mut cell = Cell {
        method: method.info().name,
        verdict: Verdict::Refused,
        setting: None,
        error: None,
        estimate: None,
        energy: None,
        evaluations: 0,
        runs: 0,
        stop: None,
        refusal: None,
    };
    let refusal = match prepared(case) {
        Ok((scene, mechanism)) => {
            Trial { case, scene: &scene, mechanism: &mechanism, method, max_evaluations }.run(&mut cell).err()
        }
        Err(refusal) => Some(refusal),
    };
    cell.refusal = refusal;
    cell.verdict = verdict(case, &cell);
    cell
}

/// The scene and its equations, or why there are none.
fn prepared(case: &Case) -> Result<(Scene, Arc<Mechanism>), String> {
    let scene = parse_scene(&case.text, &case.origin, &[]).map_err(|error| error.to_string())?;
    let mechanism = Mechanism::new(&scene).map_err(|error| error.to_string())?;
    Ok((scene, Arc::new(mechanism)))
}

/// What a finished cell amounts to.
fn verdict(case: &Case, cell: &Cell) -> Verdict {
    let is_named = |culprit: &str| cell.stop.as_ref().is_some_and(|stop| stop.what.contains(culprit));
    match &case.expected {
        Expected::Refusal if cell.refusal.is_some() => Verdict::Right,
        Expected::Stop(culprit) if is_named(culprit) => Verdict::Right,
        _ if cell.refusal.is_some() => Verdict::Refused,
        _ if cell.stop.is_some() => Verdict::Stopped,
        Expected::Unknown => Verdict::Right,
        // Not a number is not within the tolerance.
        _ if cell.error.is_some_and(|error| error <= case.tolerance) => Verdict::Right,
        _ => Verdict::Wrong,
    }
}

/// A cell under way.
struct Trial<'a> {
    case: &'a Case,
    scene: &'a Scene,
    mechanism: &'a Arc<Mechanism>,
    method: MethodId,
    max_evaluations: u64,
}

/// Angles and rates at the end of a run.
#[derive(Clone, Debug)]
struct End {
    angles: Vec<f64>,
    rates: Vec<f64>,
}

impl End {
    fn of(sample: &Sample, bodies: usize) -> Self {
        let last = |values: &[f64], count: usize| values[count.saturating_sub(bodies)..count].to_vec();
        let count = sample.centre.len();
        Self { angles: last(&sample.phi, count), rates: last(&sample.omega, count) }
    }

    /// The largest difference; rates count over 1 rad/s or themselves, and not at all where `other` has none.
    fn apart(&self, other: &Self) -> f64 {
        let angles = self.angles.iter().zip(&other.angles).map(|(a, b)| (a - b).abs());
        let rates = self.rates.iter().zip(&other.rates).map(|(a, b)| (a - b).abs() / b.abs().max(1.0));
        angles.chain(rates).fold(0.0, larger)
    }
}

impl Trial<'_> {
    /// Runs it until its end is confirmed, or is not to be had.
    fn run(&self, cell: &mut Cell) -> Result<(), String> {
        let mut before: Option<End> = None;
        for refinement in 0..=REFINEMENTS {
            let request = self.request(refinement, cell)?;
            let plan =
                Plan::new(self.scene, self.mechanism, &request).map_err(|refusal| refusal.to_string())?;
            cell.setting = Some(setting(&plan));
            let start = self.mechanism.start(self.scene);
            cell.runs += 1;
            let outcome = match Run::new(Arc::clone(self.mechanism), plan, Limits::default(), &start) {
                Ok(run) => integrate(run.trusted(Level::Auto, &start), &mut |_| Ok(()))
                    .map_err(|error| error.to_string())?,
                Err(stop) => {
                    cell.stop = Some(stop);
                    return Ok(());
                }
            };
            cell.evaluations += outcome.statistics.evaluations;
            cell.energy = Some(outcome.drift.energy.max);
            cell.stop = outcome.stop.clone();
            if let Some(stop) = &outcome.stop {
                // A finer setting may mend what is no matter of effort.
                if matches!(
                    stop.cause,
                    Cause::NotConverged | Cause::ProjectionFailed | Cause::DriftLimit | Cause::BranchLost
                ) && self.is_left(cell)
                {
                    before = None;
                    continue;
                }
                return Ok(());
            }
            let end = self.end(&outcome);
            self.score(&outcome, &end, cell);
            // What a run knows is the error of its angles, and it knows the more the smoother its motion:
            // where that is not far below what is asked for, and for the rates, a finer run has its say.
            let known = outcome
                .trust
                .as_ref()
                .filter(|trust| trust.how == How::ReferenceSolution && trust.at >= self.scene.until);
            let known = known.and_then(|trust| trust.error_estimate);
            let finer = before.as_ref().map(|before| MARGIN * end.apart(before));
            cell.estimate = match (known, finer) {
                (Some(known), None) if known > SURE * self.case.tolerance => None,
                (Some(known), finer) => Some(finer.map_or(known, |finer| finer.max(known))),
                (None, finer) => finer,
            };
            let is_no_matter_of_ends = matches!(self.case.expected, Expected::Energy | Expected::Stop(_));
            if is_no_matter_of_ends || cell.estimate.is_some_and(|estimate| estimate <= self.case.tolerance) {
                return Ok(());
            }
            before = Some(end);
            if !self.is_left(cell) {
                break;
            }
        }
        if cell.stop.is_none() {
            cell.stop = Some(self.unconfirmed(cell));
        }
        Ok(())
    }

    /// True while there is effort for another run.
    fn is_left(&self, cell: &Cell) -> bool {
        cell.evaluations < self.max_evaluations
    }

    /// The request of a refinement.
    fn request(&self, refinement: u32, cell: &Cell) -> Result<Request, String> {
        let horizon = self.scene.until;
        let max_evaluations = Some(self.max_evaluations.saturating_sub(cell.evaluations).max(1));
        let request = Request {
            method: Some(self.method),
            every: Some(horizon / 100.0),
            max_evaluations,
            ..Request::default()
        };
        if self.method.is_adaptive() {
            let tolerance = (Tolerance::default().relative * FINER.0.powi(refinement as i32)).max(LEAST);
            return Ok(Request { rtol: Some(tolerance), ..request });
        }
        let usual = Plan::new(self.scene, self.mechanism, &request).map_err(|refusal| refusal.to_string())?;
        let step = usual.step.map(|step| step * FINER.1.powi(refinement as i32));
        Ok(Request { step, ..request })
    }

    fn end(&self, outcome: &Outcome) -> End {
        let bodies = match &self.case.expected {
            Expected::End { angles, .. } => angles.len(),
            _ => self.mechanism.bodies.len(),
        };
        let mut end = End::of(&outcome.last, bodies);
        if let Expected::End { rates, .. } = &self.case.expected
            && rates.is_empty()
        {
            end.rates.clear();
        }
        end
    }

    /// What the end is off, where that is known.
    fn score(&self, outcome: &Outcome, end: &End, cell: &mut Cell) {
        cell.error = match &self.case.expected {
            Expected::End { angles, rates } => {
                Some(end.apart(&End { angles: angles.clone(), rates: rates.clone() }))
            }
            Expected::Energy | Expected::Stop(_) => Some(outcome.drift.energy.max),
            Expected::Refusal | Expected::Unknown => None,
        };
    }

    /// The stop of a run whose end nothing confirms.
    fn unconfirmed(&self, cell: &Cell) -> StepError {
        let off = cell.estimate.map_or("unknown".to_owned(), |estimate| format!("about {estimate:.1e}"));
        StepError {
            cause: Cause::DriftLimit,
            method: cell.method.to_owned(),
            t: self.scene.until,
            step: 0.0,
            what: format!("the error of the end is {off}, and {:.0e} was asked for", self.case.tolerance),
            hint: "allow more with --max-evaluations, or take a method of higher order".into(),
        }
    }
}

/// A setting in words of the command line.
fn setting(plan: &Plan) -> String {
    match (plan.step, plan.tolerance) {
        (Some(step), _) => format!("--step {step:e}"),
        (None, tolerance) => format!("--rtol {:e}", tolerance.unwrap_or_default().relative),
    }
}
