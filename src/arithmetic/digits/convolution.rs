//! Products, and sums of products rounded once.
//!
//! The sum is held in two's complement over the limbs from the largest product down; each product is formed in
//! its upper columns and added at its place, negative ones as their complement, so that no branch depends on a
//! sign.  The code is made for every number of limbs up to eight.

use super::{Digits, Kind, MOST, Scalar};

/// The upper columns of the product of two numbers of `N` limbs each into `found` (N + 2), the first of which
/// is what is carried out of the first column.
#[inline(always)]
fn columns<const N: usize>(a: &[u64], b: &[u64], found: &mut [u64]) {
    let (a, b, found) = (&a[..N], &b[..N], &mut found[..N + 2]);
    found.fill(0);
    for i in (0..N).rev() {
        let mut carry = 0;
        let last = if N - i < N { N - i + 1 } else { N };
        for j in (0..last).rev() {
            let sum = u128::from(a[i]) * u128::from(b[j]) + u128::from(found[i + j + 1]) + u128::from(carry);
            found[i + j + 1] = sum as u64;
            carry = (sum >> 64) as u64;
        }
        found[i] = carry;
    }
}

/// The same of any number of limbs.
fn any_columns(limbs: usize, a: &[u64], b: &[u64], found: &mut [u64]) {
    let (a, b, found) = (&a[..limbs], &b[..limbs], &mut found[..limbs + 2]);
    found.fill(0);
    for i in (0..limbs).rev() {
        let mut carry = 0;
        let last = (limbs - i + 1).min(limbs);
        let place = &mut found[i + 1..=i + last];
        for (place, &b) in place.iter_mut().zip(&b[..last]).rev() {
            let sum = u128::from(a[i]) * u128::from(b) + u128::from(*place) + u128::from(carry);
            *place = sum as u64;
            carry = (sum >> 64) as u64;
        }
        found[i] = carry;
    }
}

/// By the code for this number of limbs.
macro_rules! by_size {
    ($limbs:expr, $sized:ident $(::$more:tt)?, $any:expr, ($($argument:expr),*)) => {
        match $limbs {
            2 => $sized::<2 $(, $more)?>($($argument),*),
            3 => $sized::<3 $(, $more)?>($($argument),*),
            4 => $sized::<4 $(, $more)?>($($argument),*),
            5 => $sized::<5 $(, $more)?>($($argument),*),
            6 => $sized::<6 $(, $more)?>($($argument),*),
            7 => $sized::<7 $(, $more)?>($($argument),*),
            8 => $sized::<8 $(, $more)?>($($argument),*),
            limbs => $any(limbs, $($argument),*),
        }
    };
}

/// a b.
pub fn product<const W: usize>(a: &Digits<W>, b: &Digits<W>) -> Digits<W> {
    if a.kind == Kind::NotFinite || b.kind == Kind::NotFinite {
        return Digits::NAN;
    }
    if a.is_zero() || b.is_zero() {
        return Digits::ZERO;
    }
    match a.limbs().min(b.limbs()) {
        limbs @ ..=8 => product_in::<10, W>(a, b, limbs),
        limbs => product_in::<{ MOST + 2 }, W>(a, b, limbs),
    }
}

#[inline(always)]
fn product_in<const ROOM: usize, const W: usize>(a: &Digits<W>, b: &Digits<W>, limbs: usize) -> Digits<W> {
    let mut found = [0; ROOM];
    by_size!(limbs, columns, any_columns, (&a.limb, &b.limb, &mut found));
    let is_negative = a.is_negative() != b.is_negative();
    Digits::normalized(is_negative, a.exponent + b.exponent, limbs, &found[..limbs + 2])
}

