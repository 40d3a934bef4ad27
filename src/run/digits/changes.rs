//! What acts on a motion in many digits changes: events switch parts and set parameters, formulas come to
//! their corners.
//!
//! What closes does so plastically, as in all methods (`run/closing.rs`): its points have to meet, a motor
//! and a lock without an angle go on from where they are, and the energy lost is booked with the event.

use super::branches::BranchConditions;
use super::confirm::Probe;
use super::coordinates::DigitsCoordinates;
use super::events::EventWatch;
use super::friction;
use super::functions::Functions;
use super::motion::{DigitsMotion, LongState, coordinates_of};
use super::projection::DigitsProjection;
use super::resting::{self, Unheld};
use super::wall;
use crate::arithmetic::digits::Digits;
use crate::arithmetic::shown::about;
use crate::arithmetic::{Real, Scalar};
use crate::dynamics::CompileError;
use crate::dynamics::compile::exact::{Acting, ExactMechanism};
use crate::dynamics::series::Series;
use crate::stepping::{Cause, StepError};

/// Part of the digits in which the laws of motors agree on both sides of a corner.
const SAME: f64 = 0.5;
/// How far apart what closes may be: angles \[rad\], and points over the size of the mechanism.
const MEETS: f64 = 1e-6;
/// How far behind a wall a point may be when it begins to stand in the way, over the size of the mechanism.
const BEHIND: f64 = 1e-9;

impl<const W: usize> DigitsMotion<W> {
    /// Lets no event end the motion; where none changes what acts, none is looked for.
    pub(super) fn ends_nowhere(&mut self) {
        let ExactMechanism { events, functions, .. } = &mut self.mechanism;
        events.iter_mut().for_each(|event| event.stop = false);
        if !events.iter().any(|event| event.changes) {
            events.clear();
            functions.clear();
            self.watch = EventWatch::default();
        }
    }

    /// Expands the state on the branches of formulas that hold there, and tells how long a step the series
    /// makes \[s\].
    pub(super) fn on_its_branches(&mut self) -> Result<f64, StepError> {
        let mut changes = 0;
        loop {
            let step = self.expanded()?;
            let Some(modes) = self.branches.others(self, step) else { return Ok(step) };
            if changes == BranchConditions::most(self) {
                return Err(BranchConditions::slides(self, &modes));
            }
            changes += 1;
            self.let_act(Acting { modes, ..self.state.acting.clone() })?;
        }
    }

    /// Lets an event take effect that changes what acts.
    pub(super) fn change(&mut self, event: usize) -> Result<(), StepError> {
        let DigitsCoordinates { phi, omega, .. } = self.state_coordinates();
        let acting = self.mechanism.after(event, self.state.t, &phi, &omega);
        self.let_act(acting)?;
        self.settle_modes_again()
    }

