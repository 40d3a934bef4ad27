//! Checks every impact from positions and rates on both sides, and that no wall is passed between impacts.
//!
//! ```text
//! positions unchanged;   gap = 0;   v_n⁺ = -e v_n⁻;   rates of the other constraints as before or zero
//! D = Σ (m |Δv|² + J Δω²) / 2 over the bodies:      impulse (1+e) |v_n⁻| = 2 D,
//!     energy lost = D (1-e) / (1+e)
//! ```
//!
//! With dry friction at the wall, p_t being its impulse: `p_n Δv_n + p_t Δv_t = 2 D`, energy lost
//! `-(p_n Σv_n + p_t Σv_t) / 2`, sums over both sides.
//!
//! The last line is Kelvin's and Carnot's theorem on impulses along one normal; the motors' impulsive work,
//! which is accounted for, is not in it. Velocities are those of the centres of mass, walked from body to
//! body; the mass matrix, in whose terms impacts are found, is not used. Source: E. T. Whittaker, *A Treatise
//! on the Analytical Dynamics of Particles and Rigid Bodies*, 4th ed. (1937), sections 106 to 108.

mod several;

pub(super) use several::check_several;

use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::constraint::{ConstraintArguments, RowMeasure};
use crate::dynamics::contact::scale::magnitudes;
use crate::dynamics::forest::BodyOrigin;
use crate::dynamics::impact::{AWAY, Contact};
use crate::dynamics::{Mechanism, Motion, Time};

/// Energies, velocities and rates that agree to this share of the magnitudes they are made of agree.
const AGREES: f64 = 1e-9;
/// Change of a coordinate \[rad\], or over the size of the mechanism and its own magnitude, that is rounding.
const UNMOVED: f64 = 1e-12;
/// A gap that counts as zero, over the length of its contact, at least.
const CLOSED: f64 = 1e-9;

/// What an impact claims to have done.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    /// The contact.
    pub contact: usize,
    /// Impulse along the normal \[N·s\].
    pub impulse: f64,
    /// Impulse of friction along the wall, the normal turned clockwise \[N·s\].
    pub tangential: f64,
    /// Energy lost \[J\].
    pub energy_lost: f64,
}

/// The gap that counts as zero over the length of a contact, for a method of this relative tolerance:
/// projections move the end of a step by as much.
pub(super) fn closed(tolerance: f64) -> f64 {
    CLOSED.max(100.0 * tolerance)
}

/// The gap of a wall over the length of its contact, and its rounding, in doubles.
pub(super) fn gap(contact: &Contact, angles: usize, t: Time, phi: &[f64]) -> (f64, f64) {
    if contact.is_off {
        return (AWAY, 0.0);
    }
    let z = elements(angles, phi);
    let moved = contact.travel(t, phi, &z).unwrap_or(0.0);
    let rounding = 16.0 * f64::EPSILON * (magnitudes(&contact.row, &z) + moved.abs()) / contact.length;
    let reach = contact.facing(contact.normal, &z).dot(contact.point.position(&z));
    let offset = if contact.on.is_some() { 0.0 } else { offset(contact) };
    ((reach - offset - moved) / contact.length, rounding)
}

/// The rate of that gap \[1/s\].
pub(super) fn gap_rate(contact: &Contact, angles: usize, t: Time, phi: &[f64], omega: &[f64]) -> f64 {
    if contact.is_off {
        return 0.0;
    }
    let z = elements(angles, phi);
    let own = contact.travel_rate(t, phi, &z, omega).unwrap_or(0.0);
    (contact.velocity(contact.normal, &z, omega) - own) / contact.length
}

/// The largest speed of a motion \[m/s\], of angles at this lever \[m\]: an impact solves for all at once,
/// and leaves rounding of it in each.
fn fastest(mechanism: &Mechanism, lever: f64, motion: &Motion) -> f64 {
    let angles = mechanism.bodies.len();
    let speed = |(k, rate): (usize, &DoubleDouble)| rate.hi.abs() * if k < angles { lever } else { 1.0 };
    motion.omega.iter().enumerate().map(speed).fold(0.0, f64::max)
}

