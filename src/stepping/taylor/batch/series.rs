//! The series of all lanes of a team, and its sum.

use super::super::terms::{add_to, over};
use super::{Quad, TEAMS, Team};
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::sincos;

/// Expands all lanes to an order.
#[inline(always)]
pub(super) fn expand<L: Lanes, const N: usize>(teams: &mut [Team<N>; TEAMS], order: usize) {
    let mut products = [[[L::splat(0.0); N]; 2]; TEAMS];
    for (team, f) in teams.iter_mut().zip(&mut products) {
        for i in 0..N {
            let (s, c) = sincos::sin_cos::<L>(L::of(team.high[0][i]), L::of(team.low[0][i]));
            (team.powers[0].c[i], team.powers[0].s[i], team.powers[0].v[i]) =
                (c.array(), s.array(), team.high[1][i]);
            let v = L::of(team.high[1][i]);
            (f[0][i], f[1][i]) = (v.mul(c), v.mul(s));
        }
        invert::<L, N>(team);
    }
    for k in 0..order {
        for (team, f) in teams.iter_mut().zip(&mut products) {
            raise::<L, N>(team, f, k);
        }
    }
}

/// Order k: from e_k, v_k and f_k = v e to those of the next one.
#[inline(always)]
pub(super) fn raise<L: Lanes, const N: usize>(team: &mut Team<N>, f: &mut [[L; N]; 2], k: usize) {
    let zero = L::splat(0.0);
    let order = L::splat((k + 1) as f64);
    let (mut gx, mut gy, mut torque) = ([zero; N], [zero; N], [zero; N]);
    for i in 0..N {
        let s = over(f[0][i], k + 1);
        let c = zero.sub(over(f[1][i], k + 1));
        (team.powers[k + 1].c[i], team.powers[k + 1].s[i]) = (c.array(), s.array());
    }
    // Two bodies at a time keep the multipliers busy; the newest coefficients come last.
    for first in (0..N).step_by(2) {
        let count = if first + 1 < N { 2 } else { 1 };
        let mut sums = [[zero; 4]; 2];
        let past = &team.powers[1..=k];
        for (early, late) in past.iter().zip(past.iter().rev()) {
            for b in 0..count {
                let (c, s, v) =
                    (L::of(late.c[first + b]), L::of(late.s[first + b]), L::of(early.v[first + b]));
                let [x, y, load_x, load_y] = &mut sums[b];
                (*x, *y) = (v.mul_add(c, *x), v.mul_add(s, *y));
                *load_x = c.mul_add(L::of(early.px[first + b]), *load_x);
                *load_y = s.mul_add(L::of(early.py[first + b]), *load_y);
            }
        }
        for b in 0..count {
            let i = first + b;
            let [x, y, load_x, load_y] = sums[b];
            let (start, next, this) = (&team.powers[0], &team.powers[k + 1], &team.powers[k]);
            let v0 = L::of(start.v[i]);
            (gx[i], gy[i]) = (v0.mul_add(L::of(next.c[i]), x), v0.mul_add(L::of(next.s[i]), y));
            let weights = L::of(this.s[i])
                .neg_mul_add(L::of(team.weight[i][0]), L::of(this.c[i]).mul(L::of(team.weight[i][1])));
            torque[i] = weights.sub(load_x.add(load_y));
        }
    }
    for i in 0..N {
        let (ax, ay) =
            (mass_terms::<L, N>(&team.coupling[i], &gx, i), mass_terms::<L, N>(&team.coupling[i], &gy, i));
        let inner = L::of(team.powers[0].c[i]).mul_add(ax, L::of(team.powers[0].s[i]).mul(ay));
        torque[i] = order.neg_mul_add(inner, torque[i]);
    }
    let mut x = solve::<L, N>(team, &torque);
    if k < 2 {
        // x is rounded, not merely computed: one step of the residual.
        let mut residual = torque;
        for i in 0..N {
            residual[i] = L::of(team.diagonal[i]).neg_mul_add(x[i], residual[i]);
            for j in 0..N {
                if j != i {
                    let (ci, si, cj, sj) = (
                        L::of(team.powers[0].c[i]),
                        L::of(team.powers[0].s[i]),
                        L::of(team.powers[0].c[j]),
                        L::of(team.powers[0].s[j]),
                    );
                    let mass = L::of(team.coupling[i][j]).mul(ci.mul_add(cj, si.mul(sj)));
                    residual[i] = mass.neg_mul_add(x[j], residual[i]);
                }
            }
        }
        let correction = solve::<L, N>(team, &residual);
        for i in 0..N {
            x[i] = x[i].add(correction[i]);
        }
    }
    for i in 0..N {
        let v = over(x[i], k + 1);
        team.powers[k + 1].v[i] = v.array();
        (f[0][i], f[1][i]) =
            (v.mul_add(L::of(team.powers[0].c[i]), gx[i]), v.mul_add(L::of(team.powers[0].s[i]), gy[i]));
    }
    for i in 0..N {
        let (ax, ay) = (
            mass_terms::<L, N>(&team.coupling[i], &f[0], i),
            mass_terms::<L, N>(&team.coupling[i], &f[1], i),
        );
        (team.powers[k + 1].px[i], team.powers[k + 1].py[i]) = (ax.mul(order).array(), ay.mul(order).array());
    }
}

