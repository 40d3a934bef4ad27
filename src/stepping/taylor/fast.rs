//! Which fast kernel fits a mechanism and an order.

use super::bodies::{self, Bodies};
use super::driven::{self, DrivenKernel};
use super::extended;
use super::looped::{self, LoopedKernel};
use super::pair::{self, PairKernel};
use super::step_size::StepSize;
use super::swinging::{self, Swinging};
use crate::arithmetic::lanes::{self, Code, Lanes};
use crate::dynamics::natural::ReducedMatrices;
use crate::dynamics::{Mechanism, MotionPowers, State};
use std::fmt::Debug;

/// The least order mechanisms with loops are expanded to: each costs little beside the matrices of the step.
const LOOPED: usize = 20;
/// The order of the extended kernel.
const EXTENDED: usize = 24;

/// A kernel ready to run.
#[derive(Clone, Debug)]
pub struct Fast {
    settings: Settings,
    kernel: Box<dyn FastKernel>,
}

/// What it was made for.
#[derive(Clone, Debug, PartialEq)]
struct Settings {
    mechanism: Mechanism,
    tolerance: f64,
    order: usize,
    is_portable: bool,
    is_extended: bool,
}

/// A mechanism's own series, with its scratch space.
trait FastSeries: Clone + Debug + Send + Sync + 'static {
    /// One step of a state by at most `left` \[s\]: the step wanted and the step taken, or `None` where the
    /// series of any mechanism must take over.
    fn step<L: Lanes>(&mut self, state: &mut State, left: f64) -> Option<(f64, f64)>;

    /// Takes a state that stands where the last step began on by `h` \[s\].
    fn go<L: Lanes>(&mut self, state: &mut State, h: f64);

    /// Writes the powers of the last step; false where it keeps none of unit vectors and rates alone.
    fn powers(&self, _powers: &mut MotionPowers) -> bool {
        false
    }
}

/// The same in code of its own for the processor's vectors, or without them.
trait FastKernel: Debug + Send + Sync {
    fn step(&mut self, state: &mut State, left: f64, is_portable: bool) -> Option<(f64, f64)>;
    fn go(&mut self, state: &mut State, h: f64, is_portable: bool);
    fn powers(&self, powers: &mut MotionPowers) -> bool;
    fn boxed(&self) -> Box<dyn FastKernel>;
}

impl<S: FastSeries> FastKernel for S {
    fn step(&mut self, state: &mut State, left: f64, is_portable: bool) -> Option<(f64, f64)> {
        lanes::run(FastStep(self, state, left), is_portable)
    }

    fn go(&mut self, state: &mut State, h: f64, is_portable: bool) {
        lanes::run(FastAdvance(self, state, h), is_portable);
    }

    fn powers(&self, powers: &mut MotionPowers) -> bool {
        FastSeries::powers(self, powers)
    }

    fn boxed(&self) -> Box<dyn FastKernel> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn FastKernel> {
    fn clone(&self) -> Self {
        self.boxed()
    }
}

/// A step.
struct FastStep<'a, S>(&'a mut S, &'a mut State, f64);

impl<S: FastSeries> Code for FastStep<'_, S> {
    type Output = Option<(f64, f64)>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<(f64, f64)> {
        self.0.step::<L>(self.1, self.2)
    }
}

/// A way on.
struct FastAdvance<'a, S>(&'a mut S, &'a mut State, f64);

impl<S: FastSeries> Code for FastAdvance<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.0.go::<L>(self.1, self.2);
    }
}

/// Two bodies, by a series of order `P`.
#[derive(Clone, Debug)]
struct OfPair<const P: usize>(PairKernel, StepSize, Box<pair::PairScratch>);

impl<const P: usize> FastSeries for OfPair<P> {
    #[inline(always)]
    fn step<L: Lanes>(&mut self, state: &mut State, left: f64) -> Option<(f64, f64)> {
        let Self(pair, step_size, scratch) = self;
        let mut flow = pair::PairFlow::of(pair, state);
        let steps = pair::step::<L, P>(pair, step_size, scratch, &mut flow, left);
        flow.write(pair, state);
        Some(steps)
    }

    #[inline(always)]
    fn go<L: Lanes>(&mut self, state: &mut State, h: f64) {
        let mut flow = pair::PairFlow::of(&self.0, state);
        pair::go::<L, P>(&self.2, &mut flow, h);
        flow.write(&self.0, state);
    }

