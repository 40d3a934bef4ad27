//! Walls met by a motion in many digits: the moment by Newton's iteration on the series of the gap, the jump
//! by Newton's law of impact; at several walls at one moment see module `several`.
//!
//! ```text
//! gap(t) = c + Σ_m t^m (Σ_k Re(conj(g_k) z_k,m) + Σ_jk Σ_l Re(conj(z_j,l) h_jk z_k,m-l) - s_m) = 0
//! w⁺ = w⁻ - (1 + e) (g·w⁻ - s') a / (g·a),   a = response to an impulse along g,   s: travel of the wall
//! ```
//!
//! That there is a zero, and which is the first, is told in doubles ([`search`]): gaps shallower than 1e-12
//! of the length of a contact are not told from touching, but for those that begin so: see module `touch`.

use super::super::contact::DRIVEN;
use super::coordinates::DigitsCoordinates;
use super::first_passage::FirstPassage;
use super::friction_impact;
use super::motion::DigitsMotion;
use super::resting::{self, Released, Unheld};
use super::simultaneous::Meeting;
use super::transitions::ModeChange;
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::compile::exact::ExactMechanism;
use crate::dynamics::constraint::{Aim, ConstraintArguments, ConstraintEquation, RowMeasure};
use crate::dynamics::kernel::dot;
use crate::dynamics::series::{Constants, Series};
use crate::stepping::search::{Crossing, PowerSeries, TOUCH, crossing};
use crate::stepping::{Cause, StepError};
use std::sync::Arc;

/// Part of the digits in which an impact leaves nothing of an approach.
const SURE: f64 = 0.5;
/// Height of a rebound over the length of the contact from which on it is looked for in doubles.
const LEAST_REBOUND: f64 = 1e-9;
/// Newton iterations at most; each doubles the digits, at a zero of higher order it adds a part of one.
const MOST: usize = 1000;

/// What a step ends with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ends {
    /// A point meets this wall.
    Met(usize),
    /// This wall lets its point go, which has stayed on it.
    Let(usize),
    /// It cannot begin: a point that touches this wall, or stays on it, is pressed or pulled otherwise now.
    Rests(usize),
    /// A place with friction begins to do something else.
    Changes(ModeChange),
}

/// What ends a step of so many seconds, and the exact time up to it.
pub fn first<const W: usize>(
    motion: &DigitsMotion<W>,
    step: f64,
) -> Result<Option<(Ends, Digits<W>)>, StepError> {
    let (mut found, mut rests): (Option<(Ends, Digits<W>)>, _) = (None, None);
    let mut comes = |ends: Ends, time: Digits<W>| {
        if found.as_ref().is_none_or(|(_, first)| time < *first) {
            found = Some((ends, time));
        }
    };
    for (wall, ((row, _), powers)) in motion.mechanism.walls.iter().zip(&motion.gaps).enumerate() {
        if powers.is_empty() {
            continue;
        }
        let length = motion.mechanism.structure.contacts[wall].length;
        let shares = in_shares(powers, 1.0 / length, step);
        if is_near(&shares) {
            match resting::passage(motion, wall, powers, step) {
                FirstPassage::Nothing => {}
                FirstPassage::At(time) => comes(Ends::Met(wall), time),
                FirstPassage::Sinks if resting::is_struck(motion, wall, powers) => {
                    comes(Ends::Met(wall), Digits::ZERO);
                }
                FirstPassage::Sinks => rests = rests.or(Some(wall)),
            }
            continue;
        }
        let from = match crossing(&PowerSeries { powers: &shares, end: 1.0 }, 1.0) {
            Crossing::Nothing => continue,
            Crossing::At(share) => share * step,
            Crossing::Inside(_) if shares.get(1).is_some_and(|&slope| slope < 0.0) => 0.0,
            Crossing::Inside(_) => {
                let what = format!("a point is behind wall `{}`", row.name);
                let hint = "state the walls and the start so that no point is behind its wall";
                return Err(motion.stop(Cause::Unsuited, 0.0, &what, hint));
            }
        };
        comes(Ends::Met(wall), refined(motion, powers, Digits::of(from)));
    }
    for (place, &wall) in motion.state().acting.held.iter().enumerate() {
        match resting::pressure_ends(motion, place, step) {
            Released::Not => {}
            Released::After(time) => comes(Ends::Let(wall), time),
            Released::Pulled => rests = rests.or(Some(wall)),
        }
    }
    Ok(match rests {
        // What strikes does so first.
        Some(wall) if found.is_none_or(|(_, time)| time > Digits::ZERO) => {
            Some((Ends::Rests(wall), Digits::ZERO))
        }
        _ => found,
    })
}

