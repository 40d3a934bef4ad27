//! The check of an impact at several walls at once.
//!
//! ```text
//! at every wall:    gap = 0,  v_n⁺ >= 0,  |p_t| <= mu0 p_n
//! over all walls:   Σ (p_n Δv_n + p_t Δv_t) = 2 D,      energy lost = -Σ (p_n Σv_n + p_t Σv_t) / 2
//! ```
//!
//! With Poisson's law no energy is gained.

use super::{AGREES, Sides, UNMOVED, beyond, closed, gap, slips, unmoved};
use crate::dynamics::friction::simultaneous::Blow;
use crate::dynamics::{Mechanism, Motion};

/// Whether an impact at several walls is what the laws of impact and friction make of the motion before it;
/// else what is wrong.  `energy_lost` \[J\] is what the run books.
pub(in crate::run) fn check_several(
    mechanism: &Mechanism,
    tolerance: f64,
    [before, after]: [&Motion; 2],
    blows: &[Blow],
    energy_lost: f64,
) -> Result<(), String> {
    unmoved(mechanism, UNMOVED, before, after)?;
    let [phi, _] = before.rounded();
    let [drift, slip] = slips(mechanism, before, after)?;
    if beyond(slip, AGREES.max(2.0 * drift)) {
        return Err(format!("another constraint slips by {slip:.2e} of its speed after the impact"));
    }
    let here = Sides::new(mechanism, before, after);
    let scale = here.exchange * (AGREES + 10.0 * drift) + 64.0 * f64::EPSILON * here.energy;
    let fastest = blows.iter().fold(0.0_f64, |most, blow| most.max(blow.normal_rates[0].abs()));
    let (mut doubled, mut lost, mut is_poisson) = (0.0, 0.0, false);
    for blow in blows {
        let contact = &mechanism.contacts[blow.contact];
        let name = contact.row.name();
        let (gap, rounding) = gap(contact, mechanism.bodies.len(), before.time, &phi);
        if beyond(gap.abs(), closed(tolerance) + rounding) {
            return Err(format!("the point is {:.2e} m from wall {name}", gap * contact.length));
        }
        let [(approach, _), (departure, _)] =
            [before, after].map(|motion| contact.normal_velocity(before.time, &here.z, motion));
        let [slid, slides] =
            [before, after].map(|motion| contact.tangential_velocity(&here.z, &motion.omega));
        let step_size = contact.step_size(&after.omega.iter().map(|omega| omega.hi).collect::<Vec<_>>());
        if beyond(-departure, AGREES * fastest + 1e-13 * step_size) {
            return Err(format!("the point goes on into wall {name} at {:.6e} m/s", -departure));
        }
        let friction = mechanism.friction_at(blow.contact);
        is_poisson |= friction.is_some_and(|friction| !friction.is_newton);
        let most = friction.map_or(0.0, |friction| friction.stiction * blow.impulse * (1.0 + AGREES));
        if beyond(blow.tangential.abs(), most) {
            return Err(format!(
                "friction gives {:.6e} N s to {:.6e} N s of wall {name}",
                blow.tangential, blow.impulse
            ));
        }
        doubled += blow.impulse * (departure - approach) + blow.tangential * (slides - slid);
        lost -= 0.5 * (blow.impulse * (departure + approach) + blow.tangential * (slides + slid));
    }
    if beyond((doubled - 2.0 * here.jump).abs(), scale) {
        return Err(format!("impulses and momenta differ by {:.6e} J", doubled - 2.0 * here.jump));
    }
    if is_poisson && beyond(-lost, scale) {
        return Err(format!("{:.6e} J are gained", -lost));
    }
    let work = (after.work - before.work).hi;
    for (name, other) in [("booked", energy_lost), ("kinetic", work - here.gain)] {
        if beyond((other - lost).abs(), scale) {
            return Err(format!("{lost:.6e} J are lost in the impulses, and {other:.6e} J ({name})"));
        }
    }
    Ok(())
}
