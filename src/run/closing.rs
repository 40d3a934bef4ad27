//! Parts that events switch on while the motion goes on: joints and locks that close, motors that engage,
//! walls that come into the way.
//!
//! ```text
//! M (w⁺ - w⁻) + Gᵀ sigma = 0,   G w⁺ + C_t = 0         of all rows, those that close among them
//! ```
//!
//! A joint closes plastically: of all rates that its rows allow, the nearest in kinetic energy follow, and
//! the energy lost is booked with the event.  Its points have to meet there; a motor, and a lock without an
//! angle, goes on from where it is.  Source: F. Pfeiffer, C. Glocker, *Multibody Dynamics with Unilateral
//! Contacts* (1996), section 8.2, with restitution 0.

use super::contact::{ContactDriver, in_modes};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::contact::metric::ContactMetric;
use crate::dynamics::friction::{FrictionMode, Normal};
use crate::dynamics::kernel::Kernel;
use crate::dynamics::multiplier::Multiplier;
use crate::dynamics::{Form, Mechanism, Motion};
use crate::stabilization::projection::project;
use std::sync::Arc;

/// How far apart what closes may be: angles \[rad\], and points over the size of the mechanism.
const MEETS: f64 = 1e-6;
/// How far behind its wall a point may be where that is switched on, over the length of its contact.
const BEHIND: f64 = 1e-9;
/// Impulse that pulls over the largest one which is rounding.
const ROUNDING: f64 = 1e-12;

impl ContactDriver {
    /// Lets motors, and locks without an angle, that come into force at this motion go on from where they
    /// are.
    pub(super) fn engage(&mut self, motion: &Motion) {
        let clutches = &self.whole.switches.clutches;
        let rows: Vec<usize> = (0..self.whole.constraints.len())
            .filter(|&r| {
                let name = &self.whole.constraints[r].name;
                clutches.contains(name)
                    && !self.off.contains(name)
                    && self.free.constraints[r].coordinates().is_empty()
            })
            .collect();
        if rows.is_empty() {
            return;
        }
        let residuals = residuals(&self.whole, motion);
        let shifts: Vec<(usize, f64)> = rows.into_iter().map(|row| (row, residuals[row])).collect();
        self.whole = Arc::new(self.whole.shifted(&shifts));
        for (row, by) in shifts {
            match self.shifts.iter_mut().find(|shift| shift.0 == row) {
                Some(shift) => shift.1 += by,
                None => self.shifts.push((row, by)),
            }
        }
    }
}

/// Closes the rows that `after` has in force and `before` has not, and changes the motion accordingly;
/// contacts held that this would have to pull are let go.
///
/// # Errors
/// What does not meet, or a point behind a wall that is switched on, and what to try.
pub(super) fn close(
    [before, after]: [&Mechanism; 2],
    held: &mut Vec<usize>,
    motion: &mut Motion,
) -> Result<(), (String, &'static str)> {
    behind([before, after], motion)?;
    let is_closing = |&r: &usize| {
        before.constraints[r].coordinates().is_empty() && !after.constraints[r].coordinates().is_empty()
    };
    let closing: Vec<usize> = (0..after.constraints.len()).filter(is_closing).collect();
    if closing.is_empty() {
        return Ok(());
    }
    let (residuals, size) = (residuals(after, motion), after.size_of_parts());
    for &r in &closing {
        let row = &after.constraints[r];
        let unit = if row.is_in_radians() { 1.0 } else { size };
        if residuals[r].is_nan() || residuals[r].abs() > MEETS * unit {
            let what = format!("closes {}, which is off by {:.3e} {}", row.name, residuals[r], row.unit());
            return Err((what, "let the event be where it meets"));
        }
    }
    let open = vec![FrictionMode::Open; after.frictions.len()];
    let free = Arc::new(after.clone());
    loop {
        let mechanism = in_modes(&free, held, &open);
        let Some((rates, impulses, work)) = plastic(&mechanism, motion) else {
            return Err(("closes what no rates can follow".into(), "look at the motors beside it"));
        };
        let of_walls = &impulses[mechanism.standing_rows()..];
        let most = impulses.iter().fold(0.0, |most: f64, impulse| most.max(impulse.abs()));
        let pulled = (held.iter().zip(of_walls))
            .filter(|(_, impulse)| **impulse > ROUNDING * most)
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map(|(&contact, _)| contact);
        if let Some(pulled) = pulled {
            held.retain(|&contact| contact != pulled);
            continue;
        }
        motion.omega = rates.into_iter().map(DoubleDouble::from).collect();
        motion.work = motion.work + work;
        return put_on(&mechanism, motion);
    }
}

