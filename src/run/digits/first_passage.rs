//! What a function does that begins near zero: its first passage on all scales of time.
//!
//! ```text
//! f(t) = Σ_m f_m t^m,  |f_0| <= δ:   the first of  f = δ (opens, may pass zero later)  and  f = -δ (sinks)
//! windows [E/64, E],  E = step/64^j,  from  r = min_m (δ 2^-m / |f_m|)^(1/m)  on:   |f - f_0| < δ up to r
//! ```
//!
//! In shares of a window the powers are doubles of ordinary size, however small the window is, so that bounds
//! tell ([`search`](crate::stepping::search)) what happens there.  Of a function that begins at zero f_0 is
//! rounding, and left out: its zeros are those of f/t.

use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::stepping::search::{PowerSeries, root};

/// log2 of how much longer a window is than the next one.
const WINDOW: i32 = 6;
/// log2 of what a term weighs beside the largest one where it is left out.
const LEAST_TERM: f64 = -140.0;
/// Part by which a window begins within the one before, so that no zero is lost between them.
const OVERLAP: f64 = 1e-9;

/// What a function does in a step.
#[derive(Clone, Copy, Debug)]
pub(super) enum FirstPassage<const W: usize> {
    /// It stays positive, or near zero.
    Nothing,
    /// It passes from positive to negative, about here \[s\].
    At(Digits<W>),
    /// It goes negative without opening first.
    Sinks,
}

/// The first passage of a function within a step of so many seconds, from its powers; values are divided by
/// `unit`, and of these 2^`least` is near zero.
pub(super) fn passage<const W: usize>(
    powers: &[Digits<W>],
    unit: f64,
    step: f64,
    least: f64,
) -> FirstPassage<W> {
    let (mut scale, length) = (Digits::of(1.0 / unit), Digits::of(step));
    let in_shares = |power: &Digits<W>| {
        let share = *power * scale;
        scale = scale * length;
        share
    };
    let mut shares: Vec<Digits<W>> = powers.iter().map(in_shares).collect();
    let Some(first) = shares.first_mut() else { return FirstPassage::Nothing };
    let mut has_opened = *first > Digits::ZERO && first.log2() > least;
    let size = if has_opened { first.log2() } else { least };
    if !has_opened {
        *first = Digits::ZERO;
    }
    // log2 of r.
    let reach = |(m, share): (usize, &Digits<W>)| (size - share.log2()) / m as f64 - 1.0;
    let begin = shares.iter().enumerate().skip(1).map(reach).fold(f64::INFINITY, f64::min);
    if begin >= 0.0 || begin.is_nan() {
        return FirstPassage::Nothing;
    }
    let windows = (-begin / f64::from(WINDOW)).floor() as i32;
    let mut from = libm::exp2(begin + f64::from(WINDOW * windows));
    for window in (0..=windows).rev() {
        let (curve, scale) = seen_in(&shares, -WINDOW * window);
        let curve = PowerSeries { powers: &curve, end: 1.0 };
        if !has_opened {
            let level = libm::exp2(least + scale);
            let (opens, sinks) = (root(&curve, level, from, 1.0), root(&curve, -level, from, 1.0));
            match (opens, sinks) {
                (opens, Some(sink)) if opens.is_none_or(|open| sink < open) => return FirstPassage::Sinks,
                (Some(open), _) => (has_opened, from) = (true, open),
                _ => {}
            }
        }
        if has_opened && let Some(zero) = root(&curve, 0.0, from, 1.0) {
            return FirstPassage::At(Digits::of(zero).ldexp(-WINDOW * window) * length);
        }
        from = libm::exp2(f64::from(-WINDOW)) * (1.0 - OVERLAP);
    }
    FirstPassage::Nothing
}

/// Powers in shares of a window that is 2^`log_window` of the step, as doubles of ordinary size, and log2 of
/// what they are multiplied by.
fn seen_in<const W: usize>(shares: &[Digits<W>], log_window: i32) -> (Vec<f64>, f64) {
    let weight = |(m, share): (usize, &Digits<W>)| share.log2() + f64::from(log_window) * m as f64;
    let largest = shares.iter().enumerate().map(weight).fold(f64::NEG_INFINITY, f64::max);
    let scale = -largest.round();
    let power = |(m, share): (usize, &Digits<W>)| {
        if weight((m, share)) + scale < LEAST_TERM {
            return 0.0;
        }
        share.ldexp(log_window * m as i32 + scale as i32).value()
    };
    (shares.iter().enumerate().map(power).collect(), scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn powers(of: &[f64]) -> Vec<Digits<5>> {
        of.iter().map(|&power| Digits::of(power)).collect()
    }

    #[test]
    fn a_rebound_of_any_height_above_the_least_comes_down_where_it_should() {
        for v in [0.5, 1e-8, 1e-16, 1e-30] {
            let FirstPassage::At(t) = passage(&powers(&[0.0, v, -5.0, 1e-3]), 1.0, 0.125, -400.0) else {
                panic!("no passage");
            };
            let t = t.value();
            assert!((t - v / 5.0).abs() < 1e-3 * v, "{t:e} of {v:e}");
        }
    }

    #[test]
    fn what_is_lower_than_the_least_sinks() {
        let sinks = |of: &[f64]| matches!(passage(&powers(of), 2.0, 0.5, -100.0), FirstPassage::Sinks);
        assert!(sinks(&[0.0, 1e-16, -5.0]));
        assert!(sinks(&[-1e-40, 0.0, 0.0, -1.0]));
        assert!(sinks(&[1e-40, -1.0, 3.0]));
        assert!(!sinks(&[0.0, 1e-14, -5.0]));
        assert!(!sinks(&[0.0, -1e-40, 1.0]));
        assert!(!sinks(&[-1e-40, 0.0, 0.0]));
    }

    #[test]
    fn a_small_gap_that_is_approached_closes() {
        let FirstPassage::At(t) = passage(&powers(&[1e-25, -1e-5, 1.0]), 1.0, 1.0, -110.0) else {
            panic!("no passage");
        };
        assert!((t.value() - 1e-20).abs() < 1e-30);
        // One that turns back before it does not.
        let turns = passage(&powers(&[1e-25, -1e-13, 1.0]), 1.0, 1.0, -110.0);
        assert!(matches!(turns, FirstPassage::Nothing));
    }
}
