//! The series of a motion with those of small differences beside it, on dual numbers.
//!
//! ```text
//! (w_m, w_m') of (u, w) moved by (du, dw):      du(h) = du + Σ w_m' h^(m+1)/(m+1),   dw(h) = Σ w_m' h^m,
//!     m = 0…P
//! r = min over the last powers k and the columns of max((|w_0'|/|w_k'|)^(1/k), (|w_1'|/|w_k'|)^(1/(k-1))),
//!     h = r tolerance^(1/(P+1))
//! ```
//!
//! Near singular positions the radius is that of the lower powers, and the sums end with the smallest one.
//! The same recurrence that expands the motion is its own derivative, multipliers included, to rounding.

use crate::arithmetic::{DoubleDouble, Dual, Scalar};
use crate::dynamics::series::Series;
use crate::dynamics::{Coordinates, Mechanism, State};

/// Highest powers P of the rates, and the first term left out of a column with each, over the column: errors
/// multiply over the steps.
pub const ORDERS: [usize; 3] = [10, 8, 7];
const TOLERANCES: [f64; 3] = [1e-7, 1e-5, 1e-4];
/// Powers the step is taken from.
const JUDGES: usize = 4;
/// The same near singular positions, where rounding off the constraints spoils the later powers.
const LOW: usize = 6;
const LOW_TOLERANCE: f64 = 1e-5;
/// The smallest power there, over the column, that is little enough to end with.
const NOISE: f64 = 1e-3;

/// So many columns beside a motion.
pub trait ColumnsBeside: Send {
    /// Expands the motion through a state, and the columns from `first` on, that many as it has room for.
    fn expand(&mut self, mechanism: &Mechanism, state: &State, columns: &[Vec<f64>]);

    /// How far the series of the columns carry \[s\], infinite where they end; not a number where one of them
    /// is none.  Where `is_near` a singular position, which the motion goes through smoothly, the powers that
    /// rounding has spoiled are left out.
    fn reach(&mut self, weights: &[f64], is_near: bool) -> f64;

    /// Takes the columns on by `h` \[s\].
    fn go(&self, h: f64, columns: &mut [Vec<f64>]);

    /// Takes the state on by `h` \[s\].
    fn carry(&self, h: f64, state: &mut State);

    /// The largest acceleration of a column over its position, where its rates are zero \[1/s²\].
    fn pull(&self, weights: &[f64]) -> f64;

    /// Share of the weakest constraint at the state: see [`schur`](crate::dynamics::schur).
    fn weakest(&self) -> f64;

    /// The powers of the motion's own rates, one after the other.
    fn powers(&self) -> Vec<f64>;

    /// Adds so much of these powers to each column.
    fn add(&mut self, powers: &[f64], shares: &[f64]);
}

/// Room for this many columns with powers up to `order`, one of [`ORDERS`], six in a series at most.
pub fn room(
    mechanism: &Mechanism,
    coordinates: Coordinates,
    order: usize,
    mut columns: usize,
) -> Vec<(usize, Box<dyn ColumnsBeside>)> {
    let mut groups = Vec::new();
    while columns > 0 {
        let count = columns.min(6);
        groups.push((
            count,
            match count {
                1 | 2 => {
                    Box::new(ExpandedBlock::<2>::new(mechanism, coordinates, order)) as Box<dyn ColumnsBeside>
                }
                3 | 4 => Box::new(ExpandedBlock::<4>::new(mechanism, coordinates, order)),
                _ => Box::new(ExpandedBlock::<6>::new(mechanism, coordinates, order)),
            },
        ));
        columns -= count;
    }
    groups
}

/// Room for `D` columns, of which some may be idle.
struct ExpandedBlock<const D: usize> {
    count: usize,
    order: usize,
    /// Powers of the rates that are summed.
    summed: usize,
    series: Series<Dual<D>>,
    unknowns: [Vec<Dual<D>>; 3],
}

impl<const D: usize> ExpandedBlock<D> {
    fn new(mechanism: &Mechanism, coordinates: Coordinates, order: usize) -> Self {
        let series = Series::new(mechanism, coordinates, order);
        let f = series.coordinates();
        Self {
            count: 0,
            order,
            summed: order + 1,
            series,
            unknowns: std::array::from_fn(|_| vec![Dual::ZERO; f]),
        }
    }

    /// Power `m` of the rates.
    fn power(&self, m: usize) -> &[Dual<D>] {
        let f = self.series.coordinates();
        &self.series.rate[m * f..(m + 1) * f]
    }

    /// About the radius of convergence of all columns \[s\], from the powers that end with `last`.
    fn radius(&self, weights: &[f64], last: usize) -> f64 {
        let mut least = f64::INFINITY;
        for j in 0..self.count {
            let first = [0, 1].map(|m| libm::log2(self.size(m, j, weights)));
            // Where a difference in angles has neither a rate nor an acceleration, as beside bars that are
            // level and at rest, it is the measure itself.
            let is_still = first == [f64::NEG_INFINITY; 2];
            let own = if is_still { libm::log2(self.size_of(&self.unknowns[0], j, weights)) } else { 0.0 };
            for k in last + 1 - JUDGES..=last {
                let size = self.size(k, j, weights);
                if !size.is_finite() {
                    return f64::NAN;
                }
                if size > 0.0 {
                    let size = libm::log2(size);
                    least = least.min(match is_still {
                        true => (own - size) / (k + 1) as f64,
                        false => ((first[0] - size) / k as f64).max((first[1] - size) / (k - 1) as f64),
                    });
                }
            }
        }
        libm::exp2(least)
    }

