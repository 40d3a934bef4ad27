//! A hundred million seconds of `gentle` by Gauss's method, in as many sittings as it takes.
//!
//! `cargo run --release --example long_horizon -- [SECONDS]` integrates on to that simulated time, from where
//! the last call stopped; without SECONDS it goes on for three seconds of real time.
//! `output/long_horizon/checkpoint.json` holds the state to the last bit and is replaced whole.
//!
//! Plain doubles in the stages, on purpose: the evaluations in pairs leave a fifth of the walk over 1e5 s,
//! but a climb of 2e-21 a second at this step, which a random walk undercuts from about 1e6 s on.
//!
//! One run shows the law of its drift by the changes of energy over windows of time: a random walk changes as
//! the square root of the window.

use driftless::arithmetic::DoubleDouble;
use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::kernel::Kernel;
use driftless::dynamics::{Form, Mechanism, Motion, State, Time};
use driftless::scene::read_scene;
use driftless::stepping::gauss::Gauss;
use driftless::stepping::{Integrator, Seen};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::{Duration, Instant};

const STEP: f64 = 1.0 / 32.0;
/// Simulated time between samples of the energy \[s\].
const SAMPLE: f64 = 128.0;
const FOLDER: &str = "output/long_horizon";

/// Everything a later call needs.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Checkpoint {
    /// Leading and low parts of the time \[s\] and of the unknowns, turns, and the method's memory.
    time: [f64; 2],
    y: Vec<f64>,
    low: Vec<f64>,
    turns: Vec<i64>,
    memory: Vec<f64>,
    samples: u64,
    /// Energy errors at each sample so far: the largest, and those at powers of ten \[s\], over the scale of
    /// the energy.
    largest: f64,
    decades: Vec<(f64, f64, f64)>,
    /// For windows of 4^k samples: the error at the last window's end, the sum of squared changes, and their
    /// number.
    windows: Vec<(f64, f64, u64)>,
    /// Real time spent \[s\].
    spent: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let until: Option<f64> = std::env::args().nth(1).map(|word| word.parse()).transpose()?;
    let (file, part) = (format!("{FOLDER}/checkpoint.json"), format!("{FOLDER}/checkpoint.part"));
    let scene = read_scene("examples/scenes/gentle.json".as_ref(), &[])?;
    let mechanism = Arc::new(Mechanism::new(&scene)?);
    let mut form = Canonical::<2, false>::new(Arc::clone(&mechanism));
    let mut method = Gauss::new(8, STEP).ok_or("a sound step")?.plain();
    let mut kernel = Kernel::<DoubleDouble>::without_rows(&mechanism);
    let mut energy = |form: &mut Canonical<2, false>, state: &State| {
        let mut motion = Motion::default();
        form.read(state, &mut motion);
        mechanism.energy(&mut kernel, &motion.phi, &motion.omega).total()
    };
    let mut state = form.state(&mechanism.start(&scene));
    let start = energy(&mut form, &state);
    let mut checkpoint = Checkpoint::default();
    if let Ok(text) = std::fs::read_to_string(&file) {
        checkpoint = serde_json::from_str(&text)?;
        let Checkpoint { time: [hi, lo], y, low, turns, memory, .. } = checkpoint.clone();
        state = State { time: Time { hi, lo }, y, low, turns, memory, ..State::default() };
    }
    std::fs::create_dir_all(FOLDER)?;
    let (begin, before) = (Instant::now(), checkpoint.spent);
    let mut saved = begin;
    loop {
        checkpoint.samples += 1;
        let time = checkpoint.samples as f64 * SAMPLE;
        method.advance(&mut form, &mut state, Time::from(time), &mut Default::default(), &mut |_, _| {
            Ok(Seen::Kept)
        })?;
        checkpoint.see(time, (energy(&mut form, &state) - start).hi / mechanism.energy_scale);
        let is_last = until.map_or(begin.elapsed() > Duration::from_secs(3), |until| time >= until);
        if is_last || saved.elapsed() > Duration::from_secs(20) {
            saved = Instant::now();
            checkpoint.spent = before + begin.elapsed().as_secs_f64();
            let State { time: Time { hi, lo }, y, low, turns, memory, .. } = state.clone();
            checkpoint = Checkpoint { time: [hi, lo], y, low, turns, memory, ..checkpoint };
            // Written beside, then renamed: a reader or a crash finds the old one or the new one.
            std::fs::write(&part, serde_json::to_string(&checkpoint)?)?;
            std::fs::rename(&part, &file)?;
        }
        if is_last {
            checkpoint.report(time);
            return Ok(());
        }
    }
}

impl Checkpoint {
    /// Takes the energy error at a sample.
    fn see(&mut self, time: f64, error: f64) {
        self.largest = self.largest.max(error.abs());
        if time >= 10f64.powi(3 + self.decades.len() as i32) {
            self.decades.push((time, error, self.largest));
        }
        let mut window = 1;
        for level in 0.. {
            if !self.samples.is_multiple_of(window) {
                break;
            }
            if level == self.windows.len() {
                self.windows.push((0.0, 0.0, 0));
            }
            let (last, squares, count) = &mut self.windows[level];
            (*last, *squares, *count) = (error, *squares + (error - *last).powi(2), *count + 1);
            window *= 4;
        }
    }

    fn report(&self, time: f64) {
        println!(
            "{time:e} s of `gentle`, {:.1} µs of real time a simulated second, all sittings",
            self.spent * 1e6 / time
        );
        println!("\n{:>10} {:>11} {:>11}   energy error over its scale", "t [s]", "at t", "largest");
        for (time, error, largest) in
            self.decades.iter().chain([&(time, self.windows.first().map_or(0.0, |w| w.0), self.largest)])
        {
            println!("{time:10.3e} {error:11.2e} {largest:11.2e}");
        }
        println!(
            "\n{:>10} {:>11} {:>11} {:>8}   changes over windows",
            "window [s]", "rms", "/sqrt(t)", "number"
        );
        for (level, (_, squares, count)) in self.windows.iter().enumerate() {
            let (window, rms) = (SAMPLE * 4f64.powi(level as i32), (squares / *count as f64).sqrt());
            println!("{window:10.0} {rms:11.2e} {:11.2e} {count:8}", rms / window.sqrt());
        }
    }
}
