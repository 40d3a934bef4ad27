//! How far a run is: a bar on a terminal, a line now and then elsewhere, nothing when quiet.

use super::output::message;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Shortest time between two changes of the bar.
const BAR: Duration = Duration::from_millis(100);
/// Shortest time between two lines.
const LINE: Duration = Duration::from_secs(5);
/// Where rows come faster than this, the clock is looked at less often.
const LOOK: Duration = Duration::from_millis(1);
/// Most rows between two looks at the clock.
const MOST_ROWS: u32 = 1024;
/// Positions of the bar.
const POSITIONS: f64 = 10_000.0;

/// Shows the progress of one run.
pub struct Progress {
    scene: String,
    until: f64,
    bar: Option<ProgressBar>,
    next: Instant,
    /// Rows between two looks at the clock, and those left to the next.
    stride: u32,
    left: u32,
    looked: Instant,
    quiet: bool,
}

impl Progress {
    /// Begins; `until` is the horizon \[s\].
    pub fn new(scene: &str, until: f64, quiet: bool) -> Self {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new(POSITIONS as u64).with_prefix(scene.chars().take(20).collect::<String>());
            let style = ProgressStyle::with_template("{prefix} [{bar:24}] {percent:>3} %  {msg}  {elapsed}, {eta} left");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            bar
        });
        let wait = if bar.is_some() { BAR } else { LINE };
        let now = Instant::now();
        Self { scene: scene.to_owned(), until, bar, next: now + wait, stride: 1, left: 1, looked: now, quiet }
    }

    /// Takes the time reached \[s\].
    pub fn see(&mut self, t: f64) {
        if self.quiet {
            return;
        }
        self.left -= 1;
        if self.left > 0 {
            return;
        }
        let now = Instant::now();
        self.stride = if now - self.looked < LOOK { (2 * self.stride).min(MOST_ROWS) } else { 1 };
        (self.left, self.looked) = (self.stride, now);
        if now < self.next {
            return;
        }
        let share = (t / self.until).clamp(0.0, 1.0);
        match &self.bar {
            Some(bar) => {
                bar.set_message(format!("t = {t:.6} s"));
                bar.set_position((share * POSITIONS) as u64);
                self.next = now + BAR;
            }
            None => {
                message(&format!("{}: {:.0} %, t = {t} s of {} s", self.scene, 100.0 * share, self.until));
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
