//! Runs that are integrated for a page: the reference of one, points of a sweep.

use super::columns::{Role, ShownColumn, columns};
use super::{Gathering, ViewError, Viewed};
use crate::dynamics::Mechanism;
use crate::report::result::record;
use crate::run::{Limits, MethodId, Plan, Request, Run, integrate};
use crate::scene::Scene;
use serde_json::Value;
use std::sync::Arc;

/// Tolerances of references: of the series with its first orders in double-double, of the series, and of
/// `dp8` where there is none.
const REFERENCES: [(MethodId, bool, f64); 3] =
    [(MethodId::Taylor, true, 1e-20), (MethodId::Taylor, false, 1e-15), (MethodId::Dp8, false, 1e-13)];

impl Viewed {
    /// The same motion as exactly as can be: its rows are at the same times.  `window` as in
    /// [`Viewed::read`].
    ///
    /// # Errors
    /// No method can make it.
    pub fn reference(&self, window: Option<[f64; 2]>) -> Result<Self, ViewError> {
        let until = self.record["result"]["final"]["t"].as_f64().filter(|&t| t > 0.0);
        let mut refusal = String::new();
        for (method, extended, tolerance) in REFERENCES {
            let request = Request {
                method: Some(method),
                rtol: Some(tolerance),
                atol: Some(tolerance),
                extended,
                until: until.or(Some(self.scene.until)),
                every: Some(self.scene.every),
                ..Request::default()
            };
            match Plan::new(&self.scene, &self.mechanism, &request) {
                Ok(plan) => {
                    let (scene, mechanism) = (self.scene.clone(), Arc::clone(&self.mechanism));
                    return Self::integrated("reference", scene, mechanism, plan, |_| true, window);
                }
                Err(error) => refusal = error.to_string(),
            }
        }
        Err(ViewError::Run { what: format!("the reference of {}", self.label), why: refusal })
    }

    /// Integrates a plan and keeps what a page shows of it, of the columns those that are `wanted`; a run
    /// that stops is shown up to there.
    pub(super) fn integrated(
        label: &str,
        scene: Scene,
        mechanism: Arc<Mechanism>,
        plan: Plan,
        wanted: impl Fn(Role) -> bool,
        window: Option<[f64; 2]>,
    ) -> Result<Self, ViewError> {
        let failed = |why: String| ViewError::Run { what: label.to_owned(), why };
        let mut columns: Vec<ShownColumn> = columns(&mechanism);
        columns.retain(|column| wanted(column.role));
        let mut gathering = Gathering::of(&mechanism, &columns, [plan.until, plan.every], window);
        let scene = Scene { until: plan.until, every: plan.every, ..scene };
        let start = mechanism.start(&scene);
        let run = Run::new(Arc::clone(&mechanism), plan, Limits::default(), &start)
            .map_err(|stop| failed(stop.to_string()))?;
        let outcome = integrate(run, &mut |sample| {
            gathering.see(sample);
            Ok(())
        })
        .map_err(|error| failed(error.to_string()))?;
        let record: Value = record(&scene, &mechanism, &outcome, "");
        let kept = gathering.thinning.finish();
        Ok(Self { label: label.to_owned(), record, scene, mechanism, columns, kept }.settled())
    }
}
