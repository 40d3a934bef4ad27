//! The motion inside the last step of a loop.

use super::StepLoop;
use crate::dynamics::{Form, Motion, MotionPowers, Time};
use crate::run::monitor::Monitor;
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

impl<P: Form + Send + ?Sized, M: Integrator<P> + Send> StepLoop<P, M> {
    /// Shows the motion of the last step to a monitor where it is due.
    pub(super) fn show(&mut self, monitor: &mut dyn Monitor) {
        let Self { problem, method, state, from, inside, observed, statistics, is_dense, .. } = self;
        while monitor.due() <= state.time.hi {
            if *is_dense && monitor.due() > from.time.hi && monitor.due() < state.time.hi {
                method.interpolate(problem, from, Time::from(monitor.due()), inside);
                problem.read(inside, observed);
            } else {
                problem.read(state, observed);
            }
            monitor.observe(observed, *statistics);
        }
    }
}