/// Whether an impact is what Newton's law of impact makes of the motion before it; else what is wrong.
pub(super) fn check(
    mechanism: &Mechanism,
    tolerance: f64,
    before: &Motion,
    after: &Motion,
    claim: &Claim,
) -> Result<(), String> {
    unmoved(mechanism, UNMOVED, before, after)?;
    let contact = &mechanism.contacts[claim.contact];
    let [phi, _] = before.rounded();
    let (gap, rounding) = gap(contact, mechanism.bodies.len(), before.time, &phi);
    if beyond(gap.abs(), closed(tolerance) + rounding) {
        return Err(format!("the point is {:.2e} m from the wall at the impact", gap * contact.length));
    }
    let (here, slips) = (Sides::new(mechanism, before, after), slips(mechanism, before, after));
    let [(approach, own), (departure, _)] =
        [before, after].map(|motion| contact.normal_velocity(before.time, &here.z, motion));
    let step_size =
        own.abs() + contact.step_size(&before.omega.iter().map(|omega| omega.hi).collect::<Vec<_>>());
    let friction = mechanism.friction_at(claim.contact);
    let is_poisson = friction.is_some_and(|friction| !friction.is_newton);
    let speed_error = departure + contact.restitution * approach;
    // With friction the impulse is known to Poisson's law, not the velocity.
    let speed_error = if is_poisson { departure.min(0.0) } else { speed_error };
    let rounding = 16.0 * f64::EPSILON * fastest(mechanism, contact.length, before);
    if beyond(speed_error.abs(), AGREES * approach.abs() + 1e-13 * step_size + rounding) {
        return Err(format!(
            "the point leaves at {departure:.6e} m/s after an approach at {:.6e} m/s",
            -approach
        ));
    }
    let [drift, slip] = slips?;
    if beyond(slip, AGREES.max(2.0 * drift)) {
        return Err(format!("another constraint slips by {slip:.2e} of its speed after the impact"));
    }
    // What constraints had drifted apart by is put right with the impact.
    let scale = here.exchange * (AGREES + 10.0 * drift) + 64.0 * f64::EPSILON * here.energy;
    let (e, jump) = (contact.restitution, here.jump);
    let [slid, slides] =
        [&before.omega, &after.omega].map(|omega| contact.tangential_velocity(&here.z, omega));
    let tangential = claim.tangential;
    if beyond(
        tangential.abs(),
        friction.map_or(0.0, |friction| friction.stiction * claim.impulse * (1.0 + AGREES)),
    ) {
        return Err(format!("friction gives {tangential:.6e} N s to {:.6e} N s of the wall", claim.impulse));
    }
    let work_error = claim.impulse * (departure - approach) + tangential * (slides - slid) - 2.0 * jump;
    if beyond(work_error.abs(), scale) {
        return Err(format!(
            "the impulse is {:.6e} N s, and momenta change as by {:.6e} N s",
            claim.impulse,
            (2.0 * jump - tangential * (slides - slid)) / (departure - approach)
        ));
    }
    let lost = match friction {
        None => jump * (1.0 - e) / (1.0 + e),
        Some(_) => -0.5 * (claim.impulse * (departure + approach) + tangential * (slides + slid)),
    };
    if is_poisson && beyond(-lost, scale) {
        return Err(format!("{:.6e} J are gained", -lost));
    }
    if beyond((claim.energy_lost - lost).abs(), scale) {
        return Err(format!("{:.6e} J are lost, and restitution {e} loses {lost:.6e} J", claim.energy_lost));
    }
    let work = (after.work - before.work).hi;
    if beyond((here.gain - work + lost).abs(), scale) {
        return Err(format!(
            "kinetic energy changes by {:.6e} J, with {work:.6e} J of the motors and {lost:.6e} J lost",
            here.gain
        ));
    }
    Ok(())
}

/// Whether the first moment of a run is its start; else what is not as it was given.
pub(super) fn is_start(
    mechanism: &Mechanism,
    start: &Motion,
    first: &Motion,
    keeps_rates: bool,
) -> Result<(), String> {
    unmoved(mechanism, AGREES, start, first)?;
    let angles = mechanism.bodies.len();
    let fastest = |range: &[DoubleDouble]| range.iter().fold(0.0f64, |most, omega| most.max(omega.hi.abs()));
    let (turning, moving) = start.omega.split_at(angles);
    let step_size = [fastest(turning), fastest(moving)];
    let differs = |&k: &usize| {
        beyond(
            (first.omega[k] - start.omega[k]).hi.abs(),
            AGREES * step_size[usize::from(k >= angles)].max(1e-12 * step_size[0].max(step_size[1])),
        )
    };
    match (0..start.omega.len()).filter(|_| keeps_rates).find(differs) {
        Some(k) => Err(format!(
            "the rate of {} is {} and not {}",
            mechanism.coordinate_name(k),
            first.omega[k].hi,
            start.omega[k].hi
        )),
        None => Ok(()),
    }
}