/// Σ_{j≠i} A_ij x_j.
#[inline(always)]
pub(super) fn mass_terms<L: Lanes, const N: usize>(row: &[Quad; N], x: &[L; N], i: usize) -> L {
    let mut sum = L::splat(0.0);
    for j in 0..N {
        if j != i {
            sum = L::of(row[j]).mul_add(x[j], sum);
        }
    }
    sum
}

/// M_0⁻¹ x.
#[inline(always)]
pub(super) fn solve<L: Lanes, const N: usize>(team: &Team<N>, x: &[L; N]) -> [L; N] {
    let mut solution = [L::splat(0.0); N];
    for i in 0..N {
        let mut sum = L::of(team.inverse[i][0]).mul(x[0]);
        for j in 1..N {
            sum = L::of(team.inverse[i][j]).mul_add(x[j], sum);
        }
        solution[i] = sum;
    }
    solution
}

/// M_0⁻¹ by elimination without interchanges, M_0 being positive definite.
#[inline(always)]
pub(super) fn invert<L: Lanes, const N: usize>(team: &mut Team<N>) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let mut mass = [[zero; N]; N];
    for i in 0..N {
        mass[i][i] = L::of(team.diagonal[i]);
        for j in 0..N {
            if j != i {
                let (ci, si, cj, sj) = (
                    L::of(team.powers[0].c[i]),
                    L::of(team.powers[0].s[i]),
                    L::of(team.powers[0].c[j]),
                    L::of(team.powers[0].s[j]),
                );
                mass[i][j] = L::of(team.coupling[i][j]).mul(ci.mul_add(cj, si.mul(sj)));
            }
        }
    }
    for p in 0..N {
        let pivot = L::ONE.div(mass[p][p]);
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
            team.inverse[i][j] = mass[i][j].array();
        }
    }
}

/// Every lane's state at the end of its step.
#[inline(always)]
pub(super) fn finish<L: Lanes, const N: usize>(team: &mut Team<N>, order: usize, taken: Quad) {
    let h = L::of(taken);
    let square = h.mul(h);
    for i in 0..N {
        let (mut angles, mut rates) = ([L::splat(0.0); 2], [L::splat(0.0); 2]);
        let mut k = order;
        while k > 0 {
            let v = L::of(team.powers[k].v[i]);
            angles[k % 2] = angles[k % 2].mul_add(square, over(v, k + 1));
            rates[k % 2] = rates[k % 2].mul_add(square, v);
            k -= 1;
        }
        let angle = angles[0].mul_add(h, angles[1]).mul_add(h, L::of(team.powers[0].v[i])).mul(h);
        let rate = rates[0].mul_add(h, rates[1]).mul(h);
        for (part, increment, rest) in [(0, angle, L::of(team.low[1][i]).mul(h)), (1, rate, L::ZERO)] {
            let sum = add_to([L::of(team.high[part][i]), L::of(team.low[part][i])], increment, rest);
            (team.high[part][i], team.low[part][i]) = (sum[0].array(), sum[1].array());
        }
    }
}
