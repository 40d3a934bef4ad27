//! When a run shall pause: for a checkpoint that is due, or because somebody asked it to end.

use super::failure::Failure;
use super::progress::Looks;
use crate::stepping::interruption;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// From now on Ctrl-C and SIGTERM ask the run to write a checkpoint and end; the second one ends the program
/// at once.
pub fn listen() -> Result<(), Failure> {
    static ONCE: AtomicBool = AtomicBool::new(false);
    if ONCE.swap(true, Ordering::Relaxed) {
        return Ok(());
    }
    let failed =
        |error| Failure::new(super::failure::Exit::Other, format!("cannot listen for Ctrl-C: {error}"));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        // In this order: the first signal finds the flag down.
        signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(interruption::flag()))
            .map_err(failed)?;
        signal_hook::flag::register(signal, Arc::clone(interruption::flag())).map_err(failed)?;
    }
    Ok(())
}

/// From now on a write past the limit of a file's size fails, as one to a full disk does, and ends nothing.
#[cfg(unix)]
pub fn survive_size_limits() -> Result<(), Failure> {
    let failed =
        |error| Failure::new(super::failure::Exit::Other, format!("cannot listen for signals: {error}"));
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default()).map(drop).map_err(failed)
}

/// True where the run has been asked to end.
pub fn is_asked() -> bool {
    interruption::is_asked()
}

/// Says when a checkpoint is due.  Its time runs forwards only, whatever becomes of the clock on the wall.
pub struct CheckpointTimer {
    /// Time between two checkpoints; `None` for none.
    every: Option<Duration>,
    last: Instant,
    looks: Looks,
}

impl CheckpointTimer {
    /// Checkpoints every so many seconds; 0 for none but at the end that is asked for.
    pub fn new(every: f64) -> Self {
        let every = Duration::try_from_secs_f64(every).ok().filter(|every| !every.is_zero());
        Self { every, last: Instant::now(), looks: Looks::new() }
    }

    /// True where the run shall pause now; cheap enough for every step.
    pub fn wants(&mut self) -> bool {
        if is_asked() {
            return true;
        }
        let Some(every) = self.every else { return false };
        self.looks.now().is_some_and(|now| now.saturating_duration_since(self.last) >= every)
    }

    /// A checkpoint has been written.
    pub fn written(&mut self) {
        self.last = Instant::now();
    }
}