/// Whether every coordinate is the same on both sides; else which one moved.
fn unmoved(mechanism: &Mechanism, share: f64, before: &Motion, after: &Motion) -> Result<(), String> {
    let (size, angles) = (mechanism.size_of_parts(), mechanism.bodies.len());
    for (k, (one, other)) in before.phi.iter().zip(&after.phi).enumerate() {
        let turns =
            before.turns.get(k).zip(after.turns.get(k)).map_or(0.0, |(one, other)| (other - one) as f64);
        let moved = (*other - *one + DoubleDouble::TAU.scale(turns)).hi;
        let unit = if k < angles { 1.0 + one.hi.abs() } else { size + one.hi.abs() };
        if beyond(moved.abs(), share * unit) {
            return Err(format!("{} changed by {moved:.2e} at once", mechanism.coordinate_name(k)));
        }
    }
    Ok(())
}

/// True where a magnitude is beyond a bound, or no number.
fn beyond(value: f64, bound: f64) -> bool {
    value.is_nan() || value > bound
}

/// n·through of a wall \[m\].
fn offset(contact: &Contact) -> f64 {
    let RowMeasure::Place(place) = &contact.row.measure else { return 0.0 };
    contact.normal.dot(contact.point.root) - place.constant
}

fn elements<T: Scalar>(angles: usize, phi: &[T]) -> Vec<Complex<T>> {
    let place = |k: usize| {
        if (k - angles).is_multiple_of(2) { Complex::new(phi[k], phi[k + 1]) } else { Complex::ZERO }
    };
    (0..phi.len()).map(|k| if k < angles { Complex::unit(phi[k]) } else { place(k) }).collect()
}

impl Contact {
    /// Velocity of the point along the normal, seen from the wall, and that of the wall \[m/s\].
    fn normal_velocity(&self, t: Time, z: &[Complex<DoubleDouble>], motion: &Motion) -> (f64, f64) {
        let [phi, omega] = motion.rounded();
        let plain = elements(self.angles(), &phi);
        let own = self.travel_rate(t, &phi, &plain, &omega).unwrap_or(0.0);
        (self.velocity(self.normal, z, &motion.omega).hi - own, own)
    }

    /// The same along the wall, the normal turned clockwise.
    fn tangential_velocity(&self, z: &[Complex<DoubleDouble>], omega: &[DoubleDouble]) -> f64 {
        self.velocity(-self.normal.left(), z, omega).hi
    }

    /// Where a direction of the wall's frame points to.
    fn facing<T: Scalar>(&self, direction: Complex<f64>, z: &[Complex<T>]) -> Complex<T> {
        self.on.map_or(Complex::of(direction), |body| z[body].turn(direction))
    }

    /// Velocity of the point along a direction of the wall's frame, seen from what carries the wall \[m/s\].
    fn velocity<T: Scalar>(&self, direction: Complex<f64>, z: &[Complex<T>], omega: &[T]) -> T {
        let facing = self.facing(direction, z);
        let own = facing.dot(self.point.velocity(z, omega));
        self.on.map_or(own, |body| own + facing.left().dot(self.point.position(z)) * omega[body])
    }

    /// Angles of the mechanism; translational coordinates come after them.
    fn angles(&self) -> usize {
        let RowMeasure::Place(place) = &self.row.measure else { return 0 };
        place.angles
    }
}

/// The bodies on both sides of an impact.
struct Sides {
    z: Vec<Complex<DoubleDouble>>,
    /// Kinetic energy of the change of all velocities \[J\].
    jump: f64,
    /// Change of the kinetic energy \[J\].
    gain: f64,
    /// The sum of the magnitudes that change is made of \[J\].
    exchange: f64,
    /// Kinetic energy on both sides \[J\]: rates are rounded.
    energy: f64,
}

