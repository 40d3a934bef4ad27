//! How infinitely many bounces end, told from the last of them.
//!
//! ```text
//! v_k = e^k v      v: rebound where the search for impacts ends,  a: acceleration towards the wall
//! end      Σ 2 v_k / a = 2 v / (a (1 - e))
//! impulse  what all bounces give, less what the wall gives from now on to their end:  -v / a_nn,
//!     friction with it
//! ```
//!
//! Holding the point at once with that impulse leaves the rates where all bounces would, and the place to the
//! height of the last one, where nothing depends on the pressure of the wall but what is on it.  Dry friction
//! in joints does, and takes no part in impulses: until the end it is that of a flight, and what it would do
//! beside a point held at once is taken back.
//!
//! An impact at another wall before that end finds the point in flight.
//!
//! ```text
//! Δw = (a_flight - a_held) T, the constraints kept,   Δq = -T Δw / 2        T: how long all bounces last
//! ```
//!
//! Where a place with friction turns in flight, or that of the wall within an impact, bounces are followed
//! one by one ([`bounces`](crate::dynamics::contact::bounces)), and a_flight is the mean of all.

use super::super::running::Outcome;
use super::impacts::PresentState;
use super::{ContactDriver, NO_SPEED, in_modes};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::contact::bounces::{self, Bounced, Bouncing, Course, FlightMoment, MotionRates};
use crate::dynamics::contact::metric::MetricRow;
use crate::dynamics::friction::{CompiledFriction, FrictionMode, FrictionMoment, Normal, Transition};
use crate::dynamics::impact::Contact;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stepping::StepError;

/// Speed of a rebound from a wall that holds its point, over what counts as none: drift makes less.
const LEAVING: f64 = 1e3;

/// What is left of the freedom of a point along the normal of its wall, and its normal speed over the speeds
/// it is made of, up to which its path touches the wall: it goes behind it by half the square of that.
const GRAZING: f64 = 1e-7;

/// Impulse over that of an impact from which on it takes part in it.
const LEAST_PART: f64 = 1e-9;

/// Part of a rebound down to which bounces are followed: rates have the digits for it.
const FOLLOWED: f64 = 1e-4;

/// A motion between bounces that are left out.
pub(in crate::run) struct Flight {
    /// The wall.
    pub contact: usize,
    /// How long all of them last \[s\].
    pub last: f64,
    /// How the state changes from the first on, the mean of all where they differ.
    rates: MotionRates<f64>,
    /// How far the coordinates are at the end from where the rates there had brought them, where bounces were
    /// followed one by one.
    behind: Option<Vec<f64>>,
}

/// The contacts that a mechanism holds but for one, and the modes of the places with friction without it.
fn left(held: &Mechanism, contact: usize) -> (Vec<usize>, Vec<FrictionMode>) {
    let others = held.held.iter().copied().filter(|&other| other != contact).collect();
    let without = |(friction, mode): (&CompiledFriction, &FrictionMode)| match friction.normal {
        Normal::Contact(number) if number == contact => FrictionMode::Open,
        _ => *mode,
    };
    (others, held.frictions.iter().zip(&held.modes).map(without).collect())
}

/// How a motion changes at a time, of coordinates and rates.
fn motion_rates(mechanism: &Mechanism, t: Time, phi: &[f64], omega: &[f64]) -> MotionRates<f64> {
    let mut kernel = Kernel::<f64>::new(mechanism);
    kernel.accelerations(mechanism, t, phi, omega, Bias::default());
    let (power, _) = kernel.powers(mechanism, t, phi, omega);
    let lost = kernel.friction_power(omega);
    MotionRates { accelerations: kernel.load[..phi.len()].to_vec(), power, lost }
}

/// Acceleration of a point towards its wall \[m/s²\], of all coordinates.
fn inward(accelerations: &[f64], wall: &Contact, t: Time, at: ConstraintArguments<f64>) -> f64 {
    let MetricRow { row, along } = MetricRow::of(&wall.row, t, at);
    -(dot(&along, accelerations) + row.convective)
}

