//! Whether the process was asked to stop, for calls that cannot pause in between.
//!
//! Runs pause between steps where whoever runs them wants that.  The crate `ode_solvers` integrates a whole
//! window in one call, which looks here instead; what it has done of the window is given up then, and done
//! again where the run goes on.

use super::{Cause, StepError};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

static FLAG: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// The flag, to be set where the process is asked to stop, and taken down where it goes on.
pub fn flag() -> &'static Arc<AtomicBool> {
    &FLAG
}

/// True while it is set.
pub fn is_asked() -> bool {
    FLAG.load(Ordering::Relaxed)
}

/// Whether a method that made no step, `idle` times in a row, may be called again: it made none because the
/// flag is set, or was a moment ago.
///
/// # Errors
/// It would not go on, however often it is called.
pub fn check(method: &str, t: f64, idle: u32) -> Result<(), StepError> {
    if idle < 2 || is_asked() {
        return Ok(());
    }
    Err(StepError {
        cause: Cause::StepTooSmall,
        method: method.into(),
        t,
        step: 0.0,
        what: "the method made no step, and would make none".into(),
        hint: "take another --method; a defect of the integrator".into(),
    })
}
