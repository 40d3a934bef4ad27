//! How far a run is: a bar on a terminal, a line now and then elsewhere, nothing when quiet.

use super::output::message;
use crate::arithmetic::shown::{figure, plain};
use crate::report::page::counted;
use crate::run::compare::Stage;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Shortest time between two changes of the bar.
const BAR: Duration = Duration::from_millis(100);
/// Shortest time between two lines.
const LINE: Duration = Duration::from_secs(5);
/// Where calls come faster than this, the clock is looked at less often.
const LOOK: Duration = Duration::from_millis(1);
/// Most calls between two looks at the clock.
const MOST_CALLS: u32 = 1024;
/// Positions of the bar.
const POSITIONS: f64 = 10_000.0;

/// Shows the progress of one run.
pub struct RunProgress {
    scene: String,
    until: f64,
    bar: Option<ProgressBar>,
    next: Instant,
    looks: Looks,
    quiet: bool,
}

/// Looks at the clock now and then: the less often, the faster it is asked.
pub struct Looks {
    /// Calls between two looks, and those left to the next.
    stride: u32,
    left: u32,
    looked: Instant,
}

impl Looks {
    /// Looks at the first call.
    pub fn new() -> Self {
        Self { stride: 1, left: 1, looked: Instant::now() }
    }

    /// The time, where this call is one to look at.
    pub fn now(&mut self) -> Option<Instant> {
        self.left -= 1;
        if self.left > 0 {
            return None;
        }
        let now = Instant::now();
        self.stride = if now.saturating_duration_since(self.looked) < LOOK {
            (2 * self.stride).min(MOST_CALLS)
        } else {
            1
        };
        (self.left, self.looked) = (self.stride, now);
        Some(now)
    }
}

/// A bar of this length with words behind it, where stderr is a terminal.
fn bar(scene: &str, length: u64, words: &str, quiet: bool) -> Option<ProgressBar> {
    (!quiet && std::io::stderr().is_terminal()).then(|| {
        let bar = ProgressBar::new(length).with_prefix(scene.chars().take(20).collect::<String>());
        let style =
            ProgressStyle::with_template(&format!("{{prefix}} [{{bar:24}}] {{percent:>3}} %  {words}"));
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
        bar
    })
}

/// Shows the progress of a sweep: its rate so far, and the time the rest takes at that rate.
pub struct SweepProgress {
    scene: String,
    /// Points of an earlier part of it, and all there are.
    before: u64,
    count: u64,
    begin: Instant,
    bar: Option<ProgressBar>,
    next: Instant,
    quiet: bool,
}

impl SweepProgress {
    /// Begins; `count` is the number of points, of which `before` were finished earlier.
    pub fn new(scene: &str, before: u64, count: u64, quiet: bool) -> Self {
        let bar = bar(scene, count, "{msg}", quiet);
        let begin = Instant::now();
        Self {
            scene: scene.to_owned(),
            before,
            count,
            begin,
            next: begin + if bar.is_some() { BAR } else { LINE },
            bar,
            quiet,
        }
    }

