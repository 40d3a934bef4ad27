//! Power series as factors of Cauchy products: fixed point on a scaled time.
//!
//! ```text
//! a_m U^m = (V_m - 1/2) 2^e,   0 <= V_m < 1
//!     U = 2^unit seconds: coefficients hardly fall where U is near the radius of convergence
//! Σ_j a_j b_{M-j} = 2^(e_a + e_b) U^-M (Σ V V' - (Σ V + Σ V')/2 + n/4)
//! ```
//!
//! So no term of a sum has a sign or a place of its own, and the sums of V are differences of sums from the
//! first power on.  Of up to four limbs, all columns of a product are added to sums of 128 bits that stay in
//! registers, power by power; of more limbs, a column is a loop over limbs one after another in memory.  A
//! sum of total power M contributes (step/U)^M to a step, and is formed from so many limbs of its factors as
//! that leaves; columns below those are left out.  A power larger than there is room for makes the room
//! larger.

use super::{Digits, DigitsKind, Scalar, sum_of_products};
use std::ops::RangeInclusive;

/// Bits of room above the first power that is not zero.
const HEAD: i32 = 4;
/// Powers that others are measured against: by symmetry some may vanish.
const EARLY: usize = 5;
/// Bits that later powers may be larger by.
const GROWTH: i32 = 10;
/// Bits that room above two factors takes, with two for rounding.
const GUARD: usize = 2 * HEAD as usize + 4;
/// Limbs at most.  Sums have room for three more: one above the point, and one below the last column.
const MOST: usize = super::MOST + 2;
/// Limbs that there is smaller room for: it is cleared every time.
const SMALL: usize = 9;
const MIDDLE: usize = super::MIDDLE + 2;
/// Limbs of powers that are kept one after another.
const FEW: usize = 4;

/// The unit of time of a step's series, and the limbs that sums are formed from.
#[derive(Clone, Debug, Default)]
pub struct TimeScale {
    /// log2 of the unit of time \[s\].
    unit: i32,
    /// Limbs of the factors of sums of this total power, falling.  Empty: products are those of numbers with
    /// exponents.
    limbs: Vec<usize>,
    /// log2 of the longest step they serve \[s\].
    longest: f64,
}

impl TimeScale {
    /// For series up to power `order` that converge up to 2^`radius` s and make steps of up to 2^`step` s,
    /// kept to so many bits.
    pub fn new(radius: f64, step: f64, order: usize, bits: usize) -> Self {
        let unit = libm::floor(radius - 0.1);
        // Every product left out and every limb cut off may cost one in the last place.
        let terms = libm::log2((order * bits.div_ceil(64)) as f64);
        let all = (bits + GUARD) as f64 + terms;
        let needed = |m: usize| libm::ceil((all - m as f64 * (unit - step)) / 64.0);
        let limbs = (0..=order + 2).map(|m| needed(m).clamp(1.0, MOST as f64) as usize);
        Self { unit: unit as i32, limbs: limbs.collect(), longest: step }
    }

    /// Longest step that the limbs serve \[s\].
    pub fn longest(&self) -> f64 {
        if self.limbs.is_empty() { f64::INFINITY } else { libm::exp2(self.longest) }
    }

    fn limbs(&self, power: usize) -> usize {
        self.limbs.get(power).copied().unwrap_or(1)
    }
}

/// A series whose powers come one after another.
#[derive(Clone, Debug)]
pub struct Factor<const W: usize> {
    powers: Vec<Digits<W>>,
    /// Limb i of V_m at `i limb_stride + m power_stride`.
    limbs: Vec<u64>,
    limb_stride: usize,
    power_stride: usize,
    /// Powers there is room for.
    room: usize,
    /// Σ_{j<m} V_j, a limb above the point first, `stride` limbs each.
    sums: Vec<u64>,
    stride: usize,
    /// e; `None` as long as all powers are zero.
    exponent: Option<i32>,
    /// What e would be for the first powers alone.
    early: Option<i32>,
    is_finite: bool,
}

impl<const W: usize> Factor<W> {
    /// Room for powers up to `order`.
    pub fn new(order: usize) -> Self {
        let powers = Vec::with_capacity(order + 1);
        Self {
            powers,
            limbs: Vec::new(),
            limb_stride: 1,
            power_stride: FEW,
            room: order + 1,
            sums: Vec::new(),
            stride: 0,
            exponent: None,
            early: None,
            is_finite: true,
        }
    }

