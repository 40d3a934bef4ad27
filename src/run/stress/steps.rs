//! Stability: one fixed-step method on a spring of any stiffness with any step.

use super::Verdict;
use super::trial::TrialEnd;
use crate::dynamics::Mechanism;
use crate::run::methods::MethodId;
use crate::run::plan::{Plan, Request};
use crate::run::running::{Run, integrate};
use crate::run::trust::DistanceMetric;
use crate::run::{Limits, Outcome};
use crate::scene::{Scene, parse_scene};
use std::sync::Arc;

/// The scene whose spring gets the stiffnesses.
const SCENE: &str = include_str!("../../../examples/stress/spring_1.json");
/// Horizon \[s\]: enough for the second bar to fall half a turn.
const UNTIL: f64 = 0.5;
/// The longest step is the horizon over this power of two, the shortest over that one.
const HALVINGS: std::ops::RangeInclusive<i32> = 3..=15;
/// Decades of stiffness over that of the scene file.
const DECADES: std::ops::RangeInclusive<i32> = 0..=12;
/// Tolerance of what the ends are compared with.
const EXACT: f64 = 1e-13;
/// Evaluations of one run.
const MAX_EVALUATIONS: u64 = 3_000_000;

/// One step at one stiffness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepStability {
    /// Stiffness \[N/m\].
    pub stiffness: f64,
    /// Step \[s\].
    pub step: f64,
    /// What the angles at the end are off \[rad\]; `None` where the run stopped.
    pub error: Option<f64>,
    /// Right below 1e-4 rad; a stop is a stop, and all else is wrong unless the run says so itself.
    pub verdict: Verdict,
}

/// All steps at all stiffnesses.
#[derive(Clone, Debug, PartialEq)]
pub struct StabilityMap {
    /// The method.
    pub method: MethodId,
    /// Stiffness by stiffness, from the softest, each from the shortest step.
    pub cells: Vec<StepStability>,
    /// Number of stiffnesses.
    pub stiffnesses: usize,
    /// Number of steps.
    pub steps: usize,
}

/// Error below which an end is right \[rad\].
const RIGHT: f64 = 1e-4;

/// Runs a fixed-step method with every step at every stiffness; `finished` may end it with false, and gets
/// the cells done and all there are.
///
/// The scene is that of the source's spring, released from its free length.  A run that comes to its end is
/// compared with the power series at 1e-13.
pub fn stability(method: MethodId, finished: &mut dyn FnMut(usize, usize) -> bool) -> Option<StabilityMap> {
    let mut scene = parse_scene(SCENE, "spring_1.json", &[]).ok()?;
    (scene.until, scene.every) = (UNTIL, UNTIL);
    let soft = scene.springs.first()?.stiffness;
    let (stiffnesses, steps) = (DECADES.count(), HALVINGS.count());
    let mut cells = Vec::with_capacity(stiffnesses * steps);
    for decade in DECADES {
        scene.springs[0].stiffness = soft * libm::exp10(f64::from(decade));
        let mechanism = Arc::new(Mechanism::new(&scene).ok()?);
        let exact = Request { method: Some(MethodId::Taylor), rtol: Some(EXACT), ..Request::default() };
        let metric = DistanceMetric::new(&mechanism);
        let exact = TrialEnd::of(&run(&scene, &mechanism, &exact)?.last, &metric);
        for halvings in HALVINGS.rev() {
            let step = UNTIL / libm::exp2(f64::from(halvings));
            let request = Request {
                method: Some(method),
                step: Some(step),
                max_evaluations: Some(MAX_EVALUATIONS),
                ..Request::default()
            };
            let outcome = run(&scene, &mechanism, &request)?;
            let end = TrialEnd { rates: Vec::new(), ..TrialEnd::of(&outcome.last, &metric) };
            let error = outcome.stop.is_none().then(|| end.apart(&exact));
            let verdict = match error {
                None => Verdict::Stopped,
                Some(error) if error <= RIGHT => Verdict::Right,
                Some(_) => Verdict::Wrong,
            };
            cells.push(StepStability { stiffness: scene.springs[0].stiffness, step, error, verdict });
            if !finished(cells.len(), stiffnesses * steps) {
                return None;
            }
        }
    }
    Some(StabilityMap { method, cells, stiffnesses, steps })
}

fn run(scene: &Scene, mechanism: &Arc<Mechanism>, request: &Request) -> Option<Outcome> {
    let plan = Plan::new(scene, mechanism, request).ok()?;
    integrate(
        Run::new(Arc::clone(mechanism), plan, Limits::default(), &mechanism.start(scene)).ok()?,
        &mut |_| Ok(()),
    )
    .ok()
}
