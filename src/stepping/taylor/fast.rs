//! Which fast kernel fits a mechanism and an order.

use super::bodies::{self, Bodies};
use super::driven::{self, Driven};
use super::extended;
use super::looped::{self, Looped};
use super::pair::{self, Pair};
use super::step_size::StepSize;
use super::swinging::{self, Swinging};
use crate::arithmetic::lanes::{self, Code, Lanes};
use crate::dynamics::natural::Reduced;
use crate::dynamics::{Mechanism, MotionPowers, State};

/// The least order mechanisms with loops are expanded to: each costs little beside the matrices of the step.
const LOOPED: usize = 20;
/// The order of the extended kernel.
const EXTENDED: usize = 24;

/// A kernel ready to run.
#[derive(Clone, Debug)]
pub struct Fast {
    settings: Settings,
    form: Form,
    step: Step,
    go: Go,
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

/// What it runs on; the first three do not know their pace.
#[derive(Clone, Debug)]
enum Form {
    Pair(Pair, StepSize, Box<pair::Scratch>),
    Extended(Pair, StepSize, Box<extended::Scratch>),
    Driven(Box<Driven>, StepSize, Box<driven::Scratch>),
    Swinging(Box<Swinging>),
    Few(Box<Bodies<1, 0>>),
    Several(Box<Bodies<2, 0>>),
    FewSprung(Box<Bodies<1, 1>>),
    SeveralSprung(Box<Bodies<2, 1>>),
    FewLooped(Box<Looped<1>>),
    SeveralLooped(Box<Looped<2>>),
    ManyLooped(Box<Looped<4>>),
}

/// One step of a state by at most so many seconds, without the processor's vectors where the last is true:
/// the step wanted and the step taken, or `None` where the series of any mechanism must take over.
type Step = fn(&mut Form, &mut State, f64, bool) -> Option<(f64, f64)>;

/// From the last step's start on by so many seconds, likewise.
type Go = fn(&mut Form, &mut State, f64, bool);

/// A step of order `P`.
struct Stepping<'a, const P: usize>(&'a mut Form, &'a mut State, f64);

impl<const P: usize> Code for Stepping<'_, P> {
    type Output = Option<(f64, f64)>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<(f64, f64)> {
        step::<L, P>(self.0, self.1, self.2)
    }
}

/// A way on by a series of order `P`.
struct Going<'a, const P: usize>(&'a mut Form, &'a mut State, f64);

impl<const P: usize> Code for Going<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        go::<L, P>(self.0, self.1, self.2);
    }
}

/// The code of one order.
fn of_order<const P: usize>() -> (Step, Go) {
    (
        |form, state, left, is_portable| lanes::run(Stepping::<P>(form, state, left), is_portable),
        |form, state, h, is_portable| lanes::run(Going::<P>(form, state, h), is_portable),
    )
}

#[inline(always)]
fn step<L: Lanes, const P: usize>(form: &mut Form, state: &mut State, left: f64) -> Option<(f64, f64)> {
    Some(match form {
        Form::Pair(pair, step_size, scratch) => {
            let mut flow = pair::Flow::of(pair, state);
            let steps = pair::step::<L, P>(pair, step_size, scratch, &mut flow, left);
            flow.write(pair, state);
            steps
        }
        Form::Extended(pair, step_size, scratch) if P == EXTENDED => {
            let mut flow = pair::Flow::of(pair, state);
            let steps = extended::step::<L, P>(pair, step_size, scratch, &mut flow, left);
            flow.write(pair, state);
            steps
        }
        Form::Driven(driven, step_size, scratch) => {
            let mut flow = driven::Flow::of(state);
            let steps = driven::step::<L, P>(driven, step_size, scratch, &mut flow, state.time, left);
            flow.write(state);
            steps
        }
        _ => (f64::NAN, 0.0),
    })
}

/// Takes a state from the last step's start on by `h` \[s\].
#[inline(always)]
fn go<L: Lanes, const P: usize>(form: &mut Form, state: &mut State, h: f64) {
    match form {
        Form::Pair(pair, _, scratch) => {
            let mut flow = pair::Flow::of(pair, state);
            pair::go::<L, P>(scratch, &mut flow, h);
            flow.write(pair, state);
        }
        Form::Extended(pair, _, scratch) => {
            let mut flow = pair::Flow::of(pair, state);
            extended::go::<L, P>(scratch, &mut flow, h);
            flow.write(pair, state);
        }
        Form::Driven(driven, _, scratch) => {
            let mut flow = driven::Flow::of(state);
            driven::go::<L, P>(driven, scratch, &mut flow, h);
            flow.write(state);
        }
        _ => {}
    }
}

/// A step of any order, by the forms that know theirs.
struct AnyStepping<'a>(&'a mut Form, &'a mut State, f64);

impl Code for AnyStepping<'_> {
    type Output = Option<(f64, f64)>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<(f64, f64)> {
        any_step::<L>(self.0, self.1, self.2)
    }
}

/// A way on by such a series.
struct AnyGoing<'a>(&'a mut Form, &'a mut State, f64);

impl Code for AnyGoing<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        any_go::<L>(self.0, self.1, self.2);
    }
}

/// The code of all orders.
fn of_any() -> (Step, Go) {
    (
        |form, state, left, is_portable| lanes::run(AnyStepping(form, state, left), is_portable),
        |form, state, h, is_portable| lanes::run(AnyGoing(form, state, h), is_portable),
    )
}