/// True where a gap, in lengths of its contact and shares of a step, begins at zero and may not leave the
/// neighbourhood of zero at once.
fn is_near(shares: &[f64]) -> bool {
    let of = |m: usize| shares.get(m).copied().unwrap_or(0.0);
    let bounces = of(1) > 0.0 && of(1) * of(1) > 4.0 * LEAST_REBOUND * of(2).abs();
    of(0).abs() <= TOUCH && !bounces
}

/// A power series in seconds, times a factor, as one in shares of a step in doubles.
pub(super) fn in_shares<const W: usize>(powers: &[Digits<W>], factor: f64, step: f64) -> Vec<f64> {
    let (mut scale, step) = (Digits::of(factor), Digits::of(step));
    let share = |power: &Digits<W>| {
        let share = (*power * scale).value();
        scale = scale * step;
        share
    };
    powers.iter().map(share).collect()
}

/// Powers of the gaps of walls that may be met in a motion where its series is; none of the others.
pub(super) fn gaps<const W: usize>(motion: &DigitsMotion<W>) -> Vec<Vec<Digits<W>>> {
    let of_wall = |(wall, (row, _)): (usize, &(ConstraintEquation<Digits<W>>, Digits<W>))| {
        let is_met = !motion.is_off(row) && !motion.state.acting.held.contains(&wall);
        if is_met { gap(&motion.series, motion.state.t, row) } else { Vec::new() }
    };
    motion.mechanism.walls.iter().enumerate().map(of_wall).collect()
}

/// Powers of the gap of a wall \[m/s^m\] in a motion from this time on.
pub(super) fn gap<const W: usize>(
    series: &Series<Digits<W>>,
    t: Digits<W>,
    row: &ConstraintEquation<Digits<W>>,
) -> Vec<Digits<W>> {
    let RowMeasure::Place(place) = &row.measure else { return Vec::new() };
    let elements: Vec<&[Complex<Digits<W>>]> = series.z.chunks_exact(series.elements()).collect();
    let linear =
        |z: &&[Complex<Digits<W>>]| place.linear.iter().fold(Digits::ZERO, |sum, &(k, g)| sum + g.dot(z[k]));
    let mut powers: Vec<_> = elements.iter().map(linear).collect();
    for &(j, k, h) in &place.bilinear {
        let turned: Vec<_> = elements.iter().map(|z| h * z[k]).collect();
        for (m, power) in powers.iter_mut().enumerate() {
            *power = (0..=m).fold(*power, |sum, l| sum + elements[l][j].dot(turned[m - l]));
        }
    }
    if let Some(first) = powers.first_mut() {
        *first += place.constant;
    }
    if let Some(law) = &row.law {
        let mut rates = vec![Digits::ZERO; powers.len()];
        Digits::add_law(law, 1.0, t, &mut rates, 0, 1);
        for (m, power) in powers.iter_mut().enumerate() {
            *power -= match m.checked_sub(1) {
                None => Digits::law_value(law, t),
                Some(before) => rates[before].over_whole(m as u64),
            };
        }
    }
    if let Some(aim) = &row.aim {
        let moved = series.aim(aim);
        powers.iter_mut().zip(moved).for_each(|(power, moved)| *power -= moved);
    }
    powers
}

/// The gap of a wall at the state \[m\].
pub(super) fn distance<const W: usize>(
    motion: &DigitsMotion<W>,
    row: &ConstraintEquation<Digits<W>>,
) -> Digits<W> {
    let (t, coordinates) = (motion.state.t, motion.state_coordinates());
    let z = motion.mechanism.elements(&coordinates.phi);
    let travel = row.law.as_ref().map_or(Digits::ZERO, |law| Digits::law_value(law, t));
    let at = ConstraintArguments { phi: &coordinates.phi, z: &z, omega: &[] };
    let aim = |aim: &Arc<Aim<Digits<W>>>| aim.at(t, at, |slots| slots[aim.value as usize]);
    row.gap(&z) - travel - row.aim.as_ref().map_or(Digits::ZERO, aim)
}

/// How fast a wall moves along its normal, or a motor, but for what its formula says of the state \[m/s,
/// rad/s\].
pub(super) fn travel_rate<const W: usize>(
    row: &ConstraintEquation<Digits<W>>,
    t: Digits<W>,
    at: ConstraintArguments<Digits<W>>,
) -> Digits<W> {
    let rate = row.law.as_ref().map_or(Digits::ZERO, |law| Digits::phase(law, t).rate);
    let aim = |aim: &Arc<Aim<Digits<W>>>| aim.at(t, at, |slots| slots[aim.drive as usize]);
    rate + row.aim.as_ref().map_or(Digits::ZERO, aim)
}

