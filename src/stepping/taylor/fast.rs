//! Which fast kernel fits a mechanism, an order and the processor; the one place where compiled-for-the-processor code is entered.

use super::pace::Pace;
use super::pair::{self, Pair};
use crate::arithmetic::lanes::{self, Portable};
use crate::dynamics::{Mechanism, State};

/// A kernel ready to run.
#[derive(Clone, Debug)]
pub struct Fast {
    pair: Pair,
    pace: Pace,
    scratch: Box<pair::Scratch>,
    step: Step,
}

/// One step of at most so many seconds: the step wanted and the step taken.
type Step = unsafe fn(&Pair, &Pace, &mut pair::Scratch, &mut pair::Flow, f64) -> (f64, f64);

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx,fma")]
fn hardware<const P: usize>(pair: &Pair, pace: &Pace, scratch: &mut pair::Scratch, flow: &mut pair::Flow, left: f64) -> (f64, f64) {
    pair::step::<lanes::Avx, P>(pair, pace, scratch, flow, left)
}

fn portable<const P: usize>(pair: &Pair, pace: &Pace, scratch: &mut pair::Scratch, flow: &mut pair::Flow, left: f64) -> (f64, f64) {
    pair::step::<Portable, P>(pair, pace, scratch, flow, left)
}

/// The kernel of one order for this processor.
fn of_order<const P: usize>(is_portable: bool) -> Step {
    #[cfg(target_arch = "x86_64")]
    if !is_portable && lanes::available() {
        return hardware::<P>;
    }
    portable::<P>
}

impl Fast {
    /// The kernel, where there is one.
    pub fn new(mechanism: &Mechanism, tolerance: f64, order: usize, is_portable: bool) -> Option<Self> {
        let pair = Pair::new(mechanism)?;
        let step = match order {
            16 => of_order::<16>(is_portable),
            20 => of_order::<20>(is_portable),
            24 => of_order::<24>(is_portable),
            _ => return None,
        };
        let pace = Pace::new(tolerance, order, pair.longest(order));
        Some(Self { pair, pace, scratch: Box::default(), step })
    }

    /// One step of at most `left` \[s\] from the state's unknowns, which are then the new ones; returns the step wanted and the step taken.
    #[inline]
    pub fn step(&mut self, state: &mut State, left: f64) -> (f64, f64) {
        let ([phi1, phi2, v1, v2, ..], [phi1_low, phi2_low, v1_low, v2_low, ..]) = (&mut state.y[..], &mut state.low[..]) else {
            return (f64::NAN, 0.0);
        };
        let mut flow = pair::Flow { high: [*phi1, *v1, *phi2, *v2], low: [*phi1_low, *v1_low, *phi2_low, *v2_low] };
        // SAFETY: `of_order` hands out code for AVX and FMA only after the processor was asked for them; all else in it is safe code.
        #[allow(unsafe_code)]
        let (wanted, taken) = unsafe { (self.step)(&self.pair, &self.pace, &mut self.scratch, &mut flow, left) };
        [*phi1, *v1, *phi2, *v2] = flow.high;
        [*phi1_low, *v1_low, *phi2_low, *v2_low] = flow.low;
        (wanted, taken)
    }
}
