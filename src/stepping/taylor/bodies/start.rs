//! Power zero of the series: M_0, its inverse, and what is formed from them.

use super::super::wide::Wide;
use super::super::{direction, wide};
use super::{Bodies, MatrixColumn, apply};
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::lanes::row::{at, load, store};
use crate::dynamics::State;

/// Power zero, M_0 and what is formed from it.
#[inline(always)]
pub(super) fn begin<L: Lanes, const B: usize, const S: usize>(bodies: &mut Bodies<B, S>, state: &State) {
    let n = bodies.count;
    let Bodies { coupling, diagonal, columns, springs, scratch, .. } = bodies;
    let mut pairs = [[0.0; 4]; 8];
    for first in (0..n).step_by(2) {
        let second = (first + 1).min(n - 1);
        let (a, b) = (state.y[first], state.y[second]);
        let (a_low, b_low) = (state.low[first], state.low[second]);
        let (angles, rests) = (L::of([a, a, b, b]), L::of([a_low, a_low, b_low, b_low]));
        // Springs ask for what the unit vectors leave out.
        let unit = if S == 0 {
            Wide::of(direction::unit(angles, rests))
        } else {
            wide::unit(Wide { hi: angles, lo: rests })
        };
        let ([ca, sa, cb, sb], [ca_low, sa_low, cb_low, sb_low]) = (unit.hi.array(), unit.lo.array());
        pairs[first] = [ca, sa, ca_low, sa_low];
        pairs[second] = [cb, sb, cb_low, sb_low];
    }
    springs.begin::<L>(&pairs[..n]);
    for (i, [c, s, ..]) in pairs.into_iter().enumerate().take(n) {
        scratch.e[0][0][i / 4][i % 4] = c;
        scratch.e[0][1][i / 4][i % 4] = s;
        scratch.v[0][0][i / 4][i % 4] = state.y[n + i];
    }
    let [c, s]: [[L; B]; 2] = [load(&scratch.e[0][0]), load(&scratch.e[0][1])];
    let pulls = diagonal.as_flattened();
    for (j, (column, coupling)) in columns.iter_mut().zip(coupling.iter()).enumerate() {
        let (cos, sin, pull) = (L::splat(pairs[j][0]), L::splat(pairs[j][1]), L::splat(pulls[j]));
        let unit = unit::<L, B>(j);
        for b in 0..B {
            let mass = L::of(coupling[b]).mul(c[b].mul_add(cos, s[b].mul(sin)));
            column.mass[b] = mass.array();
            column.inverse[b] = unit[b].mul_add(pull, mass).array();
        }
    }
    invert::<L, B>(columns);
    for j in 0..n {
        let mut sides = [[[0.0; 4]; B]; 2];
        for b in 0..B {
            let coupling = L::splat(0.0).sub(L::of(coupling[j][b]));
            (sides[0][b], sides[1][b]) = (coupling.mul(c[b]).array(), coupling.mul(s[b]).array());
        }
        let cos = apply::<L, B>(columns.iter().map(|column| &column.inverse), &sides[0]);
        let sin = apply::<L, B>(columns.iter().map(|column| &column.inverse), &sides[1]);
        (columns[j].cos, columns[j].sin) = (store(cos), store(sin));
    }
}

/// One in lane j, nothing elsewhere.
#[inline(always)]
pub(super) fn unit<L: Lanes, const B: usize>(j: usize) -> [L; B] {
    let mut unit = [[0.0; 4]; B];
    unit[j / 4][j % 4] = 1.0;
    load(&unit)
}

/// The inverse of the positive definite matrix in its place, by Gauss–Jordan: column p turned into that of
/// the unit matrix, p = 0, 1, ….
#[inline(always)]
pub(super) fn invert<L: Lanes, const B: usize>(columns: &mut [MatrixColumn<B>]) {
    for p in 0..columns.len() {
        let unit = unit::<L, B>(p);
        let pivot = 1.0 / at(&columns[p].inverse, p);
        let (mut keep, mut full) = (unit, unit);
        for b in 0..B {
            keep[b] = L::splat(1.0).sub(unit[b]);
            full[b] = keep[b].neg_mul_add(L::of(columns[p].inverse[b]), unit[b]);
        }
        for (j, column) in columns.iter_mut().enumerate() {
            let factor = L::splat(if j == p { pivot } else { at(&column.inverse, p) * pivot });
            for b in 0..B {
                let kept = if j == p { L::splat(0.0) } else { keep[b].mul(L::of(column.inverse[b])) };
                column.inverse[b] = full[b].mul_add(factor, kept).array();
            }
        }
    }
}