/// The zero of a polynomial near a time, as far as its digits tell.
pub(super) fn refined<const W: usize>(
    motion: &DigitsMotion<W>,
    powers: &[Digits<W>],
    mut t: Digits<W>,
) -> Digits<W> {
    let limbs = motion.precision.limbs;
    t = t.shortened(limbs);
    let mut moved = f64::INFINITY;
    for _ in 0..MOST {
        let (mut value, mut slope) = (Digits::ZERO, Digits::ZERO);
        for power in powers.iter().rev() {
            slope = (slope * t + value).shortened(limbs);
            value = (value * t).shortened(limbs) + power.shortened(limbs);
        }
        let change = value / slope;
        let size = change.log2();
        if size.is_nan() || size >= moved {
            break;
        }
        (t, moved) = (t - change, size);
    }
    t.shortened(limbs)
}

/// The jump of the rates at a wall, and at all others that are met at the same moment.
pub fn impact<const W: usize>(motion: &mut DigitsMotion<W>, wall: usize) -> Result<(), StepError> {
    let gap = gap_rate(motion, wall);
    let approach = gap.rate;
    let several = Meeting::at(motion, wall);
    if several.is_none() && approach >= Digits::ZERO {
        return Ok(());
    }
    if approach < Digits::ZERO && !has_way_back(motion, wall, &gap, several.is_some())? {
        return Err(no_way_back(motion, wall));
    }
    let jump = match several {
        Some(meeting) => meeting.jump(motion)?,
        None if motion.has_friction() => friction_impact::alone(motion, wall, &gap)?,
        None => loop {
            let (jump, pulls) = alone(motion, wall, &gap);
            // A point that its wall would have to pull is let go.
            match resting::pulled(motion, &pulls, 0.0) {
                Some(held) => motion.let_go(&[held])?,
                None => break jump,
            }
        },
    };
    jumped(motion, &jump);
    motion.let_leaving_go()?;
    motion.settle_modes_again()?;
    // What motors drive there no impulse turns back.
    let after = gap_rate(motion, wall).rate;
    let is_left = after < Digits::ZERO && (after / approach).log2() > motion.precision.rounding(SURE);
    if is_left || !after.is_finite() {
        return Err(no_way_back(motion, wall));
    }
    Ok(())
}

/// True where an impulse turns a point back that meets its wall, points let go that others would have to
/// pull; among several walls only points that are not at rest along their normals are looked at.
fn has_way_back<const W: usize>(
    motion: &mut DigitsMotion<W>,
    wall: usize,
    gap: &GapRate<W>,
    is_among_several: bool,
) -> Result<bool, StepError> {
    let structure = &motion.mechanism.structure;
    let unit = libm::log2(structure.contacts[wall].length) - libm::log2(structure.units.time);
    if is_among_several && gap.rate.log2() - unit <= motion.precision.rounding(SURE) {
        return Ok(true);
    }
    let coordinates = motion.state_coordinates();
    let at = [&coordinates.phi[..], &coordinates.omega[..]];
    loop {
        // Of several walls those that hold points press as well.
        let Unheld { mechanism, mut projection } =
            if is_among_several { Unheld::of(motion) } else { Unheld::but_held(motion) }?;
        let (response, pulls) = projection.response(&mechanism, motion.state.t, at, &gap.gradient);
        if !response.iter().all(Digits::is_zero) {
            return Ok(true);
        }
        match resting::pulled(motion, &pulls, 0.0).filter(|_| !is_among_several) {
            Some(held) => motion.let_go(&[held])?,
            None => return Ok(false),
        }
    }
}

/// An error where no impulse turns a point back.
fn no_way_back<const W: usize>(motion: &DigitsMotion<W>, wall: usize) -> StepError {
    let name = &motion.mechanism.walls[wall].0.name;
    let what = format!("the constraints leave a point that meets wall {name} no way back");
    motion.stop(Cause::RestingContact, 0.0, &what, DRIVEN)
}

/// Gradient of the gap of a wall by all coordinates, how fast the wall moves, and the rate of the gap
/// \[m/s\].
pub(super) fn gap_rate<const W: usize>(motion: &DigitsMotion<W>, wall: usize) -> GapRate<W> {
    gap_rate_at(motion, wall, motion.state.t, &motion.state_coordinates())
}