    /// Takes the number of points finished.
    pub fn see(&mut self, finished: u64) {
        let now = Instant::now();
        if self.quiet || now < self.next {
            return;
        }
        let words = told(self.before, finished, self.count, now - self.begin);
        match &self.bar {
            Some(bar) => {
                bar.set_message(words);
                bar.set_position(finished);
                self.next = now + BAR;
            }
            None => {
                message(&format!(
                    "{}: {:.0} %, {words}",
                    self.scene,
                    100.0 * finished as f64 / self.count as f64
                ));
                self.next = now + LINE;
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Shows the progress of a comparison: what is being done, and the most time that is left.
pub struct CompareProgress {
    scene: String,
    bar: Option<ProgressBar>,
    next: Instant,
    quiet: bool,
}

impl CompareProgress {
    /// Begins.
    pub fn new(scene: &str, quiet: bool) -> Self {
        let bar = bar(scene, POSITIONS as u64, "{msg}", quiet);
        let wait = if bar.is_some() { BAR } else { LINE };
        Self { scene: scene.to_owned(), next: Instant::now() + wait, bar, quiet }
    }

    /// Takes how far it is.
    pub fn see(&mut self, stage: &Stage) {
        let now = Instant::now();
        if self.quiet || now < self.next {
            return;
        }
        let words = format!("{}, {} left at most", stage.doing, left(stage.left.as_secs_f64()));
        match &self.bar {
            Some(bar) => {
                bar.set_message(words);
                bar.set_position((stage.share * POSITIONS) as u64);
                self.next = now + BAR;
            }
            None => {
                message(&format!("{}: {:.0} %, {words}", self.scene, 100.0 * stage.share));
                self.next = now + LINE;
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// A time \[s\] as it is told.
fn left(seconds: f64) -> String {
    match seconds {
        left if left < 100.0 => format!("{left:.0} s"),
        left if left < 6000.0 => format!("{:.0} min", left / 60.0),
        left => format!("{:.1} h", left / 3600.0),
    }
}

/// `1200 of 4096 points, 85.3 a second, 34 s left`.
fn told(before: u64, finished: u64, count: u64, spent: Duration) -> String {
    let of = counted(count, "point", "points");
    let rate = finished.saturating_sub(before) as f64 / spent.as_secs_f64().max(1e-9);
    if finished <= before {
        return format!("{finished} of {of}");
    }
    let left = left(count.saturating_sub(finished) as f64 / rate);
    let rate = if rate < 10.0 { format!("{rate:.2}") } else { format!("{rate:.0}") };
    format!("{finished} of {of}, {rate} a second, {left} left")
}

/// The share of a run that is done.
fn share(t: f64, until: f64) -> f64 {
    (t / until).clamp(0.0, 1.0)
}

/// `free: 35 %, t = 0.35 s of 1 s`.
fn reached(scene: &str, t: f64, until: f64) -> String {
    format!("{scene}: {:.0} %, t = {} s of {} s", 100.0 * share(t, until), figure(t), plain(until))
}

impl RunProgress {
    /// Begins; `until` is the horizon \[s\].
    pub fn new(scene: &str, until: f64, quiet: bool) -> Self {
        let bar = bar(scene, POSITIONS as u64, "{msg}  {elapsed}, {eta} left", quiet);
        let wait = if bar.is_some() { BAR } else { LINE };
        let now = Instant::now();
        Self { scene: scene.to_owned(), until, bar, next: now + wait, looks: Looks::new(), quiet }
    }

    /// Takes the time reached \[s\].
    pub fn see(&mut self, t: f64) {
        if self.quiet {
            return;
        }
        let Some(now) = self.looks.now().filter(|&now| now >= self.next) else { return };
        match &self.bar {
            Some(bar) => {
                bar.set_message(format!("t = {t:.6} s"));
                bar.set_position((share(t, self.until) * POSITIONS) as u64);
                self.next = now + BAR;
            }
            None => {
                message(&reached(&self.scene, t, self.until));
                self.next = now + LINE;
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_reached_are_told_without_the_rounding_of_sums() {
        assert_eq!(reached("free", 0.350_000_000_000_000_03, 1.0), "free: 35 %, t = 0.35 s of 1 s");
        assert_eq!(reached("free", 79_349.700_000_000_01, 1e5), "free: 79 %, t = 79349.7 s of 100000 s");
    }

    #[test]
    fn the_time_left_follows_from_the_rate_so_far() {
        let spent = Duration::from_secs(10);
        assert_eq!(told(0, 0, 100, spent), "0 of 100 points");
        assert_eq!(told(0, 25, 100, spent), "25 of 100 points, 2.50 a second, 30 s left");
        assert_eq!(told(0, 1000, 61_000, spent), "1000 of 61000 points, 100 a second, 10 min left");
        assert_eq!(told(0, 1, 3601, spent), "1 of 3601 points, 0.10 a second, 10.0 h left");
    }
}
