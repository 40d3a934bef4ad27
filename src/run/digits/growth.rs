//! How fast errors grow, and how many digits that takes.
//!
//! Two motions in few digits, a little apart: whenever they have parted by [`FAR`] the second is brought back
//! to [`NEAR`] of the first, in the direction it has, and the growth is noted (G. Benettin et al., *Lyapunov
//! characteristic exponents*, Meccanica 15 (1980) 9).  The path itself is right for a few seconds only; what
//! is wanted of it is how fast its neighbours leave it.

use super::motion::{DigitsMotion, LongState};
use super::precision::{DIGITS, Precision};
use super::{DigitsSource, LongError, LongRun, Runner};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::friction::FrictionMode;
use crate::stepping::StepError;
use std::time::Instant;

/// Limbs of the two motions, and digits.
const ROOM: usize = 8;
const PILOT: usize = 24;
/// Distances at which growth is counted from, and up to.
const NEAR: f64 = 1e-9;
const FAR: f64 = 1e-6;
/// Looks at the distance.
const LOOKS: u32 = 2000;
/// Digits beyond those that are lost and wanted.
const MARGIN: f64 = 5.0;
/// Part by which the growth may be larger than measured.
const DOUBT: f64 = 0.04;
/// Digits that the companion has more.
pub const MORE: usize = 10;
/// Steps that are timed.
const TIMED: u32 = 6;

/// What a run up to a horizon takes.
#[derive(Clone, Copy, Debug)]
pub struct Forecast {
    /// Mean length of steps \[s\].
    pub mean: f64,
    /// Decimal digits that errors grow by up to the horizon, as measured.
    pub growth: f64,
    /// Digits and order of the run.
    pub run: Precision,
    /// Those of the run beside it.
    pub companion: Precision,
    /// Steps of both, about.
    pub steps: u64,
    /// Seconds for both, one after the other, about.
    pub seconds: f64,
}

/// Measures the growth of errors up to the horizon, and says what it takes to know the path within `within`
/// \[rad\] there; `None` where `pause` came true before.
///
/// # Errors
/// As a run in many digits, or more than 2000 digits would be needed (a refusal).
pub fn forecast(
    source: &DigitsSource,
    within: f64,
    has_loops: bool,
    pause: &mut dyn FnMut() -> bool,
) -> Result<Option<Forecast>, LongError> {
    let mut pilot = Runner::<ROOM>::new(source, Precision::new(PILOT, has_loops))?;
    pilot.motion.ends_nowhere();
    let horizon = pilot.rows.until;
    let until = horizon.value();
    let Some(growth) = measured(&mut pilot.motion, until, pause)? else { return Ok(None) };
    let mean = until / pilot.counts()[0].max(1) as f64;
    planned(source, growth / std::f64::consts::LN_10, within, has_loops, mean).map(Some)
}

/// What it takes where errors grow by so many digits; `mean` \[s\] is the length of steps.
///
/// # Errors
/// More digits than runs may have.
pub fn planned(
    source: &DigitsSource,
    growth: f64,
    within: f64,
    has_loops: bool,
    mean: f64,
) -> Result<Forecast, LongError> {
    let needed = growth * (1.0 + DOUBT) + MARGIN - libm::log10(within);
    let digits = (needed.ceil() as usize).max(*DIGITS.start());
    if !needed.is_finite() || digits + MORE > *DIGITS.end() {
        let reason = format!(
            "errors grow by {growth:.0} digits up to the horizon, and more than {} are not carried",
            DIGITS.end()
        );
        return Err(super::refusal("--trusted-until", &reason, "choose an earlier time").into());
    }
    let run = Precision::new(digits, has_loops);
    let companion = Precision::new(digits + MORE, has_loops);
    let companion = companion.with_order(companion.order + companion.order / 8);
    let mut forecast = Forecast { mean, growth, run, companion, steps: 0, seconds: 0.0 };
    for precision in [run, companion] {
        let mut trial = super::long_run(source, precision)?;
        let (begin, mut steps) = (Instant::now(), 0);
        let last = trial.last_row();
        trial.row(last, &mut || {
            steps += 1;
            steps >= TIMED
        })?;
        let spent = begin.elapsed().as_secs_f64() / f64::from(steps.max(1));
        // Orders in proportion to digits make steps about as long.
        let count = (trial.last_time() / mean).ceil();
        forecast.steps += count as u64;
        forecast.seconds += spent * count;
    }
    Ok(forecast)
}

