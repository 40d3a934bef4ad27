//! Decimal text, read exactly and written rounded to nearest.

use super::{Digits, DigitsKind, Scalar};

/// log2 of 10.
const BITS: f64 = std::f64::consts::LOG2_10;
/// Powers of ten that fit into a limb.
const CHUNK: usize = 19;
const POWER: u64 = 10_u64.pow(CHUNK as u32);
/// Exponents of ten that are read.
const FARTHEST: i64 = 1_000_000;

/// Limbs that carry so many decimal digits and `spare` bits beside.
pub fn limbs_for(digits: usize, spare: usize) -> usize {
    // The first limb may have a single bit.
    (libm::ceil(BITS * digits as f64) as usize + spare).div_ceil(64) + 1
}

/// Decimal digits that so many limbs carry.
pub fn decimal_places(limbs: usize) -> usize {
    (64.0 * (limbs - 1) as f64 / BITS) as usize
}

impl<const W: usize> Digits<W> {
    /// Reads a decimal number, `-0.6` or `1.5e-3`, to as many digits as there is room for; `None` where it is
    /// none.
    pub fn from_decimal(text: &str) -> Option<Self> {
        let text = text.trim();
        let (is_negative, text) = match text.as_bytes().first()? {
            b'-' => (true, &text[1..]),
            b'+' => (false, &text[1..]),
            _ => (false, text),
        };
        let (mantissa, power) = match text.split_once(['e', 'E']) {
            Some((mantissa, power)) => (mantissa, power.parse::<i64>().ok()?),
            None => (text, 0),
        };
        let (whole, decimals) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let mut digits = whole.bytes().chain(decimals.bytes()).peekable();
        if whole.is_empty() || !digits.clone().all(|digit| digit.is_ascii_digit()) {
            return None;
        }
        let mut value = Self::ZERO;
        while digits.peek().is_some() {
            let (mut chunk, mut scale) = (0, 1);
            for digit in digits.by_ref().take(CHUNK) {
                (chunk, scale) = (10 * chunk + u64::from(digit - b'0'), 10 * scale);
            }
            value = value * Self::whole(scale) + Self::whole(chunk);
        }
        let power = power.checked_sub(decimals.len() as i64)?;
        if power.abs() > FARTHEST {
            return value.is_zero().then_some(value);
        }
        let ten = Self::whole(10).powi(power.unsigned_abs() as i32);
        let value = if power < 0 { value / ten } else { value * ten };
        Some(if is_negative { -value } else { value })
    }

    /// To so many significant digits, rounded to nearest; zeros at the end are left out, and there are
    /// exponents below 1e-4 and from 1e16 on, as doubles are written.
    pub fn to_decimal(&self, places: usize) -> String {
        match self.kind {
            DigitsKind::NotFinite => return "NaN".to_owned(),
            DigitsKind::Zero => return "0.0".to_owned(),
            _ => {}
        }
        let places = places.max(1);
        let mut power = libm::floor(self.log2() / BITS) as i64;
        let mut digits = self.rounded(places as i64 - 1 - power);
        if digits.len() > places {
            // Rounded up to the next power of ten, or the logarithm was.
            power += 1;
            digits = self.rounded(places as i64 - 1 - power);
        } else if digits.len() < places {
            power -= 1;
            digits = self.rounded(places as i64 - 1 - power);
        }
        power += digits.len() as i64 - places as i64;
        digits.truncate(places);
        digits.truncate(digits.trim_end_matches('0').len().max(1));
        let sign = if self.is_negative() { "-" } else { "" };
        format!("{sign}{}", laid_out(&digits, power))
    }

    /// |x| 10^power, rounded to a whole number.
    fn rounded(&self, power: i64) -> String {
        let mut size = *self;
        size.kind = DigitsKind::Positive;
        // Two limbs more than the number has: the power is then as good as exact, and not as long as the
        // room.
        let ten = Self::whole(10).shortened(self.limbs() + 2).powi(power.unsigned_abs() as i32);
        let size = if power < 0 { size / ten } else { size * ten } + Self::of(0.5);
        if size.exponent <= 0 {
            return "0".to_owned();
        }
        let count = size.exponent as usize;
        let mut limbs: Vec<u64> = (0..count).map(|i| size.limb.get(i).copied().unwrap_or(0)).collect();
        let mut chunks = Vec::new();
        while limbs.iter().any(|&limb| limb != 0) {
            let mut rest = 0_u64;
            for limb in &mut limbs {
                let wide = u128::from(rest) << 64 | u128::from(*limb);
                (*limb, rest) = ((wide / u128::from(POWER)) as u64, (wide % u128::from(POWER)) as u64);
            }
            chunks.push(rest);
        }
        let mut text = chunks.pop().unwrap_or(0).to_string();
        chunks.iter().rev().for_each(|chunk| text += &format!("{chunk:019}"));
        text
    }
}

/// Significant digits with the point where 10^power is the place of the first.
fn laid_out(digits: &str, power: i64) -> String {
    let split = |at: usize| {
        let (whole, decimals) = digits.split_at(at.min(digits.len()));
        format!("{whole}.{}", if decimals.is_empty() { "0" } else { decimals })
    };
    match power {
        -4..=-1 => format!("0.{}{digits}", "0".repeat((-1 - power) as usize)),
        0..16 if digits.len() as i64 <= power => {
            format!("{digits}{}.0", "0".repeat((power + 1) as usize - digits.len()))
        }
        0..16 => split(power as usize + 1),
        _ if digits.len() == 1 => format!("{digits}e{power}"),
        _ => format!("{}e{power}", split(1)),
    }
}
