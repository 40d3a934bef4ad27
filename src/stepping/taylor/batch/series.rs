//! The series of all lanes of a kernel, and its sum.

use super::super::terms::{add_to, over};
use super::free::FreeLanes;
use super::{load, store, unit};
use crate::arithmetic::eight::Octet;
use crate::arithmetic::lanes::wide::EightLanes;

/// Expands all lanes to an order.
#[inline(always)]
pub(super) fn expand<W: EightLanes, const N: usize, const SPRUNG: bool>(
    kernel: &mut FreeLanes<N, SPRUNG>,
    order: usize,
) {
    let mut f = [[W::ZERO; N]; 2];
    if SPRUNG {
        kernel.springs.begin::<W>([&kernel.high[0], &kernel.low[0]], &mut kernel.powers[0]);
    }
    for i in 0..N {
        let power = &mut kernel.powers[0];
        if !SPRUNG {
            [power.c[i], power.s[i]] = unit::<W>(&kernel.high[0][i], &kernel.low[0][i]);
        }
        power.v[i] = kernel.high[1][i];
        let (c, s, v) = (power.c[i], power.s[i], load::<W>(&kernel.high[1][i]));
        (f[0][i], f[1][i]) = (v.mul(load(&c)), v.mul(load(&s)));
    }
    invert::<W, N, SPRUNG>(kernel);
    for k in 0..order {
        raise(kernel, &mut f, k);
    }
}

/// Order k: from e_k, v_k and f_k = v e to those of the next one.
#[inline(always)]
pub(super) fn raise<W: EightLanes, const N: usize, const SPRUNG: bool>(
    kernel: &mut FreeLanes<N, SPRUNG>,
    f: &mut [[W; N]; 2],
    k: usize,
) {
    let zero = W::ZERO;
    let order = W::splat((k + 1) as f64);
    let (mut gx, mut gy, mut torque) = ([zero; N], [zero; N], [zero; N]);
    for i in 0..N {
        let s = over(f[0][i], k + 1);
        let c = zero.sub(over(f[1][i], k + 1));
        (kernel.powers[k + 1].c[i], kernel.powers[k + 1].s[i]) = (store(c), store(s));
    }
    let mut pull = [[zero; N]; 2];
    if SPRUNG {
        pull = kernel.springs.pull::<W>(k, &kernel.powers[k + 1]);
    }
    // Eight sums at a time keep the multipliers busy, those of one body in two vectors or of two bodies in
    // one; the newest coefficients come last.
    let at_once = 2 / W::VECTORS;
    for first in (0..N).step_by(at_once) {
        let count = at_once.min(N - first);
        let mut sums = [[zero; 4]; 2];
        let past = &kernel.powers[1..=k];
        for (early, late) in past.iter().zip(past.iter().rev()) {
            for b in 0..count {
                let (c, s, v) = (
                    load::<W>(&late.c[first + b]),
                    load::<W>(&late.s[first + b]),
                    load::<W>(&early.v[first + b]),
                );
                let [x, y, load_x, load_y] = &mut sums[b];
                (*x, *y) = (v.mul_add(c, *x), v.mul_add(s, *y));
                *load_x = c.mul_add(load::<W>(&early.px[first + b]), *load_x);
                *load_y = s.mul_add(load::<W>(&early.py[first + b]), *load_y);
            }
        }
        for b in 0..count {
            let i = first + b;
            let [x, y, load_x, load_y] = sums[b];
            let (start, next, this) = (&kernel.powers[0], &kernel.powers[k + 1], &kernel.powers[k]);
            let v0 = load::<W>(&start.v[i]);
            (gx[i], gy[i]) = (v0.mul_add(load::<W>(&next.c[i]), x), v0.mul_add(load::<W>(&next.s[i]), y));
            let weights = load::<W>(&this.s[i]).neg_mul_add(
                load::<W>(&kernel.weight[i][0]),
                load::<W>(&this.c[i]).mul(load::<W>(&kernel.weight[i][1])),
            );
            torque[i] = weights.sub(load_x.add(load_y));
        }
    }
    for i in 0..N {
        let (ax, ay) = (
            mass_terms::<W, N>(&kernel.coupling[i], &gx, i),
            mass_terms::<W, N>(&kernel.coupling[i], &gy, i),
        );
        let inner = load::<W>(&kernel.powers[0].c[i]).mul_add(ax, load::<W>(&kernel.powers[0].s[i]).mul(ay));
        torque[i] = order.neg_mul_add(inner, torque[i]);
        if SPRUNG {
            let (c, s) = (load::<W>(&kernel.powers[0].c[i]), load::<W>(&kernel.powers[0].s[i]));
            torque[i] = c.neg_mul_add(pull[0][i], s.neg_mul_add(pull[1][i], torque[i]));
        }
    }
    let mut x = solve(kernel, &torque);
    if k < 2 {
        refine(kernel, &torque, &mut x);
    }
    for i in 0..N {
        let v = over(x[i], k + 1);
        kernel.powers[k + 1].v[i] = store(v);
        (f[0][i], f[1][i]) = (
            v.mul_add(load::<W>(&kernel.powers[0].c[i]), gx[i]),
            v.mul_add(load::<W>(&kernel.powers[0].s[i]), gy[i]),
        );
    }
    for i in 0..N {
        let (ax, ay) = (
            mass_terms::<W, N>(&kernel.coupling[i], &f[0], i),
            mass_terms::<W, N>(&kernel.coupling[i], &f[1], i),
        );
        let (mut px, mut py) = (ax.mul(order), ay.mul(order));
        if SPRUNG {
            (px, py) = (px.add(pull[0][i]), py.add(pull[1][i]));
        }
        (kernel.powers[k + 1].px[i], kernel.powers[k + 1].py[i]) = (store(px), store(py));
    }
}

