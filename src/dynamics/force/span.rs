//! A spring's law that is a formula of its length, rate and time alone, kept as that formula.
//!
//! The tape of a [`UserForce`](super::UserForce) is one of points, which holds for any law.  Most springs
//! need no more of the motion than a built-in one does, and with its geometry cost little more:
//!
//! ```text
//! D = P_a - P_b, L = |D|:   F on a = -T(L, L', t) D / L,   T = dV/dL + tension,   power = -tension L'
//! ```
//!
//! Of the instructions of a whole run with a built-in spring a tension takes 1.6 times in `dp8`, where the
//! tape of points takes 2.2; `taylor` has lanes for it (`stepping/taylor/springs/law.rs`).

use crate::arithmetic::tape::{Slot, Symbol, Tape};
use crate::arithmetic::{Over, Real, Scalar};
use crate::dynamics::constraint::ConstraintArguments;
use crate::dynamics::point::Point;

/// Inputs of the tapes: length \[m\], its rate \[m/s\] and time \[s\].
pub const LENGTH: u32 = 0;
/// See [`LENGTH`].
pub const RATE: u32 = 1;
/// See [`LENGTH`].
pub const TIME: u32 = 2;

/// The law of a spring.
#[derive(Clone, Debug, PartialEq)]
pub struct SpanLaw<C = f64> {
    /// The span D = P_a - P_b.
    pub span: Point<C>,
    /// T, and what of it is no derivative of a potential \[N\].
    pub tape: Tape,
    /// T on the tape.
    pub tension: Slot,
    /// What has its work accounted for.
    pub applied: Option<Slot>,
    /// dT/dL \[N/m\], and its number on a tape of its own.
    slope: (Tape, Slot),
    /// True where the tape or the work asks for the rate.
    pub needs_rate: bool,
}

impl<C: Real> SpanLaw<C> {
    /// Records the law of a spring along `span`: its potential as a function of length, rate and time, and
    /// its tension beside that; neither may ask for anything else.
    pub fn record(
        span: Point<C>,
        potential: impl FnOnce([Symbol; 3]) -> Option<Symbol>,
        tension: impl FnOnce([Symbol; 3]) -> Option<Symbol>,
    ) -> Option<Self> {
        let (mut is_within, mut has_work) = (true, false);
        let [(tape, slots), slope] = Symbol::record(|| {
            let inputs = [LENGTH, RATE, TIME].map(Symbol::input);
            let (potential, applied) = match (potential(inputs), tension(inputs)) {
                (Some(potential), Some(applied)) => (potential, applied),
                _ => {
                    is_within = false;
                    (Symbol::ZERO, Symbol::ZERO)
                }
            };
            has_work = !applied.is_zero();
            let along = |of: Symbol| {
                let by = of.gradient().into_iter().filter(|(input, _)| *input == LENGTH);
                by.fold(Symbol::ZERO, |sum, (_, slope)| sum + slope)
            };
            let tension = along(potential) + applied;
            let work = has_work.then_some(applied);
            [std::iter::once(tension).chain(work).collect(), vec![along(tension)]]
        });
        let needs_rate = has_work || tape.inputs().any(|input| input == RATE);
        let applied = slots.get(1).copied();
        is_within.then(|| Self {
            span,
            tension: slots[0],
            applied,
            tape,
            slope: (slope.0, slope.1[0]),
            needs_rate,
        })
    }

    /// True where time is in it.
    pub fn depends_on_time(&self) -> bool {
        self.tape.inputs().any(|input| input == TIME)
    }

    /// dT/dL \[N/m\] at a length \[m\] and rate \[m/s\], where time is not in it.
    pub fn slope(&self, length: f64, rate: f64) -> f64 {
        let (tape, slot) = &self.slope;
        tape.results(|input| if input == LENGTH { length } else { rate }, |slots| slots[*slot as usize])
    }

    /// T where the ends meet at rest \[N\], at time zero.
    pub fn tension_without_length(&self) -> f64 {
        self.tape.results(|_| 0.0, |slots| slots[self.tension as usize])
    }

