//! The canonical form at eight points at once, one a lane; the one place of this form where code compiled for the processor is entered.
//!
//! The formulas are those of a single point, evaluated on [`Eight`] and, where what doubles drop is wanted too, on [`Pairs`].  What depends on time alone
//! is formed once for each set of times, in double-double.

use super::Scratch;
use crate::arithmetic::eight::{Eight, LANES, Lanewise, Octet};
#[cfg(target_arch = "x86_64")]
use crate::arithmetic::lanes::{self, Avx};
use crate::arithmetic::lanes::{Lanes, Portable};
use crate::arithmetic::pairs::Pairs;
use crate::arithmetic::{Complex, DoubleDouble, Scalar};
use crate::dynamics::law::Phase;
use crate::dynamics::{Mechanism, Points, Time};

/// Scratch space of an evaluation in lanes, for one kind of vector.
#[derive(Clone, Debug)]
pub struct Stages {
    /// The times the drives below are for; not a number before the first.
    time: [Time; LANES],
    room: Room,
}

/// The code and what it runs on.
#[derive(Clone, Debug)]
enum Room {
    Portable(Box<Both<Portable>>),
    #[cfg(target_arch = "x86_64")]
    Hardware(Box<Both<Avx>>),
}

#[derive(Clone, Debug)]
struct Both<L> {
    plain: Bench<Eight<L>>,
    exact: Bench<Pairs<L>>,
}

/// Scratch space for one scalar.
#[derive(Clone, Debug)]
struct Bench<T> {
    scratch: Scratch<T>,
    y: Vec<T>,
    rate: Vec<T>,
}

impl<T: Lanewise> Bench<T> {
    fn new(mechanism: &Mechanism) -> Self {
        let zeros = vec![T::ZERO; 2 * mechanism.ties.count() + 1];
        Self { scratch: Scratch::new(mechanism), y: zeros.clone(), rate: zeros }
    }

    /// The rates at all points.
    #[inline(always)]
    fn rates<const N: usize, const ACCOUNT: bool>(&mut self, mechanism: &Mechanism, points: &mut Points) {
        for ((y, high), low) in self.y.iter_mut().zip(&points.y).zip(&points.low) {
            *y = T::load(high, low);
        }
        let d = points.y.len();
        self.scratch.rate::<N, ACCOUNT>(mechanism, &self.y[..d], &mut self.rate[..d]);
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
        let phase = Phase { angle: T::ZERO, unit, rate: lanes(|phase| phase.rate), acceleration: lanes(|phase| phase.acceleration) };
        self.scratch.drive(k, phase);
    }

    /// Takes what applied force `a` is multiplied by at all points.
    fn multiply(&mut self, a: usize, factors: &[DoubleDouble; LANES]) {
        self.scratch.factor[a] = T::load(&Octet(factors.map(|factor| factor.hi)), &Octet(factors.map(|factor| factor.lo)));
    }
}

impl<L: Lanes> Both<L> {
    fn new(mechanism: &Mechanism) -> Self {
        Self { plain: Bench::new(mechanism), exact: Bench::new(mechanism) }
    }

    #[inline(always)]
    fn rates<const N: usize, const ACCOUNT: bool, const EXACT: bool>(&mut self, mechanism: &Mechanism, points: &mut Points) {
        if EXACT {
            self.exact.rates::<N, ACCOUNT>(mechanism, points);
        } else {
            self.plain.rates::<N, ACCOUNT>(mechanism, points);
        }
    }

    fn drive(&mut self, mechanism: &Mechanism, time: &[Time; LANES]) {
        for (k, tie) in mechanism.ties.bodies.iter().enumerate() {
            let phases = time.map(|time| tie.drive::<DoubleDouble>(time));
            self.plain.drive(k, &phases);
            self.exact.drive(k, &phases);
        }
        for (a, action) in mechanism.actions.iter().enumerate() {
            let factors = time.map(|time| action.factor(time));
            self.plain.multiply(a, &factors);
            self.exact.multiply(a, &factors);
        }
    }
}

/// The same code compiled for the processor.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx,fma")]
fn hardware<const N: usize, const ACCOUNT: bool, const EXACT: bool>(both: &mut Both<Avx>, mechanism: &Mechanism, points: &mut Points) {
    both.rates::<N, ACCOUNT, EXACT>(mechanism, points);
}

impl Stages {
    /// Room for a mechanism, in the processor's vectors where it has them and `portable` does not forbid it.
    pub fn new(mechanism: &Mechanism, portable: bool) -> Self {
        let time = [Time::of(f64::NAN); LANES];
        #[cfg(target_arch = "x86_64")]
        if !portable && lanes::available() {
            return Self { time, room: Room::Hardware(Box::new(Both::new(mechanism))) };
        }
        let _ = portable;
        Self { time, room: Room::Portable(Box::new(Both::new(mechanism))) }
    }

    /// The rates at all points; with `exact`, what doubles leave out of points and rates too.  `account`: the form carries p_t.
    ///
    /// Not generic, so that it is compiled once and not with every program that marches a mechanism.
    pub fn rates(&mut self, account: bool, exact: bool, mechanism: &Mechanism, points: &mut Points) {
        if account && self.time != points.time {
            self.time = points.time;
            match &mut self.room {
                Room::Portable(both) => both.drive(mechanism, &self.time),
                #[cfg(target_arch = "x86_64")]
                Room::Hardware(both) => both.drive(mechanism, &self.time),
            }
        }
        // The sizes worth unrolling; any other count of the same operations has the same bits.
        match &mut self.room {
            Room::Portable(both) => match (account, exact) {
                (false, false) => both.rates::<0, false, false>(mechanism, points),
                (false, true) => both.rates::<0, false, true>(mechanism, points),
                (true, false) => both.rates::<0, true, false>(mechanism, points),
                (true, true) => both.rates::<0, true, true>(mechanism, points),
            },
            #[cfg(target_arch = "x86_64")]
            Room::Hardware(both) => {
                let code: unsafe fn(&mut Both<Avx>, &Mechanism, &mut Points) = match (mechanism.size(), account, exact) {
                    (1, false, false) => hardware::<1, false, false>,
                    (2, false, false) => hardware::<2, false, false>,
                    (3, false, false) => hardware::<3, false, false>,
                    (4, false, false) => hardware::<4, false, false>,
                    (_, false, false) => hardware::<0, false, false>,
                    (2, false, true) => hardware::<2, false, true>,
                    (_, false, true) => hardware::<0, false, true>,
                    (2, true, false) => hardware::<2, true, false>,
                    (_, true, false) => hardware::<0, true, false>,
                    (2, true, true) => hardware::<2, true, true>,
                    (_, true, true) => hardware::<0, true, true>,
                };
                // SAFETY: this room is made only where the processor was found to have AVX and FMA; all else in that code is safe.
                #[allow(unsafe_code)]
                unsafe {
                    code(both, mechanism, points);
                }
            }
        }
    }
}
