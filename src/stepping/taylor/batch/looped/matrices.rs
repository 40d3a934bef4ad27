//! The matrices of a configuration in every lane, and the way back onto all rows: see
//! [`projection`](crate::dynamics::natural::projection).

use super::{PAIR, Pair, ZERO, put};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::EightLanes;
use crate::dynamics::looped::NEAR;
use crate::dynamics::natural::projection::CLOSE;
use crate::dynamics::natural::{LinearRow, ReducedMatrices};
use crate::stepping::taylor::batch::{load, store};

/// Sweeps onto the unit lengths after the first one, of lanes that are far off.
const SWEEPS: usize = 6;

/// Constants of every lane's mechanism, and matrices at unit vectors.
#[derive(Debug)]
pub(super) struct Matrices {
    count: usize,
    /// W (n × n), block by block xx, xy, yx, yy, and what pivots of S are measured against.
    blocks: Vec<[Octet; 4]>,
    scale: Vec<Octet>,
    /// The linear rows: elements with their gradients, constant, and column of R.
    rows: Vec<MatrixRow>,
    /// V, x and y (each n × n), and S⁻¹.
    v: [Vec<Octet>; 2],
    schur: Vec<Octet>,
    /// U, x and y (each n × n).
    u: [Vec<Octet>; 2],
    /// P: (2n × 2n), or of one degree of freedom the vector (2n) whose square it is.
    spread: Vec<Octet>,
    is_line: bool,
    /// Violations, and factors made of them.
    far: Vec<Octet>,
    factors: Vec<Octet>,
}

#[derive(Debug)]
struct MatrixRow {
    terms: Vec<(usize, Pair)>,
    constant: Octet,
    back: Vec<Pair>,
}

/// Share of a pivot above which a step may end: the next one leaves, but the way back is still well told.
const NEARER: f64 = 1e-4;

/// True where the largest reciprocal share of a pivot is that of a regular position; what is not a number is
/// none.
pub(super) fn is_regular(weakest: &Octet, lane: usize) -> bool {
    weakest.0[lane] * NEAR <= 1.0
}

impl Matrices {
    /// Room for so many bodies with constants like these, which only mechanisms have that fit; `is_line`: of
    /// one degree of freedom.
    pub(super) fn new(reduced: Option<&ReducedMatrices>, n: usize, is_line: bool) -> Self {
        let row = |row: &LinearRow| MatrixRow {
            terms: row.place.linear.iter().map(|&(k, _)| (k, PAIR)).collect(),
            constant: ZERO,
            back: vec![PAIR; n],
        };
        let rows: Vec<MatrixRow> = reduced.map_or_else(Vec::new, |it| it.rows.iter().map(row).collect());
        let room = |size: usize| vec![ZERO; size];
        Self {
            count: n,
            blocks: vec![[ZERO; 4]; n * n],
            scale: room(n),
            far: room(rows.len().max(n)),
            rows,
            v: [room(n * n), room(n * n)],
            schur: room(n * n),
            u: [room(n * n), room(n * n)],
            spread: room(if is_line { 2 * n } else { 4 * n * n }),
            is_line,
            factors: room(n),
        }
    }

