//! What a number of digits asks of numbers and series.

use crate::arithmetic::digits::{MIDDLE, MOST, limbs_for};

/// Digits a run may have.
pub const DIGITS: std::ops::RangeInclusive<usize> = 20..=2000;
/// log2 of 10.
pub(super) const BITS: f64 = std::f64::consts::LOG2_10;
/// Bits beyond the digits, for rounding and for the size of what is computed.
const SPARE: usize = 28;
/// The same where it saves a limb: five digits below the last.
const LEAST_SPARE: usize = 18;
/// Highest power of the rates a digit: it makes the work least where an order costs its square.
const ORDER: f64 = 1.15;
/// Powers beyond that, as part of what one costs does not grow with their number: with 20 instead of 4 runs
/// take 0.66 to 0.9 of the time up to 40 digits, and as long from 100 on.
const LEAST_ORDER: usize = 20;

/// Digits, and the order of the series that serves them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Precision {
    /// Significant decimal digits.
    pub digits: usize,
    /// Highest power of the rates.
    pub order: usize,
    /// Limbs of all numbers.
    pub limbs: usize,
    /// Bits that series are kept to.
    pub bits: usize,
}

impl Precision {
    /// Of so many digits; `has_loops`: with as many digits more as passages near singular positions lose.
    pub fn new(digits: usize, has_loops: bool) -> Self {
        let order = (ORDER * digits as f64) as usize + LEAST_ORDER;
        let spare = if has_loops {
            (0.5 * BITS * digits as f64) as usize + 96
        } else if limbs_for(digits, LEAST_SPARE) < limbs_for(digits, SPARE) {
            LEAST_SPARE
        } else {
            SPARE
        };
        let bits = libm::ceil(BITS * digits as f64) as usize + spare;
        let limbs = limbs_for(digits, spare).min(MOST - 1);
        Self { digits, order, limbs, bits: bits.min(64 * (limbs - 1)) }
    }

    /// The same with another order.
    pub fn with_order(self, order: usize) -> Self {
        Self { order, ..self }
    }

    /// log2 of what the last power of a rate may leave in a step.
    pub(super) fn tolerance(&self) -> f64 {
        -BITS * (self.digits as f64 + 1.5)
    }

    /// log2 of what may be rounding of numbers of order one, known to this part of their digits. Steps keep
    /// the digits, however many bits more are carried.
    pub(super) fn rounding(&self, part: f64) -> f64 {
        -part * BITS * self.digits as f64
    }

    /// Limbs that each power of the rates, up to the order and one more, is kept to: the m-th weighs
    /// 10^(-digits m/order) in a step.
    pub(super) fn kept(&self) -> Vec<usize> {
        let all = 64.0 * (self.limbs - 1) as f64;
        let kept = |m: usize| {
            let falls = -self.tolerance() * m as f64 / self.order as f64;
            ((all - falls).max(SPARE as f64) / 64.0).ceil() as usize + 1
        };
        (0..=self.order + 1).map(kept).collect()
    }

    /// Room of numbers that hold so many limbs and one more: the sizes there is code for.
    pub(super) fn room(&self) -> usize {
        let sizes = [5, 8, MIDDLE, MOST];
        sizes.into_iter().find(|&size| size > self.limbs).unwrap_or(MOST)
    }
}
