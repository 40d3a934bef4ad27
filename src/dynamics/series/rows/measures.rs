//! What the rows of a mechanism are measured with.

use crate::arithmetic::Real;
use crate::dynamics::Mechanism;
use crate::dynamics::constraint::{ConstraintEquation, RowMeasure};
use crate::dynamics::partition::CoordinatePartition;
use crate::dynamics::rank::{Bounds, Metric};

/// Numbers of a mechanism that tell how far its rows are violated and how independent they are, all
/// coordinates free.
#[derive(Debug)]
pub struct RowMeasures {
    /// The longest lever of every row \[m; 1 where it gives an angle\].
    pub levers: Vec<f64>,
    /// What pivots of S are measured against.
    pub scale: Vec<f64>,
    /// D, and what pivots of J D Jᵀ are measured against (see [`Metric`](crate::dynamics::rank::Metric)).
    pub columns: Vec<f64>,
    /// See [`columns`](Self::columns).
    pub rows: Vec<f64>,
}

impl RowMeasures {
    /// Those of a mechanism.
    pub fn of(mechanism: &Mechanism) -> Self {
        let partition = CoordinatePartition::<f64>::free(mechanism);
        let in_force = in_force(&mechanism.constraints, &partition);
        let (scale, metric) = measures(mechanism, &partition, &in_force);
        let levers = in_force.iter().map(|row| longest_lever(row, mechanism.units.length)).collect();
        Self { levers, scale, columns: metric.columns, rows: metric.rows }
    }
}

/// The longest lever of a row; one of an origin is the unit of length \[m\], and so is that of an aim at
/// least, or 1 where it gives an angle.
fn longest_lever(row: &ConstraintEquation, unit: f64) -> f64 {
    let RowMeasure::Place(place) = &row.measure else { return 1.0 };
    let least = match (&row.aim, row.is_in_radians()) {
        (None, _) => 0.0,
        (Some(_), true) => 1.0,
        (Some(_), false) => unit,
    };
    let per = |k: usize| if k < place.angles { 1.0 } else { unit };
    let linear = place.linear.iter().map(|(k, g)| (per(*k), g));
    let all = linear.chain(place.bilinear.iter().map(|(j, k, h)| (per(*j).min(per(*k)), h)));
    all.map(|(unit, g)| unit * libm::hypot(g.re, g.im)).fold(least, f64::max)
}

/// The coordinates whose magnitudes the rounding of rows grows with, row by row.
pub(super) fn growing(rows: &[&ConstraintEquation]) -> Vec<Vec<usize>> {
    let aims = rows.iter().flat_map(|row| row.aim.iter());
    let counted: Vec<usize> = aims.flat_map(|aim| aim.counted_angles()).collect();
    rows.iter().map(|row| growing_of(row, &counted)).collect()
}

/// Those of one row, where turns of these angles are counted.
fn growing_of(row: &ConstraintEquation, counted: &[usize]) -> Vec<usize> {
    let RowMeasure::Place(place) = &row.measure else {
        return row.coordinates().into_iter().filter(|k| counted.contains(k)).collect();
    };
    let angles = row.aim.iter().flat_map(|aim| aim.counted_angles());
    let mut growing: Vec<usize> =
        row.coordinates().into_iter().filter(|&k| k >= place.angles).chain(angles).collect();
    growing.sort_unstable();
    growing.dedup();
    growing
}

/// The rows that a partition does not fulfil already.
pub(super) fn in_force<'a, R: Real, C: Real>(
    rows: &'a [ConstraintEquation<R>],
    partition: &CoordinatePartition<C>,
) -> Vec<&'a ConstraintEquation<R>> {
    rows.iter().filter(|row| !(row.is_angle() && partition.driven())).collect()
}

/// What pivots of S of these rows are measured against, and what their rank is measured with.
pub(super) fn measures<C: Real>(
    mechanism: &Mechanism,
    partition: &CoordinatePartition<C>,
    rows: &[&ConstraintEquation],
) -> (Vec<f64>, Metric) {
    let scale = rows.iter().map(|row| row.scale(&mechanism.tree)).collect();
    let size = mechanism.size_of_parts();
    let bounds = Bounds::new(rows.iter().copied(), size, |k| partition.bodies[k].base);
    (scale, Metric::new(bounds, partition.count(), mechanism.assembly.redundant.len()))
}
