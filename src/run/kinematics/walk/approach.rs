//! The way from the last position to a limit, and what columns come to at it.
//!
//! ```text
//! beside a fold     q = q* + a s + b s² + ...,   s = |t - t*|^(1/2)
//! a column          f* + c s + ...         extrapolated to s = 0
//!                   s^-p (c + ...)         without bound
//! ```

use super::{DriveWalk, FOUND, SolvedPosition};
use crate::run::kinematics::Limit;

/// Positions between the last one and a limit, at equal distances in s.
const BETWEEN: usize = 8;
/// Nodes of the extrapolation, s halved from one to the next, and how far the fastest coordinate is from its
/// value at the limit at the first \[rad, units of length\].
const NODES: usize = 14;
const FIRST: f64 = 0.16;
/// Nodes of one polynomial, and differences of the last nodes that tell growth.
const DEGREE: usize = 5;
const GROWING: usize = 4;
/// Without bound each difference is larger than the one before by this at least, all by the same but for a
/// share of it, as s^-p has it; and the last is no rounding.  Rounding grows as s^-3, but by no even ratios.
const GROWTH: f64 = 1.2;
const EVEN: f64 = 0.2;
const ROUNDING: f64 = 1e-9;
/// See [`DriveWalk::is_rounded`].
const ROUNDED: f64 = 1e-10;
/// Two polynomials that differ by a larger share of a column's values do not tell its value at the limit.
const ALIKE: f64 = 1e-6;

/// Positions on the way to a limit.
pub(in crate::run::kinematics) struct LimitApproach {
    /// The drive's value at the limit.
    pub drive: f64,
    /// From the last position towards it, without either.
    pub positions: Vec<SolvedPosition>,
    /// s and the position there, towards the limit.
    nodes: Vec<(f64, SolvedPosition)>,
}

impl DriveWalk {
    /// True where the rounding of the largest acceleration, which is in all of them, is more than a share of
    /// the drive's rate squared: beside a limit it hides there what stays finite.
    pub fn is_rounded(&self, at: &SolvedPosition) -> bool {
        let sizes = at.position.alpha.iter().enumerate().map(|(k, alpha)| (alpha / self.size(k)).abs());
        f64::EPSILON * sizes.fold(0.0, f64::max) > ROUNDED * self.drive_rate().powi(2)
    }

    /// The way from `last` to a limit, at whose near side this stands.
    pub fn approach(&mut self, last: &SolvedPosition, limit: &Limit) -> LimitApproach {
        let is_node = true;
        let end = if limit.is_fold { (limit.drive - self.law[0]) / self.law[1] } else { self.state.time.hi };
        let left = end - last.state.time.hi;
        let share = |k: usize| 1.0 - k as f64 / BETWEEN as f64;
        let mut ways: Vec<(f64, bool)> =
            (1..BETWEEN).map(|k| (left.abs() * share(k).powi(2), !is_node)).collect();
        if !limit.is_fold {
            ways.push((0.0, !is_node));
        } else if let Some([away, _]) = self.end() {
            // The fastest coordinate is 2 q' (t - t*) from its value at the limit.
            let first = away.abs() * (FIRST / (2.0 * self.fastest() * away)).powi(2);
            let nodes = (0..NODES).map(|k| first * 0.25_f64.powi(k as i32));
            ways.extend(nodes.filter(|way| *way > 100.0 * FOUND * end.abs()).map(|way| (way, is_node)));
        }
        ways.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut positions, mut nodes) = (Vec::new(), Vec::new());
        self.restore(last);
        for (way, is_node) in ways {
            if self.go(end - way.copysign(left)).is_err() {
                self.restore(last);
                continue;
            }
            let here = self.solved();
            if is_node {
                nodes.push((way.sqrt(), here.clone()));
            }
            if way < left.abs() {
                positions.push(here);
            }
        }
        LimitApproach { drive: limit.drive, positions, nodes }
    }
}

impl LimitApproach {
    /// Only those positions at which the drive is as it is asked for.
    pub fn within(mut self, is_asked: impl Fn(f64) -> bool) -> Self {
        self.positions.retain(|at| is_asked(at.position.drive));
        self
    }

    /// What a column comes to at the limit: infinite where it grows without bound; none if not known.
    pub fn column(&self, column: usize) -> Option<f64> {
        let points: Vec<[f64; 2]> =
            self.nodes.iter().map(|(s, at)| [*s, at.position.column(column)]).collect();
        let mut sizes: Vec<f64> = points.iter().map(|point| point[1].abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // That of most nodes: at the last ones it may be rounding.
        let (size, largest) = (*sizes.get(sizes.len() / 2)?, sizes.last().copied()?);
        let steps: Vec<f64> = points.windows(2).map(|pair| pair[1][1] - pair[0][1]).collect();
        let last = &steps[steps.len().saturating_sub(GROWING)..];
        let ratios: Vec<f64> = last.windows(2).map(|pair| pair[1] / pair[0]).collect();
        let is_even = |ratio: &f64| (ratio - ratios[0]).abs() < EVEN * ratios[0];
        if let [.., step] = *last
            && last.len() == GROWING
            && ratios.iter().all(|ratio| *ratio > GROWTH && is_even(ratio))
            && step.abs() > ROUNDING * largest
        {
            return Some(f64::INFINITY.copysign(step));
        }
        let told = points.windows(DEGREE).map(|part| {
            let value = at_zero(part);
            (value, (value - at_zero(&part[1..])).abs())
        });
        let (value, apart) = told.min_by(|a, b| a.1.total_cmp(&b.1))?;
        // Zero but for rounding is zero.
        let value = if value.abs() <= ROUNDING * size { 0.0 } else { value };
        (apart <= ALIKE * size).then_some(value)
    }
}

/// The polynomial through these points at zero, by Neville's scheme.
fn at_zero(points: &[[f64; 2]]) -> f64 {
    let mut values: Vec<f64> = points.iter().map(|point| point[1]).collect();
    for order in 1..points.len() {
        for k in 0..points.len() - order {
            let [low, high] = [points[k][0], points[k + order][0]];
            values[k] = (low * values[k + 1] - high * values[k]) / (low - high);
        }
    }
    values.first().copied().unwrap_or(f64::NAN)
}
