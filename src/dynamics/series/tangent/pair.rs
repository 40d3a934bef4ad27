//! Two bodies without loops: an order of their derivatives in registers.

use super::{Known, Tangent};
use crate::arithmetic::lanes::wide::Slots;

impl<S: Slots> Tangent<S> {
    /// An order of a pair, in registers, to the same bits.
    #[inline(always)]
    pub fn advance_pair(&mut self, m: usize) {
        let (room, Known { coupling, varied, diagonal, weight, .. }) = (self.room, &self.known);
        let ((bend_re, bend_im, left), (other_re, other_im, other_left)) =
            (self.products(0, m), self.products(1, m));
        let (mut re, mut im, mut next_re, mut next_im) = (S::ZERO, S::ZERO, S::ZERO, S::ZERO);
        if m == 0 {
            (re, im) = (re.sub(weight[0][0]), im.sub(weight[0][1]));
            (next_re, next_im) = (next_re.sub(weight[1][0]), next_im.sub(weight[1][1]));
        }
        if let [entry, _] = varied.entries[..] {
            let (curve, other) = (self.curve(0, m), self.curve(1, m));
            re = entry.slope.mul_add(S::splat(other.re), re);
            im = entry.slope.mul_add(S::splat(other.im), im);
            next_re = entry.slope.mul_add(S::splat(curve.re), next_re);
            next_im = entry.slope.mul_add(S::splat(curve.im), next_im);
        }
        let h = S::splat(if let [entry, _] = coupling.entries[..] { entry.value } else { 0.0 });
        (re, im) = (other_re.mul_add(h, re), other_im.mul_add(h, im));
        (next_re, next_im) = (bend_re.mul_add(h, next_re), bend_im.mul_add(h, next_im));
        let (z, other) = (self.values.z[0], self.values.z[1]);
        let (z_re, z_im) = (S::splat(z.re), S::splat(z.im));
        let (other_z_re, other_z_im) = (S::splat(other.re), S::splat(other.im));
        let times = (m + 1) as f64;
        let [rate, other_rate] = [self.values.omega[2 * m + 2], self.values.omega[2 * m + 3]];
        let left = re.neg_mul_add(z_im, im.mul_add(z_re, left));
        let left = diagonal[0].mul_add(S::splat(rate * times), left);
        let other_left = next_re.neg_mul_add(other_z_im, next_im.mul_add(other_z_re, other_left));
        let other_left = diagonal[1].mul_add(S::splat(other_rate * times), other_left);
        let response = &self.response[..4];
        let new = left.neg_mul_add(S::splat(response[0]), S::ZERO);
        let new = other_left.neg_mul_add(S::splat(response[1]), new);
        let other_new = left.neg_mul_add(S::splat(response[2]), S::ZERO);
        let other_new = other_left.neg_mul_add(S::splat(response[3]), other_new);
        let (over, over_next) = (S::splat(self.fractions[m + 1]), S::splat(self.fractions[m + 2]));
        let (rate, other_rate) = (new.mul(over), other_new.mul(over));
        (self.rate[m + 1], self.rate[room + m + 1]) = (rate, other_rate);
        (self.angle[m + 2], self.angle[room + m + 2]) = (rate.mul(over_next), other_rate.mul(over_next));
        let (x, y) = (other_new.mul(S::ZERO.sub(other_z_im)), other_new.mul(other_z_re));
        let (u, v) = (new.mul(S::ZERO.sub(z_im)), new.mul(z_re));
        let [rest_re, rest_im] = &mut self.rest;
        (rest_re[m], rest_im[m]) = (x.mul_add(h, re), y.mul_add(h, im));
        (rest_re[room + m], rest_im[room + m]) = (u.mul_add(h, next_re), v.mul_add(h, next_im));
    }
}
