//! The matrices of a posture in every lane, and the way back onto all rows: see
//! [`keeper`](crate::dynamics::natural::keeper).

use super::ZERO;
use crate::arithmetic::Complex;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::EightLanes;
use crate::dynamics::looped::NEAR;
use crate::dynamics::natural::keeper::CLOSE;
use crate::dynamics::natural::{Block, Reduced};
use crate::stepping::taylor::batch::{load, store};

/// Sweeps onto the unit lengths after the first one, of lanes that are far off.
const SWEEPS: usize = 6;

/// Constants of the mechanism, and matrices at unit vectors.
#[derive(Debug)]
pub(super) struct Matrices {
    count: usize,
    /// W (n × n), and what pivots of S are measured against.
    blocks: Vec<Block>,
    scale: Vec<f64>,
    /// The linear rows: elements with their gradients, constant, and column of R.
    rows: Vec<Row>,
    /// V, x and y (each n × n), and S⁻¹.
    v: [Vec<Octet>; 2],
    schur: Vec<Octet>,
    /// The matrix of an order (3n × 3n).
    whole: Vec<Octet>,
    /// Violations, and factors made of them.
    far: Vec<Octet>,
    factors: Vec<Octet>,
}

#[derive(Debug)]
struct Row {
    terms: Vec<(usize, Complex<f64>)>,
    constant: f64,
    back: Vec<Complex<f64>>,
}

/// True where the largest reciprocal share of a pivot is that of a regular position; what is not a number is
/// none.
pub(super) fn is_regular(weakest: &Octet, lane: usize) -> bool {
    weakest.0[lane] * NEAR <= 1.0
}

impl Matrices {
    /// For so many bodies with these constants, which only mechanisms have that fit.
    pub(super) fn new(reduced: Option<&Reduced>, n: usize) -> Self {
        let row = |reduced: &Reduced, r: usize| Row {
            terms: reduced.rows[r].place.linear.clone(),
            constant: reduced.rows[r].place.constant,
            back: reduced.back[r * n..(r + 1) * n].to_vec(),
        };
        let rows: Vec<Row> =
            reduced.map_or_else(Vec::new, |it| (0..it.rows.len()).map(|r| row(it, r)).collect());
        let room = |size: usize| vec![ZERO; size];
        Self {
            count: n,
            blocks: reduced.map_or_else(|| vec![[0.0; 4]; n * n], |it| it.inverse.clone()),
            scale: reduced.map_or_else(|| vec![1.0; n], |it| it.free.clone()),
            far: room(rows.len().max(n)),
            rows,
            v: [room(n * n), room(n * n)],
            schur: room(n * n),
            whole: room(9 * n * n),
            factors: room(n),
        }
    }

    /// V and S⁻¹ at unit vectors; the largest reciprocal share of a pivot.
    #[inline(always)]
    pub(super) fn face<W: EightLanes>(&mut self, x: &[Octet], y: &[Octet]) -> Octet {
        let n = self.count;
        let [vx, vy] = &mut self.v;
        for i in 0..n {
            let (own_x, own_y) = (load::<W>(&x[i]), load::<W>(&y[i]));
            for j in 0..n {
                let [xx, xy, yx, yy] = self.blocks[i * n + j];
                let (zx, zy) = (load::<W>(&x[j]), load::<W>(&y[j]));
                let across = zx.mul_add(W::splat(xx), zy.mul(W::splat(xy)));
                let along = zx.mul_add(W::splat(yx), zy.mul(W::splat(yy)));
                (vx[i * n + j], vy[i * n + j]) = (store(across), store(along));
                self.schur[i * n + j] = store(own_x.mul_add(across, own_y.mul(along)));
            }
        }
        self.invert::<W>()
    }

    /// S⁻¹ by Gauss–Jordan.
    #[inline(always)]
    fn invert<W: EightLanes>(&mut self) -> Octet {
        let (n, schur, mut weakest) = (self.count, &mut self.schur, W::ZERO);
        for p in 0..n {
            let factor = W::ONE.div(load::<W>(&schur[p * n + p]));
            weakest = factor.mul(W::splat(self.scale[p])).larger(weakest);
            schur[p * n + p] = store(W::ONE);
            for j in 0..n {
                schur[p * n + j] = store(load::<W>(&schur[p * n + j]).mul(factor));
            }
            for i in 0..n {
                if i == p {
                    continue;
                }
                let part = load::<W>(&schur[i * n + p]);
                schur[i * n + p] = ZERO;
                for j in 0..n {
                    let left = part.neg_mul_add(load(&schur[p * n + j]), load::<W>(&schur[i * n + j]));
                    schur[i * n + j] = store(left);
                }
            }
        }
        store(weakest)
    }

