//! Small differences through impacts at several walls at one moment, which neighbours meet one after the
//! other.
//!
//! The neighbour on one side meets them in the order of its own times, that on the other side in the opposite
//! order.  Where both orders lead to the motion itself, and to the same differences, these are those of the
//! flow.  Else what comes of the impacts depends on which of them is first, and there is no flow.

use super::impact::{Side, change, plain, shift};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::Posture;
use crate::dynamics::friction::Mode;
use crate::dynamics::kernel::dot;
use crate::dynamics::{Mechanism, Motion};
use crate::run::contact::{Jump, in_modes};
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

/// Takes a column of all coordinates and rates through the impacts of one moment.
///
/// # Errors
/// Why neighbours do not go the same way.
pub(super) fn cross(mechanism: &Arc<Mechanism>, jumps: &[Jump], column: &mut [f64]) -> Result<(), String> {
    let ([first, ..], [.., last]) = (jumps, jumps) else { return Ok(()) };
    let is_only_struck = jumps.iter().all(|jump| jump.contact.is_some());
    if !is_only_struck || !mechanism.held.is_empty() || !last.mechanism.held.is_empty() {
        return Err("several walls are met at once where a point rests or an event happens, too".into());
    }
    let mut walls: Vec<usize> =
        jumps.iter().flat_map(|jump| jump.contact.iter().chain(&jump.together)).copied().collect();
    walls.sort_unstable();
    walls.dedup();
    let open = vec![Mode::Open; mechanism.frictions.len()];
    let striking = in_modes(mechanism, &[], &open);
    let orders = [1.0, -1.0].map(|sign| {
        let mut found = column.to_vec();
        let rates = one_after_the_other(&striking, &first.before, &walls, sign, &mut found)?;
        Ok::<_, String>((found, rates))
    });
    let [ahead, behind] = orders;
    let (ahead, behind) = (ahead?, behind?);
    let after: Vec<f64> = last.after.omega.iter().map(|omega| omega.hi).collect();
    let is_one =
        are_alike(&ahead.1, &after) && are_alike(&behind.1, &after) && are_alike(&ahead.0, &behind.0);
    if !is_one {
        return Err(
            "several walls are met at once, and which of them is met first decides what follows".into()
        );
    }
    column.copy_from_slice(&ahead.0);
    Ok(())
}

/// Takes a column through the impacts in the order in which the neighbour on the side of this sign meets them;
/// returns the motion's own rates after these.
fn one_after_the_other(
    mechanism: &Mechanism,
    before: &Motion,
    walls: &[usize],
    sign: f64,
    column: &mut [f64],
) -> Result<Vec<f64>, String> {
    let n = mechanism.coordinates();
    let mut motion = before.clone();
    for _ in 0..ROUNDS {
        let side = Side::new(mechanism, &motion);
        let z = mechanism.elements(&side.phi);
        let late = |&wall: &usize| {
            let contact = &mechanism.contacts[wall];
            let mut gradient = vec![0.0; n];
            let at = Posture { phi: &side.phi, z: &z, omega: &side.omega };
            let here = contact.row.linearise(motion.time, at, &mut gradient);
            let approach = dot(&gradient, &side.omega) + here.drive;
            let is_met = approach < -LEAVES * contact.step_size(&side.omega);
            is_met.then(|| (wall, -dot(&gradient, &column[..n]) / approach))
        };
        let next = walls.iter().filter_map(late).min_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1)));
        let Some((wall, late)) = next else { return Ok(side.omega) };
        shift(column, late, &side);
        let rates = |motion: &Motion, _: &[f64]| {
            let [phi, omega] = plain(motion);
            mechanism.impact_at(wall, motion.time, &phi, &omega).map(|impact| impact.omega)
        };
        let no_way = "neighbouring motions have no way back from a wall";
        change(&motion, late, column, &rates).ok_or(no_way)?;
        motion.omega = rates(&motion, &[]).ok_or(no_way)?.into_iter().map(DoubleDouble::from).collect();
        shift(column, -late, &Side::new(mechanism, &motion));
    }
    Err("several walls are met at once again and again".into())
}

/// Whether two lists are the same over the size of the largest entry.
fn are_alike(one: &[f64], other: &[f64]) -> bool {
    let most = one.iter().chain(other).fold(0.0, |most: f64, entry| most.max(entry.abs()));
    one.iter().zip(other).all(|(a, b)| (a - b).abs() <= ALIKE * most)
}