impl Flight {
    /// The bounces that are left out at walls that a mechanism holds from now on.
    pub fn all(held: &Mechanism, new: &[usize], motion: &Motion) -> Vec<Self> {
        new.iter().filter_map(|&contact| Self::new(held, contact, motion)).collect()
    }

    /// Those of one wall beside others.
    fn new(held: &Mechanism, contact: usize, motion: &Motion) -> Option<Self> {
        let [phi, omega] = motion.rounded();
        let z = held.elements(&phi);
        let wall = &held.contacts[contact];
        let speed = wall.gap_rate(motion.time, &phi, &z, &omega);
        if speed <= NO_SPEED * wall.step_size(&omega) || wall.restitution >= 1.0 {
            return None;
        }
        let (others, modes) = left(held, contact);
        let flying = FlyingPoint { held, contact, t: motion.time, others: &others };
        if let Some(bounced) = flying.bounced([&phi, &omega], &modes) {
            let rates = bounced.mean(&omega);
            return Some(Self { contact, last: bounced.last, rates, behind: Some(bounced.behind) });
        }
        let rates = motion_rates(&held.moving(&others, &modes), motion.time, &phi, &omega);
        let at = ConstraintArguments { phi: &phi, z: &z, omega: &omega };
        let inward = inward(&rates.accelerations, wall, motion.time, at);
        let last = 2.0 * speed / (inward * (1.0 - wall.restitution));
        // Others at their limits may not share the load without it.
        let at = FrictionMoment { t: motion.time, phi: &phi, z: &z, omega: &omega };
        let is_motion = inward > 0.0 && last.is_finite() && held.hold_so(at, &others, &modes);
        is_motion.then_some(Self { contact, last, rates, behind: None })
    }

    /// How the mechanism moves that holds the point at once, halfway to the end of the bounces.
    fn beside(&self, held: &Mechanism, motion: &Motion, closed: &[f64]) -> MotionRates<f64> {
        let ([mut phi, mut omega], Self { last, rates, .. }) = (motion.rounded(), self);
        let first = motion_rates(held, motion.time, &phi, closed).accelerations;
        for (k, (phi, omega)) in phi.iter_mut().zip(&mut omega).enumerate() {
            let end = *omega + rates.accelerations[k] * last;
            *phi += 0.5 * last * (end - 0.75 * last * first[k]);
            *omega = end - 0.5 * last * first[k];
        }
        motion_rates(held, motion.time + 0.5 * last, &phi, &omega)
    }
}

/// A mechanism of which a point bounces on its wall, others held.
struct FlyingPoint<'a> {
    held: &'a Mechanism,
    contact: usize,
    t: Time,
    others: &'a [usize],
}

impl FlyingPoint<'_> {
    /// All bounces of a motion, where they are not alike: see [`bounces::all`].
    fn bounced(&self, [phi, omega]: [&[f64]; 2], modes: &[FrictionMode]) -> Option<Bounced<f64>> {
        if self.held.frictions.is_empty() {
            return None;
        }
        let start = FlightMoment { late: 0.0, phi: phi.to_vec(), omega: omega.to_vec() };
        bounces::all(self, start, modes, self.held.contacts[self.contact].restitution, FOLLOWED)
    }
}

