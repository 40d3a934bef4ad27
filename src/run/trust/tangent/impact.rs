//! Small differences of the tangent flow through impacts, events and the transitions of dry friction: see
//! [`saltation`](crate::run::saltation).

use super::TangentFlow;
use crate::dynamics::Coordinates;
use crate::run::contact::Jump;
use crate::run::saltation::{Delta, Discontinuity, cross, engage};
use std::sync::Arc;

impl TangentFlow {
    /// Tells the constraints which of them have engaged on the way.
    pub(super) fn hold_engaged(&mut self) {
        if let Some(ground) = &mut self.ground {
            ground.engaged.clone_from(&self.path.engaged);
        }
    }

    /// Takes impacts, holds and releases on the way to [`TangentFlow::next`], in their order.
    pub(in crate::run) fn jump(&mut self, jumps: &[Jump]) {
        for jumps in jumps.chunk_by(|one, other| one.before.time == other.before.time) {
            self.jump_at_once(jumps);
        }
    }

    /// Takes those of one moment.
    fn jump_at_once(&mut self, jumps: &[Jump]) {
        let ([first, ..], [.., last]) = (jumps, jumps) else { return };
        self.advance(first.before.time, None, 0.0);
        if self.path.lost.is_some() {
            return;
        }
        let n = self.mechanism.coordinates();
        let unknowns = 2 * self.weights.len();
        let spread = |column: &Vec<f64>| [&self.spread(column)[..], &column[unknowns..]].concat();
        let mut all: Vec<Vec<f64>> = self.path.columns.iter().chain(&self.path.inputs).map(spread).collect();
        if let Err(why) = self.cross(jumps, &mut all) {
            return self.lose(&why);
        }
        if !Arc::ptr_eq(&last.mechanism, &self.mechanism) {
            let mut path = std::mem::take(&mut self.path);
            engage(&mut path.engaged, [&self.mechanism, &last.mechanism]);
            match Self::bare(&last.mechanism) {
                Ok(other) => *self = Self { path, ..other },
                Err(why) => {
                    self.path = path;
                    return self.lose(&why);
                }
            }
            self.hold_engaged();
            self.path.held.clone_from(&self.mechanism.held);
        }
        if self.coordinates == Coordinates::Independent {
            let own = &self.mechanism.partition.independent;
            for column in &mut all {
                let moving = own.iter().copied().chain(own.iter().map(|&k| n + k));
                *column = moving.chain(2 * n..column.len()).map(|k| column[k]).collect();
            }
        }
        let inputs = all.split_off(self.path.columns.len());
        (self.path.columns, self.path.inputs) = (all, inputs);
        self.path.state = self.problem.state(&last.after);
        self.make_room();
        if let Err(why) = self.take_parameters() {
            return self.lose(&why);
        }
        self.keep();
        self.evaluate();
        if self.normalise() {
            self.path.moment = None;
            self.prepare();
        }
    }

    /// Takes columns of all coordinates, rates and parameters that events set through what happens at one
    /// moment.
    fn cross(&mut self, jumps: &[Jump], all: &mut [Vec<f64>]) -> Result<(), String> {
        let n = self.mechanism.coordinates();
        let moment = jumps.first().map(|jump| jump.before.time);
        let given: Vec<Vec<f64>> = all.iter().map(|column| column[2 * n..].to_vec()).collect();
        let passage = Discontinuity {
            mechanism: &self.mechanism,
            jumps,
            set: &self.set,
            follow: &|k, jump| self.neighbours_at(&jump.mechanism, &given[k]),
            earlier: self
                .path
                .moment
                .as_ref()
                .filter(|(at, _)| Some(*at) == moment)
                .map(|(_, late)| &late[..]),
        };
        let mut columns: Vec<Delta> = (all.iter_mut().zip(&given))
            .map(|(column, given)| Delta {
                entries: &mut column[..2 * n],
                neighbours: self.neighbours(given),
            })
            .collect();
        let passed = cross(&passage, &mut columns)?;
        self.path.moment = moment.zip((!passed.late.is_empty()).then_some(passed.late));
        let Some(set) = passed.set else { return Ok(()) };
        let drives = self.mechanism.laws.as_ref().is_some_and(|laws| laws.formulas.drives());
        if drives && set.iter().flatten().any(|slope| *slope != 0.0) {
            let what = "an event sets a parameter beside formulas of motors or walls, which neighbouring \
                motions set otherwise";
            return Err(what.into());
        }
        all.iter_mut().zip(set).for_each(|(column, set)| column[2 * n..].copy_from_slice(&set));
        Ok(())
    }
}