    fn powers(&self, powers: &mut MotionPowers) -> bool {
        self.0.powers(&self.2, P, powers);
        true
    }
}

/// The same with the first orders in double-double.
#[derive(Clone, Debug)]
struct OfExtended(PairKernel, StepSize, Box<extended::ExtendedScratch>);

impl FastSeries for OfExtended {
    #[inline(always)]
    fn step<L: Lanes>(&mut self, state: &mut State, left: f64) -> Option<(f64, f64)> {
        let Self(pair, step_size, scratch) = self;
        let mut flow = pair::PairFlow::of(pair, state);
        let steps = extended::step::<L, EXTENDED>(pair, step_size, scratch, &mut flow, left);
        flow.write(pair, state);
        Some(steps)
    }

    #[inline(always)]
    fn go<L: Lanes>(&mut self, state: &mut State, h: f64) {
        let mut flow = pair::PairFlow::of(&self.0, state);
        extended::go::<L, EXTENDED>(&self.2, &mut flow, h);
        flow.write(&self.0, state);
    }
}

/// A bar on one that a motor turns evenly, by a series of order `P`.
#[derive(Clone, Debug)]
struct OfDriven<const P: usize>(Box<DrivenKernel>, StepSize, Box<driven::DrivenScratch>);

impl<const P: usize> FastSeries for OfDriven<P> {
    #[inline(always)]
    fn step<L: Lanes>(&mut self, state: &mut State, left: f64) -> Option<(f64, f64)> {
        let Self(driven, step_size, scratch) = self;
        let mut flow = driven::DrivenFlow::of(state);
        let steps = driven::step::<L, P>(driven, step_size, scratch, &mut flow, state.time, left);
        flow.write(state);
        Some(steps)
    }

    #[inline(always)]
    fn go<L: Lanes>(&mut self, state: &mut State, h: f64) {
        let mut flow = driven::DrivenFlow::of(state);
        driven::go::<L, P>(&self.0, &self.2, &mut flow, h);
        flow.write(state);
    }
}

impl FastSeries for Swinging {
    #[inline(always)]
    fn step<L: Lanes>(&mut self, state: &mut State, left: f64) -> Option<(f64, f64)> {
        Some(swinging::step::<L>(self, state, left))
    }

    #[inline(always)]
    fn go<L: Lanes>(&mut self, state: &mut State, h: f64) {
        swinging::go::<L>(self, state, h);
    }
}

impl<const B: usize, const S: usize> FastSeries for Bodies<B, S> {
    #[inline(always)]
    fn step<L: Lanes>(&mut self, state: &mut State, left: f64) -> Option<(f64, f64)> {
        Some(bodies::step::<L, B, S>(self, state, left))
    }

    #[inline(always)]
    fn go<L: Lanes>(&mut self, state: &mut State, h: f64) {
        bodies::go::<L, B, S>(self, state, h);
    }

    fn powers(&self, powers: &mut MotionPowers) -> bool {
        // Springs have unknowns of their own.
        if S == 0 {
            self.powers(powers);
        }
        S == 0
    }
}

impl<const B: usize> FastSeries for LoopedKernel<B> {
    #[inline(always)]
    fn step<L: Lanes>(&mut self, state: &mut State, left: f64) -> Option<(f64, f64)> {
        looped::step::<L, B>(self, state, left)
    }

    #[inline(always)]
    fn go<L: Lanes>(&mut self, state: &mut State, h: f64) {
        looped::go::<L, B>(self, state, h);
    }
}

