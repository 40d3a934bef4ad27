//! Quotients and square roots, by Newton's iteration from the doubles nearest to them.
//!
//! ```text
//! x ← x + x (1 - b x),   q = a x,  q ← q + x (a - q b)
//! y ← y + y (1 - a y²)/2,   s = a y,  s ← s + y (a - s²)/2
//! ```
//!
//! Every turn doubles the digits, and runs on as many limbs as it yields.

use super::{Digits, DigitsKind, Real, Scalar};

/// Limbs of the turns of an iteration that starts with a double and ends with so many.
pub(super) fn turns(limbs: usize) -> impl Iterator<Item = usize> {
    // A double has 53 bits; n limbs have at least 64 (n - 1).
    let mut bits = 50;
    std::iter::from_fn(move || {
        (bits < 64 * limbs).then(|| {
            bits *= 2;
            (bits / 64 + 2).min(limbs)
        })
    })
}

/// A number near one limb in size as a double, and the limbs taken off its exponent.
fn leading<const W: usize>(a: &Digits<W>) -> (f64, i32) {
    let mut near = *a;
    near.exponent = 1;
    (near.value(), a.exponent - 1)
}

/// a / b.
pub fn quotient<const W: usize>(a: Digits<W>, b: Digits<W>) -> Digits<W> {
    if matches!(b.kind, DigitsKind::Zero | DigitsKind::NotFinite) || !a.is_finite() {
        return Digits::NAN;
    }
    if a.is_zero() {
        return a;
    }
    let limbs = a.limbs().min(b.limbs());
    let room = (limbs + 1).min(W);
    let b = b.shortened(room);
    let (size, shift) = leading(&b);
    let mut x = Digits::of(1.0 / size);
    x.exponent -= shift;
    for limbs in turns(room) {
        x = x.shortened(limbs);
        x += x * (Digits::ONE - b.shortened(limbs) * x);
    }
    let (a, x) = (a.shortened(room), x.shortened(room));
    let q = a * x;
    (q + x * (a - q * b)).shortened(limbs)
}

/// The root of `a`; NaN below zero.
pub fn square_root<const W: usize>(a: Digits<W>) -> Digits<W> {
    match a.kind {
        DigitsKind::Zero => return a,
        DigitsKind::Negative | DigitsKind::NotFinite => return Digits::NAN,
        DigitsKind::Positive => {}
    }
    let limbs = a.limbs();
    let room = (limbs + 1).min(W);
    let a = a.shortened(room);
    let (mut size, mut shift) = leading(&a);
    if shift % 2 != 0 {
        // Limbs by twos have whole roots.
        (size, shift) = (size * super::TWO_64, shift - 1);
    }
    let mut y = Digits::of(1.0 / size.sqrt());
    y.exponent -= shift / 2;
    for limbs in turns(room) {
        y = y.shortened(limbs);
        y += (y * (Digits::ONE - a.shortened(limbs) * y * y)).ldexp(-1);
    }
    let y = y.shortened(room);
    let s = a * y;
    (s + (y * (a - s * s)).ldexp(-1)).shortened(limbs)
}
