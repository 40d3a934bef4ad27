//! Periodic motions of a driven mechanism, and their Floquet multipliers.
//!
//! ```text
//! P(x) = state one period T after x, in local coordinates x of positions and rates on the constraints
//! periodic motion:   P(x) = x                       Newton's method, damped; whole turns of bodies are none
//! multipliers:       eigenvalues of DP              central differences of two lengths, extrapolated
//! ```
//!
//! Rates are measured in units of 2π/T.  Source: A. H. Nayfeh, B. Balachandran, *Applied Nonlinear Dynamics*
//! (1995), sections 3.2 and 6.4 (shooting); G. Floquet, Ann. Sci. Éc. Norm. Sup. 12 (1883).

use super::local::Local;
use super::period::{check_period, common_period, is_driven};
use super::{DISTINCT, ModesError, Stability};
use crate::arithmetic::sum::larger;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::build::build;
use crate::run::contact::ContactDriver;

use crate::run::plan::Plan;
use crate::run::running::Outcome;
use crate::scene::Scene;
use crate::stepping::Tolerance;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Tolerance of the runs.
const TOLERANCE: f64 = 1e-13;
/// Half lengths of differences: in the search, and for the multipliers \[1\].
const DIFFERENCES: [f64; 2] = [1e-5, 1e-3];
/// Where the difference of two such neighbours comes to so much after a period, it is no derivative any more
/// \[rad, units of length\]: chaotic motions over long periods.
const LINEAR: f64 = 0.1;
/// Most iterations of Newton's method from one start, and longest step \[rad, units of length\].
const ITERATIONS: usize = 40;
const LONGEST: f64 = 0.5;
/// What is left of P(x) - x where a motion is found.
const CLOSED: f64 = 1e-10;
/// After a second period it may be off by so much for each unit of the largest multiplier.
const CLOSED_AGAIN: f64 = 1e-8;
/// Multipliers that differ from magnitude 1 by less, times the root of the largest entry of DP, do so by
/// rounding: a double root is known to half the digits.
const ROUNDING: f64 = 1e-4;
/// What runs leave of the multipliers that are none, for each unit of the largest entry of DP.
const RESOLVED: f64 = 1e-9;
/// What both sides of a motion differ by over the length of a difference where it may be a corner, for each
/// unit of the largest entry of DP, and how much of it is left at half the length: half beside a smooth
/// motion, all beside a corner.
const BENT: f64 = 1e-5;
const KEPT: f64 = 0.6;
/// Most steps of a run to one time, which near a collision would take them without end.
const STEPS_MOST: usize = 20_000;
/// Periods that the scene's start is left to settle for.
const SETTLING: usize = 50;

/// A motion that repeats itself.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PeriodicMotion {
    /// Coordinates at t = 0, angles in (-π, π] but where turns matter \[rad, m\].
    pub phi: Vec<f64>,
    /// Rates there \[rad/s, m/s\].
    pub omega: Vec<f64>,
    /// Whole turns of the bodies in a period.
    pub turns: Vec<i64>,
    /// What is left of the difference of its ends: rad, units of length, and 2π/T of these.
    pub residual: f64,
    /// Real and imaginary parts of its Floquet multipliers, the largest first; of a pair both.  None where it
    /// stays on a corner.
    pub multipliers: Vec<[f64; 2]>,
    /// Multipliers of a smaller magnitude are rounding.
    pub multiplier_rounding: f64,
    /// What a small disturbance does.
    pub stability: Stability,
    /// True where it was found from the scene's start.
    pub from_start: bool,
    /// True where a multiplier is 1: neighbours may be periodic too.
    pub is_family: bool,
    /// True where it stays on a corner or a jump of a law, or touches one and turns back: disturbances to
    /// either side have other multipliers.
    pub is_on_corner: bool,
}

impl PeriodicMotion {
    /// True where both are of families with the same multipliers and turns.
    fn is_of_family(&self, other: &Self) -> bool {
        let near = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-3;
        let is_near = self.multipliers.iter().zip(&other.multipliers).all(near);
        self.is_family && other.is_family && self.turns == other.turns && is_near
    }
}

