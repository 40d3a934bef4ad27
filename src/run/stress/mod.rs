//! Stress: stiff and extreme scenes by every method, and what becomes of them.
//!
//! A cell of the matrix is one scene by one method, asked for one thing: the end of the motion, to the
//! scene's tolerance.  What a user would do is done: the method begins with its usual setting, and where the
//! estimate of its error, or else a finer run, does not confirm the tolerance, the setting is refined a few
//! times.  It ends in one of four ways.
//!
//! | verdict | what it means |
//! | --- | --- |
//! | right | confirmed, and near enough to the known end; or refused or stopped where only that is right |
//! | refused | the pairing makes no sense, and the reason and an alternative were given |
//! | stopped | a limit, the effort allowed, a step that does not converge, an end that nothing confirms |
//! | wrong | returned as a success, and it is not: a defect of this program |

mod set;
mod steps;
mod trial;

use trial::{EXPANSIONS, Trial};

pub use set::shipped;
pub use steps::{StabilityMap, StepStability, stability};

use super::methods::{METHODS, MethodId};
use super::plan::{Plan, Request};
use super::running::{Run, integrate};
use super::trust::DistanceMetric;
use super::{Limits, reference};
use crate::dynamics::Mechanism;
use crate::scene::{Scene, parse_scene};
use crate::stepping::StepError;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Evaluations of a cell where nobody says: all its runs together.
pub const MAX_EVALUATIONS: u64 = 1_000_000;

/// A scene to be run by every method.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Its name in the matrix.
    pub name: String,
    /// Where its text is from, for messages.
    pub origin: String,
    /// The text.
    pub text: String,
    /// What its end may be off \[rad; positions over the mechanism's size; rates likewise, over 1 rad/s or
    /// themselves where they are larger\].
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
    /// All coordinates and rates at the end: the horizon, or where an event stops the motion.
    Motion {
        /// When that is \[s\].
        t: f64,
        /// Angles of all bodies \[rad\], then positions of those that translate, over the mechanism's size
        /// ([`DistanceMetric`]).
        coordinates: Vec<f64>,
        /// Their rates \[rad/s\], velocities over the size \[1/s\].
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
pub struct StressCell {
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
pub struct StressLine {
    /// The scene.
    pub scene: String,
    /// What it may be off.
    pub tolerance: f64,
    /// By method, in the order asked for.
    pub cells: Vec<StressCell>,
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
pub fn stress(plan: &Stress, finished: &mut dyn FnMut(usize) -> bool) -> Vec<StressLine> {
    let (count, cases) = (plan.count(), plan.cases.iter().map(known).collect::<Vec<Case>>());
    let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let available = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = if plan.threads == 0 { available } else { plan.threads }.min(count.max(1));
    let mut cells: Vec<Option<StressCell>> = vec![None; count];
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
            let cells: Option<Vec<StressCell>> = cells.iter().cloned().collect();
            Some(StressLine { scene: case.name.clone(), tolerance: case.tolerance, cells: cells? })
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
        // An event may stop the motion before the horizon.
        let t = if trial.ended_by.is_some() { trial.last.t } else { scene.until };
        let found = reference(&mechanism, &start, &[trial.stop.is_none().then_some(t)?.into()]).ok()?;
        // What it is off must be nothing beside the tolerance.
        let is_known = found.accuracy.iter().all(|&accuracy| accuracy <= 1e-3 * case.tolerance);
        let motion = found.motions.last().filter(|_| is_known)?;
        let metric = DistanceMetric::new(&mechanism);
        let coordinates = (0..motion.phi.len()).map(|k| motion.unwrapped(k));
        let rates = motion.omega.iter().map(|omega| omega.hi);
        let [coordinates, rates] = [metric.measured(coordinates).collect(), metric.measured(rates).collect()];
        Some(Expected::Motion { t, coordinates, rates })
    };
    let expected = if case.expected == Expected::Unknown {
        end().unwrap_or(Expected::Unknown)
    } else {
        case.expected.clone()
    };
    Case { expected, ..case.clone() }
}

/// One scene by one method.
pub fn cell(case: &Case, method: MethodId, max_evaluations: u64) -> StressCell {
    let mut cell = StressCell {
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
fn verdict(case: &Case, cell: &StressCell) -> Verdict {
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
