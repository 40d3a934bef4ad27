//! Methods compared on one scene: true error, drift and evaluations of each method at each of its settings,
//! against the time it takes.
//!
//! ```text
//! together    two runs from starts an ulp apart: until when a path means anything
//! truth       the reference motion up to there
//! measure     each setting once, watched: error, drift, counts        rung by rung, all methods in turn
//! time        each setting again and again, unwatched
//!     round by round, so that noise hits all alike
//! ```
//!
//! Settings go from coarse to fine, and end where finer ones bring nothing more.  What a method refuses or
//! where it stops is an entry like any other.  Nothing but times, and what is left out or cut short for want
//! of time, depends on the machine.

mod ladder;
mod measure;
mod task;
mod truth;
mod verdict;

pub use measure::RunMeasurement;
pub use task::compare;
pub use truth::Truth;
pub use verdict::{Advice, LOST, ROUNDING, TARGETS, front};

use super::methods::{MethodId, Stabilization};
use super::plan::{Plan, Request, RequestRefusal};
use crate::dynamics::Mechanism;
use crate::scene::Scene;
use crate::stepping::StepError;
use std::time::Duration;

/// What is to be compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Methods; empty for every one.
    pub methods: Vec<MethodId>,
    /// Stabilizations; empty for each method's usual one.
    pub stabilize: Vec<Stabilization>,
    /// Horizon \[s\]; the scene's, or what there is time for, unless given.
    pub until: Option<f64>,
    /// Time for all of it.
    pub budget: Duration,
    /// Blocks of repeated runs that tell the time of each setting, as far as there is time; 9 make a sure
    /// median.
    pub blocks: usize,
}

impl Asked {
    /// The horizon asked for, or the scene's \[s\].
    ///
    /// # Errors
    /// It makes no sense.
    pub fn horizon(&self, scene: &Scene, mechanism: &Mechanism) -> Result<f64, RequestRefusal> {
        let request = Request { until: self.until, every: self.until, ..Request::default() };
        Plan::new(scene, mechanism, &request).map(|plan| plan.until)
    }
}

/// What became of a setting.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// It came to the horizon.
    Done,
    /// The method stopped on the way.
    Stopped(StepError),
    /// The method is not for this scene, or not with this stabilization.
    Refused(RequestRefusal),
    /// It had come to this time \[s\] when its share of the budget was used up; 0 where it was not begun,
    /// since a coarser one took too long.
    Late(f64),
}

/// One setting of one method.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Method.
    pub method: MethodId,
    /// With the first orders of its series in double-double.
    pub extended: bool,
    /// The plan as carried out; `None` where it was refused.
    pub plan: Option<Plan>,
    /// The stabilization, where one was asked for or there is anything to stabilize.
    pub stabilization: Option<Stabilization>,
    /// What became of it.
    pub fate: Fate,
    /// What was found; of a run that stopped, up to there.
    pub found: Option<RunMeasurement>,
    /// Time of a run in each block \[s\].
    pub blocks: Vec<f64>,
}

/// Methods compared.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Horizon of the runs \[s\].
    pub until: f64,
    /// What errors are measured against.
    pub truth: Truth,
    /// All settings of all methods.
    pub entries: Vec<Entry>,
    /// What was decided on the way, one line each.
    pub notes: Vec<String>,
    /// False where it was given up before its end.
    pub is_whole: bool,
    /// Time it took.
    pub wall: Duration,
}

/// How far a comparison is.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// What is being done.
    pub doing: String,
    /// The most time that is left.
    pub left: Duration,
    /// The share that is done of the time it takes.
    pub share: f64,
}

impl Entry {
    /// Median time of a run \[s\], of one that came to its end.
    pub fn median(&self) -> Option<f64> {
        if self.fate == Fate::Done { quantile(&self.blocks, 0.5) } else { None }
    }

    /// Distance between the quartiles of that time \[s\]; `None` with fewer than two blocks.
    pub fn spread(&self) -> Option<f64> {
        if self.blocks.len() < 2 {
            None
        } else {
            Some(quantile(&self.blocks, 0.75)? - quantile(&self.blocks, 0.25)?)
        }
    }

    /// The error of a run that came to its end \[rad\].
    pub fn error(&self) -> Option<f64> {
        let found = self.found.as_ref().filter(|_| self.fate == Fate::Done)?;
        found.error.is_finite().then_some(found.error)
    }
}

/// A quantile by linear interpolation.
fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = share * (sorted.len().checked_sub(1)?) as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    Some(below + place.fract() * (above - below))
}

impl Entry {
    fn without(
        method: MethodId,
        extended: bool,
        stabilization: Option<Stabilization>,
        plan: Option<Plan>,
        fate: Fate,
    ) -> Self {
        Self { method, extended, plan, stabilization, fate, found: None, blocks: Vec::new() }
    }

    /// Method and stabilization: what all settings of a line in a chart share.
    pub fn name(&self) -> String {
        name(self.method, self.extended, self.stabilization)
    }
}

fn name(method: MethodId, extended: bool, stabilization: Option<Stabilization>) -> String {
    let extended = if extended { " extended" } else { "" };
    let kept = stabilization.map_or(String::new(), |kind| format!(", {kind}"));
    format!("{method}{extended}{kept}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_the_values() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(
            [0.0, 0.5, 0.75, 1.0].map(|share| quantile(&values, share)),
            [Some(1.0), Some(2.5), Some(3.25), Some(4.0)]
        );
        assert_eq!((quantile(&[], 0.5), quantile(&[7.0], 0.25)), (None, Some(7.0)));
    }
}
