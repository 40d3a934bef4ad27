//! Products of the powers of an order, and of the next one as far as these are known.

use super::Tangent;
use crate::arithmetic::lanes::wide::Slots;

/// Sums of an order on their way: of the components of z dphi, of dphi D, and of the two terms of z × dR.
#[derive(Clone, Copy, Debug)]
pub struct TangentSums<S> {
    turn_re: S,
    turn_im: S,
    pull: S,
    cross_re: S,
    cross_im: S,
}

impl<S: Slots> TangentSums<S> {
    /// Nothing yet.
    pub const ZERO: Self =
        Self { turn_re: S::ZERO, turn_im: S::ZERO, pull: S::ZERO, cross_re: S::ZERO, cross_im: S::ZERO };

    /// Adds the products of an angle with z.
    #[inline(always)]
    fn turn(&mut self, angle: S, (re, im): (S, S)) {
        self.turn_re = angle.mul_add(re, self.turn_re);
        self.turn_im = angle.mul_add(im, self.turn_im);
    }

    /// Adds those of R with z.
    #[inline(always)]
    fn cross(&mut self, (rest_re, rest_im): (S, S), (re, im): (S, S)) {
        self.cross_re = rest_im.mul_add(re, self.cross_re);
        self.cross_im = rest_re.mul_add(im, self.cross_im);
    }

    /// Adds the product of an angle with D.
    #[inline(always)]
    fn pull(&mut self, angle: S, along: S) {
        self.pull = angle.mul_add(along, self.pull);
    }
}

impl<S: Slots> Tangent<S> {
    /// Derivatives of z'' of order m without those of the new accelerations, and what products of powers that
    /// are known leave of the equation of a body.
    #[inline(always)]
    pub fn products(&mut self, k: usize, m: usize) -> (S, S, S) {
        let sums = if m.is_multiple_of(2) { self.two_orders(k, m) } else { self.completed(k, m) };
        let times = self.times[m];
        let bend = (sums.turn_im.mul(S::splat(-times)), sums.turn_re.mul(S::splat(times)));
        (bend.0, bend.1, sums.cross_re.sub(sums.cross_im).sub(sums.pull))
    }

    /// The sums of order m, an even number; those of the next are left for it.
    #[inline(always)]
    fn two_orders(&mut self, k: usize, m: usize) -> TangentSums<S> {
        let last = self.place(k);
        // Power m+3-j of z and of D is at j.
        let from = last - 3 - m..last + 1;
        let (re, im, along) = (&self.z[0][from.clone()], &self.z[1][from.clone()], &self.along[from]);
        let (re, im, along) = (&re[..m + 4], &im[..m + 4], &along[..m + 4]);
        let first = k * self.room;
        let angle = &self.angle[first..][..m + 2];
        let (rest_re, rest_im) = (&self.rest[0][first..][..m], &self.rest[1][first..][..m]);
        let (mut this, mut next) = (TangentSums::<S>::ZERO, TangentSums::<S>::ZERO);
        let (mut z0, mut z1) = ((S::splat(re[0]), S::splat(im[0])), (S::splat(re[1]), S::splat(im[1])));
        let mut z2 = (S::splat(re[2]), S::splat(im[2]));
        let mut d2 = S::splat(along[2]);
        let mut j = 0;
        while j < m {
            let z3 = (S::splat(re[j + 3]), S::splat(im[j + 3]));
            let d3 = S::splat(along[j + 3]);
            let (turn, rest) = (angle[j], (rest_re[j], rest_im[j]));
            this.turn(turn, z1);
            next.turn(turn, z0);
            this.pull(turn, d3);
            next.pull(turn, d2);
            this.cross(rest, z3);
            next.cross(rest, z2);
            (z0, z1, z2, d2) = (z1, z2, z3, d3);
            j += 1;
        }
        let last = S::splat(along[m + 3]);
        this.turn(angle[m], z1);
        next.turn(angle[m], z0);
        this.pull(angle[m], last);
        next.pull(angle[m], d2);
        this.turn(angle[m + 1], z2);
        next.turn(angle[m + 1], z1);
        next.pull(angle[m + 1], last);
        self.ahead[k] = next;
        this
    }

    /// The sums of order m, an odd number.
    #[inline(always)]
    fn completed(&self, k: usize, m: usize) -> TangentSums<S> {
        let (first, place) = (k * self.room, self.place(k) - 1);
        let z = (S::splat(self.z[0][place]), S::splat(self.z[1][place]));
        let mut sums = self.ahead[k];
        sums.turn(self.angle[first + m + 1], z);
        sums.cross((self.rest[0][first + m - 1], self.rest[1][first + m - 1]), z);
        sums
    }
}

/// -A x, of a matrix row by row.
#[inline(always)]
pub fn minus_product<S: Slots>(matrix: &[f64], x: &[S], found: &mut [S]) {
    let (width, mut r) = (x.len(), 0);
    // Four rows at a time, so that sums do not wait for themselves.
    while r + 4 <= found.len() {
        let (a, rest) = matrix[r * width..(r + 4) * width].split_at(width);
        let (b, rest) = rest.split_at(width);
        let (c, d) = rest.split_at(width);
        let (a, b, c, d) = (&a[..width], &b[..width], &c[..width], &d[..width]);
        let (mut p, mut q, mut s, mut t) = (S::ZERO, S::ZERO, S::ZERO, S::ZERO);
        let mut j = 0;
        while j < width {
            p = x[j].neg_mul_add(S::splat(a[j]), p);
            q = x[j].neg_mul_add(S::splat(b[j]), q);
            s = x[j].neg_mul_add(S::splat(c[j]), s);
            t = x[j].neg_mul_add(S::splat(d[j]), t);
            j += 1;
        }
        (found[r], found[r + 1], found[r + 2], found[r + 3]) = (p, q, s, t);
        r += 4;
    }
    while r < found.len() {
        let row = &matrix[r * width..][..width];
        let (mut sum, mut j) = (S::ZERO, 0);
        while j < width {
            sum = x[j].neg_mul_add(S::splat(row[j]), sum);
            j += 1;
        }
        found[r] = sum;
        r += 1;
    }
}
