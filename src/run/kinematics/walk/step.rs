//! One step of a walk, and how far it may be.

use super::{DriveWalk, coordinate};
use crate::arithmetic::Scalar;
use crate::dynamics::Time;
use crate::run::kinematics::independence::{ACROSS, Independence};
use std::sync::Arc;

/// The solution may differ from what was predicted by this \[rad, units of length\], and by this share of the
/// way there: else it may be on another branch.
const APART: [f64; 2] = [0.02, 0.1];
/// No coordinate that G depends on goes farther in one step \[rad, units of length\].
const LONGEST: f64 = 0.25;

impl DriveWalk {
    /// Steps to another time, from a position of which `here` is known, and gives the same of the other.
    ///
    /// # Errors
    /// The solution there is not on this branch for certain; this is still here then.
    pub(super) fn step(&mut self, t: f64, here: Option<&Independence>) -> Result<Option<Independence>, ()> {
        let (n, h) = (self.alpha.len(), t - self.state.time.hi);
        // The parabola must not turn back within the step: eight times as far from a fold as this is, it
        // would come to the other branch.
        if self.fastest_coordinate().is_some_and(|k| (0.5 * h * self.alpha[k]).abs() > self.omega(k).abs()) {
            return Err(());
        }
        let is_across = h.abs() * self.fastest_of_jacobian() <= 2.01 * ACROSS;
        let branch = Arc::clone(&self.mechanism);
        self.before.clone_from(&self.state);
        self.state.time = Time::of(t);
        for k in 0..n {
            let (omega, alpha) = (self.state.y[n + k], self.alpha[k]);
            self.state.y[k] += h * (omega + 0.5 * h * alpha);
            self.state.y[n + k] += h * alpha;
        }
        self.state.low.fill(0.0);
        for k in 0..n {
            self.predicted[k] = self.coordinate(k);
            self.predicted[n + k] = self.omega(k);
        }
        let is_settled = self.settle().is_ok();
        let is_at_corner = !Arc::ptr_eq(&branch, &self.mechanism);
        if is_settled && self.is_as_predicted(h, is_at_corner, is_across) {
            let there = self.independence();
            if is_across || here.zip(there.as_ref()).is_none_or(|(here, there)| there.follows(here, h)) {
                return Ok(there);
            }
        }
        self.state.clone_from(&self.before);
        self.stand();
        Err(())
    }

    /// True where the solution, a step of `h` on, is near what was predicted, and so are its rates: these
    /// differ by three times as much over the step where positions differ by a term in h³.  Where laws came
    /// to a corner rates jump, and on a step as short as that across a crossing positions may differ by as
    /// much as that is.  What G does not depend on goes with the others.  The drive's value is rounded, and
    /// with it how far others are that are faster.
    fn is_as_predicted(&self, h: f64, is_at_corner: bool, is_across: bool) -> bool {
        let n = self.alpha.len();
        let (mut apart, mut way) = (0.0_f64, 0.0_f64);
        for k in (0..n).filter(|&k| self.is_in_jacobian[k]) {
            let (here, size) = (self.coordinate(k), self.size(k));
            let off = (here - self.predicted[k]).abs();
            let jump = (h * (self.omega(k) - self.predicted[n + k])).abs();
            let off = match (is_at_corner, is_across) {
                (false, _) => off.max(jump / 3.0),
                (true, false) => off,
                (true, true) => off - jump,
            };
            apart = apart.max(off / size);
            way = way.max((here - coordinate(&self.before, k)).abs() / size);
        }
        let rounding = 1e-12 + 1e-15 * self.fastest() / self.drive_rate();
        apart <= APART[0] && apart <= APART[1] * way + rounding
    }

    /// The longest step that may be tried from here, where this is known of the position.
    pub(super) fn reach(&self, here: Option<&Independence>) -> f64 {
        let fastest = self.fastest_of_jacobian();
        here.map_or(f64::INFINITY, |here| here.reach(fastest)).min(LONGEST / fastest)
    }
}
