//! Small differences through impacts at several walls at one moment, which neighbours meet one after the
//! other.
//!
//! The neighbour on one side meets them in the order of its own times, that on the other side in the opposite
//! order.  Where both orders lead to the motion itself, and to the same differences, these are those of the
//! flow.  Else what comes of the impacts depends on which of them is first, and there is no flow.

use super::{Crossed, Delta, Discontinuity, Side, shift, strike};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::{Mechanism, Motion};
use crate::run::contact::Jump;
use std::sync::Arc;

/// What both orders may leave between them, over the size of what they lead to.
const ALIKE: f64 = 1e-6;
/// Impacts in a row at most.
const ROUNDS: usize = 16;
/// Normal velocity over that of the point's parts above which a point does not move into its wall.
const LEAVES: f64 = 1e-9;

/// True where a moment has impacts at more than one wall.
pub(super) fn is_at_several(jumps: &[Jump]) -> bool {
    jumps.iter().any(|jump| !jump.together.is_empty())
        || jumps.iter().filter(|jump| jump.contact.is_some()).count() > 1
}

/// Takes columns through the impacts of one moment.
///
/// # Errors
/// Why neighbours do not go the same way.
pub(super) fn cross(passage: &Discontinuity, columns: &mut [Delta]) -> Result<Crossed, String> {
    let Discontinuity { mechanism, jumps, .. } = *passage;
    let ([first, ..], [.., last]) = (jumps, jumps) else { return Ok(Crossed::default()) };
    let is_only_struck = jumps.iter().all(|jump| jump.contact.is_some());
    let is_free = |mechanism: &Mechanism| mechanism.held.is_empty() && mechanism.frictions.is_empty();
    if !(is_only_struck && is_free(mechanism) && is_free(&last.mechanism)) {
        let what =
            "several walls are met at once where a point rests, dry friction acts or an event happens, too";
        return Err(what.into());
    }
    let mut walls: Vec<usize> =
        jumps.iter().flat_map(|jump| jump.contact.iter().chain(&jump.together)).copied().collect();
    walls.sort_unstable();
    walls.dedup();
    let moment = SimultaneousWalls { mechanism, before: &first.before, walls: &walls };
    let [_, after] = last.after.rounded();
    let mut passed = Crossed::default();
    let side = Side::new(moment.mechanism, moment.before);
    for (wall, gradient, approach) in moment.met(&side) {
        let late = |column: &Delta| side.late(moment.mechanism, wall, (&gradient, approach), column);
        passed.walls.push((wall, columns.iter().map(late).collect()));
    }
    for column in columns {
        let [ahead, behind] = [1.0, -1.0].map(|sign| {
            let mut found = column.entries.to_vec();
            let mut own = Delta { entries: &mut found, neighbours: column.neighbours.clone() };
            let rates = moment.one_after_the_other(sign, &mut own)?;
            Ok::<_, String>((found, rates))
        });
        let (ahead, behind) = (ahead?, behind?);
        let is_one =
            are_alike(&ahead.1, &after) && are_alike(&behind.1, &after) && are_alike(&ahead.0, &behind.0);
        if !is_one {
            return Err(
                "several walls are met at once, and which of them is met first decides what follows".into()
            );
        }
        column.entries.copy_from_slice(&ahead.0);
    }
    Ok(passed)
}

/// Walls that touch at one moment.
struct SimultaneousWalls<'a> {
    mechanism: &'a Arc<Mechanism>,
    before: &'a Motion,
    walls: &'a [usize],
}

impl SimultaneousWalls<'_> {
    /// Those of the walls that points move into, with the derivatives of their gaps by coordinates and time.
    fn met(&self, side: &Side) -> Vec<(usize, Vec<f64>, f64)> {
        let met = |&wall: &usize| {
            let mut gradient = vec![0.0; side.phi.len()];
            let approach = side.gap_rate(self.mechanism, wall, &mut gradient);
            let is_met = approach < -LEAVES * self.mechanism.contacts[wall].step_size(&side.omega);
            is_met.then_some((wall, gradient, approach))
        };
        self.walls.iter().filter_map(met).collect()
    }

    /// Takes a column through the impacts in the order in which the neighbour on the side of this sign meets
    /// them; returns the motion's own rates after these.
    fn one_after_the_other(&self, sign: f64, column: &mut Delta) -> Result<Vec<f64>, String> {
        let mut motion = self.before.clone();
        for _ in 0..ROUNDS {
            let side = Side::new(self.mechanism, &motion);
            let late = |(wall, gradient, approach): &(usize, Vec<f64>, f64)| {
                (*wall, side.late(self.mechanism, *wall, (gradient, *approach), column))
            };
            let met = self.met(&side);
            let next = met.iter().map(late).min_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1)));
            let Some((wall, late)) = next else { return Ok(side.omega) };
            shift(column.entries, late, &side);
            strike(self.mechanism, &motion, wall, late, column)?;
            let impact = self.mechanism.impact_at(wall, motion.time, &side.phi, &side.omega);
            let rates = impact.ok_or("neighbouring motions have no way back from a wall")?.omega;
            motion.omega = rates.into_iter().map(DoubleDouble::from).collect();
            shift(column.entries, -late, &Side::new(self.mechanism, &motion));
        }
        Err("several walls are met at once again and again".into())
    }
}

/// Whether two lists are the same over the size of the largest entry.
fn are_alike(one: &[f64], other: &[f64]) -> bool {
    let most = one.iter().chain(other).fold(0.0, |most: f64, entry| most.max(entry.abs()));
    one.iter().zip(other).all(|(a, b)| (a - b).abs() <= ALIKE * most)
}
