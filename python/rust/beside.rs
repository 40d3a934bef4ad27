//! Runs looked at for Ctrl-C from beside.

use driftless::run::Running;
use driftless::run::methods::MethodId;
use driftless::stepping::interruption;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Longest time of computing between two looks for Ctrl-C.
pub const LOOK: Duration = Duration::from_millis(20);

/// Takes a run on, on a thread of its own, while this one looks for Ctrl-C; what that raised, and what came of
/// the run, which asks [`interruption::is_asked`] whether it is to pause.
pub fn go_beside<T: Send>(py: Python<'_>, go: impl FnOnce() -> T + Send) -> (Option<PyErr>, T) {
    let (waiting, is_done) = (std::thread::current(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let gone = go();
            is_done.store(true, Ordering::Release);
            waiting.unpark();
            gone
        });
        let mut signal = None;
        while !is_done.load(Ordering::Acquire) && !worker.is_finished() {
            py.detach(|| std::thread::park_timeout(LOOK));
            if let Err(error) = py.check_signals() {
                interruption::flag().store(true, Ordering::Relaxed);
                signal = Some(error);
            }
        }
        let gone = py.detach(|| worker.join());
        interruption::flag().store(false, Ordering::Relaxed);
        match gone {
            Ok(gone) => (signal, gone),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

/// True where windows are integrated in one call each, which cannot pause.
pub fn is_windowed(running: &Running) -> bool {
    matches!(running.plan().method, MethodId::Dopri5 | MethodId::Dop853)
}