    /// Size of power `m` in column `j`.
    fn size(&self, m: usize, j: usize, weights: &[f64]) -> f64 {
        self.size_of(self.power(m), j, weights)
    }

    /// Size of column `j` of these coordinates, or of powers of their rates.
    fn size_of(&self, values: &[Dual<D>], j: usize, weights: &[f64]) -> f64 {
        let squares = values.iter().zip(weights).map(|(value, weight)| (value.slope[j] * weight).powi(2));
        squares.sum::<f64>().sqrt()
    }
}

impl<const D: usize> ColumnsBeside for ExpandedBlock<D> {
    fn expand(&mut self, mechanism: &Mechanism, state: &State, columns: &[Vec<f64>]) {
        let f = self.series.coordinates();
        self.count = columns.len();
        let [u, rest, rate] = &mut self.unknowns;
        let slope = |i: usize| std::array::from_fn(|j| columns.get(j).map_or(0.0, |column| column[i]));
        for i in 0..f {
            u[i] = Dual::new(state.y[i], slope(i));
            rest[i] = Dual::constant(state.low[i]);
            rate[i] = Dual::new(state.y[f + i], slope(f + i));
        }
        self.series.expand(mechanism, state.time, u, rest, rate);
    }

    fn reach(&mut self, weights: &[f64], is_near: bool) -> f64 {
        let order = self.order;
        self.summed = order + 1;
        let tolerance = ORDERS
            .iter()
            .zip(TOLERANCES)
            .find(|(known, _)| **known == order)
            .map_or(TOLERANCES[0], |(_, tolerance)| tolerance);
        let reach = self.radius(weights, order) * libm::pow(tolerance, 1.0 / (order + 1) as f64);
        if !is_near {
            return reach;
        }
        let low = self.radius(weights, LOW) * libm::pow(LOW_TOLERANCE, 1.0 / (LOW + 1) as f64);
        if low < 1.5 * reach {
            return reach;
        }
        let share = |m: usize| {
            let of = |j: usize| {
                let first = self.size(0, j, weights) + self.size(1, j, weights) * low;
                if first > 0.0 { self.size(m, j, weights) * libm::pow(low, m as f64) / first } else { 0.0 }
            };
            (0..self.count).map(of).fold(0.0, f64::max)
        };
        let (last, noise) =
            (2..=order).map(|m| (m, share(m))).fold((2, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
        self.summed = last + 1;
        if noise < NOISE { low } else { f64::NAN }
    }

    fn go(&self, h: f64, columns: &mut [Vec<f64>]) {
        let f = self.series.coordinates();
        for i in 0..f {
            let (mut turn, mut rate) = ([0.0; D], [0.0; D]);
            for m in (0..self.summed).rev() {
                let power = &self.power(m)[i].slope;
                for j in 0..D {
                    turn[j] = turn[j] * h + power[j] / (m + 1) as f64;
                    rate[j] = rate[j] * h + power[j];
                }
            }
            for (j, column) in columns.iter_mut().enumerate() {
                column[i] += h * turn[j];
                column[f + i] = rate[j];
            }
        }
    }

    fn carry(&self, h: f64, state: &mut State) {
        let f = self.series.coordinates();
        for i in 0..f {
            let sum = (0..self.summed).rev().fold([0.0; 2], |[turn, rate], m| {
                let power = self.power(m)[i].value;
                [turn * h + power / (m + 1) as f64, rate * h + power]
            });
            let turned = DoubleDouble::sum(state.y[i], state.low[i]) + h * sum[0];
            (state.y[i], state.low[i]) = (turned.hi, turned.lo);
            (state.y[f + i], state.low[f + i]) = (sum[1], 0.0);
        }
        state.time = state.time + h;
        state.wrap();
    }

    fn pull(&self, weights: &[f64]) -> f64 {
        let positions = |j: usize| {
            self.unknowns[0].iter().zip(weights).map(|(u, weight)| (u.slope[j] * weight).powi(2)).sum::<f64>()
        };
        let share = |j: usize| self.size(1, j, weights) / positions(j).sqrt();
        (0..self.count).map(share).filter(|share| share.is_finite()).fold(0.0, f64::max)
    }

    fn weakest(&self) -> f64 {
        self.series.weakest().share
    }

    fn powers(&self) -> Vec<f64> {
        self.series.rate.iter().map(|rate| rate.value).collect()
    }

    fn add(&mut self, powers: &[f64], shares: &[f64]) {
        for (rate, power) in self.series.rate.iter_mut().zip(powers) {
            for (slope, share) in rate.slope.iter_mut().zip(shares) {
                *slope += share * power;
            }
        }
    }
}
