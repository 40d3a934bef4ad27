//! The tangent flow of a scene at times of one's own.

use super::TangentFlow;
use crate::dynamics::{Mechanism, Motion, Time};
use crate::run::build::build;
use crate::run::contact::{ContactDriver, JumpLog};
use crate::run::plan::Plan;
use crate::run::running::Outcome;
use std::sync::Arc;

/// A motion with the small differences beside it.
#[derive(Clone, Debug)]
pub struct FlowState {
    /// The motion.
    pub motion: Motion,
    /// Differences in all coordinates and rates \[rad, m, rad/s, m/s\], those of the start carried along.
    pub columns: Vec<Vec<f64>>,
    /// Natural logarithm of the growth.
    pub growth: f64,
}

/// The flow along a motion.
#[derive(Clone, Debug)]
pub struct Flow {
    /// The start, after what impacts there are at it, and at the times asked for, as far as the flow goes.
    pub moments: Vec<FlowState>,
    /// What rates are divided by to be compared with positions \[rad/s\].
    pub rate: f64,
    /// Steps of the flow.
    pub steps: u64,
    /// Why it ended before, where it did.
    pub lost: Option<String>,
}

/// The flow along the motion that a plan makes from a start, at rising times \[s\].
///
/// # Errors
/// Why there is no such flow, or no such motion.
pub fn flow(mechanism: &Arc<Mechanism>, plan: &Plan, start: &Motion, times: &[f64]) -> Result<Flow, String> {
    let mut plan = plan.clone();
    let mut outcome = Outcome::begun(mechanism, plan.clone());
    let driver = build(mechanism, &mut plan, start).map_err(|stop| stop.what)?;
    let mut contact_driver = ContactDriver::new(Arc::clone(mechanism), driver);
    contact_driver.meet(&mut outcome).map_err(|stop| stop.what)?;
    let begin = contact_driver.motion();
    let mut tangent = TangentFlow::new(contact_driver.holding(), &begin, plan.until)?;
    let jumps = JumpLog::with_switches();
    contact_driver.jumps = Some(jumps.clone());
    let moment = |motion: Motion, tangent: &TangentFlow| FlowState {
        motion,
        columns: tangent.columns(),
        growth: tangent.growth(),
    };
    let mut flow =
        Flow { moments: vec![moment(begin, &tangent)], rate: tangent.rate(), steps: 0, lost: None };
    for &time in times {
        loop {
            let next = tangent.next_within(time);
            contact_driver
                .go(Time::from(next), &mut outcome, &mut || false)
                .map_err(|stop| format!("at {} s: {}", stop.t, stop.what))?;
            tangent.jump(&jumps.take());
            tangent.take(&contact_driver.motion(), 0);
            flow.steps += 1;
            if let Some(lost) = tangent.lost() {
                flow.lost = Some(lost.into());
                return Ok(flow);
            }
            if tangent.now()[0] >= time {
                break;
            }
        }
        // The last motion asked for may be one before the end of a step.
        contact_driver
            .go(Time::from(time), &mut outcome, &mut || false)
            .map_err(|stop| format!("at {} s: {}", stop.t, stop.what))?;
        flow.moments.push(moment(contact_driver.motion(), &tangent));
    }
    Ok(flow)
}