    /// Forgets all powers.
    pub fn restart(&mut self, scale: &TimeScale) {
        self.powers.clear();
        (self.exponent, self.early, self.is_finite) = (None, None, true);
        if scale.limbs.is_empty() {
            return;
        }
        let limbs = scale.limbs(0);
        self.stride = limbs + 1;
        (self.limb_stride, self.power_stride) = if limbs <= FEW { (1, FEW) } else { (self.room, 1) };
        self.limbs.resize(limbs.max(FEW) * self.room, 0);
        // Every sum is written before it is read, but for the first.
        self.sums.resize(self.stride * (self.room + 1), 0);
        self.sums[..self.stride].fill(0);
    }

    /// Takes the next power.
    pub fn push(&mut self, scale: &TimeScale, power: Digits<W>) {
        let m = self.powers.len();
        self.is_finite &= power.is_finite();
        self.powers.push(power);
        if scale.limbs.is_empty() {
            return;
        }
        if matches!(power.kind, DigitsKind::Positive | DigitsKind::Negative) {
            let bits = 64 * power.exponent - power.limb[0].leading_zeros() as i32;
            let needed = bits + scale.unit * m as i32 + 1;
            if m < EARLY {
                self.early = self.early.max(Some(needed));
            }
            if self.exponent.is_none_or(|exponent| needed > exponent) {
                self.exponent = Some(needed + HEAD);
                (0..m).for_each(|m| self.place(scale, m));
            }
        }
        self.place(scale, m);
    }

    /// True where later powers are as small as sums expect.
    pub fn is_sound(&self) -> bool {
        match (self.exponent, self.early) {
            (Some(exponent), Some(early)) => exponent - HEAD - early <= GROWTH,
            (Some(_), None) => false,
            (None, _) => true,
        }
    }

    /// V_m, and the sum up to it.
    fn place(&mut self, scale: &TimeScale, m: usize) {
        match scale.limbs(m) {
            1 => self.place_in::<1>(scale, m, 1),
            2 => self.place_in::<2>(scale, m, 2),
            3 => self.place_in::<3>(scale, m, 3),
            4 => self.place_in::<4>(scale, m, 4),
            limbs @ ..=SMALL => self.place_in::<SMALL>(scale, m, limbs),
            limbs @ ..=MIDDLE => self.place_in::<MIDDLE>(scale, m, limbs),
            limbs => self.place_in::<MOST>(scale, m, limbs),
        }
    }

    #[inline(always)]
    fn place_in<const ROOM: usize>(&mut self, scale: &TimeScale, m: usize, limbs: usize) {
        let power = &self.powers[m];
        let mut found = [0; ROOM];
        let found = &mut found[..limbs];
        if let (Some(exponent), DigitsKind::Positive | DigitsKind::Negative) = (self.exponent, power.kind) {
            shifted_down(&power.limb, exponent - 64 * power.exponent - scale.unit * m as i32, found);
            if power.is_negative() {
                negate(found);
            }
        }
        found[0] ^= 1 << 63;
        for (i, &limb) in found.iter().enumerate() {
            self.limbs[i * self.limb_stride + m * self.power_stride] = limb;
        }
        let (before, sum) = self.sums.split_at_mut((m + 1) * self.stride);
        let sum = &mut sum[..self.stride];
        sum.copy_from_slice(&before[m * self.stride..]);
        if super::plus(&mut sum[1..limbs + 1], found) {
            sum[0] += 1;
        }
    }

    /// Σ_j a_j b_{total-j} over the powers `of` this series, rounded once.
    pub fn product(
        &self,
        other: &Self,
        scale: &TimeScale,
        total: usize,
        of: RangeInclusive<usize>,
    ) -> Digits<W> {
        let (first, last) = of.into_inner();
        if first > last {
            return Digits::ZERO;
        }
        let (of, from) = ([first, last + 1], [total - last, total - first + 1]);
        if scale.limbs.is_empty() {
            let powers = other.powers[from[0]..from[1]].iter().rev();
            return sum_of_products(self.powers[of[0]..of[1]].iter().zip(powers));
        }
        if !(self.is_finite && other.is_finite) {
            return Digits::NAN;
        }
        let (Some(exponent), Some(other_exponent)) = (self.exponent, other.exponent) else {
            return Digits::ZERO;
        };
        let limbs = scale.limbs(total);
        let bits = exponent + other_exponent - scale.unit * total as i32;
        match limbs {
            1 => self.scaled_few::<1, 4>(other, of, from, bits),
            2 => self.scaled_few::<2, 5>(other, of, from, bits),
            3 => self.scaled_few::<3, 6>(other, of, from, bits),
            4 => self.scaled_few::<4, 7>(other, of, from, bits),
            limbs @ ..=SMALL => self.scaled::<{ SMALL + 3 }>(other, of, from, limbs, bits),
            limbs @ ..=MIDDLE => self.scaled::<{ MIDDLE + 3 }>(other, of, from, limbs, bits),
            _ => self.scaled::<{ MOST + 3 }>(other, of, from, limbs, bits),
        }
    }