    /// The matrix of an order, of V and S⁻¹ at hand.
    #[inline(always)]
    pub(super) fn combine<W: EightLanes>(&mut self) {
        let n = self.count;
        let (size, [vx, vy]) = (3 * n, &self.v);
        for i in 0..n {
            for s in 0..n {
                let (mut ux, mut uy) = (W::ZERO, W::ZERO);
                for j in 0..n {
                    let inverse = load::<W>(&self.schur[j * n + s]);
                    ux = load::<W>(&vx[i * n + j]).mul_add(inverse, ux);
                    uy = load::<W>(&vy[i * n + j]).mul_add(inverse, uy);
                }
                self.whole[(2 * n + s) * size + i] = store(ux);
                self.whole[(2 * n + s) * size + n + i] = store(uy);
                self.whole[i * size + 2 * n + s] = store(W::ZERO.sub(ux));
                self.whole[(n + i) * size + 2 * n + s] = store(W::ZERO.sub(uy));
                self.whole[(2 * n + i) * size + 2 * n + s] = self.schur[i * n + s];
            }
        }
        for i in 0..n {
            for j in i..n {
                let [xx, xy, yx, yy] = self.blocks[i * n + j];
                let (mut pxx, mut pxy) = (W::splat(xx), W::splat(xy));
                let (mut pyx, mut pyy) = (W::splat(yx), W::splat(yy));
                for s in 0..n {
                    let ux = load::<W>(&self.whole[i * size + 2 * n + s]);
                    let uy = load::<W>(&self.whole[(n + i) * size + 2 * n + s]);
                    let (x, y) = (load::<W>(&vx[j * n + s]), load::<W>(&vy[j * n + s]));
                    (pxx, pxy) = (ux.mul_add(x, pxx), ux.mul_add(y, pxy));
                    (pyx, pyy) = (uy.mul_add(x, pyx), uy.mul_add(y, pyy));
                }
                let (pxx, pxy, pyx, pyy) = (store(pxx), store(pxy), store(pyx), store(pyy));
                let whole = &mut self.whole;
                (whole[i * size + j], whole[i * size + n + j]) = (pxx, pxy);
                (whole[(n + i) * size + j], whole[(n + i) * size + n + j]) = (pyx, pyy);
                (whole[j * size + i], whole[j * size + n + i]) = (pxx, pyx);
                (whole[(n + j) * size + i], whole[(n + j) * size + n + i]) = (pxy, pyy);
            }
        }
    }

    /// The product of the matrix of an order: three rows at a time in two sums each, none of which waits for another.
    #[inline(always)]
    pub(super) fn times<W: EightLanes>(&self, right: &[Octet], found: &mut [Octet]) {
        let size = 3 * self.count;
        let (right, found) = (&right[..size], &mut found[..size]);
        let mut row = 0;
        while row + 3 <= size {
            let at = row * size;
            let a = &self.whole[at..at + size];
            let b = &self.whole[at + size..at + 2 * size];
            let c = &self.whole[at + 2 * size..at + 3 * size];
            let (mut p, mut q, mut r) = (W::ZERO, W::ZERO, W::ZERO);
            let (mut s, mut t, mut u) = (W::ZERO, W::ZERO, W::ZERO);
            let mut j = 0;
            while j + 1 < size {
                let (x, y) = (load::<W>(&right[j]), load::<W>(&right[j + 1]));
                p = x.mul_add(load(&a[j]), p);
                q = x.mul_add(load(&b[j]), q);
                r = x.mul_add(load(&c[j]), r);
                s = y.mul_add(load(&a[j + 1]), s);
                t = y.mul_add(load(&b[j + 1]), t);
                u = y.mul_add(load(&c[j + 1]), u);
                j += 2;
            }
            if j < size {
                let x = load::<W>(&right[j]);
                p = x.mul_add(load(&a[j]), p);
                q = x.mul_add(load(&b[j]), q);
                r = x.mul_add(load(&c[j]), r);
            }
            found[row] = store(p.add(s));
            found[row + 1] = store(q.add(t));
            found[row + 2] = store(r.add(u));
            row += 3;
        }
    }

