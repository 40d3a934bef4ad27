//! Motions inside the step of a lane.

use super::passage::coordinates;
use super::{BatchMember, LaneKernel, read};
use crate::dynamics::{Motion, State, Time};

/// Room for a state inside a step, and what the coordinates are there.
#[derive(Default)]
pub(super) struct Interior {
    state: State,
    /// False until something is asked about a step.
    is_known: bool,
    /// Coordinates at the start \[rad, m\]; powers of their rates, and of the ways gone over the time that
    /// has passed, coordinate by coordinate; no coordinates where they are no polynomials.
    start: Vec<f64>,
    rates: Vec<f64>,
    ways: Vec<f64>,
}

/// A step of a lane: of which order, in which lane, from which time on.
#[derive(Clone, Copy)]
pub(super) struct InLane {
    pub order: usize,
    pub lane: usize,
    pub from: Time,
}

impl Interior {
    /// What is asked next is about another step.
    pub fn forget(&mut self) {
        self.is_known = false;
    }

    /// Writes the motion of a trajectory `after` \[s\] from where its step begins, by its series.
    pub fn look<T: LaneKernel>(
        &mut self,
        kernel: &T,
        member: &BatchMember,
        step: InLane,
        after: f64,
        motion: &mut Motion,
    ) {
        if !self.is_known {
            self.state.clone_from(&member.state);
            self.take_in(kernel, member, step);
            self.is_known = true;
        }
        let Self { state, start, rates, ways, .. } = self;
        state.low.fill(0.0);
        state.turns.copy_from_slice(&member.state.turns);
        let f = start.len();
        if f == 0 {
            kernel.inside(step.order, step.lane, after, member.mechanism, state);
        } else {
            let count = step.order + 1;
            for c in 0..f {
                let (rates, ways) = (&rates[c * count..(c + 1) * count], &ways[c * count..(c + 1) * count]);
                let (mut rate, mut way, mut k) = (0.0, 0.0, count);
                // Without iterators, which not every build puts in line.
                while k > 0 {
                    k -= 1;
                    rate = rate * after + rates[k];
                    way = way * after + ways[k];
                }
                (state.y[c], state.y[f + c]) = (start[c] + way * after, rate);
            }
        }
        state.time = step.from + after;
        state.wrap();
        read(member.mechanism, state, motion);
    }

    /// Writes the motion at the end of a step that was made, as the integration has it.
    pub fn end<T: LaneKernel>(
        &mut self,
        kernel: &T,
        member: &BatchMember,
        lane: usize,
        time: Time,
        motion: &mut Motion,
    ) {
        let state = &mut self.state;
        state.clone_from(&member.state);
        kernel.write_state(lane, state);
        state.time = time;
        state.wrap();
        read(member.mechanism, state, motion);
    }

    /// Takes the polynomials of a step.
    fn take_in<T: LaneKernel>(
        &mut self,
        kernel: &T,
        member: &BatchMember,
        InLane { order, lane, .. }: InLane,
    ) {
        let Self { start, rates, ways, .. } = self;
        let f = coordinates(member.mechanism);
        start.clear();
        rates.resize((order + 1) * f, 0.0);
        ways.resize((order + 1) * f, 0.0);
        for c in 0..f {
            let Some(place) = kernel.start_of(lane, c) else {
                start.clear();
                return;
            };
            start.push(place);
            for k in 0..=order {
                let power = kernel.power_of(lane, c, k);
                let at = c * (order + 1) + k;
                (rates[at], ways[at]) = (power, power / (k + 1) as f64);
            }
        }
    }
}