    /// The same in fixed point from `N` limbs, in room for three limbs more.
    #[inline(always)]
    fn scaled_few<const N: usize, const ROOM: usize>(
        &self,
        other: &Self,
        of: [usize; 2],
        from: [usize; 2],
        bits: i32,
    ) -> Digits<W> {
        if self.power_stride != FEW {
            return self.scaled::<ROOM>(other, of, from, N, bits);
        }
        let (a, b) = (self.limbs.as_chunks::<FEW>().0, other.limbs.as_chunks::<FEW>().0);
        let (a, b) = (&a[of[0]..of[1]], &b[from[0]..from[1]]);
        // The limbs of the product, the first one above its first column.
        let mut columns = [0_u128; FEW + 1];
        let (a_pairs, a_rest) = a.as_chunks::<2>();
        let (b_rest, b_pairs) = b.as_rchunks::<2>();
        for (a, b) in a_pairs.iter().zip(b_pairs.iter().rev()) {
            add_columns::<N>(&a[0], &b[1], &mut columns);
            add_columns::<N>(&a[1], &b[0], &mut columns);
        }
        if let ([a], [b]) = (a_rest, b_rest) {
            add_columns::<N>(a, b, &mut columns);
        }
        let (mut sum, mut carry) = ([0; ROOM], 0);
        for (sum, column) in sum[1..N + 2].iter_mut().zip(&columns).rev() {
            let wide = column + carry;
            (*sum, carry) = (wide as u64, wide >> 64);
        }
        sum[0] = carry as u64;
        self.rounded::<ROOM>(other, of, from, bits, &mut sum[..N + 2])
    }

    /// The same from any number of limbs.
    #[inline(always)]
    fn scaled<const ROOM: usize>(
        &self,
        other: &Self,
        of: [usize; 2],
        from: [usize; 2],
        limbs: usize,
        bits: i32,
    ) -> Digits<W> {
        let a = |i: usize| &self.limbs[i * self.limb_stride..][of[0]..of[1]];
        let b = |i: usize| &other.limbs[i * other.limb_stride..][from[0]..from[1]];
        // A limb above the point, which has the sign, and one more below it than there are columns.
        let mut sum = [0; ROOM];
        let sum = &mut sum[..limbs + 2];
        let mut carry = 0_u128;
        for column in (0..limbs).rev() {
            let (mut low, mut high) = (u128::from(carry as u64), carry >> 64);
            for i in 0..=column {
                add_products(a(i), b(column - i), &mut low, &mut high);
            }
            sum[column + 2] = low as u64;
            carry = high + (low >> 64);
        }
        (sum[1], sum[0]) = (carry as u64, (carry >> 64) as u64);
        self.rounded::<ROOM>(other, of, from, bits, sum)
    }

    /// From Σ V V', the rest of the product: a limb above the point first.
    #[inline(always)]
    fn rounded<const ROOM: usize>(
        &self,
        other: &Self,
        of: [usize; 2],
        from: [usize; 2],
        bits: i32,
        sum: &mut [u64],
    ) -> Digits<W> {
        // Σ V + Σ V', of which half is taken off, a bit below its last limb.
        let count = sum.len() - 1;
        let mut twice = [0; ROOM];
        let twice = &mut twice[..count + 1];
        let ([a_from, a_to], [b_from, b_to]) = (self.sums_before(of, count), other.sums_before(from, count));
        let mut carry = 0;
        for i in (0..count).rev() {
            let (a, b) =
                (i128::from(a_to[i]) - i128::from(a_from[i]), i128::from(b_to[i]) - i128::from(b_from[i]));
            let wide = a + b + carry;
            (twice[i], carry) = (wide as u64, wide >> 64);
        }
        let mut borrow = false;
        for i in (0..=count).rev() {
            let above = if i == 0 { 0 } else { twice[i - 1] << 63 };
            let (rest, first) = sum[i].overflowing_sub(twice[i] >> 1 | above);
            let (rest, second) = rest.overflowing_sub(u64::from(borrow));
            (sum[i], borrow) = (rest, first | second);
        }
        // n/4.
        let terms = (of[1] - of[0]) as u64;
        super::plus(&mut sum[..2], &[terms >> 2, terms << 62]);
        let is_negative = sum[0] >> 63 == 1;
        if is_negative {
            negate(sum);
        }
        raised::<ROOM, W>(is_negative, sum, bits, count)
    }

