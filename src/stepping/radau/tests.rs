use super::*;

/// y' = y² cos t, y = 1/(2 - sin t): nonlinear, and a stage at a wrong time costs the order.
struct Bernoulli;

fn exact(t: f64) -> f64 {
    1.0 / (2.0 - t.sin())
}

impl OdeSystem for Bernoulli {
    fn dimension(&self) -> usize {
        1
    }

    fn angles(&self) -> usize {
        0
    }

    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        rate[0] = y[0] * y[0] * t.hi.cos();
    }

    fn jacobian(&mut self, t: Time, y: &[f64], jacobian: &mut [f64]) -> bool {
        jacobian[0] = 2.0 * y[0] * t.hi.cos();
        true
    }

    fn label(&self, _: usize) -> String {
        "y".into()
    }
}

/// The error after steps of `h` to t = 3, whatever its estimate says.
fn error(stages: usize, count: u32) -> f64 {
    let mut radau = Radau::new(stages, Tolerance { relative: 1e-12, absolute: 1e-12 }).expect("a method");
    let (h, mut statistics) = (3.0 / f64::from(count), Statistics::default());
    let mut state = State { y: vec![exact(0.0)], low: vec![0.0], ..State::default() };
    radau.resize(1);
    for step in 1..=count {
        scales(radau.tolerance, &state.y, &[1.0], &mut radau.work.scale);
        radau.differentiate(&mut Bernoulli, Some(&state), &mut statistics);
        // Goes on from where the iteration before gave up.
        assert!(
            (0..5).any(|_| radau.repeat(&mut Bernoulli, &state, h, &mut statistics)),
            "step {step} of {count}"
        );
        state.y.copy_from_slice(&radau.work.next);
        state.low.copy_from_slice(&radau.work.next_low);
        state.time = Time::of(f64::from(step) * h);
    }
    (state.y[0] - exact(3.0)).abs()
}

#[test]
fn the_order_of_a_step_is_the_declared_one() {
    for (stages, counts) in [(3, [16, 32, 64]), (5, [6, 9, 12])] {
        let declared = 2.0 * stages as f64 - 1.0;
        let errors = counts.map(|count| error(stages, count));
        let slope = (errors[0] / errors[2]).ln() / (f64::from(counts[2]) / f64::from(counts[0])).ln();
        assert!((slope - declared).abs() < 0.5, "order {slope}, declared {declared}: {errors:?}");
    }
}

/// A linear system whose fast mode dies at once: the method follows the slow one with long steps, and its
/// estimate sees no more.
#[test]
fn what_has_died_away_costs_nothing() {
    struct FastDecay;
    impl OdeSystem for FastDecay {
        fn dimension(&self) -> usize {
            2
        }
        fn angles(&self) -> usize {
            0
        }
        fn rhs(&mut self, _: Time, y: &[f64], rate: &mut [f64]) {
            rate.copy_from_slice(&[-y[0], -1e9 * (y[1] - y[0])]);
        }
        fn jacobian(&mut self, _: Time, _: &[f64], jacobian: &mut [f64]) -> bool {
            jacobian.copy_from_slice(&[-1.0, 0.0, 1e9, -1e9]);
            true
        }
        fn label(&self, i: usize) -> String {
            i.to_string()
        }
    }
    for stages in [3, 5] {
        let mut radau = Radau::new(stages, Tolerance { relative: 1e-8, absolute: 1e-8 }).expect("a method");
        let mut state = State { y: vec![1.0, 3.0], low: vec![0.0; 2], ..State::default() };
        let mut statistics = Statistics::default();
        let reached =
            radau.advance(&mut FastDecay, &mut state, Time::of(2.0), &mut statistics, &mut |_, _| {
                Ok(super::super::Seen::Kept)
            });
        assert_eq!(reached, Ok(crate::stepping::Reached::Until));
        let exact = (-2.0_f64).exp();
        assert!(state.y.iter().all(|y| (y - exact).abs() < 1e-7), "{:?}", state.y);
        assert!(statistics.steps < 200 && statistics.evaluations < 1500, "{statistics:?}");
    }
}
