//! Sine, cosine, exponential, logarithm and the angle of a vector, to all digits asked for.
//!
//! ```text
//! sin, cos:  x = k π/2 + 2^j r,  v = cos r - 1 and s = sin r by their series,
//!     s, v ← 2 s (1 + v), 2 v (2 + v)   j times
//! exp:       x = k ln 2 + 2^j r, p = exp r - 1 by its series,                   p ← p (2 + p)
//!     j times
//! ln:        y ← y + x exp(-y) - 1;    atan2: a ← a + (y cos a - x sin a)/(x cos a + y sin a)
//! π = 16 atan 1/5 - 4 atan 1/239 (J. Machin, 1706),   ln 2 = 18 atanh 1/26 - 2 atanh 1/4801 + 8 atanh 1/8749
//! ```
//!
//! Source: R. Brent, P. Zimmermann, *Modern Computer Arithmetic* (2010), sections 4.2 to 4.4.

use super::quotient::turns;
use super::{Digits, DigitsKind, FARTHEST, Real, Scalar};
use std::sync::RwLock;

/// A constant, to as many limbs behind the point as have been asked for.
struct Constant {
    known: RwLock<Vec<u64>>,
    /// Multiples of arctangents, or of their hyperbolic kin, of unit fractions.
    parts: &'static [(i64, u64)],
    is_hyperbolic: bool,
}

static PI: Constant =
    Constant { known: RwLock::new(Vec::new()), parts: &[(16, 5), (-4, 239)], is_hyperbolic: false };
static LN_2: Constant = Constant {
    known: RwLock::new(Vec::new()),
    parts: &[(18, 26), (-2, 4801), (8, 8749)],
    is_hyperbolic: true,
};

impl Constant {
    /// To `W` limbs: cut off, so that the digits do not depend on how many were known before.
    fn digits<const W: usize>(&self) -> Digits<W> {
        let from = |known: &[u64]| Digits::normalized(false, 1, W, &known[..=W]);
        if let Ok(known) = self.known.read()
            && known.len() > W + 1
        {
            return from(&known);
        }
        // Two limbs more: there the last ones are rounded.
        let found = self.sum(W + 2);
        let digits = from(&found);
        if let Ok(mut known) = self.known.write()
            && known.len() < found.len()
        {
            *known = found;
        }
        digits
    }

    /// One limb before the point and so many behind it.
    fn sum(&self, limbs: usize) -> Vec<u64> {
        let mut sum = vec![0; limbs + 1];
        for &(multiple, k) in self.parts {
            let mut power = vec![0; limbs + 1];
            power[0] = multiple.unsigned_abs();
            divide(&mut power, k);
            for i in 0_u64.. {
                let mut term = power.clone();
                divide(&mut term, 2 * i + 1);
                if (multiple < 0) != (!self.is_hyperbolic && i % 2 == 1) {
                    super::minus(&mut sum, &term);
                } else {
                    super::plus(&mut sum, &term);
                }
                divide(&mut power, k * k);
                if power.iter().all(|&limb| limb == 0) {
                    break;
                }
            }
        }
        sum
    }
}

/// Divides limbs, the most significant first, by a number, and tells what is left.
fn divide(limbs: &mut [u64], by: u64) -> u64 {
    limbs.iter_mut().fold(0, |rest, limb| divide_on(limb, rest, by))
}

/// Goes on with a division in the next limb.
#[inline(always)]
fn divide_on(limb: &mut u64, rest: u64, by: u64) -> u64 {
    let wide = u128::from(rest) << 64 | u128::from(*limb);
    *limb = (wide / u128::from(by)) as u64;
    (wide % u128::from(by)) as u64
}

/// π.
pub fn pi<const W: usize>() -> Digits<W> {
    PI.digits()
}

/// The quotient by a small whole number.
pub fn over<const W: usize>(a: Digits<W>, by: u64) -> Digits<W> {
    if matches!(a.kind, DigitsKind::Zero | DigitsKind::NotFinite) {
        return a;
    }
    let limbs = a.limbs();
    let mut limb = a.limb;
    let rest = divide(&mut limb[..limbs], by);
    let mut exponent = a.exponent;
    if limb[0] == 0 {
        exponent -= 1;
        if exponent <= -FARTHEST {
            return Digits::ZERO;
        }
        limb.copy_within(1..limbs, 0);
        limb[limbs - 1] = 0;
        divide_on(&mut limb[limbs - 1], rest, by);
    }
    Digits { exponent, limb, ..a }
}

/// Numbers are worked on with a limb more than asked for, where there is room.
fn more<const W: usize>(x: Digits<W>) -> Digits<W> {
    x.shortened((x.limbs() + 1).min(W))
}

/// The whole number nearest to x, which is below 2⁶² in magnitude; `None` where it is not.
fn nearest<const W: usize>(x: Digits<W>) -> Option<i64> {
    if x.is_zero() || x.exponent < 0 {
        return Some(0);
    }
    let shifted = x.abs() + Digits::of(0.5);
    match shifted.exponent {
        ..=0 => Some(0),
        1 if shifted.limb[0] < 1 << 62 => {
            let whole = shifted.limb[0] as i64;
            Some(if x.is_negative() { -whole } else { whole })
        }
        _ => None,
    }
}

/// A whole number with its sign.
fn signed<const W: usize>(value: i64) -> Digits<W> {
    let whole = Digits::whole(value.unsigned_abs());
    if value < 0 { -whole } else { whole }
}

/// Quarters of a turn that a double counts.
const FEW_QUARTERS: f64 = 1e9;

/// How often an argument is halved: as often as makes series and doublings cost the same.
fn halvings(limbs: usize) -> i32 {
    libm::sqrt(32.0 * limbs as f64) as i32
}

