//! What every tableau must fulfil.

use super::dense::expand;
use super::{EmbeddedPair, NESTED, Row};

pub fn rows_sum_to_nodes<P: EmbeddedPair>(tolerance: f64) {
    for (row, c) in P::A.iter().zip(&P::C[1..]) {
        assert!((row.iter().map(|entry| entry.1).sum::<f64>() - c).abs() < tolerance);
    }
}

/// Σ b c^(k-1) = 1/k.
pub fn quadrature<P: EmbeddedPair>(order: i32, tolerance: f64) {
    for k in 1..=order {
        let sum: f64 = P::B.iter().map(|&(i, b)| b * P::C[i].powi(k - 1)).sum();
        assert!((sum - 1.0 / f64::from(k)).abs() < tolerance, "order {k}: {sum}");
    }
}

/// y' = t^(m-1) is interpolated exactly up to m = order.
pub fn interpolation<P: EmbeddedPair>(order: i32, tolerance: f64) {
    for m in 1..=order {
        let (t, h) = (0.3f64, 0.7);
        let rate = |t: f64| t.powi(m - 1);
        let exact = |at: f64| (at.powi(m) - t.powi(m)) / f64::from(m);
        let mut k: Vec<f64> = P::C.iter().map(|c| rate(t + c * h)).collect();
        k.push(rate(t + h));
        P::extra_stages(&mut |_, c, _: Row| k.push(rate(t + c * h)));
        let mut powers = [0.0; NESTED];
        expand(&P::interpolate(h, exact(t + h), &|stage| k[stage])[..P::DEGREE], &mut powers[..P::DEGREE]);
        for theta in [0.1, 0.5, 0.8, 1.0] {
            let found = powers.iter().rev().fold(0.0, |sum, power| (sum + power) * theta);
            assert!((found - exact(t + theta * h)).abs() < tolerance, "power {m} at {theta}: {found}");
        }
    }
}