    /// Puts the constants of a mechanism into a lane.
    pub(super) fn take_in(&mut self, lane: usize, reduced: &ReducedMatrices) {
        let n = self.count;
        for (block, own) in self.blocks.iter_mut().zip(&reduced.inverse) {
            block.iter_mut().zip(own).for_each(|(entry, &own)| entry.0[lane] = own);
        }
        self.scale.iter_mut().zip(&reduced.free).for_each(|(scale, &own)| scale.0[lane] = own);
        for (r, (row, own)) in self.rows.iter_mut().zip(&reduced.rows).enumerate() {
            row.constant.0[lane] = own.place.constant;
            let gradients = own.place.linear.iter().map(|&(_, g)| g);
            row.terms.iter_mut().zip(gradients).for_each(|((_, g), own)| put(g, lane, own));
            let back = &reduced.back[r * n..(r + 1) * n];
            row.back.iter_mut().zip(back).for_each(|(back, &own)| put(back, lane, own));
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
                let [xx, xy, yx, yy] = &self.blocks[i * n + j];
                let (zx, zy) = (load::<W>(&x[j]), load::<W>(&y[j]));
                let across = zx.mul_add(load(xx), zy.mul(load(xy)));
                let along = zx.mul_add(load(yx), zy.mul(load(yy)));
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
            weakest = factor.mul(load(&self.scale[p])).larger(weakest);
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

    /// U and P, of V and S⁻¹ at hand.
    #[inline(always)]
    pub(super) fn combine<W: EightLanes>(&mut self) {
        let (n, [vx, vy], [ux, uy]) = (self.count, &self.v, &mut self.u);
        for i in 0..n {
            for s in 0..n {
                let (mut x, mut y) = (W::ZERO, W::ZERO);
                for j in 0..n {
                    let inverse = load::<W>(&self.schur[j * n + s]);
                    x = load::<W>(&vx[i * n + j]).mul_add(inverse, x);
                    y = load::<W>(&vy[i * n + j]).mul_add(inverse, y);
                }
                (ux[i * n + s], uy[i * n + s]) = (store(x), store(y));
            }
        }
        if self.is_line {
            self.find_line::<W>();
        } else {
            self.find_plane::<W>();
        }
    }

    /// P = W - U Vᵀ.
    #[inline(always)]
    fn find_plane<W: EightLanes>(&mut self) {
        let (n, [vx, vy], [ux, uy], spread) = (self.count, &self.v, &self.u, &mut self.spread);
        for i in 0..n {
            for j in i..n {
                let [xx, xy, yx, yy] = &self.blocks[i * n + j];
                let (mut pxx, mut pxy) = (load::<W>(xx), load::<W>(xy));
                let (mut pyx, mut pyy) = (load::<W>(yx), load::<W>(yy));
                for s in 0..n {
                    let (ux, uy) = (load::<W>(&ux[i * n + s]), load::<W>(&uy[i * n + s]));
                    let (x, y) = (load::<W>(&vx[j * n + s]), load::<W>(&vy[j * n + s]));
                    (pxx, pxy) = (ux.neg_mul_add(x, pxx), ux.neg_mul_add(y, pxy));
                    (pyx, pyy) = (uy.neg_mul_add(x, pyx), uy.neg_mul_add(y, pyy));
                }
                let (pxx, pxy, pyx, pyy) = (store(pxx), store(pxy), store(pyx), store(pyy));
                let (row, other) = (2 * n * i, 2 * n * j);
                (spread[row + j], spread[row + n + j]) = (pxx, pxy);
                (spread[other + i], spread[other + n + i]) = (pxx, pyx);
                let (row, other) = (2 * n * (n + i), 2 * n * (n + j));
                (spread[row + j], spread[row + n + j]) = (pyx, pyy);
                (spread[other + i], spread[other + n + i]) = (pxy, pyy);
            }
        }
    }

    /// The vector whose square P is: its column of the largest entry on the diagonal, over that entry's root.
    #[inline(always)]
    fn find_line<W: EightLanes>(&mut self) {
        let (n, [vx, vy], [ux, uy]) = (self.count, &self.v, &self.u);
        for i in 0..n {
            let [xx, _, _, yy] = &self.blocks[i * n + i];
            let (mut x, mut y) = (load::<W>(xx), load::<W>(yy));
            for s in 0..n {
                x = load::<W>(&ux[i * n + s]).neg_mul_add(load(&vx[i * n + s]), x);
                y = load::<W>(&uy[i * n + s]).neg_mul_add(load(&vy[i * n + s]), y);
            }
            (self.spread[i], self.spread[n + i]) = (store(x), store(y));
        }
        let mut largest = [0; LANES];
        let mut most = [0.0; LANES];
        for (k, diagonal) in self.spread.iter().enumerate() {
            for lane in 0..LANES {
                if diagonal.0[lane] > most[lane] {
                    (largest[lane], most[lane]) = (k, diagonal.0[lane]);
                }
            }
        }
        for s in 0..n {
            for lane in 0..LANES {
                let (axis, k) = (largest[lane] / n, largest[lane] % n);
                self.factors[s].0[lane] = self.v[axis][k * n + s].0[lane];
            }
        }
        let root = W::of(&most).sqrt();
        for i in 0..n {
            let (mut x, mut y) = (ZERO, ZERO);
            for lane in 0..LANES {
                let (axis, k) = (largest[lane] / n, largest[lane] % n);
                let block = &self.blocks[i * n + k];
                (x.0[lane], y.0[lane]) = (block[axis].0[lane], block[2 + axis].0[lane]);
            }
            let (mut x, mut y) = (load::<W>(&x), load::<W>(&y));
            for s in 0..n {
                let factor = load::<W>(&self.factors[s]);
                x = load::<W>(&self.u[0][i * n + s]).neg_mul_add(factor, x);
                y = load::<W>(&self.u[1][i * n + s]).neg_mul_add(factor, y);
            }
            (self.spread[i], self.spread[n + i]) = (store(x.div(root)), store(y.div(root)));
        }
    }

    /// What comes of f and q: P f - U q, x and then y, and Uᵀ f + S⁻¹ q.
    #[inline(always)]
    pub(super) fn times<W: EightLanes>(&self, right: &[Octet], found: &mut [Octet]) {
        let n = self.count;
        self.multipliers::<W>(right, &mut found[2 * n..]);
        let q = &right[2 * n..3 * n];
        let mut along = W::ZERO;
        if self.is_line {
            let (mut x, mut y) = (W::ZERO, W::ZERO);
            for i in 0..n {
                x = load::<W>(&self.spread[i]).mul_add(load(&right[i]), x);
                y = load::<W>(&self.spread[n + i]).mul_add(load(&right[n + i]), y);
            }
            along = x.add(y);
        }
        for i in 0..n {
            let (ux, uy) = (&self.u[0][i * n..(i + 1) * n], &self.u[1][i * n..(i + 1) * n]);
            let (mut x, mut y) = (W::ZERO, W::ZERO);
            if self.is_line {
                x = load::<W>(&self.spread[i]).mul(along);
                y = load::<W>(&self.spread[n + i]).mul(along);
            } else {
                let (row, other) = (2 * n * i, 2 * n * (n + i));
                for j in 0..2 * n {
                    let f = load::<W>(&right[j]);
                    x = f.mul_add(load(&self.spread[row + j]), x);
                    y = f.mul_add(load(&self.spread[other + j]), y);
                }
            }
            for s in 0..n {
                let q = load::<W>(&q[s]);
                x = q.neg_mul_add(load(&ux[s]), x);
                y = q.neg_mul_add(load(&uy[s]), y);
            }
            (found[i], found[n + i]) = (store(x), store(y));
        }
    }

    /// Uᵀ f + S⁻¹ q: four of them at a time, in sums none of which waits for another.
    #[inline(always)]
    fn multipliers<W: EightLanes>(&self, right: &[Octet], found: &mut [Octet]) {
        let n = self.count;
        let (fx, fy, q) = (&right[..n], &right[n..2 * n], &right[2 * n..3 * n]);
        let mut s = 0;
        while s + 4 <= n {
            let (mut a, mut b, mut c, mut d) = (W::ZERO, W::ZERO, W::ZERO, W::ZERO);
            for i in 0..n {
                let at = i * n + s;
                let (x, y, schur) = (&self.u[0][at..at + 4], &self.u[1][at..at + 4], &self.schur[at..at + 4]);
                let (fx, fy, q) = (load::<W>(&fx[i]), load::<W>(&fy[i]), load::<W>(&q[i]));
                a = q.mul_add(load(&schur[0]), fy.mul_add(load(&y[0]), fx.mul_add(load(&x[0]), a)));
                b = q.mul_add(load(&schur[1]), fy.mul_add(load(&y[1]), fx.mul_add(load(&x[1]), b)));
                c = q.mul_add(load(&schur[2]), fy.mul_add(load(&y[2]), fx.mul_add(load(&x[2]), c)));
                d = q.mul_add(load(&schur[3]), fy.mul_add(load(&y[3]), fx.mul_add(load(&x[3]), d)));
            }
            (found[s], found[s + 1]) = (store(a), store(b));
            (found[s + 2], found[s + 3]) = (store(c), store(d));
            s += 4;
        }
        while s < n {
            let (mut a, mut b, mut c) = (W::ZERO, W::ZERO, W::ZERO);
            for i in 0..n {
                let at = i * n + s;
                a = load::<W>(&fx[i]).mul_add(load(&self.u[0][at]), a);
                b = load::<W>(&fy[i]).mul_add(load(&self.u[1][at]), b);
                c = load::<W>(&q[i]).mul_add(load(&self.schur[at]), c);
            }
            found[s] = store(a.add(b).add(c));
            s += 1;
        }
    }

    /// Brings unit vectors and their rates, x and then y, onto all rows; tells which lanes are there, of
    /// those that go.
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
            let is_told = weakest.0[lane] * NEARER <= 1.0 && left.0[lane] <= CLOSE;
            is_landed[lane] = is_going[lane] && is_told;
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
            let mut far = if with_constants { load::<W>(&self.rows[r].constant) } else { W::ZERO };
            for (k, [x, y]) in &self.rows[r].terms {
                far = load::<W>(&z[*k]).mul_add(load(x), far);
                far = load::<W>(&z[n + *k]).mul_add(load(y), far);
            }
            self.far[r] = store(far);
        }
        for i in 0..n {
            let (mut x, mut y) = (load::<W>(&z[i]), load::<W>(&z[n + i]));
            for r in 0..self.rows.len() {
                let (far, [back_x, back_y]) = (load::<W>(&self.far[r]), &self.rows[r].back[i]);
                x = far.neg_mul_add(load(back_x), x);
                y = far.neg_mul_add(load(back_y), y);
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
