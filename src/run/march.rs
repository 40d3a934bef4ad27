//! The loop: from output time to output time, through impacts, with limits watched.

use super::drift::{Drift, Limits};
use super::methods::{MethodId, Stabilization};
use super::plan::{Plan, Refusal, Request};
use super::sample::{Sample, Sampler};
use super::trace::Trace;
use crate::arithmetic::DoubleDouble;
use crate::dynamics::canonical::Canonical;
use crate::dynamics::elimination::Elimination;
use crate::dynamics::multiplier::Multiplier;
use crate::dynamics::natural::Natural;
use crate::dynamics::{CompileError, Field, Form, Mechanism, Motion, State, Time};
use crate::scene::Scene;
use crate::stabilization::{Baumgarte, Projected};
use crate::stepping::gauss::Gauss;
use crate::stepping::rattle::Rattle;
use crate::stepping::{Cause, Dop853, Dopri5, Dp5, Dp8, Method, Reached, Seen, StepError, Tally, Taylor};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A mechanism in some form, as a first-order system.
pub trait Problem: Field + Form {}
impl<P: Field + Form> Problem for P {}

/// A problem, its method and its state.
trait March {
    fn advance(&mut self, until: Time) -> Result<Reached, StepError>;
    fn read(&mut self, motion: &mut Motion);
    /// Goes on from another motion, with what the method remembers.
    fn jump(&mut self, motion: &Motion);
    fn tally(&self) -> Tally;
}

struct Marcher<P: ?Sized, M> {
    problem: Box<P>,
    method: M,
    state: State,
    tally: Tally,
}

impl<P: Form + ?Sized, M: Method<P>> March for Marcher<P, M> {
    fn advance(&mut self, until: Time) -> Result<Reached, StepError> {
        self.method.advance(&mut self.problem, &mut self.state, until, &mut self.tally, &mut |_, _| Ok(Seen::Kept))
    }

    fn read(&mut self, motion: &mut Motion) {
        self.problem.read(&self.state, motion);
    }

    fn jump(&mut self, motion: &Motion) {
        let memory = std::mem::take(&mut self.state.memory);
        self.state = self.problem.state(motion);
        self.state.memory = memory;
    }

    fn tally(&self) -> Tally {
        self.tally
    }
}

fn marcher<P: Form + ?Sized + 'static, M: Method<P> + 'static>(problem: Box<P>, method: M, start: &Motion) -> Box<dyn March> {
    let state = problem.state(start);
    Box::new(Marcher { problem, method, state, tally: Tally::default() })
}

/// The form a stabilization marches in, for `N` bodies.
fn form<const N: usize>(mechanism: &Arc<Mechanism>, stabilization: Stabilization, time_constant: f64) -> Box<dyn Problem> {
    let mechanism = Arc::clone(mechanism);
    let accounts = !mechanism.rows.is_empty() || mechanism.is_damped();
    match stabilization {
        Stabilization::Elimination => eliminated::<N>(&mechanism),
        Stabilization::Baumgarte => Box::new(Baumgarte::new(Multiplier::<N, true>::new(mechanism), time_constant)),
        Stabilization::None | Stabilization::Projection if accounts => Box::new(Multiplier::<N, true>::new(mechanism)),
        Stabilization::None | Stabilization::Projection => Box::new(Multiplier::<N, false>::new(mechanism)),
    }
}

/// The form of the independent coordinates for `N` bodies, whether angles are driven or not.
fn eliminated<const N: usize>(mechanism: &Arc<Mechanism>) -> Box<dyn Problem> {
    Box::new(Elimination::<N>::new(Arc::clone(mechanism)))
}

/// The canonical form for `N` bodies.
fn canonical<const N: usize>(mechanism: &Arc<Mechanism>) -> Box<dyn Problem> {
    let mechanism = Arc::clone(mechanism);
    if mechanism.rows.is_empty() && !mechanism.is_damped() {
        Box::new(Canonical::<N, false>::new(mechanism))
    } else {
        Box::new(Canonical::<N, true>::new(mechanism))
    }
}

