//! Laws of motors in the lanes: a constant rate, an acceleration, sines.

use super::super::terms::over;
use super::super::wide::Wide;
use super::{HIGHEST_ORDER, LaneClock, load, pair, store};
use crate::arithmetic::DoubleDouble;
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::Arithmetic;
use crate::arithmetic::lanes::wide::EightLanes;
use crate::arithmetic::sincos;
use crate::arithmetic::sum::WHOLE;
use crate::scene::Law;

/// Powers of a rate: what order `HIGHEST_ORDER` of the free body asks for.
pub(super) const RATES: usize = HIGHEST_ORDER + 2;
const ZERO: Octet = Octet([0.0; LANES]);

/// The law of each lane, and where it is.
#[derive(Clone, Debug)]
pub(super) struct LaneLaws {
    /// Time \[s\] in two terms.
    time: [Octet; 2],
    start: Octet,
    pub rate: Octet,
    acceleration: Octet,
    /// As many as the lane with most of them had; those that others have not are zero.
    sines: Vec<LaneSine>,
    /// The angle \[rad\] in [-π, π], in two terms.
    pub angle: [Octet; 2],
    /// Powers of the rate, where they were asked for.
    pub rates: [Octet; RATES],
}

/// One sine of each law, and cosine and sine of its argument.
#[derive(Clone, Copy, Debug)]
struct LaneSine {
    amplitude: Octet,
    frequency: Octet,
    phase: Octet,
    cos: Octet,
    sin: Octet,
}

impl LaneLaws {
    /// Laws that do nothing.
    pub fn new() -> Self {
        Self {
            time: [ZERO; 2],
            start: ZERO,
            rate: ZERO,
            acceleration: ZERO,
            sines: Vec::new(),
            angle: [ZERO; 2],
            rates: [ZERO; RATES],
        }
    }

    /// The law of a lane.
    pub fn take_in(&mut self, lane: usize, law: &Law) {
        (self.start.0[lane], self.rate.0[lane]) = (law.start, law.rate);
        self.acceleration.0[lane] = law.acceleration;
        let none = LaneSine { amplitude: ZERO, frequency: ZERO, phase: ZERO, cos: ZERO, sin: ZERO };
        self.sines.resize(self.sines.len().max(law.sines.len()), none);
        for (i, sine) in self.sines.iter_mut().enumerate() {
            let [amplitude, frequency, phase] =
                law.sines.get(i).map_or([0.0; 3], |sine| [sine.amplitude, sine.frequency, sine.phase]);
            (sine.amplitude.0[lane], sine.frequency.0[lane]) = (amplitude, frequency);
            sine.phase.0[lane] = phase;
        }
    }

    /// Angles and arguments of sines where the steps begin.
    #[inline(always)]
    pub fn begin<W: EightLanes>(&mut self, clock: &LaneClock) {
        self.time = clock.time;
        let time = pair::<W>([&self.time[0], &self.time[1]]);
        let bend = load::<W>(&self.acceleration).mul(W::splat(0.5));
        let mut angle = time.scale(load(&self.rate)).add(Wide::of(load(&self.start)));
        angle = angle.add(time.mul(time).scale(bend));
        for sine in &mut self.sines {
            let argument = time.scale(load(&sine.frequency));
            let argument = reduced(argument.add(Wide::of(load(&sine.phase))));
            let ([sin, rest], [cos, _]) = sincos::sin_cos_pair([argument.hi, argument.lo]);
            angle = angle.add(Wide { hi: sin, lo: rest }.scale(load(&sine.amplitude)));
            (sine.cos, sine.sin) = (store(cos), store(sin));
        }
        let angle = reduced(angle);
        self.angle = [store(angle.hi), store(angle.lo)];
    }

    /// Powers of the rates.
    #[inline(always)]
    pub fn expand<W: EightLanes>(&mut self) {
        let slope = load::<W>(&self.acceleration);
        self.rates = [ZERO; RATES];
        self.rates[0] = store(slope.mul_add(load(&self.time[0]), load(&self.rate)));
        self.rates[1] = self.acceleration;
        for sine in &self.sines {
            let (frequency, cos, sin) =
                (load::<W>(&sine.frequency), load::<W>(&sine.cos), load::<W>(&sine.sin));
            let mut factor = load::<W>(&sine.amplitude).mul(frequency);
            self.rates[0] = store(factor.mul_add(cos, load(&self.rates[0])));
            // The m-th derivative of A f cos is A f^(m+1) cos, -sin, -cos, sin.
            let mut m = 1;
            while m < RATES {
                factor = over(factor.mul(frequency), m);
                let (before, part) = (load::<W>(&self.rates[m]), if m % 2 == 0 { cos } else { sin });
                let is_negative = m % 4 == 1 || m % 4 == 2;
                let sum =
                    if is_negative { part.neg_mul_add(factor, before) } else { part.mul_add(factor, before) };
                self.rates[m] = store(sum);
                m += 1;
            }
        }
    }
}

/// An angle \[rad\] less whole turns, in [-π, π].
#[inline(always)]
pub(super) fn reduced<L: Arithmetic>(angle: Wide<L>) -> Wide<L> {
    let shift = L::splat(WHOLE);
    let turns = angle.hi.mul_add(L::splat(1.0 / std::f64::consts::TAU), shift).sub(shift);
    let (high, low) = (DoubleDouble::TAU.hi, DoubleDouble::TAU.lo);
    angle.add(Wide { hi: L::splat(high), lo: L::splat(low) }.scale(turns).minus())
}
