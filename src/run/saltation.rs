//! Small differences through an impact, an event that switches parts and branches or sets numbers, and the
//! transitions of dry friction: neighbours come there earlier or later, by the saltation matrix.
//!
//! ```text
//! dt = -(g_q dq + g_w dw + g_p dp) / g',     dq = dq⁻ + q'⁻ dt,   dw = dw⁻ + a⁻ dt      at the zero of g;
//!     w⁺ = I(t, q, w⁻; p)
//! dq⁺ = dq - q'⁺ dt,      dw⁺ = dI(dt, dq, dw, dp) - a⁺ dt
//!     a⁺ with what acts, sticks and is held from then on
//! ds⁺ = dS(dt, dq, dw, dp)
//!     numbers s that an event sets
//! ```
//!
//! g is the gap of a wall, the event function of a switch, or that of a place with friction: the relative
//! velocity of what slides, `(mu0 N)² - tau²` of what sticks.  I is the law of impact, what a joint that
//! closes does to the rates, or what is taken off them where a point comes to rest on a wall.  p are numbers
//! that the mechanism depends on; neighbouring mechanisms tell what they do.  Derivatives along a column are
//! central differences of the fourth order.
//!
//! Source: P. C. Müller, *Calculation of Lyapunov exponents for dynamic systems with discontinuities*, Chaos,
//! Solitons & Fractals 5 (1995).

mod finer;
mod side;
mod together;

pub(super) use finer::{Difference, DistanceLevel, agreeing};
pub(super) use side::Side;

use super::closing::plastic;
use super::contact::{Flight, Jump, Switch, come_to_rest};
use super::event::SwitchFunction;
use super::friction::FrictionWatch;
use crate::dynamics::friction::FrictionMode;
use crate::dynamics::{Mechanism, Motion};
use std::sync::Arc;

/// Normal velocity over that of the point's parts, or over a usual one where these are nearly at rest, below
/// which a wall is grazed, and neighbours may miss it.
const GRAZED: f64 = 1e-7;
/// Share of the mechanism's own time by which the search for a zero is off at most.
const SUDDEN: f64 = 1e-8;
/// Share of the approach that a difference may take off.
const SHARE: f64 = 0.05;

/// A mechanism with other numbers, and its weight in derivatives by what a column stands for; weights of a
/// column add up to zero.
pub(super) type Weighted = (f64, Arc<Mechanism>);

/// Such mechanisms at distances that become finer.
pub(super) type Levels = Vec<DistanceLevel<Weighted>>;

/// The neighbours of a column, by number, as they are after a jump.
type Follow<'a> = dyn Fn(usize, &Jump) -> Result<Levels, String> + 'a;

/// A function of a mechanism and a motion.
type Function<'a> = &'a dyn Fn(&Arc<Mechanism>, &Motion) -> Option<Vec<f64>>;

/// Small differences of all coordinates and rates, beside which the mechanism may be another.
pub(super) struct Delta<'a> {
    /// Coordinates, then rates.
    pub entries: &'a mut [f64],
    pub neighbours: Levels,
}

impl Delta<'_> {
    /// The derivative of what a function tells of the neighbours beside what it tells `here`, where there are
    /// any and it tells of all.
    fn moved(&self, here: &[f64], value: impl Fn(&Arc<Mechanism>) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
        let of = |(weight, neighbour): &Weighted| Some((*weight, value(neighbour)?));
        agreeing(self.neighbours.len(), |level| {
            let DistanceLevel { far, list } = self.neighbours.get(level)?;
            let values: Option<Vec<_>> = list.iter().map(of).collect();
            Some(Difference::of(values?, here, *far))
        })
        .map(|agreed| agreed.slopes)
    }
}

/// What happens at one moment.
pub(super) struct Discontinuity<'a> {
    /// With what acts, sticks and is held before it.
    pub mechanism: &'a Arc<Mechanism>,
    pub jumps: &'a [Jump],
    /// The parameters that events set, by number.
    pub set: &'a [usize],
    /// The neighbours of a column, by number, as they are after a jump.
    pub follow: &'a Follow<'a>,
    /// How much later \[s\] each column comes to what has happened before at this very moment, if anything
    /// has: what a jump makes happen at once, as a sign that an impact turns, comes with it.
    pub earlier: Option<&'a [f64]>,
}

