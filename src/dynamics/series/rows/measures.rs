//! What the rows of a mechanism are measured with.

use crate::arithmetic::Real;
use crate::dynamics::Mechanism;
use crate::dynamics::constraint::{ConstraintEquation, Measure};
use crate::dynamics::partition::CoordinatePartition;
use crate::dynamics::rank::{Levers, Metric};

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
        let levers = in_force.iter().map(|row| longest_lever(row)).collect();
        Self { levers, scale, columns: metric.columns, rows: metric.rows }
    }
}

fn longest_lever(row: &ConstraintEquation) -> f64 {
    let Measure::Place(place) = &row.measure else { return 1.0 };
    let linear = place.linear.iter().map(|(_, g)| g);
    let all = linear.chain(place.bilinear.iter().map(|(_, _, h)| h));
    all.map(|g| libm::hypot(g.re, g.im)).fold(0.0, f64::max)
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
    let base = |(k, b): (usize, f64)| partition.bodies[k].base.map(|base| (base, b));
    let levers: Vec<Levers> =
        rows.iter().map(|row| row.levers(size).into_iter().filter_map(base).collect()).collect();
    (scale, Metric::new(&levers, partition.count(), mechanism.assembly.redundant.len()))
}
