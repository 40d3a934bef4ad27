//! Columns of numbers, packed for a page: whole multiples of a quantum, differences of the order that leaves
//! least, their bytes apart, all of them deflated.

use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::{self, Write};

/// Most quanta a column may span, 2⁴⁸: differences of third order, their signs folded in, stay whole numbers
/// in a browser's doubles.
const SPAN: f64 = (1_u64 << 48) as f64;
/// Effort of the compression: the default, 6, takes nine times as long for 8 % less, 4 three and a half times
/// for 7 %.
const LEVEL: u32 = 1;
/// Orders of differences tried, from none on.
const ORDERS: usize = 4;

/// A column to be packed.
#[derive(Clone, Debug, Default)]
pub struct PackedColumn {
    /// Name.
    pub name: String,
    /// Unit, empty where there is none.
    pub unit: String,
    /// Numbers, a row each; what is not finite is shown as missing.
    pub values: Vec<f64>,
    /// Step of the numbers shown, in the column's unit; coarser where the column spans more than 2⁴⁸ of them.
    pub quantum: f64,
    /// Whether the numbers are decimal logarithms of what is shown.
    pub is_logarithm: bool,
}

/// How a column is to be unpacked: number = offset + quantum (k − 1), where k = 0 is a missing number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Packing {
    pub offset: f64,
    pub quantum: f64,
    /// Order of the differences.
    pub order: usize,
    /// Bytes of a difference, the lowest first; each stands in a plane of its own, as many bytes as rows.
    pub planes: usize,
}

/// Packs a column; its planes are appended to `bytes`.
pub(super) fn pack(column: &PackedColumn, bytes: &mut Vec<u8>) -> Packing {
    let finite = || column.values.iter().copied().filter(|value| value.is_finite());
    let [low, high] = finite().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    let offset = if low.is_finite() { low } else { 0.0 };
    let span = if low.is_finite() { high - low } else { 0.0 };
    let floor = (span / SPAN).max(f64::MIN_POSITIVE);
    let quantum = if column.quantum > floor { column.quantum } else { floor };
    let whole: Vec<i64> = (column.values.iter())
        .map(|value| if value.is_finite() { ((value - offset) / quantum).round() as i64 + 1 } else { 0 })
        .collect();
    let order = best_order(&whole);
    let mut last = [0; ORDERS];
    // Small numbers of either sign become small numbers.
    let folded = |d: i64| ((d << 1) ^ (d >> 63)) as u64;
    let codes: Vec<u64> = whole.iter().map(|&n| folded(differences(n, &mut last)[order])).collect();
    let most = codes.iter().copied().max().unwrap_or(0);
    let planes = (64 - most.leading_zeros()).div_ceil(8) as usize;
    for plane in 0..planes {
        bytes.extend(codes.iter().map(|code| (code >> (8 * plane)) as u8));
    }
    Packing { offset, quantum, order, planes }
}

/// The next differences of every order, the number itself the zeroth; before the first number stand zeros.
#[inline]
fn differences(number: i64, last: &mut [i64; ORDERS]) -> [i64; ORDERS] {
    let mut next = [number; ORDERS];
    for order in 1..ORDERS {
        next[order] = next[order - 1] - last[order - 1];
    }
    *last = next;
    next
}

/// The order whose differences take the fewest bits, roughly.
fn best_order(whole: &[i64]) -> usize {
    let (mut last, mut bits) = ([0; ORDERS], [0_u64; ORDERS]);
    for &number in whole {
        for (bits, difference) in bits.iter_mut().zip(differences(number, &mut last)) {
            *bits += u64::from(64 - difference.unsigned_abs().leading_zeros());
        }
    }
    (0..ORDERS).min_by_key(|&order| bits[order]).unwrap_or_default()
}

/// Deflated, with the header that browsers ask for.
///
/// # Errors
/// None in practice: the bytes go to memory.
pub(super) fn deflated(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(bytes.len() / 2), Compression::new(LEVEL));
    encoder.write_all(bytes)?;
    encoder.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the page does, in the page's arithmetic.
    fn unpacked(packing: Packing, rows: usize, bytes: &[u8]) -> Vec<f64> {
        let code = |k: usize| {
            (0..packing.planes).map(|p| f64::from(bytes[p * rows + k]) * 256_f64.powi(p as i32)).sum()
        };
        let mut whole: Vec<f64> = (0..rows)
            .map(|k| {
                let code: f64 = code(k);
                if code % 2.0 == 1.0 { -(code + 1.0) / 2.0 } else { code / 2.0 }
            })
            .collect();
        for _ in 0..packing.order {
            for k in 1..rows {
                whole[k] += whole[k - 1];
            }
        }
        let number =
            |k: &f64| if *k == 0.0 { f64::NAN } else { packing.offset + packing.quantum * (k - 1.0) };
        whole.iter().map(number).collect()
    }

    fn column(values: Vec<f64>, quantum: f64) -> PackedColumn {
        PackedColumn { values, quantum, ..PackedColumn::default() }
    }

    #[test]
    fn every_number_comes_back_to_half_a_quantum() {
        let smooth = |k: usize| (0.01 * k as f64).sin() * 3.0;
        let missing = |k: usize| if k % 97 == 5 { f64::NAN } else { (k as f64).sqrt() };
        let steep = |k: usize| if k == 500 { 1e12 } else { 0.0 };
        for (values, quantum) in [
            ((0..1000).map(smooth).collect::<Vec<f64>>(), 1e-4),
            ((0..1000).map(missing).collect(), 1e-3),
            ((0..1000).map(steep).collect(), 1e-6),
            (vec![7.5; 300], 0.0),
            (vec![f64::INFINITY, f64::NAN], 1.0),
            (Vec::new(), 1.0),
            (vec![-1e300, 1e300], 1e-9),
        ] {
            let mut bytes = Vec::new();
            let column = column(values, quantum);
            let packing = pack(&column, &mut bytes);
            let back = unpacked(packing, column.values.len(), &bytes);
            for (value, back) in column.values.iter().zip(&back) {
                assert_eq!(value.is_finite(), back.is_finite());
                let off = (value - back).abs();
                assert!(
                    !value.is_finite() || off <= 0.500_001 * packing.quantum + 1e-15 * value.abs(),
                    "{value} {back}"
                );
            }
        }
    }

    #[test]
    fn smooth_columns_take_a_byte_a_row_and_straight_ones_none() {
        let size = |values: Vec<f64>, quantum: f64| {
            let mut bytes = Vec::new();
            pack(&column(values, quantum), &mut bytes);
            deflated(&bytes).expect("memory").len()
        };
        let swing: Vec<f64> =
            (0..20_000).map(|k| (0.02 * f64::from(k) * 9.0).sin() * (f64::from(k) * 1e-4).cos()).collect();
        assert!(size(swing, 1e-4) < 25_000);
        assert!(size((0..20_000).map(|k| 0.1 * f64::from(k)).collect(), 1e-4) < 2_000);
    }
}
