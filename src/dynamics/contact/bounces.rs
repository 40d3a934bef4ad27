//! Bounces too low for their heights to be told from rounding, one by one.
//!
//! ```text
//! flight   g'' = -a(modes),  w_j'    constant until a w_j is zero, or g; to second order in their time
//! w_j = 0  modes anew: sticks, or slides as it is pushed     w_j: relative velocity of place j
//! g = 0    impulse at the wall with its friction, g' < 0 to g' > 0
//! rest     Σ of a geometric series, ratio q of the last two rebounds
//! ```
//!
//! Where nothing turns, q is the restitution e.  A block on a rail with friction that bounces along it has
//! a1 up and a2 down, so that q = e √(a2/a1); friction of the wall that stops or turns within an impact by
//! Poisson's law has a q of its own.  All equations are homogeneous in rebounds and relative velocities of
//! that size: bounces repeat, smaller, and few tell the others.

use super::super::friction::{FrictionMode, Transition};
use crate::arithmetic::Real;

/// Bounces that are followed at most.
const MOST: usize = 4000;
/// Changes of modes within one flight at most.
const TURNS: usize = 64;
/// Difference of the ratio of rebounds from the restitution that is none.
const ALIKE: f64 = 1e-4;
/// How many times what all bounces change of a velocity it has to be to be sure not to turn.
const SAFE: f64 = 4.0;
/// Velocity, over the rebound, that an impact gives to what sticks where it has no part in it.
const NO_SPEED: f64 = 1e-9;

/// A moment of a motion that bounces.
#[derive(Clone, Debug)]
pub struct FlightMoment<T> {
    /// How long after the first of these bounces \[s\].
    pub late: T,
    /// Coordinates \[rad, m\].
    pub phi: Vec<T>,
    /// Rates \[rad/s, m/s\].
    pub omega: Vec<T>,
}

/// How the state changes.
#[derive(Clone, Debug)]
pub struct MotionRates<T> {
    /// Accelerations of all coordinates.
    pub accelerations: Vec<T>,
    /// Power \[W\].
    pub power: T,
    /// Power that friction takes \[W\].
    pub lost: T,
}

/// How a flight goes on at a moment.
#[derive(Clone, Debug)]
pub struct Course<T> {
    /// How the state changes.
    pub rates: MotionRates<T>,
    /// Acceleration of the point towards its wall \[m/s²\].
    pub inward: T,
    /// Relative velocities of all places with friction, and their rates.
    pub sliding: Vec<[T; 2]>,
}

/// A mechanism of which a point bounces on its wall.
pub trait Bouncing<T> {
    /// The rate of the gap \[m/s\].
    fn rebound(&self, at: &FlightMoment<T>) -> T;

    /// What places with friction do in flight; `None` where nothing fits, or what holds other points changes.
    fn modes(
        &self,
        at: &FlightMoment<T>,
        before: &[FrictionMode],
        transition: Transition,
    ) -> Option<Vec<FrictionMode>>;

    /// The motion in these modes.
    fn course(&self, at: &FlightMoment<T>, modes: &[FrictionMode]) -> Option<Course<T>>;

    /// Rates after the impact, and the work of what moves by a law \[J\]; `None` where others take part.
    fn strike(&self, at: &FlightMoment<T>) -> Option<(Vec<T>, T)>;
}

/// What bounces of a point do.
#[derive(Clone, Debug)]
pub struct Bounced<T> {
    /// How long they last \[s\].
    pub last: T,
    /// Rates at their end \[rad/s, m/s\].
    pub omega: Vec<T>,
    /// How far the coordinates are then from where those rates had brought them \[rad, m\].
    pub behind: Vec<T>,
    /// Work \[J\].
    pub work: T,
    /// Energy lost in friction, impacts aside \[J\].
    pub lost: T,
}

impl<T: Real> Bounced<T> {
    /// The mean rates of all bounces, the first of which began with these \[rad/s, m/s\].
    pub fn mean(&self, first: &[T]) -> MotionRates<T> {
        let Self { last, omega, work, lost, .. } = self;
        let accelerations = omega.iter().zip(first).map(|(&end, &first)| (end - first) / *last).collect();
        MotionRates { accelerations, power: *work / *last, lost: *lost / *last }
    }
}

/// What one flight and the impact at its end do.
struct Bounce<T> {
    work: T,
    lost: T,
    /// True where modes are those that were expected, and nothing that slides comes near rest.
    is_plain: bool,
}

/// All bounces from a moment on, followed down to a part `least` of the first rebound.
///
/// `None` where places remain in the `expected` modes and rebounds have the ratio `restitution`, so that all
/// flights have one acceleration, and where nothing fits.
pub fn all<T: Real>(
    of: &impl Bouncing<T>,
    start: FlightMoment<T>,
    expected: &[FrictionMode],
    restitution: T,
    least: f64,
) -> Option<Bounced<T>> {
    let first = of.rebound(&start);
    let (mut at, mut rebound, mut modes) = (start.clone(), first, expected.to_vec());
    let (mut work, mut lost) = (T::ZERO, T::ZERO);
    for number in 0..MOST {
        let before = at.clone();
        let bounce = one(of, &mut at, expected, &mut modes)?;
        let next = of.rebound(&at);
        let ratio = next / rebound;
        let is_alike = (ratio - restitution).value().abs() <= ALIKE;
        if ratio >= T::ONE || number == 0 && bounce.is_plain && is_alike {
            return None;
        }
        work += bounce.work;
        lost += bounce.lost;
        rebound = next;
        if next > first.scale(least) {
            continue;
        }
        // Those that are left, each smaller by the same ratio.
        let left = if next > T::ZERO { ratio / (T::ONE - ratio) } else { T::ZERO };
        let flight = at.late - before.late;
        let end = |(omega, before): (&T, &T)| *omega + (*omega - *before) * left;
        let omega: Vec<T> = at.omega.iter().zip(&before.omega).map(end).collect();
        let behind = |k: usize| at.phi[k] - start.phi[k] - omega[k] * at.late;
        return Some(Bounced {
            last: at.late + flight * left,
            behind: (0..omega.len()).map(behind).collect(),
            work: work + bounce.work * left,
            lost: lost + bounce.lost * left,
            omega,
        });
    }
    None
}