    /// Goes on with other parts acting, or on other branches; what that does to the energy is booked.
    fn let_act(&mut self, mut acting: Acting<Digits<W>>) -> Result<(), StepError> {
        let before = (self.state_coordinates(), self.energy());
        let walls: Vec<_> = self
            .mechanism
            .walls
            .iter()
            .map(|(row, _)| (self.is_off(row), row.law.clone(), row.aim.clone()))
            .collect();
        let unsuited = |motion: &Self, what: &str, hint: &str| motion.stop(Cause::Unsuited, 0.0, what, hint);
        let mechanism = self.mechanism.clone();
        self.exchange(&acting).map_err(|error| self.cannot_go_on(&error, "look at that formula"))?;
        let closing = self.mechanism.closing(&mechanism);
        if let Some(shifts) = self.engaged(&closing, &acting.shifts) {
            acting.shifts = shifts;
            self.exchange(&acting).map_err(|error| self.cannot_go_on(&error, "look at its law"))?;
        }
        self.state.acting = acting;
        // The next series is another one.
        self.state.radius = None;
        let mut gone = Vec::new();
        for (wall, ((was_off, law, aim), (row, _))) in
            walls.into_iter().zip(&self.mechanism.walls).enumerate()
        {
            let gap = wall::distance(self, row);
            let has_changed = was_off || law != row.law || aim != row.aim;
            if self.is_off(row) || has_changed && !self.follows(wall, gap) {
                gone.push(wall);
            }
            if has_changed
                && !self.is_off(row)
                && gap < Digits::of(-BEHIND * self.mechanism.structure.size_of_parts())
            {
                let does = if was_off { "switches on" } else { "moves" };
                let (name, by) = (&row.name, -gap.value());
                let what =
                    format!("an event {does} wall {name}, behind which its point is by {} m", about(by));
                let hint = "let the event be while the point is in front of it";
                return Err(unsuited(self, &what, hint));
            }
        }
        // What places with friction do is decided once all impulses have acted.
        if closing.is_empty() { self.let_go(&gone) } else { self.release(&gone) }?;
        let kept = self.kept(&closing);
        self.close(&closing)?;
        let after = self.state_coordinates();
        let apart = |(a, b): (&Digits<W>, &Digits<W>)| (*a - *b).log2() - a.log2().max(0.0);
        let moved = |a: &[Digits<W>], b: &[Digits<W>]| a.iter().zip(b).map(apart).fold(f64::MIN, f64::max);
        let turned = moved(&before.0.phi, &after.phi).max(moved(&before.0.omega, &after.omega));
        let jump = if closing.is_empty() { kept.max(turned) } else { kept };
        if jump > self.precision.rounding(SAME) {
            let what = format!("the law of a motor jumps by {:.1e}", libm::exp2(jump));
            return Err(unsuited(self, &what, "it must keep its value and its rate through its corners"));
        }
        self.state.jump_energy += self.energy() - before.1;
        Ok(())
    }

    /// An error where the mechanism has no equations with what acts next.
    pub(super) fn cannot_go_on(&self, error: &CompileError, hint: &str) -> StepError {
        self.stop(Cause::Unsuited, 0.0, &format!("the run cannot go on: {error}"), hint)
    }

    /// The mechanism where other parts act, or on other branches.
    pub(super) fn exchange(&mut self, acting: &Acting<Digits<W>>) -> Result<(), CompileError> {
        let mechanism = self.mechanism.with(acting.clone())?;
        let order = self.precision.order;
        let coordinates = coordinates_of(&mechanism);
        if coordinates != self.coordinates {
            // A point that stays on its wall needs all coordinates.
            let DigitsCoordinates { phi, omega, .. } = self.state_coordinates();
            self.coordinates = coordinates;
            let none = [vec![false; phi.len()], vec![false; phi.len()]];
            (self.state.u, self.state.rate) = self.independent(&phi, &omega, &none);
            self.zeros = vec![Digits::ZERO; self.state.u.len()];
        }
        self.series = Series::of_terms(&mechanism.terms(), self.coordinates, order);
        self.series.keep(self.kept.clone());
        self.series.resolve_reversals(self.precision.rounding(friction::SURE));
        self.probe = Probe::of(&mechanism, self.coordinates);
        self.watch = std::mem::take(&mut self.watch).renewed([&self.mechanism, &mechanism], order);
        self.branches = BranchConditions::new(Functions::new(&mechanism.conditions, order));
        self.projection = DigitsProjection::new(&mechanism, self.precision);
        self.mechanism = mechanism;
        Ok(())
    }

    /// The shifts with which those rows that close and are motors, or locks without an angle, go on from
    /// where they are; `None` where none of them is.
    fn engaged(&mut self, closing: &[usize], shifts: &[Digits<W>]) -> Option<Vec<Digits<W>>> {
        let clutches = &self.mechanism.structure.switches.clutches;
        let names = self.mechanism.constraints.iter().map(|row| clutches.contains(&row.name));
        let is_clutch: Vec<bool> = names.collect();
        let rows: Vec<usize> = closing.iter().copied().filter(|&r| is_clutch[r]).collect();
        if rows.is_empty() {
            return None;
        }
        let residuals = self.residuals();
        let mut shifts = shifts.to_vec();
        rows.into_iter().for_each(|r| shifts[r] += residuals[r]);
        Some(shifts)
    }