/// ln of the largest growth of a small distance between any two times up to `until` \[s\]; `None` where it
/// was paused.
fn measured(
    motion: &mut DigitsMotion<ROOM>,
    until: f64,
    pause: &mut dyn FnMut() -> bool,
) -> Result<Option<f64>, StepError> {
    // What rests on a wall from the start on is held before the two part.
    if !motion.reach(Digits::ZERO, pause)? {
        return Ok(None);
    }
    let start = motion.state().clone();
    let mut other = motion.beside();
    let mut shifted = start.clone();
    let tiny = Digits::of(NEAR);
    shifted.u.iter_mut().for_each(|u| *u += tiny);
    other.resume(shifted);
    other.settle()?;
    let (mut total, mut least, mut most) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut from = distance(motion.state(), other.state());
    for look in 1..=LOOKS {
        let t = Digits::of(until * f64::from(look) / f64::from(LOOKS));
        if !motion.reach(t, pause)? || !other.reach(t, pause)? {
            return Ok(None);
        }
        let (here, there) = (motion.state_at(t), other.state_at(t));
        // Where a point stays on its wall, or a place sticks, in one of them only, they are no neighbours for
        // that time.
        if here.acting.held != there.acting.held || !move_alike(&here, &there) {
            continue;
        }
        let apart = distance(&here, &there);
        let now = total + libm::log(apart / from);
        if now.is_finite() {
            least = least.min(now);
            most = most.max(now - least);
        }
        if !(1e-3 * NEAR..FAR).contains(&apart) {
            let share = Digits::of(if apart > 0.0 && apart.is_finite() { NEAR / apart } else { 0.0 });
            let mut back = here.clone();
            for (back, (&a, &b)) in back.u.iter_mut().zip(here.u.iter().zip(&there.u)) {
                *back = a + (b - a) * share;
            }
            for (back, (&a, &b)) in back.rate.iter_mut().zip(here.rate.iter().zip(&there.rate)) {
                *back = a + (b - a) * share;
            }
            for (back, there) in back.acting.sliding.iter_mut().zip(&there.acting.sliding) {
                if let (FrictionMode::Stick(a), FrictionMode::Stick(b)) = (&mut *back, there) {
                    *a = *a + (*b - *a) * share;
                }
            }
            other.resume(back);
            other.settle()?;
            total = if now.is_finite() { now } else { total };
            from = distance(&here, other.state()).max(f64::MIN_POSITIVE);
        }
    }
    Ok(Some(most))
}

/// True where all places with dry friction do the same in two states.
fn move_alike<const W: usize>(a: &LongState<W>, b: &LongState<W>) -> bool {
    let without_place = |mode: &FrictionMode<Digits<W>>| match mode {
        FrictionMode::Stick(_) => FrictionMode::Stick(0.0),
        mode => mode.in_doubles(),
    };
    a.acting.sliding.iter().map(without_place).eq(b.acting.sliding.iter().map(without_place))
}

/// How far two states are apart \[rad, m\], rates counted over one second.
fn distance<const W: usize>(a: &LongState<W>, b: &LongState<W>) -> f64 {
    let parts = a.u.iter().zip(&b.u).chain(a.rate.iter().zip(&b.rate));
    parts.map(|(&a, &b)| (a - b).value().powi(2)).sum::<f64>().sqrt()
}
