//! Two bodies, one of them driven from the ground by sines: a single trajectory in the code of the lanes,
//! whose equations stand in `batch/swinging.rs`.
//!
//! Of the four lanes of a vector one counts, and its bits are those of a trajectory among others.  Wins over
//! the series of any mechanism (whole runs by `taylor`): 2.6 times on `motor_sine` at 1e-9, 2.8 at 1e-13.

use super::HIGHEST_ORDER;
use super::batch::{BatchMember, LaneClock, LaneKernel, SwingingLanes, swinging_law};
use super::step_size::{self, StepSize};
use crate::arithmetic::eight::{LANES, Octet};
use crate::arithmetic::lanes::Lanes;
use crate::arithmetic::lanes::wide::{FirstHalf, Vectors};
use crate::dynamics::{Mechanism, State, Time};

/// Angle, rate and work.
const UNKNOWNS: usize = 3;

/// The trajectory, and the series of its last step.
#[derive(Clone, Debug)]
pub struct Swinging {
    kernel: SwingingLanes,
    clock: LaneClock,
    step_size: StepSize,
    order: usize,
}

impl Swinging {
    /// For an order of at most [`HIGHEST_ORDER`], where this form fits.
    pub fn new(mechanism: &Mechanism, tolerance: f64, order: usize) -> Option<Self> {
        // An acceleration would make the motor faster than the steps are made for.
        swinging_law(mechanism).filter(|law| law.acceleration == 0.0 && order <= HIGHEST_ORDER)?;
        let zero = vec![0.0; UNKNOWNS];
        let state = State { y: zero.clone(), low: zero, ..State::default() };
        let member = BatchMember::new(mechanism, state);
        let mut kernel = SwingingLanes::new(&member, order, Vectors::Portable);
        let longest = kernel.take_in(0, &member, order);
        let step_size = StepSize::new(tolerance, order, longest).over(mechanism.units.time);
        Some(Self { kernel, clock: LaneClock::new(tolerance, order, Time::default()), step_size, order })
    }
}

/// One step of at most `left` \[s\]; returns the step wanted, and leaves the state alone where it is useless.
#[inline(always)]
pub fn step<L: Lanes>(own: &mut Swinging, state: &mut State, left: f64) -> (f64, f64) {
    let Swinging { kernel, clock, step_size, order } = own;
    clock.set(0, state.time);
    kernel.set_state(0, state);
    kernel.begin::<FirstHalf<L>>(clock);
    kernel.expand::<FirstHalf<L>>(*order);
    let sizes = kernel.sizes::<FirstHalf<L>>(*order);
    if !kernel.power_of(0, 0, *order).is_finite() {
        return (f64::NAN, 0.0);
    }
    let mut largest = [0.0; super::JUDGES];
    for (largest, sizes) in largest.iter_mut().zip(&sizes) {
        *largest = sizes.0[0];
    }
    let wanted = step_size.step_of(*order, &largest);
    let h = step_size::taken(wanted, left);
    if h > 0.0 {
        go::<L>(own, state, h);
    }
    (wanted, h)
}

/// Takes a state that stands where the last step began on by `h` \[s\].
#[inline(always)]
pub fn go<L: Lanes>(own: &mut Swinging, state: &mut State, h: f64) {
    own.kernel.set_state(0, state);
    let mut taken = [0.0; LANES];
    taken[0] = h;
    own.kernel.finish::<FirstHalf<L>>(own.order, &Octet(taken));
    own.kernel.write_state(0, state);
}
