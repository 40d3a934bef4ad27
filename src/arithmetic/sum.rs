//! Error-free sums and products: the rounding error of an operation is itself a double.
//!
//! Source: T. J. Dekker, *A floating-point technique for extending the available precision*, Numer. Math. 18
//! (1971); D. E. Knuth, *The Art of Computer Programming*, vol. 2, section 4.2.2, theorem B.

/// `a + b = sum + error` exactly, for any order of magnitude (Knuth, six operations).
#[inline(always)]
pub fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_virtual = sum - a;
    let a_virtual = sum - b_virtual;
    (sum, (a - a_virtual) + (b - b_virtual))
}

/// `a + b = sum + error` exactly, where `|a| >= |b|` or `a = 0` (Dekker, three operations).
#[inline(always)]
pub fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// `a * b = product + error` exactly (barring underflow), by one fused multiply-add.
#[inline(always)]
pub fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, fused(a, b, -product))
}

/// `a * b + c`, rounded once: by the processor or in software, to the same bits.
///
/// Not by the C library of 32-bit x86, which computes in 80 bits: musl's rounds twice where c is zero.
#[inline(always)]
#[expect(clippy::disallowed_methods, reason = "the one place that knows where it is rounded once")]
pub fn fused(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(driftless_relaxed) {
        return nearly_fused(a, b, c);
    }
    if cfg!(target_arch = "x86") { libm::fma(a, b, c) } else { a.mul_add(b, c) }
}

/// The same but for the last bit in rare cases, and for numbers near the ends of the range: for processors
/// that would do it in software, where same bits are not asked for (`--cfg driftless_relaxed`, the
/// playground).
fn nearly_fused(a: f64, b: f64, c: f64) -> f64 {
    /// 2²⁷ + 1 (Veltkamp).
    const HALVES: f64 = 134_217_729.0;
    let halves = |x: f64| {
        let wide = HALVES * x;
        let high = wide - (wide - x);
        (high, x - high)
    };
    let ((a_high, a_low), (b_high, b_low)) = (halves(a), halves(b));
    let product = a * b;
    let error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    let (sum, rest) = two_sum(product, c);
    let fused = sum + (rest + error);
    if fused.is_nan() { product + c } else { fused }
}

/// The larger of two; not a number where either is not, which `f64::max` would lose.
#[inline(always)]
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// 1.5 · 2⁵²: a sum near it has no bits for a fraction, and its last bits are those of the whole number, so
/// that adding and taking it away rounds to the nearest integer, ties to even.
pub const WHOLE: f64 = 6_755_399_441_055_744.0;

/// The nearest whole number, ties to even; two additions where the size allows it, since the baseline
/// processor has no instruction for it.
#[inline(always)]
pub fn nearest(value: f64) -> f64 {
    if value.abs() < 1e15 { (value + WHOLE) - WHOLE } else { value.round_ties_even() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_one_for_pages_is_within_a_unit_of_the_last_place() {
        let number = |k: u32| (f64::from(k) * 0.754_877).fract() * 4.0 - 2.0;
        for k in 0..10_000 {
            let (a, b) = (number(k), number(7 * k + 1));
            let product = a * b;
            assert_eq!(nearly_fused(a, b, -product), fused(a, b, -product), "{a} {b}");
            let (near, exact) = (nearly_fused(a, b, number(3 * k)), fused(a, b, number(3 * k)));
            assert!((near - exact).abs() <= f64::EPSILON * exact.abs(), "{a} {b}: {near} {exact}");
        }
        assert_eq!(nearly_fused(1e300, 1e10, 1.0), f64::INFINITY);
        assert!(nearly_fused(f64::NAN, 1.0, 1.0).is_nan());
    }

    #[test]
    fn the_error_of_a_sum_is_what_rounding_dropped() {
        assert_eq!(two_sum(1.0, 2f64.powi(-60)), (1.0, 2f64.powi(-60)));
        assert_eq!(two_sum(2f64.powi(-60), 1.0), (1.0, 2f64.powi(-60)));
        assert_eq!(fast_two_sum(1.0, -2f64.powi(-70)), (1.0, -2f64.powi(-70)));
    }

    #[test]
    fn a_fused_multiply_add_is_rounded_once() {
        // Halfway between two doubles in 64 bits, just below it in full.
        let (a, b) = (f64::from_bits(0x3fc7_5d27_d400_0000), f64::from_bits(0x3fde_1fdc_7ff1_9194));
        assert_eq!(fused(a, b, 0.0).to_bits(), 0x3fb5_fe98_9331_476f);
        let (half, less) = (f64::EPSILON / 2.0, 2f64.powi(-90));
        assert_eq!((fused(1.0, half, 1.0), fused(1.0 + f64::EPSILON, half, 1.0)), (1.0, 1.0 + f64::EPSILON));
        assert_eq!(
            (fused(less, less, 1.0 + f64::EPSILON), fused(-less, less, 1.0)),
            (1.0 + f64::EPSILON, 1.0)
        );
    }

    #[test]
    fn the_error_of_a_product_is_what_rounding_dropped() {
        let a = 1.0 + f64::EPSILON;
        assert_eq!(two_product(a, a), (1.0 + 2.0 * f64::EPSILON, f64::EPSILON * f64::EPSILON));
    }

    #[test]
    fn the_nearest_whole_number_is_found_at_every_size() {
        for value in [0.0, 0.49, 0.51, -0.51, 1.5, 2.5, -1e14 - 0.4, 1e15 + 0.75, -3e300] {
            assert_eq!(nearest(value), value.round_ties_even(), "{value}");
        }
        assert!(nearest(f64::NAN).is_nan() && nearest(f64::INFINITY).is_infinite());
    }
}