impl Bouncing<f64> for FlyingPoint<'_> {
    fn rebound(&self, FlightMoment { late, phi, omega }: &FlightMoment<f64>) -> f64 {
        let z = self.held.elements(phi);
        self.held.contacts[self.contact].gap_rate(self.t + *late, phi, &z, omega)
    }

    fn modes(
        &self,
        FlightMoment { late, phi, omega }: &FlightMoment<f64>,
        before: &[FrictionMode],
        transition: Transition,
    ) -> Option<Vec<FrictionMode>> {
        let z = self.held.elements(phi);
        let at = FrictionMoment { t: self.t + *late, phi, z: &z, omega };
        let (closed, modes) = self.held.modes_at(at, before, [self.others, self.others], transition).ok()?;
        (closed == self.others).then_some(modes)
    }

    fn course(
        &self,
        FlightMoment { late, phi, omega }: &FlightMoment<f64>,
        modes: &[FrictionMode],
    ) -> Option<Course<f64>> {
        let (t, z) = (self.t + *late, self.held.elements(phi));
        let rates = motion_rates(&self.held.moving(self.others, modes), t, phi, omega);
        let accelerations = &rates.accelerations;
        let at = ConstraintArguments { phi, z: &z, omega };
        let inward = inward(accelerations, &self.held.contacts[self.contact], t, at);
        let sliding = |friction: &CompiledFriction| {
            let MetricRow { row, along } = MetricRow::of(&friction.tangent, t, at);
            [dot(&along, omega) + row.drive, dot(&along, accelerations) + row.convective]
        };
        let sliding = self.held.frictions.iter().map(sliding).collect();
        let is_finite = accelerations.iter().all(|a| a.is_finite());
        is_finite.then_some(Course { rates, inward, sliding })
    }

    fn strike(&self, FlightMoment { late, phi, omega }: &FlightMoment<f64>) -> Option<(Vec<f64>, f64)> {
        let open = vec![FrictionMode::Open; self.held.frictions.len()];
        let striking = self.held.moving(self.others, &open);
        let impact = striking.impact_at(self.contact, self.t + *late, phi, omega)?;
        // What is pulled would be let go, and what rubs takes part.
        let takes_part = |(&other, &pull): (&usize, &f64)| {
            pull.abs() > LEAST_PART * impact.impulse && (pull > 0.0 || striking.friction_at(other).is_some())
        };
        let mut others = striking.held.iter().zip(&impact.row_impulses[striking.standing_rows()..]);
        let is_alone = !others.any(takes_part);
        is_alone.then_some((impact.omega, impact.motor_work))
    }
}

/// Takes off a motion what speed bounces have left at walls that a mechanism holds anew, with what friction
/// has to do with it: at these walls and, where flights are left out, in joints, which do not rub as beside a
/// point held already.  Without friction projection does so, and what is left is the work of walls that move.
/// `None` where the constraints leave no rates.
pub(in crate::run) fn come_to_rest(
    held: &Mechanism,
    new: &[usize],
    flights: &[Flight],
    motion: &mut Motion,
) -> Option<()> {
    let is_new = |normal| matches!(normal, Normal::Contact(contact) if new.contains(&contact));
    let rubs = held.sliding().any(|(friction, _)| !is_new(friction.normal));
    let flights: Vec<&Flight> = flights.iter().filter(|flight| rubs || flight.behind.is_some()).collect();
    let [phi, omega] = motion.rounded();
    let t = motion.time;
    let close = |omega: &[f64]| held.without_normal_rates(t, &phi, omega);
    let (closed, work) = close(&omega)?;
    motion.work += DoubleDouble::from(work);
    if flights.is_empty() && !held.sliding().any(|(friction, _)| is_new(friction.normal)) {
        return Some(());
    }
    let (mut turned, mut rates) = (vec![0.0; omega.len()], closed.clone());
    let at_once = motion_rates(held, t, &phi, &omega);
    for flight in flights {
        let (last, flown) = (flight.last, &flight.rates);
        let beside = flight.behind.is_some().then(|| flight.beside(held, motion, &closed));
        let at_once = beside.as_ref().unwrap_or(&at_once);
        let changes = flown.accelerations.iter().zip(&at_once.accelerations);
        let changed: Vec<f64> =
            omega.iter().zip(changes).map(|(omega, (flown, held))| omega + (flown - held) * last).collect();
        let (flown_rates, flown_work) = close(&changed)?;
        for (k, flown) in flown_rates.into_iter().enumerate() {
            rates[k] += flown - closed[k];
            turned[k] += match &flight.behind {
                Some(behind) => behind[k] + 0.5 * at_once.accelerations[k] * last * last,
                None => -(0.5 * last * (flown - closed[k])),
            };
        }
        motion.work += DoubleDouble::from((flown.power - at_once.power) * last + flown_work - work);
        motion.friction += (flown.lost - at_once.lost) * last;
    }
    for ((phi, omega), (turned, rate)) in
        motion.phi.iter_mut().zip(&mut motion.omega).zip(turned.into_iter().zip(rates))
    {
        *phi += DoubleDouble::from(turned);
        *omega = DoubleDouble::from(rate);
    }
    Some(())
}

