//! The canonical form at eight points at once, one a lane.
//!
//! The formulas are those of a single point, evaluated on [`Eight`] and, where what doubles drop is wanted
//! too, on [`Pairs`].  What depends on time alone is formed once for each set of times, in double-double.

use super::CanonicalScratch;
use crate::arithmetic::eight::{Eight, LANES, Lanewise, Octet};
use crate::arithmetic::lanes::{self, Code, Hardware, Lanes, Portable, Vector};
use crate::arithmetic::pairs::Pairs;
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::law::Phase;
use crate::dynamics::{Mechanism, Points, Time};

/// Scratch space of an evaluation in lanes, for one kind of vector.
#[derive(Clone, Debug)]
pub struct LaneStages {
    /// The times the drives below are for; not a number before the first.
    time: [Time; LANES],
    room: StagesByVector,
}

/// The code and what it runs on.
#[derive(Clone, Debug)]
enum StagesByVector {
    Portable(Box<BothScalars<Portable>>),
    Hardware(Hardware, Box<BothScalars<Vector>>),
}

#[derive(Clone, Debug)]
struct BothScalars<L> {
    plain: StageScratch<Eight<L>>,
    exact: StageScratch<Pairs<L>>,
}

/// Scratch space for one scalar.
#[derive(Clone, Debug)]
struct StageScratch<T> {
    scratch: CanonicalScratch<T>,
    y: Vec<T>,
    rate: Vec<T>,
}

impl<T: Lanewise> StageScratch<T> {
    fn new(mechanism: &Mechanism) -> Self {
        let zeros = vec![T::ZERO; 2 * mechanism.partition.count() + 1];
        Self { scratch: CanonicalScratch::new(mechanism), y: zeros.clone(), rate: zeros }
    }

    /// The rates at all points.
    #[inline(always)]
    fn rates<const N: usize>(&mut self, StagePoints { mechanism, has_work_integral, points }: StagePoints) {
        for ((y, high), low) in self.y.iter_mut().zip(&points.y).zip(&points.low) {
            *y = T::load(high, low);
        }
        let d = points.y.len();
        self.scratch.rate::<N>(mechanism, has_work_integral, &self.y[..d], &mut self.rate[..d]);
        for ((rate, high), low) in self.rate.iter().zip(&mut points.rate).zip(&mut points.rate_low) {
            rate.store(high, low);
        }
    }

    /// Takes the known part of body `k`'s angle at all points.
    fn drive(&mut self, k: usize, phases: &[Phase<DoubleDouble>; LANES]) {
        let lanes = |part: fn(&Phase<DoubleDouble>) -> DoubleDouble| {
            let parts = phases.each_ref().map(part);
            T::load(&Octet(parts.map(|part| part.hi)), &Octet(parts.map(|part| part.lo)))
        };
        let unit = Complex::new(lanes(|phase| phase.unit.re), lanes(|phase| phase.unit.im));
        let phase = Phase {
            angle: T::ZERO,
            unit,
            rate: lanes(|phase| phase.rate),
            acceleration: lanes(|phase| phase.acceleration),
        };
        self.scratch.drive(k, phase);
    }

    /// Takes the times of all points.
    fn set(&mut self, time: &[Time; LANES]) {
        self.scratch.time = T::load(&Octet(time.map(|time| time.hi)), &Octet(time.map(|time| time.lo)));
    }

    /// Takes what applied force `a` is multiplied by at all points.
    fn multiply(&mut self, a: usize, factors: &[DoubleDouble; LANES]) {
        self.scratch.factor[a] =
            T::load(&Octet(factors.map(|factor| factor.hi)), &Octet(factors.map(|factor| factor.lo)));
    }
}

impl<L: Lanes> BothScalars<L> {
    fn new(mechanism: &Mechanism) -> Self {
        Self { plain: StageScratch::new(mechanism), exact: StageScratch::new(mechanism) }
    }

    fn drive(&mut self, mechanism: &Mechanism, time: &[Time; LANES]) {
        for (k, dependent_angle) in mechanism.partition.bodies.iter().enumerate() {
            let phases = time.map(|time| dependent_angle.drive::<DoubleDouble>(time));
            self.plain.drive(k, &phases);
            self.exact.drive(k, &phases);
        }
        for (a, action) in mechanism.actions.iter().enumerate() {
            let factors = time.map(|time| action.factor(time));
            self.plain.multiply(a, &factors);
            self.exact.multiply(a, &factors);
        }
        self.plain.set(time);
        self.exact.set(time);
    }
}

/// What is evaluated.
struct StagePoints<'a> {
    mechanism: &'a Mechanism,
    has_work_integral: bool,
    points: &'a mut Points,
}

/// The rates at all points, in doubles or, where `EXACT`, with what these leave out.
struct CanonicalRates<'a, V, const N: usize, const EXACT: bool>(&'a mut BothScalars<V>, StagePoints<'a>);

impl<V: Lanes, const N: usize, const EXACT: bool> Code for CanonicalRates<'_, V, N, EXACT> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self(both, of) = self;
        if EXACT {
            both.exact.rates::<N>(of);
        } else {
            both.plain.rates::<N>(of);
        }
    }
}

impl LaneStages {
    /// Room for a mechanism, in the processor's vectors where it has them and `portable` does not forbid it.
    pub fn new(mechanism: &Mechanism, portable: bool) -> Self {
        let time = [Time::of(f64::NAN); LANES];
        let room = match lanes::hardware().filter(|_| !portable) {
            Some(hardware) => StagesByVector::Hardware(hardware, Box::new(BothScalars::new(mechanism))),
            None => StagesByVector::Portable(Box::new(BothScalars::new(mechanism))),
        };
        Self { time, room }
    }

    /// The rates at all points; with `exact`, what doubles leave out of points and rates too.
    /// `has_work_integral`: the form carries p_t.
    ///
    /// Not generic, so that it is compiled once and not with every program that integrates a mechanism.
    pub fn rates(
        &mut self,
        has_work_integral: bool,
        exact: bool,
        mechanism: &Mechanism,
        points: &mut Points,
    ) {
        if has_work_integral && self.time != points.time {
            self.time = points.time;
            match &mut self.room {
                StagesByVector::Portable(both) => both.drive(mechanism, &self.time),
                StagesByVector::Hardware(_, both) => both.drive(mechanism, &self.time),
            }
        }
        let of = StagePoints { mechanism, has_work_integral, points };
        // The sizes worth unrolling; any other count of the same operations has the same bits.
        match &mut self.room {
            StagesByVector::Portable(both) => match exact {
                false => Portable::apart(CanonicalRates::<_, 0, false>(both, of)),
                true => Portable::apart(CanonicalRates::<_, 0, true>(both, of)),
            },
            StagesByVector::Hardware(hardware, both) => match (mechanism.size(), exact) {
                (1, false) => hardware.run(CanonicalRates::<_, 1, false>(both, of)),
                (2, false) => hardware.run(CanonicalRates::<_, 2, false>(both, of)),
                (3, false) => hardware.run(CanonicalRates::<_, 3, false>(both, of)),
                (4, false) => hardware.run(CanonicalRates::<_, 4, false>(both, of)),
                (_, false) => hardware.run(CanonicalRates::<_, 0, false>(both, of)),
                (2, true) => hardware.run(CanonicalRates::<_, 2, true>(both, of)),
                (_, true) => hardware.run(CanonicalRates::<_, 0, true>(both, of)),
            },
        }
    }
}
