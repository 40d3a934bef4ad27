//! Error-free sums and products: the rounding error of an operation is itself a double.
//!
//! Source: T. J. Dekker, *A floating-point technique for extending the available precision*, Numer. Math. 18 (1971);
//! D. E. Knuth, *The Art of Computer Programming*, vol. 2, section 4.2.2, theorem B.

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
///
/// A fused multiply-add is correctly rounded in hardware and in software alike, so the bits do not depend on the processor.
#[inline(always)]
pub fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_sum_is_what_rounding_dropped() {
        assert_eq!(two_sum(1.0, 2f64.powi(-60)), (1.0, 2f64.powi(-60)));
        assert_eq!(two_sum(2f64.powi(-60), 1.0), (1.0, 2f64.powi(-60)));
        assert_eq!(fast_two_sum(1.0, -2f64.powi(-70)), (1.0, -2f64.powi(-70)));
    }

    #[test]
    fn the_error_of_a_product_is_what_rounding_dropped() {
        let a = 1.0 + f64::EPSILON;
        assert_eq!(two_product(a, a), (1.0 + 2.0 * f64::EPSILON, f64::EPSILON * f64::EPSILON));
    }
}