/// `sized!(n, f(args))` calls `f::<n>` for the sizes compiled in, and `f::<0>` for any other.
macro_rules! sized {
    ($n:expr, $function:ident($($argument:expr),*)) => {
        match $n {
            1 => $function::<1>($($argument),*),
            2 => $function::<2>($($argument),*),
            3 => $function::<3>($($argument),*),
            4 => $function::<4>($($argument),*),
            5 => $function::<5>($($argument),*),
            6 => $function::<6>($($argument),*),
            _ => $function::<0>($($argument),*),
        }
    };
}

/// Builds what a plan asks for; Baumgarte's time constant is measured first where none was given.
fn build(mechanism: &Arc<Mechanism>, plan: &mut Plan, start: &Motion) -> Result<Box<dyn March>, StepError> {
    let n = mechanism.bodies.len();
    let tolerance = plan.tolerance.unwrap_or_default();
    let step = plan.step.unwrap_or(0.0);
    if plan.stabilization == Stabilization::Baumgarte && plan.time_constant.is_none() {
        let found = pilot(mechanism, plan, start)?;
        plan.notes.push(format!("Baumgarte's time constant is {found:.3e} s, five mean steps of a pilot run"));
        plan.time_constant = Some(found);
    }
    let projected = plan.stabilization == Stabilization::Projection;
    let problem = || sized!(n, form(mechanism, plan.stabilization, plan.time_constant.unwrap_or(1.0)));
    Ok(match plan.method {
        MethodId::Dopri5 => marcher(problem(), Dopri5::new(tolerance), start),
        MethodId::Dop853 => marcher(problem(), Dop853::new(tolerance), start),
        MethodId::Dp5 if projected => marcher(problem(), Projected::new(Dp5::new(tolerance)), start),
        MethodId::Dp8 if projected => marcher(problem(), Projected::new(Dp8::new(tolerance)), start),
        MethodId::Dp5 => marcher(problem(), Dp5::new(tolerance), start),
        MethodId::Dp8 => marcher(problem(), Dp8::new(tolerance), start),
        MethodId::Taylor => marcher(sized!(n, eliminated(mechanism)), Taylor::new(tolerance), start),
        MethodId::Gauss(stages) => {
            let gauss = Gauss::new(stages, step)
                .ok_or_else(|| cannot_begin(plan, format!("no Gauss method has {stages} stages and step {step} s")))?;
            marcher(sized!(n, canonical(mechanism)), gauss, start)
        }
        MethodId::Rattle(composition) => {
            let natural = Natural::new(Arc::clone(mechanism)).map_err(|error| cannot_begin(plan, error.to_string()))?;
            marcher(Box::new(natural), Rattle::new(composition, step), start)
        }
    })
}

fn cannot_begin(plan: &Plan, what: String) -> StepError {
    let hint = "use dp8".into();
    StepError { cause: Cause::Unsuited, method: plan.method.to_string(), t: 0.0, step: plan.step.unwrap_or(0.0), what, hint }
}

/// Five mean steps of the unstabilized run over its first output intervals (at most twenty) \[s\].
fn pilot(mechanism: &Arc<Mechanism>, plan: &Plan, start: &Motion) -> Result<f64, StepError> {
    let mut plain = Plan { stabilization: Stabilization::None, ..plan.clone() };
    let mut marcher = build(mechanism, &mut plain, start)?;
    let rows = plan.rows.min(20);
    for row in 1..=rows {
        if let Reached::Event(_) = marcher.advance(plan.time(row))? {
            break;
        }
    }
    let mut motion = Motion::default();
    marcher.read(&mut motion);
    Ok(5.0 * motion.time.hi.max(f64::MIN_POSITIVE) / marcher.tally().steps.max(1) as f64)
}

/// A run about to begin.
pub struct Run {
    mechanism: Arc<Mechanism>,
    plan: Plan,
    limits: Limits,
    marcher: Box<dyn March>,
}

/// One impact of a run.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Strike {
    /// Time \[s\].
    pub t: f64,
    /// Name of the wall.
    pub wall: String,
    /// Impulse on the point along the wall's normal \[N·s\].
    pub impulse: f64,
    /// Normal velocity before it \[m/s\].
    pub approach: f64,
    /// Energy lost \[J\].
    pub energy_lost: f64,
}

