//! The step from the last coefficients, without a logarithm or a power function.
//!
//! ```text
//! h = tolerance^(1/(P+1)) min_k |v_k|^(-1/k),   k = P-4…P,   v_k over the unit of rates
//! ```
//!
//! which puts the first term left out of a rate at the tolerance.  The logarithm taken straight from the bits
//! of a double is piecewise linear, its error at most 0.09, and that is divided by k.

use super::JUDGES;
use super::expansion::minus_log2;

/// Largest share of a motion that its last powers may have, however small it is: beyond, the powers left out
/// are the larger ones.
const SHARE: f64 = 1e-3;

/// How long steps may be.
#[derive(Clone, Debug)]
pub struct StepSize {
    /// log2 tolerance / (P+1).
    exponent: f64,
    /// The longest step \[s\].
    longest: f64,
    /// The bits of the unit of rates \[rad/s\], a power of two.
    unit: i64,
}

impl StepSize {
    /// For a tolerance \[rad/s\] and an order, with a longest step \[s\].
    pub fn new(tolerance: f64, order: usize, longest: f64) -> Self {
        Self { exponent: libm::log2(tolerance) / (order + 1) as f64, longest, unit: 1f64.to_bits() as i64 }
    }

    /// The same for a tolerance in rad over a unit of time \[s\], a power of two.
    pub fn over(self, time: f64) -> Self {
        Self { unit: (1.0 / time).to_bits() as i64, ..self }
    }

    /// The step from the largest coefficients of orders P, P-1, … \[s\]; the longest one where they vanish.
    #[inline(always)]
    pub fn step<const P: usize>(&self, largest: &[f64; JUDGES]) -> f64 {
        self.step_of(P, largest)
    }

    /// The same for an order known at run time.
    #[inline(always)]
    pub fn step_of(&self, order: usize, largest: &[f64; JUDGES]) -> f64 {
        let mut least = f64::INFINITY;
        for (i, &size) in largest.iter().enumerate() {
            let log = (self.unit - size.to_bits() as i64) as f64;
            let root = log * (1.0 / ((1_u64 << 52) as f64 * (order - i) as f64));
            least = if root < least { root } else { least };
        }
        let x = least + self.exponent;
        if x > 60.0 {
            return self.longest;
        }
        // 2^x: whole part into the exponent, a cubic for the fraction.
        let whole = x.floor();
        let part = x - whole;
        let power = 1.0 + part * (0.695_5 + part * (0.226_2 + part * 0.078_3));
        let h = power * f64::from_bits(((1023 + whole.max(-1000.0) as i64) as u64) << 52);
        if h < self.longest { h } else { self.longest }
    }
}

/// Of a step as much as leaves the last of `largest`, powers order, order - 1, … of the rates over their
/// unit, smaller than the first: a motion that is smaller than the tolerance would have any step.
pub fn falling(
    tolerance: f64,
    order: usize,
    (last, largest): (&[f64; JUDGES], impl Fn(usize) -> f64),
    step: f64,
) -> f64 {
    let beginning = largest(0).max(largest(1) * step);
    if tolerance < 0.1 * SHARE * beginning || *last == [0.0; JUDGES] {
        return step;
    }
    shortened(order, last, largest, step)
}

#[cold]
fn shortened(order: usize, last: &[f64; JUDGES], largest: impl Fn(usize) -> f64, mut step: f64) -> f64 {
    // Every round takes the surplus down by a fifth or more.
    for _ in 0..100 {
        let (mut size, mut power) = (0.0_f64, 1.0);
        for k in 0..=order - JUDGES {
            size = size.max(largest(k) * power);
            power *= step;
        }
        let most = |(i, &last): (usize, &f64)| {
            libm::exp2((minus_log2(last) - minus_log2(SHARE * size)) / (order - i) as f64)
        };
        let least = last.iter().enumerate().map(most).fold(f64::INFINITY, f64::min);
        if size == 0.0 || least >= 0.95 * step {
            break;
        }
        step = least;
    }
    step
}

/// The step taken of the one wanted where `left` \[s\] are left: no sliver is left over.
#[inline(always)]
pub fn taken(wanted: f64, left: f64) -> f64 {
    if wanted >= left {
        left
    } else if wanted > 0.5 * left {
        0.5 * left
    } else {
        wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_that_of_the_formula_within_two_percent() {
        for (scale, growth) in [(1.0, 20.0), (1e-12, 3.0), (1e6, 0.5)] {
            let size = |k: i32| scale * f64::powi(growth, k);
            let exact = (16..=20).map(|k| size(k).powf(-1.0 / f64::from(k))).fold(f64::INFINITY, f64::min)
                * 1e-13_f64.powf(1.0 / 21.0);
            let found =
                StepSize::new(1e-13, 20, 1e9).step::<20>(&[size(20), size(19), size(18), size(17), size(16)]);
            assert!((found / exact - 1.0).abs() < 0.02, "{found} {exact}");
        }
    }

    #[test]
    fn vanishing_coefficients_give_the_longest_step() {
        assert_eq!(StepSize::new(1e-13, 20, 7.0).step::<20>(&[0.0; JUDGES]), 7.0);
        // One of them is enough for a step that is right.
        assert!(StepSize::new(1e-13, 20, 7.0).step::<20>(&[0.0, 0.0, 0.0, 1e20, 0.0]) < 0.1);
    }
}
