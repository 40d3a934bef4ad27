//! Tables of points as functions in formulas: `gust(t)`.
//!
//! A clamped cubic spline through the points, level at both ends and constant beyond them.  Its pieces are
//! branches of the formula and the knots between them switches, so that methods of high order end a step at
//! every knot and see a polynomial in between.  Pieces are found by bisection, and the
//! [conditions](super::branches) of a table grow with the logarithm of its points.
//!
//! Source: C. de Boor, *A Practical Guide to Splines* (1978), chapter IV (complete cubic spline
//! interpolation).

use super::branches::{Branches, BySign, Knots};
use super::{Formula, Node, Origin};
use crate::arithmetic::{Real, Scalar};
use std::sync::Arc;

/// Points of a table at least and at most: every one of them ends a step.
pub const POINTS: [usize; 2] = [2, 1_000_000];

/// A cubic spline that is level at both ends.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spline<C = f64> {
    /// Points (x, y), x ascending.
    points: Arc<[[C; 2]]>,
    /// Slopes there.
    slopes: Arc<[C]>,
}

impl<C: Real> Spline<C> {
    /// The spline through points with ascending x.
    pub fn new(points: &[[C; 2]]) -> Self {
        Self { points: points.into(), slopes: slopes(points).into() }
    }

    /// The x of a point.
    pub fn knot(&self, point: usize) -> C {
        self.points[point][0]
    }

    /// The coefficients on a piece, by rising powers of the distance from the point it begins at: of piece 0,
    /// which ends at the first point, and of the last one a constant.
    pub fn coefficients(&self, piece: usize) -> [C; 4] {
        let Some(k) = piece.checked_sub(1) else {
            let first = self.points.first().map_or(C::ZERO, |point| point[1]);
            return [first, C::ZERO, C::ZERO, C::ZERO];
        };
        let [knot, y] = self.points[k];
        let Some(&[next, value]) = self.points.get(k + 1) else { return [y, C::ZERO, C::ZERO, C::ZERO] };
        let (h, b, end) = (next - knot, self.slopes[k], self.slopes[k + 1]);
        let chord = (value - y) / h;
        let c = (chord.scale(3.0) - b.scale(2.0) - end) / h;
        let d = (b + end - chord.scale(2.0)) / (h * h);
        [y, b, c, d]
    }
}

/// A table with its spline.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpolant {
    /// Name, as formulas call it.
    pub name: String,
    spline: Spline,
}

impl Interpolant {
    /// The spline through points with ascending x.
    pub fn new(name: &str, points: &[[f64; 2]]) -> Self {
        Self { name: name.to_owned(), spline: Spline::new(points) }
    }

    /// Its knots, one a point.
    pub(super) fn knots(&self) -> Knots<'_> {
        Knots(&self.spline.points)
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
    /// gives numbers of table number `table` as such scalars.
    pub(super) fn value<S: Scalar>(
        &self,
        table: usize,
        piece: usize,
        x: S,
        number: &impl Fn(Origin, f64) -> S,
    ) -> S {
        let coefficients = self.spline.coefficients(piece);
        let coefficient =
            |power: usize| number(Origin::Coefficient { table, piece, power }, coefficients[power]);
        if piece == 0 || piece == self.spline.points.len() {
            return coefficient(0);
        }
        let from_knot = x - self.knot(table, piece - 1, number);
        (0..3).rev().fold(coefficient(3), |sum, power| sum * from_knot + coefficient(power))
    }

    /// Its value in doubles.
    pub(super) fn at(&self, x: f64) -> f64 {
        let piece = BySign.piece(0, &self.knots(), x, |point| self.spline.knot(point));
        self.value(0, piece, x, &|_, number| number)
    }

    /// The x of a point, likewise.
    pub(super) fn knot<S: Scalar>(
        &self,
        table: usize,
        point: usize,
        number: &impl Fn(Origin, f64) -> S,
    ) -> S {
        number(Origin::Knot { table, point }, self.spline.knot(point))
    }
}

/// Slopes at the points of the cubic spline that is level at both ends, by elimination in a tridiagonal
/// system.
fn slopes<C: Real>(points: &[[C; 2]]) -> Vec<C> {
    let n = points.len();
    let mut slopes = vec![C::ZERO; n];
    if n < 3 {
        return slopes;
    }
    let length = |k: usize| points[k + 1][0] - points[k][0];
    let chord = |k: usize| (points[k + 1][1] - points[k][1]) / length(k);
    // h_k s_{k-1} + 2 (h_{k-1} + h_k) s_k + h_{k-1} s_{k+1} = 3 (h_k m_{k-1} + h_{k-1} m_k)
    let (mut above, mut right) = (vec![C::ZERO; n], vec![C::ZERO; n]);
    for k in 1..n - 1 {
        let (before, after) = (length(k - 1), length(k));
        let pivot = (before + after).scale(2.0) - after * above[k - 1];
        above[k] = before / pivot;
        right[k] = ((after * chord(k - 1) + before * chord(k)).scale(3.0) - after * right[k - 1]) / pivot;
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
