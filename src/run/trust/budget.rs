//! What a reference solution may cost: a share of the run's work, counted and not clocked, so that the
//! figures are the same on every machine.
//!
//! Work is measured in nanoseconds of the machine the constants were taken on.  They need to be right within
//! a factor of two or so; what the reference solution really costs beside runs of the shipped scenes is what
//! `.ci/cost` counts.

use super::finer::is_near_rounding;
use crate::dynamics::Mechanism;
use crate::run::build::order_in_double_double;
use crate::run::methods::MethodId;
use crate::run::plan::Plan;
use crate::stepping::{Statistics, Taylor};

/// Largest share of the run's work that its reference solution may take.
pub const SHARE: f64 = 0.3;
/// Work that is free: what nobody notices at the end of a run, and of runs of fixed steps, near rounding or
/// with dry friction, whose reference solutions cost most beside them.
const GRACE: [f64; 2] = [20e6, 50e6];
/// Share and work free of charge of a reference solution in double-double, where the run is not near
/// rounding.
pub const DOUBLE_DOUBLE: [f64; 2] = [0.05, 100e3];
/// The same of the tangent flow from Jacobians, and from series on dual numbers.
pub const FLOW: [[f64; 2]; 2] = [[0.5, 200e3], [0.15, 60e3]];

/// The same where the estimate is to be had at all costs: thirty times the run's work, and five seconds that
/// nobody asks after.
pub const FULL_SHARE: f64 = 30.0;
/// See [`FULL_SHARE`].
pub const FULL_GRACE: f64 = 5e9;

/// A step of the series in double-double over one of the series in doubles of the same order, by counted
/// instructions.
const WIDE: f64 = 8.0;
/// What a place with dry friction adds to an evaluation, and to a step of the series with the search for its
/// transitions \[ns\].
pub(super) const FRICTION: [f64; 2] = [2e3, 12e3];

/// The work of a reference solution that is free beside a run.
pub fn grace(mechanism: &Mechanism, run: &Plan) -> f64 {
    let is_dear = run.step.is_some() || is_near_rounding(run) || !mechanism.frictions.is_empty();
    GRACE[usize::from(is_dear)]
}

/// Prices of a mechanism's parts.
#[derive(Clone, Copy, Debug)]
pub struct Prices {
    /// One evaluation of the equations.
    pub evaluation: f64,
    /// One step of the reference solution's series, and of the run's where it has one.
    pub series: [f64; 2],
    /// The reference solution's motion at one time, and how far it is from the run's.
    pub look: f64,
}

impl Prices {
    /// Those of a mechanism, for the plans of a reference solution and of its run.
    pub fn new(mechanism: &Mechanism, error_estimator: &Plan, run: &Plan) -> Self {
        let (n, rows) = (mechanism.coordinates() as f64, mechanism.constraints.len() as f64);
        let forces = (mechanism.springs.len()
            + mechanism.torsions.len()
            + mechanism.actions.len()
            + mechanism.forces.len()
            + mechanism.constraints.iter().filter(|row| row.aim.is_some()).count())
            as f64;
        let goes_bodywise = mechanism.recursion.is_some();
        let matrices = if goes_bodywise { 7.0 * n } else { 4.0 * n * n };
        let friction = FRICTION.map(|price| price * mechanism.frictions.len() as f64);
        let evaluation = 15.0 + 20.0 * n + matrices + 60.0 * rows + 20.0 * forces + friction[0];
        let of_series = if goes_bodywise { 200.0 * n } else { 150.0 * n * n + 300.0 * rows };
        let general = 700.0 + 400.0 * n + of_series + 400.0 * rows + 700.0 * forces + friction[1];
        let plain = if !Taylor::has_lanes(mechanism, false) {
            general
        } else if n <= 2.0 && forces == 0.0 {
            400.0
        } else {
            300.0 + 220.0 * n + if forces > 0.0 { 600.0 } else { 0.0 }
        };
        let series = |plan: &Plan| {
            if plan.method != MethodId::Taylor {
                return evaluation;
            }
            let tolerance = plan.tolerance.unwrap_or_default();
            let order = match plan.in_double_double {
                true => plan.order.unwrap_or_else(|| order_in_double_double(tolerance.relative)),
                false => plan.series(tolerance).order,
            } as f64;
            let wide = match plan.extended {
                _ if plan.in_double_double => WIDE,
                false => 1.0,
                true if Taylor::has_lanes(mechanism, true) => 3.0,
                true => 10.0,
            };
            let each = if plan.in_double_double { general } else { plain };
            each * wide * (order / 20.0).powi(2)
        };
        let look = 200.0 + 60.0 * n + if rows > 0.0 { evaluation } else { 0.0 };
        Self { evaluation, series: [series(error_estimator), series(run)], look }
    }

    /// The work of a run so far, its output left out: estimates do not depend on that.
    pub fn run(&self, method: MethodId, statistics: Statistics) -> f64 {
        statistics.evaluations as f64
            * if method == MethodId::Taylor { self.series[1] } else { self.evaluation }
    }
}