    /// The sums of V before these powers, to so many limbs.
    #[inline(always)]
    fn sums_before(&self, powers: [usize; 2], count: usize) -> [&[u64]; 2] {
        let before = |m: usize| &self.sums[m * self.stride..m * self.stride + count];
        [before(powers[0]), before(powers[1])]
    }
}

/// Adds the product of two numbers of `N` limbs to columns, the first of which is above its own first one.
#[inline(always)]
fn add_columns<const N: usize>(a: &[u64; FEW], b: &[u64; FEW], columns: &mut [u128; FEW + 1]) {
    for i in 0..N {
        for k in 0..N - i {
            let product = u128::from(a[i]) * u128::from(b[k]);
            columns[i + k + 1] += u128::from(product as u64);
            columns[i + k] += product >> 64;
        }
    }
}

/// Adds the lower and the upper limbs of Σ a_j b_{n-1-j} to sums of their own: a carry of each product into
/// a third limb is gathered by slow vector code, and so are copies of this loop in functions of many.
#[inline(never)]
fn add_products(a: &[u64], b: &[u64], low: &mut u128, high: &mut u128) {
    let (mut lower, mut upper) = (*low, *high);
    let mut add = |a: u64, b: u64| {
        let product = u128::from(a) * u128::from(b);
        lower += u128::from(product as u64);
        upper += product >> 64;
    };
    // Four at a time, or registers are moved about for longer than numbers are multiplied.
    let (a_blocks, a_rest) = a.as_chunks::<4>();
    let (b_rest, b_blocks) = b.as_rchunks::<4>();
    for (a, b) in a_blocks.iter().zip(b_blocks.iter().rev()) {
        add(a[0], b[3]);
        add(a[1], b[2]);
        add(a[2], b[1]);
        add(a[3], b[0]);
    }
    for (&a, &b) in a_rest.iter().zip(b_rest.iter().rev()) {
        add(a, b);
    }
    (*low, *high) = (lower, upper);
}

/// The limbs below the point of a fraction divided by 2^`shift`.
fn shifted_down(limb: &[u64], shift: i32, found: &mut [u64]) {
    let (limbs, bits) = (shift.div_euclid(64), shift.rem_euclid(64));
    let at = |i: i32| usize::try_from(i).ok().and_then(|i| limb.get(i)).copied().unwrap_or(0);
    let mut above = at(-limbs - 1);
    for (i, found) in found.iter_mut().enumerate() {
        let here = at(i as i32 - limbs);
        *found = (u128::from(above) << 64 | u128::from(here)).wrapping_shr(bits as u32) as u64;
        above = here;
    }
}

/// A number whose first limb is above the point, times 2^`bits`.
#[inline(always)]
fn raised<const ROOM: usize, const W: usize>(
    is_negative: bool,
    sum: &[u64],
    bits: i32,
    limbs: usize,
) -> Digits<W> {
    let (whole, bits) = (bits.div_euclid(64), bits.rem_euclid(64));
    let mut found = [0; ROOM];
    let found = &mut found[..sum.len() + 1];
    let mut below = 0;
    for i in (0..found.len()).rev() {
        let here = if i == 0 { 0 } else { sum[i - 1] };
        found[i] = here << bits | (below >> 1) >> (63 - bits);
        below = here;
    }
    Digits::normalized(is_negative, whole + 2, limbs.min(W), found)
}

/// The negative of a number in two's complement.
fn negate(number: &mut [u64]) {
    let mut carry = true;
    for limb in number.iter_mut().rev() {
        (*limb, carry) = (!*limb).overflowing_add(u64::from(carry));
    }
}