/// The periodic motions of a scene.
#[derive(Clone, Debug)]
pub struct PeriodicMotions {
    /// The scene.
    pub scene: Scene,
    /// Its mechanism.
    pub mechanism: Arc<Mechanism>,
    /// Degrees of freedom that the drives leave.
    pub degrees_of_freedom: usize,
    /// The period \[s\].
    pub period: f64,
    /// The motions, the most stable first.
    pub motions: Vec<PeriodicMotion>,
    /// How many starts the search had, and how many came to a periodic motion.
    pub starts: [usize; 2],
    /// The other positions asked for: all of them, those in which loops cannot be closed, and those that come
    /// to a position among the starts.
    pub asked: [usize; 3],
    /// How many were left since small differences grow too far within a period.
    pub unstable: usize,
    /// How many came to an equilibrium of a scene that nothing drives, which has every period; none where
    /// something drives it, as rest is a motion like others there.
    pub at_rest: Option<usize>,
    /// What of the scene has no part in this.
    pub left_out: Vec<&'static str>,
}

/// Looks for motions that repeat themselves with the drives of a scene, from its start and from `starts`
/// other positions.  The period \[s\] is that of motors at a constant rate and of sines, or the one given.
///
/// # Errors
/// The scene has none by its nature, or its period is not known.
pub fn periodic(
    scene: &Scene,
    mechanism: &Arc<Mechanism>,
    starts: usize,
    period: Option<f64>,
) -> Result<PeriodicMotions, ModesError> {
    if mechanism.integrals().next().is_some() {
        return Err(ModesError::Integrals);
    }
    if !mechanism.frictions.is_empty() {
        return Err(ModesError::Friction);
    }
    let mechanism = &Arc::new(mechanism.without_events());
    let start = mechanism.start(scene);
    let first = start.rounded();
    let mut local = Local::new(mechanism);
    let period = match period {
        Some(period) => period,
        None => common_period(mechanism)?,
    };
    check_period(mechanism, &local, &first[0], period, scene.until)?;
    let freedom = local.tangent(&first[0]).ncols();
    if freedom == 0 {
        return Err(ModesError::Driven(period));
    }
    let plan = Plan::of_series(mechanism, Tolerance { relative: TOLERANCE, absolute: TOLERANCE }, period);
    let mut shooting =
        Shooting { local, whole: mechanism, plan, period, unit_rate: TAU / period, unstable: 0 };
    let mut found: Vec<PeriodicMotion> = Vec::new();
    let mut count = [0, 0];
    let mut at_rest = (!is_driven(mechanism)).then_some(0);
    let settled = shooting.settled(&first);
    let near = [Some(first.clone()), settled];
    let (others, asked) = shooting.others(scene, starts);
    for (k, begin) in near.into_iter().chain(others.into_iter().map(Some)).enumerate() {
        let Some(begin) = begin else { continue };
        count[0] += 1;
        let Some(motion) = shooting.close(begin, k < 2 && found.is_empty(), freedom) else { continue };
        if let Some(at_rest) = at_rest.as_mut().filter(|_| shooting.is_rest(&motion)) {
            *at_rest += 1;
            continue;
        }
        count[1] += 1;
        // Of a family one is enough.
        let is_known =
            |known: &PeriodicMotion| shooting.is_same(known, &motion) || known.is_of_family(&motion);
        if !found.iter().any(is_known) {
            found.push(motion);
        }
    }
    // Those on corners, which have none, are the last ones.
    let growth =
        |one: &PeriodicMotion| one.multipliers.first().map_or(f64::INFINITY, |[re, im]| re.hypot(*im));
    found.sort_by(|a, b| growth(a).total_cmp(&growth(b)));
    Ok(PeriodicMotions {
        scene: scene.clone(),
        mechanism: Arc::clone(mechanism),
        degrees_of_freedom: freedom,
        period,
        motions: found,
        starts: count,
        asked,
        unstable: shooting.unstable,
        at_rest,
        left_out: if scene.events.is_empty() { Vec::new() } else { vec!["events"] },
    })
}

