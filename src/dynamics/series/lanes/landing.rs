//! The way back onto the constraint equations at the end of a step, eight motions at once.
//!
//! As the projection of the angle form (`stabilization/projection.rs`): positions, then rates,
//! the shortest way in the metric of the mass matrix, with the factors of the step's end.  Every motion is
//! moved as often as it needs by itself, so that none depends on the others.

use super::super::rows::RowMeasures;
use super::super::user::PowersAt;
use super::super::{Constants, Series, Terms};
use super::number::InLanes;
use super::{StepEnds, Times};
use crate::arithmetic::Complex;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::{EightLanes, SlotTask};
use crate::dynamics::schur::NEAR;

/// Rounds of one level, at most.
const SWEEPS: usize = 6;
/// Violation over its lever that is rounding.
const ROUNDING: f64 = 1e-16;
/// Violation over its lever that may be left.
const LEFT: f64 = 1e-13;
/// The longest turn \[rad\]: the series of its sine and cosine go as far as the fifth power.
const FAR: f64 = 1e-3;
/// Diagonal of M over its pivots, and pivots of S below this part of those of the rank: beyond, light members
/// or long levers cost more digits than doubles have (see [`schur`](crate::dynamics::schur)).
const DEEP: f64 = 1e4;
const LOSS: f64 = 1e-3;

/// How near the lanes are to where constraints lose their independence.
#[derive(Clone, Debug, Default)]
pub struct Regularity {
    /// One over the longest levers of the rows \[1/m; 1 of an angle\].
    per_lever: Vec<Octet>,
    /// What pivots of S are measured against, D, and what pivots of J D Jᵀ are measured against.
    scale: Vec<Octet>,
    columns: Vec<Octet>,
    rows: Vec<Octet>,
    /// J D Jᵀ and its reciprocal pivots.
    rank: Vec<Octet>,
    /// Reciprocal shares of the weakest pivots of S and of J D Jᵀ, and M's diagonal over its pivots.
    shares: [Octet; 3],
}

impl Regularity {
    /// For so many constraints of so many coordinates.
    pub fn new(r: usize, f: usize) -> Self {
        let room = |size: usize| vec![Octet::default(); size];
        Self {
            per_lever: room(r),
            scale: room(r),
            columns: room(f),
            rows: room(r),
            rank: room(r * r),
            ..Self::default()
        }
    }

    /// Puts what the constraints of a mechanism are measured with into a lane.
    pub fn take_in(&mut self, lane: usize, own: &RowMeasures) {
        let per_lever = self.per_lever.iter_mut().zip(&own.levers);
        per_lever.for_each(|(octet, lever)| octet.0[lane] = 1.0 / lever);
        let all = [&mut self.scale, &mut self.columns, &mut self.rows];
        for (octets, own) in all.into_iter().zip([&own.scale, &own.columns, &own.rows]) {
            octets.iter_mut().zip(own).for_each(|(octet, &own)| octet.0[lane] = own);
        }
    }

    /// True where the constraints of a lane are independent, and doubles are enough for them; what is not a
    /// number is as well: the series tells.
    pub fn holds(&self, lane: usize) -> bool {
        let [mass, rank, depth] = [0, 1, 2].map(|k| self.shares[k].0[lane]);
        let is_near = mass * NEAR > 1.0 && (rank * NEAR > 1.0 || rank < LOSS * mass);
        !is_near && depth <= DEEP
    }

    /// Looks at the factors at hand.
    #[inline(always)]
    pub fn look<W: EightLanes>(&mut self, series: &Series<InLanes<W>>, diagonal: &[InLanes<W>]) {
        let Self { scale, columns, rows, rank, .. } = self;
        let [jacobian, pivot] = series.rows.factors();
        let (r, f) = (scale.len(), columns.len());
        let (mut weakest, mut deepest) = (W::ZERO, W::ZERO);
        for i in 0..r {
            weakest = pivot[i].0.mul(W::of(&scale[i].0)).larger(weakest);
        }
        for c in 0..f {
            deepest = series.pivot[c].0.mul(diagonal[c].0).larger(deepest);
        }
        for i in 0..r {
            for j in i..r {
                let mut sum = W::ZERO;
                for c in 0..f {
                    let product = jacobian[i * f + c].0.mul(W::of(&columns[c].0));
                    sum = product.mul_add(jacobian[j * f + c].0, sum);
                }
                rank[i * r + j] = Octet(sum.array());
            }
        }
        let mut dependent = W::ZERO;
        for k in (0..r).rev() {
            let reciprocal = W::ONE.div(W::of(&rank[k * r + k].0));
            dependent = reciprocal.mul(W::of(&rows[k].0)).larger(dependent);
            for i in 0..k {
                let part = W::of(&rank[i * r + k].0).mul(reciprocal);
                for j in 0..=i {
                    let full = W::of(&rank[j * r + k].0);
                    let left = full.neg_mul_add(part, W::of(&rank[j * r + i].0));
                    rank[j * r + i] = Octet(left.array());
                }
            }
        }
        self.shares = [Octet(weakest.array()), Octet(dependent.array()), Octet(deepest.array())];
    }
}