/// Modes of places with friction where only these contacts are held.
pub(super) fn modes(mechanism: &Mechanism, modes: &[FrictionMode], held: &[usize]) -> Vec<FrictionMode> {
    let mode =
        |(place, &mode): (&crate::dynamics::friction::CompiledFriction, &FrictionMode)| match place.normal {
            Normal::Contact(contact) if !held.contains(&contact) => FrictionMode::Open,
            _ => mode,
        };
    mechanism.frictions.iter().zip(modes).map(mode).collect()
}

/// Refuses walls that are switched on, or moved at once, in front of their points.
fn behind([before, after]: [&Mechanism; 2], motion: &Motion) -> Result<(), (String, &'static str)> {
    let [phi, _] = motion.rounded();
    let changed = before.contacts.iter().zip(&after.contacts).filter(|(before, after)| {
        !after.is_off
            && (before.is_off || (&before.row.law, &before.row.aim) != (&after.row.law, &after.row.aim))
    });
    for (before, contact) in changed {
        let gap = contact.gap(motion.time, &phi, &after.elements(&phi));
        if gap.is_nan() || gap < -BEHIND {
            let what = format!(
                "{} wall {}, behind which its point is by {:.3e} m",
                if before.is_off { "switches on" } else { "moves" },
                contact.row.name,
                -gap * contact.length
            );
            return Err((what, "let the event be while the point is in front of it"));
        }
    }
    Ok(())
}

/// C of every row \[rad, m\].
fn residuals(mechanism: &Mechanism, motion: &Motion) -> Vec<f64> {
    let [phi, omega] = motion.rounded();
    let mut kernel = Kernel::<f64>::new(mechanism);
    kernel.linearise_at::<0>(mechanism, motion.time, &phi, &omega);
    kernel.rows.iter().map(|row| row.position).collect()
}

/// Rates after all rows have taken hold, their impulses, and the work of motors and walls \[J\].
pub(super) fn plastic(mechanism: &Mechanism, motion: &Motion) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    let [phi, omega] = motion.rounded();
    let metric = ContactMetric::at(mechanism, motion.time, &phi, &omega)?;
    let before = metric.velocity(&omega);
    let change = metric.kept(&before) - &before;
    let impulses = metric.multipliers(&-&change);
    let work = impulses.iter().zip(&metric.rows).map(|(impulse, row)| impulse * row.row.drive).sum();
    let rates: Vec<f64> =
        metric.rates(&change).iter().zip(&omega).map(|(change, omega)| omega + change).collect();
    rates.iter().all(|rate| rate.is_finite()).then_some((rates, impulses, work))
}

/// Takes off a motion what the search for the event has left between what closes.
fn put_on(mechanism: &Arc<Mechanism>, motion: &mut Motion) -> Result<(), (String, &'static str)> {
    let mut form = Multiplier::<0, true>::new(Arc::clone(mechanism));
    let mut state = form.state(motion);
    let mut kernel = Kernel::new(mechanism);
    project(mechanism, &mut kernel, &mut state, 1e-13).map_err(|(row, left)| {
        (format!("leaves {left:.1e} of constraint {row}"), "let the event be where all of it meets")
    })?;
    // What it changes in the energy is the event's.
    let stabilizer = motion.stabilizer;
    form.read(&state, motion);
    motion.stabilizer = stabilizer;
    Ok(())
}