impl ContactDriver {
    /// Lets points go whose bounces, which were left out, last at the moment: an impact at another wall finds
    /// them in flight, and they meet their own walls after it.  Returns their walls.
    pub(super) fn take_up_bounces(&mut self, outcome: &mut Outcome) -> Result<Vec<usize>, StepError> {
        let t = self.motion().time.hi;
        let mut flying = Vec::new();
        while let Some(bouncing) = self.held.iter().find(|held| held.since > t) {
            flying.push(bouncing.contact);
            self.release(bouncing.contact, outcome)?;
        }
        Ok(flying)
    }

    /// True where a wall does nothing to a point that meets it, as rounding or the error of a step makes it
    /// do: the point touches it at its dead centre, or stays on it since what holds others leaves it no
    /// freedom.
    pub(super) fn is_passed_by(&mut self, contact: usize) -> bool {
        let PresentState { t, z, phi, omega } = self.present_state();
        let wall = &self.free.contacts[contact];
        let slow = (GRAZING * wall.step_size(&omega)).max(self.no_speed(contact, &omega));
        wall.gap_rate(t, &phi, &z, &omega).abs() <= slow
            && self.mechanism.freedom(contact, t, &phi, &omega) <= GRAZING
    }

    /// True where the impact at another wall has made the point of a contact rebound that is held.
    pub(super) fn rebounds(&self, contact: usize, motion: &Motion) -> bool {
        let [phi, omega] = motion.rounded();
        let rate = self.free.contacts[contact].gap_rate(motion.time, &phi, &self.free.elements(&phi), &omega);
        rate > LEAVING * self.no_speed(contact, &omega)
    }

    /// A touching contact, not among those whose points are still, that rebounds less high than points do
    /// that stay, and is pressed by what friction does to the others in these modes.
    pub(super) fn pressed_by_friction(
        &mut self,
        touching: &[usize],
        still: &[usize],
        (held, modes): (&[usize], &[FrictionMode]),
    ) -> Option<usize> {
        if self.free.frictions.is_empty() || touching.iter().all(|contact| still.contains(contact)) {
            return None;
        }
        let PresentState { t, z, phi, omega } = self.present_state();
        let rates = motion_rates(&in_modes(&self.free, held, modes), t, &phi, &omega);
        touching.iter().copied().find(|contact| {
            let wall = &self.free.contacts[*contact];
            let at = ConstraintArguments { phi: &phi, z: &z, omega: &omega };
            let (speed, inward) =
                (wall.gap_rate(t, &phi, &z, &omega), inward(&rates.accelerations, wall, t, at));
            !still.contains(contact) && wall.rebounds_low([speed, inward], self.rest_height)
        })
    }

    /// Means are those of the flight until the bounces that are left out end, from a motion on.
    pub(super) fn fly_in_means(&mut self, flights: &[Flight], motion: &Motion, until: f64) {
        let Some(extremes) = &mut self.extremes else { return };
        extremes.hold(&self.mechanism);
        for flight in flights {
            let (others, modes) = left(&self.mechanism, flight.contact);
            let span = flight.last.min(until - motion.time.hi);
            extremes.exchange_for(&in_modes(&self.free, &others, &modes), motion, span);
        }
    }

    /// Counts a hold from the end of the bounces before it on, so much later \[s\].
    pub(super) fn begin_later(&mut self, contact: usize, by: f64, outcome: &mut Outcome) {
        let Some(held) = self.held.iter_mut().find(|held| held.contact == contact) else { return };
        held.since += by;
        if let Some(kept) = held.kept {
            outcome.holds[kept].t += by;
        }
    }
}