    /// Brings unit vectors and their rates, x and then y, onto all rows; tells which lanes are there, of those
    /// that go.
    #[inline(always)]
    pub(super) fn land<W: EightLanes>(
        &mut self,
        z: &mut [Octet],
        v: &mut [Octet],
        is_going: &[bool; LANES],
    ) -> [bool; LANES] {
        let n = self.count;
        self.onto_rows::<W>(z, true);
        let (x, y) = z.split_at(n);
        let weakest = self.face::<W>(x, y);
        let mut left = self.lengths::<W>(z);
        self.onto_lengths::<W>(z, W::ONE);
        // What a sweep leaves is about the square of what it found, with the same factors as many times less.
        let (mut is_far, mut is_landed) = ([false; LANES], [false; LANES]);
        for lane in 0..LANES {
            is_far[lane] = is_going[lane] && left.0[lane] > CLOSE;
        }
        let again = if is_far.contains(&true) { SWEEPS } else { 0 };
        let mask = mask::<W>(&is_far);
        for _ in 0..again {
            left = self.lengths::<W>(z);
            self.onto_lengths::<W>(z, mask);
        }
        for lane in 0..LANES {
            is_landed[lane] = is_going[lane] && is_regular(&weakest, lane) && left.0[lane] <= CLOSE;
        }
        self.onto_rows::<W>(v, false);
        self.drifts::<W>(z, v);
        self.onto_lengths::<W>(v, W::ONE);
        for _ in 0..again {
            self.drifts::<W>(z, v);
            self.onto_lengths::<W>(v, mask);
        }
        is_landed
    }

    /// (|z|² - 1)/2, and the largest of a lane.
    #[inline(always)]
    fn lengths<W: EightLanes>(&mut self, z: &[Octet]) -> Octet {
        let (n, mut left) = (self.count, W::ZERO);
        for i in 0..n {
            let (x, y) = (load::<W>(&z[i]), load::<W>(&z[n + i]));
            let far = x.mul_add(x, y.mul(y)).sub(W::ONE).mul(W::splat(0.5));
            left = far.larger(left);
            self.far[i] = store(far);
        }
        store(left)
    }

    /// z·v.
    #[inline(always)]
    fn drifts<W: EightLanes>(&mut self, z: &[Octet], v: &[Octet]) {
        let n = self.count;
        for i in 0..n {
            let (x, y) = (load::<W>(&z[i]), load::<W>(&z[n + i]));
            self.far[i] = store(x.mul_add(load(&v[i]), y.mul(load(&v[n + i]))));
        }
    }

    /// x - R (C x + c), or without the constants.
    #[inline(always)]
    fn onto_rows<W: EightLanes>(&mut self, z: &mut [Octet], with_constants: bool) {
        let n = self.count;
        for r in 0..self.rows.len() {
            let mut far = W::splat(if with_constants { self.rows[r].constant } else { 0.0 });
            for &(k, g) in &self.rows[r].terms {
                far = load::<W>(&z[k]).mul_add(W::splat(g.re), far);
                far = load::<W>(&z[n + k]).mul_add(W::splat(g.im), far);
            }
            self.far[r] = store(far);
        }
        for i in 0..n {
            let (mut x, mut y) = (load::<W>(&z[i]), load::<W>(&z[n + i]));
            for r in 0..self.rows.len() {
                let (far, back) = (load::<W>(&self.far[r]), self.rows[r].back[i]);
                x = far.neg_mul_add(W::splat(back.re), x);
                y = far.neg_mul_add(W::splat(back.im), y);
            }
            (z[i], z[n + i]) = (store(x), store(y));
        }
    }

    /// x - V S⁻¹ violation, in some lanes.
    #[inline(always)]
    fn onto_lengths<W: EightLanes>(&mut self, z: &mut [Octet], mask: W) {
        let n = self.count;
        for i in 0..n {
            let mut sum = W::ZERO;
            for j in 0..n {
                sum = load::<W>(&self.schur[i * n + j]).mul_add(load(&self.far[j]), sum);
            }
            self.factors[i] = store(sum.mul(mask));
        }
        for i in 0..n {
            let (mut x, mut y) = (load::<W>(&z[i]), load::<W>(&z[n + i]));
            for j in 0..n {
                let factor = load::<W>(&self.factors[j]);
                x = load::<W>(&self.v[0][i * n + j]).neg_mul_add(factor, x);
                y = load::<W>(&self.v[1][i * n + j]).neg_mul_add(factor, y);
            }
            (z[i], z[n + i]) = (store(x), store(y));
        }
    }
}

/// One in some lanes, zero in the others.
#[inline(always)]
fn mask<W: EightLanes>(is_there: &[bool; LANES]) -> W {
    let mut mask = [0.0; LANES];
    for lane in 0..LANES {
        mask[lane] = if is_there[lane] { 1.0 } else { 0.0 };
    }
    W::of(&mask)
}