/// Impacts kept by name; the rest are counted.
const STRIKES_KEPT: usize = 1000;
/// Impacts between two output times beyond which a point counts as resting.
const STRIKES_MOST: usize = 10_000;

/// How a run ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The plan as carried out.
    pub plan: Plan,
    /// The last sample.
    pub last: Sample,
    /// Counts.
    pub tally: Tally,
    /// Drift.
    pub drift: Drift,
    /// Samples for charts.
    pub trace: Trace,
    /// The first impacts.
    pub strikes: Vec<Strike>,
    /// Number of impacts.
    pub strike_count: u64,
    /// Energy lost in them \[J\].
    pub strike_loss: f64,
    /// Time spent between the first output time and the last.
    pub wall: Duration,
    /// Why it ended before its horizon.
    pub stop: Option<StepError>,
}

/// What ends a run without an outcome.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The scene has no equations.
    #[error("{0}")]
    Compile(#[from] CompileError),
    /// The request makes no sense for the scene.
    #[error("{0}")]
    Refused(#[from] Refusal),
    /// The method could not begin.
    #[error("{0}")]
    Step(#[from] StepError),
    /// An observer failed to write.
    #[error("{0}")]
    Observer(#[from] std::io::Error),
}

impl Run {
    /// Prepares a run from a motion.
    ///
    /// # Errors
    /// A method that cannot begin there.
    pub fn new(mechanism: Arc<Mechanism>, mut plan: Plan, limits: Limits, start: &Motion) -> Result<Self, StepError> {
        let marcher = build(&mechanism, &mut plan, start)?;
        Ok(Self { mechanism, plan, limits, marcher })
    }

    /// The plan as it will be carried out.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
}

/// A scene from its start to its horizon in one call: compiles, plans, marches.
///
/// # Errors
/// Whatever keeps it from beginning, and what the observer failed with; a stop on the way is part of the [`Outcome`].
pub fn simulate(scene: &Scene, request: &Request, observer: &mut dyn FnMut(&Sample) -> std::io::Result<()>) -> Result<Outcome, RunError> {
    let mechanism = Arc::new(Mechanism::new(scene)?);
    let plan = Plan::new(scene, &mechanism, request)?;
    let start = mechanism.start(scene);
    march(Run::new(mechanism, plan, Limits::default(), &start)?, observer)
}

/// Marches a run to its horizon, shows every sample to `observer`, and tells how it ended.
///
/// A stop of the method is part of the [`Outcome`]; everything up to it has been shown.
///
/// # Errors
/// What the observer failed with.
pub fn march(run: Run, observer: &mut dyn FnMut(&Sample) -> std::io::Result<()>) -> Result<Outcome, RunError> {
    let Run { mechanism, plan, limits, mut marcher } = run;
    let mut sampler = Sampler::new(Arc::clone(&mechanism));
    let mut outcome = Outcome {
        last: Sample::default(),
        tally: Tally::default(),
        drift: Drift::new(&mechanism, plan.until),
        trace: Trace::default(),
        strikes: Vec::new(),
        strike_count: 0,
        strike_loss: 0.0,
        wall: Duration::ZERO,
        stop: None,
        plan,
    };
    let mut motion = Motion::default();
    let mut resting = strike_at_start(&mechanism, &mut *marcher, &mut sampler, &mut outcome);
    let begin = Instant::now();
    for row in 0..=outcome.plan.rows {
        let stopped = resting.take().map_or_else(|| go(&mechanism, &mut *marcher, row, &mut sampler, &mut outcome), Err);
        marcher.read(&mut motion);
        let sample = sampler.take(&motion);
        // A stop before any progress leaves the state of the row before.
        if row == 0 || sample.t > outcome.last.t {
            observer(sample)?;
            outcome.trace.see(sample);
        }
        let exceeded = outcome.drift.see(sample, &limits);
        outcome.stop = stopped
            .err()
            .or_else(|| exceeded.err().map(|what| drift_stop(&outcome.plan, sample.t, what)))
            .or_else(|| (!sample.is_finite()).then(|| not_finite(&outcome.plan, sample.t)));
        outcome.last.clone_from(sample);
        if outcome.stop.is_some() {
            break;
        }
    }
    outcome.wall = begin.elapsed();
    outcome.tally = marcher.tally();
    Ok(outcome)
}

/// Advances to an output row, through impacts.
fn go(mechanism: &Mechanism, marcher: &mut dyn March, row: u64, sampler: &mut Sampler, outcome: &mut Outcome) -> Result<(), StepError> {
    if row == 0 {
        return Ok(());
    }
    let until = outcome.plan.time(row);
    for _ in 0..STRIKES_MOST {
        match marcher.advance(until)? {
            Reached::Until => return Ok(()),
            Reached::Event(contact) => strike(mechanism, marcher, contact, sampler, outcome)?,
        }
    }
    let mut motion = Motion::default();
    marcher.read(&mut motion);
    Err(resting(&outcome.plan, motion.time.hi, format!("more than {STRIKES_MOST} impacts before the next output time")))
}

/// Lets the impact at a wall take effect.
fn strike(
    mechanism: &Mechanism,
    marcher: &mut dyn March,
    contact: usize,
    sampler: &mut Sampler,
    outcome: &mut Outcome,
) -> Result<(), StepError> {
    let mut motion = Motion::default();
    marcher.read(&mut motion);
    let before = sampler.balance(&motion);
    let phi: Vec<f64> = motion.phi.iter().map(|phi| phi.hi).collect();
    let omega: Vec<f64> = motion.omega.iter().map(|omega| omega.hi).collect();
    let wall = &mechanism.contacts[contact].row.name;
    let Some(impact) = mechanism.strike(contact, motion.time, &phi, &omega) else {
        return Err(resting(&outcome.plan, motion.time.hi, format!("the motors drive a point into wall {wall}")));
    };
    motion.omega = impact.omega.iter().map(|&omega| DoubleDouble::from(omega)).collect();
    motion.work = motion.work + impact.motor_work;
    marcher.jump(&motion);
    let change = sampler.balance(&motion) - before;
    sampler.shift(change);
    outcome.strike_count += 1;
    outcome.strike_loss -= change.hi;
    if outcome.strikes.len() < STRIKES_KEPT {
        outcome.strikes.push(Strike {
            t: motion.time.hi,
            wall: wall.clone(),
            impulse: impact.impulse,
            approach: impact.approach,
            energy_lost: -change.hi,
        });
    }
    Ok(())
}

/// A scene may begin with a point on its wall, moving into it; the reference of the energy is what is left after that.
fn strike_at_start(mechanism: &Mechanism, marcher: &mut dyn March, sampler: &mut Sampler, outcome: &mut Outcome) -> Option<StepError> {
    for contact in 0..mechanism.contacts.len() {
        let mut motion = Motion::default();
        marcher.read(&mut motion);
        let z: Vec<_> = motion.phi.iter().map(|phi| crate::arithmetic::Complex::unit(phi.hi)).collect();
        if mechanism.contacts[contact].row.gap(&z) > 1e-12 {
            continue;
        }
        let already = outcome.strike_count;
        if let Err(stop) = strike(mechanism, marcher, contact, sampler, outcome) {
            return Some(stop);
        }
        if outcome.strikes.last().is_some_and(|strike| strike.approach >= 0.0) {
            // Leaving already: no impact.
            outcome.strikes.pop();
            outcome.strike_count = already;
        }
    }
    None
}

fn resting(plan: &Plan, t: f64, what: String) -> StepError {
    let hint = "sustained contact is not modelled: raise the restitution or end the run before".into();
    StepError { cause: Cause::RestingContact, method: plan.method.to_string(), t, step: 0.0, what, hint }
}

fn not_finite(plan: &Plan, t: f64) -> StepError {
    let what = "energies, torques or velocities are beyond the numbers a double holds".into();
    let hint = "look for masses, rates or stiffnesses far out of proportion".into();
    StepError { cause: Cause::NotFinite, method: plan.method.to_string(), t, step: plan.step.unwrap_or(0.0), what, hint }
}

fn drift_stop(plan: &Plan, t: f64, what: String) -> StepError {
    let hint = if plan.step.is_some() { "shorten the step" } else { "tighten the tolerance" };
    StepError { cause: Cause::DriftLimit, method: plan.method.to_string(), t, step: plan.step.unwrap_or(0.0), what, hint: hint.into() }
}