impl Sides {
    fn new(mechanism: &Mechanism, before: &Motion, after: &Motion) -> Self {
        let z = elements(mechanism.bodies.len(), &before.phi);
        let velocities = [before, after].map(|motion| centre_velocities(mechanism, &z, &motion.omega));
        let (mut jump, mut gain, mut exchange, mut energy) =
            (DoubleDouble::ZERO, DoubleDouble::ZERO, 0.0, 0.0);
        for (k, body) in mechanism.bodies.iter().enumerate() {
            let ([v, w], [turn, turned]) =
                ([velocities[0][k], velocities[1][k]], [before.omega[k], after.omega[k]]);
            let (change, sum) = (w - v, w + v);
            let (spin, spins) = (turned - turn, turned + turn);
            jump += change.norm_squared().scale(0.5 * body.mass) + (spin * spin).scale(0.5 * body.inertia);
            gain += change.dot(sum).scale(0.5 * body.mass) + (spin * spins).scale(0.5 * body.inertia);
            energy += 0.5
                * (body.mass * (v.norm_squared() + w.norm_squared()).hi
                    + body.inertia * (turn * turn + turned * turned).hi);
            let size = |v: Complex<DoubleDouble>| v.norm_squared().hi.sqrt();
            exchange += 0.5
                * (body.mass * size(change) * (size(v) + size(w))
                    + body.inertia * spin.hi.abs() * (turn.hi.abs() + turned.hi.abs()));
        }
        Self { z, jump: jump.hi, gain: gain.hi, exchange, energy }
    }
}

/// Velocities of the centres of mass, from body to body \[m/s\].
fn centre_velocities(
    mechanism: &Mechanism,
    z: &[Complex<DoubleDouble>],
    omega: &[DoubleDouble],
) -> Vec<Complex<DoubleDouble>> {
    let mut translations = vec![Complex::<DoubleDouble>::ZERO; mechanism.bodies.len()];
    for &k in &mechanism.forest.order {
        translations[k] = match mechanism.forest.hangs[k].origin_point {
            BodyOrigin::Ground(_) => Complex::ZERO,
            BodyOrigin::On(parent, arm) => {
                translations[parent] + z[parent].turn(arm).left().times(omega[parent])
            }
            BodyOrigin::Free(x) => Complex::new(omega[x], omega[x + 1]),
        };
    }
    let arm = |k: usize| z[k].turn(mechanism.bodies[k].centre).left().times(omega[k]);
    translations.iter().enumerate().map(|(k, &origin_point)| origin_point + arm(k)).collect()
}

