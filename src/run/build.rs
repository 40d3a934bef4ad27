//! From a plan to a driver: the form of the equations a stabilization asks for, the method, and what is
//! measured before the first step.

use super::contact::ContactDriver;
use super::driver::{Driver, driver};
use super::impact_monitor::closed;
use super::methods::{MethodId, Stabilization};
use super::plan::Plan;
use super::running::Outcome;
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::shown::about;
use crate::dynamics::canonical::Canonical;
use crate::dynamics::elimination::Elimination;
use crate::dynamics::looped::Looped;
use crate::dynamics::multiplier::Multiplier;
use crate::dynamics::natural::Natural;
use crate::dynamics::{Form, Mechanism, Motion, OdeSystem};
use crate::stabilization::{Baumgarte, Projected, SymmetricGauss};
use crate::stepping::gauss::Gauss;
use crate::stepping::rattle::Rattle;
use crate::stepping::{Cause, Dop853, Dopri5, Dp5, Dp8, Radau, StepError, Taylor};
use std::sync::Arc;

/// A mechanism in some form, as a first-order system.
pub trait Problem: OdeSystem + Form + Send {}
impl<P: OdeSystem + Form + Send> Problem for P {}

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

/// The form a stabilization integrates in, for `N` bodies.
fn form<const N: usize>(
    mechanism: &Arc<Mechanism>,
    stabilization: Stabilization,
    time_constant: f64,
) -> Box<dyn Problem> {
    let mechanism = Arc::clone(mechanism);
    if matches!(stabilization, Stabilization::None | Stabilization::Projection)
        && let Some(looped) = Looped::new(Arc::clone(&mechanism))
    {
        return Box::new(looped);
    }
    match stabilization {
        Stabilization::Elimination => eliminated::<N>(&mechanism),
        Stabilization::Baumgarte => {
            Box::new(Baumgarte::new(Multiplier::<N, true>::new(mechanism), time_constant))
        }
        Stabilization::None | Stabilization::Projection if mechanism.has_work_integral() => {
            Box::new(Multiplier::<N, true>::new(mechanism))
        }
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
    if mechanism.has_work_integral() {
        Box::new(Canonical::<N, true>::new(mechanism))
    } else {
        Box::new(Canonical::<N, false>::new(mechanism))
    }
}

/// Builds what a plan asks for; Baumgarte's time constant is measured first where none was given.
pub(super) fn build(
    mechanism: &Arc<Mechanism>,
    plan: &mut Plan,
    start: &Motion,
) -> Result<Box<dyn Driver>, StepError> {
    // What cannot begin does not where the motion is.
    let there = |stop: StepError| StepError { t: start.time.hi.max(stop.t), ..stop };
    let mut driver = built(mechanism, plan, start).map_err(there)?;
    driver.guard(closed(plan.tolerance.unwrap_or_default().relative));
    Ok(driver)
}

fn built(mechanism: &Arc<Mechanism>, plan: &mut Plan, start: &Motion) -> Result<Box<dyn Driver>, StepError> {
    let n = mechanism.size();
    let tolerance = plan.tolerance.unwrap_or_default();
    let step = plan.step.unwrap_or(0.0);
    if plan.stabilization == Stabilization::Baumgarte && plan.time_constant.is_none() {
        let found = pilot(mechanism, plan, start)?;
        plan.notes
            .push(format!("Baumgarte's time constant is {} s, five mean steps of a pilot run", about(found)));
        plan.time_constant = Some(found);
    }
    // A saved plan may ask for it where there is nothing to be projected, and no energy kept of it.
    let projected = plan.stabilization == Stabilization::Projection && mechanism.has_work_integral();
    let problem = || sized!(n, form(mechanism, plan.stabilization, plan.time_constant.unwrap_or(1.0)));
    Ok(match plan.method {
        MethodId::Custom => {
            let Some(custom) = &plan.integrator else {
                return Err(cannot_begin(
                    plan,
                    "the integrator of this run is from outside the crate, and was not given again".into(),
                ));
            };
            let integrator = custom.make();
            if projected {
                driver(problem(), Projected::new(integrator), start)
            } else {
                driver(problem(), integrator, start)
            }
        }
        MethodId::Dopri5 => driver(problem(), Dopri5::new(tolerance), start),
        MethodId::Dop853 => driver(problem(), Dop853::new(tolerance), start),
        MethodId::Dp5 if projected => driver(problem(), Projected::new(Dp5::new(tolerance)), start),
        MethodId::Dp8 if projected => driver(problem(), Projected::new(Dp8::new(tolerance)), start),
        MethodId::Dp5 => driver(problem(), Dp5::new(tolerance), start),
        MethodId::Dp8 => driver(problem(), Dp8::new(tolerance), start),
        MethodId::Taylor if mechanism.vibration.is_some() => {
            return Err(cannot_begin(
                plan,
                "the mean force of a rigid spring's vibration has no series".into(),
            ));
        }
        MethodId::Taylor if plan.in_double_double => {
            let order = plan.order.unwrap_or_else(|| order_in_double_double(tolerance.relative));
            exact(mechanism, start, order, tolerance.relative)
        }
        MethodId::Taylor => {
            let taylor = plan.series(tolerance);
            match plan.stabilization {
                Stabilization::None if mechanism.constraints.is_empty() && mechanism.frictions.is_empty() => {
                    driver(sized!(n, eliminated(mechanism)), taylor, start)
                }
                _ if projected => driver(problem(), Projected::new(taylor), start),
                _ => driver(problem(), taylor, start),
            }
        }
        MethodId::Radau(stages) => {
            let radau = Radau::new(stages, tolerance)
                .ok_or_else(|| cannot_begin(plan, format!("no Radau method has {stages} stages")))?;
            if projected {
                return Ok(driver(problem(), Projected::new(radau), start));
            }
            driver(problem(), radau, start)
        }
        MethodId::Gauss(stages) => {
            let gauss = Gauss::new(stages, step).ok_or_else(|| {
                cannot_begin(plan, format!("no Gauss method has {stages} stages and step {step} s"))
            })?;
            if projected {
                return Ok(driver(problem(), SymmetricGauss::new(gauss), start));
            }
            driver(sized!(n, canonical(mechanism)), gauss, start)
        }
        MethodId::Rattle(composition) => {
            let natural =
                Natural::new(Arc::clone(mechanism)).map_err(|error| cannot_begin(plan, error.to_string()))?;
            driver(Box::new(natural), Rattle::new(composition, step), start)
        }
    })
}

/// The order of a series in double-double that takes the least work at a tolerance: a step costs as its
/// square, and is as long as its root of the tolerance.
pub(super) fn order_in_double_double(tolerance: f64) -> usize {
    (-0.5 * libm::log(tolerance)).round().clamp(20.0, 30.0) as usize
}

/// The series of a mechanism in double-double, from `start`, with its order and tolerance \[rad/s\].
pub(super) fn exact(
    mechanism: &Arc<Mechanism>,
    start: &Motion,
    order: usize,
    tolerance: f64,
) -> Box<dyn Driver> {
    let taylor = Taylor::<DoubleDouble>::with_order(tolerance, order);
    match mechanism.has_multipliers() || !mechanism.frictions.is_empty() {
        true => driver(form::<0>(mechanism, Stabilization::None, 1.0), taylor, start),
        false => driver(eliminated::<0>(mechanism), taylor, start),
    }
}

/// The form whose unknowns small differences are followed in.
pub(super) fn tangent_form(mechanism: &Arc<Mechanism>) -> Box<dyn Problem> {
    if mechanism.has_multipliers() {
        return sized!(mechanism.size(), form(mechanism, Stabilization::None, 1.0));
    }
    sized!(mechanism.size(), eliminated(mechanism))
}

fn cannot_begin(plan: &Plan, what: String) -> StepError {
    let hint = "--method dp8".into();
    StepError {
        cause: Cause::Unsuited,
        method: plan.method.to_string(),
        t: 0.0,
        step: plan.step.unwrap_or(0.0),
        what,
        hint,
    }
}

/// Five mean steps of the unstabilized run over its first output intervals (at most twenty) \[s\], or up to
/// where it stops; five output intervals where it makes none.
fn pilot(mechanism: &Arc<Mechanism>, plan: &Plan, start: &Motion) -> Result<f64, StepError> {
    let mut plain = Plan { stabilization: Stabilization::None, ..plan.clone() };
    let mut driver = build(mechanism, &mut plain, start)?;
    driver.allow(plan.max_evaluations);
    let mut outcome = Outcome::begun(mechanism, plain);
    let mut pilot = ContactDriver::new(Arc::clone(mechanism), driver);
    // What stops it stops the run itself, which says so.
    if pilot.meet(&mut outcome).is_ok() {
        for row in 1..=plan.rows.min(20) {
            if !pilot.go(plan.time(row), &mut outcome, &mut || false).is_ok_and(|went| went) {
                break;
            }
        }
    }
    Ok(match pilot.statistics().steps {
        0 => 5.0 * plan.time(1).hi,
        steps => 5.0 * pilot.motion().time.hi / steps as f64,
    })
}
