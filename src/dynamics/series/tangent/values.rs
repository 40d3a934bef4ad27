//! The powers of the motion itself: those of its own step and those beyond, or all of them expanded here.

use super::{Tangent, add_product};
use crate::arithmetic::lanes::wide::Slots;
use crate::dynamics::series::Terms;
use crate::dynamics::series::columns::{Begin, MotionPowers};
use crate::dynamics::series::varied::Number;

impl<S: Slots> Tangent<S> {
    /// Those powers of a motion that are of these bodies.
    #[inline(always)]
    pub(super) fn fitting<'a>(&self, known: Option<&'a MotionPowers>) -> Option<&'a MotionPowers> {
        known.filter(|known| self.rows == 0 && known.z.len() == (known.order + 2) * self.bodies)
    }

    /// Expands the motion where its powers are not known, but for that of a pair.
    pub fn expand_values(
        &mut self,
        terms: &Terms<Number>,
        (t, u, rest, rate): Begin,
        known: Option<&MotionPowers>,
    ) {
        if let Some(known) = self.fitting(known) {
            let (n, order) = (self.bodies, self.order().min(known.order));
            let (z, rates) = ((order + 2) * n, (order + 1) * n);
            self.values.z[..z].copy_from_slice(&known.z[..z]);
            self.values.omega[..rates].copy_from_slice(&known.omega[..rates]);
            self.values.rate[..rates].copy_from_slice(&known.omega[..rates]);
            return;
        }
        let is_pair = self.is_pair();
        let [own_u, own_rest, own_rate] = &mut self.begin;
        for c in 0..self.bodies {
            (own_u[c], own_rest[c], own_rate[c]) = (u[c].value, rest[c].value, rate[c].value);
        }
        let plain = terms.structure.terms();
        if !is_pair {
            self.values.expand_terms(&plain, t, own_u, own_rest, own_rate);
        }
    }

    /// The powers of z up to `order` + 1, from the last to the first, and those of z''.
    #[inline(always)]
    pub(super) fn turn_over(&mut self, order: usize) {
        let (n, room) = (self.bodies, self.room);
        let times = &self.times[..order];
        for k in 0..n {
            let last = self.place(k);
            let [re, im] = &mut self.z;
            let (re, im) = (&mut re[last - order - 1..=last], &mut im[last - order - 1..=last]);
            let powers = self.values.z[k..].iter().step_by(n);
            for ((z, re), im) in powers.zip(re.iter_mut().rev()).zip(im.iter_mut().rev()) {
                (*re, *im) = (z.re, z.im);
            }
            let [curve_re, curve_im] = &mut self.curve;
            let (curve_re, curve_im) =
                (&mut curve_re[k * room..][..order], &mut curve_im[k * room..][..order]);
            let (re, im) = (&re[..order], &im[..order]);
            for m in 0..order {
                curve_re[m] = re[order - 1 - m] * times[m];
                curve_im[m] = im[order - 1 - m] * times[m];
            }
        }
    }

    /// R of the motion below `order`.
    #[inline(always)]
    pub(super) fn find_force(&mut self, terms: &Terms<Number>, order: usize) {
        let (n, room) = (self.bodies, self.room);
        let [force_re, force_im] = &mut self.force;
        if self.rows > 0 {
            for (m, rest) in self.values.rest[..order * n].chunks_exact(n).enumerate() {
                for (k, rest) in rest.iter().enumerate() {
                    (force_re[k * room + m], force_im[k * room + m]) = (rest.re, rest.im);
                }
            }
            return;
        }
        let [curve_re, curve_im] = &self.curve;
        for k in 0..n {
            let (re, im) = (&mut force_re[k * room..][..order], &mut force_im[k * room..][..order]);
            re.fill(0.0);
            im.fill(0.0);
            for entry in self.known.coupling.row(k) {
                let first = entry.column * room;
                add_product(re, &curve_re[first..][..order], entry.value);
                add_product(im, &curve_im[first..][..order], entry.value);
            }
            let weight = terms.structure.tree.weight[k];
            (re[0], im[0]) = (re[0] - weight.re, im[0] - weight.im);
        }
    }

    /// R_m of a body from z'' of power m.
    #[inline(always)]
    fn couple(&mut self, k: usize, m: usize) {
        let (room, [curve_re, curve_im]) = (self.room, &self.curve);
        let (mut re, mut im) = (0.0, 0.0);
        for entry in self.known.coupling.row(k) {
            re += entry.value * curve_re[entry.column * room + m];
            im += entry.value * curve_im[entry.column * room + m];
        }
        (self.force[0][k * room + m], self.force[1][k * room + m]) = (re, im);
    }

    /// Order m of the motion of a tree, m > 0: the next power of its rates, that of z after it, and R_m.
    #[inline(always)]
    pub(super) fn extend(&mut self, m: usize) {
        let (n, room) = (self.bodies, self.room);
        // z'' without the new accelerations, and the next power of z but for them and its divisor.
        for k in 0..n {
            let last = self.place(k);
            let (re, im) = (&self.z[0][last - m - 1..=last], &self.z[1][last - m - 1..=last]);
            let (mut sum_re, mut sum_im) = (0.0, 0.0);
            for j in 0..=m {
                let rate = self.values.omega[j * n + k];
                sum_re += rate * re[j];
                sum_im += rate * im[j];
            }
            (self.z[0][last - m - 2], self.z[1][last - m - 2]) = (-sum_im, sum_re);
            let times = (m + 1) as f64;
            (self.curve[0][k * room + m], self.curve[1][k * room + m]) = (-sum_im * times, sum_re * times);
        }
        for k in 0..n {
            self.couple(k, m);
            let last = self.place(k);
            let (z_re, z_im) = (&self.z[0][last - m..=last], &self.z[1][last - m..=last]);
            let own = k * room..k * room + m + 1;
            let (force_re, force_im) = (&self.force[0][own.clone()], &self.force[1][own]);
            let (mut sum, mut other) = (0.0, 0.0);
            for i in 0..=m {
                sum += z_re[i] * force_im[i];
                other += z_im[i] * force_re[i];
            }
            self.load[k] = other - sum;
        }
        for k in 0..n {
            let row = &self.response[k * n..][..n];
            let acceleration = row.iter().zip(&self.load).fold(0.0, |sum, (a, load)| sum + a * load);
            let (last, rate) = (self.place(k), acceleration / (m + 1) as f64);
            self.values.omega[(m + 1) * n + k] = rate;
            let (z_re, z_im) = (self.z[0][last], self.z[1][last]);
            let (newest, times) = (last - m - 2, ((m + 1) * (m + 2)) as f64);
            self.z[0][newest] = (self.z[0][newest] - z_im * rate) / (m + 2) as f64;
            self.z[1][newest] = (self.z[1][newest] + z_re * rate) / (m + 2) as f64;
            self.curve[0][k * room + m] = self.z[0][newest] * times;
            self.curve[1][k * room + m] = self.z[1][newest] * times;
        }
        for k in 0..n {
            self.couple(k, m);
        }
    }
}
