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

use super::super::running::Outcome;
use super::impacts::PresentState;
use super::{ContactDriver, NO_SPEED, in_modes};
use crate::arithmetic::DoubleDouble;
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::contact::metric::MetricRow;
use crate::dynamics::friction::{FrictionMode, FrictionMoment, Normal};
use crate::dynamics::impact::Contact;
use crate::dynamics::kernel::{Bias, Kernel, dot};
use crate::dynamics::{Mechanism, Motion, Time};
use crate::stepping::StepError;

/// Speed of a rebound from a wall that holds its point, over what counts as none: drift makes less.
const LEAVING: f64 = 1e3;

/// What is left of the freedom of a point along the normal of its wall, and its normal speed over the speeds
/// it is made of, up to which its path touches the wall: it goes behind it by half the square of that.
const GRAZING: f64 = 1e-7;

/// A motion between bounces that are left out.
pub(in crate::run) struct Flight {
    /// The wall.
    pub contact: usize,
    /// How long all of them last \[s\].
    pub last: f64,
    /// How it goes on from the first.
    course: Course,
}

/// Accelerations of all coordinates, power \[W\], and power that friction takes \[W\].
struct Course {
    accelerations: Vec<f64>,
    power: f64,
    lost: f64,
}

impl Course {
    fn of(mechanism: &Mechanism, motion: &Motion) -> Self {
        let [phi, omega] = motion.rounded();
        let mut kernel = Kernel::<f64>::new(mechanism);
        kernel.accelerate::<0>(mechanism, motion.time, &phi, &omega, Bias::default());
        let (power, _) = kernel.powers(mechanism, motion.time, &phi, &omega);
        let lost = kernel.friction_power(&omega);
        Self { accelerations: kernel.load[..phi.len()].to_vec(), power, lost }
    }

    /// Acceleration of a point towards its wall \[m/s²\].
    fn inward(&self, wall: &Contact, t: Time, at: ConstraintArguments<f64>) -> f64 {
        let MetricRow { row, along } = MetricRow::of(&wall.row, t, at);
        -(dot(&along, &self.accelerations) + row.convective)
    }
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
        let others: Vec<usize> = held.held.iter().copied().filter(|&other| other != contact).collect();
        let mut modes = held.modes.clone();
        for (friction, mode) in held.frictions.iter().zip(&mut modes) {
            if friction.normal == Normal::Contact(contact) {
                *mode = FrictionMode::Open;
            }
        }
        let course = Course::of(&held.moving(&others, &modes), motion);
        let at = ConstraintArguments { phi: &phi, z: &z, omega: &omega };
        let inward = course.inward(wall, motion.time, at);
        let last = 2.0 * speed / (inward * (1.0 - wall.restitution));
        // Others at their limits may not share the load without it.
        let at = FrictionMoment { t: motion.time, phi: &phi, z: &z, omega: &omega };
        let is_motion = inward > 0.0 && last.is_finite() && held.hold_so(at, &others, &modes);
        is_motion.then_some(Self { contact, last, course })
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
    let flights = if held.sliding().any(|(friction, _)| !is_new(friction.normal)) { flights } else { &[] };
    let [phi, omega] = motion.rounded();
    let t = motion.time;
    let close = |omega: &[f64]| held.without_normal_rates(t, &phi, omega);
    let (closed, work) = close(&omega)?;
    motion.work += DoubleDouble::from(work);
    if flights.is_empty() && !held.sliding().any(|(friction, _)| is_new(friction.normal)) {
        return Some(());
    }
    let (mut turned, mut rates) = (vec![0.0; omega.len()], closed.clone());
    let at_once = Course::of(held, motion);
    for flight in flights {
        let (last, flown) = (flight.last, &flight.course);
        let changes = flown.accelerations.iter().zip(&at_once.accelerations);
        let changed: Vec<f64> =
            omega.iter().zip(changes).map(|(omega, (flown, held))| omega + (flown - held) * last).collect();
        let (flown_rates, flown_work) = close(&changed)?;
        for (k, flown) in flown_rates.into_iter().enumerate() {
            rates[k] += flown - closed[k];
            turned[k] -= 0.5 * last * (flown - closed[k]);
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
        let motion = self.motion();
        let PresentState { t, z, phi, omega } = self.present_state();
        let course = Course::of(&in_modes(&self.free, held, modes), &motion);
        touching.iter().copied().find(|contact| {
            let wall = &self.free.contacts[*contact];
            let at = ConstraintArguments { phi: &phi, z: &z, omega: &omega };
            let (speed, inward) = (wall.gap_rate(t, &phi, &z, &omega), course.inward(wall, t, at));
            !still.contains(contact) && wall.rebounds_low([speed, inward], self.rest_height)
        })
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