/// Terms of a series of x^m/m! until they are below the last limb, for a number of this size.
fn terms(limbs: usize, log2: f64) -> u64 {
    let (mut bits, mut m) = (0.0, 0_u64);
    while bits < 64.0 * limbs as f64 && m < 10_000 {
        m += 1;
        bits += libm::log2(m as f64) - log2;
    }
    m + 1
}

/// Sine and cosine.
pub fn sin_cos<const W: usize>(x: Digits<W>) -> (Digits<W>, Digits<W>) {
    let limbs = x.limbs();
    let x = more(x);
    let quarter = pi::<W>().ldexp(-1);
    // Beside the middle of two quarters either will do.
    let quarters = x.value() * std::f64::consts::FRAC_2_PI;
    let near = (quarters.abs() < FEW_QUARTERS).then(|| libm::rint(quarters) as i64);
    let Some(k) = near.or_else(|| x.is_finite().then(|| nearest(x / quarter)).flatten()) else {
        return (Digits::NAN, Digits::NAN);
    };
    let j = halvings(x.limbs());
    let r = (x - signed(k) * quarter).ldexp(-j).shortened(x.limbs());
    let square = r * r;
    let (mut s, mut v) = (Digits::ONE, Digits::ONE);
    // Horner: sin r = r (1 - r²/(2·3) (1 - …)), cos r - 1 = -r²/2 (1 - r²/(3·4) (1 - …)).
    let most = terms(r.limbs(), -f64::from(j)).div_ceil(2);
    for m in (1..=most).rev() {
        s = Digits::ONE - over(square * s, 2 * m * (2 * m + 1));
        v = Digits::ONE - over(square * v, (2 * m + 1) * (2 * m + 2));
    }
    (s, v) = (r * s, -(square * v).ldexp(-1));
    for _ in 0..j {
        let two = Digits::whole(2);
        (s, v) = ((s * (Digits::ONE + v)).ldexp(1), (v * (two + v)).ldexp(1));
    }
    let (sin, cos) = (s.shortened(limbs), (Digits::ONE + v).shortened(limbs));
    match k.rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// exp x - 1 of an argument below 1 in magnitude.
fn exp_minus_one<const W: usize>(x: Digits<W>) -> Digits<W> {
    let j = halvings(x.limbs());
    let r = x.ldexp(-j);
    let mut sum = Digits::ONE;
    for m in (2..=terms(x.limbs(), -f64::from(j))).rev() {
        sum = Digits::ONE + over(r * sum, m);
    }
    let mut p = r * sum;
    for _ in 0..j {
        p = p * (Digits::whole(2) + p);
    }
    p
}

/// e to the power x.
pub fn exp<const W: usize>(x: Digits<W>) -> Digits<W> {
    let limbs = x.limbs();
    let x = more(x);
    let ln_2 = LN_2.digits::<W>();
    let k = x.is_finite().then(|| nearest(x / ln_2)).flatten();
    let Some(k) = k.filter(|k| k.unsigned_abs() < 1 << 31) else {
        return if x.is_negative() { Digits::ZERO } else { Digits::NAN };
    };
    let p = exp_minus_one(x - signed(k) * ln_2);
    (Digits::ONE + p).shortened(limbs).ldexp(k as i32)
}

/// Natural logarithm; NaN below zero, and of zero.
pub fn ln<const W: usize>(x: Digits<W>) -> Digits<W> {
    if x.kind != DigitsKind::Positive {
        return Digits::NAN;
    }
    let limbs = x.limbs();
    let x = more(x);
    let k = libm::round(x.log2()) as i32;
    let mantissa = x.ldexp(-k);
    let mut y = Digits::of(libm::log(mantissa.value()));
    for limbs in turns(x.limbs()) {
        y = y.shortened(limbs);
        y += mantissa.shortened(limbs) * exp(-y) - Digits::ONE;
    }
    (y + signed(i64::from(k)) * LN_2.digits()).shortened(limbs)
}

/// Hyperbolic tangent.
pub fn tanh<const W: usize>(x: Digits<W>) -> Digits<W> {
    let limbs = x.limbs();
    let twice = more(x).ldexp(1);
    if x.is_finite() && twice.abs().value() > 64.0 * W as f64 {
        return if x.is_negative() { -Digits::ONE } else { Digits::ONE }.shortened(limbs);
    }
    let p = if twice.abs().value() < 0.5 { exp_minus_one(twice) } else { exp(twice) - Digits::ONE };
    (p / (p + Digits::whole(2))).shortened(limbs)
}

/// The angle of the vector (x, y) in (-π, π].
pub fn atan2<const W: usize>(y: Digits<W>, x: Digits<W>) -> Digits<W> {
    let limbs = y.limbs().min(x.limbs());
    if !(x.is_finite() && y.is_finite()) {
        return Digits::NAN;
    }
    if y.is_zero() {
        return if x.is_negative() { pi() } else { Digits::ZERO };
    }
    // Angles do not ask for the size.
    let shift = x.exponent.max(y.exponent);
    let scaled = |mut a: Digits<W>| {
        a.exponent -= if a.is_zero() { 0 } else { shift };
        more(a.shortened(limbs))
    };
    let (y, x) = (scaled(y), scaled(x));
    let mut angle = Digits::of(libm::atan2(y.value(), x.value()));
    for limbs in turns(y.limbs()) {
        angle = angle.shortened(limbs);
        let (sin, cos) = angle.sin_cos();
        let (y, x) = (y.shortened(limbs), x.shortened(limbs));
        angle += (y * cos - x * sin) / (x * cos + y * sin);
    }
    angle.shortened(limbs)
}
