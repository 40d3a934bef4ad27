//! The motion inside the last step of a loop.

use super::StepLoop;
use crate::dynamics::{Form, Motion, MotionPowers, Time};
use crate::run::observer::Inside;
use crate::stepping::Integrator;

impl<P: Form + Send + ?Sized, M: Integrator<P> + Send> Inside for StepLoop<P, M> {
    fn span(&self) -> (Time, Time) {
        (self.from.time, self.state.time)
    }

    fn at(&mut self, time: Time) -> &Motion {
        self.observe(time, M::interpolate)
    }

    fn roughly_at(&mut self, time: Time) -> &Motion {
        self.observe(time, M::interpolate_roughly)
    }

    fn coarsely_at(&mut self, time: Time) -> Option<&Motion> {
        let Self { problem, method, state, from, inside, observed, .. } = self;
        if time >= state.time || time <= from.time {
            return Some(self.at(time));
        }
        if !method.interpolate_coarsely(from, time, inside) {
            return None;
        }
        problem.read(inside, observed);
        Some(&self.observed)
    }

    fn landed(&mut self, time: Time) -> Option<&Motion> {
        let Self { problem, method, state, from, inside, observed, .. } = self;
        if time >= state.time || time <= from.time || !method.land(problem, from, time, inside) {
            return None;
        }
        problem.read(inside, observed);
        Some(&self.observed)
    }

    fn powers(&self, powers: &mut MotionPowers) -> bool {
        self.method.powers(powers)
    }
}