/// The product with a whole number.
pub fn times_whole<const W: usize>(a: &Digits<W>, factor: u64) -> Digits<W> {
    if factor == 0 && a.is_finite() {
        return Digits::ZERO;
    }
    if matches!(a.kind, Kind::Zero | Kind::NotFinite) || factor == 1 {
        return *a;
    }
    let (limbs, mut carry) = (a.limbs(), 0);
    let mut found = [0; MOST + 1];
    for i in (0..limbs).rev() {
        let sum = u128::from(a.limb[i]) * u128::from(factor) + u128::from(carry);
        found[i + 1] = sum as u64;
        carry = (sum >> 64) as u64;
    }
    found[0] = carry;
    Digits::normalized(a.is_negative(), a.exponent + 1, limbs, &found[..=limbs])
}

/// Σ a b of terms, rounded once, with as many limbs as the shortest of them.
pub fn sum_of_products<'a, const W: usize>(
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)> + Clone,
) -> Digits<W> {
    let (mut limbs, mut top) = (W, i32::MIN);
    for (a, b) in terms.clone() {
        if a.is_zero() || b.is_zero() {
            continue;
        }
        if a.kind == Kind::NotFinite || b.kind == Kind::NotFinite {
            return Digits::NAN;
        }
        limbs = limbs.min(a.limbs()).min(b.limbs());
        top = top.max(a.exponent + b.exponent);
    }
    if top == i32::MIN {
        return Digits::ZERO;
    }
    match limbs {
        ..=8 => sum_in::<11, W>(terms, top, limbs),
        _ => sum_in::<{ MOST + 3 }, W>(terms, top, limbs),
    }
}

/// The sum in room for three limbs more than it has; the second is the first of the largest product.
#[inline(always)]
fn sum_in<'a, const ROOM: usize, const W: usize>(
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)>,
    top: i32,
    limbs: usize,
) -> Digits<W> {
    let mut sum = [0; ROOM];
    by_size!(limbs, accumulate::W, any_accumulate, (terms, top, &mut sum));
    rounded(&mut sum[..limbs + 3], top + 1, limbs)
}

#[inline(always)]
fn accumulate<'a, const N: usize, const W: usize>(
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)>,
    top: i32,
    sum: &mut [u64],
) {
    add_all::<10, W>(N, terms, top, sum, columns::<N>);
}

fn any_accumulate<'a, const W: usize>(
    limbs: usize,
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)>,
    top: i32,
    sum: &mut [u64],
) {
    add_all::<{ MOST + 2 }, W>(limbs, terms, top, sum, |a, b, found| any_columns(limbs, a, b, found));
}

#[inline(always)]
fn add_all<'a, const ROOM: usize, const W: usize>(
    limbs: usize,
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)>,
    top: i32,
    sum: &mut [u64],
    columns: impl Fn(&[u64], &[u64], &mut [u64]),
) {
    let mut found = [0; ROOM];
    for (a, b) in terms {
        let apart = (top - a.exponent).wrapping_sub(b.exponent) as usize;
        if a.is_zero() || b.is_zero() || apart >= limbs + 2 {
            continue;
        }
        columns(&a.limb, &b.limb, &mut found);
        // -x is the complement of x, plus one in the last limb that counts.
        let mask = if a.is_negative() == b.is_negative() { 0 } else { u64::MAX };
        let mut carry = mask & 1;
        let (above, place) = sum[..limbs + 3].split_at_mut(1 + apart);
        for (place, &limb) in place.iter_mut().zip(&found[..limbs + 2 - apart]).rev() {
            let wide = u128::from(*place) + u128::from(limb ^ mask) + u128::from(carry);
            *place = wide as u64;
            carry = (wide >> 64) as u64;
        }
        for place in above.iter_mut().rev() {
            let wide = u128::from(*place) + u128::from(mask) + u128::from(carry);
            *place = wide as u64;
            carry = (wide >> 64) as u64;
        }
    }
}

/// The number that a sum in two's complement stands for.
fn rounded<const W: usize>(sum: &mut [u64], exponent: i32, limbs: usize) -> Digits<W> {
    let is_negative = sum[0] >> 63 == 1;
    if is_negative {
        let mut carry = true;
        for limb in sum.iter_mut().rev() {
            (*limb, carry) = (!*limb).overflowing_add(u64::from(carry));
        }
    }
    Digits::normalized(is_negative, exponent, limbs, sum)
}
