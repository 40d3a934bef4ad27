//! Sums over the stages of a step.

use super::Row;

/// `out = y + h Σ a_j k_j`.
#[inline]
pub(super) fn combine(y: &[f64], h: f64, row: Row, k: &[f64], out: &mut [f64]) {
    sum_up(row, k, out);
    for (out, y) in out.iter_mut().zip(y) {
        *out = y + h * *out;
    }
}

/// `out = Σ a_j k_j`.
#[inline]
pub(super) fn sum_up(row: Row, k: &[f64], out: &mut [f64]) {
    match out.len() {
        2 => sum_up_sized::<2>(row, k, out),
        3 => sum_up_sized::<3>(row, k, out),
        4 => sum_up_sized::<4>(row, k, out),
        5 => sum_up_sized::<5>(row, k, out),
        6 => sum_up_sized::<6>(row, k, out),
        8 => sum_up_sized::<8>(row, k, out),
        n => {
            for (i, out) in out.iter_mut().enumerate() {
                *out = row.iter().fold(0.0, |sum, &(j, a)| sum + a * k[j * n + i]);
            }
        }
    }
}

/// The same for `D` unknowns, side by side: one after another the sums of small systems wait for their own
/// additions.
fn sum_up_sized<const D: usize>(row: Row, k: &[f64], out: &mut [f64]) {
    let mut sums = [0.0; D];
    for &(j, a) in row {
        let k = &k[j * D..(j + 1) * D];
        for i in 0..D {
            sums[i] += a * k[i];
        }
    }
    for (out, sum) in out.iter_mut().zip(sums) {
        *out = sum;
    }
}
