//! The points of a sweep, integrated on threads and shown in the order of the grid.

#[cfg(feature = "threads")]
use super::threads;
use super::{Sweep, SweepError, SweepPoint, Totals};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Sees the points of a sweep, in the order of the grid.
pub trait PointObserver {
    /// Takes a point.
    ///
    /// # Errors
    /// Whatever shall end the sweep.
    fn see(&mut self, point: &SweepPoint) -> std::io::Result<()>;

    /// Told now and then how many points are finished, seen or not yet, and what those seen amount to.
    ///
    /// # Errors
    /// Whatever shall end the sweep; points under way are given up.
    fn finished(&mut self, _points: u64, _seen: &Totals) -> std::io::Result<()> {
        Ok(())
    }
}

impl<F: FnMut(&SweepPoint) -> std::io::Result<()>> PointObserver for F {
    fn see(&mut self, point: &SweepPoint) -> std::io::Result<()> {
        self(point)
    }
}

/// What the threads of a sweep share.
pub(super) struct SharedSweep<'a> {
    pub(super) sweep: &'a Sweep,
    chunk: u64,
    /// The points that were not seen before.
    rest: Range<u64>,
    pub(super) finished: AtomicU64,
    /// Set where nobody wants the rest.
    pub(super) is_over: AtomicBool,
}

impl SharedSweep<'_> {
    pub(super) fn chunks(&self) -> u64 {
        (self.rest.end - self.rest.start).div_ceil(self.chunk)
    }

    /// The points of a chunk; fewer where nobody wants them any more.
    pub(super) fn integrate(&self, chunk: u64) -> Vec<SweepPoint> {
        let first = self.rest.start + chunk * self.chunk;
        let last = (first + self.chunk).min(self.rest.end);
        let finished = || {
            self.finished.fetch_add(1, Ordering::Relaxed);
        };
        let is_over = || self.is_over.load(Ordering::Relaxed) || self.sweep.is_stopped();
        self.sweep.integrate(first..last, &finished, &is_over)
    }
}

/// Runs all points of a sweep on so many threads (0: as many as there are processors) and shows them to
/// `observer` in the order of the grid.
///
/// Without the feature `threads` there is one.
///
/// # Errors
/// What the observer failed with; a point that fails is part of what it is shown.
pub fn sweep(sweep: &Sweep, threads: usize, observer: &mut dyn PointObserver) -> Result<Totals, SweepError> {
    sweep_on(sweep, threads, Totals::default(), observer)
}

/// The same for the points that follow those seen before, which amounted to `seen`.
///
/// # Errors
/// As [`sweep`].
pub fn sweep_on(
    sweep: &Sweep,
    threads: usize,
    seen: Totals,
    observer: &mut dyn PointObserver,
) -> Result<Totals, SweepError> {
    let begin = Instant::now();
    let available = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = if cfg!(not(feature = "threads")) {
        1
    } else if threads == 0 {
        available()
    } else {
        threads
    };
    let (range, before) = (sweep.range(), seen.points().min(sweep.count()));
    let shared = SharedSweep {
        sweep,
        chunk: sweep.chunk(threads),
        rest: range.start + before..range.end,
        finished: AtomicU64::new(before),
        is_over: AtomicBool::new(false),
    };
    let mut sweep_observer =
        SweepObserver { observer, begin, before: seen.wall, totals: Totals { threads, ..seen } };
    #[cfg(feature = "threads")]
    threads::integrate(&shared, threads, &mut sweep_observer)?;
    #[cfg(not(feature = "threads"))]
    for chunk in 0..shared.chunks() {
        let points = shared.integrate(chunk);
        sweep.check_stop()?;
        points.iter().try_for_each(|point| sweep_observer.see(point))?;
        sweep_observer.finished(shared.finished.load(Ordering::Relaxed))?;
    }
    sweep_observer.totals.wall = sweep_observer.before + begin.elapsed();
    Ok(sweep_observer.totals)
}

/// An observer, and what it has seen.
pub(super) struct SweepObserver<'a> {
    observer: &'a mut dyn PointObserver,
    begin: Instant,
    /// Time spent before this part of the sweep.
    before: Duration,
    totals: Totals,
}

impl SweepObserver<'_> {
    pub(super) fn see(&mut self, point: &SweepPoint) -> std::io::Result<()> {
        self.totals.take(point);
        self.observer.see(point)
    }

    pub(super) fn finished(&mut self, points: u64) -> std::io::Result<()> {
        self.totals.wall = self.before + self.begin.elapsed();
        self.observer.finished(points, &self.totals)
    }
}