impl Fast {
    /// The kernel, where there is one; `is_extended`: with the first orders in double-double.
    pub fn new(
        mechanism: &Mechanism,
        tolerance: f64,
        order: usize,
        is_portable: bool,
        is_extended: bool,
    ) -> Option<Self> {
        let step_size = |longest| StepSize::new(tolerance, order, longest).over(mechanism.units.time);
        let kernel: Box<dyn FastKernel> = if is_extended {
            let pair = PairKernel::new(mechanism).filter(|_| order == EXTENDED)?;
            let step_size = step_size(pair.longest(order));
            Box::new(OfExtended(pair, step_size, Box::default()))
        } else if let Some(pair) = PairKernel::new(mechanism) {
            let step_size = step_size(pair.longest(order));
            match order {
                16 => Box::new(OfPair::<16>(pair, step_size, Box::default())),
                20 => Box::new(OfPair::<20>(pair, step_size, Box::default())),
                24 => Box::new(OfPair::<24>(pair, step_size, Box::default())),
                _ => return None,
            }
        } else if let Some(driven) = DrivenKernel::new(mechanism).map(Box::new) {
            let step_size = step_size(driven.longest(order));
            match order {
                16 => Box::new(OfDriven::<16>(driven, step_size, Box::default())),
                20 => Box::new(OfDriven::<20>(driven, step_size, Box::default())),
                24 => Box::new(OfDriven::<24>(driven, step_size, Box::default())),
                _ => return None,
            }
        } else if let Some(swinging) = Swinging::new(mechanism, tolerance, order) {
            Box::new(swinging)
        } else {
            Self::bodies(mechanism, tolerance, order)?
        };
        let settings = Settings { mechanism: mechanism.clone(), tolerance, order, is_portable, is_extended };
        Some(Self { settings, kernel })
    }

    /// The smallest series that has room for all bodies and springs.
    fn bodies(mechanism: &Mechanism, tolerance: f64, order: usize) -> Option<Box<dyn FastKernel>> {
        fn of<const B: usize, const S: usize>(
            (mechanism, tolerance, order): (&Mechanism, f64, usize),
        ) -> Option<Box<dyn FastKernel>> {
            Bodies::<B, S>::new(mechanism, tolerance, order)
                .map(|bodies| Box::new(bodies) as Box<dyn FastKernel>)
        }
        let wanted = (mechanism, tolerance, order);
        let free = of::<1, 0>(wanted).or_else(|| of::<2, 0>(wanted));
        free.or_else(|| of::<1, 1>(wanted)).or_else(|| of::<2, 1>(wanted))
    }

    /// The kernel of a mechanism with loops, where there is one: it sums the best of all orders up to the one
    /// asked for, or to 20 where that is higher.
    pub fn of_looped(
        mechanism: &Mechanism,
        reduced: &ReducedMatrices,
        tolerance: f64,
        order: usize,
        is_portable: bool,
    ) -> Option<Self> {
        fn of<const B: usize>(
            (mechanism, reduced): (&Mechanism, &ReducedMatrices),
            tolerance: f64,
            order: usize,
        ) -> Option<Box<dyn FastKernel>> {
            let looped = LoopedKernel::<B>::new(mechanism, reduced, tolerance, order)?;
            Some(Box::new(looped))
        }
        let (wanted, highest) = ((mechanism, reduced), order.max(LOOPED));
        let kernel = match mechanism.bodies.len() {
            0..=4 => of::<1>(wanted, tolerance, highest)?,
            5..=8 => of::<2>(wanted, tolerance, highest)?,
            _ => of::<4>(wanted, tolerance, highest)?,
        };
        let settings =
            Settings { mechanism: mechanism.clone(), tolerance, order, is_portable, is_extended: false };
        Some(Self { settings, kernel })
    }

    /// True where it was made for all these.
    pub fn is_for(
        &self,
        mechanism: &Mechanism,
        tolerance: f64,
        order: usize,
        is_portable: bool,
        is_extended: bool,
    ) -> bool {
        let made = &self.settings;
        (made.tolerance, made.order, made.is_portable, made.is_extended)
            == (tolerance, order, is_portable, is_extended)
            && made.mechanism == *mechanism
    }

    /// One step of at most `left` \[s\] from the state's unknowns, which are then the new ones; returns the
    /// step wanted and the step taken.
    #[inline]
    pub fn step(&mut self, state: &mut State, left: f64) -> Option<(f64, f64)> {
        self.kernel.step(state, left, self.settings.is_portable)
    }

    /// Takes a state that stands where the last step began on by `h` \[s\], as the step would have.
    pub fn go(&mut self, state: &mut State, h: f64) {
        self.kernel.go(state, h, self.settings.is_portable);
    }

    /// Writes the powers of the last step; false where the series keeps none of unit vectors and rates alone.
    pub fn powers(&self, powers: &mut MotionPowers) -> bool {
        self.kernel.powers(powers)
    }
}
