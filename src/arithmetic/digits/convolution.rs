//! Products, and sums of products rounded once.
//!
//! Each product is formed in its upper columns and added, limb by limb, to the sum of positive or to that of
//! negative ones; carries are left for the end, and no branch depends on a sign.  The code is made for every
//! number of limbs up to eight.

use super::{Digits, DigitsKind, FARTHEST, MIDDLE, MOST, Scalar};

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
    ($limbs:expr, $sized:ident $(::$more:ident)*, $any:expr, ($($argument:expr),*)) => {
        match $limbs {
            2 => $sized::<2 $(, $more)*>($($argument),*),
            3 => $sized::<3 $(, $more)*>($($argument),*),
            4 => $sized::<4 $(, $more)*>($($argument),*),
            5 => $sized::<5 $(, $more)*>($($argument),*),
            6 => $sized::<6 $(, $more)*>($($argument),*),
            7 => $sized::<7 $(, $more)*>($($argument),*),
            8 => $sized::<8 $(, $more)*>($($argument),*),
            limbs => $any(limbs, $($argument),*),
        }
    };
}

/// a b.
pub fn product<const W: usize>(a: &Digits<W>, b: &Digits<W>) -> Digits<W> {
    if a.kind == DigitsKind::NotFinite || b.kind == DigitsKind::NotFinite {
        return Digits::NAN;
    }
    if a.is_zero() || b.is_zero() {
        return Digits::ZERO;
    }
    match a.limbs().min(b.limbs()) {
        2 => product_in::<4, W>(a, b, 2),
        3 => product_in::<5, W>(a, b, 3),
        4 => product_in::<6, W>(a, b, 4),
        limbs @ ..=8 => product_in::<10, W>(a, b, limbs),
        limbs @ ..=MIDDLE => product_in::<{ MIDDLE + 2 }, W>(a, b, limbs),
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
    if matches!(a.kind, DigitsKind::Zero | DigitsKind::NotFinite) || factor == 1 {
        return *a;
    }
    let (limbs, mut carry) = (a.limbs(), 0);
    let mut limb = [0; W];
    for (limb, &digit) in limb[..limbs].iter_mut().zip(&a.limb[..limbs]).rev() {
        let sum = u128::from(digit) * u128::from(factor) + u128::from(carry);
        *limb = sum as u64;
        carry = (sum >> 64) as u64;
    }
    let mut exponent = a.exponent;
    if carry > 0 {
        exponent += 1;
        if exponent >= FARTHEST {
            return Digits::NAN;
        }
        limb.copy_within(..limbs - 1, 1);
        limb[0] = carry;
    }
    Digits { exponent, limb, ..*a }
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
        if a.kind == DigitsKind::NotFinite || b.kind == DigitsKind::NotFinite {
            return Digits::NAN;
        }
        limbs = limbs.min(a.limbs()).min(b.limbs());
        top = top.max(a.exponent + b.exponent);
    }
    if top == i32::MIN {
        return Digits::ZERO;
    }
    match limbs {
        limbs @ ..=8 => sum_in::<10, 20, W>(terms, top, limbs),
        limbs @ ..=MIDDLE => sum_in::<{ MIDDLE + 2 }, { 2 * MIDDLE + 4 }, W>(terms, top, limbs),
        _ => sum_in::<{ MOST + 2 }, { 2 * MOST + 4 }, W>(terms, top, limbs),
    }
}

/// The sum, whose first limb is the first of the largest product, in room for two products end to end.
#[inline(always)]
fn sum_in<'a, const ROOM: usize, const DOUBLE: usize, const W: usize>(
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)>,
    top: i32,
    limbs: usize,
) -> Digits<W> {
    let mut sums = [[0; DOUBLE]; 2];
    by_size!(limbs, accumulate::ROOM::DOUBLE::W, any_accumulate::<ROOM, DOUBLE, W>, (terms, top, &mut sums));
    rounded::<DOUBLE, W>(&sums, top, limbs)
}

#[inline(always)]
fn accumulate<'a, const N: usize, const ROOM: usize, const DOUBLE: usize, const W: usize>(
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)>,
    top: i32,
    sums: &mut [[u128; DOUBLE]; 2],
) {
    add_all::<ROOM, DOUBLE, W>(N, terms, top, sums, columns::<N>);
}

fn any_accumulate<'a, const ROOM: usize, const DOUBLE: usize, const W: usize>(
    limbs: usize,
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)>,
    top: i32,
    sums: &mut [[u128; DOUBLE]; 2],
) {
    add_all::<ROOM, DOUBLE, W>(limbs, terms, top, sums, |a, b, found| any_columns(limbs, a, b, found));
}

/// Adds the limbs of every product to those of the positive or of the negative sum, carries left for the end.
#[inline(always)]
fn add_all<'a, const ROOM: usize, const DOUBLE: usize, const W: usize>(
    limbs: usize,
    terms: impl Iterator<Item = (&'a Digits<W>, &'a Digits<W>)>,
    top: i32,
    sums: &mut [[u128; DOUBLE]; 2],
    columns: impl Fn(&[u64], &[u64], &mut [u64]),
) {
    let mut found = [0; ROOM];
    for (a, b) in terms {
        let apart = (top - a.exponent).wrapping_sub(b.exponent) as usize;
        if a.is_zero() || b.is_zero() || apart >= limbs + 2 {
            continue;
        }
        columns(&a.limb, &b.limb, &mut found);
        let sum = &mut sums[usize::from(a.is_negative() != b.is_negative())];
        for (place, &limb) in sum[apart..apart + limbs + 2].iter_mut().zip(&found[..limbs + 2]) {
            *place += u128::from(limb);
        }
    }
}

/// The difference of the two sums.
#[inline(always)]
fn rounded<const DOUBLE: usize, const W: usize>(
    sums: &[[u128; DOUBLE]; 2],
    top: i32,
    limbs: usize,
) -> Digits<W> {
    let count = 2 * (limbs + 2);
    // Limbs with a first one for what is carried out.
    let mut carried = [[0; DOUBLE], [0; DOUBLE]];
    let mut over = [0; 2];
    for ((limbs, sum), over) in carried.iter_mut().zip(sums).zip(&mut over) {
        let mut carry = 0;
        for (limb, &sum) in limbs[..count].iter_mut().zip(&sum[..count]).rev() {
            let wide = sum + carry;
            *limb = wide as u64;
            carry = wide >> 64;
        }
        *over = carry as u64;
    }
    let is_negative = (over[1], &carried[1][..count]) > (over[0], &carried[0][..count]);
    let [positive, negative] = &mut carried;
    let (large, small) = if is_negative { (negative, positive) } else { (positive, negative) };
    let borrow = super::minus(&mut large[..count], &small[..count]);
    let first = over[usize::from(is_negative)] - over[usize::from(!is_negative)] - u64::from(borrow);
    let mut found = [0; DOUBLE];
    found[0] = first;
    found[1..].copy_from_slice(&large[..DOUBLE - 1]);
    Digits::normalized(is_negative, top + 1, limbs, &found[..count])
}
