//! Reports: what a scene is, what its start amounts to, how a run went, as one JSON object and as a page of
//! 80 columns.
//!
//! Reports read results, they never run anything.  The keys of the JSON objects are what scripts rely on; a
//! number that is not finite is written as `null`, and a run that met one says so in `stop`.
//!
//! | report | of | file |
//! | --- | --- | --- |
//! | [`check`] | scene and plan | `check.rs` |
//! | [`inspect`] | the scene's start | `inspect.rs` |
//! | [`result`] | a run | `result.rs` |
//! | `sweep` | a sweep, with its chart | `sweep.rs`, with the feature `files` |
//! | [`kinematics`] | a mechanism moved through the range of its drive | `kinematics.rs` |
//! | [`modes`] | equilibria and modes | `modes.rs` |
//! | [`periodic`] | periodic motions and their multipliers | `periodic.rs` |
//! | `start` | the start of a scene, in a picture | `start.rs`, with the feature `charts` |
//! | [`sensitivity`] | derivatives of a run, its Lyapunov spectrum | `sensitivity.rs` |
//! | `fit` | a scene fitted to data | `fit.rs`, with the feature `fit` |
//! | [`stress`] | stiff and extreme scenes by every method | `stress.rs` |
//! | [`compare`] | methods compared, with charts | `compare.rs` |
//! | [`trust`] | how far a run may be trusted | `trust.rs` |
//! | `digits` | a run in many digits, with its proof | `digits.rs`, with the features `digits` and `files` |
//! | [`methods`] | the table of methods | `methods.rs` |
//! | `view` | runs, as a page to look at | `view.rs`, with the feature `charts` |
//! | `charts` | a run, in pictures | `charts.rs`, with the feature `charts` |

#[doc(hidden)]
#[cfg(feature = "charts")]
pub mod charts;
#[doc(hidden)]
pub mod check;
#[doc(hidden)]
pub mod compare;
#[cfg(feature = "charts")]
mod curves;
#[cfg(all(feature = "digits", feature = "files"))]
#[doc(hidden)]
pub mod digits;
#[cfg(feature = "files")]
mod displaced;
mod drawing;
pub mod events;
#[cfg(feature = "fit")]
pub mod fit;
mod friction;
#[doc(hidden)]
pub mod geometry;
mod inputs;
#[doc(hidden)]
pub mod inspect;
pub mod kinematics;
#[doc(hidden)]
pub mod methods;
pub mod modes;
mod outputs;
#[doc(hidden)]
pub mod page;
pub mod periodic;
#[doc(hidden)]
pub mod result;
pub mod sensitivity;
#[doc(hidden)]
#[cfg(feature = "charts")]
pub mod start;
#[doc(hidden)]
pub mod stress;
#[doc(hidden)]
#[cfg(feature = "files")]
pub mod sweep;
#[doc(hidden)]
pub mod trust;
#[doc(hidden)]
#[cfg(feature = "charts")]
pub mod view;

use crate::run::Plan;
use serde_json::{Value, json};

/// The settings of a plan: `step` \[s\] or `rtol` and `atol`, `stabilize`, `time_constant` \[s\], `extended`,
/// `every` \[s\], `effort` (evaluations allowed); `null` where one does not apply.
pub fn settings(plan: &Plan) -> Value {
    json!({
        "step": plan.step,
        "rtol": plan.tolerance.map(|tolerance| tolerance.relative),
        "atol": plan.tolerance.map(|tolerance| tolerance.absolute),
        "stabilize": plan.stabilization,
        "time_constant": plan.time_constant,
        "extended": plan.extended,
        "every": plan.every,
        "max_evaluations": plan.max_evaluations,
        // The name of one version ago.
        "effort": plan.max_evaluations,
    })
}

/// Method and setting in words: `gauss16, step 0.005 s`.
pub fn setting(plan: &Plan) -> String {
    match (plan.step, plan.tolerance) {
        (Some(step), _) => format!("{}, step {} s", plan.method, page::figure(step)),
        (None, Some(tolerance)) if tolerance.relative != tolerance.absolute => {
            format!(
                "{}, relative tolerance {:e}, absolute {:e}",
                plan.method, tolerance.relative, tolerance.absolute
            )
        }
        (None, tolerance) => {
            format!("{}, tolerance {:e}", plan.method, tolerance.unwrap_or_default().relative)
        }
    }
}
