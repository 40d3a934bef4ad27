//! Samples as curves: how far apart they are, and what lies between them.

use crate::run::Sample;

/// A turn of the fastest body between samples beyond which curves through them would mislead \[rad\].
const COARSE: f64 = 2.0;
/// A coordinate that changes by less is called constant \[rad or m\].
pub(super) const STILL: f64 = 1e-9;
/// Share of the motion that mean rates may miss; a swing sampled seven times a period misses that much.
const MISSED: f64 = 0.07;
/// Points of a curve between two samples, and from how many samples on it needs none.
const FINE: usize = 6;
const DENSE: usize = 1500;

/// How far the coordinate that changes most changes from one sample to the next \[rad or m\].
pub(super) fn furthest(a: &Sample, b: &Sample) -> f64 {
    turned(a, b, a.phi.len())
}

/// How far the body that turns furthest turns from one sample to the next \[rad\]; the first so many
/// coordinates are `angles`.
pub(super) fn turned(a: &Sample, b: &Sample, angles: usize) -> f64 {
    a.phi.iter().zip(&b.phi).take(angles).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max)
}

/// True where curves through the samples would mislead: a body turns too far from one to the next, or its
/// rates there do not tell how far it turns or moves.  The first so many coordinates are `angles`.
pub(super) fn is_coarse(samples: &[&Sample], angles: usize) -> bool {
    let (mut missed, mut told) = (0.0, 0.0);
    for pair in samples.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for k in 0..a.phi.len() {
            let (change, half) = (b.phi[k] - a.phi[k], 0.5 * (b.t - a.t));
            let way = half * (a.omega[k].abs() + b.omega[k].abs());
            // What is still moves by rounding, which rates do not tell.
            if way.max(change.abs()) > STILL {
                missed += (change - half * (a.omega[k] + b.omega[k])).powi(2);
                told += way.powi(2);
            }
        }
    }
    missed > MISSED * MISSED * told
        || samples.windows(2).any(|pair| turned(pair[0], pair[1], angles) > COARSE)
}

pub(super) fn span(samples: &[&Sample]) -> f64 {
    samples.first().zip(samples.last()).map_or(0.0, |(first, last)| last.t - first.t)
}

/// Times and angles of samples, with points between them where they are few.
pub(super) fn smoothed(samples: &[&Sample]) -> Vec<(f64, Vec<f64>)> {
    let fine = if samples.len() < DENSE { FINE } else { 1 };
    let mut smooth = Vec::new();
    for pair in samples.windows(2) {
        let shares = (0..fine).map(|k| k as f64 / fine as f64);
        smooth.extend(
            shares.map(|share| (pair[0].t + share * (pair[1].t - pair[0].t), cubic(pair[0], pair[1], share))),
        );
    }
    smooth.extend(samples.last().map(|last| (last.t, last.phi.clone())));
    smooth
}

/// Angles at a share of the way between two samples, from angles and rates at both (Hermite's cubic).
pub(super) fn cubic(a: &Sample, b: &Sample, share: f64) -> Vec<f64> {
    let (s, rest, span) = (share, 1.0 - share, b.t - a.t);
    let blend = [
        rest * rest * (1.0 + 2.0 * s),
        s * s * (3.0 - 2.0 * s),
        s * rest * rest * span,
        -s * s * rest * span,
    ];
    (0..a.phi.len())
        .map(|k| blend[0] * a.phi[k] + blend[1] * b.phi[k] + blend[2] * a.omega[k] + blend[3] * b.omega[k])
        .collect()
}

/// Angles and rates at time `t` \[s\], between samples.
pub(super) fn between(samples: &[Sample], t: f64) -> (Vec<f64>, Vec<f64>) {
    let after = samples.partition_point(|sample| sample.t < t).min(samples.len().saturating_sub(1));
    let (Some(a), Some(b)) = (samples.get(after.saturating_sub(1)), samples.get(after)) else {
        return Default::default();
    };
    let share = if b.t > a.t { ((t - a.t) / (b.t - a.t)).clamp(0.0, 1.0) } else { 0.0 };
    (cubic(a, b, share), a.omega.iter().zip(&b.omega).map(|(a, b)| a + share * (b - a)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(t: f64, phi: f64, omega: f64) -> Sample {
        Sample { t, phi: vec![phi], omega: vec![omega], ..Sample::default() }
    }

    #[test]
    fn small_swings_sampled_too_seldom_are_coarse() {
        let coarse = |per_period: f64| {
            let time = |k: u32| f64::from(k) * std::f64::consts::TAU / per_period;
            let samples: Vec<Sample> =
                (0..100).map(|k| sample(time(k), 0.2 * time(k).sin(), 0.2 * time(k).cos())).collect();
            is_coarse(&samples.iter().collect::<Vec<_>>(), 1)
        };
        assert!(coarse(3.3) && coarse(5.0) && !coarse(10.0) && !coarse(100.0));
        assert!(!is_coarse(&[&sample(0.0, 0.0, 0.0), &sample(1.0, 0.0, 0.0)], 1), "at rest");
        // Hanging at -pi/2, of which the last digit is 2e-16, a bar swings by 6e-17.
        let hanging = |t: f64| sample(t, -std::f64::consts::FRAC_PI_2, 3e-16 * (5.0 * t).sin());
        assert!(!is_coarse(&[&hanging(0.0), &hanging(0.01), &hanging(0.02)], 1), "at rest but for rounding");
        let fast = |t: f64| sample(t, 0.3, 4.0);
        assert!(is_coarse(&[&fast(0.0), &fast(1000.0)], 1), "whole periods apart");
        let uniform = [&sample(0.0, 0.0, 5.0), &sample(1.0, 5.0, 5.0)];
        assert!(is_coarse(&uniform, 1) && !is_coarse(&uniform, 0), "a place is not told by turns");
    }

    #[test]
    fn a_cubic_motion_is_met_between_its_samples() {
        let motion = |t: f64| sample(t, t * t * t - t, 3.0 * t * t - 1.0);
        let samples = [motion(1.0), motion(1.5), motion(2.0)];
        for t in [1.0, 1.1, 1.5, 1.9, 2.0] {
            assert!((between(&samples, t).0[0] - motion(t).phi[0]).abs() < 1e-14);
        }
        assert!(between(&[], 1.0).0.is_empty());
        for (t, phi) in smoothed(&samples.iter().collect::<Vec<_>>()) {
            assert!((phi[0] - motion(t).phi[0]).abs() < 1e-14);
        }
    }
}
