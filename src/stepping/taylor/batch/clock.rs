//! The times of the lanes, and the steps that their series allow, all lanes at once.

use super::{JUDGES, added, load, store};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::wide::EightLanes;
use crate::dynamics::Time;

const ZERO: Octet = Octet([0.0; LANES]);
/// The largest logarithm to base 2 of a step \[s\].
const LONGEST: f64 = 1000.0;

/// When the steps of the lanes begin, and how long they are.
#[derive(Clone, Debug)]
pub(in crate::stepping::taylor) struct LaneClock {
    /// Which lanes have a trajectory.
    pub is_going: [bool; LANES],
    /// Times \[s\] in two terms.
    pub time: [Octet; 2],
    /// What is left to go, the last steps wanted and those taken \[s\].
    pub left: Octet,
    pub wanted: Octet,
    pub taken: Octet,
    /// The mechanisms' units of time \[s\] and of rates \[rad/s\], powers of two.
    unit: Octet,
    rate: Octet,
    /// The longest steps \[s\].
    longest: Octet,
    /// log2 tolerance / (P+1).
    exponent: f64,
    until: Time,
}

/// The step a lane is about to take.
#[derive(Clone, Copy, Debug)]
pub(in crate::stepping::taylor) struct LaneStep {
    pub lane: usize,
    pub time: Time,
    /// The mechanism's unit of time \[s\].
    pub unit: f64,
    /// What is left to go, and the step wanted \[s\].
    pub left: f64,
    pub wanted: f64,
}

impl LaneClock {
    /// Empty lanes, for a tolerance \[rad\] over a unit of time and an order.
    pub fn new(tolerance: f64, order: usize, until: Time) -> Self {
        let one = Octet::splat(1.0);
        Self {
            is_going: [false; LANES],
            time: [Octet::splat(until.hi), Octet::splat(until.lo)],
            left: ZERO,
            wanted: ZERO,
            taken: ZERO,
            unit: one,
            rate: one,
            longest: one,
            exponent: libm::log2(tolerance) / (order + 1) as f64,
            until,
        }
    }

    /// Starts a lane at a time, with its unit of time and longest step \[s\].
    pub fn start(&mut self, lane: usize, time: Time, unit: f64, longest: f64) {
        self.is_going[lane] = true;
        self.set(lane, time);
        (self.unit.0[lane], self.rate.0[lane], self.longest.0[lane]) = (unit, 1.0 / unit, longest);
    }

    /// Stops a lane: nothing is left to go in it.
    pub fn stop(&mut self, lane: usize) {
        self.is_going[lane] = false;
        self.set(lane, self.until);
    }

    /// The time of a lane.
    pub fn at(&self, lane: usize) -> Time {
        Time { hi: self.time[0].0[lane], lo: self.time[1].0[lane] }
    }

    /// Sets it.
    pub fn set(&mut self, lane: usize, time: Time) {
        (self.time[0].0[lane], self.time[1].0[lane]) = (time.hi, time.lo);
    }

    /// The step of a lane.
    pub fn step(&self, lane: usize) -> LaneStep {
        let (unit, left, wanted) = (self.unit.0[lane], self.left.0[lane], self.wanted.0[lane]);
        LaneStep { lane, time: self.at(lane), unit, left, wanted }
    }

    /// Finds what is left to go.
    #[inline(always)]
    pub fn look<W: EightLanes>(&mut self) {
        let (high, error) = W::splat(self.until.hi).two_sum(load::<W>(&self.time[0]).neg());
        let (low, rest) = W::splat(self.until.lo).two_sum(load::<W>(&self.time[1]).neg());
        let (high, error) = high.fast_two_sum(error.add(low));
        self.left = store(high.add(error.add(rest)));
    }

    /// The steps wanted from the largest coefficients of orders P, P-1, …, as
    /// [`StepSize::step_of`](super::super::step_size::StepSize::step_of) has them; not a number where `flaw`,
    /// elsewhere zero, is not.
    #[inline(always)]
    pub fn want<W: EightLanes>(&mut self, order: usize, largest: &[Octet; JUDGES], flaw: W) {
        let (unit, mut least, mut back) = (load::<W>(&self.rate), W::splat(f64::INFINITY), 0);
        while back < JUDGES {
            let root = 1.0 / ((1_u64 << 52) as f64 * (order - back) as f64);
            least = unit.bits_above(load(&largest[back])).mul(W::splat(root)).smaller(least);
            back += 1;
        }
        let x = least.add(W::splat(self.exponent)).smaller(W::splat(LONGEST));
        let whole = x.floor();
        let part = x.sub(whole);
        let power = part.mul(W::splat(0.078_3)).add(W::splat(0.226_2));
        let power = part.mul(power).add(W::splat(0.695_5));
        let power = part.mul(power).add(W::ONE);
        self.wanted = store(power.times_power(whole).smaller(load(&self.longest)).add(flaw));
    }

    /// The times at the ends of the steps taken, in two terms.
    #[inline(always)]
    pub fn ends<W: EightLanes>(&self) -> [Octet; 2] {
        let [high, low] = &self.time;
        added([high, low], load::<W>(&self.taken), W::ZERO).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::lanes::{Arithmetic, Portable};
    use crate::stepping::taylor::step_size::StepSize;

    type Plain = [Portable; 2];

    #[test]
    fn steps_are_those_of_a_trajectory_alone() {
        let (tolerance, order, until) = (1e-13, 20, Time { hi: 40.0, lo: 1e-16 });
        let mut clock = LaneClock::new(tolerance, order, until);
        let size = |lane: usize, back: usize| match lane {
            0 => 0.0,
            1 if back == 2 => f64::INFINITY,
            _ => 0.3 * libm::pow(4.0 * lane as f64, (order - back) as f64) * (1.0 + 0.1 * back as f64),
        };
        let largest = std::array::from_fn(|back| Octet(std::array::from_fn(|lane| size(lane, back))));
        for lane in 0..LANES {
            let time = Time { hi: 0.7 * lane as f64, lo: 1e-17 * lane as f64 };
            clock.start(lane, time, libm::exp2(lane as f64 - 3.0), if lane == 7 { 1e-3 } else { 1e9 });
        }
        clock.stop(6);
        clock.look::<Plain>();
        clock.want::<Plain>(order, &largest, Plain::splat(0.0));
        for lane in 0..LANES {
            let unit = clock.unit.0[lane];
            let alone = StepSize::new(tolerance, order, clock.longest.0[lane]).over(unit);
            let largest = std::array::from_fn(|back| size(lane, back));
            assert_eq!(clock.wanted.0[lane], alone.step_of(order, &largest), "{lane}");
            assert_eq!(clock.left.0[lane], (until - clock.at(lane)).hi, "{lane}");
        }
        assert_eq!(clock.left.0[6], 0.0);
        clock.taken = clock.wanted;
        let ends = clock.ends::<Plain>();
        for lane in 0..LANES {
            let end = clock.at(lane) + clock.wanted.0[lane];
            assert_eq!((ends[0].0[lane], ends[1].0[lane]), (end.hi, end.lo));
        }
        clock.want::<Plain>(order, &largest, Plain::splat(f64::NAN));
        assert!(clock.wanted.0.iter().all(|wanted| wanted.is_nan()));
    }
}
