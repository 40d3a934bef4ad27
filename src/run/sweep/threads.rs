//! Chunks on several threads, seen in order.

use super::execute::{SharedSweep, SweepObserver};
use super::{SweepError, SweepPoint};
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// Chunks a thread that are under way or waiting to be seen: one slow chunk does not hold the others up at
/// once, and memory stays bounded.
const AHEAD: u64 = 16;
/// Longest time without telling how far it is.
const TICK: Duration = Duration::from_millis(40);

/// A finished chunk; none where its thread panicked.
type Finished = (u64, Option<Vec<SweepPoint>>);

/// Sends word even where integrating panics.
struct PanicNotifier {
    chunk: u64,
    points: Option<Vec<SweepPoint>>,
    send: Sender<Finished>,
}

impl Drop for PanicNotifier {
    fn drop(&mut self) {
        // Nobody listens any more where the sweep is over.
        let _ = self.send.send((self.chunk, self.points.take()));
    }
}

/// Integrates all chunks and shows them in order.
pub(super) fn integrate(
    shared: &SharedSweep,
    threads: usize,
    sweep_observer: &mut SweepObserver,
) -> Result<(), SweepError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| SweepError::Threads(error.to_string()))?;
    let (send, receive) = channel::<Finished>();
    pool.in_place_scope(|scope| {
        let (chunks, ahead) = (shared.chunks(), AHEAD * threads as u64);
        let (mut begun, mut seen) = (0, 0);
        let mut waiting = BTreeMap::new();
        let mut go_on = || {
            while seen < chunks {
                while begun < chunks.min(seen + ahead) {
                    let mut messenger = PanicNotifier { chunk: begun, points: None, send: send.clone() };
                    scope.spawn(move |_| {
                        messenger.points = Some(shared.integrate(messenger.chunk));
                        drop(messenger);
                    });
                    begun += 1;
                }
                match receive.recv_timeout(TICK) {
                    // The pool hands the panic on when the scope ends.
                    Ok((_, None)) | Err(RecvTimeoutError::Disconnected) => return Ok(()),
                    Ok((chunk, Some(points))) => drop(waiting.insert(chunk, points)),
                    Err(RecvTimeoutError::Timeout) => {}
                }
                // What a chunk came to that was given up is not shown.
                shared.sweep.check_stop()?;
                while let Some(points) = waiting.remove(&seen) {
                    points.iter().try_for_each(|point| sweep_observer.see(point))?;
                    seen += 1;
                }
                sweep_observer.finished(shared.finished.load(Ordering::Relaxed))?;
            }
            Ok(())
        };
        let outcome = go_on();
        shared.is_over.store(true, Ordering::Relaxed);
        outcome
    })
}
