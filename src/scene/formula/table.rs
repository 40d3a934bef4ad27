//! Tables of points as functions in formulas: `gust(t)`.
//!
//! A clamped cubic spline through the points, level at both ends and constant beyond them.  Its pieces are
//! branches of the formula and the knots between them switches, so that methods of high order end a step at
//! every knot and see a polynomial in between.  Pieces are found by bisection, and the
//! [conditions](super::branches) of a table grow with the logarithm of its points.
//!
//! Source: C. de Boor, *A Practical Guide to Splines* (1978), chapter IV (complete cubic spline
//! interpolation).

use super::branches::Knots;
use super::{Formula, Node};
use crate::arithmetic::Scalar;
use std::sync::Arc;

/// Points of a table at least and at most: every one of them ends a step.
pub const POINTS: [usize; 2] = [2, 1_000_000];

/// A table with its spline.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpolant {
    /// Name, as formulas call it.
    pub name: String,
    /// Points (x, y), x ascending.
    points: Arc<[[f64; 2]]>,
    /// Slopes of the spline there.
    slopes: Arc<[f64]>,
}

impl Interpolant {
    /// The spline through points with ascending x.
    pub fn new(name: &str, points: &[[f64; 2]]) -> Self {
        Self { name: name.to_owned(), points: points.into(), slopes: slopes(points).into() }
    }

    /// Its knots, one a point.
    pub(super) fn knots(&self) -> Knots<'_> {
        Knots(&self.points)
    }

    /// Adds it at an argument to a formula; returns its result.
    pub(super) fn emit(&self, formula: &mut Formula, argument: usize, place: (usize, usize)) -> usize {
        let known = formula.tables.iter().position(|table| table.name == self.name);
        let table = known.unwrap_or_else(|| {
            formula.tables.push(self.clone());
            formula.tables.len() - 1
        });
        let first = formula.conditions.len();
        formula.conditions.extend(std::iter::repeat_n(argument, self.knots().bits()));
        formula.push(Node::Table(table, first, argument), place)
    }

    /// Its value at `x` by the polynomial of a piece: 0 before the first point, one more after each; `number`
    /// gives numbers as such scalars.
    pub(super) fn value<S: Scalar>(&self, piece: usize, x: S, number: &impl Fn(f64) -> S) -> S {
        let Some(k) = piece.checked_sub(1) else {
            return self.points.first().map_or(S::ZERO, |point| number(point[1]));
        };
        let [knot, y] = self.points[k];
        let Some(&[next, value]) = self.points.get(k + 1) else { return number(y) };
        let (h, b) = (next - knot, self.slopes[k]);
        let chord = (value - y) / h;
        let c = (3.0 * chord - 2.0 * b - self.slopes[k + 1]) / h;
        let d = (b + self.slopes[k + 1] - 2.0 * chord) / (h * h);
        let from_knot = x - number(knot);
        [c, b, y].into_iter().fold(number(d), |sum, coefficient| sum * from_knot + number(coefficient))
    }
}

/// Slopes at the points of the cubic spline that is level at both ends, by elimination in a tridiagonal
/// system.
fn slopes(points: &[[f64; 2]]) -> Vec<f64> {
    let n = points.len();
    let mut slopes = vec![0.0; n];
    if n < 3 {
        return slopes;
    }
    let length = |k: usize| points[k + 1][0] - points[k][0];
    let chord = |k: usize| (points[k + 1][1] - points[k][1]) / length(k);
    // h_k s_{k-1} + 2 (h_{k-1} + h_k) s_k + h_{k-1} s_{k+1} = 3 (h_k m_{k-1} + h_{k-1} m_k)
    let (mut above, mut right) = (vec![0.0; n], vec![0.0; n]);
    for k in 1..n - 1 {
        let (before, after) = (length(k - 1), length(k));
        let pivot = 2.0 * (before + after) - after * above[k - 1];
        above[k] = before / pivot;
        right[k] = (3.0 * (after * chord(k - 1) + before * chord(k)) - after * right[k - 1]) / pivot;
    }
    for k in (1..n - 1).rev() {
        slopes[k] = right[k] - above[k] * slopes[k + 1];
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_smooth_through_its_points_and_constant_beyond_them() {
        let points = [[-1.0, 2.0], [0.5, 1.0], [1.0, 4.0], [3.0, 3.5]];
        let formula =
            Formula::parse_with("3*f(x) - 1", &[Interpolant::new("f", &points)]).expect("a formula");
        let f = |x: f64| (formula.value(&[x]) + 1.0) / 3.0;
        for [x, y] in points {
            assert!((f(x) - y).abs() < 1e-14 && (f(x + 1e-9) - y).abs() < 1e-7);
        }
        assert_eq!((f(-7.0), f(9.0)), (2.0, 3.5));
        // First and second differences are continuous at inner knots, the first at the ends.
        let h = 1e-4;
        for [x, _] in points {
            let [a, b, c, d, e] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| f(x + k * h));
            assert!(((c - b) / h - (d - c) / h).abs() < 0.02, "{x}");
            let curvature = [(a - 2.0 * b + c) / (h * h), (c - 2.0 * d + e) / (h * h)];
            assert!(
                x == -1.0 || x == 3.0 || (curvature[0] - curvature[1]).abs() < 0.02,
                "{x}: {curvature:?}"
            );
        }
        // A parabola that is level at 0 is its own spline where it ends level too: y = x² (3 - 2 x).
        let cubic: Vec<[f64; 2]> = [0.0, 0.3, 0.7, 1.0].map(|x: f64| [x, x * x * (3.0 - 2.0 * x)]).to_vec();
        let formula = Formula::parse_with("f(x)", &[Interpolant::new("f", &cubic)]).expect("a formula");
        for x in [0.1, 0.5, 0.9] {
            assert!((formula.value(&[x]) - x * x * (3.0 - 2.0 * x)).abs() < 1e-15);
        }
    }
}