/// Which lanes are still to be moved.
#[derive(Clone, Copy, Debug)]
struct Sieve {
    is_going: [bool; LANES],
    last: [f64; LANES],
}

impl Sieve {
    fn new(is_going: [bool; LANES]) -> Self {
        Self { is_going, last: [f64::INFINITY; LANES] }
    }

    /// Keeps those whose violation is not rounding, and has fallen by half; true where there are any.
    fn sift(&mut self, worst: &[f64; LANES], least: f64) -> bool {
        for lane in 0..LANES {
            let (worst, last) = (worst[lane], &mut self.last[lane]);
            self.is_going[lane] &= worst > least && worst < 0.5 * *last;
            *last = worst;
        }
        self.is_going.contains(&true)
    }

    /// One in the lanes that are to be moved, zero in the others.
    fn mask<W: EightLanes>(&self) -> W {
        let mut mask = [0.0; LANES];
        for lane in 0..LANES {
            mask[lane] = f64::from(u8::from(self.is_going[lane]));
        }
        W::of(&mask)
    }
}

/// Brings angles and rates of all lanes back, which are left where they are in those that do not land.
pub(super) struct ProjectLanes<'a, 'b, W: EightLanes> {
    pub series: &'a mut Series<InLanes<W>>,
    pub regularity: &'a mut Regularity,
    pub begin: &'a mut [Vec<InLanes<W>>; 3],
    pub terms: &'a Terms<'b, InLanes<W>>,
    pub times: Times,
    pub landing: StepEnds<'a>,
}

impl<W: EightLanes> SlotTask for ProjectLanes<'_, '_, W> {
    type Output = [bool; LANES];

    #[inline(always)]
    fn perform(self) -> [bool; LANES] {
        let Self { series, regularity, begin: [u, rest, rate], terms, times, landing } = self;
        let (f, angles) = (u.len(), series.angles);
        let StepEnds { high, low, is_going, unit, per_length } = landing;
        let per_length = W::of(&per_length.0);
        for c in 0..f {
            u[c] = InLanes(W::of(&high[c].0));
            rest[c] = InLanes(W::of(&low[c].0));
            rate[c] = InLanes(W::of(&high[f + c].0));
        }
        series.time = InLanes::moment(times);
        series.begin(times, u, rest, rate);
        series.rows.face(times);
        series.factor_for_rows(terms);
        regularity.look(series, &terms.tree.diagonal);
        let mut sieve = Sieve::new(is_going);
        let mut turned = W::ZERO;
        for _ in 0..SWEEPS {
            series.rows.violations(&series.z[..f]);
            let worst = series.worst_violation(&regularity.per_lever, high, per_length);
            if !sieve.sift(&worst.array(), ROUNDING) {
                break;
            }
            let (mask, way) = (sieve.mask::<W>(), series.rows.way_back());
            for c in 0..f {
                u[c] = InLanes(way[c].0.mul(mask));
            }
            turned = series.turn_back(u, high, low).larger(turned);
            series.aim_here();
        }
        let (far, mut is_landed) = (turned.array(), [false; LANES]);
        for lane in 0..LANES {
            let left = sieve.last[lane];
            is_landed[lane] = is_going[lane] && left <= LEFT && far[lane] <= FAR && regularity.holds(lane);
        }
        series.rows.linearise(&series.z[..f]);
        let mut sieve = Sieve::new(is_landed);
        for _ in 0..SWEEPS {
            let mut fastest = W::of(&unit.0);
            for c in 0..angles {
                fastest = rate[c].0.larger(fastest);
            }
            for c in angles..f {
                fastest = rate[c].0.mul(per_length).larger(fastest);
            }
            let slips = series.rows.slips(rate);
            let mut worst = W::ZERO;
            for i in 0..slips.len() {
                worst = slips[i].0.mul(W::of(&regularity.per_lever[i].0)).larger(worst);
            }
            if !sieve.sift(&worst.div(fastest).array(), ROUNDING) {
                break;
            }
            let (mask, way) = (sieve.mask::<W>(), series.rows.way_back());
            for c in 0..f {
                let change = way[c].0.mul(mask);
                move_by(&mut high[f + c], &mut low[f + c], change);
                rate[c] = InLanes(W::of(&high[f + c].0));
            }
        }
        for lane in 0..LANES {
            is_landed[lane] &= sieve.last[lane] <= LEFT;
        }
        is_landed
    }
}

