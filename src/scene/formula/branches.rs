//! Which branches of a formula hold, and pieces of tables among them.
//!
//! A table of n points has n + 1 pieces, and neighbours among them differ in one bit of their Gray numbers k
//! ^ (k >> 1).  These bits are the conditions of a table: 20 for a million points.  Bit j changes at the
//! knots whose numbers, from 1 on, are odd multiples of 2^j; its condition is a parabola with zeros at the
//! two of them around the present piece,
//!
//! ```text
//! ± (x - a) (b - x) / (b - a),    ± (x - a) or ± (b - x) where there is but one
//! ```
//!
//! Source of the numbers: F. Gray, US patent 2 632 058 (1953).

use crate::arithmetic::Scalar;

/// Says which branches hold, as a formula is evaluated.
pub(super) trait Branches<S> {
    /// True where the condition of this number, with this value, chooses its first branch.
    fn is_positive(&mut self, condition: usize, value: S) -> bool;

    /// The piece of a table at `x`, whose conditions begin with number `first`; `knot` gives the x of a
    /// point.
    fn piece(&mut self, first: usize, knots: &Knots, x: S, knot: impl Fn(usize) -> S) -> usize;
}

/// The knots of a table.
pub(super) struct Knots<'a>(pub &'a [[f64; 2]]);

impl Knots<'_> {
    /// How many conditions tell its pieces apart.
    pub fn bits(&self) -> usize {
        (usize::BITS - self.0.len().leading_zeros()) as usize
    }

    /// The piece whose bits these are; a piece that there is not is the last one.
    fn piece(&self, bits: &[bool]) -> usize {
        let mut higher = false;
        let piece = bits.iter().rev().fold(0, |piece, &bit| {
            higher ^= bit;
            2 * piece + usize::from(higher)
        });
        piece.min(self.0.len())
    }

    /// Bit `j` of a piece.
    fn bit(piece: usize, j: usize) -> bool {
        (piece ^ (piece >> 1)) >> j & 1 == 1
    }

    /// The condition of bit `j` on a piece; `at` gives the x of a point.
    fn condition<S: Scalar>(&self, piece: usize, j: usize, x: S, at: impl Fn(usize) -> S) -> S {
        let (first, period) = (1 << j, 2 << j);
        // The least number of a knot above the piece at which the bit changes.
        let above = if piece < first { first } else { first + (piece - first) / period * period + period };
        let from = (above > first).then(|| above - period - 1);
        let until = (above <= self.0.len()).then(|| above - 1);
        let value = match (from, until) {
            (Some(a), Some(b)) => ((x - at(a)) * (at(b) - x)).scale(1.0 / (self.0[b][0] - self.0[a][0])),
            (Some(a), None) => x - at(a),
            (None, Some(b)) => at(b) - x,
            (None, None) => S::ONE,
        };
        if Self::bit(piece, j) { value } else { -value }
    }
}

/// By the signs of conditions in doubles.
pub(super) struct BySign;

impl Branches<f64> for BySign {
    fn is_positive(&mut self, _: usize, value: f64) -> bool {
        value > 0.0
    }

    fn piece(&mut self, _: usize, knots: &Knots, x: f64, _: impl Fn(usize) -> f64) -> usize {
        knots.0.partition_point(|knot| x - knot[0] > 0.0)
    }
}

/// The same over a scalar with an order.
pub(super) struct ByOrder;

impl<S: crate::arithmetic::Real> Branches<S> for ByOrder {
    fn is_positive(&mut self, _: usize, value: S) -> bool {
        value > S::ZERO
    }

    fn piece(&mut self, _: usize, knots: &Knots, x: S, knot: impl Fn(usize) -> S) -> usize {
        let numbers: Vec<usize> = (0..knots.0.len()).collect();
        numbers.partition_point(|&number| x > knot(number))
    }
}

