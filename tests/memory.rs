//! No allocation per step, and memory that does not grow with the horizon: a counting allocator.
//!
//! The library forbids `unsafe`; an allocator cannot be written without it, and this one lives in the test
//! alone.  Counts are per thread, so that tests beside one another do not see each other.

mod common;

use common::shipped;
use driftless::dynamics::canonical::Canonical;
use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::multiplier::Multiplier;
use driftless::dynamics::natural::Natural;
use driftless::dynamics::{Form, Motion, Time};
use driftless::run::{MethodId, Problem, Request};
use driftless::stabilization::{Baumgarte, Projected};
use driftless::stepping::composition::Composition;
use driftless::stepping::gauss::Gauss;
use driftless::stepping::rattle::Rattle;
use driftless::stepping::{Dop853, Dopri5, Dp5, Dp8, Integrator, Reached, Seen, Statistics, Tolerance};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static LIVE: Cell<i64> = const { Cell::new(0) };
    static PEAK: Cell<i64> = const { Cell::new(0) };
}

fn note(bytes: i64) {
    // A thread that is ending has no counters any more.
    let _ = LIVE.try_with(|live| {
        live.set(live.get() + bytes);
        let _ = PEAK.try_with(|peak| peak.set(peak.get().max(live.get())));
    });
    if bytes > 0 {
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
    }
}

// SAFETY: every call is handed on unchanged to the system's allocator; the counters are plain cells without
// destructors.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size() as i64);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        note(-(layout.size() as i64));
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Old and new block may exist side by side.
        note(size as i64);
        let moved = unsafe { System.realloc(pointer, layout, size) };
        note(-(layout.size() as i64));
        moved
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const TOLERANCE: Tolerance = Tolerance { relative: 1e-9, absolute: 1e-9 };

/// Allocations of one call of `advance` over `span` \[s\], and its steps.
fn allocations<P: Form + ?Sized>(
    method: &mut dyn Integrator<P>,
    form: &mut P,
    start: &Motion,
    span: f64,
) -> (u64, u64) {
    let mut state = form.state(start);
    let mut statistics = Statistics::default();
    // The first call sizes scratch space and the state's memory.
    let mut advance = |until: f64| {
        let reached =
            method.advance(form, &mut state, Time::from(until), &mut statistics, &mut |_, _| Ok(Seen::Kept));
        assert_eq!(reached, Ok(Reached::Until));
        statistics.steps
    };
    let before = advance(0.125);
    let count = ALLOCATIONS.get();
    let after = advance(0.125 + span);
    (ALLOCATIONS.get() - count, after - before)
}

/// Ten times the steps take not one allocation more.
fn check<P: Form + ?Sized>(method: &mut dyn Integrator<P>, form: &mut P, start: &Motion) {
    let (short, few) = allocations(method, form, start, 0.5);
    let (long, many) = allocations(method, form, start, 5.0);
    assert!(many > 5 * few && few > 2, "{} {few} {many}", method.name());
    assert_eq!(short, long, "{} allocates: {short} in {few} steps, {long} in {many}", method.name());
    assert_eq!(short, 0, "{}", method.name());
}

#[test]
fn steps_of_a_free_scene_allocate_nothing() {
    let (mechanism, start) = common::started("free");
    let form: &mut dyn Problem = &mut Multiplier::<2, false>::new(Arc::clone(&mechanism));
    check(&mut Dp5::new(TOLERANCE), form, &start);
    check(&mut Dp8::new(TOLERANCE), form, &start);
    let canonical: &mut dyn Problem = &mut Canonical::<2, false>::new(Arc::clone(&mechanism));
    check(&mut Gauss::new(8, 1.0 / 128.0).expect("a method"), canonical, &start);
}

#[test]
fn steps_of_a_driven_scene_allocate_nothing() {
    let (mechanism, mut start) = common::started("motor_sine");
    start.omega[0] = start.omega[0] + 1e-6;
    let plain = || Multiplier::<2, true>::new(Arc::clone(&mechanism));
    let check = |method: &mut dyn Integrator<dyn Problem>, form: &mut (dyn Problem + 'static)| {
        check(method, form, &start);
    };
    check(&mut Dp8::new(TOLERANCE), &mut plain());
    check(&mut Projected::new(Dp8::new(TOLERANCE)), &mut plain());
    check(&mut Dp8::new(TOLERANCE), &mut Baumgarte::new(plain(), 0.1));
    check(&mut Dp8::new(TOLERANCE), &mut Elimination::<2>::new(Arc::clone(&mechanism)));
    check(
        &mut Gauss::new(8, 1.0 / 128.0).expect("a method"),
        &mut Canonical::<2, true>::new(Arc::clone(&mechanism)),
    );
}

#[test]
fn steps_of_rattle_allocate_nothing() {
    for name in ["free", "motor_sine"] {
        let (mechanism, start) = common::started(name);
        let mut natural = Natural::new(Arc::clone(&mechanism)).expect("a natural form");
        let mut rattle = Rattle::new(Composition::Suzuki5, 1.0 / 128.0);
        check(&mut rattle, &mut natural, &start);
    }
}

/// A window of `ode_solvers` allocates its own rows; the number of windows is ours, and each costs the same.
#[test]
fn windows_cost_the_same_each() {
    let (mechanism, start) = common::started("gentle");
    let methods: [Box<dyn Integrator<dyn Problem>>; 2] =
        [Box::new(Dopri5::new(TOLERANCE)), Box::new(Dop853::new(TOLERANCE))];
    for mut method in methods {
        let mut form = Multiplier::<2, false>::new(Arc::clone(&mechanism));
        let mut state = form.state(&start);
        let mut most = 0;
        let mut statistics = Statistics::default();
        for row in 1..=200 {
            let count = ALLOCATIONS.get();
            let reached = method.advance(
                &mut form,
                &mut state,
                Time::from(0.0625 * f64::from(row)),
                &mut statistics,
                &mut |_, _| Ok(Seen::Kept),
            );
            assert_eq!(reached, Ok(Reached::Until));
            if row > 1 {
                most = most.max(ALLOCATIONS.get() - count);
            }
        }
        println!("{}: {most} allocations a window", method.name());
        assert!(most < 100, "{}: {most}", method.name());
    }
}

/// Peak of the heap above where it stood, over a run of so many rows.
fn peak(method: MethodId, rows: f64) -> i64 {
    let mut scene = shipped("gentle", &[]);
    (scene.every, scene.until) = (0.0625, 0.0625 * rows);
    let before = LIVE.get();
    PEAK.set(before);
    let step = if method.is_adaptive() { None } else { Some(0.0625) };
    let rtol = if method.is_adaptive() { Some(1e-6) } else { None };
    let outcome = common::run(&scene, &Request { method: Some(method), step, rtol, ..Request::default() });
    assert_eq!((outcome.stop, outcome.plan.rows), (None, rows as u64));
    PEAK.get() - before
}

#[test]
fn the_peak_does_not_grow_with_the_horizon() {
    const LIMIT: i64 = 2 << 20;
    for method in [MethodId::Dp8, MethodId::Dop853, MethodId::Gauss(4)] {
        let (short, long) = (peak(method, 1e3), peak(method, 1e5));
        println!("{method}: {short} {long} bytes");
        assert!((long - short).abs() < LIMIT, "{method}: {short} and {long} bytes");
    }
}