impl PeriodicMotions {
    /// Coordinates and rates of a motion at so many times of its period, from 0 on, the last one before its
    /// end.
    ///
    /// # Errors
    /// Why the motion ends before.
    pub fn course(&self, motion: &PeriodicMotion, count: usize) -> Result<Vec<[Vec<f64>; 2]>, String> {
        let mut plan = Plan::of_series(
            &self.mechanism,
            Tolerance { relative: TOLERANCE, absolute: TOLERANCE },
            self.period,
        );
        plan.every = self.period / count.max(1) as f64;
        let times: Vec<f64> = (1..count).map(|k| self.period * k as f64 / count as f64).collect();
        let begin = [motion.phi.clone(), motion.omega.clone()];
        let mut all = vec![begin.clone()];
        all.extend(course(&self.mechanism, &plan, &begin, &times)?);
        Ok(all)
    }
}

/// Coordinates and rates at rising times of a run from t = 0.
fn course(
    mechanism: &Arc<Mechanism>,
    plan: &Plan,
    begin: &[Vec<f64>; 2],
    times: &[f64],
) -> Result<Vec<[Vec<f64>; 2]>, String> {
    let mut plan = plan.clone();
    plan.until = times.iter().copied().fold(plan.until, f64::max);
    let mut outcome = Outcome::begun(mechanism, plan.clone());
    let start = Motion::of_doubles(0.0, begin.each_ref().map(Vec::as_slice));
    let driver = build(mechanism, &mut plan, &start).map_err(|stop| stop.what)?;
    let mut driver = ContactDriver::new(Arc::clone(mechanism), driver);
    driver.meet(&mut outcome).map_err(|stop| stop.what)?;
    let mut at = |time: f64| -> Result<[Vec<f64>; 2], String> {
        let mut steps = 0..STEPS_MOST;
        let is_over = &mut || steps.next().is_none();
        let is_there = driver.go(Time::from(time), &mut outcome, is_over).map_err(|stop| stop.what)?;
        is_there.then_some(()).ok_or("it takes too many steps")?;
        let motion = driver.motion();
        let turned = motion.phi.iter().zip(&motion.turns).map(|(phi, turns)| phi.hi + TAU * *turns as f64);
        Ok([turned.collect(), motion.omega.iter().map(|omega| omega.hi).collect()])
    };
    times.iter().map(|&time| at(time)).collect()
}

/// Runs of one period from states beside a state.
struct Shooting<'a> {
    local: Local<'a>,
    whole: &'a Arc<Mechanism>,
    plan: Plan,
    period: f64,
    unit_rate: f64,
    unstable: usize,
}

/// A state and the directions its neighbours lie in.
struct Base {
    state: [Vec<f64>; 2],
    tangent: DMatrix<f64>,
}