/// The same at another time and other coordinates.
pub(super) fn gap_rate_at<const W: usize>(
    motion: &DigitsMotion<W>,
    wall: usize,
    t: Digits<W>,
    coordinates: &DigitsCoordinates<W>,
) -> GapRate<W> {
    let z = motion.mechanism.elements(&coordinates.phi);
    let row = &motion.mechanism.walls[wall].0;
    let mut gradient = vec![Digits::ZERO; coordinates.phi.len()];
    if let RowMeasure::Place(place) = &row.measure {
        place.slopes(&z, |k, slope| gradient[k] += slope);
    }
    let at = ConstraintArguments { phi: &coordinates.phi, z: &z, omega: &coordinates.omega };
    if let Some(aim) = &row.aim {
        let slopes = aim.slopes.iter();
        aim.at(t, at, |slots| slopes.for_each(|&(k, slope)| gradient[k] -= slots[slope as usize]));
    }
    let travel = travel_rate(row, t, at);
    let rate = dot(&gradient, &coordinates.omega) - travel;
    GapRate { gradient, travel, rate }
}

/// How the gap of a wall changes.
pub(super) struct GapRate<const W: usize> {
    /// Its gradient by all coordinates.
    pub gradient: Vec<Digits<W>>,
    /// How fast the wall moves along its normal by itself \[m/s\].
    pub travel: Digits<W>,
    /// Its rate \[m/s\].
    pub rate: Digits<W>,
}

/// What the impulse of one wall does, and the impulses of the constraints for one of it.
fn alone<const W: usize>(
    motion: &mut DigitsMotion<W>,
    wall: usize,
    GapRate { gradient, travel, rate }: &GapRate<W>,
) -> (ImpulseJump<W>, Vec<Digits<W>>) {
    let (t, coordinates) = (motion.state.t, motion.state_coordinates());
    let at = [&coordinates.phi[..], &coordinates.omega[..]];
    let (response, pulls) = motion.projection.response(&motion.mechanism, t, at, gradient);
    let restitution = motion.mechanism.walls[wall].1;
    let impulse = -(Digits::ONE + restitution) * *rate / dot(gradient, &response);
    let change = response.iter().map(|&a| a * impulse).collect();
    let work = impulse * (*travel + work_of_rows(&motion.mechanism, t, &coordinates, &pulls));
    (ImpulseJump { change, work, walls: 1 }, pulls)
}

/// Work \[J\] of motors, and of walls that hold a point, which hold their rates, by these impulses of the
/// constraints.
pub(super) fn work_of_rows<const W: usize>(
    mechanism: &ExactMechanism<Digits<W>>,
    t: Digits<W>,
    coordinates: &DigitsCoordinates<W>,
    impulses: &[Digits<W>],
) -> Digits<W> {
    let z = mechanism.elements(&coordinates.phi);
    let at = ConstraintArguments { phi: &coordinates.phi, z: &z, omega: &coordinates.omega };
    let rows = mechanism.constraints.iter().zip(impulses);
    rows.fold(Digits::ZERO, |work, (row, &impulse)| work - impulse * travel_rate(row, t, at))
}

/// What impulses do at one moment.
pub(super) struct ImpulseJump<const W: usize> {
    /// Change of the rates of all coordinates.
    pub change: Vec<Digits<W>>,
    /// Work of motors and of walls that move \[J\].
    pub work: Digits<W>,
    /// Walls that press.
    pub walls: u64,
}

/// Changes the rates of all coordinates by impulses.
fn jumped<const W: usize>(
    motion: &mut DigitsMotion<W>,
    ImpulseJump { change, work, walls }: &ImpulseJump<W>,
) {
    let (coordinates, limbs) = (motion.state_coordinates(), motion.precision.limbs);
    let (phi, omega) = (&coordinates.phi, &coordinates.omega);
    let z = motion.mechanism.elements(phi);
    let after: Vec<_> = omega.iter().zip(change).map(|(&w, &change)| (w + change).shortened(limbs)).collect();
    let energy = |omega: &[Digits<W>]| {
        let [kinetic, potential] = motion.mechanism.energy(phi, omega, &z);
        kinetic + potential
    };
    motion.state.jump_energy += energy(&after) - energy(omega) - *work;
    motion.state.work += *work;
    let independent = motion.mechanism.partition.independent.clone();
    let has_all = motion.state.rate.len() == phi.len();
    for (c, rate) in motion.state.rate.iter_mut().enumerate() {
        let k = if has_all { c } else { independent[c] };
        *rate += after[k] - omega[k];
    }
    motion.state.impacts += *walls;
    // The next series is another one.
    motion.state.radius = None;
}
