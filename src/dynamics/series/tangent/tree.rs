//! Trees of several bodies: an order of their derivatives by two products with matrices.
//!
//! ```text
//! B = Im(conj(z) H ·),   da_m = -M_0⁻¹ left - M_0⁻¹ B bend,   dR_m = known + H (bend + i z da_m)
//! ```

use super::Tangent;
use super::products::minus_product;
use crate::arithmetic::lanes::wide::Slots;

impl<S: Slots> Tangent<S> {
    /// M_0⁻¹, and its products with what z'' is multiplied by in the equations.
    #[inline(always)]
    pub fn find_whole_response(&mut self) {
        let n = self.bodies;
        let matrix = &self.known.matrix[..n * n];
        let rows = self.whole_response.chunks_exact_mut(3 * n).zip(self.response.chunks_exact(n));
        for (whole, response) in rows {
            let (own, products) = whole.split_at_mut(n);
            own.copy_from_slice(response);
            products.fill(0.0);
            let (re, im) = products.split_at_mut(n);
            for ((row, response), z) in matrix.chunks_exact(n).zip(response).zip(&self.values.z[..n]) {
                super::add_product(re, row, -z.im * response);
                super::add_product(im, row, z.re * response);
            }
        }
    }

    /// An order.
    #[inline(always)]
    pub fn advance_tree(&mut self, m: usize) {
        let (n, room) = (self.bodies, self.room);
        for k in 0..n {
            let (bend_re, bend_im, left) = self.products(k, m);
            let (z, place) = (self.values.z[k], k * room + m);
            let left = self.rest[1][place].mul_add(S::splat(z.re), left);
            let left = self.rest[0][place].neg_mul_add(S::splat(z.im), left);
            self.input[k] = self.known.diagonal[k].mul_add(S::splat(self.acceleration(k, m)), left);
            (self.input[n + k], self.input[2 * n + k]) = (bend_re, bend_im);
        }
        minus_product(&self.whole_response, &self.input, &mut self.new);
        for k in 0..n {
            let (z, new) = (self.values.z[k], self.new[k]);
            self.push_rate(k, m, new);
            self.input[n + k] = new.neg_mul_add(S::splat(z.im), self.input[n + k]);
            self.input[2 * n + k] = new.mul_add(S::splat(z.re), self.input[2 * n + k]);
        }
        let (re, im) = self.input[n..].split_at(n);
        let [rest_re, rest_im] = &mut self.rest;
        let mut k = 0;
        while k < n {
            let row = &self.known.matrix[k * n..];
            if k + 1 < n {
                let (places, rows) = ([k * room + m, (k + 1) * room + m], [&row[..n], &row[n..2 * n]]);
                add_two_rows(rows, (re, im), (&mut *rest_re, &mut *rest_im), places);
                k += 2;
            } else {
                add_row(&row[..n], (re, im), (&mut *rest_re, &mut *rest_im), k * room + m);
                k += 1;
            }
        }
    }
}

/// Adds the products of two rows of H with x to R.
#[inline(always)]
fn add_two_rows<S: Slots>(
    [one, two]: [&[f64]; 2],
    (x_re, x_im): (&[S], &[S]),
    (rest_re, rest_im): (&mut [S], &mut [S]),
    [first, second]: [usize; 2],
) {
    let n = one.len();
    let (two, x_re, x_im) = (&two[..n], &x_re[..n], &x_im[..n]);
    let (mut re, mut im) = (rest_re[first], rest_im[first]);
    let (mut other_re, mut other_im) = (rest_re[second], rest_im[second]);
    let mut c = 0;
    while c < n {
        let (h, other) = (S::splat(one[c]), S::splat(two[c]));
        re = x_re[c].mul_add(h, re);
        im = x_im[c].mul_add(h, im);
        other_re = x_re[c].mul_add(other, other_re);
        other_im = x_im[c].mul_add(other, other_im);
        c += 1;
    }
    (rest_re[first], rest_im[first]) = (re, im);
    (rest_re[second], rest_im[second]) = (other_re, other_im);
}

/// The same of one row.
#[inline(always)]
fn add_row<S: Slots>(
    row: &[f64],
    (x_re, x_im): (&[S], &[S]),
    (rest_re, rest_im): (&mut [S], &mut [S]),
    place: usize,
) {
    let n = row.len();
    let (x_re, x_im) = (&x_re[..n], &x_im[..n]);
    let (mut re, mut im) = (rest_re[place], rest_im[place]);
    let mut c = 0;
    while c < n {
        let h = S::splat(row[c]);
        re = x_re[c].mul_add(h, re);
        im = x_im[c].mul_add(h, im);
        c += 1;
    }
    (rest_re[place], rest_im[place]) = (re, im);
}