/// One step of the residual, so that x is rounded, not merely computed.
#[inline(always)]
fn refine<W: EightLanes, const N: usize, const SPRUNG: bool>(
    kernel: &FreeLanes<N, SPRUNG>,
    torque: &[W; N],
    x: &mut [W; N],
) {
    let mut residual = *torque;
    for i in 0..N {
        residual[i] = load::<W>(&kernel.diagonal[i]).neg_mul_add(x[i], residual[i]);
        for j in 0..N {
            if j != i {
                let (ci, si, cj, sj) = (
                    load::<W>(&kernel.powers[0].c[i]),
                    load::<W>(&kernel.powers[0].s[i]),
                    load::<W>(&kernel.powers[0].c[j]),
                    load::<W>(&kernel.powers[0].s[j]),
                );
                let mass = load::<W>(&kernel.coupling[i][j]).mul(ci.mul_add(cj, si.mul(sj)));
                residual[i] = mass.neg_mul_add(x[j], residual[i]);
            }
        }
    }
    let correction = solve(kernel, &residual);
    for i in 0..N {
        x[i] = x[i].add(correction[i]);
    }
}

/// Σ_{j≠i} A_ij x_j.
#[inline(always)]
pub(super) fn mass_terms<W: EightLanes, const N: usize>(row: &[Octet; N], x: &[W; N], i: usize) -> W {
    let mut sum = W::ZERO;
    for j in 0..N {
        if j != i {
            sum = load::<W>(&row[j]).mul_add(x[j], sum);
        }
    }
    sum
}

/// M_0⁻¹ x.
#[inline(always)]
pub(super) fn solve<W: EightLanes, const N: usize, const SPRUNG: bool>(
    kernel: &FreeLanes<N, SPRUNG>,
    x: &[W; N],
) -> [W; N] {
    let mut solution = [W::ZERO; N];
    for i in 0..N {
        let mut sum = load::<W>(&kernel.inverse[i][0]).mul(x[0]);
        for j in 1..N {
            sum = load::<W>(&kernel.inverse[i][j]).mul_add(x[j], sum);
        }
        solution[i] = sum;
    }
    solution
}

/// M_0⁻¹ by elimination without interchanges, M_0 being positive definite.
#[inline(always)]
pub(super) fn invert<W: EightLanes, const N: usize, const SPRUNG: bool>(kernel: &mut FreeLanes<N, SPRUNG>) {
    let (zero, one) = (W::ZERO, W::ONE);
    let mut mass = [[zero; N]; N];
    for i in 0..N {
        mass[i][i] = load::<W>(&kernel.diagonal[i]);
        for j in 0..N {
            if j != i {
                let (ci, si, cj, sj) = (
                    load::<W>(&kernel.powers[0].c[i]),
                    load::<W>(&kernel.powers[0].s[i]),
                    load::<W>(&kernel.powers[0].c[j]),
                    load::<W>(&kernel.powers[0].s[j]),
                );
                mass[i][j] = load::<W>(&kernel.coupling[i][j]).mul(ci.mul_add(cj, si.mul(sj)));
            }
        }
    }
    for p in 0..N {
        let pivot = W::ONE.div(mass[p][p]);
        mass[p][p] = one;
        for j in 0..N {
            mass[p][j] = mass[p][j].mul(pivot);
        }
        for i in 0..N {
            if i != p {
                let factor = mass[i][p];
                mass[i][p] = zero;
                for j in 0..N {
                    mass[i][j] = factor.neg_mul_add(mass[p][j], mass[i][j]);
                }
            }
        }
    }
    for i in 0..N {
        for j in 0..N {
            kernel.inverse[i][j] = store(mass[i][j]);
        }
    }
}

/// Every lane's state at the end of its step.
#[inline(always)]
pub(super) fn finish<W: EightLanes, const N: usize, const SPRUNG: bool>(
    kernel: &mut FreeLanes<N, SPRUNG>,
    order: usize,
    taken: &Octet,
) {
    let h = load::<W>(taken);
    let square = h.mul(h);
    if SPRUNG {
        kernel.springs.finish(order, h);
    }
    for i in 0..N {
        let (mut angles, mut rates) = ([W::ZERO; 2], [W::ZERO; 2]);
        // Even and odd powers apart, in registers.
        macro_rules! add {
            ($parity:literal, $k:expr) => {
                let v = load::<W>(&kernel.powers[$k].v[i]);
                angles[$parity] = angles[$parity].mul_add(square, over(v, $k + 1));
                rates[$parity] = rates[$parity].mul_add(square, v);
            };
        }
        let mut k = order;
        if k % 2 == 1 {
            add!(1, k);
            k -= 1;
        }
        while k > 0 {
            add!(0, k);
            add!(1, k - 1);
            k -= 2;
        }
        let angle = angles[0].mul_add(h, angles[1]).mul_add(h, load::<W>(&kernel.powers[0].v[i])).mul(h);
        let rate = rates[0].mul_add(h, rates[1]).mul(h);
        for (part, increment, rest) in [(0, angle, load::<W>(&kernel.low[1][i]).mul(h)), (1, rate, W::ZERO)] {
            let sum =
                add_to([load::<W>(&kernel.high[part][i]), load::<W>(&kernel.low[part][i])], increment, rest);
            (kernel.high[part][i], kernel.low[part][i]) = (store(sum[0]), store(sum[1]));
        }
    }
}