/// What came of it beside the columns.
#[derive(Default)]
pub(super) struct Crossed {
    /// The walls that were met, and how much later \[s\] for each column.
    pub walls: Vec<(usize, Vec<f64>)>,
    /// How much later \[s\] it happens, for each column.
    pub late: Vec<f64>,
    /// Parameters that events set, for each column, where this one sets some.
    pub set: Option<Vec<Vec<f64>>>,
}

/// The parameters that events of a mechanism set, by number.
pub(super) fn set_by_events(mechanism: &Mechanism) -> Vec<usize> {
    let events = mechanism.laws.iter().flat_map(|laws| &laws.formulas.events);
    let mut set: Vec<usize> = events.flat_map(|event| event.parameters()).collect();
    set.sort_unstable();
    set.dedup();
    set
}

/// The motors and locks that have engaged up to now, by row, after another mechanism has followed on one.
pub(super) fn engage(engaged: &mut Vec<usize>, [before, after]: [&Mechanism; 2]) {
    let acts = |mechanism: &Mechanism, r: usize| {
        mechanism.constraints.get(r).is_some_and(|row| !row.coordinates().is_empty())
    };
    engaged.retain(|&r| acts(after, r));
    for r in 0..after.standing_rows() {
        let may = after.switches.clutches.contains(&after.constraints[r].name);
        if may && acts(after, r) && !acts(before, r) && !engaged.contains(&r) {
            engaged.push(r);
        }
    }
}

/// The event function of a mechanism's own event or condition at a motion.
pub(super) fn event_value(mechanism: &Mechanism, at: SwitchFunction, motion: &Motion) -> Option<f64> {
    let laws = mechanism.laws.as_ref()?;
    mechanism.seen(motion, |here| match at {
        SwitchFunction::Event(number) => Some(laws.formulas.event_value(number, here, &laws.parameters)),
        SwitchFunction::Condition(number) => {
            laws.formulas.condition_values(here, &laws.parameters, &laws.modes).get(number).copied()
        }
        SwitchFunction::Other => None,
    })
}

/// The derivative of a function along a column that is there so much later \[s\], with differences of at most
/// `share`.
fn derivative(
    mechanism: &Arc<Mechanism>,
    side: &Side,
    column: &Delta,
    [late, share]: [f64; 2],
    value: Function,
) -> Option<Vec<f64>> {
    let mut sum = side.slope(column.entries, late, share, &mut |motion| value(mechanism, motion))?;
    if !column.neighbours.is_empty() {
        let here = value(mechanism, &side.motion)?;
        let moved = column.moved(&here, |neighbour| value(neighbour, &side.motion))?;
        sum.iter_mut().zip(moved).for_each(|(sum, moved)| *sum += moved);
    }
    Some(sum)
}

/// Takes a column to a moment so much later \[s\].
fn shift(column: &mut [f64], late: f64, side: &Side) {
    let n = side.phi.len();
    for k in 0..n {
        column[k] += late * side.omega[k];
        column[n + k] += late * side.acceleration[k];
    }
}

