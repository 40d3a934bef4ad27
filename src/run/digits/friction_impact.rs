//! The impact of one point on a wall where there is dry friction, in many digits: Routh's method as in
//! doubles (`dynamics::friction::impact`), in all digits.
//!
//! Friction in hinges and sliders takes no part in impacts: what sticks there may slide after one.  An impact
//! that presses a point which touches another wall at rest, held or not, is one at both where one of them has
//! friction (module `several`).

use super::coordinates::DigitsCoordinates;
use super::evidence::gradient;
use super::friction::SURE;
use super::motion::{DigitsMotion, LongState};
use super::projection::DigitsProjection;
use super::resting;
use super::simultaneous::Meeting;
use super::wall::{GapRate, ImpulseJump, work_of_rows};
use crate::arithmetic::digits::Digits;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::compile::exact::Acting;
use crate::dynamics::friction::impact::Shock;
use crate::dynamics::friction::{CompiledFriction, FrictionMode, Normal};
use crate::dynamics::kernel::dot;
use crate::stepping::{Cause, StepError};

/// Part of the digits that a velocity has to be zero in along a wall that others hold the point along: the
/// place of the impact is as much off.
const HELD_SURE: f64 = 0.5;

/// What the impulses at one wall do.
pub(super) fn alone<const W: usize>(
    motion: &mut DigitsMotion<W>,
    wall: usize,
    gap: &GapRate<W>,
) -> Result<ImpulseJump<W>, StepError> {
    loop {
        let (jump, pulls) = jump(motion, wall, gap)?;
        // A point that its wall would have to pull is let go.
        if let Some(held) = resting::pulled(motion, &pulls, 0.0) {
            motion.release(&[held])?;
            continue;
        }
        let Some(jump) = jump else {
            let name = &motion.mechanism.walls[wall].0.name;
            let what = format!("no impulses fit the law of impact and friction at wall {name}");
            return Err(motion.stop(Cause::Unsuited, 0.0, &what, "lower the coefficient of friction"));
        };
        let (held, standing) = (&motion.state().acting.held, motion.mechanism.structure.standing_rows());
        let rounding = motion.precision.rounding(SURE);
        let is_pressed = |(other, pull): (&usize, &Digits<W>)| {
            *pull < Digits::ZERO
                && pull.log2() > rounding
                && motion.mechanism.structure.friction_at(*other).is_some()
        };
        let is_pressed = held.iter().zip(&pulls[standing..]).any(is_pressed);
        let touching = Meeting::touching(motion, wall);
        return if is_pressed || touching.is_pressed_by(motion, wall, &jump) {
            touching.jump(motion)
        } else {
            Ok(jump)
        };
    }
}

/// A jump, and the impulses of the constraints over that of the wall.
type Jump<const W: usize> = (Option<ImpulseJump<W>>, Vec<Digits<W>>);

/// The jump, and the impulses of the constraints over that of the wall; where no impulses fit, those for a
/// normal impulse alone.
fn jump<const W: usize>(
    motion: &DigitsMotion<W>,
    wall: usize,
    gap: &GapRate<W>,
) -> Result<Jump<W>, StepError> {
    let LongState { t, acting, .. } = motion.state();
    jump_at(motion, (*t, &motion.state_coordinates()), &acting.held, wall, gap)
}

/// The same at another time and other coordinates, while these walls hold points.
pub(super) fn jump_at<const W: usize>(
    motion: &DigitsMotion<W>,
    (t, coordinates): (Digits<W>, &DigitsCoordinates<W>),
    held: &[usize],
    wall: usize,
    GapRate { gradient: normal, travel, rate }: &GapRate<W>,
) -> Result<Jump<W>, StepError> {
    let sliding = vec![FrictionMode::Open; motion.mechanism.frictions.len()];
    let acting = Acting { held: held.to_vec(), sliding, ..motion.state().acting.clone() };
    let striking = motion.mechanism.with(acting);
    let striking = striking.map_err(|error| motion.cannot_go_on(&error, "look at that formula"))?;
    let mut projection = DigitsProjection::new(&striking, motion.precision);
    let at = [&coordinates.phi[..], &coordinates.omega[..]];
    let (response, pulls) = projection.response(&striking, t, at, normal);
    let restitution = motion.mechanism.walls[wall].1;
    let is_here = |friction: &&CompiledFriction<Digits<W>>| friction.normal == Normal::Contact(wall);
    let Some(friction) = motion.mechanism.frictions.iter().find(is_here) else {
        let impulse = -(Digits::ONE + restitution) * *rate / dot(normal, &response);
        let change = response.iter().map(|&a| a * impulse).collect();
        let work = impulse * (*travel + work_of_rows(&striking, t, coordinates, &pulls));
        return Ok((Some(ImpulseJump { change, work, walls: 1 }), pulls));
    };
    let along = gradient(&friction.tangent, &motion.mechanism.elements(&coordinates.phi));
    let (across, pulls_across) = projection.response(&striking, t, at, &along);
    let slides = dot(&along, &coordinates.omega);
    let rounding = Digits::ONE.ldexp(motion.precision.rounding(SURE) as i32);
    let mut still = ((*rate).abs() + slides.abs()) * rounding;
    let [a_nn, mut a_nt, mut a_tt] = [dot(normal, &response), dot(normal, &across), dot(&along, &across)];
    // Where others hold it along its wall, rounding must not say which way it slides.
    if a_tt.abs() <= a_nn * rounding {
        (a_nt, a_tt) = (Digits::ZERO, Digits::ZERO);
        let least = motion.precision.rounding(HELD_SURE) as i32;
        still = ((*rate).abs() + slides.abs()) * Digits::ONE.ldexp(least);
    }
    let apart = (a_nn * a_tt - a_nt * a_nt).abs();
    let shock = Shock {
        response: [a_nn, a_nt, a_tt],
        velocity: [*rate, slides],
        restitution,
        coefficients: [friction.kinetic, friction.stiction],
        is_newton: friction.is_newton,
        one_way: (apart <= a_nn * a_tt * rounding).then_some(rounding),
    };
    let Some([impulse, tangential]) = shock.impulses_beyond(still) else { return Ok((None, pulls)) };
    let change = response.iter().zip(&across).map(|(&a, &b)| a * impulse + b * tangential).collect();
    let ratio = tangential / impulse;
    let pulls: Vec<_> =
        pulls.iter().zip(&pulls_across).map(|(&pull, &across)| pull + across * ratio).collect();
    let work = impulse * (*travel + work_of_rows(&striking, t, coordinates, &pulls));
    Ok((Some(ImpulseJump { change, work, walls: 1 }), pulls))
}