    /// What is left of every constraint equation \[rad, m\].
    fn residuals(&mut self) -> Vec<Digits<W>> {
        self.residuals_and_rates().into_iter().map(|residual| residual[0]).collect()
    }

    fn residuals_and_rates(&mut self) -> Vec<[Digits<W>; 2]> {
        let DigitsCoordinates { phi, omega, .. } = self.state_coordinates();
        self.projection.residuals(&self.mechanism, self.state.t, &phi, &omega)
    }

    /// log2 of the largest residual, or rate of one, of rows that were in force before.
    fn kept(&mut self, closing: &[usize]) -> f64 {
        let residuals = self.residuals_and_rates().into_iter().enumerate();
        let kept = residuals.filter(|(r, _)| !closing.contains(r)).flat_map(|(_, residual)| residual);
        kept.map(|residual| residual.log2()).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Lets those rows take hold that were not in force before.  Dry friction has no part in their impulses:
    /// what sticks may slide after them.
    fn close(&mut self, closing: &[usize]) -> Result<(), StepError> {
        if closing.is_empty() {
            return Ok(());
        }
        let (residuals, size) = (self.residuals(), self.mechanism.structure.size_of_parts());
        for &r in closing {
            let row = &self.mechanism.structure.constraints[r];
            let (off, unit) = (residuals[r].value(), if row.is_in_radians() { 1.0 } else { size });
            if off.is_nan() || off.abs() > MEETS * unit {
                let off = about(off);
                let what = format!("an event closes {}, which is off by {off} {}", row.name, row.unit());
                return Err(self.stop(Cause::Unsuited, 0.0, &what, "let the event be where it meets"));
            }
        }
        let Unheld { mechanism, mut projection } = loop {
            let mut unheld = Unheld::but_held(self)?;
            let LongState { t, u, rate, .. } = &self.state;
            let mut after = rate.clone();
            let (work, impulses) = unheld.projection.close(&unheld.mechanism, *t, u, &mut after);
            let most = impulses.iter().map(Digits::log2).fold(f64::NEG_INFINITY, f64::max);
            // A point that its wall would have to pull is let go.
            match resting::pulled(self, &impulses, most) {
                Some(pulled) => self.release(&[pulled])?,
                None => {
                    self.state.rate = after;
                    self.state.work += work;
                    self.state.jump_energy -= work;
                    break unheld;
                }
            }
        };
        let LongState { t, u, rate, .. } = &mut self.state;
        projection.project(&mechanism, *t, u, rate)?;
        // The rows of what sticks, which may slide now, come last.
        let rows = mechanism.structure.constraints.len();
        let rates = self.residuals_and_rates().into_iter().take(rows).map(|[_, rate]| rate.abs()).enumerate();
        let Some((worst, left)) = rates.max_by(|(_, a), (_, b)| a.log2().total_cmp(&b.log2())) else {
            return Ok(());
        };
        if left.log2() <= self.precision.rounding(SAME) {
            return Ok(());
        }
        let [row, closed] = [worst, closing[0]].map(|r| &self.mechanism.structure.constraints[r]);
        let left = about(left.value());
        let what = format!(
            "an event closes {}, and leaves constraint {} by {left} {}/s",
            closed.name,
            row.name,
            row.unit()
        );
        Err(self.stop(Cause::Unsuited, 0.0, &what, "change rates along what the constraints allow"))
    }

    /// Kinetic and potential energy of the state \[J\].
    pub(super) fn energy(&self) -> Digits<W> {
        let DigitsCoordinates { phi, omega, .. } = self.state_coordinates();
        let z = self.mechanism.elements(&phi);
        let [kinetic, potential] = self.mechanism.energy(&phi, &omega, &z);
        kinetic + potential
    }
}