/// Takes columns through what happens at one moment.
///
/// What is held or let go with it comes earlier or later as well; what is held is put on its wall afterwards.
///
/// # Errors
/// Why neighbours do not go the same way.
pub(super) fn cross(passage: &Discontinuity, columns: &mut [Delta]) -> Result<Crossed, String> {
    let Discontinuity { mechanism, jumps, .. } = *passage;
    if together::is_at_several(jumps) {
        return together::cross(passage, columns);
    }
    let mut passed = Crossed::default();
    let is_cause = |jump: &&Jump| jump.contact.is_some() || jump.switch.is_some() || jump.friction.is_some();
    let (Some(cause), Some(last)) = (jumps.iter().find(is_cause), jumps.last()) else { return Ok(passed) };
    if jumps.iter().filter(|jump| jump.switch.is_some()).count() > 1 {
        return Err(
            "several events happen at once, which neighbouring motions meet one after the other".into()
        );
    }
    let here = Side::new(mechanism, &cause.before);
    let there = Side::new(&last.mechanism, &last.after);
    let late = match cause {
        Jump { contact: Some(contact), .. } => late_at_wall(mechanism, *contact, &here, columns)?,
        Jump { switch: Some(switch), .. } => late_at_switch(passage, switch, &here, columns)?,
        Jump { friction, .. } => late_at_friction(passage, *friction, &here, columns)?,
    };
    for (k, (column, &late)) in columns.iter_mut().zip(&late).enumerate() {
        shift(column.entries, late, &here);
        for jump in jumps {
            if let Some(contact) = jump.contact {
                follow(passage, k, jump, column)?;
                impact_at(jump, contact, late, column)?;
            }
            if let Some(switch) = &jump.switch {
                let before = Side::resting(&jump.mechanism, &jump.before);
                if let Some(set) = set_at(passage, switch, &before, late, column)? {
                    passed.set.get_or_insert_default().push(set);
                }
                if jump.before.omega != jump.after.omega {
                    follow(passage, k, jump, column)?;
                    close_at(jump, late, column)?;
                }
            }
            if is_hold(jump) && jump.before.omega != jump.after.omega {
                follow(passage, k, jump, column)?;
                hold_at(mechanism, jump, late, column)?;
            }
        }
        shift(column.entries, -late, &there);
    }
    passed.walls.extend(cause.contact.map(|contact| (contact, late.clone())));
    passed.late = late;
    Ok(passed)
}

/// Takes the neighbours of a column on to what they are after a jump.
fn follow(passage: &Discontinuity, k: usize, jump: &Jump, column: &mut Delta) -> Result<(), String> {
    if !column.neighbours.is_empty() && !Arc::ptr_eq(&jump.mechanism, passage.mechanism) {
        column.neighbours = (passage.follow)(k, jump)?;
    }
    Ok(())
}

/// How much later \[s\] a point meets its wall, column by column.
fn late_at_wall(
    mechanism: &Mechanism,
    contact: usize,
    here: &Side,
    columns: &[Delta],
) -> Result<Vec<f64>, String> {
    if !mechanism.frictions.is_empty() && !mechanism.held.is_empty() {
        return Err("an impact beside a contact with dry friction is not followed".into());
    }
    let touched = &mechanism.contacts[contact];
    let mut gradient = vec![0.0; here.phi.len()];
    let approach = here.gap_rate(mechanism, contact, &mut gradient);
    let usual = touched.length / mechanism.units.time;
    if approach >= -GRAZED * touched.step_size(&here.omega).max(usual) {
        return Err("a point grazes a wall, which neighbouring motions may miss".into());
    }
    Ok(columns.iter().map(|column| here.late(mechanism, contact, (&gradient, approach), column)).collect())
}

/// How much later \[s\] an event happens that switches parts or branches, column by column.
fn late_at_switch(
    passage: &Discontinuity,
    switch: &Switch,
    here: &Side,
    columns: &[Delta],
) -> Result<Vec<f64>, String> {
    if !switch.keeps_motion {
        return Err("an event from outside sets the motion, which is not followed".into());
    }
    late_with(passage, here, columns, &|mechanism, motion| {
        Some(vec![event_value(mechanism, switch.at, motion)?])
    })
}

/// How much later \[s\] a place with friction begins to stick or to slide, column by column.
fn late_at_friction(
    passage: &Discontinuity,
    place: Option<usize>,
    here: &Side,
    columns: &[Delta],
) -> Result<Vec<f64>, String> {
    let own = FrictionWatch::new(passage.mechanism);
    late_with(passage, here, columns, &|of, motion| {
        let values = match Arc::ptr_eq(of, passage.mechanism) {
            true => own.as_ref()?.values(motion),
            false => FrictionWatch::new(of)?.values(motion),
        };
        Some(vec![*values.get(place?)?])
    })
}

