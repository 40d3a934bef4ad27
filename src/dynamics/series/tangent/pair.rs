//! Two bodies without loops: an order of their derivatives in registers.

use super::{Tangent, TangentConstants};
use crate::arithmetic::lanes::wide::Slots;

impl<S: Slots> Tangent<S> {
    /// An order of a pair, in registers.
    #[inline(always)]
    pub fn advance_pair(&mut self, m: usize) {
        let ((bend_re, bend_im, left), (other_re, other_im, other_left)) =
            (self.products(0, m), self.products(1, m));
        let (room, TangentConstants { matrix, diagonal, .. }) = (self.room, &self.known);
        let (mut re, mut im) = (self.rest[0][m], self.rest[1][m]);
        let (mut next_re, mut next_im) = (self.rest[0][room + m], self.rest[1][room + m]);
        let h = S::splat(matrix[1]);
        (re, im) = (other_re.mul_add(h, re), other_im.mul_add(h, im));
        (next_re, next_im) = (bend_re.mul_add(h, next_re), bend_im.mul_add(h, next_im));
        let (z, other) = (self.values.z[0], self.values.z[1]);
        let (z_re, z_im) = (S::splat(z.re), S::splat(z.im));
        let (other_z_re, other_z_im) = (S::splat(other.re), S::splat(other.im));
        let left = re.neg_mul_add(z_im, im.mul_add(z_re, left));
        let left = diagonal[0].mul_add(S::splat(self.acceleration(0, m)), left);
        let other_left = next_re.neg_mul_add(other_z_im, next_im.mul_add(other_z_re, other_left));
        let other_left = diagonal[1].mul_add(S::splat(self.acceleration(1, m)), other_left);
        let response = &self.response[..4];
        let new = left.neg_mul_add(S::splat(response[0]), S::ZERO);
        let new = other_left.neg_mul_add(S::splat(response[1]), new);
        let other_new = left.neg_mul_add(S::splat(response[2]), S::ZERO);
        let other_new = other_left.neg_mul_add(S::splat(response[3]), other_new);
        self.push_rate(0, m, new);
        self.push_rate(1, m, other_new);
        let (x, y) = (other_new.mul(S::ZERO.sub(other_z_im)), other_new.mul(other_z_re));
        let (u, v) = (new.mul(S::ZERO.sub(z_im)), new.mul(z_re));
        let [rest_re, rest_im] = &mut self.rest;
        (rest_re[m], rest_im[m]) = (x.mul_add(h, re), y.mul_add(h, im));
        (rest_re[room + m], rest_im[room + m]) = (u.mul_add(h, next_re), v.mul_add(h, next_im));
    }
}