/// The same, noted; conditions among the zeros are zero, whatever rounding makes of them.
pub(super) struct Noted<'a> {
    pub found: Vec<bool>,
    pub zeros: &'a [bool],
}

impl Noted<'_> {
    fn note(&mut self, condition: usize, is_positive: bool) -> bool {
        self.found[condition] = is_positive && !self.zeros.get(condition).is_some_and(|&is_zero| is_zero);
        self.found[condition]
    }
}

impl Branches<f64> for Noted<'_> {
    fn is_positive(&mut self, condition: usize, value: f64) -> bool {
        self.note(condition, value > 0.0)
    }

    fn piece(&mut self, first: usize, knots: &Knots, x: f64, knot: impl Fn(usize) -> f64) -> usize {
        let piece = BySign.piece(first, knots, x, knot);
        let bits = first..first + knots.bits();
        bits.clone().for_each(|bit| {
            self.note(bit, Knots::bit(piece, bit - first));
        });
        knots.piece(&self.found[bits])
    }
}

/// Those whose bits are set.
pub(super) struct GivenBranches<'a>(pub &'a [bool]);

impl<S> Branches<S> for GivenBranches<'_> {
    fn is_positive(&mut self, condition: usize, _: S) -> bool {
        self.0.get(condition).copied().unwrap_or(false)
    }

    fn piece(&mut self, first: usize, knots: &Knots, _: S, _: impl Fn(usize) -> S) -> usize {
        knots.piece(self.0.get(first..first + knots.bits()).unwrap_or(&[]))
    }
}

/// Those whose bits are set; the values of all conditions are noted.
pub(super) struct WatchedBranches<'a, S> {
    pub given: GivenBranches<'a>,
    pub values: &'a mut [S],
}

impl<S: Scalar> Branches<S> for WatchedBranches<'_, S> {
    fn is_positive(&mut self, condition: usize, value: S) -> bool {
        self.values[condition] = value;
        self.given.is_positive(condition, value)
    }

    fn piece(&mut self, first: usize, knots: &Knots, x: S, knot: impl Fn(usize) -> S) -> usize {
        let piece = self.given.piece(first, knots, x, &knot);
        (0..knots.bits()).for_each(|j| self.values[first + j] = knots.condition(piece, j, x, &knot));
        piece
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_condition_changes_at_every_knot_and_leads_to_the_next_piece() {
        for count in [2, 3, 4, 5, 16, 31, 32, 33, 1000] {
            let points: Vec<[f64; 2]> = (0..count).map(|k| [(k * (k + 3)) as f64, 0.0]).collect();
            let knots = Knots(&points);
            let bits = |piece| (0..knots.bits()).map(|j| Knots::bit(piece, j)).collect::<Vec<_>>();
            for piece in 0..=count {
                assert_eq!(knots.piece(&bits(piece)), piece);
                let inside = match piece {
                    0 => points[0][0] - 1.0,
                    _ if piece == count => points[count - 1][0] + 1.0,
                    _ => 0.5 * (points[piece - 1][0] + points[piece][0]),
                };
                assert_eq!(BySign.piece(0, &knots, inside, |k| points[k][0]), piece);
                let condition = |j: usize, x: f64| knots.condition(piece, j, x, |k| points[k][0]);
                for j in 0..knots.bits() {
                    assert_eq!(condition(j, inside) > 0.0, bits(piece)[j], "{count} points, piece {piece}");
                }
                for (next, knot) in [(piece + 1, piece), (piece.wrapping_sub(1), piece.wrapping_sub(1))] {
                    let Some(&[x, _]) = points.get(knot) else { continue };
                    let zeros: Vec<usize> = (0..knots.bits()).filter(|&j| condition(j, x) == 0.0).collect();
                    let changed: Vec<usize> =
                        (0..knots.bits()).filter(|&j| bits(piece)[j] != bits(next)[j]).collect();
                    assert_eq!((zeros.len(), zeros), (1, changed));
                }
            }
        }
    }
}