/// A unit vector turned back by an angle up to [`FAR`].
#[inline(always)]
fn turned_back<W: EightLanes>(z: Complex<InLanes<W>>, turn: W) -> Complex<InLanes<W>> {
    let square = turn.mul(turn);
    let sine = square.mul(turn).neg_mul_add(W::splat(1.0 / 6.0), turn);
    let less = square.mul(square.neg_mul_add(W::splat(1.0 / 24.0), W::splat(0.5)));
    let (x, y) = (z.re.0, z.im.0);
    let re = x.neg_mul_add(less, sine.mul_add(y, x));
    let im = y.neg_mul_add(less, sine.neg_mul_add(x, y));
    Complex::new(InLanes(re), InLanes(im))
}

/// Takes a change off a number in two terms.
#[inline(always)]
fn move_by<W: EightLanes>(high: &mut Octet, low: &mut Octet, change: W) {
    let (from, rest) = (W::of(&high.0), W::of(&low.0).sub(change));
    let sum = from.add(rest);
    let part = sum.sub(from);
    let left = from.sub(sum.sub(part)).add(rest.sub(part));
    (*high, *low) = (Octet(sum.array()), Octet(left.array()));
}

impl<W: EightLanes> Series<InLanes<W>> {
    /// The largest of the violations just found of every lane over their levers, and over angles and places
    /// where rounding grows with these.
    #[inline(always)]
    fn worst_violation(&self, per_lever: &[Octet], high: &[Octet], per_length: W) -> W {
        let mut worst = W::ZERO;
        for i in 0..self.rows.count() {
            let far = self.rows.off(i).0.mul(W::of(&per_lever[i].0));
            let growing = self.rows.growing(i);
            if growing.is_empty() {
                worst = far.larger(worst);
                continue;
            }
            let mut most = W::ONE;
            for &k in growing {
                let size = W::of(&high[k].0);
                most = if k < self.angles { size } else { size.mul(per_length) }.larger(most);
            }
            worst = far.div(most).larger(worst);
        }
        worst
    }

    /// Takes changes off the coordinates; returns the largest of an angle of every lane.
    #[inline(always)]
    fn turn_back(&mut self, changes: &[InLanes<W>], high: &mut [Octet], low: &mut [Octet]) -> W {
        let (angles, mut turned) = (self.angles, W::ZERO);
        for c in 0..changes.len() {
            let turn = changes[c].0;
            move_by(&mut high[c], &mut low[c], turn);
            if c < angles {
                turned = turn.larger(turned);
                self.z[c] = turned_back(self.z[c], turn);
                self.phi[c] = InLanes(W::of(&high[c].0));
            } else if (c - angles).is_multiple_of(2) {
                self.z[c].re -= InLanes(turn);
            } else {
                self.z[c - 1].im -= InLanes(turn);
            }
        }
        turned
    }

    /// Aims and their slopes at the elements that are there now.
    #[inline(always)]
    fn aim_here(&mut self) {
        let n = self.elements;
        let at = PowersAt { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
        self.rows.advance_aims(0, at, &self.factors.scale, &mut self.load);
    }

    /// The factors of M_0 and of the rows at unit vectors that are there already, and nothing more.
    #[inline(always)]
    fn factor_for_rows(&mut self, terms: &Terms<InLanes<W>>) {
        self.factor_mass::<0>(terms);
        let n = self.elements;
        self.rows.factor(&self.z[..n], &self.reduced, &self.pivot);
    }
}