/// How much later \[s\] a function of the motion is zero, or a jump at this moment has taken it across,
/// column by column.
fn late_with(
    passage: &Discontinuity,
    here: &Side,
    columns: &[Delta],
    value: Function,
) -> Result<Vec<f64>, String> {
    let Discontinuity { mechanism, earlier, .. } = *passage;
    if let (Some(earlier), Some(off)) = (earlier, value(mechanism, &here.motion)) {
        let rate = here.slope(&here.ahead(), 1.0, f64::INFINITY, &mut |motion| value(mechanism, motion));
        let passed = rate.map_or(0.0, |rate| SUDDEN * mechanism.units.time * rate[0].abs());
        if off[0].abs() > passed {
            return Ok(earlier.to_vec());
        }
    }
    late_at_zero(mechanism, here, columns, value)
}

/// How much later \[s\] a function of the motion is zero, column by column.
///
/// # Errors
/// Why neighbours may not come there.
pub(super) fn late_at_zero(
    mechanism: &Arc<Mechanism>,
    here: &Side,
    columns: &[Delta],
    value: Function,
) -> Result<Vec<f64>, String> {
    let unknown = "what happens here is not known to the scene";
    let rate = here.slope(&here.ahead(), 1.0, f64::INFINITY, &mut |motion| value(mechanism, motion));
    let rate = rate.ok_or(unknown)?[0];
    if rate == 0.0 || !rate.is_finite() {
        let what = "the rate of an event function is zero at its zero: how that moves is not known";
        return Err(what.into());
    }
    let late = |column: &Delta| {
        let change = derivative(mechanism, here, column, [0.0, f64::INFINITY], value).ok_or(unknown)?;
        Ok(-change[0] / rate)
    };
    columns.iter().map(late).collect()
}

/// What an event, so much later \[s\], sets otherwise along a column; `None` where it sets nothing.
fn set_at(
    passage: &Discontinuity,
    switch: &Switch,
    here: &Side,
    late: f64,
    column: &Delta,
) -> Result<Option<Vec<f64>>, String> {
    let Discontinuity { mechanism, set, .. } = *passage;
    let sets = |event: usize| {
        let events = mechanism.laws.as_ref().map(|laws| &laws.formulas.events);
        events.is_some_and(|events| events[event].parameters().next().is_some())
    };
    let number = match switch.at {
        SwitchFunction::Event(number) if sets(number) => number,
        _ if switch.keeps_parameters => return Ok(None),
        _ => return Err("an event from outside sets parameters, which is not followed".into()),
    };
    let value = |mechanism: &Arc<Mechanism>, motion: &Motion| {
        let laws = mechanism.laws.as_ref()?;
        let after = mechanism.seen(motion, |at| laws.formulas.set_by(number, at, &laws.parameters));
        Some(set.iter().map(|&number| after[number]).collect())
    };
    let slopes = derivative(mechanism, here, column, [late, f64::INFINITY], &value);
    Ok(Some(slopes.ok_or("what an event sets is not known to the scene")?))
}

/// A mechanism that holds these contacts, in which nothing sticks or slides: friction in hinges and sliders
/// takes no part in impacts.
fn striking(mechanism: &Arc<Mechanism>, held: &[usize]) -> Arc<Mechanism> {
    let open = vec![FrictionMode::Open; mechanism.frictions.len()];
    match mechanism.held == held && mechanism.modes == open {
        true => Arc::clone(mechanism),
        false => Arc::new(mechanism.moving(held, &open)),
    }
}

/// The rates of a column after an impact.
fn impact_at(jump: &Jump, contact: usize, late: f64, column: &mut Delta) -> Result<(), String> {
    strike(&striking(&jump.mechanism, &jump.mechanism.held), &jump.before, contact, late, column)
}