/// The worst rate of the constraints before and after, each over the magnitudes it would be made of if all of
/// the mechanism moved as fast as the fastest of it.
fn slips(mechanism: &Mechanism, before: &Motion, after: &Motion) -> Result<[f64; 2], String> {
    let (angles, length) = (mechanism.bodies.len(), mechanism.size_of_parts());
    let z = elements(angles, &before.phi);
    let fastest = |range: std::ops::Range<usize>| {
        [before, after]
            .iter()
            .flat_map(|motion| &motion.omega[range.clone()])
            .fold(0.0f64, |most, omega| most.max(omega.hi.abs()))
    };
    let (turning, moving) = (fastest(0..angles), fastest(angles..before.omega.len()));
    // Impacts are solved for with all rates at once, and rounded to those.
    let turning = turning.max(moving / length);
    let moving = moving.max(turning * length);
    let mut worst = [0.0f64; 2];
    for row in &mechanism.constraints {
        let mut jacobian = vec![DoubleDouble::ZERO; before.phi.len()];
        let here = row.differentiate(
            before.time,
            ConstraintArguments { phi: &before.phi, z: &z, omega: &before.omega },
            &mut jacobian,
        );
        let sides = [before, after].map(|motion| {
            let rate = jacobian.iter().zip(&motion.omega).fold(here.drive, |rate, (&g, &w)| rate + g * w);
            rate.hi.abs()
        });
        let size = (jacobian.iter().enumerate()).fold(here.drive.hi.abs(), |size, (k, g)| {
            size + g.hi.abs() * if k < angles { turning } else { moving }
        });
        for (worst, rate) in worst.iter_mut().zip(sides) {
            if !rate.is_finite() {
                return Err(format!("the rate of {} is not finite", row.name()));
            }
            *worst = if size > 0.0 { worst.max(rate / size) } else { *worst };
        }
    }
    Ok(worst)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse_scene;

    /// A motion just before its impact.
    fn met(scene: &str) -> (Mechanism, Motion) {
        let scene = parse_scene(scene, "test", &[]).expect("a scene");
        let mechanism = Mechanism::new(&scene).expect("a mechanism");
        let start = mechanism.start(&scene);
        (mechanism, start)
    }

    /// The motion after it as the impact code has it, and what it claims.
    fn struck(mechanism: &Mechanism, before: &Motion) -> (Motion, Claim) {
        let [phi, omega] = before.rounded();
        let impact = mechanism.impact_at(0, before.time, &phi, &omega).expect("a rebound");
        let omega = impact.omega.iter().map(|&omega| DoubleDouble::from(omega)).collect();
        let after = Motion { omega, work: before.work + impact.motor_work, ..before.clone() };
        (
            after,
            Claim {
                contact: 0,
                impulse: impact.impulse,
                tangential: impact.tangential,
                energy_lost: impact.motor_work - impact.energy_change,
            },
        )
    }

    /// A rod that falls on its lower end, and a cart that carries a driven arm against a stop.
    const SCENES: [&str; 2] = [
        r#"{"name": "rod", "gravity": [0, -9.81], "bars": [{"name": "rod", "mass": 2, "centre": [0.5, 0],
         "inertia": 0.2, "length": 1}],
            "walls": [{"name": "floor", "body": "rod", "point": [0, 0], "line": {"through": [0, 0],
             "normal": [0, 1]}, "restitution": 0.6}],
            "start": {"rod": {"phi": 0.4, "omega": 1.1, "origin": [3, 0], "velocity": [0.3, -2]}}, "until": 1,
             "every": 1}"#,
        r#"{"name": "cart", "gravity": [0, -9.81], "bars": [{"name": "cart", "mass": 2, "centre": [0, 0],
         "inertia": 0.1, "length": 0.1},
                {"name": "arm", "mass": 0.5, "centre": [0.3, 0], "inertia": 0.02, "length": 0.6}],
            "hinges": [{"name": "H", "between": [{"body": "cart", "point": [0, 0]}, {"body": "arm",
             "point": [0, 0]}]}],
            "sliders": [{"name": "rail", "point": {"body": "cart", "point": [0, 0]},
                "rail": {"body": "ground", "point": [0, 0], "direction": [1, 0]}, "angle": "locked"}],
            "motors": [{"name": "motor", "body": "arm", "law": {"start": 0.7, "rate": -3}}],
            "walls": [{"name": "stop", "body": "arm", "point": [0.6, 0],
                "line": {"through": [0.4589053124, 0], "normal": [-1, 0]}, "restitution": 0.3}],
            "start": {"cart": {"phi": 0, "origin": [0, 0], "velocity": [1, 0]}}, "until": 1, "every": 1}"#,
    ];

    #[test]
    fn right_impacts_pass_and_wrong_ones_do_not() {
        for scene in SCENES {
            let (mechanism, before) = met(scene);
            let (after, claim) = struck(&mechanism, &before);
            let tell = |after: &Motion, claim: &Claim| check(&mechanism, 1e-9, &before, after, claim);
            assert_eq!(tell(&after, &claim), Ok(()), "{scene}");
            let said = |wrong: Result<(), String>, words: &str| {
                let what = wrong.expect_err(words);
                assert!(what.contains(words), "{what}");
            };
            said(tell(&after, &Claim { impulse: 1.000_1 * claim.impulse, ..claim }), "impulse");
            said(tell(&after, &Claim { energy_lost: claim.energy_lost + 1e-6, ..claim }), "are lost");
            said(tell(&Motion { work: after.work + 1e-6, ..after.clone() }, &claim), "kinetic energy");
            for k in 0..before.phi.len() {
                let mut moved = after.clone();
                moved.phi[k] += DoubleDouble::from(1e-9);
                said(tell(&moved, &claim), "changed by");
                let mut turned = after.clone();
                turned.omega[k] += DoubleDouble::from(1e-4);
                assert!(tell(&turned, &claim).is_err(), "rate {k}");
            }
            // As though nothing had been met at all.
            said(tell(&before, &claim), "leaves at");
        }
    }

    #[test]
    fn an_impact_away_from_its_wall_and_a_start_elsewhere_are_told() {
        let (mechanism, mut before) = met(SCENES[0]);
        before.phi[2] += DoubleDouble::from(1e-3);
        let (after, claim) = struck(&mechanism, &before);
        assert!(
            check(&mechanism, 1e-9, &before, &after, &claim)
                .is_err_and(|what| what.contains("from the wall"))
        );
        assert!(is_start(&mechanism, &before, &after, false).is_ok());
        assert!(is_start(&mechanism, &before, &after, true).is_err_and(|what| what.contains("rate")));
        let mut elsewhere = before.clone();
        elsewhere.phi[2] += DoubleDouble::from(1e-6);
        assert!(is_start(&mechanism, &before, &elsewhere, true).is_err_and(|what| what.contains("y of rod")));
    }
}