#[inline(always)]
fn any_step<L: Lanes>(form: &mut Form, state: &mut State, left: f64) -> Option<(f64, f64)> {
    match form {
        Form::Swinging(swinging) => Some(swinging::step::<L>(swinging, state, left)),
        Form::Few(bodies) => Some(bodies::step::<L, _, _>(bodies, state, left)),
        Form::Several(bodies) => Some(bodies::step::<L, _, _>(bodies, state, left)),
        Form::FewSprung(bodies) => Some(bodies::step::<L, _, _>(bodies, state, left)),
        Form::SeveralSprung(bodies) => Some(bodies::step::<L, _, _>(bodies, state, left)),
        Form::FewLooped(looped) => looped::step::<L, 1>(looped, state, left),
        Form::SeveralLooped(looped) => looped::step::<L, 2>(looped, state, left),
        Form::ManyLooped(looped) => looped::step::<L, 4>(looped, state, left),
        _ => None,
    }
}

#[inline(always)]
fn any_go<L: Lanes>(form: &mut Form, state: &mut State, h: f64) {
    match form {
        Form::Swinging(swinging) => swinging::go::<L>(swinging, state, h),
        Form::Few(bodies) => bodies::go::<L, _, _>(bodies, state, h),
        Form::Several(bodies) => bodies::go::<L, _, _>(bodies, state, h),
        Form::FewSprung(bodies) => bodies::go::<L, _, _>(bodies, state, h),
        Form::SeveralSprung(bodies) => bodies::go::<L, _, _>(bodies, state, h),
        Form::FewLooped(looped) => looped::go::<L, 1>(looped, state, h),
        Form::SeveralLooped(looped) => looped::go::<L, 2>(looped, state, h),
        Form::ManyLooped(looped) => looped::go::<L, 4>(looped, state, h),
        _ => {}
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
        let settings =
            || Settings { mechanism: mechanism.clone(), tolerance, order, is_portable, is_extended };
        let step_size = |longest| StepSize::new(tolerance, order, longest).over(mechanism.units.time);
        let form = if is_extended {
            let pair = Pair::new(mechanism).filter(|_| order == EXTENDED)?;
            let step_size = step_size(pair.longest(order));
            Form::Extended(pair, step_size, Box::default())
        } else if let Some(pair) = Pair::new(mechanism) {
            let step_size = step_size(pair.longest(order));
            Form::Pair(pair, step_size, Box::default())
        } else if let Some(driven) = Driven::new(mechanism) {
            let step_size = step_size(driven.longest(order));
            Form::Driven(Box::new(driven), step_size, Box::default())
        } else {
            let swinging = Swinging::new(mechanism, tolerance, order).map(Box::new).map(Form::Swinging);
            let form = swinging.or_else(|| Self::bodies(mechanism, tolerance, order))?;
            return Some(Self::of_any(settings(), form));
        };
        let (step, go) = match order {
            16 => of_order::<16>(),
            20 => of_order::<20>(),
            24 => of_order::<24>(),
            _ => return None,
        };
        Some(Self { settings: settings(), form, step, go })
    }

    /// The smallest form that has room for all bodies and springs.
    fn bodies(mechanism: &Mechanism, tolerance: f64, order: usize) -> Option<Form> {
        fn of<const B: usize, const S: usize>(
            (mechanism, tolerance, order): (&Mechanism, f64, usize),
        ) -> Option<Box<Bodies<B, S>>> {
            Bodies::new(mechanism, tolerance, order).map(Box::new)
        }
        let wanted = (mechanism, tolerance, order);
        let free = of(wanted).map(Form::Few).or_else(|| of(wanted).map(Form::Several));
        free.or_else(|| of(wanted).map(Form::FewSprung)).or_else(|| of(wanted).map(Form::SeveralSprung))
    }

    /// The kernel of a mechanism with loops, where there is one: it sums the best of all orders up to the one
    /// asked for, or to 20 where that is higher.
    pub fn of_looped(
        mechanism: &Mechanism,
        reduced: &Reduced,
        tolerance: f64,
        order: usize,
        is_portable: bool,
    ) -> Option<Self> {
        let highest = order.max(LOOPED);
        let form = match mechanism.bodies.len() {
            0..=4 => Form::FewLooped(Box::new(Looped::new(mechanism, reduced, tolerance, highest)?)),
            5..=8 => Form::SeveralLooped(Box::new(Looped::new(mechanism, reduced, tolerance, highest)?)),
            _ => Form::ManyLooped(Box::new(Looped::new(mechanism, reduced, tolerance, highest)?)),
        };
        let settings =
            Settings { mechanism: mechanism.clone(), tolerance, order, is_portable, is_extended: false };
        Some(Self::of_any(settings, form))
    }

    /// With a form that knows its order and its pace.
    fn of_any(settings: Settings, form: Form) -> Self {
        let (step, go) = of_any();
        Self { settings, form, step, go }
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
        (self.step)(&mut self.form, state, left, self.settings.is_portable)
    }

    /// Takes a state that stands where the last step began on by `h` \[s\], as the step would have.
    pub fn go(&mut self, state: &mut State, h: f64) {
        (self.go)(&mut self.form, state, h, self.settings.is_portable);
    }

    /// Writes the powers of the last step; false where the form keeps none of unit vectors and rates alone.
    pub fn powers(&self, powers: &mut MotionPowers) -> bool {
        match &self.form {
            Form::Pair(pair, _, scratch) => pair.powers(scratch, self.settings.order, powers),
            Form::Few(bodies) => bodies.powers(powers),
            Form::Several(bodies) => bodies.powers(powers),
            _ => return false,
        }
        true
    }
}