    /// Adds the generalized forces \[N·m, N\]; returns the power accounted as work \[W\].
    #[inline]
    pub fn pull<T: Over<C>>(&self, time: T, at: ConstraintArguments<T>, load: &mut [T]) -> T {
        let span = self.span.position(at.z);
        let length = span.norm_squared().sqrt();
        let rate = match self.needs_rate {
            true => span.dot(self.span.velocity(at.z, at.omega)) / length,
            false => T::ZERO,
        };
        let input = |input: u32| match input {
            LENGTH => length,
            RATE => rate,
            _ => time,
        };
        self.tape.results(input, |slots| {
            let pull = -(slots[self.tension as usize] / length);
            self.span.pull(span.times(pull), at.z, load);
            self.applied.map_or(T::ZERO, |slot| -(slots[slot as usize] * rate))
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::arithmetic::Complex;
    use crate::dynamics::constraint::ConstraintArguments;
    use crate::dynamics::{Mechanism, force::UserForce};
    use crate::scene::parse_scene;

    fn law(law: &str) -> UserForce {
        let text = format!(
            r#"{{"name": "s", "gravity": [0, 0], "parameters": {{"k": 7.3}}, "signals": {{"tilt": "b.phi"}},
            "bars": [{{"name": "a", "mass": 1, "centre": [0.3, 0], "inertia": 0.1}}, {{"name": "b", "mass": 1,
             "centre": [0.2, 0.1], "inertia": 0.1}}],
            "hinges": [{{"name": "A", "between": [{{"body": "ground", "point": [0, 0]}}, {{"body": "a",
             "point": [0, 0]}}]}},
                {{"name": "B", "between": [{{"body": "a", "point": [0.6, 0]}}, {{"body": "b",
                 "point": [0, 0]}}]}}],
            "springs": [{{"name": "s", "between": [{{"body": "ground", "point": [-0.4, 0.7]}}, {{"body": "b",
             "point": [0.4, 0.2]}}], {law}}}],
            "start": {{"a": {{"phi": 0.3, "omega": 0}}, "b": {{"phi": 1, "omega": 0}}}}, "until": 1,
             "every": 1}}"#
        );
        let scene = parse_scene(&text, "test", &[]).unwrap_or_else(|error| panic!("{error}"));
        Mechanism::new(&scene).expect("equations").forces[0].clone()
    }

    #[test]
    fn the_law_over_the_length_is_that_over_the_points() {
        let laws = [
            r#""tension": "k*(length - 0.4)""#,
            r#""potential": "0.5*k*(length - 0.4)^2""#,
            r#""tension": "0.3*rate + 0.1*sin(3*t)", "potential": "1*(1*length^4 + exp(-1*length))""#,
            r#""tension": "1*(1*length*rate*tanh(1*rate) - 1*sqrt(length)*log(1 + 1*length))""#,
        ];
        for text in laws {
            let force = law(text);
            assert!(force.span.is_some(), "{text}");
            let points = UserForce { span: None, ..force.clone() };
            for i in 0..40 {
                let of = |shift: f64| (shift + 1.7 * f64::from(i)).sin() * 3.0;
                let (phi, omega) = ([of(0.3), of(1.1)], [of(2.3), of(0.7)]);
                let z = phi.map(Complex::unit);
                let at = ConstraintArguments { phi: &phi, z: &z, omega: &omega };
                let (mut found, mut expected) = ([0.0; 2], [0.0; 2]);
                let time = 0.37 * f64::from(i);
                let powers = [force.pull(time, at, &mut found), points.pull(time, at, &mut expected)];
                for (a, b) in found.iter().zip(&expected).chain([(&powers[0], &powers[1])]) {
                    assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{text}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn what_asks_for_more_has_no_law_over_the_length() {
        for text in [r#""tension": "1*length + 1*a.omega""#, r#""tension": "1*length + 1*tilt""#] {
            assert!(law(text).span.is_none(), "{text}");
        }
    }
}