/// The rates of a column after an impact at a motion of a mechanism in which nothing sticks or slides.
fn strike(
    mechanism: &Arc<Mechanism>,
    before: &Motion,
    contact: usize,
    late: f64,
    column: &mut Delta,
) -> Result<(), String> {
    let side = Side::resting(mechanism, before);
    let rates = |of: &Arc<Mechanism>, motion: &Motion| {
        let [phi, omega] = motion.rounded();
        let impact = striking(of, &mechanism.held).impact_at(contact, motion.time, &phi, &omega);
        impact.map(|impact| impact.omega)
    };
    // Neighbours must meet the wall as well.
    let share = reach(mechanism, contact, &side, late, column);
    change(mechanism, &side, [late, share], column, &rates)
        .ok_or_else(|| "neighbouring motions have no way back from a wall".into())
}

/// The differences at which the point of a wall still moves along its normal as it does, for a column that is
/// there so much later \[s\].
fn reach(mechanism: &Arc<Mechanism>, contact: usize, side: &Side, late: f64, column: &Delta) -> f64 {
    let speed = |motion: &Motion| {
        Side::resting(mechanism, motion).gap_rate(mechanism, contact, &mut vec![0.0; side.phi.len()])
    };
    let most = column.entries.iter().fold(late.abs(), |most, entry| most.max(entry.abs()));
    let scale = |entry: f64| if most > 0.0 { entry / most } else { 0.0 };
    let unit: Vec<f64> = column.entries.iter().map(|&entry| scale(entry)).collect();
    let faster = side
        .slope(&unit, 0.0, f64::INFINITY, &mut |motion| Some(vec![speed(motion)]))
        .map_or(0.0, |slope| slope[0].abs());
    let size = 1.0 + side.omega.iter().fold(0.0, |most: f64, omega| most.max(omega.abs()));
    SHARE * speed(&side.motion).abs() / (faster * size).max(f64::MIN_POSITIVE)
}

/// The rates of a column after what closes or engages.
fn close_at(jump: &Jump, late: f64, column: &mut Delta) -> Result<(), String> {
    let held = &jump.mechanism.held;
    let closing = striking(&jump.mechanism, held);
    let rates =
        |of: &Arc<Mechanism>, motion: &Motion| plastic(&striking(of, held), motion).map(|(rates, ..)| rates);
    change(&closing, &Side::resting(&jump.mechanism, &jump.before), [late, f64::INFINITY], column, &rates)
        .ok_or_else(|| "what closes leaves neighbouring motions no rates".into())
}

/// True where only what is held or let go changes.
fn is_hold(jump: &Jump) -> bool {
    jump.contact.is_none() && jump.switch.is_none() && jump.friction.is_none()
}

/// The rates of a column after contacts are held, which takes off what speed the last impact has left.
fn hold_at(before: &Mechanism, jump: &Jump, late: f64, column: &mut Delta) -> Result<(), String> {
    let (mechanism, side) = (&jump.mechanism, Side::resting(&jump.mechanism, &jump.before));
    let new: Vec<usize> =
        mechanism.held.iter().copied().filter(|contact| !before.held.contains(contact)).collect();
    // Bounces that are left out matter to friction alone, and neighbours must make them as well.
    let flights = |of: &Mechanism, motion: &Motion| match of.frictions.is_empty() {
        false => Flight::all(of, &new, motion),
        true => Vec::new(),
    };
    let rates = |of: &Arc<Mechanism>, motion: &Motion| {
        let mut after = motion.clone();
        come_to_rest(of, &new, &flights(of, motion), &mut after)?;
        plastic(of, &after).map(|(rates, ..)| rates)
    };
    let share = (flights(mechanism, &jump.before).iter())
        .map(|flight| reach(mechanism, flight.contact, &side, late, column))
        .fold(f64::INFINITY, f64::min);
    change(mechanism, &side, [late, share], column, &rates)
        .ok_or_else(|| "what is held leaves neighbouring motions no rates".into())
}

/// The rates of a column after they have become others.
fn change(
    mechanism: &Arc<Mechanism>,
    side: &Side,
    size: [f64; 2],
    column: &mut Delta,
    rates: Function,
) -> Option<()> {
    let after = derivative(mechanism, side, column, size, rates)?;
    column.entries[side.phi.len()..].copy_from_slice(&after);
    Some(())
}