/// One flight, and the impact at its end.
fn one<T: Real>(
    of: &impl Bouncing<T>,
    at: &mut FlightMoment<T>,
    expected: &[FrictionMode],
    modes: &mut Vec<FrictionMode>,
) -> Option<Bounce<T>> {
    let (start, mut gap) = (at.clone(), T::ZERO);
    let mut bounce = Bounce { work: T::ZERO, lost: T::ZERO, is_plain: true };
    let mut transition = Transition::default();
    for _ in 0..TURNS {
        *modes = of.modes(at, modes, transition)?;
        let (rate, course) = (of.rebound(at), of.course(at, modes)?);
        let (_, time) = ends(&course, modes, [gap, rate])?;
        // Halfway accelerations are those of all of it, and power is linear.
        let halfway = moved(at, &course.rates.accelerations, time.scale(0.5));
        let then = of.course(&halfway, modes)?;
        let sliding = course.sliding.iter().zip(&then.sliding);
        let sliding = sliding.map(|(now, then)| [now[0], then[1]]).collect();
        let course = Course { sliding, ..then };
        let (place, time) = ends(&course, modes, [gap, rate])?;
        *at = moved(at, &course.rates.accelerations, time);
        bounce.work += course.rates.power * time;
        bounce.lost += course.rates.lost * time;
        gap += (rate - (course.inward * time).scale(0.5)) * time;
        bounce.is_plain &= place.is_none() && are_alike(modes, expected);
        if place.is_none() {
            let (omega, work) = of.strike(at)?;
            at.omega = omega;
            bounce.work += work;
            bounce.is_plain = bounce.is_plain && goes_on(of, modes, [&start, at])?;
            return Some(bounce);
        }
        transition = Transition { arrived: place, breaks: None };
    }
    None
}

/// A moment so much later, with these accelerations.
fn moved<T: Real>(at: &FlightMoment<T>, accelerations: &[T], time: T) -> FlightMoment<T> {
    let phi = |k: usize| at.phi[k] + (at.omega[k] + (accelerations[k] * time).scale(0.5)) * time;
    let omega = |k: usize| at.omega[k] + accelerations[k] * time;
    let all = 0..at.phi.len();
    FlightMoment {
        late: at.late + time,
        phi: all.clone().map(phi).collect(),
        omega: all.map(omega).collect(),
    }
}

/// The first place that slides to come to rest, and when \[s\]; or when the point is on its wall again, whose
/// gap and its rate are given.
fn ends<T: Real>(
    course: &Course<T>,
    modes: &[FrictionMode],
    [gap, rate]: [T; 2],
) -> Option<(Option<usize>, T)> {
    let inward = course.inward;
    let falls = || (rate + (rate * rate + (inward * gap).scale(2.0)).sqrt()) / inward;
    let mut first = (inward > T::ZERO).then(|| (None, falls()));
    for (place, (mode, &[speed, acceleration])) in modes.iter().zip(&course.sliding).enumerate() {
        let FrictionMode::Slip(sign) = *mode else { continue };
        if acceleration.scale(sign) >= T::ZERO {
            continue;
        }
        let time = -speed / acceleration;
        if time > T::ZERO && first.is_none_or(|(_, first)| time < first) {
            first = Some((Some(place), time));
        }
    }
    first
}

/// True where modes are the same, wherever places stick.
fn are_alike(modes: &[FrictionMode], others: &[FrictionMode]) -> bool {
    modes.iter().zip(others).all(|pair| match pair {
        (FrictionMode::Stick(_), FrictionMode::Stick(_)) => true,
        (mode, other) => mode == other,
    })
}

/// True where what slides, or sticks, does so after all bounces, the first of which is between two moments.
fn goes_on<T: Real>(
    of: &impl Bouncing<T>,
    modes: &[FrictionMode],
    [start, after]: [&FlightMoment<T>; 2],
) -> Option<bool> {
    let (first, next) = (of.rebound(start), of.rebound(after));
    let all = SAFE * (first / (first - next)).value();
    let [before, after] = [of.course(start, modes)?.sliding, of.course(after, modes)?.sliding];
    let mut places = modes.iter().zip(before.iter().zip(&after));
    Some(places.all(|(mode, ([before, _], [after, _]))| match mode {
        FrictionMode::Slip(sign) => sign * before.value() > all * (*after - *before).value().abs(),
        FrictionMode::Stick(_) => after.value().abs() <= NO_SPEED * first.value(),
        _ => true,
    }))
}