impl Shooting<'_> {
    /// A state with its neighbours; `None` where the constraints cannot be kept.
    fn base(&mut self, state: &[Vec<f64>; 2], freedom: usize) -> Option<Base> {
        let state = self.local.projected_moving(state)?;
        let tangent = self.local.tangent(&state[0]);
        (tangent.ncols() == freedom).then_some(Base { state, tangent })
    }

    /// The neighbour of local coordinates x.
    fn beside(&mut self, base: &Base, x: &DVector<f64>) -> Option<[Vec<f64>; 2]> {
        let f = base.tangent.ncols();
        let [y, v] = [x.rows(0, f).into_owned(), x.rows(f, f) * self.unit_rate];
        self.local.beside(&base.state, &base.tangent, [&y, &v])
    }

    /// Where a state is after so many periods, in which the drives go on.
    fn after(&self, state: &[Vec<f64>; 2], periods: u32) -> Option<[Vec<f64>; 2]> {
        let times: Vec<f64> = (1..=periods).map(|k| f64::from(k) * self.period).collect();
        let end = course(self.whole, &self.plan, state, &times).ok()?.pop()?;
        end.iter().flatten().all(|x| x.is_finite()).then_some(end)
    }

    /// Differences of two states without whole turns, in the units of coordinates and rates.
    fn apart(&self, from: &[Vec<f64>; 2], to: &[Vec<f64>; 2]) -> [DVector<f64>; 2] {
        let mut phi: Vec<f64> = to[0].iter().zip(&from[0]).map(|(to, from)| to - from).collect();
        self.local.turns.take_off(&mut phi);
        let n = self.local.unit.len();
        let phi = DVector::from_fn(n, |k, _| phi[k] / self.local.unit[k]);
        let omega = |k: usize| (to[1][k] - from[1][k]) / (self.local.unit[k] * self.unit_rate);
        [phi, DVector::from_fn(n, |k, _| omega(k))]
    }

    /// P(x) less the base, in local coordinates.
    fn image(&mut self, base: &Base, x: &DVector<f64>) -> Option<DVector<f64>> {
        let begin = self.beside(base, x)?;
        let end = self.after(&begin, 1)?;
        let f = base.tangent.ncols();
        let [phi, omega] = self.apart(&base.state, &end).map(|part| base.tangent.transpose() * part);
        Some(DVector::from_fn(2 * f, |k, _| if k < f { phi[k] } else { omega[k - f] }))
    }

    /// DP at the base, where the motion closes or nearly so, by central differences of a half length, and
    /// what both sides differ by over it; `None` where it is too long.
    fn derivative(&mut self, base: &Base, length: f64) -> Option<(DMatrix<f64>, f64)> {
        let size = 2 * base.tangent.ncols();
        let (mut matrix, mut bend) = (DMatrix::zeros(size, size), 0.0);
        for j in 0..size {
            let mut x = DVector::zeros(size);
            x[j] = length;
            let [ahead, behind] = [self.image(base, &x)?, self.image(base, &-x)?];
            let apart = (&ahead - &behind) / 2.0;
            if apart.amax() > LINEAR {
                self.unstable += 1;
                return None;
            }
            bend = larger(bend, (ahead + behind).amax() / (2.0 * length));
            matrix.set_column(j, &(apart / length));
        }
        Some((matrix, bend))
    }

    /// The periodic motion that is reached from a state, if one is.
    fn close(&mut self, begin: [Vec<f64>; 2], from_start: bool, freedom: usize) -> Option<PeriodicMotion> {
        let size = 2 * freedom;
        let zero = DVector::zeros(size);
        let mut base = self.base(&begin, freedom)?;
        let mut left = self.image(&base, &zero)?;
        let mut damping = 0.0;
        for _ in 0..ITERATIONS {
            if left.amax() <= CLOSED {
                break;
            }
            let slope = self.derivative(&base, DIFFERENCES[0])?.0 - DMatrix::identity(size, size);
            let squares = slope.transpose() * &slope;
            let scale = squares.diagonal().amax();
            let mut step = None;
            for _ in 0..10 {
                let shifted = &squares + DMatrix::identity(size, size) * (damping * scale);
                if let Some(mut x) = shifted.lu().solve(&(slope.transpose() * -&left)) {
                    let longest = x.amax();
                    if longest > LONGEST {
                        x *= LONGEST / longest;
                    }
                    let next = self.beside(&base, &x).and_then(|state| self.base(&state, freedom));
                    let taken = next.and_then(|next| self.image(&next, &zero).map(|rest| (next, rest)));
                    if let Some(taken) = taken.filter(|(_, rest)| rest.norm() < left.norm()) {
                        step = Some(taken);
                        break;
                    }
                }
                damping = f64::max(10.0 * damping, 1e-6);
            }
            (base, left) = step?;
            damping = if damping < 1e-9 { 0.0 } else { 0.1 * damping };
        }
        if left.amax() > CLOSED {
            return None;
        }
        self.judged(&base, from_start)
    }

    /// Multipliers of a motion that closes, and whether it closes once more.
    fn judged(&mut self, base: &Base, from_start: bool) -> Option<PeriodicMotion> {
        let rough = self.derivative(base, DIFFERENCES[0])?.0.amax().max(1.0);
        let length = DIFFERENCES[1] / rough;
        let (wide, bend) = self.derivative(base, length)?;
        let (narrow, left) = self.derivative(base, 0.5 * length)?;
        let is_on_corner = left > BENT * rough && left > KEPT * bend;
        let derivative = (narrow * 4.0 - wide) / 3.0;
        let end = self.after(&base.state, 1)?;
        let off =
            |to: &[Vec<f64>; 2]| self.apart(&base.state, to).iter().map(DVector::amax).fold(0.0, f64::max);
        let residual = off(&end);
        if off(&self.after(&base.state, 2)?) > CLOSED_AGAIN * rough {
            return None;
        }
        let mut multipliers: Vec<[f64; 2]> = match is_on_corner {
            true => Vec::new(),
            false => derivative.complex_eigenvalues().iter().map(|value| [value.re, value.im]).collect(),
        };
        let size = |value: &[f64; 2]| value[0].hypot(value[1]);
        multipliers.sort_by(|a, b| {
            size(b).total_cmp(&size(a)).then(b[0].total_cmp(&a[0])).then(b[1].total_cmp(&a[1]))
        });
        let most = multipliers.first().map_or(0.0, size);
        let rounding = ROUNDING * rough.sqrt();
        let stability = if is_on_corner {
            Stability::Undecided
        } else if most > 1.0 + rounding {
            Stability::Unstable
        } else if most < 1.0 - rounding {
            Stability::AsymptoticallyStable
        } else {
            Stability::Stable
        };
        Some(PeriodicMotion {
            phi: self.local.turns.principal(&base.state[0]),
            turns: (base.state[0].iter().zip(&end[0]).take(self.whole.bodies.len()))
                .map(|(from, to)| ((to - from) / TAU).round() as i64)
                .collect(),
            omega: base.state[1].clone(),
            residual,
            is_family: multipliers.iter().any(|[re, im]| (re - 1.0).hypot(*im) < rounding),
            multipliers,
            multiplier_rounding: RESOLVED * rough,
            stability,
            from_start,
            is_on_corner,
        })
    }

    /// Where a state has come to after many periods, where it comes to something.
    fn settled(&self, begin: &[Vec<f64>; 2]) -> Option<[Vec<f64>; 2]> {
        (0..SETTLING).try_fold(begin.clone(), |state, _| self.after(&state, 1))
    }

    /// Other states to begin with, at rest and turning with the drives, and what became of the positions
    /// asked for, as [`Mechanism::other_assemblies`] tells it.
    fn others(&mut self, scene: &Scene, starts: usize) -> (Vec<[Vec<f64>; 2]>, [usize; 3]) {
        let laws = self.whole.constraints.iter().filter_map(|row| row.law.as_ref());
        let turning = laws.map(|law| law.rate).find(|rate| *rate != 0.0).unwrap_or(0.0);
        let bodies = self.whole.bodies.len();
        let rates = |rate: f64| (0..self.local.unit.len()).map(move |k| if k < bodies { rate } else { 0.0 });
        let (others, asked) = self.whole.other_assemblies(scene, starts, self.whole.turns_of_gears());
        let begin = |(k, phi)| [phi, rates(if k % 2 == 0 { turning } else { 0.0 }).collect()];
        (others.into_iter().enumerate().map(begin).collect(), asked)
    }

    /// True where nothing moves in a period.
    fn is_rest(&self, motion: &PeriodicMotion) -> bool {
        let begin = [motion.phi.clone(), motion.omega.clone()];
        // A quarter of a period is a whole one of motions four times as fast.
        let states = course(self.whole, &self.plan, &begin, &[0.25, 0.39].map(|share| share * self.period));
        let stays =
            |then: &[Vec<f64>; 2]| self.apart(&begin, then).iter().all(|apart| apart.amax() < DISTINCT);
        states.is_ok_and(|states| states.iter().all(stays))
    }

    /// True where two motions are the same at t = 0.
    fn is_same(&self, a: &PeriodicMotion, b: &PeriodicMotion) -> bool {
        let of = |one: &PeriodicMotion| [one.phi.clone(), one.omega.clone()];
        self.apart(&of(a), &of(b)).iter().all(|apart| apart.amax() < DISTINCT)
    }
}
